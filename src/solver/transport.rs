//! How v . grad u is discretized: the seam of every advection scheme.

use super::fields::Fields;
use super::limits::Rate;
use super::term::Site;
use crate::apply::{Report, Rows};
use crate::error::Result;
use crate::neighbors::Neighbors;

/// A scheme for v . grad u.
///
/// [`Pse`](crate::Pse), [`Sph`](crate::Sph) and [`DcPse`](crate::DcPse) of the gradient are central schemes, and so is any
/// other method inside [`Central`](crate::Central); [`UpwindGradient`](crate::UpwindGradient) is the upwind scheme of
/// order 1, [`UpwindDcPse`](crate::UpwindDcPse) those of order 2 and 3, and [`Stabilized`](crate::Stabilized) is central with
/// hyperviscosity.
#[diagnostic::on_unimplemented(
    message = "`{Self}` is no advection scheme in {D} dimensions",
    label = "expected a method for the gradient or an upwind scheme",
    note = "write `DcPse::<Gradient<{D}>, 2>::new()`, `Central(method)` or `UpwindGradient::new(..)`"
)]
pub trait Transport<const D: usize>: Sync {
    /// What is made once for a particle set.
    type Rows<E: Fields>: TransportRows<D, E>;

    /// Sweeps over stored rows a stage.
    const APPLIES: usize;

    /// Makes the rows. `flow` gives the velocity of every particle at the start of the run, for schemes that look
    /// upstream; `steady` says whether it stays, `solenoidal` whether the scene has no term u div v.
    ///
    /// # Errors
    /// As [`Rows::assemble`].
    fn build<E: Fields, P: Neighbors<D>>(
        &self,
        site: &Site<D>,
        flow: impl Fn(usize) -> [f64; D] + Sync,
        steady: bool,
        solenoidal: bool,
        neighbors: &P,
    ) -> Result<Self::Rows<E>>;

    /// The central rows of the gradient at free particles, where the scheme has such rows: for the divergence of a velocity
    /// beside mirrors.
    ///
    /// # Errors
    /// As [`Rows::assemble`].
    fn gradient<P: Neighbors<D>>(&self, site: &Site<D>, neighbors: &P) -> Result<Option<Rows<[f64; D]>>> {
        let _ = (site, neighbors);
        Ok(None)
    }

    /// The numerical viscosity of order 1 along a velocity v at particle p, in the units of a diffusivity; 0 for schemes
    /// of higher order.
    fn viscosity(&self, p: usize, v: &[f64; D]) -> f64 {
        let _ = (p, v);
        0.0
    }
}

/// The rows of an advection scheme: v . grad u for any velocity.
pub trait TransportRows<const D: usize, E: Fields>: Send + Sync {
    /// Computes what depends on the whole field before the particles are gone through.
    fn refresh(&mut self, u: &[E]) {
        let _ = u;
    }

    /// (v . grad u)_p; not a number where v comes from a side without rows.
    fn along(&self, p: usize, v: &[f64; D], u: &[E]) -> E;

    /// The entries (q, A_pq) of v . grad at particle p.
    fn entries(&self, p: usize, v: &[f64; D], entry: &mut dyn FnMut(usize, f64));

    /// How fast the modes of v . grad move where the velocity at particle p is v.
    ///
    /// # Errors
    /// [`SolverError::NoUpstream`](crate::SolverError::NoUpstream) where v comes from a side without rows.
    fn rate(&self, p: usize, v: &[f64; D]) -> Result<Rate>;

    /// The rate of hyperviscosity where the velocity at particle p is v.
    fn hyperviscosity(&self, p: usize, v: &[f64; D]) -> Rate {
        let _ = (p, v);
        Rate::default()
    }

    /// Whether no weight of -v . grad on a neighbor is negative, for any v.
    fn monotone(&self) -> bool {
        false
    }

    /// The divergence of a velocity field at particle p, far from mirrors, by central rows; `None` where the scheme has none.
    fn divergence(&self, p: usize, v: &[[f64; D]]) -> Option<f64> {
        let _ = (p, v);
        None
    }

    /// What the build of the rows found.
    fn report(&self) -> &Report;
}
