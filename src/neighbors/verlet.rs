//! The Verlet list: rows stored with a skin, which serve until somebody has moved too far.

use std::sync::Arc;

use super::block::ROWS;
use super::cell_list::{CellList, magnitude};
use super::grid::Grid;
use super::links::Links;
use super::placed::{Placed, distance_squared};
use super::{NeighborList, Neighbors};
use crate::domain::{Domain, Image};
use crate::error::{NeighborError, ParticleError, Result};
use crate::particles::{Particles, reserved};
use crate::scalar::square;
use crate::scale::Cutoff;
use crate::stencil::{Neighbor, Stencil};

/// The provider for particles that move little between two queries: rows up to r_c + skin are stored, and searched anew
/// only when twice the largest displacement since the last search exceeds the skin.
///
/// Until then two particles cannot have come within r_c without standing in each other's rows. A displacement is the
/// shortest one, so that a particle that crosses a periodic face has not moved far. A query measures the stored pairs
/// at their places of now and serves exactly those within r_c: the rows are at any time those of
/// [`BruteForce`](crate::BruteForce), bit for bit, in another order. A closed axis must be two (r_c + skin) wide, and a
/// little more for rounding.
///
/// Particles are targets and sources. [`update`](Self::update) moves the list to the places of now; until then it
/// answers for the former generation. An update that reuses the rows allocates nothing.
///
/// ```
/// use parops::{Cutoff, Domain, Neighbors, Particles, VerletList};
/// let mut ring = Particles::lattice([0.0], [1.0], [8])?;
/// let mut list = VerletList::build(&ring, &Domain::periodic([0.0], [1.0])?, Cutoff(0.1875), 0.0625)?;
/// let pushed: Vec<_> = ring.points().iter().map(|[x]| [x + 0.03125]).collect();
/// ring.set_points(&pushed)?;
/// assert!(!list.update(&ring)?);
/// let pushed: Vec<_> = ring.points().iter().map(|[x]| [x + 0.03125]).collect();
/// ring.set_points(&pushed)?;
/// assert!(list.update(&ring)?);
/// assert_eq!((list.count(0, 0.1875), list.rebuilds()), (2, 1));
/// # parops::Result::Ok(())
/// ```
///
/// Source: notes 001, sec. 2.2, with errata 48 (twice the displacement, accumulated since the last search) and 49.
/// See also: [`CellList`], cheaper where the particles move by more than the skin in one step.
#[derive(Clone, Debug)]
pub struct VerletList<const D: usize> {
    /// The particles at their places of now, with the cutoff r_c.
    placed: Placed<D>,
    skin: f64,
    /// Rows up to r_c + skin at the places of the last search.
    links: Vec<Links>,
    searched_at: Vec<[f64; D]>,
    /// Which image of its former place every particle has gone over to; empty where no axis is periodic.
    crossings: Vec<Image>,
    /// Whether a particle or a stored neighbor of it has crossed a face; empty where no axis is periodic.
    concerned: Vec<bool>,
    spare: Vec<[f64; D]>,
    rebuilds: usize,
}

impl<const D: usize> VerletList<D> {
    /// Searches all rows up to `cutoff` + `skin`. The skin is a length from 0 on; a tenth to a fifth of r_c is usual.
    ///
    /// # Errors
    /// [`NeighborError::Skin`] where the skin is negative or not finite, and as [`CellList::build`] for a cutoff of
    /// r_c + skin + 32 eps D (largest coordinate + r_c + skin).
    pub fn build(particles: &Particles<D>, domain: &Domain<D>, cutoff: Cutoff, skin: f64) -> Result<Self> {
        if !(skin >= 0.0 && skin.is_finite()) {
            return Err(NeighborError::Skin { skin }.into());
        }
        let placed = Placed::new(None, particles, domain, cutoff)?;
        Self::search(placed, particles, skin)
    }

    fn search(placed: Placed<D>, particles: &Particles<D>, skin: f64) -> Result<Self> {
        // What rounding can add to a separation or take from a displacement.
        let slack = Grid::<D>::slack(magnitude(&placed), placed.cutoff + skin);
        let reach = Cutoff(placed.cutoff + skin + slack);
        let links = CellList::build(particles, &placed.domain, reach)?.links()?;
        let points = placed.sources.len();
        let mut searched_at = reserved(points)?;
        searched_at.extend_from_slice(&placed.sources);
        let crossing = if placed.domain.has_shifts() { points } else { 0 };
        let (mut crossings, mut concerned) = (reserved(crossing)?, reserved(crossing)?);
        crossings.resize(crossing, Image::OWN);
        concerned.resize(crossing, false);
        let spare = reserved(points)?;
        Ok(Self { placed, skin, links, searched_at, crossings, concerned, spare, rebuilds: 0 })
    }

    /// Moves the list to where the particles are now; returns whether the rows were searched anew.
    ///
    /// The rows are kept while twice the largest displacement since the last search is at most the skin.
    ///
    /// # Errors
    /// [`ParticleError::Length`] for another number of particles, [`DomainError::Outside`](crate::DomainError::Outside)
    /// naming one that has left the domain, and as [`build`](Self::build) where the rows are searched anew. The list
    /// is then as it was.
    pub fn update(&mut self, particles: &Particles<D>) -> Result<bool> {
        Ok(self.replaced(particles)?.is_some())
    }

