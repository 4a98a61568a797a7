//! Particle sets: positions, and volumes where a method needs them.

mod generate;
mod quasi_random;
mod random;
mod spacing;
mod volumes;

pub use random::Random;

use std::sync::atomic::{AtomicU64, Ordering};

use crate::error::{ParticleError, Result};
use crate::scale::Volumes;

/// Largest legal magnitude of a coordinate, 2^160: sums of squares of separations stay far from overflow.
pub const COORDINATE_HIGH: f64 = f64::from_bits((1023 + 160) << 52);

/// Largest legal number of particles: indices are 32 bits wide and the last one is kept for "none".
pub const PARTICLES_HIGH: usize = u32::MAX as usize - 1;

/// Particles at points x_p in D dimensions, with volumes V_p if they were given.
///
/// The set owns its points. Its [`generation`](Self::generation) is unique to these points: providers and rows
/// remember it, so that stale ones are found. An empty set is legal, and so are coincident particles.
///
/// ```
/// use parops::Particles;
/// let particles = Particles::lattice([0.0], [1.0], [4])?;
/// assert_eq!(particles.points(), [[0.125], [0.375], [0.625], [0.875]]);
/// assert_eq!(particles.volumes()?.get(0)?, 0.25);
/// # parops::Result::Ok(())
/// ```
#[derive(Clone, Debug)]
pub struct Particles<const D: usize> {
    points: Vec<[f64; D]>,
    volumes: Option<Volumes>,
    generation: u64,
}

impl<const D: usize> Particles<D> {
    /// Particles at these points, without volumes.
    ///
    /// # Errors
    /// [`ParticleError::Coordinate`] where a coordinate is not finite,
    /// [`ParticleError::Range`] where its magnitude is above [`COORDINATE_HIGH`],
    /// [`ParticleError::TooMany`] for more than [`PARTICLES_HIGH`] points.
    pub fn new(points: Vec<[f64; D]>) -> Result<Self> {
        check_count(points.len(), PARTICLES_HIGH)?;
        check_points(&points)?;
        Ok(Self { points, volumes: None, generation: next_generation() })
    }

    /// The points x_p.
    pub fn points(&self) -> &[[f64; D]] {
        &self.points
    }

    /// Number of particles N.
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// Whether there is no particle.
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// A stamp no other points of this process have; clones share it until one of them moves.
    pub fn generation(&self) -> u64 {
        self.generation
    }

    /// Moves the particles to these points: copies them and takes a new generation. Volumes stay as they are.
    ///
    /// # Errors
    /// As [`new`](Self::new), and [`ParticleError::Length`] for another number of points.
    pub fn set_points(&mut self, points: &[[f64; D]]) -> Result<()> {
        if points.len() != self.len() {
            return Err(ParticleError::Length { found: points.len(), needed: self.len() }.into());
        }
        check_points(points)?;
        self.points.copy_from_slice(points);
        self.generation = next_generation();
        Ok(())
    }
}

fn next_generation() -> u64 {
    static NEXT: AtomicU64 = AtomicU64::new(1);
    NEXT.fetch_add(1, Ordering::Relaxed)
}

/// Refuses more particles than `limit`.
pub(crate) fn check_count(count: usize, limit: usize) -> Result<()> {
    if count > limit { Err(ParticleError::TooMany { count, limit }.into()) } else { Ok(()) }
}

/// Refuses coordinates that are not finite or out of the legal range, naming the point.
pub(crate) fn check_points<const D: usize>(points: &[[f64; D]]) -> Result<()> {
    for (p, point) in points.iter().enumerate() {
        for (axis, &coordinate) in point.iter().enumerate() {
            if !coordinate.is_finite() {
                return Err(crate::error::Error::from(ParticleError::Coordinate { axis, coordinate }).at(p));
            }
            if coordinate.abs() > COORDINATE_HIGH {
                let kind = ParticleError::Range { axis, value: coordinate, high: COORDINATE_HIGH };
                return Err(crate::error::Error::from(kind).at(p));
            }
        }
    }
    Ok(())
}

/// An empty vector with room for `count` entries.
pub(crate) fn reserved<T>(count: usize) -> Result<Vec<T>> {
    let mut entries = Vec::new();
    entries.try_reserve_exact(count).map_err(|_| ParticleError::Memory { count })?;
    Ok(entries)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::Error;

    #[test]
    fn particle_count_beyond_the_index_type_is_refused() {
        assert_eq!(check_count(255, 255), Ok(()));
        assert_eq!(check_count(256, 255), Err(Error::from(ParticleError::TooMany { count: 256, limit: 255 })));
    }

    #[test]
    fn memory_that_cannot_be_had_is_an_error() {
        let count = usize::MAX / 16;
        assert_eq!(reserved::<u64>(count).map(|_| ()), Err(Error::from(ParticleError::Memory { count })));
    }
}
