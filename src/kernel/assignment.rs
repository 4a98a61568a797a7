//! Assignment kernels of order 0, 1 and 2: a particle that is a point, a top hat, a pyramid.

use super::mesh_kernel::MeshKernel;
use crate::scalar::Scalar;

/// Nearest grid point, order 0: all of a particle goes to the nearest node. K = 1 for |s| < 1/2.
///
/// On a mesh of cells this is the cell the particle is in. Conserves the strength, not its center.
///
/// Source: exercise sheet 003, exercise 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Ngp;

impl<T: Scalar> MeshKernel<T, 1> for Ngp {
    #[inline(always)]
    fn weights(&self, _: T) -> [T; 1] {
        [T::one()]
    }

    fn exactness(&self) -> u32 {
        0
    }
}

/// Cloud in cell, order 1: K(s) = 1 - |s| for |s| < 1, linear interpolation.
///
/// Conserves strength and center; the second moment grows by f (1 - f), f = u + 1/2.
///
/// Source: exercise sheet 003, exercise 2; errata 46.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cic;

impl<T: Scalar> MeshKernel<T, 2> for Cic {
    #[inline(always)]
    fn weights(&self, u: T) -> [T; 2] {
        let half = T::lift(0.5);
        [half - u, half + u]
    }

    fn exactness(&self) -> u32 {
        1
    }
}

/// Triangular shaped cloud, order 2: K(s) = 3/4 - s^2 for |s| < 1/2, (3/2 - |s|)^2/2 for |s| < 3/2.
///
/// Conserves strength and center; the second moment grows by 1/4 wherever the particle is, so it is not conserved
/// either, and gathering does not reproduce x^2.
///
/// ```
/// use parops::{MeshKernel, Tsc};
/// assert_eq!(Tsc.weights(0.25), [0.03125, 0.6875, 0.28125]);
/// ```
///
/// Source: exercise sheet 003, exercise 2, with e = u + 1/2; errata 46.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tsc;

impl<T: Scalar> MeshKernel<T, 3> for Tsc {
    #[inline(always)]
    fn weights(&self, u: T) -> [T; 3] {
        let half = T::lift(0.5);
        let (below, above) = (half - u, half + u);
        [half * below * below, T::lift(0.75) - u * u, half * above * above]
    }

    fn exactness(&self) -> u32 {
        1
    }
}
