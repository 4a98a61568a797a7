//! Rows of a few thousand targets as indices: separations are measured again when they are asked for.

use super::block::{ROWS, exact};
use super::placed::{Placed, difference, distance_squared, within};
use crate::domain::Image;
use crate::error::Result;
use crate::particles::reserved;
use crate::stencil::{Neighbor, Stencil};

/// Consecutive rows of sources and images, [`ROWS`] of them.
#[derive(Clone, Debug, Default)]
pub(super) struct Links {
    ends: Vec<usize>,
    sources: Vec<u32>,
    /// One for every source, or none where all are the sources themselves.
    images: Vec<Image>,
}

impl Links {
    /// Rows of indices, block after block; `fill(p, links)` adds the neighbors of p.
    pub(super) fn rows(targets: usize, mut fill: impl FnMut(usize, &mut Self)) -> Result<Vec<Self>> {
        let mut blocks = reserved(targets.div_ceil(ROWS))?;
        let mut links = Self::default();
        for p in 0..targets {
            fill(p, &mut links);
            links.end_row();
            if p + 1 == targets || (p + 1).is_multiple_of(ROWS) {
                blocks.push(links.pack()?);
            }
        }
        Ok(blocks)
    }

    /// Adds sources that are no images.
    #[inline(always)]
    pub(super) fn extend(&mut self, sources: impl Iterator<Item = u32>) {
        self.sources.extend(sources);
        if !self.images.is_empty() {
            self.images.resize(self.sources.len(), Image::OWN);
        }
    }

    #[inline(always)]
    pub(super) fn push(&mut self, source: u32, image: Image) {
        if image != Image::OWN && self.images.is_empty() {
            self.images.resize(self.sources.len(), Image::OWN);
        }
        self.sources.push(source);
        if image != Image::OWN || !self.images.is_empty() {
            self.images.push(image);
        }
    }

    fn end_row(&mut self) {
        self.ends.push(self.sources.len());
    }

    pub(super) fn total(&self) -> usize {
        self.sources.len()
    }

    /// A copy without spare room; the links themselves are emptied and keep their memory.
    fn pack(&mut self) -> Result<Self> {
        let packed = Self { ends: exact(&self.ends)?, sources: exact(&self.sources)?, images: exact(&self.images)? };
        self.ends.clear();
        self.sources.clear();
        self.images.clear();
        Ok(packed)
    }

    /// Sources and images of one row; no images where all are the sources themselves.
    #[inline(always)]
    pub(super) fn row(&self, row: usize) -> (&[u32], &[Image]) {
        let past = self.ends.get(row).copied().unwrap_or(0);
        let first = if row == 0 || past == 0 { 0 } else { self.ends[row - 1] };
        let images = self.images.get(first..past).unwrap_or(&[]);
        let any = images.iter().filter(|&&image| image != Image::OWN).count() > 0;
        (&self.sources[first..past], if any { images } else { &[] })
    }

    /// Calls `visit` for the neighbors of target p with |separation| <= `cutoff`, or all of them.
    #[inline(always)]
    pub(super) fn visit<const D: usize>(
        &self,
        placed: &Placed<D>,
        p: usize,
        cutoff: f64,
        whole: bool,
        mut visit: impl FnMut(Neighbor<D>),
    ) {
        let Some(target) = placed.targets().get(p) else { return };
        let limit = within(cutoff);
        let (sources, images) = self.row(p % ROWS);
        for (i, &q) in sources.iter().enumerate() {
            let image = images.get(i).copied().unwrap_or(Image::OWN);
            let neighbor = placed.neighbor(image, target, q);
            if whole || distance_squared(&neighbor.separation) <= limit {
                visit(neighbor);
            }
        }
    }

    /// Adds the neighbors of target p with |separation| <= `cutoff`, or all of them, to `row`.
    #[inline(always)]
    pub(super) fn gather<const D: usize>(
        &self,
        placed: &Placed<D>,
        p: usize,
        cutoff: f64,
        whole: bool,
        row: &mut Stencil<D>,
    ) {
        let Some(target) = placed.targets().get(p) else { return };
        let (sources, images) = self.row(p % ROWS);
        if !images.is_empty() {
            return self.visit(placed, p, cutoff, whole, |neighbor| row.push(neighbor));
        }
        let measured = |&q: &u32| difference(target, &placed.sources[q as usize]);
        if whole {
            return row.extend(sources.iter().copied(), sources.iter().map(measured));
        }
        // Kept without a branch, because whether one is within the cutoff cannot be predicted.
        let limit = within(cutoff);
        let mut near = [0; 64];
        for some in sources.chunks(near.len()) {
            let mut kept = 0;
            for q in some {
                near[kept % 64] = *q;
                kept += usize::from(distance_squared(&measured(q)) <= limit);
            }
            row.extend(near[..kept].iter().copied(), near[..kept].iter().map(measured));
        }
    }
}
