//! Several numbers side by side: one operation on all of them.

use std::array;
use std::ops::{Add, AddAssign, Mul, Sub, SubAssign};

/// L numbers that go through the same operations together, one per stencil.
///
/// Plain loops over arrays: the compiler turns them into the vector instructions of the target it builds for. No
/// operation mixes lanes, so the bits of a lane do not depend on the others, on L or on the target.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(16))]
pub(crate) struct Lanes<const L: usize>(pub(crate) [f64; L]);

impl<const L: usize> Lanes<L> {
    pub(crate) const ZERO: Self = Self([0.0; L]);
    pub(crate) const ONE: Self = Self([1.0; L]);

    /// x in all lanes.
    #[inline(always)]
    pub(crate) fn all(x: f64) -> Self {
        Self([x; L])
    }

    #[inline(always)]
    pub(crate) fn map(self, mut f: impl FnMut(f64) -> f64) -> Self {
        let mut out = self.0;
        for x in &mut out {
            *x = f(*x);
        }
        Self(out)
    }

    #[inline(always)]
    pub(crate) fn zip(self, other: Self, mut f: impl FnMut(f64, f64) -> f64) -> Self {
        Self(array::from_fn(|i| f(self.0[i], other.0[i])))
    }

    #[inline(always)]
    pub(crate) fn abs(self) -> Self {
        self.map(f64::abs)
    }

    #[inline(always)]
    pub(crate) fn sqrt(self) -> Self {
        self.map(f64::sqrt)
    }

    /// `self` where `chosen` is not zero, `other` elsewhere.
    #[inline(always)]
    pub(crate) fn where_set(self, chosen: Self, other: Self) -> Self {
        Self(array::from_fn(|i| if chosen.0[i] != 0.0 { self.0[i] } else { other.0[i] }))
    }
}

impl<const L: usize> Add for Lanes<L> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.zip(other, |x, y| x + y)
    }
}

impl<const L: usize> Sub for Lanes<L> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.zip(other, |x, y| x - y)
    }
}

impl<const L: usize> Mul for Lanes<L> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.zip(other, |x, y| x * y)
    }
}

impl<const L: usize> AddAssign for Lanes<L> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<const L: usize> SubAssign for Lanes<L> {
    #[inline(always)]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}
