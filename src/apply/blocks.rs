//! Work cut into blocks of rows: one owner a row, the same bits for any number of threads.

use crate::error::Result;

/// Rows in one block of work.
pub(super) const BLOCK: usize = 512;

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
        let blocks: Vec<B> = blocks.collect();
        let results: Vec<Result<R>> = blocks.into_par_iter().map(work).collect();
        results.into_iter().collect()
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
        // The reduction keeps the order of the blocks.
        let done = out.par_chunks_mut(BLOCK).enumerate().map(|(b, out)| work(b * BLOCK, out));
        done.reduce(|| Ok(()), Result::and)
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
