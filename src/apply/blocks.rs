//! Work cut into blocks of rows: one owner a row, the same bits for any number of threads.

use crate::error::Result;

/// Rows in one block of work.
pub(super) const BLOCK: usize = 512;

/// The lowest block that failed so far: those after it need not be done, those before it must be.
#[cfg(feature = "rayon")]
struct Lowest(std::sync::atomic::AtomicUsize);

#[cfg(feature = "rayon")]
impl Default for Lowest {
    fn default() -> Self {
        Self(usize::MAX.into())
    }
}

#[cfg(feature = "rayon")]
impl Lowest {
    /// Does a block, or leaves it out where one before it has failed.
    fn unless_after<R>(&self, b: usize, work: impl FnOnce() -> Result<R>) -> Option<Result<R>> {
        use std::sync::atomic::Ordering::Relaxed;
        if b > self.0.load(Relaxed) {
            return None;
        }
        let done = work();
        if done.is_err() {
            self.0.fetch_min(b, Relaxed);
        }
        Some(done)
    }
}

/// Does every block, on the threads of the pool where the feature `rayon` is on, and returns what they gave in order.
///
/// # Errors
/// The error of the first block that failed, whichever thread met one first.
pub(super) fn each_block<B: Send, R: Send>(
    blocks: impl Iterator<Item = B>,
    work: impl Fn(B) -> Result<R> + Sync + Send,
) -> Result<Vec<R>> {
    #[cfg(feature = "rayon")]
    {
        use rayon::prelude::*;
        let (blocks, lowest) = (blocks.collect::<Vec<B>>(), Lowest::default());
        let results: Vec<Option<Result<R>>> =
            blocks.into_par_iter().enumerate().map(|(b, block)| lowest.unless_after(b, || work(block))).collect();
        results.into_iter().flatten().collect()
    }
    #[cfg(not(feature = "rayon"))]
    blocks.map(work).collect()
}

/// Does every block and merges what they gave, in order; allocates nothing but what the pool takes.
///
/// # Errors
/// As [`each_block`].
pub(super) fn each_block_merged<B: Send, R: Send>(
    blocks: impl Iterator<Item = B>,
    work: impl Fn(B) -> Result<R> + Sync + Send,
    #[cfg_attr(feature = "rayon", expect(unused_mut, reason = "called in a loop only without a pool"))]
    mut merge: impl FnMut(R),
) -> Result<()> {
    #[cfg(feature = "rayon")]
    each_block(blocks, work)?.into_iter().for_each(merge);
    #[cfg(not(feature = "rayon"))]
    for block in blocks {
        merge(work(block)?);
    }
    Ok(())
}

/// Does every block of an output, given its first row; allocates nothing but what the pool itself does.
///
/// # Errors
/// As [`each_block`].
pub(super) fn each_part<T: Send>(
    out: &mut [T],
    work: impl Fn(usize, &mut [T]) -> Result<()> + Sync + Send,
) -> Result<()> {
    #[cfg(feature = "rayon")]
    {
        use rayon::prelude::*;
        let lowest = Lowest::default();
        let part = |(b, out)| lowest.unless_after(b, || work(b * BLOCK, out)).unwrap_or(Ok(()));
        // The reduction keeps the order of the blocks.
        out.par_chunks_mut(BLOCK).enumerate().map(part).reduce(|| Ok(()), Result::and)
    }
    #[cfg(not(feature = "rayon"))]
    out.chunks_mut(BLOCK).enumerate().try_for_each(|(b, out)| work(b * BLOCK, out))
}

/// Applies row after row to an output, block by block.
pub(crate) fn each_row<T: Send>(out: &mut [T], row: impl Fn(usize) -> T + Sync + Send) {
    let block = |(b, out): (usize, &mut [T])| {
        for (i, out) in out.iter_mut().enumerate() {
            *out = row(b * BLOCK + i);
        }
    };
    #[cfg(feature = "rayon")]
    {
        use rayon::prelude::*;
        out.par_chunks_mut(BLOCK).enumerate().for_each(block);
    }
    #[cfg(not(feature = "rayon"))]
    out.chunks_mut(BLOCK).enumerate().for_each(block);
}
