//! One thread's part of making rows: gather, weights, and what is tried where a row is refused.

use std::fmt;
use std::ops::Range;
use std::sync::{Arc, Mutex, PoisonError};

use crate::domain::Face;
use crate::error::{Error, ErrorKind, NeighborError, OperatorError, Result};
use crate::neighbors::Neighbors;
use crate::operator::{Draft, GROWTH, Method, Outputs, RowReport};
use crate::scale::Cutoff;
use crate::stencil::Stencil;

/// Rows made side by side.
pub(super) const BATCH: usize = 8;

/// A row of more neighbors that breaks a limit without leave is refused at once: the worst of many such rows is not worth
/// waiting for, their pairs being the square of their number.
pub(super) const CROWD: usize = 1 << 16;

/// The drafts and the scratch one thread works with.
pub(super) struct Worker<const D: usize, M: Method<D>> {
    drafts: Vec<Draft<D, M::Out>>,
    scratch: M::Scratch,
}

/// As many workers as work at a time, kept from one block of rows to the next; copies share them.
pub(crate) struct Workers<const D: usize, M: Method<D>>(Arc<Mutex<Vec<Worker<D, M>>>>);

impl<const D: usize, M: Method<D>> Default for Workers<D, M> {
    fn default() -> Self {
        Self(Arc::default())
    }
}

impl<const D: usize, M: Method<D>> Clone for Workers<D, M> {
    fn clone(&self) -> Self {
        Self(Arc::clone(&self.0))
    }
}

impl<const D: usize, M: Method<D>> fmt::Debug for Workers<D, M> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Workers")
    }
}

impl<const D: usize, M: Method<D>> Workers<D, M> {
    pub(super) fn with<R>(&self, method: &M, work: impl FnOnce(&mut Worker<D, M>) -> Result<R>) -> Result<R> {
        let spare = self.0.lock().unwrap_or_else(PoisonError::into_inner).pop();
        let mut worker = match spare {
            Some(worker) => worker,
            None => Worker::new(method)?,
        };
        let result = work(&mut worker);
        self.0.lock().unwrap_or_else(PoisonError::into_inner).push(worker);
        result
    }
}

impl<const D: usize, M: Method<D>> Worker<D, M> {
    fn new(method: &M) -> Result<Self> {
        Ok(Self { drafts: vec![Draft::default(); BATCH], scratch: method.scratch()? })
    }

    /// Makes the weights of target p, without a report.
    pub(super) fn row<P: Neighbors<D>>(&mut self, method: &M, neighbors: &P, p: usize) -> Result<&Draft<D, M::Out>> {
        let Self { drafts, scratch } = self;
        let draft = &mut drafts[0];
        gather(neighbors, p, cutoff(method, neighbors, p)?, draft)?;
        if let Err(refusal) = method.weights(&draft.stencil, scratch, &mut draft.weights, &mut draft.diagonal) {
            draft.report = Err(refusal);
            mend(method, neighbors, p, draft, scratch)?;
            check_draft(p, neighbors.sources(), draft)?;
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
        for (p, draft) in targets.clone().zip(drafts.iter_mut()) {
            gather(neighbors, p, cutoff(method, neighbors, p)?, draft)?;
        }
        method.weights_batch(drafts, scratch);
        for (p, draft) in targets.zip(drafts.iter_mut()) {
            if draft.report.is_err() {
                mend(method, neighbors, p, draft, scratch)?;
            }
            check_draft(p, neighbors.sources(), draft)?;
            if let (true, Ok(RowReport { breach: Some(breach), allowed: false, .. })) =
                (draft.stencil.len() > CROWD, &draft.report)
            {
                return Err(breach.refuse(p));
            }
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
    let found = draft.stencil.target();
    if found != p {
        return Err(Error::from(NeighborError::Misnamed { found }).at(p));
    }
    check_sources(p, neighbors.sources(), &draft.stencil)?;
    draft.clear();
    Ok(())
}

fn check_sources<const D: usize>(p: usize, sources: usize, row: &Stencil<D>) -> Result<()> {
    let named = row.sources().iter().fold(0, |most, &q| most.max(q)) as usize;
    match named.max(row.center().unwrap_or(0)) {
        q if q >= sources && (row.center().is_some() || !row.is_empty()) => {
            Err(Error::from(NeighborError::Source { q, sources }).at(p))
        }
        _ => Ok(()),
    }
}

/// Methods may reach into a draft as they like: what they leave must still be a row of p.
fn check_draft<const D: usize, S: Outputs>(p: usize, sources: usize, draft: &Draft<D, S>) -> Result<()> {
    let (target, neighbors, weights) = (draft.stencil.target(), draft.stencil.len(), draft.weights.len());
    if target != p || weights != neighbors {
        return Err(Error::from(OperatorError::Draft { target, neighbors, weights }).at(p));
    }
    check_sources(p, sources, &draft.stencil)
}

/// Widens the support of a refused row as often as the method wants and the provider reaches, then asks the method for
/// what is to stand in for it.
fn mend<const D: usize, M: Method<D>, P: Neighbors<D>>(
    method: &M,
    neighbors: &P,
    p: usize,
    draft: &mut Draft<D, M::Out>,
    scratch: &mut M::Scratch,
) -> Result<()> {
    let (mut grown, mut limited) = (0, false);
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
            Err(other) if !method.can_grow(other) => {
                // An epsilon of its own may refuse the wider support for another reason: the row keeps the last support
                // that was legal, and the refusal to name is that one's.
                gather(neighbors, p, before, draft)?;
                draft.report = refusal;
                (grown, limited) = (grown - 1, true);
                break;
            }
            Err(_) => {}
        }
    }
    // Where all neighbors lie at one place no factor helps.
    let wanted = Some(GROWTH * draft.stencil.cutoff()).filter(|&wanted| wanted > 0.0 && admits(neighbors, wanted));
    method.stand_in(draft, scratch);
    match &mut draft.report {
        Ok(report) => {
            report.grown = grown;
            Ok(())
        }
        Err(refusal) => {
            let refusal = refusal.clone().at(p);
            Err(match lack(neighbors, &draft.stencil, &refusal) {
                Some((found, needed)) => refusal.lacking(found, needed),
                None => match wanted.filter(|_| !limited && method.can_grow(&refusal)) {
                    Some(wanted) => refusal.wanting(wanted),
                    None => refusal,
                },
            })
        }
    }
}

/// Whether the domain of a provider, where it is known, admits the cutoff.
fn admits<const D: usize>(neighbors: &impl Neighbors<D>, cutoff: f64) -> bool {
    neighbors.domain().is_none_or(|domain| domain.admits(Cutoff(cutoff)).is_ok())
}

/// How many sources there are and how many are needed at least, where a row has too few neighbors at any cutoff.
fn lack<const D: usize>(neighbors: &impl Neighbors<D>, row: &Stencil<D>, refusal: &Error) -> Option<(usize, usize)> {
    let ErrorKind::Operator(OperatorError::TooFew { needed, .. }) = *refusal.kind() else { return None };
    let (faces, found) = (neighbors.domain()?.faces(), neighbors.sources());
    // Behind faces there are images: more neighbors than particles.
    let alone = faces.iter().flatten().all(|face| *face == Face::Open);
    let needed = needed + usize::from(row.center().is_some());
    (alone && found < needed).then_some((found, needed))
}
