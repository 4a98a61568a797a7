//! Methods for particles that move: what of them follows the set.

use crate::domain::Domain;
use crate::error::{OperatorError, Result};
use crate::kernel::Kernel;
use crate::moment::MomentSolver;
use crate::operator::{DcPse, GROWTH, Method, Operator, Pse};
use crate::particles::Particles;
use crate::scale::{Cutoff, Spacing, Volumes};

/// A method for one operator that serves a set while it moves and is made anew.
///
/// Implemented by [`Pse`] with one epsilon and by [`DcPse`]; a method of one's own needs its order, its cutoff, and what a
/// lattice must have for it.
pub trait MovingMethod<const D: usize>: Method<D, Out = [f64; 1]> + Clone + Send {
    /// The convergence order r.
    fn order(&self) -> u32;

    /// The cutoff of its rows on this set, and the reach that rows of a distorted set may grow to.
    ///
    /// # Errors
    /// Where the set has too few particles for the method.
    fn reach(&self, particles: &Particles<D>, domain: &Domain<D>) -> Result<[Cutoff; 2]>;

    /// Takes the volumes of now.
    fn set_volumes(&mut self, volumes: &Volumes) {
        let _ = volumes;
    }

    /// Refuses a lattice on which the rows would be illegal.
    ///
    /// # Errors
    /// For a spacing that is too wide for the overlap of the kernel, or for the neighbors that the cutoff must hold.
    fn admits(&self, spacing: Spacing, cutoff: Cutoff) -> Result<()>;

    /// Whether its rows have condition numbers.
    fn conditioned(&self) -> bool {
        false
    }
}

impl<K: Kernel<f64, D> + Clone, const D: usize> MovingMethod<D> for Pse<K> {
    fn order(&self) -> u32 {
        self.design::<D>().order
    }

    fn reach(&self, _: &Particles<D>, _: &Domain<D>) -> Result<[Cutoff; 2]> {
        Ok([self.cutoff(), self.cutoff()])
    }

    fn set_volumes(&mut self, volumes: &Volumes) {
        self.replace_volumes(volumes);
    }

    fn admits(&self, spacing: Spacing, _: Cutoff) -> Result<()> {
        let design = self.design::<D>();
        let (h_over_epsilon, limit) = (spacing.0 / design.epsilon, design.overlap_limit);
        // A limit that is met by design may be exceeded by the rounding of h.
        if h_over_epsilon <= limit * (1.0 + 8.0 * f64::EPSILON) {
            return Ok(());
        }
        Err(OperatorError::Overlap { h_over_epsilon, limit }.into())
    }
}

impl<Op, const R: u32, S, const D: usize> MovingMethod<D> for DcPse<Op, R, S>
where
    Self: Method<D, Out = [f64; 1]> + Clone + Send,
    Op: Operator<D, Out = [f64; 1]>,
    S: MomentSolver,
{
    fn order(&self) -> u32 {
        self.own_order()
    }

    fn reach(&self, particles: &Particles<D>, domain: &Domain<D>) -> Result<[Cutoff; 2]> {
        let cutoff = self.cutoff_in(particles, domain)?;
        Ok([cutoff, Cutoff(GROWTH * GROWTH * cutoff.0)])
    }

    fn admits(&self, spacing: Spacing, cutoff: Cutoff) -> Result<()> {
        let (conditions, needed) = (self.most_conditions()?, self.fewest_neighbors()?);
        let neighbors = lattice_points::<D>(cutoff.0 / spacing.0) - 1;
        if neighbors >= needed {
            return Ok(());
        }
        Err(OperatorError::TooFew { neighbors, conditions, needed }.into())
    }

    fn conditioned(&self) -> bool {
        true
    }
}

/// Points of the integer lattice within this radius of one of them, itself included; none are counted beyond 2^20.
fn lattice_points<const D: usize>(radius: f64) -> usize {
    let square = radius * radius * (1.0 + 8.0 * f64::EPSILON);
    let mut reached = vec![0.0];
    for _ in 0..D {
        let mut next = Vec::new();
        for length in reached {
            let along = (square - length).max(0.0).sqrt().floor();
            let mut i = -along;
            while i <= along && next.len() < 1 << 20 {
                next.push(length + i * i);
                i += 1.0;
            }
        }
        reached = next;
    }
    reached.len()
}

#[cfg(test)]
mod tests {
    use super::lattice_points;

    #[test]
    fn lattice_points_in_a_ball_are_counted() {
        assert_eq!((lattice_points::<1>(2.5), lattice_points::<2>(1.0), lattice_points::<2>(1.5)), (5, 5, 9));
        assert_eq!((lattice_points::<3>(1.0), lattice_points::<3>(1.5), lattice_points::<2>(0.5)), (7, 19, 1));
    }
}
