//! Ready-made sets in a box: lattice, jittered lattice, random.

use super::random::Random;
use super::{PARTICLES_HIGH, Particles, check_count, reserved};
use crate::domain::{Domain, Face};
use crate::error::{ParticleError, Result};

impl<const D: usize> Particles<D> {
    /// A lattice, x = lower + (i + 1/2) h with h = (upper - lower) / counts axis by axis, the last axis fastest.
    ///
    /// Particles stand in the middle of their cells, so that V = h^D (the product of the h_i) is consistent with the
    /// spacing. Volumes: equal, box volume / N. A count of zero gives the empty set.
    ///
    /// # Errors
    /// [`DomainError`](crate::DomainError) as [`Domain::new`] for an illegal or infinite box,
    /// [`ParticleError::TooMany`] for more than [`PARTICLES_HIGH`] particles,
    /// [`ParticleError::Memory`] where they do not fit into memory.
    ///
    /// Source: notes 001, sec. 5.2.1 with errata 16.
    pub fn lattice(lower: [f64; D], upper: [f64; D], counts: [usize; D]) -> Result<Self> {
        Self::on_lattice(lower, upper, counts, || 0.0)
    }

    /// A lattice whose particles are displaced by up to `amount` h along every axis, uniformly in [-amount, amount) h.
    ///
    /// `amount` is in units of h, from 0 to 1/2, so that every particle stays in its cell.
    /// Volumes: equal, box volume / N.
    ///
    /// # Errors
    /// As [`lattice`](Self::lattice), and [`ParticleError::Jitter`] for an amount outside 0 to 1/2.
    pub fn jittered(lower: [f64; D], upper: [f64; D], counts: [usize; D], amount: f64, seed: u64) -> Result<Self> {
        const HIGH: f64 = 0.5;
        if !(0.0..=HIGH).contains(&amount) {
            return Err(ParticleError::Jitter { amount, high: HIGH }.into());
        }
        let mut random = Random::new(seed);
        Self::on_lattice(lower, upper, counts, || amount * (2.0 * random.uniform() - 1.0))
    }

    /// N particles placed independently and uniformly. Volumes: equal, box volume / N.
    ///
    /// # Errors
    /// As [`lattice`](Self::lattice).
    pub fn random(lower: [f64; D], upper: [f64; D], count: usize, seed: u64) -> Result<Self> {
        let mut random = Random::new(seed);
        Self::in_box(lower, upper, count, |_| random.uniform())
    }

    /// Calls `unit(axis)` for the coordinates of each point in the unit cube, particle by particle.
    pub(super) fn in_box(
        lower: [f64; D],
        upper: [f64; D],
        count: usize,
        mut unit: impl FnMut(usize) -> f64,
    ) -> Result<Self> {
        let volume = finite_box(lower, upper)?.volume();
        check_count(count, PARTICLES_HIGH)?;
        let mut points = reserved(count)?;
        for _ in 0..count {
            points.push(std::array::from_fn(|axis| {
                (lower[axis] + unit(axis) * (upper[axis] - lower[axis])).clamp(lower[axis], upper[axis])
            }));
        }
        Self::new(points)?.with_equal_volumes(volume)
    }

    fn on_lattice(
        lower: [f64; D],
        upper: [f64; D],
        counts: [usize; D],
        mut displacement: impl FnMut() -> f64,
    ) -> Result<Self> {
        let product = counts.iter().try_fold(1_usize, |product, &count| product.checked_mul(count));
        let count = product.unwrap_or(if counts.contains(&0) { 0 } else { usize::MAX });
        let spacings: [f64; D] = std::array::from_fn(|axis| (upper[axis] - lower[axis]) / counts[axis] as f64);
        let volume = finite_box(lower, upper)?.volume();
        check_count(count, PARTICLES_HIGH)?;
        let mut points = reserved(count)?;
        let mut index = [0_usize; D];
        for _ in 0..count {
            points.push(std::array::from_fn(|axis| {
                let place = lower[axis] + (index[axis] as f64 + 0.5 + displacement()) * spacings[axis];
                place.clamp(lower[axis], upper[axis])
            }));
            for axis in (0..D).rev() {
                index[axis] += 1;
                if index[axis] < counts[axis] {
                    break;
                }
                index[axis] = 0;
            }
        }
        Self::new(points)?.with_equal_volumes(volume)
    }
}

/// The box, refused where it has no finite volume to spread particles over.
fn finite_box<const D: usize>(lower: [f64; D], upper: [f64; D]) -> Result<Domain<D>> {
    // An even mirror may not lie at infinity, which an open face may.
    Domain::new(lower, upper, [[Face::MirrorEven; 2]; D])
}
