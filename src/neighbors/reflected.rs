//! Neighbors with the signs of a field that a mirror turns along one axis, as it turns a component of a velocity.

use super::Neighbors;
use crate::domain::Domain;
use crate::stencil::Neighbor;

/// The neighbors of another provider, whose targets are these points, an image having the sign -1 where it stands behind a
/// mirror of one axis and +1 where it does not; without an axis all have +1.
pub(crate) struct Reflected<'a, P, const D: usize> {
    provider: &'a P,
    points: &'a [[f64; D]],
    axis: Option<usize>,
    far: &'a [bool],
}

impl<'a, P: Neighbors<D>, const D: usize> Reflected<'a, P, D> {
    pub(crate) fn new(provider: &'a P, points: &'a [[f64; D]], axis: Option<usize>, far: &'a [bool]) -> Self {
        Self { provider, points, axis, far }
    }

    /// The place of the mirror of this axis that a neighbor of target p stands behind.
    pub(crate) fn mirror(&self, p: usize, axis: usize, neighbor: &Neighbor<D>) -> Option<f64> {
        let (x, y) = (self.points.get(p)?[axis], self.points.get(neighbor.q)?[axis]);
        // Rounding is all that parts a separation from that of the image it belongs to.
        let miss = |separation: f64| (neighbor.separation[axis] - separation).abs();
        let own = miss(x - y);
        self.provider.domain()?.mirrors(axis).find(|face| miss((x - face) + (y - face)) < own)
    }
}

impl<P: Neighbors<D>, const D: usize> Neighbors<D> for Reflected<'_, P, D> {
    fn targets(&self) -> usize {
        self.provider.targets()
    }

    fn sources(&self) -> usize {
        self.provider.sources()
    }

    fn owned(&self) -> usize {
        self.provider.owned()
    }

    fn center(&self, p: usize) -> Option<usize> {
        self.provider.center(p)
    }

    fn cutoff(&self, p: usize) -> f64 {
        self.provider.cutoff(p)
    }

    fn reach(&self) -> f64 {
        self.provider.reach()
    }

    fn generation(&self) -> u64 {
        self.provider.generation()
    }

    fn domain(&self) -> Option<&Domain<D>> {
        self.provider.domain()
    }

    fn for_each(&self, p: usize, cutoff: f64, mut visit: impl FnMut(Neighbor<D>)) {
        if self.far.get(p).copied().unwrap_or(false) {
            return;
        }
        self.provider.for_each(p, cutoff, |neighbor| {
            let behind = self.axis.is_some_and(|axis| self.mirror(p, axis, &neighbor).is_some());
            visit(Neighbor { sign: if behind { -1 } else { 1 }, ..neighbor });
        });
    }
}
