//! Householder QR of the windowed Vandermonde matrix: the conditions without squaring their condition number.
//!
//! Windows let the rows of B span many decades, and only with the heavy rows first is QR exact row by row.
//!
//! Source: A. J. Cox and N. J. Higham, Stability of Householder QR factorization for weighted least squares problems,
//! 1998, sec. 3.

use std::cmp::Ordering;

use super::solver::{MomentScratch, MomentSolver, Rung, Solution, condition, worst};
use super::system::{MomentSystem, Residual};
use crate::error::{OperatorError, Result};
use crate::scalar::Scalar;

/// Householder QR of B, w = E Q R^-T b, and one step with the residual taken from B. Keeps the digits that A = B^T B
/// loses, and what a row misses does not grow with its neighbors.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Qr;

/// QR of B with column pivoting and a rank decision: solves the conditions that the stencil can tell apart, and leaves
/// it to the residual whether the others hold too.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PivotedQr;

impl MomentSolver for Qr {
    fn solve<T: Scalar, const D: usize>(
        &self,
        system: &MomentSystem<T, D>,
        scratch: &mut MomentScratch<T>,
        w: &mut [T],
    ) -> Result<Solution<T>> {
        solve(system, scratch, w, false)
    }
}

impl MomentSolver for PivotedQr {
    fn solve<T: Scalar, const D: usize>(
        &self,
        system: &MomentSystem<T, D>,
        scratch: &mut MomentScratch<T>,
        w: &mut [T],
    ) -> Result<Solution<T>> {
        solve(system, scratch, w, true)
    }
}

fn solve<T: Scalar, const D: usize>(
    system: &MomentSystem<T, D>,
    scratch: &mut MomentScratch<T>,
    w: &mut [T],
    pivot: bool,
) -> Result<Solution<T>> {
    let (n, l) = (system.neighbors(), system.conditions());
    let MomentScratch { matrix, diagonal, factors, order, rows, a, b, y, .. } = scratch;
    rows.clear();
    rows.extend(0..n);
    let roots = system.roots();
    rows.sort_unstable_by(|&p, &q| roots[q].partial_cmp(&roots[p]).unwrap_or(Ordering::Equal).then(p.cmp(&q)));
    matrix.clear();
    system.columns().chunks_exact(n.max(1)).for_each(|column| matrix.extend(rows.iter().map(|&p| column[p])));
    let rank = factorize(matrix, n, l, diagonal, factors, order, pivot);
    let singular = OperatorError::Singular { neighbors: n, conditions: l, rank };
    if rank == 0 || (!pivot && rank < l) {
        return Err(singular.into());
    }
    let triangle = Triangle { matrix, diagonal, n, rank };
    let condition = condition(
        rank,
        a,
        |x| {
            triangle.multiply(x);
            triangle.multiply_transposed(x);
        },
        |x| {
            triangle.solve_transposed(x);
            triangle.solve(x);
        },
    );
    let mut solution = Solution {
        rung: if pivot { Rung::PivotedQr } else { Rung::Qr },
        rank,
        condition,
        residual: Residual { absolute: T::zero(), terms: T::zero() },
    };
    for (k, w) in w.chunks_exact_mut(n).enumerate() {
        a.clear();
        a.resize(n, T::zero());
        // E^-1 w += Q R^-T b.
        let mut add = |b: &[T], a: &mut [T]| {
            y.clear();
            y.extend(order[..rank].iter().map(|&j| b[j]));
            triangle.solve_transposed(y);
            y.resize(n, T::zero());
            for j in (0..rank).rev() {
                reflect(&matrix[j * n + j..(j + 1) * n], factors[j], &mut y[j..]);
            }
            rows.iter().zip(&*y).for_each(|(&p, &y)| a[p] += y);
        };
        b.clear();
        b.extend(system.scaled_required(k));
        add(b, a);
        system.defect(k, a, b);
        add(b, a);
        solution.residual = worst(solution.residual, system.residual(k, a));
        system.window_into(a, w);
    }
    Ok(solution)
}

