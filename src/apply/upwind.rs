//! Rows of one-sided derivatives, and those that serve any velocity.

use super::blocks::each_row;
use super::sweep::Sweep;
use super::{Field, MatrixFree, Report, Rows, check, check_results, scalars};
use crate::error::{Error, OperatorError, Result};
use crate::neighbors::Neighbors;
use crate::operator::{OneSided, Upwind, UpwindGradient};
use crate::stencil::Side;

macro_rules! one_output {
    ($($name:ident)*) => { $(
        impl<const D: usize> $name<D> {
            /// Builds the rows of this operator, with `f64` weights; [`Rows::assemble`] rounds them to another type.
            ///
            /// # Errors
            /// As [`Rows::assemble`]; [`OperatorError::EmptySide`] naming the particle, axis and side without a source.
            pub fn assemble<P: Neighbors<D>>(&self, neighbors: &P) -> Result<Rows> {
                Rows::assemble(self, neighbors)
            }

            /// The same operator without stored weights: they are computed anew in every application.
            ///
            /// # Errors
            /// As [`assemble`](Self::assemble).
            pub fn matrix_free<'a, P: Neighbors<D>>(&'a self, neighbors: &'a P) -> Result<MatrixFree<'a, D, Self, P>> {
                MatrixFree::new(self, neighbors)
            }
        }
    )* };
}

one_output!(OneSided Upwind);

impl<const D: usize> UpwindGradient<D> {
    /// Builds the rows, with `f64` weights; [`UpwindRows::assemble`] rounds them to another type.
    ///
    /// # Errors
    /// As [`UpwindRows::assemble`].
    pub fn assemble<P: Neighbors<D>>(&self, neighbors: &P) -> Result<UpwindRows<D>> {
        UpwindRows::assemble(self, neighbors)
    }
}

/// Rows of [`UpwindGradient`]: v . grad f upwind, for a velocity given with every application.
///
/// out_p = sum_q sum_i min(v_i(p) w_pq,i, 0) (f_q - f_p): the weights of the left are below zero and those of the right
/// above, so that the minimum takes the side each component comes from. The same bits as the rows of [`Upwind`] for the
/// same velocities. D weights a pair.
///
/// ```
/// use parops::{CellList, Domain, Particles, UpwindGradient};
/// let ring = Particles::lattice([0.0], [1.0], [50])?;
/// let gradient = UpwindGradient::new(ring.spacing()?.epsilon(1.0)?, ring.volumes()?);
/// let neighbors = CellList::build(&ring, &Domain::periodic([0.0], [1.0])?, gradient.cutoff())?;
/// let rows = gradient.assemble(&neighbors)?;
/// let mut u = vec![0.0; 50];
/// u[20] = 1.0;
/// let mut du = vec![0.0; 50];
/// rows.apply(&vec![[1.0]; 50], &u, &mut du)?;
/// assert!(du[21] < 0.0 && du[19] == 0.0);
/// rows.apply(&vec![[-1.0]; 50], &u, &mut du)?;
/// assert!(du[19] < 0.0 && du[21] == 0.0);
/// # parops::Result::Ok(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct UpwindRows<const D: usize, T: Field = f64>(Rows<[f64; D], T>);

impl<const D: usize, T: Field> UpwindRows<D, T> {
    /// Builds the rows over `neighbors`, with weights rounded to `T`.
    ///
    /// # Errors
    /// As [`Rows::assemble`]; [`OperatorError::OddImage`] for images behind an odd number of odd mirrors.
    pub fn assemble<P: Neighbors<D>>(gradient: &UpwindGradient<D>, neighbors: &P) -> Result<Self> {
        Ok(Self(Rows::assemble(gradient, neighbors)?))
    }

    /// What the build found; the sum of absolute weights is that of one axis and both sides, at a velocity of 1.
    pub fn report(&self) -> &Report {
        self.0.report()
    }

    /// Number of targets.
    pub fn targets(&self) -> usize {
        self.0.targets()
    }

    /// Number of sources.
    pub fn sources(&self) -> usize {
        self.0.sources()
    }

    /// Writes v . grad f into `out`, `v` and `out` one per target. Allocates nothing.
    ///
    /// # Errors
    /// As [`Rows::apply_along`]; [`OperatorError::EmptySide`] naming the first target with a velocity component from a
    /// side without sources.
    pub fn apply(&self, v: &[[T; D]], f: &[T], out: &mut [T]) -> Result<()> {
        check(scalars(f), self.0.sources(), out, self.targets())?;
        check(v, self.targets(), out, self.targets())?;
        each_row(out, |p| self.row(p, &v[p], f).unwrap_or(T::lift(f64::NAN)));
        check_results(scalars(out)).map_err(|error| self.named(error, v))
    }

    /// One row; `None` where a side is empty that a component comes from.
    #[inline(always)]
    fn row(&self, p: usize, v: &[T; D], f: &[T]) -> Option<T> {
        let zero = (T::zero(), v.map(|v| v == T::zero()));
        let (sum, served) = self.0.stored(p).sum(
            zero,
            |q| [f[q]],
            |(sum, served), w, difference| {
                let mut weight = T::zero();
                for ((&w, &v), served) in w.iter().zip(v).zip(served) {
                    if serves(w, v) {
                        weight += w * v;
                        *served = true;
                    }
                }
                *sum += weight * difference[0];
            },
        );
        served.iter().all(|&served| served).then_some(sum)
    }

    /// The refusal of a target whose result is not finite: what it lacks, if anything.
    fn named(&self, error: Error, v: &[[T; D]]) -> Error {
        let Some(p) = error.particle() else { return error };
        let (Some(v), Some(row)) = (v.get(p), self.0.row(p)) else { return error };
        let served = |axis: usize| row.weights.iter().any(|w| serves(w[axis], v[axis]));
        for (axis, &v) in v.iter().enumerate() {
            if let Some(side) = Side::upwind(v.as_()).filter(|_| !served(axis)) {
                return Error::from(OperatorError::EmptySide { axis, side, neighbors: row.sources.len() }).at(p);
            }
        }
        error
    }
}

/// Whether a weight belongs to the side that v comes from. Their product would say so too, but for the smallest v.
#[inline(always)]
fn serves<T: Field>(w: T, v: T) -> bool {
    (w < T::zero() && v > T::zero()) || (w > T::zero() && v < T::zero())
}
