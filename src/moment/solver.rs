//! The seam of the solvers of moment systems.

use super::system::{MomentSystem, Residual, larger};
use crate::error::Result;
use crate::scalar::Scalar;

/// Which method found the weights of a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Rung {
    /// LU of A = B^T B, as in the notes.
    Lu,
    /// Cholesky of A.
    Cholesky,
    /// Cholesky of A and one step with the residual taken from B.
    Corrected,
    /// Householder QR of B.
    Qr,
    /// QR of B with column pivoting, at the rank found.
    PivotedQr,
}

/// What a solver found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Solution<T> {
    /// The method that found it.
    pub rung: Rung,
    /// Rank of B, as far as the method can tell.
    pub rank: usize,
    /// Estimate of the condition number of B (columns scaled), 0.1 to 1.2 times the true value.
    pub condition: T,
    /// By how much the weights miss their conditions, the largest over the outputs.
    pub residual: Residual<T>,
}

/// Working memory of any solver, reused from stencil to stencil.
#[derive(Clone, Debug, Default)]
pub struct MomentScratch<T> {
    pub(super) matrix: Vec<T>,
    pub(super) diagonal: Vec<T>,
    pub(super) factors: Vec<T>,
    pub(super) order: Vec<usize>,
    pub(super) rows: Vec<usize>,
    pub(super) a: Vec<T>,
    pub(super) b: Vec<T>,
    pub(super) y: Vec<T>,
    pub(super) kept: Vec<T>,
}

/// Finds the weights of a filled [`MomentSystem`].
pub trait MomentSolver: Clone + Send + Sync + 'static {
    /// Whether operators try Cholesky on many stencils side by side first, and this method where that gives rows that
    /// are not sharp.
    const AFTER_CHOLESKY: bool = false;

    /// Writes the weights of output k into `w[k n..(k + 1) n]` and says how good they are.
    ///
    /// # Errors
    /// [`OperatorError::Singular`](crate::OperatorError::Singular) where the method finds no weights at all. Whether
    /// weights that exist are good enough is for the caller to judge from the residual.
    fn solve<T: Scalar, const D: usize>(
        &self,
        system: &MomentSystem<T, D>,
        scratch: &mut MomentScratch<T>,
        w: &mut [T],
    ) -> Result<Solution<T>>;

    /// As [`solve`](Self::solve), where Cholesky has left the solution `known`, or none, with its weights in `w`.
    ///
    /// # Errors
    /// As [`solve`](Self::solve).
    fn climb<T: Scalar, const D: usize>(
        &self,
        known: Option<Solution<T>>,
        system: &MomentSystem<T, D>,
        scratch: &mut MomentScratch<T>,
        w: &mut [T],
    ) -> Result<Solution<T>> {
        let _ = known;
        self.solve(system, scratch, w)
    }
}

/// max over the outputs of their residuals.
pub(super) fn worst<T: Scalar>(a: Residual<T>, b: Residual<T>) -> Residual<T> {
    Residual { absolute: larger(a.absolute, b.absolute), terms: a.terms.max(b.terms) }
}

impl<T: Scalar> Solution<T> {
    /// Whether the residual is rounding and nothing else: at most 4 l eps cond(B) max|b|, at most
    /// 30 l eps max_alpha sum_q |w_q z_q^alpha|, and at most sqrt(eps) max|b|, because where condition or weights reach
    /// 1/eps the first two say nothing. NaN is not.
    ///
    /// The estimate is of B with its columns scaled. Before that, cond(B) is at least
    /// max_alpha sum_q |w_q z_q^alpha| / |b| by Cauchy and Schwarz, with |b| <= sqrt(l) max|b|: the larger one on slivers.
    pub fn holds<const D: usize>(&self, system: &MomentSystem<T, D>) -> bool {
        self.is_within(system.conditions(), system.largest_required())
    }

    /// As [`holds`](Self::holds), for l conditions and max|b|.
    pub(crate) fn is_within(&self, conditions: usize, largest: T) -> bool {
        let eps = T::default_epsilon();
        let unit = eps * T::lift(conditions as f64);
        let Residual { absolute, terms } = self.residual;
        let unscaled = terms / T::lift(conditions as f64).sqrt();
        absolute <= T::lift(4.0) * unit * (self.condition * largest).max(unscaled)
            && absolute <= T::lift(30.0) * unit * terms
            && absolute <= eps.sqrt() * largest
    }

    /// Whether it is also about as small as QR leaves it: what is asked of the cheaper methods before the next is tried;
    /// for l conditions and max|b|. At most 16 eps max_alpha sum_q |w_q z_q^alpha|, without l, since rounding of a sum
    /// grows with its terms, not with their number; and 4 eps times these where that is above 2^11 eps max|b|, 4.5e-13,
    /// so that second derivatives of order 4 on half-stencils stay below 1e-12 too.
    pub(crate) fn is_sharp(&self, conditions: usize, largest: T) -> bool {
        let eps = T::default_epsilon();
        let terms = eps * self.residual.terms;
        let sharp = (T::lift(16.0) * terms).min((T::lift(2048.0) * eps * largest).max(T::lift(4.0) * terms));
        self.is_within(conditions, largest) && self.residual.absolute <= sharp
    }
}

/// Largest and smallest singular value of a triangular factor by power and inverse iteration: `multiply` is R^T R,
/// `solve` its inverse.
pub(super) fn condition<T: Scalar>(
    l: usize,
    work: &mut Vec<T>,
    mut multiply: impl FnMut(&mut [T]),
    mut solve: impl FnMut(&mut [T]),
) -> T {
    let mut extreme = |apply: &mut dyn FnMut(&mut [T]), steps: usize| {
        work.clear();
        // A start that is orthogonal to no coordinate direction.
        work.extend(
            (0..l).map(|i| T::lift(1.0 + 0.25 * (i % 3) as f64) * T::lift(if i % 2 == 0 { 1.0 } else { -1.0 })),
        );
        let mut growth = T::one();
        for _ in 0..steps {
            let norm = work.iter().fold(T::zero(), |sum, &x| sum + x * x).sqrt();
            work.iter_mut().for_each(|x| *x /= norm);
            apply(work);
            growth = work.iter().fold(T::zero(), |sum, &x| sum + x * x).sqrt();
        }
        growth
    };
    let largest = extreme(&mut multiply, 3);
    let smallest = extreme(&mut solve, 2);
    (largest * smallest).sqrt()
}

#[cfg(test)]
mod tests;
