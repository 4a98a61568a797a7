//! Scattered particles in the disc and in the ball of radius 1/2 around 0, some of them exactly on the boundary.

use std::f64::consts::{PI, TAU};

use parops::{BoundaryCondition, Particles, Random};

const RADIUS: f64 = 0.5;
/// Largest displacement along an axis of inner particles from a lattice, in units of h.
const JITTER: f64 = 0.2;
/// Their least distance from the boundary, in units of h.
const CLEAR: f64 = 0.5;
const SEED: u64 = 11;

/// Particles, those on the boundary behind all others.
pub struct Round<const D: usize> {
    pub h: f64,
    pub particles: Particles<D>,
    /// The boundary particles with their outward unit normals.
    pub boundary: Vec<(usize, [f64; D])>,
}

impl<const D: usize> Round<D> {
    /// A jittered lattice of n + 1 points an axis, and a boundary particle in the direction of each normal.
    fn new(n: usize, normals: impl Iterator<Item = [f64; D]>) -> parops::Result<Self> {
        let h = 2.0 * RADIUS / n as f64;
        let mut random = Random::new(SEED);
        let mut points = Vec::new();
        for number in 0..(n + 1).pow(D as u32) {
            let x: [f64; D] = std::array::from_fn(|axis| {
                let i = number / (n + 1).pow(axis as u32) % (n + 1);
                h * (i as f64 + JITTER * (2.0 * random.uniform() - 1.0)) - RADIUS
            });
            if x.iter().map(|x| x * x).sum::<f64>().sqrt() <= RADIUS - CLEAR * h {
                points.push(x);
            }
        }
        let boundary: Vec<_> = (points.len()..).zip(normals).collect();
        points.extend(boundary.iter().map(|(_, normal)| normal.map(|n| RADIUS * n)));
        Ok(Self { h, particles: Particles::new(points)?, boundary })
    }

    /// What is given at each boundary particle.
    pub fn conditions(&self) -> Vec<BoundaryCondition<D>> {
        let condition = |&(p, normal): &(usize, [f64; D])| {
            if gives_value(&normal) { BoundaryCondition::dirichlet(p) } else { BoundaryCondition::neumann(p, normal) }
        };
        self.boundary.iter().map(condition).collect()
    }
}

/// Whether u is given in the direction of this normal, or else du/dn: on the sphere and on half of the circle.
pub fn gives_value<const D: usize>(normal: &[f64; D]) -> bool {
    D > 2 || normal[1] > 0.0
}

/// n particles across; those on the circle are h apart.
pub fn disc(n: usize) -> parops::Result<Round<2>> {
    let count = (PI * n as f64).round() as usize;
    let angle = move |i: usize| TAU * i as f64 / count as f64;
    Round::new(n, (0..count).map(|i| [angle(i).cos(), angle(i).sin()]))
}

/// n particles across; those on the sphere lie on a spiral, each with the area h^2.
pub fn ball(n: usize) -> parops::Result<Round<3>> {
    let count = (PI * (n * n) as f64).round() as usize;
    let golden = PI * (3.0 - 5.0_f64.sqrt());
    let normal = |i: usize| {
        let z = 1.0 - (2 * i + 1) as f64 / count as f64;
        let (across, (sin, cos)) = ((1.0 - z * z).sqrt(), (golden * i as f64).sin_cos());
        [across * cos, across * sin, z]
    };
    Round::new(n, (0..count).map(normal))
}
