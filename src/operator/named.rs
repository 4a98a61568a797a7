//! The operators that have a name: gradient, divergence, curl, Hessian, Laplacian, bi-Laplacian, derivatives along a vector.

use std::fmt;
use std::ops::{Add, Mul, Neg, Sub};

use typenum::{U1, U2, U4};

use super::expression::{Operator, Outputs, ShowSum};
use super::typed::{Homogeneous, Plus, Times, arithmetic, shown};
use crate::multi_index::{MultiIndex, SameDegree};

/// The Laplacian sum_i d^2/dx_i^2, one weight per pair.
#[derive(Clone, Copy, Default)]
pub struct Laplacian<const D: usize>;

impl<const D: usize> Homogeneous for Laplacian<D> {
    type Degree = U2;

    fn show(&self, factor: f64, sum: &mut ShowSum<'_, '_>) -> fmt::Result {
        along_axes::<D>(2).try_for_each(|index| sum.term(factor, index))
    }
}

impl<const D: usize> Operator<D> for Laplacian<D> {
    type Out = [f64; 1];

    fn terms(&self, term: &mut dyn FnMut(usize, MultiIndex<D>, f64)) {
        along_axes(2).for_each(|index| term(0, index, 1.0));
    }
}

/// The gradient, output k being d/dx_k: D weights per pair.
#[derive(Clone, Copy, Default)]
pub struct Gradient<const D: usize>;

impl<const D: usize> Homogeneous for Gradient<D> {
    type Degree = U1;

    fn show(&self, factor: f64, sum: &mut ShowSum<'_, '_>) -> fmt::Result {
        let outputs: Vec<_> = along_axes::<D>(1).map(|index| index.to_string()).collect();
        sum.term(factor, format_args!("({})", outputs.join(", ")))
    }
}

impl<const D: usize> Operator<D> for Gradient<D> {
    type Out = [f64; D];

    fn terms(&self, term: &mut dyn FnMut(usize, MultiIndex<D>, f64)) {
        along_axes(1).enumerate().for_each(|(axis, index)| term(axis, index, 1.0));
    }
}

/// The divergence of a vector field. Its rows are those of the [`Gradient`]; `apply_dot` contracts them with the field.
pub type Divergence<const D: usize> = Gradient<D>;

/// The curl of a vector field in 2D or 3D. Its rows are those of the [`Gradient`]; `apply_curl` takes it of the field.
pub type Curl<const D: usize> = Gradient<D>;

/// All second derivatives d^2/dx_i dx_j with i <= j, row by row of the upper triangle: xx, xy, yy in 2D and
/// xx, xy, xz, yy, yz, zz in 3D. D (D + 1)/2 weights per pair from one factorization; D = 1, 2, 3.
///
/// ```
/// use parops::Hessian;
/// assert_eq!(Hessian::<2>.to_string(), "(D^(2,0), D^(1,1), D^(0,2))");
/// ```
#[derive(Clone, Copy, Default)]
pub struct Hessian<const D: usize>;

impl<const D: usize> Hessian<D> {
    /// The pairs of axes (i, j), i <= j, in the order of the outputs.
    pub fn axes() -> impl Iterator<Item = (usize, usize)> {
        (0..D).flat_map(|i| (i..D).map(move |j| (i, j)))
    }

    /// The coefficients c_k with sum_k c_k H_k = A : H = sum_ij A_ij H_ij, for
    /// [`Contraction`](super::Contraction): A_ii, and A_ij + A_ji off the diagonal.
    ///
    /// ```
    /// use parops::Hessian;
    /// assert_eq!(Hessian::<2>::packed(&[[1.0, 0.5], [0.25, 2.0]]), [1.0, 0.75, 2.0]);
    /// ```
    pub fn packed(a: &[[f64; D]; D]) -> <Self as Operator<D>>::Out
    where
        Self: Operator<D>,
    {
        let mut packed = <Self as Operator<D>>::Out::ZERO;
        for (packed, (i, j)) in packed.as_mut_slice().iter_mut().zip(Self::axes()) {
            *packed = if i == j { a[i][i] } else { a[i][j] + a[j][i] };
        }
        packed
    }
}

impl<const D: usize> Homogeneous for Hessian<D> {
    type Degree = U2;

    fn show(&self, factor: f64, sum: &mut ShowSum<'_, '_>) -> fmt::Result {
        let outputs: Vec<_> = Self::axes().map(|(i, j)| mixed::<D>(i, j, 1).to_string()).collect();
        sum.term(factor, format_args!("({})", outputs.join(", ")))
    }
}

// K = D (D + 1)/2 cannot be computed from a const parameter in a type.
macro_rules! hessian {
    ($($d:literal: $k:literal),*) => { $(
        impl Operator<$d> for Hessian<$d> {
            type Out = [f64; $k];

            fn terms(&self, term: &mut dyn FnMut(usize, MultiIndex<$d>, f64)) {
                Self::axes().enumerate().for_each(|(output, (i, j))| term(output, mixed(i, j, 1), 1.0));
            }
        }
    )* };
}

hessian!(1: 1, 2: 3, 3: 6);

