//! A provider whose rows are sorted by separation, whatever the provider beneath.

use super::{NeighborList, Neighbors};
use crate::domain::Domain;
use crate::error::Result;
use crate::stencil::{Neighbor, Stencil};

/// The neighbors of another provider, each row sorted by separation; see [`Neighbors::canonical`].
#[derive(Clone, Debug)]
pub struct Canonical<P>(pub(super) P);

impl<P: Neighbors<D>, const D: usize> Neighbors<D> for Canonical<P> {
    fn targets(&self) -> usize {
        self.0.targets()
    }

    fn sources(&self) -> usize {
        self.0.sources()
    }

    fn owned(&self) -> usize {
        self.0.owned()
    }

    fn center(&self, p: usize) -> Option<usize> {
        self.0.center(p)
    }

    fn cutoff(&self, p: usize) -> f64 {
        self.0.cutoff(p)
    }

    fn reach(&self) -> f64 {
        self.0.reach()
    }

    fn generation(&self) -> u64 {
        self.0.generation()
    }

    fn domain(&self) -> Option<&Domain<D>> {
        self.0.domain()
    }

    fn for_each(&self, p: usize, cutoff: f64, visit: impl FnMut(Neighbor<D>)) {
        let mut row = Stencil::default();
        self.gather(p, cutoff, &mut row);
        row.iter().for_each(visit);
    }

    fn gather(&self, p: usize, cutoff: f64, row: &mut Stencil<D>) {
        self.0.gather(p, cutoff, row);
        row.sort();
    }

    fn count(&self, p: usize, cutoff: f64) -> usize {
        self.0.count(p, cutoff)
    }
}

/// A shared reference to a provider is that provider.
impl<P: Neighbors<D>, const D: usize> Neighbors<D> for &P {
    fn targets(&self) -> usize {
        (**self).targets()
    }

    fn sources(&self) -> usize {
        (**self).sources()
    }

    fn owned(&self) -> usize {
        (**self).owned()
    }

    fn center(&self, p: usize) -> Option<usize> {
        (**self).center(p)
    }

    fn cutoff(&self, p: usize) -> f64 {
        (**self).cutoff(p)
    }

    fn reach(&self) -> f64 {
        (**self).reach()
    }

    fn generation(&self) -> u64 {
        (**self).generation()
    }

    fn domain(&self) -> Option<&Domain<D>> {
        (**self).domain()
    }

    fn for_each(&self, p: usize, cutoff: f64, visit: impl FnMut(Neighbor<D>)) {
        (**self).for_each(p, cutoff, visit);
    }

    fn gather(&self, p: usize, cutoff: f64, row: &mut Stencil<D>) {
        (**self).gather(p, cutoff, row);
    }

    fn count(&self, p: usize, cutoff: f64) -> usize {
        (**self).count(p, cutoff)
    }

    fn stored(&self) -> Result<NeighborList<D>> {
        (**self).stored()
    }
}
