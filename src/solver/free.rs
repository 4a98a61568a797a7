//! A method that makes no rows where the value of a particle is prescribed.

use super::term::Site;
use crate::error::{Error, Result};
use crate::operator::{Draft, Method, Outputs, RowReport};
use crate::stencil::Stencil;

/// The rows of a method at free particles, zeros at the others: there a row may not even exist, as at a corner or where
/// the flow comes in.
pub(super) struct Free<'a, M, const D: usize> {
    pub(super) method: &'a M,
    pub(super) site: &'a Site<D>,
}

impl<M: Method<D>, const D: usize> Method<D> for Free<'_, M, D> {
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
        if self.site.prescribed(row.target()) {
            w.fill(M::Out::ZERO);
            *diagonal = M::Out::ZERO;
            return Ok(());
        }
        self.method.weights(row, scratch, w, diagonal)
    }

    fn report(&self, row: &Stencil<D>, scratch: &M::Scratch, w: &[M::Out], diagonal: &M::Out) -> Result<RowReport> {
        if self.site.prescribed(row.target()) {
            return Ok(RowReport::of(row, w, diagonal));
        }
        self.method.report(row, scratch, w, diagonal)
    }

    fn weights_batch(&self, drafts: &mut [Draft<D, M::Out>], scratch: &mut M::Scratch) {
        let prescribed = |draft: &Draft<D, M::Out>| self.site.prescribed(draft.stencil.target());
        for run in drafts.chunk_by_mut(|a, b| prescribed(a) == prescribed(b)) {
            if run.first().is_some_and(prescribed) {
                for draft in run {
                    draft.clear();
                    draft.report = Ok(RowReport::of(&draft.stencil, &draft.weights, &draft.diagonal));
                }
            } else {
                self.method.weights_batch(run, scratch);
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