/// The bi-Laplacian sum_ij d^4/dx_i^2 dx_j^2, one weight per pair.
///
/// ```
/// use parops::BiLaplacian;
/// assert_eq!(BiLaplacian::<2>.to_string(), "D^(4,0) + 2 D^(2,2) + D^(0,4)");
/// ```
#[derive(Clone, Copy, Default)]
pub struct BiLaplacian<const D: usize>;

impl<const D: usize> BiLaplacian<D> {
    fn list() -> impl Iterator<Item = (MultiIndex<D>, f64)> {
        Hessian::<D>::axes().map(|(i, j)| (mixed(i, j, 2), if i == j { 1.0 } else { 2.0 }))
    }
}

impl<const D: usize> Homogeneous for BiLaplacian<D> {
    type Degree = U4;

    fn show(&self, factor: f64, sum: &mut ShowSum<'_, '_>) -> fmt::Result {
        Self::list().try_for_each(|(index, c)| sum.term(factor * c, index))
    }
}

impl<const D: usize> Operator<D> for BiLaplacian<D> {
    type Out = [f64; 1];

    fn terms(&self, term: &mut dyn FnMut(usize, MultiIndex<D>, f64)) {
        Self::list().for_each(|(index, c)| term(0, index, c));
    }
}

/// v . grad for one constant velocity. Where the velocity varies, contract [`Gradient`] rows by `apply_along`.
///
/// ```
/// use parops::Along;
/// assert_eq!(Along([0.5, -2.0]).to_string(), "0.5 D^(1,0) - 2 D^(0,1)");
/// ```
#[derive(Clone, Copy, PartialEq)]
pub struct Along<const D: usize>(
    /// The velocity v.
    pub [f64; D],
);

impl<const D: usize> Homogeneous for Along<D> {
    type Degree = U1;

    fn show(&self, factor: f64, sum: &mut ShowSum<'_, '_>) -> fmt::Result {
        along_axes::<D>(1).zip(self.0).try_for_each(|(index, v)| sum.term(factor * v, index))
    }
}

impl<const D: usize> Operator<D> for Along<D> {
    type Out = [f64; 1];

    fn terms(&self, term: &mut dyn FnMut(usize, MultiIndex<D>, f64)) {
        along_axes(1).zip(self.0).for_each(|(index, v)| term(0, index, v));
    }
}

/// The second derivative (v . grad)^2 = sum_ij v_i v_j d^2/dx_i dx_j along one constant vector, one weight per pair.
/// Where the vector varies, contract [`Hessian`] by [`Contraction`](super::Contraction).
///
/// ```
/// use parops::AlongTwice;
/// assert_eq!(AlongTwice([0.5, -2.0]).to_string(), "0.25 D^(2,0) - 2 D^(1,1) + 4 D^(0,2)");
/// ```
#[derive(Clone, Copy, PartialEq)]
pub struct AlongTwice<const D: usize>(
    /// The vector v.
    pub [f64; D],
);

impl<const D: usize> AlongTwice<D> {
    fn list(&self) -> impl Iterator<Item = (MultiIndex<D>, f64)> {
        let v = self.0;
        Hessian::<D>::axes().map(move |(i, j)| (mixed(i, j, 1), if i == j { v[i] * v[i] } else { 2.0 * v[i] * v[j] }))
    }
}

impl<const D: usize> Homogeneous for AlongTwice<D> {
    type Degree = U2;

    fn show(&self, factor: f64, sum: &mut ShowSum<'_, '_>) -> fmt::Result {
        self.list().try_for_each(|(index, c)| sum.term(factor * c, index))
    }
}

impl<const D: usize> Operator<D> for AlongTwice<D> {
    type Out = [f64; 1];

    fn terms(&self, term: &mut dyn FnMut(usize, MultiIndex<D>, f64)) {
        self.list().for_each(|(index, c)| term(0, index, c));
    }
}

/// d^(2 n)/dx_i^n dx_j^n.
fn mixed<const D: usize>(i: usize, j: usize, n: u8) -> MultiIndex<D> {
    MultiIndex::new(std::array::from_fn(|axis| n * (u8::from(axis == i) + u8::from(axis == j))))
}

/// The pure derivatives of this degree, axis by axis.
fn along_axes<const D: usize>(degree: u8) -> impl Iterator<Item = MultiIndex<D>> {
    (0..D).map(move |axis| MultiIndex::new(std::array::from_fn(|i| if i == axis { degree } else { 0 })))
}

arithmetic! {
    [const D: usize] Laplacian<D> [];
    [const D: usize] Gradient<D> [];
    [const D: usize] Along<D> [];
    [const D: usize] AlongTwice<D> [];
    [const D: usize] Hessian<D> [];
    [const D: usize] BiLaplacian<D> [];
}

shown! {
    [const D: usize] Laplacian<D> [];
    [const D: usize] Gradient<D> [];
    [const D: usize] Along<D> [];
    [const D: usize] AlongTwice<D> [];
    [const D: usize] Hessian<D> [];
    [const D: usize] BiLaplacian<D> [];
}
