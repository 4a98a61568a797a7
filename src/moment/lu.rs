//! LU of the moment matrix, as in the notes: an oracle, not a default.

use nalgebra::DMatrix;

use super::cholesky::moment_matrix;
use super::solver::{MomentScratch, MomentSolver, Rung, Solution, worst};
use super::system::{MomentSystem, Residual};
use crate::error::{OperatorError, Result};
use crate::scalar::Scalar;

/// LU with partial pivoting of A = B^T B. It squares the condition number: at cond(B) of 10^8 all digits are gone.
///
/// Allocates. Its condition number comes from the singular values of B.
///
/// Source: notes 001, eq. 5.42 to 5.47.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Lu;

impl MomentSolver for Lu {
    fn solve<T: Scalar, const D: usize>(
        &self,
        system: &MomentSystem<T, D>,
        scratch: &mut MomentScratch<T>,
        w: &mut [T],
    ) -> Result<Solution<T>> {
        let (n, l) = (system.neighbors(), system.conditions());
        let MomentScratch { matrix, b, y, .. } = scratch;
        moment_matrix(system, matrix);
        let singular = || OperatorError::Singular { neighbors: n, conditions: l, rank: 0 };
        // Columns of zeros, of what is no number, or of no neighbor at all.
        if !(0..l).all(|j| matrix[j * l + j] > T::zero()) {
            return Err(singular().into());
        }
        let a = DMatrix::from_fn(l, l, |i, j| matrix[i.max(j) * l + i.min(j)]);
        let values = DMatrix::from_column_slice(n, l, system.columns()).singular_values();
        let condition = values.max() / values.min();
        let lu = a.lu();
        let mut residual = Residual { absolute: T::zero(), terms: T::zero() };
        for (k, w) in w.chunks_exact_mut(n).enumerate() {
            b.clear();
            b.extend(system.scaled_required(k));
            let mut solved = nalgebra::DVector::from_column_slice(b);
            if !lu.solve_mut(&mut solved) {
                return Err(singular().into());
            }
            y.clear();
            y.resize(n, T::zero());
            for (j, &a) in solved.iter().enumerate() {
                for (y, &b) in y.iter_mut().zip(system.column(j)) {
                    *y += b * a;
                }
            }
            residual = worst(residual, system.residual(k, y));
            system.window_into(y, w);
        }
        Ok(Solution { rung: Rung::Lu, rank: l, condition, residual })
    }
}
