//! The norm of an inverse, estimated from solves.

use crate::error::Result;

/// Vertices visited from one start at most.
const VERTICES: usize = 4;

/// Estimates |A^-1|_1 from solves: `solve(x, false)` overwrites x with A^-1 x, `solve(x, true)` with A^-T x.
///
/// A lower bound. The gradient of the convex |A^-1 x|_1 leads from vertex to vertex of the unit ball, from the mean of
/// all vertices and from a vector of growing entries with alternating signs, which sees what the mean does not.
///
/// Source: W. W. Hager, 1984; N. J. Higham, 1988, algorithm 4.1, where the second vector is no start but a guard.
pub(super) fn inverse_norm(n: usize, mut solve: impl FnMut(&mut [f64], bool) -> Result<()>) -> Result<f64> {
    let mut x = vec![0.0; n];
    let mut estimate = 0.0_f64;
    let step = 1.0 / (n.max(2) - 1) as f64;
    let mean = |_: usize| 1.0;
    let alternating = |i: usize| (1.0 + i as f64 * step) * if i.is_multiple_of(2) { 1.0 } else { -1.0 };
    for start in [&mean as &dyn Fn(usize) -> f64, &alternating] {
        x.iter_mut().enumerate().for_each(|(i, x)| *x = start(i));
        let length = sum_abs(&x);
        x.iter_mut().for_each(|x| *x /= length);
        let (mut climbed, mut vertex) = (0.0, None);
        for _ in 0..=VERTICES {
            solve(&mut x, false)?;
            let found = sum_abs(&x);
            if !found.is_finite() {
                return Ok(f64::INFINITY);
            }
            if found <= climbed {
                break;
            }
            climbed = found;
            x.iter_mut().for_each(|x| *x = 1.0_f64.copysign(*x));
            solve(&mut x, true)?;
            let best = (0..n).max_by(|&i, &j| x[i].abs().total_cmp(&x[j].abs()));
            if vertex == best {
                break;
            }
            vertex = best;
            x.fill(0.0);
            best.into_iter().for_each(|best| x[best] = 1.0);
        }
        estimate = estimate.max(climbed);
    }
    Ok(estimate)
}

fn sum_abs(x: &[f64]) -> f64 {
    x.iter().fold(0.0, |sum, x| sum + x.abs())
}
