//! An operator that stores no weights: right where a list of neighbors serves few applications.

use std::sync::{Mutex, PoisonError};

use super::assemble::Worker;
use super::blocks::{BLOCK, each_block, each_part};
use super::{Apply, Field, Report, check, check_results};
use crate::error::Result;
use crate::neighbors::Neighbors;
use crate::operator::Method;

/// A method over a provider, applied without stored weights; the same bits as the stored rows.
///
/// All rows are checked once when it is made. An application costs the weights anew: about four times the cost of
/// stored rows for a Gaussian. It allocates nothing after the first application of as many threads, but what the pool of
/// the feature `rayon` does.
pub struct MatrixFree<'a, const D: usize, M: Method<D>, P> {
    method: &'a M,
    neighbors: &'a P,
    report: Report,
    workers: Mutex<Vec<Worker<D, M>>>,
}

impl<'a, const D: usize, M: Method<D>, P: Neighbors<D>> MatrixFree<'a, D, M, P> {
    /// Checks every row of `method` over `neighbors` and keeps none.
    ///
    /// # Errors
    /// As [`Rows::assemble`](super::Rows::assemble).
    pub fn new(method: &'a M, neighbors: &'a P) -> Result<Self> {
        let mut operator = Self { method, neighbors, report: Report::default(), workers: Mutex::default() };
        let targets = neighbors.targets();
        let blocks = (0..targets).step_by(BLOCK).map(|first| first..targets.min(first + BLOCK));
        let reports = each_block(blocks, |rows| {
            operator.with_worker(|worker| {
                let mut report = Report::default();
                for p in rows {
                    worker.fill(method, neighbors, p)?;
                    report.add(&worker.report(method, p)?);
                }
                Ok(report)
            })
        })?;
        reports.iter().for_each(|block| operator.report.merge(block));
        operator.report.accept()?;
        Ok(operator)
    }

    /// What the check of all rows found.
    pub fn report(&self) -> &Report {
        &self.report
    }

    fn with_worker<R>(&self, work: impl FnOnce(&mut Worker<D, M>) -> Result<R>) -> Result<R> {
        let spare = self.workers.lock().unwrap_or_else(PoisonError::into_inner).pop();
        let mut worker = match spare {
            Some(worker) => worker,
            None => Worker::new(self.method)?,
        };
        let result = work(&mut worker);
        self.workers.lock().unwrap_or_else(PoisonError::into_inner).push(worker);
        result
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
        check(f.as_chunks::<1>().0, self.neighbors.sources(), out, self.neighbors.targets())?;
        each_part(out, |first, out| {
            self.with_worker(|worker| {
                for (p, out) in (first..).zip(out) {
                    worker.fill(self.method, self.neighbors, p)?;
                    *out = worker.apply(f);
                }
                Ok(())
            })
        })?;
        check_results(out.as_chunks::<1>().0)
    }
}

impl<const D: usize, M: Method<D, Out = [f64; 1]>> Worker<D, M> {
    /// The row just filled, applied: the arithmetic of stored rows, with weights rounded like theirs.
    fn apply<T: Field>(&self, f: &[T]) -> T {
        let center = self.row.center().map(|center| f[center]);
        let mut sum = T::zero();
        if let Some(fp) = center {
            sum += T::lift(self.diagonal[0]) * fp;
        }
        for (&q, w) in self.row.sources().iter().zip(&self.weights) {
            let fq = f[q as usize];
            sum += T::lift(w[0]) * center.map_or(fq, |fp| fq - fp);
        }
        sum
    }
}
