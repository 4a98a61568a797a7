//! The value of one particle: a number, or an array of them.

use nalgebra::SVector;

/// The value one particle contributes to a state: `f32`, `f64`, or arrays and `SVector`s of entries.
///
/// The factor a of x + a y comes as `f64` and is rounded once to the precision of the entry.
pub trait Entry: Copy + Send + Sync + 'static {
    /// self + a y, every number in its own precision.
    #[must_use]
    fn plus(self, a: f64, y: Self) -> Self;

    /// Whether every number is finite.
    fn finite(self) -> bool;
}

impl Entry for f64 {
    #[inline(always)]
    fn plus(self, a: f64, y: Self) -> Self {
        self + a * y
    }

    #[inline(always)]
    fn finite(self) -> bool {
        self.is_finite()
    }
}

impl Entry for f32 {
    #[inline(always)]
    fn plus(self, a: f64, y: Self) -> Self {
        self + a as f32 * y
    }

    #[inline(always)]
    fn finite(self) -> bool {
        self.is_finite()
    }
}

impl<E: Entry, const K: usize> Entry for [E; K] {
    #[inline(always)]
    fn plus(self, a: f64, y: Self) -> Self {
        std::array::from_fn(|k| self[k].plus(a, y[k]))
    }

    #[inline(always)]
    fn finite(self) -> bool {
        self.iter().fold(true, |all, x| all & x.finite())
    }
}

impl<E: Entry + nalgebra::Scalar, const K: usize> Entry for SVector<E, K> {
    #[inline(always)]
    fn plus(self, a: f64, y: Self) -> Self {
        self.zip_map(&y, |x, y| x.plus(a, y))
    }

    #[inline(always)]
    fn finite(self) -> bool {
        self.iter().fold(true, |all, x| all & x.finite())
    }
}

/// How many entries are tested for finiteness before the first branch, so that the test is a vector loop.
const BLOCK: usize = 256;

/// x_p = base_p + a y_p.
#[inline]
pub(super) fn set_sum<E: Entry>(x: &mut [E], base: &[E], a: f64, y: &[E]) {
    for ((x, &base), &y) in x.iter_mut().zip(base).zip(y) {
        *x = base.plus(a, y);
    }
}

/// x_p += a y_p.
#[inline]
pub(super) fn add<E: Entry>(x: &mut [E], a: f64, y: &[E]) {
    for (x, &y) in x.iter_mut().zip(y) {
        *x = x.plus(a, y);
    }
}

/// The first entry with a number that is not finite.
#[inline]
pub(super) fn first_non_finite<E: Entry>(x: &[E]) -> Option<usize> {
    for (block, entries) in x.chunks(BLOCK).enumerate() {
        if !entries.iter().fold(true, |all, x| all & x.finite()) {
            return entries.iter().position(|x| !x.finite()).map(|i| block * BLOCK + i);
        }
    }
    None
}
