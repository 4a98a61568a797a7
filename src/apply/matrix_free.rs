//! An operator that stores no weights: right where a list of neighbors serves few applications.

use super::blocks::{BLOCK, each_block_merged, each_part};
use super::sweep::Sweep;
use super::worker::{BATCH, Workers};
use super::{Apply, Field, Report, check, check_results, scalars};
use crate::error::Result;
use crate::neighbors::Neighbors;
use crate::operator::{Draft, Method};

/// A method over a provider, applied without stored weights; the same bits as the stored rows.
///
/// All rows are checked once when it is made. An application costs the weights anew: about four times the cost of
/// stored rows for a Gaussian. It allocates nothing after the first application of as many threads, but what the pool of
/// the feature `rayon` does.
pub struct MatrixFree<'a, const D: usize, M: Method<D>, P> {
    method: &'a M,
    pub(super) neighbors: &'a P,
    report: Report,
    workers: Workers<D, M>,
}

impl<'a, const D: usize, M: Method<D>, P: Neighbors<D>> MatrixFree<'a, D, M, P> {
    /// Checks every row of `method` over `neighbors` and keeps none.
    ///
    /// # Errors
    /// As [`Rows::assemble`](super::Rows::assemble).
    pub fn new(method: &'a M, neighbors: &'a P) -> Result<Self> {
        let mut operator = Self::unchecked(method, neighbors, Workers::default());
        operator.check(&mut vec![(); neighbors.targets()], |_, _| ())?;
        Ok(operator)
    }

    /// The same without a check, for rows that are checked another time, by workers of the caller's.
    pub(crate) fn unchecked(method: &'a M, neighbors: &'a P, workers: Workers<D, M>) -> Self {
        Self { method, neighbors, report: Report::default(), workers }
    }

    /// Checks every row and hands each to `row`, which gives its result.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub(crate) fn check<T: Send>(
        &mut self,
        out: &mut [T],
        row: impl Fn(usize, &Draft<D, M::Out>) -> T + Sync + Send,
    ) -> Result<()> {
        let Self { method, neighbors, workers, report } = self;
        method.validate(neighbors.targets(), neighbors.sources())?;
        let blocks = out.chunks_mut(BLOCK).enumerate().map(|(b, out)| (b * BLOCK, out));
        *report = Report::default();
        let rows = |(first, out): (usize, &mut [T])| {
            workers.with(method, |worker| {
                let mut report = Report::default();
                for (batch, out) in (first..).step_by(BATCH).zip(out.chunks_mut(BATCH)) {
                    let drafts = worker.rows(method, *neighbors, batch..batch + out.len())?;
                    for ((p, out), draft) in (batch..).zip(out).zip(drafts) {
                        report.add(&draft.report.clone()?);
                        *out = row(p, draft);
                    }
                }
                Ok(report)
            })
        };
        each_block_merged(blocks, rows, |block| report.merge(&block))?;
        report.accept()
    }

    /// What the check of all rows found.
    pub fn report(&self) -> &Report {
        &self.report
    }
}

impl<const D: usize, const K: usize, M: Method<D, Out = [f64; K]>, P: Neighbors<D>> MatrixFree<'_, D, M, P> {
    /// Fills row after row and hands each to `row`, which gives its result.
    ///
    /// # Errors
    /// Naming the target without a row.
    pub(crate) fn each<T: Send>(
        &self,
        out: &mut [T],
        row: impl Fn(usize, &Draft<D, [f64; K]>) -> T + Sync + Send,
    ) -> Result<()> {
        each_part(out, |first, out| {
            self.workers.with(self.method, |worker| {
                // Methods that certify their rows are cheaper side by side; the others would pay for a report.
                if self.method.growths() > 0 {
                    for (batch, out) in (first..).step_by(BATCH).zip(out.chunks_mut(BATCH)) {
                        let drafts = worker.rows(self.method, self.neighbors, batch..batch + out.len())?;
                        for ((p, out), draft) in (batch..).zip(out).zip(drafts) {
                            *out = row(p, draft);
                        }
                    }
                    return Ok(());
                }
                for (p, out) in (first..).zip(out) {
                    *out = row(p, worker.row(self.method, self.neighbors, p)?);
                }
                Ok(())
            })
        })
    }

    /// All K outputs of a scalar field, as [`Rows::apply_all`](super::Rows::apply_all).
    ///
    /// # Errors
    /// As [`Apply::apply`].
    pub fn apply_all<T: Field>(&self, f: &[T], out: &mut [[T; K]]) -> Result<()> {
        check(scalars(f), self.neighbors.sources(), out, self.neighbors.targets())?;
        self.each(out, |_, draft| draft.all(f))?;
        check_results(out)
    }

    /// The contraction with a vector field, as [`Rows::apply_dot`](super::Rows::apply_dot).
    ///
    /// # Errors
    /// As [`Apply::apply`].
    pub fn apply_dot<T: Field>(&self, f: &[[T; K]], out: &mut [T]) -> Result<()> {
        check(f, self.neighbors.sources(), out, self.neighbors.targets())?;
        self.each(out, |_, draft| draft.dot(f))?;
        check_results(scalars(out))
    }

    /// The derivative along a vector per target, as [`Rows::apply_along`](super::Rows::apply_along).
    ///
    /// # Errors
    /// As [`Rows::apply_along`](super::Rows::apply_along).
    pub fn apply_along<T: Field>(&self, v: &[[T; K]], f: &[T], out: &mut [T]) -> Result<()> {
        check(scalars(f), self.neighbors.sources(), out, self.neighbors.targets())?;
        check(v, self.neighbors.targets(), out, self.neighbors.targets())?;
        self.each(out, |p, draft| draft.along(&v[p], f))?;
        check_results(scalars(out))
    }
}

impl<T: Field, const D: usize, M, P> Apply<T> for MatrixFree<'_, D, M, P>
where
    M: Method<D, Out = [f64; 1]>,
    P: Neighbors<D>,
{
    fn targets(&self) -> usize {
        self.neighbors.targets()
    }

    fn sources(&self) -> usize {
        self.neighbors.sources()
    }

    fn apply(&self, f: &[T], out: &mut [T]) -> Result<()> {
        self.apply_all(f, out.as_chunks_mut().0)
    }
}

/// The row just filled, with weights rounded like stored ones.
impl<T: Field, const D: usize, const K: usize> Sweep<T, K> for Draft<D, [f64; K]> {
    #[inline(always)]
    fn center(&self) -> Option<usize> {
        self.stencil.center()
    }

    #[inline(always)]
    fn diagonal(&self) -> Option<[T; K]> {
        Some(self.diagonal.map(T::lift))
    }

    #[inline(always)]
    fn pairs(&self) -> impl Iterator<Item = (usize, [T; K])> {
        self.stencil.sources().iter().zip(&self.weights).map(|(&q, w)| (q as usize, w.map(T::lift)))
    }
}
