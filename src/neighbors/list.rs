//! Stored rows: those of another provider, or the user's own after every check.

use super::Neighbors;
use super::placed::{Placed, check_cutoff, distance_squared, within};
use crate::domain::{Domain, Image};
use crate::error::{Error, NeighborError, ParticleError, Result};
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
    /// One cutoff per target, or a single one.
    cutoffs: Vec<f64>,
    reach: f64,
    generation: u64,
    offsets: Vec<usize>,
    neighbors: Vec<u32>,
    separations: Vec<[f64; D]>,
    signs: Vec<i8>,
}

const NONE: u32 = u32::MAX;

impl<const D: usize> NeighborList<D> {
    /// The rows of another provider, up to its reach. Every row is searched twice, first to count, so that nothing
    /// is allocated twice.
    ///
    /// # Errors
    /// [`NeighborError::Offsets`] naming a target for which the provider gathers more or fewer than it counts,
    /// [`ParticleError::TooMany`], [`ParticleError::Memory`] where the list does not fit.
    pub fn from_provider(provider: &impl Neighbors<D>) -> Result<Self> {
        let (targets, reach) = (provider.targets(), provider.reach());
        let mut offsets = reserved(targets + 1)?;
        let mut total = 0;
        offsets.push(0);
        for p in 0..targets {
            total += provider.count(p, reach);
            offsets.push(total);
        }
        let mut list = Self::with_offsets(provider.sources(), offsets, reach, provider.generation())?;
        list.owned = provider.owned();
        let mut row = Stencil::default();
        for p in 0..targets {
            provider.gather(p, reach, &mut row);
            list.neighbors.extend_from_slice(row.sources());
            list.separations.extend_from_slice(row.separations());
            list.signs.extend_from_slice(row.signs());
            let needed = list.offsets[p + 1];
            if list.neighbors.len() != needed {
                let found = list.neighbors.len();
                return Err(Error::from(NeighborError::Offsets { row: p, found, needed }).at(p));
            }
            list.centers.push(provider.center(p).map_or(NONE, |q| q as u32));
            list.cutoffs.push(provider.cutoff(p));
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
    /// [`ParticleError::Length`] where there is not one offset more than centers,
    /// [`ParticleError::TooMany`], [`ParticleError::Memory`] where the list does not fit.
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
        let mut own_offsets = reserved(offsets.len())?;
        own_offsets.extend_from_slice(offsets);
        let mut list = Self::with_offsets(sources, own_offsets, cutoff.0, generation)?;
        for (p, &center) in centers.iter().enumerate() {
            let row = &neighbors[offsets[p]..offsets[p + 1]];
            if let Some(q) = center.filter(|&q| q >= sources) {
                return Err(Error::from(NeighborError::Source { q, sources }).at(p));
            }
            check_row(sources, center, row, cutoff.0).map_err(|error| error.at(p))?;
            list.centers.push(center.map_or(NONE, |q| q as u32));
            list.cutoffs.push(cutoff.0);
            for neighbor in row {
                list.neighbors.push(neighbor.q as u32);
                list.separations.push(neighbor.separation);
                list.signs.push(neighbor.sign);
            }
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
        self.neighbors.len()
    }

    fn with_offsets(sources: usize, offsets: Vec<usize>, reach: f64, generation: u64) -> Result<Self> {
        check_count(sources, PARTICLES_HIGH)?;
        let (targets, total) = (offsets.len().saturating_sub(1), offsets.last().copied().unwrap_or(0));
        Ok(Self {
            sources,
            owned: sources,
            centers: reserved(targets)?,
            cutoffs: reserved(targets)?,
            reach,
            generation,
            offsets,
            neighbors: reserved(total)?,
            separations: reserved(total)?,
            signs: reserved(total)?,
        })
    }

    #[inline(always)]
    fn within(&self, p: usize, cutoff: f64) -> impl Iterator<Item = Neighbor<D>> + '_ {
        let range = match self.offsets.get(p..).and_then(|rest| rest.first_chunk::<2>()) {
            Some(&[first, past]) if cutoff >= 0.0 => first..past,
            _ => 0..0,
        };
        let whole = cutoff >= self.reach;
        let limit = within(cutoff);
        let row = self.neighbors[range.clone()].iter().zip(&self.separations[range.clone()]).zip(&self.signs[range]);
        row.filter(move |((_, separation), _)| whole || distance_squared(separation) <= limit)
            .map(|((&q, &separation), &sign)| Neighbor { q: q as usize, separation, sign })
    }
}

fn check_offsets(offsets: &[usize], targets: usize, neighbors: usize) -> Result<()> {
    if Some(offsets.len()) != targets.checked_add(1) {
        return Err(ParticleError::Length { found: offsets.len(), needed: targets.saturating_add(1) }.into());
    }
    let mut least = 0;
    for (row, &found) in offsets.iter().enumerate() {
        if found < least || (row == 0 && found != 0) {
            return Err(Error::from(NeighborError::Offsets { row, found, needed: least }).at(row));
        }
        if row == targets && found != neighbors {
            return Err(NeighborError::Offsets { row, found, needed: neighbors }.into());
        }
        least = found;
    }
    Ok(())
}

fn check_row<const D: usize>(sources: usize, center: Option<usize>, row: &[Neighbor<D>], cutoff: f64) -> Result<()> {
    for &Neighbor { q, separation, sign } in row {
        if q >= sources {
            return Err(NeighborError::Source { q, sources }.into());
        }
        if let Some(axis) = (0..D).find(|&axis| !separation[axis].is_finite()) {
            return Err(NeighborError::Separation { q, axis, separation: separation[axis] }.into());
        }
        if sign != 1 && sign != -1 {
            return Err(NeighborError::Sign { q, sign }.into());
        }
        let squared = distance_squared(&separation);
        if !(squared <= within(cutoff)) {
            return Err(NeighborError::Distance { q, distance: squared.sqrt(), cutoff }.into());
        }
        if center == Some(q) && sign == 1 && separation == [0.0; D] {
            return Err(NeighborError::OwnCenter { q }.into());
        }
    }
    // Adding zero makes -0 and +0 one place.
    let mut images: Vec<_> = row.iter().map(|n| (n.q, n.separation.map(|s| (s + 0.0).to_bits()), n.sign)).collect();
    images.sort_unstable();
    match images.windows(2).find(|pair| pair[0] == pair[1]) {
        Some(pair) => Err(NeighborError::Repeated { q: pair[0].0 }.into()),
        None => Ok(()),
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
