//! The neighbors on the side a velocity comes from.

use super::Neighbors;
use super::placed::{distance_squared, within};
use crate::domain::Domain;
use crate::error::{NeighborError, Result};
use crate::particles::reserved;
use crate::scale::Spacing;
use crate::stencil::{Neighbor, Side, Stencil};

/// The neighbors of another provider seen from one side along one axis, as many for each target as were asked for.
///
/// [`half`](Self::half): those on that side of the plane through the target. [`biased`](Self::biased): those within the
/// cutoff of the point m one spacing h from the target on that side; then [`Stencil::middle`] is x_p - m. The cutoff of
/// a target is the distance of its neighbor number k, whole shells; where the provider reaches fewer it is the reach.
/// Neighbors in the plane itself belong to neither half.
///
/// ```
/// use parops::{Domain, Nearest, Neighbors, Particles, Side, Upstream};
/// let set = Particles::jittered([0.0; 2], [1.0; 2], [12; 2], 0.3, 1)?;
/// let around = Nearest::build(&set, &Domain::periodic([0.0; 2], [1.0; 2])?, 20)?;
/// let left = Upstream::half(&around, 0, Side::Left, 8)?;
/// assert!((0..144).all(|p| left.count(p, left.cutoff(p)) == 8));
/// left.for_each(7, left.cutoff(7), |neighbor| assert!(neighbor.separation[0] > 0.0));
/// # parops::Result::Ok(())
/// ```
#[derive(Clone, Debug)]
pub struct Upstream<'a, P> {
    provider: &'a P,
    axis: usize,
    side: Side,
    /// From the target to the middle of its stencil; `None` for half-stencils.
    shift: Option<f64>,
    cutoffs: Vec<f64>,
}

/// As in `Nearest`: a neighbor as far away as the last one but for rounding is in.
const SHELL: f64 = 1.0 + 1e-9;

impl<'a, P> Upstream<'a, P> {
    /// The k nearest neighbors on this side of the plane through the target.
    ///
    /// # Errors
    /// [`NeighborError::Axis`] for an axis that does not exist; [`ParticleError::Memory`](crate::ParticleError::Memory)
    /// where there is no room for a cutoff per target.
    pub fn half<const D: usize>(provider: &'a P, axis: usize, side: Side, k: usize) -> Result<Self>
    where
        P: Neighbors<D>,
    {
        Self::new(provider, axis, side, None, k)
    }

    /// The k neighbors nearest to the point one spacing from the target on this side.
    ///
    /// # Errors
    /// As [`half`](Self::half).
    pub fn biased<const D: usize>(provider: &'a P, axis: usize, side: Side, h: Spacing, k: usize) -> Result<Self>
    where
        P: Neighbors<D>,
    {
        Self::new(provider, axis, side, Some(h.0), k)
    }

    fn new<const D: usize>(provider: &'a P, axis: usize, side: Side, shift: Option<f64>, k: usize) -> Result<Self>
    where
        P: Neighbors<D>,
    {
        if axis >= D {
            return Err(NeighborError::Axis { axis, axes: D }.into());
        }
        let targets = provider.targets();
        let mut upstream = Self { provider, axis, side, shift, cutoffs: reserved(targets)? };
        let (mut distances, k) = (Vec::new(), k.max(1));
        let reach = upstream.reach();
        for p in 0..targets {
            let mut cutoff = (provider.cutoff(p) - shift.unwrap_or(0.0)).clamp(0.0, reach);
            let found = loop {
                distances.clear();
                let middle = upstream.middle();
                let add = |neighbor: Neighbor<D>| distances.push(distance_squared(&away(&neighbor, &middle)));
                upstream.for_each(p, cutoff, add);
                if distances.len() >= k {
                    let (_, last, _) = distances.select_nth_unstable_by(k - 1, f64::total_cmp);
                    break (last.sqrt() * SHELL).min(reach);
                }
                if cutoff >= reach {
                    break reach;
                }
                cutoff = reach;
            };
            upstream.cutoffs.push(found);
        }
        Ok(upstream)
    }

    /// The axis.
    pub fn axis(&self) -> usize {
        self.axis
    }

    /// The side.
    pub fn side(&self) -> Side {
        self.side
    }

    /// x_p - m.
    #[inline(always)]
    fn middle<const D: usize>(&self) -> [f64; D] {
        let mut middle = [0.0; D];
        if let (Some(shift), Some(middle)) = (self.shift, middle.get_mut(self.axis)) {
            *middle = self.side.sign() * shift;
        }
        middle
    }
}

/// x_m - x_q.
#[inline(always)]
fn away<const D: usize>(neighbor: &Neighbor<D>, middle: &[f64; D]) -> [f64; D] {
    std::array::from_fn(|axis| neighbor.separation[axis] - middle[axis])
}

impl<P: Neighbors<D>, const D: usize> Neighbors<D> for Upstream<'_, P> {
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
        self.cutoffs.get(p).copied().unwrap_or(0.0)
    }

    fn reach(&self) -> f64 {
        (self.provider.reach() - self.shift.unwrap_or(0.0)).max(0.0)
    }

    fn generation(&self) -> u64 {
        self.provider.generation()
    }

    fn domain(&self) -> Option<&Domain<D>> {
        self.provider.domain()
    }

    fn for_each(&self, p: usize, cutoff: f64, mut visit: impl FnMut(Neighbor<D>)) {
        match self.shift {
            None => {
                let (axis, sign) = (self.axis, self.side.sign());
                self.provider.for_each(p, cutoff, |neighbor| {
                    if neighbor.separation.get(axis).is_some_and(|x| sign * x > 0.0) {
                        visit(neighbor);
                    }
                });
            }
            Some(shift) => {
                let (middle, limit) = (self.middle(), within(cutoff));
                self.provider.for_each(p, (cutoff + shift) * SHELL, |neighbor| {
                    if distance_squared(&away(&neighbor, &middle)) <= limit {
                        visit(neighbor);
                    }
                });
            }
        }
    }

    fn gather(&self, p: usize, cutoff: f64, row: &mut Stencil<D>) {
        row.reset(p, self.center(p), cutoff);
        row.set_middle(self.middle());
        self.for_each(p, cutoff, |neighbor| row.push(neighbor));
    }
}
