//! exp(-a |z|^2) to the last place, for several z side by side.
//!
//! |z|^2 rounded is off by eps |z|^2 and more, and so is its exponential, relatively: 16 eps at |z| = 5. So nothing of it is
//! dropped: with z_i = h_i + l_i, h_i on a grid so coarse that sums of squares of such numbers are exact,
//! |z|^2 = sum_i h_i^2 + sum_i l_i (z_i + h_i), and both sums go into the exponential. No fused operations are needed.

use std::any::Any;
use std::array;

use crate::exp::exp_of_sum;
use crate::lanes::Lanes;
use crate::scalar::Scalar;

/// Points that go through a kernel side by side.
const LANES: usize = 4;

/// out = f(z), several points at a time. The last points are taken together even where that repeats some.
#[inline(always)]
pub(super) fn in_lanes<T: Scalar, const D: usize>(
    z: &[[T; D]],
    out: &mut [T],
    f: impl Fn(&[[T; D]; LANES]) -> [T; LANES],
) {
    let Some(last) = z.last_chunk() else {
        let Some(&first) = z.first() else { return };
        let padded = f(&array::from_fn(|i| z.get(i).copied().unwrap_or(first)));
        out.iter_mut().zip(padded).for_each(|(out, value)| *out = value);
        return;
    };
    let last = f(last);
    for (z, out) in z.as_chunks().0.iter().zip(out.as_chunks_mut().0) {
        *out = f(z);
    }
    if let Some(out) = out.last_chunk_mut() {
        *out = last;
    }
}

/// out times exp(-|z|^2).
#[inline(always)]
pub(super) fn damp<T: Scalar, const D: usize>(z: &[[T; D]], out: &mut [T]) {
    let ((z, z_rest), (out, out_rest)) = (z.as_chunks::<LANES>(), out.as_chunks_mut::<LANES>());
    for (z, out) in z.iter().zip(out) {
        let (_, decay) = decay(z, 1.0);
        *out = array::from_fn(|i| out[i] * decay[i]);
    }
    for (z, out) in z_rest.iter().zip(out_rest) {
        let (_, [decay]) = decay(&[*z], 1.0);
        *out *= decay;
    }
}

/// |z|^2, rounded once, and exp(-a |z|^2) within 2 units in the last place, for a = 1, 1/2 or 1/4.
///
/// In `f64` the bits depend neither on L nor on the target.
#[inline(always)]
pub(super) fn decay<T: Scalar, const D: usize, const L: usize>(z: &[[T; D]; L], a: f64) -> ([T; L], [T; L]) {
    let (high, low) = squares(z);
    let a = T::lift(-a);
    (array::from_fn(|i| high[i] + low[i]), exponential(high.map(|high| a * high), low.map(|low| a * low)))
}

/// |z|^2 = high + low.
#[inline(always)]
fn squares<T: Scalar, const D: usize, const L: usize>(z: &[[T; D]; L]) -> ([T; L], [T; L]) {
    let shift = T::lift(grid::<T>());
    let (mut high, mut low) = ([T::zero(); L], [T::zero(); L]);
    for axis in 0..D {
        let x = z.map(|z| z[axis]);
        for i in 0..L {
            let h = (x[i] + shift) - shift;
            high[i] += h * h;
            low[i] += (x[i] - h) * (x[i] + h);
        }
    }
    (high, low)
}

/// |z|^2, rounded once where its root is below 45, above once an axis.
#[inline(always)]
pub(super) fn square_once<T: Scalar, const D: usize>(z: &[T; D]) -> T {
    let ([high], [low]) = squares(&[*z]);
    let sum = high + low;
    // The low part of an infinite square is no number.
    if sum.is_finite() { sum } else { high }
}

/// 3/2 of the power of two that leaves multiples of 2^-21 in double precision and 2^-7 in single precision: squares of such
/// numbers and their sums are exact up to 2^11 and 2^10, where exp(-s) and exp(-s/4) have vanished.
#[inline(always)]
fn grid<T: Scalar>() -> f64 {
    if T::default_epsilon() < T::lift(1e-10) { 1.5 * 2_147_483_648.0 } else { 1.5 * 65_536.0 }
}

/// exp(high + low).
#[inline(always)]
fn exponential<T: Scalar, const L: usize>(high: [T; L], low: [T; L]) -> [T; L] {
    let (any_high, any_low): (&dyn Any, &dyn Any) = (&high, &low);
    if let (Some(&high), Some(&low)) = (any_high.downcast_ref(), any_low.downcast_ref()) {
        return exp_of_sum(Lanes(high), Lanes(low)).0.map(T::lift);
    }
    array::from_fn(|i| {
        let sum = high[i] + low[i];
        // The low part of an infinite square is no number.
        if !sum.is_finite() {
            return high[i].exp();
        }
        let value = sum.exp();
        value + value * ((high[i] - sum) + low[i])
    })
}
