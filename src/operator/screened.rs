//! A method some of whose rows are left out, or refused.

use super::draft::Draft;
use super::expression::Outputs;
use super::method::Method;
use super::row_report::RowReport;
use crate::error::{Error, OperatorError, Result};
use crate::stencil::{Side, Stencil};

/// Which rows of a method are left out before they are made, and which are refused afterwards.
pub(crate) trait Screen<const D: usize>: Sync {
    /// Whether target p gets a row of zeros: there a row may not even exist.
    fn leaves_out(&self, p: usize) -> bool {
        let _ = p;
        false
    }

    /// Refuses a row, or hands its report on.
    ///
    /// # Errors
    /// Of the kind that the method would refuse the row with.
    fn check(&self, row: &Stencil<D>, known: RowReport) -> Result<RowReport> {
        let _ = row;
        Ok(known)
    }
}

/// Refuses a row with less than half of its neighbors on a side, as one of too few: so a stencil at an edge is never made of
/// what lies downwind.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Facing {
    pub(crate) axis: usize,
    pub(crate) side: Side,
}

impl<const D: usize> Screen<D> for Facing {
    fn check(&self, row: &Stencil<D>, known: RowReport) -> Result<RowReport> {
        let upstream = |s: &&[f64; D]| s.get(self.axis).is_some_and(|x| self.side.sign() * x > 0.0);
        let (neighbors, needed) = (row.separations().iter().filter(upstream).count(), row.len().div_ceil(2));
        if neighbors < needed {
            return Err(OperatorError::TooFew { neighbors, conditions: known.conditions, needed }.into());
        }
        Ok(known)
    }
}

/// The rows of a method as a screen lets them through.
#[derive(Clone, Debug)]
pub(crate) struct Screened<'a, M, S> {
    pub(crate) method: &'a M,
    pub(crate) screen: S,
}

impl<M: Method<D>, S: Screen<D>, const D: usize> Method<D> for Screened<'_, M, S> {
    type Out = M::Out;
    type Scratch = M::Scratch;

    fn scratch(&self) -> Result<M::Scratch> {
        self.method.scratch()
    }

    fn validate(&self, targets: usize, sources: usize) -> Result<()> {
        self.method.validate(targets, sources)
    }

    fn cutoff(&self, p: usize) -> Result<Option<f64>> {
        self.method.cutoff(p)
    }

    fn weights(
        &self,
        row: &Stencil<D>,
        scratch: &mut M::Scratch,
        w: &mut [M::Out],
        diagonal: &mut M::Out,
    ) -> Result<()> {
        if self.screen.leaves_out(row.target()) {
            w.fill(M::Out::ZERO);
            *diagonal = M::Out::ZERO;
            return Ok(());
        }
        self.method.weights(row, scratch, w, diagonal)
    }

    fn report(&self, row: &Stencil<D>, scratch: &M::Scratch, w: &[M::Out], diagonal: &M::Out) -> Result<RowReport> {
        if self.screen.leaves_out(row.target()) {
            return Ok(RowReport::of(row, w, diagonal));
        }
        self.screen.check(row, self.method.report(row, scratch, w, diagonal)?)
    }

    fn weights_batch(&self, drafts: &mut [Draft<D, M::Out>], scratch: &mut M::Scratch) {
        let left_out = |draft: &Draft<D, M::Out>| self.screen.leaves_out(draft.stencil.target());
        for run in drafts.chunk_by_mut(|a, b| left_out(a) == left_out(b)) {
            if run.first().is_some_and(left_out) {
                for draft in run {
                    draft.clear();
                    draft.report = Ok(RowReport::of(&draft.stencil, &draft.weights, &draft.diagonal));
                }
                continue;
            }
            self.method.weights_batch(run, scratch);
            for draft in run {
                if let Ok(known) = draft.report {
                    draft.report = self.screen.check(&draft.stencil, known);
                }
            }
        }
    }

    fn growths(&self) -> u32 {
        self.method.growths()
    }

    fn can_grow(&self, refusal: &Error) -> bool {
        self.method.can_grow(refusal)
    }

    fn stand_in(&self, draft: &mut Draft<D, M::Out>, scratch: &mut M::Scratch) {
        self.method.stand_in(draft, scratch);
    }
}
