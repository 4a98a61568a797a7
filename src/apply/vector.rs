//! Gradient rows applied to vector fields: curl and Jacobian, beside the divergence.

use super::blocks::each_row;
use super::sweep::Sweep;
use super::{Field, MatrixFree, Rows, check, check_results, scalars};
use crate::error::{Error, Result};
use crate::neighbors::Neighbors;
use crate::operator::Method;

/// A vector that has a curl: `[T; 2]`, whose curl is a number, and `[T; 3]`.
#[diagnostic::on_unimplemented(message = "`{Self}` has no curl", note = "a curl exists in two and three dimensions")]
pub trait Vector<T: Field>: Copy + Send + Sync {
    /// `T` in the plane, `[T; 3]` in space.
    type Curl: Copy + Send + Default;

    /// Adds w x f: of the weights of a gradient and a vector, their share of the curl.
    fn add_cross(sum: &mut Self::Curl, w: &Self, f: &Self);

    /// Refuses curls that are not finite.
    ///
    /// # Errors
    /// [`ApplyError::Overflow`](crate::ApplyError::Overflow) naming the first target.
    fn check(curls: &[Self::Curl]) -> Result<()>;
}

impl<T: Field> Vector<T> for [T; 2] {
    type Curl = T;

    #[inline(always)]
    fn add_cross(sum: &mut T, w: &Self, f: &Self) {
        *sum += w[0] * f[1] - w[1] * f[0];
    }

    fn check(curls: &[T]) -> Result<()> {
        check_results(scalars(curls))
    }
}

impl<T: Field> Vector<T> for [T; 3] {
    type Curl = [T; 3];

    #[inline(always)]
    fn add_cross(sum: &mut [T; 3], w: &Self, f: &Self) {
        for (axis, sum) in sum.iter_mut().enumerate() {
            let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
            *sum += w[i] * f[j] - w[j] * f[i];
        }
    }

    fn check(curls: &[[T; 3]]) -> Result<()> {
        check_results(curls)
    }
}

impl<const K: usize, T: Field> Rows<[f64; K], T> {
    /// The curl of a vector field, for gradient rows: `out[p]` = (D_0 f_1 - D_1 f_0)_p in the plane,
    /// (D_1 f_2 - D_2 f_1, D_2 f_0 - D_0 f_2, D_0 f_1 - D_1 f_0)_p in space.
    ///
    /// # Errors
    /// As [`Apply::apply`](super::Apply::apply).
    pub fn apply_curl(&self, f: &[[T; K]], out: &mut [<[T; K] as Vector<T>>::Curl]) -> Result<()>
    where
        [T; K]: Vector<T>,
    {
        check(f, self.sources, out, self.targets())?;
        each_row(out, |p| self.stored(p).sum(Default::default(), |q| f[q], Vector::add_cross));
        <[T; K] as Vector<T>>::check(out)
    }

    /// All K outputs of F fields, `out[p][i][k]` = (L_k f_i)_p: the Jacobian of a vector field, for gradient rows. Each
    /// field gets the bits that [`apply_all`](Self::apply_all) gives it alone.
    ///
    /// # Errors
    /// As [`Apply::apply`](super::Apply::apply).
    pub fn apply_jacobian<const F: usize>(&self, f: &[[T; F]], out: &mut [[[T; K]; F]]) -> Result<()> {
        check(f, self.sources, out, self.targets())?;
        each_row(out, |p| self.stored(p).jacobian(f));
        check_jacobian(out)
    }
}

impl<const D: usize, const K: usize, M: Method<D, Out = [f64; K]>, P: Neighbors<D>> MatrixFree<'_, D, M, P> {
    /// The curl of a vector field, as [`Rows::apply_curl`].
    ///
    /// # Errors
    /// As [`Apply::apply`](super::Apply::apply).
    pub fn apply_curl<T: Field>(&self, f: &[[T; K]], out: &mut [<[T; K] as Vector<T>>::Curl]) -> Result<()>
    where
        [T; K]: Vector<T>,
    {
        check(f, self.neighbors.sources(), out, self.neighbors.targets())?;
        self.each(out, |_, worker| worker.sum(Default::default(), |q| f[q], Vector::add_cross))?;
        <[T; K] as Vector<T>>::check(out)
    }

    /// All K outputs of F fields, as [`Rows::apply_jacobian`].
    ///
    /// # Errors
    /// As [`Apply::apply`](super::Apply::apply).
    pub fn apply_jacobian<T: Field, const F: usize>(&self, f: &[[T; F]], out: &mut [[[T; K]; F]]) -> Result<()> {
        check(f, self.neighbors.sources(), out, self.neighbors.targets())?;
        self.each(out, |_, worker| worker.jacobian(f))?;
        check_jacobian(out)
    }
}

fn check_jacobian<T: Field, const K: usize, const F: usize>(out: &[[[T; K]; F]]) -> Result<()> {
    // One target is F K values without a gap; an error counts chunks of F rows as one target.
    check_results(out.as_flattened()).map_err(|error: Error| match error.particle() {
        Some(row) => error.at(row / F.max(1)),
        None => error,
    })
}
