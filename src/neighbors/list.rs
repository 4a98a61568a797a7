//! Stored rows: those of another provider, or the user's own after every check.

use super::Neighbors;
use super::block::Block;
use super::placed::{Placed, check_cutoff, distance_squared};
use super::row_check::{check_offsets, check_row};
use crate::domain::{Domain, Image};
use crate::error::{Error, NeighborError, Result};
use crate::particles::{PARTICLES_HIGH, Particles, check_count, reserved};
use crate::scale::Cutoff;
use crate::stencil::{Neighbor, Stencil};

/// A provider that holds its rows: about 29 bytes a neighbor in three dimensions, and no search in a query.
///
/// Queries with a smaller cutoff filter the row; the order of a row is that in which it was given.
///
/// ```
/// use parops::{CellList, Cutoff, Domain, NeighborList, Neighbors, Particles};
/// let square = Particles::lattice([0.0; 2], [1.0; 2], [8; 2])?;
/// let cells = CellList::build(&square, &Domain::periodic([0.0; 2], [1.0; 2])?, Cutoff(0.25))?;
/// let list = NeighborList::from_provider(&cells)?;
/// assert_eq!((list.count(0, 0.25), list.count(0, 0.125)), (12, 4));
/// # parops::Result::Ok(())
/// ```
#[derive(Clone, Debug)]
pub struct NeighborList<const D: usize> {
    sources: usize,
    owned: usize,
    /// `NONE` where a target is no particle.
    centers: Vec<u32>,
    cutoffs: Vec<f64>,
    reach: f64,
    generation: u64,
    blocks: Vec<Block<D>>,
}

const NONE: u32 = u32::MAX;

impl<const D: usize> NeighborList<D> {
    /// The rows of another provider, up to its reach. Every row is searched once and stored without spare room.
    ///
    /// # Errors
    /// [`ParticleError::TooMany`](crate::ParticleError::TooMany), [`ParticleError::Memory`](crate::ParticleError::Memory) where the list does not fit.
    pub fn from_provider(provider: &impl Neighbors<D>) -> Result<Self> {
        let (targets, reach) = (provider.targets(), provider.reach());
        let mut list = Self::with_room(targets, provider.sources(), reach, provider.generation())?;
        list.owned = provider.owned();
        let mut block = Block::empty();
        for p in 0..targets {
            provider.for_each(p, reach, |neighbor| block.push(neighbor));
            list.end_row(p + 1 == targets, &mut block, provider.center(p), provider.cutoff(p))?;
        }
        Ok(list)
    }

    /// Rows of the user's own: row p is `neighbors[offsets[p]..offsets[p + 1]]`, its target the source `centers[p]`
    /// or no particle. `generation` is that of the particles the rows were made for.
    ///
    /// Two images of one source at the same place with the same sign (a particle exactly on an even mirror) cannot
    /// be told from a neighbor given twice and are refused; [`from_provider`](Self::from_provider) keeps them.
    ///
    /// # Errors
    /// [`NeighborError::Cutoff`], [`NeighborError::CutoffRange`] for an illegal cutoff; and naming the target:
    /// [`NeighborError::Offsets`] where they do not start at 0, decrease, or miss the number of neighbors,
    /// [`NeighborError::Source`] for a neighbor or center that does not exist,
    /// [`NeighborError::Separation`] where one is not finite,
    /// [`NeighborError::Sign`] for a sign other than 1 and -1,
    /// [`NeighborError::Distance`] for a neighbor beyond the cutoff,
    /// [`NeighborError::OwnCenter`] for the target itself (source and zero separation),
    /// [`NeighborError::Repeated`] for the same image twice,
    /// [`ParticleError::Length`](crate::ParticleError::Length) where there is not one offset more than centers,
    /// [`ParticleError::TooMany`](crate::ParticleError::TooMany), [`ParticleError::Memory`](crate::ParticleError::Memory) where the list does not fit.
    pub fn from_rows(
        sources: usize,
        centers: &[Option<usize>],
        offsets: &[usize],
        neighbors: &[Neighbor<D>],
        cutoff: Cutoff,
        generation: u64,
    ) -> Result<Self> {
        check_cutoff(cutoff)?;
        check_offsets(offsets, centers.len(), neighbors.len())?;
        let mut list = Self::with_room(centers.len(), sources, cutoff.0, generation)?;
        let mut block = Block::empty();
        for (p, &center) in centers.iter().enumerate() {
            let row = &neighbors[offsets[p]..offsets[p + 1]];
            if let Some(q) = center.filter(|&q| q >= sources) {
                return Err(Error::from(NeighborError::Source { q, sources }).at(p));
            }
            check_row(sources, center, row, cutoff.0).map_err(|error| error.at(p))?;
            row.iter().for_each(|&neighbor| block.push(neighbor));
            list.end_row(p + 1 == centers.len(), &mut block, center, cutoff.0)?;
        }
        Ok(list)
    }

