//! Several numbers side by side: one operation on all of them, in the widest vectors of the machine.

use std::array;
use std::ops::{Add, AddAssign, Mul, Sub, SubAssign};

/// L numbers that go through the same operations together, one per stencil.
///
/// Plain loops over arrays: the compiler turns them into the vector instructions of the target it builds for. No
/// operation mixes lanes, so the bits of a lane do not depend on the others, on L or on the target.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(32))]
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

/// Which vector instructions a piece of work over lanes is compiled for.
///
/// None of them is fused or approximate, so the choice does not change a bit.
pub(crate) trait Vectors: Copy {
    /// Calls `work`, out of line, compiled for these instructions as far as it is inlined.
    fn run<W: Work>(self, work: W) -> W::Out;
}

/// A piece of work over lanes. What `run` calls must be inlined to profit.
pub(crate) trait Work {
    type Out;
    fn run<V: Vectors>(self, vectors: V) -> Self::Out;
}

/// What every machine of the target has.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Common;

impl Vectors for Common {
    #[inline(never)]
    fn run<W: Work>(self, work: W) -> W::Out {
        work.run(self)
    }
}

/// Runs `work` with the widest vectors this machine has.
#[inline(always)]
pub(crate) fn widest<W: Work>(work: W) -> W::Out {
    #[cfg(target_arch = "x86_64")]
    if let Some(vectors) = wide::Avx2::found() {
        return vectors.run(work);
    }
    Common.run(work)
}

#[cfg(target_arch = "x86_64")]
mod wide {
    use super::{Vectors, Work};

    /// AVX2, found on this machine: there is no other way to make one.
    #[derive(Clone, Copy, Debug)]
    pub(super) struct Avx2(());

    impl Avx2 {
        #[inline(always)]
        pub(super) fn found() -> Option<Self> {
            std::arch::is_x86_feature_detected!("avx2").then_some(Self(()))
        }
    }

    impl Vectors for Avx2 {
        #[inline(always)]
        #[allow(unsafe_code)]
        fn run<W: Work>(self, work: W) -> W::Out {
            #[inline(never)]
            #[target_feature(enable = "avx2")]
            fn here<W: Work>(work: W, vectors: Avx2) -> W::Out {
                work.run(vectors)
            }
            // SAFETY: `here` asks for AVX2 and for nothing else, and `self` exists only where it was found.
            unsafe { here(work, self) }
        }
    }
}
