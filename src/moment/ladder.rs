//! The default solver: as cheap as the stencil allows, as careful as it needs.

use super::cholesky::Cholesky;
use super::qr::{PivotedQr, Qr};
use super::solver::{MomentScratch, MomentSolver, Solution};
use super::system::MomentSystem;
use crate::error::Result;
use crate::scalar::Scalar;

/// Cholesky, Cholesky with one corrected step, QR, pivoted QR: the first whose measured residual is rounding.
///
/// The residual decides, not the pivots: half-stencils at r = 4 pass any pivot test and still miss their conditions.
/// Where none passes, the last is returned and the caller refuses it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Ladder;

impl MomentSolver for Ladder {
    fn solve<T: Scalar, const D: usize>(
        &self,
        system: &MomentSystem<T, D>,
        scratch: &mut MomentScratch<T>,
        w: &mut [T],
    ) -> Result<Solution<T>> {
        if let Ok(solution) = Cholesky.solve(system, scratch, w)
            && solution.is_sharp(system.conditions(), system.largest_required())
        {
            return Ok(solution);
        }
        if let Ok(solution) = Qr.solve(system, scratch, w)
            && solution.holds(system)
        {
            return Ok(solution);
        }
        PivotedQr.solve(system, scratch, w)
    }
}
