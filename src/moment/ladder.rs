//! The default solver: as cheap as the stencil allows, as careful as it needs.

use super::cholesky::Cholesky;
use super::qr::{PivotedQr, Qr};
use super::solver::{MomentScratch, MomentSolver, Solution};
use super::system::MomentSystem;
use crate::error::Result;
use crate::scalar::Scalar;

/// Cholesky, Cholesky with one corrected step, QR, pivoted QR: the first whose measured residual is as small as it can
/// be, or else the first of QR, pivoted QR and Cholesky whose residual is within the gates.
///
/// The residual decides, not the pivots: half-stencils at r = 4 pass any pivot test and still miss their conditions.
/// Where none passes, the last is returned and the caller refuses it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Ladder;

impl MomentSolver for Ladder {
    const AFTER_CHOLESKY: bool = true;

    fn solve<T: Scalar, const D: usize>(
        &self,
        system: &MomentSystem<T, D>,
        scratch: &mut MomentScratch<T>,
        w: &mut [T],
    ) -> Result<Solution<T>> {
        let known = Cholesky.solve(system, scratch, w).ok();
        self.climb(known, system, scratch, w)
    }

    fn climb<T: Scalar, const D: usize>(
        &self,
        known: Option<Solution<T>>,
        system: &MomentSystem<T, D>,
        scratch: &mut MomentScratch<T>,
        w: &mut [T],
    ) -> Result<Solution<T>> {
        let sharp = |known: &Solution<T>| known.is_sharp(system.conditions(), system.largest_required());
        if let Some(known) = known.filter(sharp) {
            return Ok(known);
        }
        let known = known.filter(|known| known.holds(system));
        scratch.kept.clear();
        scratch.kept.extend_from_slice(if known.is_some() { w } else { &[] });
        if let Ok(solution) = Qr.solve(system, scratch, w)
            && solution.holds(system)
        {
            return Ok(solution);
        }
        let last = PivotedQr.solve(system, scratch, w);
        match known {
            Some(known) if !last.as_ref().is_ok_and(|last| last.holds(system)) => {
                w.copy_from_slice(&scratch.kept);
                Ok(known)
            }
            _ => last,
        }
    }
}
