//! Stored rows in one of two forms: with their separations, or as indices over points they share.

use std::sync::Arc;

use super::block::{Block, ROWS};
use super::links::Links;
use super::placed::Placed;
use crate::stencil::{Neighbor, Stencil};

/// Rows of a few thousand targets each; clones share them.
#[derive(Clone, Debug)]
pub(super) enum Rows<const D: usize> {
    Measured(Arc<Vec<Block<D>>>),
    Linked(Arc<Placed<D>>, Arc<Vec<Links>>),
}

impl<const D: usize> Rows<D> {
    /// How many neighbors all rows hold together.
    pub(super) fn total(&self) -> usize {
        match self {
            Self::Measured(blocks) => blocks.iter().map(Block::total).sum(),
            Self::Linked(_, blocks) => blocks.iter().map(Links::total).sum(),
        }
    }

    /// Calls `visit` for the neighbors of row p with |separation| <= `cutoff`, or for all of them.
    #[inline(always)]
    pub(super) fn visit(&self, p: usize, cutoff: f64, whole: bool, mut visit: impl FnMut(Neighbor<D>)) {
        match self {
            _ if !(cutoff >= 0.0) => {}
            Self::Measured(blocks) => {
                blocks
                    .get(p / ROWS)
                    .into_iter()
                    .for_each(|block| block.row(p % ROWS, cutoff, whole).for_each(&mut visit));
            }
            Self::Linked(placed, blocks) => {
                blocks.get(p / ROWS).into_iter().for_each(|links| links.visit(placed, p, cutoff, whole, &mut visit));
            }
        }
    }

    /// Adds the neighbors of row p with |separation| <= `cutoff`, or all of them, to `row`.
    #[inline(always)]
    pub(super) fn gather(&self, p: usize, cutoff: f64, whole: bool, row: &mut Stencil<D>) {
        match self {
            Self::Linked(placed, blocks) if cutoff >= 0.0 => {
                if let Some(links) = blocks.get(p / ROWS) {
                    links.gather(placed, p, cutoff, whole, row);
                }
            }
            _ => self.visit(p, cutoff, whole, |neighbor| row.push(neighbor)),
        }
    }
}
