//! The exponential function of several numbers side by side.

use std::f64::consts::LOG2_E;

use crate::lanes::Lanes;

/// The lowest argument that is told from minus infinity: exp(-708) = 3.3e-308 is still a normal number.
const LOWEST: f64 = -708.0;

/// 3/2 2^52: a number of modulus below 2^51 added to it loses its fraction, and stands as an integer in the low bits.
const SHIFT: f64 = 6_755_399_441_055_744.0;

/// log 2 in two parts; multiples of the first up to 2^11 are exact.
const LN_2_HIGH: f64 = 0.693_147_180_369_123_8;
const LN_2_LOW: f64 = 1.908_214_929_270_587_7e-10;

/// (exp(r) - 1 - r)/r^2 by powers of r, interpolated at Chebyshev points of |r| <= 1.0001 log(2)/2. In exact arithmetic
/// exp(r) comes out to 0.15 2^-53.
const SERIES: [f64; 10] = [
    0.500_000_000_000_000_1,
    0.166_666_666_666_666_7,
    0.041_666_666_666_624_13,
    0.008_333_333_333_330_062,
    0.001_388_888_891_721_371_7,
    0.000_198_412_698_630_536_18,
    2.480_152_129_595_437_6e-5,
    2.755_726_845_999_706_4e-6,
    2.762_008_844_540_974_6e-7,
    2.510_038_549_551_032e-8,
];

/// exp(x) for x <= 0, within 2 units in the last place; 0 below -708; NaN stays NaN.
///
/// x = k log 2 + r with |r| <= log(2)/2; the power of two is put together from its bits. No branches, no fused operations:
/// the same bits on every target.
#[inline(always)]
pub(crate) fn exp<const L: usize>(x: Lanes<L>) -> Lanes<L> {
    // Written so that NaN is kept.
    let bounded = x.map(|x| if x < LOWEST { LOWEST } else { x });
    let shifted = bounded * Lanes::all(LOG2_E) + Lanes::all(SHIFT);
    let k = shifted - Lanes::all(SHIFT);
    let r = bounded - k * Lanes::all(LN_2_HIGH) - k * Lanes::all(LN_2_LOW);
    let mut sum = Lanes::all(SERIES[9]);
    for &coefficient in SERIES[..9].iter().rev() {
        sum = sum * r + Lanes::all(coefficient);
    }
    let power = shifted.map(|shifted| f64::from_bits(shifted.to_bits().wrapping_add(1023) << 52));
    let result = (Lanes::ONE + (r + r * r * sum)) * power;
    result.zip(x, |result, x| if x < LOWEST { 0.0 } else { result })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exponential_stays_within_two_units_of_the_standard_one() {
        let mut most = 0;
        // Steps that share no factor with the table of powers of two.
        for i in 0..1_000_000 {
            let x = [-i as f64 * 4.0000001e-5, -i as f64 * 7.079e-4, -i as f64 * 1e-9, -(i as f64).exp2().recip()];
            let found = exp(Lanes(x));
            for (x, found) in x.into_iter().zip(found.0) {
                most = most.max(found.to_bits().abs_diff(x.exp().to_bits()));
            }
        }
        assert!(most <= 2, "{most} units");
    }

    #[test]
    fn exponential_ends_in_one_zero_and_nan() {
        assert_eq!(exp(Lanes([0.0, -0.0, -f64::MIN_POSITIVE])).0, [1.0; 3]);
        assert_eq!(exp(Lanes([-709.0, -1e300, f64::NEG_INFINITY])).0, [0.0; 3]);
        let [first, second, third] = exp(Lanes([f64::NAN, -708.0, -1.0])).0;
        assert!(first.is_nan());
        assert!(second >= f64::MIN_POSITIVE && second.to_bits().abs_diff((-708.0_f64).exp().to_bits()) <= 2);
        assert_eq!(exp(Lanes([-1.0])).0, [third]);
    }
}
