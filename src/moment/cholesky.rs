//! Cholesky of the moment matrix A = B^T B, and one step that takes the residual from B.

use super::solver::{MomentScratch, MomentSolver, Rung, Solution, condition, worst};
use super::system::{MomentSystem, Residual};
use crate::error::{OperatorError, Result};
use crate::scalar::Scalar;

/// Cholesky of A = B^T B, followed by one corrected step of the same factor where the residual asks for it:
/// r = b - B^T w, w += E B A^-1 r. The cheapest way; the correction is as good as QR up to cond(B) of 10^6.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cholesky;

impl MomentSolver for Cholesky {
    fn solve<T: Scalar, const D: usize>(
        &self,
        system: &MomentSystem<T, D>,
        scratch: &mut MomentScratch<T>,
        w: &mut [T],
    ) -> Result<Solution<T>> {
        let (n, l) = (system.neighbors(), system.conditions());
        let MomentScratch { matrix, a, b, y, .. } = scratch;
        moment_matrix(system, matrix);
        if let Err(rank) = factorize(matrix, l) {
            return Err(OperatorError::Singular { neighbors: n, conditions: l, rank }.into());
        }
        // A = L L^T, so the iterations give cond(A) through L alone: cond(B) is its root.
        let condition = condition(
            l,
            a,
            |x| {
                multiply_transposed(matrix, l, x);
                multiply(matrix, l, x);
            },
            |x| solve(matrix, l, x),
        );
        let mut solution = Solution {
            rung: Rung::Cholesky,
            rank: l,
            condition,
            residual: Residual { absolute: T::zero(), terms: T::zero() },
        };
        for (k, w) in w.chunks_exact_mut(n).enumerate() {
            b.clear();
            b.extend(system.scaled_required(k));
            solve(matrix, l, b);
            y.clear();
            y.resize(n, T::zero());
            accumulate(system, b, y);
            let mut row = Solution { residual: system.residual(k, y), ..solution };
            if !row.is_sharp(system.conditions(), system.largest_required()) {
                system.defect(k, y, b);
                solve(matrix, l, b);
                accumulate(system, b, y);
                row.residual = system.residual(k, y);
                solution.rung = Rung::Corrected;
            }
            solution.residual = worst(solution.residual, row.residual);
            system.window_into(y, w);
        }
        Ok(solution)
    }
}

/// y += B a.
fn accumulate<T: Scalar, const D: usize>(system: &MomentSystem<T, D>, a: &[T], y: &mut [T]) {
    for (j, &a) in a.iter().enumerate() {
        for (y, &b) in y.iter_mut().zip(system.column(j)) {
            *y += b * a;
        }
    }
}

/// The lower triangle of A = B^T B, row after row in an l x l square.
pub(super) fn moment_matrix<T: Scalar, const D: usize>(system: &MomentSystem<T, D>, matrix: &mut Vec<T>) {
    let l = system.conditions();
    matrix.clear();
    matrix.resize(l * l, T::zero());
    for i in 0..l {
        for j in 0..=i {
            let pairs = system.column(i).iter().zip(system.column(j));
            matrix[i * l + j] = pairs.fold(T::zero(), |sum, (&x, &y)| sum + x * y);
        }
    }
}

/// Replaces the lower triangle by L; the index of the first pivot that is rounding, otherwise.
fn factorize<T: Scalar>(matrix: &mut [T], l: usize) -> std::result::Result<(), usize> {
    // Diagonal entries lie between 1/4 and 1: a pivot this small has lost all digits.
    let tolerance = T::default_epsilon() * T::lift(4.0 * l as f64);
    for i in 0..l {
        for j in 0..=i {
            let mut sum = matrix[i * l + j];
            for k in 0..j {
                sum -= matrix[i * l + k] * matrix[j * l + k];
            }
            if i == j {
                if !(sum > tolerance) {
                    return Err(i);
                }
                matrix[i * l + i] = sum.sqrt();
            } else {
                matrix[i * l + j] = sum / matrix[j * l + j];
            }
        }
    }
    Ok(())
}

/// x <- A^-1 x.
fn solve<T: Scalar>(matrix: &[T], l: usize, x: &mut [T]) {
    for i in 0..l {
        let row = &matrix[i * l..i * l + i];
        let sum = row.iter().zip(x.iter()).fold(T::zero(), |sum, (&a, &x)| sum + a * x);
        x[i] = (x[i] - sum) / matrix[i * l + i];
    }
    for i in (0..l).rev() {
        let xi = x[i] / matrix[i * l + i];
        x[i] = xi;
        for (x, &a) in x.iter_mut().zip(&matrix[i * l..i * l + i]) {
            *x -= a * xi;
        }
    }
}

/// x <- L^T x.
fn multiply_transposed<T: Scalar>(matrix: &[T], l: usize, x: &mut [T]) {
    for j in 0..l {
        let mut sum = T::zero();
        for i in j..l {
            sum += matrix[i * l + j] * x[i];
        }
        x[j] = sum;
    }
}

/// x <- L x.
fn multiply<T: Scalar>(matrix: &[T], l: usize, x: &mut [T]) {
    for i in (0..l).rev() {
        let row = &matrix[i * l..i * l + i + 1];
        x[i] = row.iter().zip(x.iter()).fold(T::zero(), |sum, (&a, &x)| sum + a * x);
    }
}