    /// The same; returns the list there was where the rows were searched anew.
    pub(crate) fn replaced(&mut self, particles: &Particles<D>) -> Result<Option<Self>> {
        let (found, needed) = (particles.len(), self.placed.sources.len());
        if found != needed {
            return Err(ParticleError::Length { found, needed }.into());
        }
        if particles.generation() == self.placed.generation {
            return Ok(None);
        }
        let domain = self.placed.domain;
        self.spare.clear();
        let mut farthest = 0.0_f64;
        for (p, (point, from)) in particles.points().iter().zip(&self.searched_at).enumerate() {
            let to = domain.wrap(point).map_err(|error| error.at(p))?;
            farthest = farthest.max(square(&domain.displacement(from, &to).0));
            self.spare.push(to);
        }
        if !(2.0 * farthest.sqrt() <= self.skin) {
            let placed = Placed::new(None, particles, &domain, Cutoff(self.placed.cutoff))?;
            let searched = Self::search(placed, particles, self.skin)?;
            let searched = Self { rebuilds: self.rebuilds + 1, ..searched };
            return Ok(Some(std::mem::replace(self, searched)));
        }
        std::mem::swap(&mut self.spare, &mut self.placed.sources);
        self.placed.generation = particles.generation();
        self.cross();
        Ok(None)
    }

    /// Notes who has crossed a periodic face since the last search, and whom that concerns.
    fn cross(&mut self) {
        let Self { placed, links, searched_at, crossings, concerned, .. } = self;
        concerned.fill(false);
        for (p, crossing) in crossings.iter_mut().enumerate() {
            *crossing = placed.domain.displacement(&searched_at[p], &placed.sources[p]).1;
            if *crossing != Image::OWN {
                concerned[p] = true;
                let (sources, _) = links[p / ROWS].row(p % ROWS);
                sources.iter().for_each(|&q| concerned[q as usize] = true);
            }
        }
    }

    /// Refuses a list that answers for another generation of the particles.
    ///
    /// # Errors
    /// [`NeighborError::Stale`] where it does.
    pub fn validate(&self, generation: u64) -> Result<()> {
        let list = self.placed.generation;
        if list == generation { Ok(()) } else { Err(NeighborError::Stale { list, set: generation }.into()) }
    }

    /// The skin, a length.
    pub fn skin(&self) -> f64 {
        self.skin
    }

    /// Where the particles were when the rows were last searched: a list built there and updated to the places of now has
    /// the rows of this one in the same order.
    pub fn searched_at(&self) -> &[[f64; D]] {
        &self.searched_at
    }

    /// How often an update has searched the rows anew.
    pub fn rebuilds(&self) -> usize {
        self.rebuilds
    }

    /// Visits the neighbors of p within `cutoff` with the images they are.
    #[inline(always)]
    fn walk(&self, p: usize, cutoff: f64, mut visit: impl FnMut(Image, Neighbor<D>)) {
        let (Some(links), Some(limit)) = (self.links.get(p / ROWS), self.placed.limit(cutoff)) else { return };
        let Some(target) = self.placed.sources.get(p) else { return };
        let (sources, images) = links.row(p % ROWS);
        let concerned = self.is_concerned(p);
        for (i, &q) in sources.iter().enumerate() {
            let mut image = images.get(i).copied().unwrap_or(Image::OWN);
            if concerned {
                match image.crossed(self.crossings[q as usize], self.crossings[p]) {
                    Some(crossed) => image = crossed,
                    None => continue,
                }
            }
            let neighbor = self.placed.neighbor(image, target, q);
            if distance_squared(&neighbor.separation) <= limit {
                visit(image, neighbor);
            }
        }
    }

    fn is_concerned(&self, p: usize) -> bool {
        self.concerned.get(p).copied().unwrap_or(false)
    }
}

impl<const D: usize> Neighbors<D> for VerletList<D> {
    fn targets(&self) -> usize {
        self.placed.sources.len()
    }

    fn sources(&self) -> usize {
        self.placed.sources.len()
    }

    fn center(&self, p: usize) -> Option<usize> {
        self.placed.center(p)
    }

    fn cutoff(&self, _: usize) -> f64 {
        self.placed.cutoff
    }

    fn reach(&self) -> f64 {
        self.placed.cutoff
    }

    fn generation(&self) -> u64 {
        self.placed.generation
    }

    fn domain(&self) -> Option<&Domain<D>> {
        Some(&self.placed.domain)
    }

    fn for_each(&self, p: usize, cutoff: f64, mut visit: impl FnMut(Neighbor<D>)) {
        self.walk(p, cutoff, |_, neighbor| visit(neighbor));
    }

    fn gather(&self, p: usize, cutoff: f64, row: &mut Stencil<D>) {
        row.reset(p, self.center(p), cutoff);
        match self.links.get(p / ROWS) {
            Some(links) if cutoff >= 0.0 && !self.is_concerned(p) => {
                links.gather(&self.placed, p, cutoff.min(self.placed.cutoff), false, row);
            }
            _ => self.for_each(p, cutoff, |neighbor| row.push(neighbor)),
        }
    }

    fn stored(&self) -> Result<NeighborList<D>> {
        let near = |p: usize, links: &mut Links| {
            self.walk(p, self.placed.cutoff, |image, neighbor| links.push(neighbor.q as u32, image));
        };
        NeighborList::linked(&Arc::new(self.placed.clone()), Links::rows(self.targets(), near)?)
    }
}
