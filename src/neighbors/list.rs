//! Stored rows: those of another provider, or the user's own after every check.

use std::sync::Arc;

use super::Neighbors;
use super::block::{Block, ROWS};
use super::links::Links;
use super::placed::{Placed, check_cutoff, distance_squared};
use super::row_check::{check_offsets, check_row};
use super::rows::Rows;
use crate::domain::{Domain, Image};
use crate::error::{Error, NeighborError, Result};
use crate::particles::{PARTICLES_HIGH, Particles, check_count, reserved};
use crate::scale::Cutoff;
use crate::stencil::{Neighbor, Stencil};

/// A provider that holds its rows: no search in a query.
///
/// Rows of a [`CellList`](crate::CellList) take 4 bytes a neighbor (6 near boundaries) and share its points, from which
/// separations are measured again; other rows keep them, 29 bytes a neighbor in three dimensions.
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
    domain: Option<Domain<D>>,
    rows: Rows<D>,
}

/// A target that is no particle.
const NONE: u32 = u32::MAX;

impl<const D: usize> NeighborList<D> {
    /// The rows of another provider, up to its reach. Every row is searched once and stored without spare room.
    ///
    /// # Errors
    /// [`ParticleError::TooMany`](crate::ParticleError::TooMany),
    /// [`ParticleError::Memory`](crate::ParticleError::Memory) where the list does not fit.
    pub fn from_provider(provider: &impl Neighbors<D>) -> Result<Self> {
        provider.stored()
    }

    /// Rows with their separations and signs.
    pub(super) fn measured(provider: &impl Neighbors<D>) -> Result<Self> {
        let (targets, reach) = (provider.targets(), provider.reach());
        let mut list = Self::with_room(targets, provider.sources(), reach, provider.generation())?;
        list.owned = provider.owned();
        list.domain = provider.domain().copied();
        let mut blocks = reserved(targets.div_ceil(ROWS))?;
        let mut block = Block::empty();
        for p in 0..targets {
            provider.for_each(p, reach, |neighbor| block.push(neighbor));
            block.end_row();
            if list.end_row(targets, provider.center(p), provider.cutoff(p)) {
                blocks.push(block.pack()?);
            }
        }
        list.rows = Rows::Measured(Arc::new(blocks));
        Ok(list)
    }

    /// These rows of indices over these points, up to their cutoff.
    pub(super) fn linked(placed: &Arc<Placed<D>>, links: Vec<Links>) -> Result<Self> {
        let targets = placed.targets().len();
        let mut list = Self::with_room(targets, placed.sources.len(), placed.cutoff, placed.generation)?;
        list.domain = Some(placed.domain);
        for p in 0..targets {
            list.end_row(targets, placed.center(p), placed.cutoff);
        }
        list.rows = Rows::Linked(Arc::clone(placed), Arc::new(links));
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
    /// [`ParticleError::TooMany`](crate::ParticleError::TooMany),
    /// [`ParticleError::Memory`](crate::ParticleError::Memory) where the list does not fit.
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
        let mut blocks = reserved(centers.len().div_ceil(ROWS))?;
        let mut block = Block::empty();
        for (p, &center) in centers.iter().enumerate() {
            let row = &neighbors[offsets[p]..offsets[p + 1]];
            if let Some(q) = center.filter(|&q| q >= sources) {
                return Err(Error::from(NeighborError::Source { q, sources }).at(p));
            }
            check_row(sources, center, row, cutoff.0).map_err(|error| error.at(p))?;
            row.iter().for_each(|&neighbor| block.push(neighbor));
            block.end_row();
            if list.end_row(centers.len(), center, cutoff.0) {
                blocks.push(block.pack()?);
            }
        }
        list.rows = Rows::Measured(Arc::new(blocks));
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
        let list = Self::from_rows(particles.len(), &centers, offsets, &neighbors, cutoff, particles.generation())?;
        Ok(list.in_domain(domain))
    }

    /// The same rows, said to hold images of this domain; needed of rows of your own with images behind mirrors.
    #[must_use]
    pub fn in_domain(self, domain: &Domain<D>) -> Self {
        Self { domain: Some(*domain), ..self }
    }

    pub(super) fn into_rows(self) -> Rows<D> {
        self.rows
    }

    /// How many neighbors all rows hold together.
    pub fn total(&self) -> usize {
        self.rows.total()
    }

    fn with_room(targets: usize, sources: usize, reach: f64, generation: u64) -> Result<Self> {
        check_count(sources, PARTICLES_HIGH)?;
        let (centers, cutoffs) = (reserved(targets)?, reserved(targets)?);
        Ok(Self {
            sources,
            owned: sources,
            centers,
            cutoffs,
            reach,
            generation,
            domain: None,
            rows: Rows::Measured(Arc::default()),
        })
    }

    /// Notes center and cutoff of the next target; whether a block of rows ends here.
    fn end_row(&mut self, targets: usize, center: Option<usize>, cutoff: f64) -> bool {
        self.centers.push(center.map_or(NONE, |q| q as u32));
        self.cutoffs.push(cutoff);
        let rows = self.centers.len();
        rows == targets || rows.is_multiple_of(ROWS)
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

    fn domain(&self) -> Option<&Domain<D>> {
        self.domain.as_ref()
    }

    fn for_each(&self, p: usize, cutoff: f64, visit: impl FnMut(Neighbor<D>)) {
        self.rows.visit(p, cutoff, cutoff >= self.reach, visit);
    }

    fn gather(&self, p: usize, cutoff: f64, row: &mut Stencil<D>) {
        row.reset(p, self.center(p), cutoff);
        self.rows.gather(p, cutoff, cutoff >= self.reach, row);
    }

    fn stored(&self) -> Result<Self> {
        Ok(self.clone())
    }
}
