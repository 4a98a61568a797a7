//! All pairs and all images, one by one: slow, and right by inspection.

use super::Neighbors;
use super::placed::{Placed, distance_squared};
use crate::domain::{Domain, Image};
use crate::error::Result;
use crate::particles::Particles;
use crate::scale::Cutoff;
use crate::stencil::Neighbor;

/// The provider that looks at every image of every source: O(3^D N) a row, the oracle for all others.
///
/// Rows come in the order of the sources, images of one source side by side.
///
/// ```
/// use parops::{BruteForce, Cutoff, Domain, Neighbors, Particles};
/// let ring = Particles::lattice([0.0], [1.0], [8])?;
/// let neighbors = BruteForce::build(&ring, &Domain::periodic([0.0], [1.0])?, Cutoff(0.125))?;
/// assert_eq!(neighbors.count(0, 0.125), 2);
/// # parops::Result::Ok(())
/// ```
///
/// See also: [`CellList`](crate::CellList) for more than a few hundred particles.
#[derive(Clone, Debug)]
pub struct BruteForce<const D: usize> {
    placed: Placed<D>,
    images: Vec<Image>,
}

impl<const D: usize> BruteForce<D> {
    /// The particles are targets and sources.
    ///
    /// # Errors
    /// [`NeighborError::Cutoff`](crate::NeighborError::Cutoff) where the cutoff is not positive and finite,
    /// [`NeighborError::CutoffRange`](crate::NeighborError::CutoffRange) where it is outside
    /// [`LENGTH_LOW`](crate::LENGTH_LOW) to [`LENGTH_HIGH`](crate::LENGTH_HIGH),
    /// [`DomainError::Narrow`](crate::DomainError::Narrow) where a closed axis is narrower than two cutoffs,
    /// [`DomainError::Outside`](crate::DomainError::Outside) naming a particle outside the domain,
    /// [`ParticleError::Memory`](crate::ParticleError::Memory) where memory is short.
    pub fn build(particles: &Particles<D>, domain: &Domain<D>, cutoff: Cutoff) -> Result<Self> {
        Self::new(Placed::new(None, particles, domain, cutoff)?)
    }

    /// The targets are points of their own, none of them a particle even where one lies at the same place.
    ///
    /// # Errors
    /// As [`build`](Self::build), and as [`Particles::new`] for the targets; the index an error names is then that of
    /// a target.
    pub fn build_at(
        targets: &[[f64; D]],
        particles: &Particles<D>,
        domain: &Domain<D>,
        cutoff: Cutoff,
    ) -> Result<Self> {
        Self::new(Placed::new(Some(targets), particles, domain, cutoff)?)
    }

    fn new(placed: Placed<D>) -> Result<Self> {
        let mut images = Vec::new();
        placed.domain.for_images(&[0.0; D], f64::INFINITY, |image| images.push(image));
        Ok(Self { placed, images })
    }
}

impl<const D: usize> Neighbors<D> for BruteForce<D> {
    fn targets(&self) -> usize {
        self.placed.targets().len()
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
        let (Some(target), Some(limit)) = (self.placed.targets().get(p), self.placed.limit(cutoff)) else {
            return;
        };
        let center = self.placed.center(p);
        for q in 0..self.placed.sources.len() {
            for &image in &self.images {
                if image == Image::OWN && center == Some(q) {
                    continue;
                }
                let separation = self.placed.separation(image, target, q);
                if distance_squared(&separation) <= limit {
                    visit(Neighbor { q, separation, sign: self.placed.domain.sign(image) });
                }
            }
        }
    }
}
