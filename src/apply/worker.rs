//! One thread's part of making rows: gather, weights, and what is tried where a row is refused.

use std::ops::Range;

use crate::error::{Error, NeighborError, Result};
use crate::neighbors::Neighbors;
use crate::operator::{Draft, GROWTH, Method, Outputs};

/// Rows made side by side.
pub(super) const BATCH: usize = 8;

/// The drafts and the scratch one thread works with.
pub(super) struct Worker<const D: usize, M: Method<D>> {
    drafts: Vec<Draft<D, M::Out>>,
    scratch: M::Scratch,
}

impl<const D: usize, M: Method<D>> Worker<D, M> {
    pub(super) fn new(method: &M) -> Result<Self> {
        Ok(Self { drafts: vec![Draft::default(); BATCH], scratch: method.scratch()? })
    }

    /// Makes the weights of target p, without a report.
    pub(super) fn row<P: Neighbors<D>>(&mut self, method: &M, neighbors: &P, p: usize) -> Result<&Draft<D, M::Out>> {
        let Self { drafts, scratch } = self;
        let draft = &mut drafts[0];
        gather(neighbors, p, cutoff(method, neighbors, p)?, draft)?;
        if let Err(refusal) = method.weights(&draft.stencil, scratch, &mut draft.weights, &mut draft.diagonal) {
            draft.report = Err(refusal);
            mend(method, neighbors, draft, scratch)?;
        }
        Ok(draft)
    }

    /// Makes rows and reports of at most [`BATCH`] targets, and returns them in order.
    pub(super) fn rows<P: Neighbors<D>>(
        &mut self,
        method: &M,
        neighbors: &P,
        targets: Range<usize>,
    ) -> Result<&[Draft<D, M::Out>]> {
        let Self { drafts, scratch } = self;
        let drafts = &mut drafts[..targets.len()];
        for (p, draft) in targets.zip(drafts.iter_mut()) {
            gather(neighbors, p, cutoff(method, neighbors, p)?, draft)?;
        }
        method.weights_batch(drafts, scratch);
        for draft in drafts.iter_mut().filter(|draft| draft.report.is_err()) {
            mend(method, neighbors, draft, scratch)?;
        }
        Ok(drafts)
    }
}

/// The cutoff of target p: the method's own, or the provider's.
pub(super) fn cutoff<const D: usize, M: Method<D>, P: Neighbors<D>>(
    method: &M,
    neighbors: &P,
    p: usize,
) -> Result<f64> {
    let cutoff = method.cutoff(p).map_err(|error| error.at(p))?.unwrap_or_else(|| neighbors.cutoff(p));
    let reach = neighbors.reach();
    if cutoff <= reach { Ok(cutoff) } else { Err(Error::from(NeighborError::Reach { cutoff, reach }).at(p)) }
}

fn gather<const D: usize, S: Outputs, P: Neighbors<D>>(
    neighbors: &P,
    p: usize,
    cutoff: f64,
    draft: &mut Draft<D, S>,
) -> Result<()> {
    neighbors.gather(p, cutoff, &mut draft.stencil);
    let sources = neighbors.sources();
    let named = draft.stencil.sources().iter().map(|&q| q as usize).chain(draft.stencil.center());
    if let Some(q) = named.max().filter(|&q| q >= sources) {
        return Err(Error::from(NeighborError::Source { q, sources }).at(p));
    }
    draft.clear();
    Ok(())
}

/// Widens the support of a refused row as often as the method wants and the provider reaches, then asks the method for
/// what is to stand in for it.
fn mend<const D: usize, M: Method<D>, P: Neighbors<D>>(
    method: &M,
    neighbors: &P,
    draft: &mut Draft<D, M::Out>,
    scratch: &mut M::Scratch,
) -> Result<()> {
    let p = draft.stencil.target();
    let mut grown = 0;
    while grown < method.growths() {
        let (before, refusal) = (draft.stencil.cutoff(), draft.report.clone());
        let wider = (GROWTH * before).min(neighbors.reach());
        let helps = refusal.as_ref().is_err_and(|refusal| method.can_grow(refusal));
        if !(helps && wider > before) {
            break;
        }
        gather(neighbors, p, wider, draft)?;
        grown += 1;
        method.weights_batch(std::slice::from_mut(draft), scratch);
        match &mut draft.report {
            Ok(report) => {
                report.grown = grown;
                return Ok(());
            }
            // An epsilon of its own may refuse the wider support for another reason: the first one is the one to name.
            Err(other) if !method.can_grow(other) => draft.report = refusal,
            Err(_) => {}
        }
    }
    let wanted = GROWTH * draft.stencil.cutoff();
    method.stand_in(draft, scratch);
    match &mut draft.report {
        Ok(report) => {
            report.grown = grown;
            Ok(())
        }
        Err(refusal) if method.can_grow(refusal) => Err(refusal.clone().wanting(wanted).at(p)),
        Err(refusal) => Err(refusal.clone().at(p)),
    }
}
