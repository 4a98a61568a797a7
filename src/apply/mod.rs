//! Operators applied to fields: stored rows, or weights made anew for every application.

mod advect;
mod assemble;
pub(crate) mod blocks;
mod composed;
mod export;
mod fields;
mod histogram;
mod hyperviscosity;
mod matrix_free;
mod moving;
mod pairs;
mod report;
mod rows;
#[cfg(feature = "serde")]
mod saved;
mod sided;
mod splice;
mod strided;
mod sweep;
mod symmetric;
mod upwind;
mod upwind_dcpse;
mod vector;
pub(crate) mod worker;

pub use advect::Advect;
pub use export::RawRows;
pub use histogram::Histogram;
pub use hyperviscosity::Hyperviscosity;
pub use matrix_free::MatrixFree;
pub use moving::MovingMethod;
pub use report::Report;
pub use rows::{Row, Rows};
pub use sided::SidedRows;
pub use strided::Strided;
pub use symmetric::SymmetricPse;
pub use upwind::UpwindRows;
pub use upwind_dcpse::UpwindDcPse;
pub use vector::Vector;

use num_traits::AsPrimitive;

use crate::error::{ApplyError, Error, Result};
use crate::scalar::Scalar;

/// The number type of fields and stored weights: `f32` or `f64`.
///
/// Weights are always computed in `f64` and rounded to it once.
pub trait Field: Scalar + Default + AsPrimitive<f64> {}

impl Field for f32 {}
impl Field for f64 {}

/// A linear operator with one output, applied to a field: out_p = (L f)_p. Object-safe.
pub trait Apply<T: Field>: Sync {
    /// Number of values written: targets.
    fn targets(&self) -> usize;

    /// Number of values read: sources.
    fn sources(&self) -> usize;

    /// Writes L f into `out`. The order of summation is that of the rows, for any number of threads.
    ///
    /// # Errors
    /// [`ApplyError::Input`] and [`ApplyError::Output`] for wrong lengths; [`ApplyError::Field`] naming the first
    /// particle whose value is not finite; `out` is then as it was. [`ApplyError::Overflow`] naming the first target
    /// whose result is not finite.
    fn apply(&self, f: &[T], out: &mut [T]) -> Result<()>;

    /// du = L u as a right-hand side `f(t, &u, &mut du)`, for [`integrate`](crate::integrate), the steppers, and any
    /// other integrator that calls a closure; a state is a slice, a vector or an array. From a `dyn Apply` write
    /// `|_, u, du| operator.apply(u, du)`.
    ///
    /// # Errors
    /// Of the closure: as [`apply`](Self::apply).
    ///
    /// ```
    /// use parops::{Apply, CsrMatrix, Plan, Rk4, integrate};
    /// let decay = CsrMatrix::from_triplets(2, 2, [(0, 0, -1.0), (1, 1, -2.0)])?;
    /// let mut u = vec![1.0, 1.0];
    /// integrate(&mut Rk4::new(), &mut u, &Plan::new(0.0, 1.0, 0.01)?, decay.rhs(), |_, _, _| {})?;
    /// assert!((u[1] - (-2.0_f64).exp()).abs() < 1e-8);
    /// # parops::Result::Ok(())
    /// ```
    fn rhs<U>(&self) -> impl Fn(f64, &U, &mut U) -> Result<()>
    where
        Self: Sized,
        U: AsRef<[T]> + AsMut<[T]> + ?Sized,
    {
        |_, u, du| self.apply(u.as_ref(), du.as_mut())
    }
}

/// Checks a field and an output before anything is written.
pub(crate) fn check<T: Field, In: AsRef<[T]>, Out>(
    f: &[In],
    sources: usize,
    out: &[Out],
    targets: usize,
) -> Result<()> {
    if f.len() != sources {
        return Err(ApplyError::Input { found: f.len(), needed: sources }.into());
    }
    if out.len() != targets {
        return Err(ApplyError::Output { found: out.len(), needed: targets }.into());
    }
    let bad = |values: &In| values.as_ref().iter().copied().find(|x| !x.is_finite());
    match f.iter().enumerate().find_map(|(p, values)| bad(values).map(|x| (p, x))) {
        Some((p, value)) => Err(Error::from(ApplyError::Field { value: value.as_() }).at(p)),
        None => Ok(()),
    }
}

/// Refuses results that are not finite, which a finite field and finite weights give only by overflow.
pub(crate) fn check_results<T: Field, Out: AsRef<[T]>>(out: &[Out]) -> Result<()> {
    let bad = |values: &Out| values.as_ref().iter().copied().find(|x| !x.is_finite());
    match out.iter().enumerate().find_map(|(p, values)| bad(values).map(|x| (p, x))) {
        Some((p, value)) => Err(Error::from(ApplyError::Overflow { value: value.as_() }).at(p)),
        None => Ok(()),
    }
}

/// A scalar field seen as a field of one value per particle.
pub(crate) fn scalars<T: Field>(f: &[T]) -> &[[T; 1]] {
    f.as_chunks().0
}
