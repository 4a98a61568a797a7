//! The value of one particle: a number, or an array of them.

use nalgebra::SVector;

/// The value one particle contributes to a state: `f32`, `f64`, or arrays and `SVector`s of entries.
///
/// The factor a of x + a y comes as `f64` and is rounded once to the precision of the entry.
pub trait Entry: Copy + Send + Sync + 'static {
    /// How many numbers an entry has.
    const NUMBERS: usize;

    /// self + a y, every number in its own precision.
    #[must_use]
    fn plus(self, a: f64, y: Self) -> Self;

    /// Whether every number is finite.
    fn finite(self) -> bool;

    /// Number k; k is below [`NUMBERS`](Self::NUMBERS).
    fn number(&self, k: usize) -> f64;

    /// Gives number k this value, rounded once; k is below [`NUMBERS`](Self::NUMBERS).
    fn set_number(&mut self, k: usize, value: f64);
}

macro_rules! entry_of_a_number {
    ($number:ty) => {
        impl Entry for $number {
            const NUMBERS: usize = 1;

            #[inline(always)]
            fn plus(self, a: f64, y: Self) -> Self {
                self + a as $number * y
            }

            #[inline(always)]
            fn finite(self) -> bool {
                self.is_finite()
            }

            #[inline(always)]
            fn number(&self, _: usize) -> f64 {
                f64::from(*self)
            }

            #[inline(always)]
            fn set_number(&mut self, _: usize, value: f64) {
                *self = value as $number;
            }
        }
    };
}

entry_of_a_number!(f64);
entry_of_a_number!(f32);

impl<E: Entry, const K: usize> Entry for [E; K] {
    const NUMBERS: usize = K * E::NUMBERS;

    #[inline(always)]
    fn plus(self, a: f64, y: Self) -> Self {
        std::array::from_fn(|k| self[k].plus(a, y[k]))
    }

    #[inline(always)]
    fn finite(self) -> bool {
        self.iter().fold(true, |all, x| all & x.finite())
    }

    #[inline(always)]
    fn number(&self, k: usize) -> f64 {
        self[k / E::NUMBERS].number(k % E::NUMBERS)
    }

    #[inline(always)]
    fn set_number(&mut self, k: usize, value: f64) {
        self[k / E::NUMBERS].set_number(k % E::NUMBERS, value);
    }
}

impl<E: Entry + nalgebra::Scalar, const K: usize> Entry for SVector<E, K> {
    const NUMBERS: usize = K * E::NUMBERS;

    #[inline(always)]
    fn plus(self, a: f64, y: Self) -> Self {
        self.zip_map(&y, |x, y| x.plus(a, y))
    }

    #[inline(always)]
    fn finite(self) -> bool {
        self.iter().fold(true, |all, x| all & x.finite())
    }

    #[inline(always)]
    fn number(&self, k: usize) -> f64 {
        self[k / E::NUMBERS].number(k % E::NUMBERS)
    }

    #[inline(always)]
    fn set_number(&mut self, k: usize, value: f64) {
        self[k / E::NUMBERS].set_number(k % E::NUMBERS, value);
    }
}

/// How many entries are tested for finiteness before the first branch, so that the test is a vector loop; few enough to
/// stay in the innermost cache.
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

/// x_p = base_p + a y_p and sum_p += b y_p, block by block, so that a block of y comes from memory once; or the first
/// entry of y that is not finite.
#[inline]
pub(super) fn set_sum_and_add<E: Entry>(
    x: &mut [E],
    base: &[E],
    a: f64,
    y: &[E],
    sum: &mut [E],
    b: f64,
) -> Option<usize> {
    let blocks = x.chunks_mut(BLOCK).zip(base.chunks(BLOCK)).zip(y.chunks(BLOCK)).zip(sum.chunks_mut(BLOCK));
    for (block, (((x, base), y), sum)) in blocks.enumerate() {
        if let Some(i) = first_non_finite(y) {
            return Some(block * BLOCK + i);
        }
        set_sum(x, base, a, y);
        add(sum, b, y);
    }
    None
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