/// Replaces B by its reflectors (on and below the diagonal) and R (above; its diagonal apart); returns the rank.
fn factorize<T: Scalar>(
    matrix: &mut [T],
    n: usize,
    l: usize,
    diagonal: &mut Vec<T>,
    factors: &mut Vec<T>,
    order: &mut Vec<usize>,
    pivot: bool,
) -> usize {
    diagonal.clear();
    factors.clear();
    order.clear();
    order.extend(0..l);
    let mut largest = T::zero();
    for j in 0..l.min(n) {
        if pivot {
            let tail = |column: usize| squares(&matrix[column * n + j..(column + 1) * n]);
            let best = (j + 1..l).fold((j, tail(j)), |(at, most), column| {
                let sum = tail(column);
                if sum > most { (column, sum) } else { (at, most) }
            });
            if best.0 != j {
                let (left, right) = matrix.split_at_mut(best.0 * n);
                left[j * n..(j + 1) * n].swap_with_slice(&mut right[..n]);
                order.swap(j, best.0);
            }
        }
        let (done, rest) = matrix.split_at_mut((j + 1) * n);
        let column = &mut done[j * n + j..];
        let norm = squares(column).sqrt();
        largest = largest.max(norm);
        // Below this a column is rounding of the others; NaN ends here too.
        if !(norm > largest * T::default_epsilon() * T::lift(n as f64)) {
            return j;
        }
        let alpha = if column[0] > T::zero() { -norm } else { norm };
        column[0] -= alpha;
        let factor = T::lift(2.0) / squares(column);
        for other in rest.chunks_exact_mut(n) {
            reflect(column, factor, &mut other[j..]);
        }
        diagonal.push(alpha);
        factors.push(factor);
    }
    l.min(n)
}

fn squares<T: Scalar>(x: &[T]) -> T {
    x.iter().fold(T::zero(), |sum, &x| sum + x * x)
}

/// x -= factor (v . x) v.
#[inline]
fn reflect<T: Scalar>(v: &[T], factor: T, x: &mut [T]) {
    let dot = v.iter().zip(x.iter()).fold(T::zero(), |sum, (&v, &x)| sum + v * x);
    let step = factor * dot;
    for (x, &v) in x.iter_mut().zip(v) {
        *x -= step * v;
    }
}

/// The leading block of R.
struct Triangle<'a, T> {
    matrix: &'a [T],
    diagonal: &'a [T],
    n: usize,
    rank: usize,
}

impl<T: Scalar> Triangle<'_, T> {
    #[inline]
    fn above(&self, j: usize) -> &[T] {
        &self.matrix[j * self.n..j * self.n + j]
    }

    /// x <- R x.
    fn multiply(&self, x: &mut [T]) {
        for j in 0..self.rank {
            let xj = x[j];
            for (x, &r) in x.iter_mut().zip(self.above(j)) {
                *x += r * xj;
            }
            x[j] = self.diagonal[j] * xj;
        }
    }

    /// x <- R^T x.
    fn multiply_transposed(&self, x: &mut [T]) {
        for j in (0..self.rank).rev() {
            let sum = self.above(j).iter().zip(x.iter()).fold(T::zero(), |sum, (&r, &x)| sum + r * x);
            x[j] = self.diagonal[j] * x[j] + sum;
        }
    }

    /// x <- R^-1 x.
    fn solve(&self, x: &mut [T]) {
        for j in (0..self.rank).rev() {
            let xj = x[j] / self.diagonal[j];
            x[j] = xj;
            for (x, &r) in x.iter_mut().zip(self.above(j)) {
                *x -= r * xj;
            }
        }
    }

    /// x <- R^-T x.
    fn solve_transposed(&self, x: &mut [T]) {
        for j in 0..self.rank {
            let sum = self.above(j).iter().zip(x.iter()).fold(T::zero(), |sum, (&r, &x)| sum + r * x);
            x[j] = (x[j] - sum) / self.diagonal[j];
        }
    }
}
