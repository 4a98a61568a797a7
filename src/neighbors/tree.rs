//! A k-d tree of another package behind the interface of our providers.

use kiddo::{ImmutableKdTree, SquaredEuclidean};

use super::Neighbors;
use super::cell_list::{ghosts, magnitude};
use super::grid::Grid;
use super::placed::{Placed, distance_squared, within};
use crate::domain::{Domain, Image};
use crate::error::{NeighborError, Result};
use crate::particles::{PARTICLES_HIGH, Particles, check_count, reserved};
use crate::scale::Cutoff;
use crate::stencil::Neighbor;

/// The provider over an immutable k-d tree of the package `kiddo`, for sets whose density varies by many orders.
///
/// Sources and their images near the faces are points of the tree, as in a [`CellList`](crate::CellList); the tree finds
/// candidates, which are then measured like everywhere, so that rows are those of
/// [`BruteForce`](crate::BruteForce) bit for bit. Rows come in the order of the tree. Coincident particles are legal:
/// a leaf of this tree grows with them.
///
/// ```
/// use parops::{Cutoff, Domain, KdTree, Neighbors, Particles};
/// let square = Particles::lattice([0.0; 2], [1.0; 2], [16; 2])?;
/// let neighbors = KdTree::build(&square, &Domain::periodic([0.0; 2], [1.0; 2])?, Cutoff(0.0625))?;
/// assert_eq!(neighbors.count(0, 0.0625), 4);
/// # parops::Result::Ok(())
/// ```
///
/// See also: [`CellList`](crate::CellList), four times as fast where particles are spread evenly.
pub struct KdTree<const D: usize> {
    placed: Placed<D>,
    tree: ImmutableKdTree<f64, D>,
    /// What the entries after the sources are images of.
    origins: Vec<(u32, Image)>,
    /// What the search radius is widened by: more than all roundings of the places of images and of the tree.
    slack: f64,
}

impl<const D: usize> KdTree<D> {
    /// The particles are targets and sources.
    ///
    /// # Errors
    /// As [`BruteForce::build`](crate::BruteForce::build),
    /// [`ParticleError::TooMany`](crate::ParticleError::TooMany) where particles and images together are more than
    /// [`PARTICLES_HIGH`](crate::PARTICLES_HIGH), and [`NeighborError::Tree`] where the package refuses them.
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
        let slack = Grid::<D>::slack(magnitude(&placed), placed.cutoff);
        let (positions, origins) = ghosts(&placed, placed.cutoff + slack)?;
        let count = placed.sources.len() + positions.len();
        check_count(count, PARTICLES_HIGH)?;
        let mut entries = reserved(count)?;
        entries.extend_from_slice(&placed.sources);
        entries.extend(positions);
        let tree = ImmutableKdTree::new_from_slice(&entries).map_err(|_| NeighborError::Tree { entries: count })?;
        Ok(Self { placed, tree, origins, slack })
    }
}

impl<const D: usize> Neighbors<D> for KdTree<D> {
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
        let (Some(target), Some(limit)) = (self.placed.targets().get(p), self.placed.limit(cutoff)) else { return };
        let (sources, center) = (self.placed.sources.len(), self.placed.center(p));
        // The tree sums squares in an order of its own.
        let rough = within(cutoff.min(self.placed.cutoff) + self.slack) * (1.0 + 16.0 * f64::EPSILON);
        self.tree.query(target).within::<SquaredEuclidean<f64>>(rough).unsorted().visit(|found| {
            let entry = found.item as usize;
            let (q, image) = match entry.checked_sub(sources) {
                None => (found.item, Image::OWN),
                Some(ghost) => self.origins[ghost],
            };
            let neighbor = self.placed.neighbor(image, target, q);
            if distance_squared(&neighbor.separation) <= limit && !(image == Image::OWN && center == Some(entry)) {
                visit(neighbor);
            }
        });
    }
}
