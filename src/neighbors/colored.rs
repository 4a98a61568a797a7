//! Blocks of rows that write to their own particles and to others beyond, in colors that never write to one place.

use std::ops::Range;

use crate::error::Result;
use crate::particles::reserved;

/// Blocks a set is cut into, at most.
const BLOCKS: usize = 32;

/// Rows in a block at least.
const ROWS_LOW: usize = 256;

/// Consecutive rows that write to the places from the first row to before `end`.
#[derive(Clone, Debug)]
struct Span {
    rows: Range<usize>,
    end: usize,
}

/// Blocks of consecutive rows in colors: those of one color touch disjoint ranges of the output and are done at the
/// same time, one color after another. Cut and colors depend on the rows alone, so that every place receives its
/// terms in the same order for any number of threads.
#[derive(Clone, Debug)]
pub(super) struct Colored(Vec<Vec<Span>>);

impl Colored {
    /// `last(p)` is the highest place row p writes to, at least p.
    pub(super) fn new(rows: usize, last: impl Fn(usize) -> usize) -> Result<Self> {
        let size = rows.div_ceil(BLOCKS).max(ROWS_LOW);
        let mut colors: Vec<Vec<Span>> = reserved(BLOCKS)?;
        for first in (0..rows).step_by(size) {
            let rows = first..rows.min(first + size);
            let end = rows.clone().map(&last).fold(rows.end, |end, last| end.max(last + 1));
            let span = Span { rows, end };
            // Blocks come in ascending order, so that the first free color makes the fewest colors.
            match colors.iter_mut().find(|color| color.last().is_none_or(|before| before.end <= first)) {
                Some(color) => color.push(span),
                None => colors.push(vec![span]),
            }
        }
        Ok(Self(colors))
    }

    /// Does every block: `work` is given its rows and the places it may write to, from its first row on. Allocates
    /// nothing but what the pool of threads itself does.
    ///
    /// # Errors
    /// That of the first block that fails, in the order of the colors.
    pub(super) fn each<T: Send>(
        &self,
        out: &mut [T],
        work: &(impl Fn(Range<usize>, &mut [T]) -> Result<()> + Sync),
    ) -> Result<()> {
        self.0.iter().try_for_each(|color| split(color, 0, out, work))
    }
}

/// Halves the blocks of one color, and the places with them, until one is left.
fn split<T: Send>(
    spans: &[Span],
    offset: usize,
    out: &mut [T],
    work: &(impl Fn(Range<usize>, &mut [T]) -> Result<()> + Sync),
) -> Result<()> {
    let (left, right) = spans.split_at(spans.len() / 2);
    match (left.last(), right.first()) {
        (Some(_), Some(middle)) => {
            let at = middle.rows.start;
            let (below, above) = out.split_at_mut(at - offset);
            both(|| split(left, offset, below, work), || split(right, at, above, work))
        }
        (None, Some(only)) => work(only.rows.clone(), &mut out[only.rows.start - offset..only.end - offset]),
        _ => Ok(()),
    }
}

#[cfg(feature = "rayon")]
fn both(a: impl FnOnce() -> Result<()> + Send, b: impl FnOnce() -> Result<()> + Send) -> Result<()> {
    let (a, b) = rayon::join(a, b);
    a.and(b)
}

#[cfg(not(feature = "rayon"))]
fn both(a: impl FnOnce() -> Result<()>, b: impl FnOnce() -> Result<()>) -> Result<()> {
    a().and_then(|()| b())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_of_one_color_write_to_disjoint_places_and_every_row_is_done_once() {
        let rows = 10_000;
        for reach in [0, 1, 200, 3_000, 20_000] {
            let colored = Colored::new(rows, |p| (p + reach * (p % 7) / 6).min(rows - 1)).unwrap();
            for color in &colored.0 {
                assert!(color.windows(2).all(|pair| pair[0].end <= pair[1].rows.start), "reach {reach}");
            }
            let mut done = vec![0; rows];
            let count = |rows: Range<usize>, out: &mut [i32]| {
                out[..rows.len()].iter_mut().for_each(|done| *done += 1);
                Ok(())
            };
            colored.each(&mut done, &count).unwrap();
            assert!(done.iter().all(|&done| done == 1), "reach {reach}");
            assert_eq!(colored.0.iter().map(Vec::len).sum::<usize>(), 32);
        }
    }

    #[test]
    fn an_empty_set_has_no_blocks() {
        let colored = Colored::new(0, |p| p).unwrap();
        assert!(colored.0.is_empty());
    }
}
