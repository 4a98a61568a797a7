//! Whether the rows of a diffusion term are symmetric, from what they make of two fields.

use super::fields::Fields;
use crate::particles::Random;
use crate::time::RowSymmetry;

/// Rounding of a row, in eps of its terms; rows of DC-PSE miss symmetry by percents.
const ROUNDING: f64 = 1e3;

/// Two pseudo-random fields of this many particles.
pub(super) fn probes<E: Fields>(particles: usize) -> [Vec<E>; 2] {
    let mut random = Random::new(1);
    [(); 2].map(|()| {
        let mut one = || {
            let mut u = E::ZERO;
            u.set(0, random.uniform() - 0.5);
            u
        };
        (0..particles).map(|_| one()).collect()
    })
}

/// Whether V_p w_pq = V_q w_qp, from the images of [`probes`].
///
/// The terms of sum_p V_p (a_p (A b)_p - b_p (A a)_p) have random signs: what asymmetry leaves of them is measured by the
/// root of the sum of their squares, whatever the number of particles.
pub(super) fn symmetry<E: Fields>(
    [a, b]: &[Vec<E>; 2],
    [of_a, of_b]: &[Vec<E>; 2],
    volume: impl Fn(usize) -> f64,
) -> RowSymmetry {
    let (mut defect, mut squares) = (0.0, 0.0);
    for (p, ((a, b), (of_a, of_b))) in a.iter().zip(b).zip(of_a.iter().zip(of_b)).enumerate() {
        let [ab, ba] = [(a, of_b), (b, of_a)].map(|(u, image)| volume(p) * u.get(0) * image.get(0));
        defect += ab - ba;
        squares += (ab.abs() + ba.abs()).powi(2);
    }
    let symmetric = defect.abs() <= ROUNDING * E::EPSILON * f64::sqrt(squares);
    if symmetric { RowSymmetry::Symmetric } else { RowSymmetry::General }
}
