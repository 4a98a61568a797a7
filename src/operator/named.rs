//! The operators that have a name: Laplacian, gradient, divergence, derivative along a velocity.

use std::fmt;
use std::ops::{Add, Mul, Neg, Sub};

use typenum::{U1, U2};

use super::expression::{Operator, ShowSum};
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

/// The pure derivatives of this degree, axis by axis.
fn along_axes<const D: usize>(degree: u8) -> impl Iterator<Item = MultiIndex<D>> {
    (0..D).map(move |axis| MultiIndex::new(std::array::from_fn(|i| if i == axis { degree } else { 0 })))
}

arithmetic! {
    [const D: usize] Laplacian<D> [];
    [const D: usize] Gradient<D> [];
    [const D: usize] Along<D> [];
}

shown! {
    [const D: usize] Laplacian<D> [];
    [const D: usize] Gradient<D> [];
    [const D: usize] Along<D> [];
}
