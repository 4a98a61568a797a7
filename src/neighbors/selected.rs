//! Some targets of another provider.

use super::Neighbors;
use crate::domain::Domain;
use crate::error::{NeighborError, Result};
use crate::stencil::{Neighbor, Stencil};

/// The rows of some targets of another provider, such as the particles at a boundary.
///
/// Target i is the target `targets[i]` of the other: what a method holds per target is counted anew, as is the index an
/// error names. Sources keep their numbers.
///
/// ```
/// use parops::{BruteForce, Cutoff, Domain, Neighbors, Particles, Selected};
/// let set = Particles::lattice([0.0], [1.0], [10])?;
/// let ends = Selected::new(BruteForce::build(&set, &Domain::open(), Cutoff(0.25))?, &[0, 9])?;
/// assert_eq!((ends.targets(), ends.center(1), ends.count(1, 0.25)), (2, Some(9), 2));
/// # parops::Result::Ok(())
/// ```
#[derive(Clone, Debug)]
pub struct Selected<P> {
    all: P,
    targets: Vec<usize>,
}

impl<P> Selected<P> {
    /// The rows of `targets`, in that order.
    ///
    /// # Errors
    /// [`NeighborError::Target`] for one that does not exist.
    pub fn new<const D: usize>(all: P, targets: &[usize]) -> Result<Self>
    where
        P: Neighbors<D>,
    {
        let known = all.targets();
        match targets.iter().find(|&&p| p >= known) {
            Some(&p) => Err(NeighborError::Target { p, targets: known }.into()),
            None => Ok(Self { all, targets: targets.to_vec() }),
        }
    }

    /// The targets, by their numbers in the other provider.
    pub fn selection(&self) -> &[usize] {
        &self.targets
    }
}

impl<P: Neighbors<D>, const D: usize> Neighbors<D> for Selected<P> {
    fn targets(&self) -> usize {
        self.targets.len()
    }

    fn sources(&self) -> usize {
        self.all.sources()
    }

    fn owned(&self) -> usize {
        self.all.owned()
    }

    fn center(&self, i: usize) -> Option<usize> {
        self.targets.get(i).and_then(|&p| self.all.center(p))
    }

    fn cutoff(&self, i: usize) -> f64 {
        self.targets.get(i).map_or(self.all.reach(), |&p| self.all.cutoff(p))
    }

    fn reach(&self) -> f64 {
        self.all.reach()
    }

    fn generation(&self) -> u64 {
        self.all.generation()
    }

    fn domain(&self) -> Option<&Domain<D>> {
        self.all.domain()
    }

    fn for_each(&self, i: usize, cutoff: f64, visit: impl FnMut(Neighbor<D>)) {
        if let Some(&p) = self.targets.get(i) {
            self.all.for_each(p, cutoff, visit);
        }
    }

    fn gather(&self, i: usize, cutoff: f64, row: &mut Stencil<D>) {
        row.reset(i, self.center(i), cutoff);
        if let Some(&p) = self.targets.get(i) {
            self.all.gather(p, cutoff, row);
            row.rename(i);
        }
    }

    fn count(&self, i: usize, cutoff: f64) -> usize {
        self.targets.get(i).map_or(0, |&p| self.all.count(p, cutoff))
    }
}
