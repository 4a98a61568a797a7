//! What one particle carries: one field, or several.

use num_traits::AsPrimitive;

use crate::apply::Field;
use crate::error::Result;
use crate::kernel::MeshKernel;
use crate::mesh::{Mesh, Remeshed};
use crate::scalar::Scalar;
use crate::time::Entry;

/// The value u_p of one particle in a scene: `f64` or `f32` for one field, `[T; F]` for F fields that rows act on in one
/// sweep.
///
/// ```
/// use parops::Fields;
/// let u = [1.0_f32, -2.0];
/// assert_eq!((<[f32; 2]>::FIELDS, u.get(1)), (2, -2.0));
/// ```
pub trait Fields: Entry + PartialEq {
    /// The number type of the fields, and of the weights that act on them.
    type Scalar: Field;

    /// Number of fields F.
    const FIELDS: usize;

    /// The rounding unit eps of the number type.
    const EPSILON: f64;

    /// All fields zero.
    const ZERO: Self;

    /// self + w f, field by field.
    #[must_use]
    fn plus_product(self, w: Self::Scalar, f: Self) -> Self;

    /// self + w (f - g), field by field.
    #[must_use]
    fn plus_difference(self, w: Self::Scalar, f: Self, g: Self) -> Self;

    /// Field i; NaN beyond the last.
    fn get(&self, i: usize) -> f64;

    /// Sets field i, rounded to its number type; does nothing beyond the last.
    fn set(&mut self, i: usize, value: f64);

    /// Adds strengths to a mesh, as [`Mesh::deposit`].
    ///
    /// # Errors
    /// As [`Mesh::deposit`].
    fn deposit<const D: usize, const S: usize>(
        mesh: &Mesh<D>,
        kernel: &impl MeshKernel<f64, S>,
        points: &[[f64; D]],
        strengths: &[Self],
        out: &mut [Self],
    ) -> Result<()>;

    /// Makes particles of the values on a mesh, as [`Mesh::remesh`], with one threshold for all fields.
    ///
    /// # Errors
    /// As [`Mesh::remesh`].
    fn remesh<const D: usize>(mesh: &Mesh<D>, values: &[Self], threshold: f64) -> Result<Remeshed<Self, D>>;
}

macro_rules! one_field {
    ($($t:ty),*) => { $(
        impl Fields for $t {
            type Scalar = $t;
            const FIELDS: usize = 1;
            const EPSILON: f64 = <$t>::EPSILON as f64;
            const ZERO: Self = 0.0;

            #[inline(always)]
            fn plus_product(self, w: $t, f: Self) -> Self {
                self + w * f
            }

            #[inline(always)]
            fn plus_difference(self, w: $t, f: Self, g: Self) -> Self {
                self + w * (f - g)
            }

            #[inline(always)]
            fn get(&self, _: usize) -> f64 {
                self.as_()
            }

            #[inline(always)]
            fn set(&mut self, _: usize, value: f64) {
                *self = <$t as Scalar>::lift(value);
            }

            fn deposit<const D: usize, const S: usize>(
                mesh: &Mesh<D>,
                kernel: &impl MeshKernel<f64, S>,
                points: &[[f64; D]],
                strengths: &[Self],
                out: &mut [Self],
            ) -> Result<()> {
                mesh.deposit(kernel, points, strengths, out)
            }

            fn remesh<const D: usize>(mesh: &Mesh<D>, values: &[Self], threshold: f64) -> Result<Remeshed<Self, D>> {
                mesh.remesh(values, <$t as Scalar>::lift(threshold))
            }
        }

        impl<const F: usize> Fields for [$t; F] {
            type Scalar = $t;
            const FIELDS: usize = F;
            const EPSILON: f64 = <$t>::EPSILON as f64;
            const ZERO: Self = [0.0; F];

            #[inline(always)]
            fn plus_product(mut self, w: $t, f: Self) -> Self {
                self.iter_mut().zip(&f).for_each(|(sum, f)| *sum += w * f);
                self
            }

            #[inline(always)]
            fn plus_difference(mut self, w: $t, f: Self, g: Self) -> Self {
                self.iter_mut().zip(&f).zip(&g).for_each(|((sum, f), g)| *sum += w * (f - g));
                self
            }

            #[inline(always)]
            fn get(&self, i: usize) -> f64 {
                self.as_slice().get(i).map_or(f64::NAN, |&u| u.as_())
            }

            #[inline(always)]
            fn set(&mut self, i: usize, value: f64) {
                if let Some(own) = self.as_mut_slice().get_mut(i) {
                    *own = <$t as Scalar>::lift(value);
                }
            }

            fn deposit<const D: usize, const S: usize>(
                mesh: &Mesh<D>,
                kernel: &impl MeshKernel<f64, S>,
                points: &[[f64; D]],
                strengths: &[Self],
                out: &mut [Self],
            ) -> Result<()> {
                mesh.deposit_fields(kernel, points, strengths, out)
            }

            fn remesh<const D: usize>(mesh: &Mesh<D>, values: &[Self], threshold: f64) -> Result<Remeshed<Self, D>> {
                mesh.remesh_fields(values, [<$t as Scalar>::lift(threshold); F])
            }
        }
    )* };
}

one_field!(f32, f64);
