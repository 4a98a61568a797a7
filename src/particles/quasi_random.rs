//! Quasi-random sets: a Kronecker sequence with the generalized golden ratio.

use super::Particles;
use super::random::{Random, unit};
use crate::error::Result;

impl<const D: usize> Particles<D> {
    /// N particles of low discrepancy, without the pattern of a lattice: in the unit cube
    /// x_i = frac(s + i alpha), alpha_a = phi^-a for axis a = 1..D, where phi > 1 solves phi^(D+1) = phi + 1.
    ///
    /// The shift s is drawn from the seed. A radical inverse in base 2 would be a lattice at N = 2^k in one dimension;
    /// the gaps of this sequence always have two or three different lengths. The sequence runs in 64-bit fixed point,
    /// so that its accuracy does not depend on i. Volumes: equal, box volume / N.
    ///
    /// # Errors
    /// As [`lattice`](Self::lattice).
    ///
    /// Source: Roberts 2018, "The unreasonable effectiveness of quasirandom sequences" (phi = 1.618 for D = 1,
    /// 1.3247 for D = 2); the shift is ours.
    pub fn quasi_random(lower: [f64; D], upper: [f64; D], count: usize, seed: u64) -> Result<Self> {
        let phi = generalized_golden_ratio(D);
        let mut power = 1.0;
        let steps: [u64; D] = std::array::from_fn(|_| {
            power /= phi;
            (power * 2.0_f64.powi(64)) as u64
        });
        let mut random = Random::new(seed);
        let mut state: [u64; D] = std::array::from_fn(|_| random.bits());
        Self::in_box(lower, upper, count, |axis| {
            state[axis] = state[axis].wrapping_add(steps[axis]);
            unit(state[axis])
        })
    }
}

/// The root phi > 1 of phi^(D+1) = phi + 1, by Newton's method from above, with exactly rounded operations only.
fn generalized_golden_ratio(dimensions: usize) -> f64 {
    let mut phi = 2.0_f64;
    for _ in 0..64 {
        let power = (0..dimensions).fold(1.0, |power, _| power * phi);
        phi -= (power * phi - phi - 1.0) / ((dimensions as f64 + 1.0) * power - 1.0);
    }
    phi
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn golden_ratios_solve_their_equation() {
        // One Newton step from the root moves it by less than a few roundings of phi^(D+1) <= 3.
        const TOLERANCE: f64 = 8.0 * f64::EPSILON;
        for dimensions in 1..=6 {
            let phi = generalized_golden_ratio(dimensions);
            assert!((phi.powi(dimensions as i32 + 1) - phi - 1.0).abs() <= TOLERANCE, "{dimensions}: {phi}");
        }
        assert!((generalized_golden_ratio(1) - 0.5 * (1.0 + 5.0_f64.sqrt())).abs() <= TOLERANCE);
    }
}
