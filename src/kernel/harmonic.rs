//! Homogeneous polynomials in floating point, as kernels evaluate them.

use crate::multi_index::MultiIndex;
use crate::scalar::Scalar;

/// Y(z) = sum_alpha y_alpha z^alpha.
#[derive(Clone, Debug)]
pub(super) struct Harmonic<const D: usize>(Vec<(MultiIndex<D>, f64)>);

impl<const D: usize> Harmonic<D> {
    pub(super) fn new(monomials: impl Iterator<Item = (MultiIndex<D>, f64)>) -> Self {
        Self(monomials.collect())
    }

    /// Y over the coefficient of its first monomial, and that coefficient: then a single monomial needs no product.
    pub(super) fn normalized(mut self) -> (Self, f64) {
        let first = self.0.first().map_or(1.0, |&(_, y)| y);
        for (_, y) in &mut self.0 {
            *y /= first;
        }
        (self, first)
    }

    /// Whether Y = 1.
    pub(super) fn is_constant(&self) -> bool {
        matches!(self.0.as_slice(), [(alpha, 1.0)] if alpha.degree() == 0)
    }

    #[inline]
    pub(super) fn value<T: Scalar>(&self, z: &[T; D]) -> T {
        let mut sum = T::zero();
        for (alpha, y) in &self.0 {
            sum += alpha.power(z) * T::lift(*y);
        }
        sum
    }
}