    /// Rows of indices, one for every particle; each index means the nearest image of that particle.
    ///
    /// # Errors
    /// As [`BruteForce::build`](crate::BruteForce::build) for particles, domain and cutoff, and as
    /// [`from_rows`](Self::from_rows) for the rows.
    pub fn from_indices(
        particles: &Particles<D>,
        domain: &Domain<D>,
        offsets: &[usize],
        indices: &[u32],
        cutoff: Cutoff,
    ) -> Result<Self> {
        let placed = Placed::new(None, particles, domain, cutoff)?;
        check_offsets(offsets, particles.len(), indices.len())?;
        let mut neighbors = reserved(indices.len())?;
        for (p, target) in placed.sources.iter().enumerate() {
            for &q in &indices[offsets[p]..offsets[p + 1]] {
                let (q, sources) = (q as usize, particles.len());
                let Some(source) = placed.sources.get(q) else {
                    return Err(Error::from(NeighborError::Source { q, sources }).at(p));
                };
                if q == p {
                    return Err(Error::from(NeighborError::OwnCenter { q }).at(p));
                }
                let (mut nearest, mut image_of) = (f64::INFINITY, Image::OWN);
                placed.domain.for_images(source, f64::INFINITY, |image| {
                    let distance = distance_squared(&placed.separation(image, target, q));
                    if distance < nearest {
                        (nearest, image_of) = (distance, image);
                    }
                });
                let separation = placed.separation(image_of, target, q);
                neighbors.push(Neighbor { q, separation, sign: placed.domain.sign(image_of) });
            }
        }
        let mut centers = reserved(particles.len())?;
        centers.extend((0..particles.len()).map(Some));
        Self::from_rows(particles.len(), &centers, offsets, &neighbors, cutoff, particles.generation())
    }

    /// How many neighbors all rows hold together.
    pub fn total(&self) -> usize {
        self.blocks.iter().map(Block::total).sum()
    }

    fn with_room(targets: usize, sources: usize, reach: f64, generation: u64) -> Result<Self> {
        check_count(sources, PARTICLES_HIGH)?;
        let (centers, cutoffs) = (reserved(targets)?, reserved(targets)?);
        let blocks = reserved(targets.div_ceil(Block::<D>::ROWS))?;
        Ok(Self { sources, owned: sources, centers, cutoffs, reach, generation, blocks })
    }

    fn end_row(&mut self, last: bool, block: &mut Block<D>, center: Option<usize>, cutoff: f64) -> Result<()> {
        self.centers.push(center.map_or(NONE, |q| q as u32));
        self.cutoffs.push(cutoff);
        block.end_row();
        if last || block.is_full() {
            self.blocks.push(block.pack()?);
        }
        Ok(())
    }

    #[inline(always)]
    fn within(&self, p: usize, cutoff: f64) -> impl Iterator<Item = Neighbor<D>> + '_ {
        let rows = Block::<D>::ROWS;
        let block = self.blocks.get(p / rows).filter(|_| cutoff >= 0.0);
        block.into_iter().flat_map(move |block| block.row(p % rows, cutoff, cutoff >= self.reach))
    }
}

impl<const D: usize> Neighbors<D> for NeighborList<D> {
    fn targets(&self) -> usize {
        self.centers.len()
    }

    fn sources(&self) -> usize {
        self.sources
    }

    fn owned(&self) -> usize {
        self.owned
    }

    fn center(&self, p: usize) -> Option<usize> {
        self.centers.get(p).filter(|&&q| q != NONE).map(|&q| q as usize)
    }

    fn cutoff(&self, p: usize) -> f64 {
        self.cutoffs.get(p).copied().unwrap_or(self.reach)
    }

    fn reach(&self) -> f64 {
        self.reach
    }

    fn generation(&self) -> u64 {
        self.generation
    }

    fn for_each(&self, p: usize, cutoff: f64, visit: impl FnMut(Neighbor<D>)) {
        self.within(p, cutoff).for_each(visit);
    }

    fn gather(&self, p: usize, cutoff: f64, row: &mut Stencil<D>) {
        row.reset(p, self.center(p), cutoff);
        self.within(p, cutoff).for_each(|neighbor| row.push(neighbor));
    }

    fn count(&self, p: usize, cutoff: f64) -> usize {
        self.within(p, cutoff).count()
    }
}
