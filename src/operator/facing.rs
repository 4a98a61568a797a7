//! A method whose rows must take at least half of their neighbors from one side.

use super::draft::Draft;
use super::method::Method;
use super::row_report::RowReport;
use crate::error::{Error, OperatorError, Result};
use crate::stencil::{Side, Stencil};

/// The rows of another method; one with less than half of its neighbors on the side is refused as one of too few, so that
/// a stencil at an edge is never made of what lies downwind.
#[derive(Clone, Debug)]
pub(crate) struct Facing<M> {
    pub(crate) method: M,
    pub(crate) axis: usize,
    pub(crate) side: Side,
}

impl<M> Facing<M> {
    fn check<const D: usize>(&self, row: &Stencil<D>, known: RowReport) -> Result<RowReport> {
        let upstream = |s: &&[f64; D]| s.get(self.axis).is_some_and(|x| self.side.sign() * x > 0.0);
        let (neighbors, needed) = (row.separations().iter().filter(upstream).count(), row.len().div_ceil(2));
        if neighbors < needed {
            return Err(OperatorError::TooFew { neighbors, conditions: known.conditions, needed }.into());
        }
        Ok(known)
    }
}

impl<M: Method<D>, const D: usize> Method<D> for Facing<M> {
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
        self.method.weights(row, scratch, w, diagonal)
    }

    fn report(&self, row: &Stencil<D>, scratch: &M::Scratch, w: &[M::Out], diagonal: &M::Out) -> Result<RowReport> {
        self.check(row, self.method.report(row, scratch, w, diagonal)?)
    }

    fn weights_batch(&self, drafts: &mut [Draft<D, M::Out>], scratch: &mut M::Scratch) {
        self.method.weights_batch(drafts, scratch);
        for draft in drafts {
            if let Ok(known) = draft.report {
                draft.report = self.check(&draft.stencil, known);
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
