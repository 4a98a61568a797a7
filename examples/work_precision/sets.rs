//! The particle sets on the unit torus, with volumes and a spacing for each particle.

use std::f64::consts::TAU;

use parops::{Particles, Random, Volumes};

const SEED: u64 = 7;
/// Largest displacement from the lattice in units of its spacing.
const JITTER: f64 = 0.3;
/// Spacings of a clustered set vary along an axis by (1 + a) / (1 - a) = 4.
const CLUSTER: f64 = 0.6;

/// How particles are placed.
#[derive(Clone, Copy, PartialEq)]
pub enum Set {
    Lattice,
    Jittered,
    QuasiRandom,
    Clustered,
}

impl Set {
    pub const ALL: [Self; 4] = [Self::Lattice, Self::Jittered, Self::QuasiRandom, Self::Clustered];

    pub fn name(self) -> &'static str {
        match self {
            Self::Lattice => "lattice",
            Self::Jittered => "jittered",
            Self::QuasiRandom => "quasi-random",
            Self::Clustered => "clustered",
        }
    }

    /// `side`^D particles with volumes that add up to 1, and their spacings V_p^(1/D).
    pub fn particles<const D: usize>(self, side: usize) -> parops::Result<(Particles<D>, Vec<f64>)> {
        let jittered = || Particles::jittered([0.0; D], [1.0; D], [side; D], JITTER, SEED);
        let count = side.pow(D as u32);
        let (points, stretch) = match self {
            Self::Lattice => (Particles::lattice([0.0; D], [1.0; D], [side; D])?.points().to_vec(), None),
            Self::Jittered => (jittered()?.points().to_vec(), None),
            Self::QuasiRandom => (halton(count), None),
            Self::Clustered => {
                // s -> s + a sin(2 pi s) / (2 pi) maps the torus onto itself, by 1 + a cos(2 pi s) along each axis.
                let places = jittered()?.points().to_vec();
                let stretch: Vec<f64> =
                    places.iter().map(|s| s.iter().map(|s| 1.0 + CLUSTER * (TAU * s).cos()).product()).collect();
                let moved = places.iter().map(|s| s.map(|s| s + CLUSTER * (TAU * s).sin() / TAU)).collect();
                (moved, Some(stretch))
            }
        };
        let stretch = stretch.unwrap_or_else(|| vec![1.0; count]);
        let sum: f64 = stretch.iter().sum();
        let volumes: Vec<f64> = stretch.iter().map(|stretch| stretch / sum).collect();
        let spacings = volumes.iter().map(|volume| volume.powf(1.0 / D as f64)).collect();
        Ok((Particles::new(points)?.with_volumes(Volumes::each(volumes)?)?, spacings))
    }
}

/// Halton points, the radical inverses of 1, 2, ... in bases 2, 3 and 5, shifted at random on the torus.
fn halton<const D: usize>(count: usize) -> Vec<[f64; D]> {
    let mut random = Random::new(SEED);
    let shift: [f64; D] = std::array::from_fn(|_| random.uniform());
    let inverse = |mut i: usize, base: usize| {
        let (mut value, mut digit) = (0.0, 1.0);
        while i > 0 {
            digit /= base as f64;
            value += digit * (i % base) as f64;
            i /= base;
        }
        value
    };
    (1..=count).map(|i| std::array::from_fn(|axis| (inverse(i, [2, 3, 5][axis]) + shift[axis]).fract())).collect()
}
