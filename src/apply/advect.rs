//! The one seam of advection: v . grad f for velocities that come with every application.

use super::{Field, Rows, UpwindRows};
use crate::error::Result;

/// An operator v . grad f whose rows do not depend on v: central rows of a gradient, or upwind rows.
///
/// `velocities` and `out` are one per target, `f` one per source; a sweep reads f once and allocates nothing. Of
/// du/dt + v . grad u = 0 the right-hand side is minus the result. Object-safe.
///
/// ```
/// use parops::{Advect, CellList, DcPse, Domain, Gradient, Nearest, Particles, UpwindDcPse};
/// let set = Particles::jittered([0.0; 2], [1.0; 2], [14; 2], 0.3, 1)?;
/// let torus = Domain::periodic([0.0; 2], [1.0; 2])?;
/// let central = DcPse::<Gradient<2>, 2>::new().assemble(&Nearest::build(&set, &torus, 24)?)?;
/// let upwind = UpwindDcPse::half_stencils().assemble(&Nearest::build(&set, &torus, 24)?)?;
/// let f: Vec<f64> = set.points().iter().map(|x| 2.0 * x[0] - x[1]).collect();
/// let v = vec![[1.0, -3.0]; f.len()];
/// let mut out = vec![0.0; f.len()];
/// // A particle whose stencil does not cross the faces.
/// let inner = set.points().iter().position(|x| x.iter().all(|x| (0.4..0.6).contains(x))).unwrap();
/// for rows in [&central as &dyn Advect<2, f64>, &upwind] {
///     rows.advect(&v, &f, &mut out)?;
///     assert!((out[inner] - 5.0).abs() < 1e-10);
/// }
/// # parops::Result::Ok(())
/// ```
pub trait Advect<const D: usize, T: Field>: Sync {
    /// Number of values written: targets.
    fn targets(&self) -> usize;

    /// Number of values read: sources.
    fn sources(&self) -> usize;

    /// Writes v . grad f into `out`.
    ///
    /// # Errors
    /// As [`Rows::apply_along`]; of upwind rows also [`OperatorError::EmptySide`](crate::OperatorError::EmptySide) naming
    /// the first target with a velocity component from a side without neighbors.
    fn advect(&self, velocities: &[[T; D]], f: &[T], out: &mut [T]) -> Result<()>;
}

impl<const D: usize, T: Field> Advect<D, T> for Rows<[f64; D], T> {
    fn targets(&self) -> usize {
        self.targets()
    }

    fn sources(&self) -> usize {
        self.sources()
    }

    fn advect(&self, velocities: &[[T; D]], f: &[T], out: &mut [T]) -> Result<()> {
        self.apply_along(velocities, f, out)
    }
}

impl<const D: usize, T: Field> Advect<D, T> for UpwindRows<D, T> {
    fn targets(&self) -> usize {
        self.targets()
    }

    fn sources(&self) -> usize {
        self.sources()
    }

    fn advect(&self, velocities: &[[T; D]], f: &[T], out: &mut [T]) -> Result<()> {
        self.apply(velocities, f, out)
    }
}
