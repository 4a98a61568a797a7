//! The exponential function of several numbers side by side.

use std::f64::consts::{LOG2_E, SQRT_2};

use crate::lanes::Lanes;

/// The lowest argument that is told from minus infinity: exp(-708) = 3.3e-308 is still a normal number.
const LOWEST: f64 = -708.0;

/// 3/2 2^52: a number of modulus below 2^51 added to it loses its fraction, and stands as an integer in the low bits.
const SHIFT: f64 = 6_755_399_441_055_744.0;

/// log(2)/64 in two parts; multiples of the first up to 2^17 are exact.
const STEP_HIGH: f64 = 0.010_830_424_696_223_417;
const STEP_LOW: f64 = 2.572_804_622_327_669e-14;

/// (exp(r) - 1 - r)/r^2 by powers of r, interpolated at Chebyshev points of |r| <= (1 + 2^-8) log(2)/128. In exact
/// arithmetic exp(r) comes out to 0.04 2^-53.
const SERIES: [f64; 4] =
    [0.499_999_999_999_848_34, 0.166_666_666_666_645, 0.041_666_707_714_005_18, 0.008_333_339_197_238_233];

/// 2^(j/64).
#[rustfmt::skip]
const POWERS: [f64; 64] = [
    1.0, 1.010_889_286_051_700_5, 1.021_897_148_654_116_6, 1.033_024_879_021_228_4,
    1.044_273_782_427_413_8, 1.055_645_178_360_557_2, 1.067_140_400_676_823_7, 1.078_760_797_757_119_9,
    1.090_507_732_665_257_7, 1.102_382_583_307_841, 1.114_386_742_595_892_4, 1.126_521_618_608_241_8,
    1.138_788_634_756_691_6, 1.151_189_229_952_982_7, 1.163_724_858_777_577_5, 1.176_396_991_650_281_2,
    1.189_207_115_002_721, 1.202_156_731_452_703, 1.215_247_359_980_469, 1.228_480_536_106_87,
    1.241_857_812_073_484, 1.255_380_757_024_691, 1.269_050_957_191_733_2, 1.282_870_016_078_778_3,
    1.296_839_554_651_009_6, 1.310_961_211_524_764_4, 1.325_236_643_159_741_3, 1.339_667_524_053_303,
    1.354_255_546_936_892_7, 1.369_002_422_974_590_5, 1.383_909_881_963_832, 1.398_979_672_538_311_2,
    SQRT_2, 1.429_613_338_391_97, 1.445_180_806_977_046_7, 1.460_917_794_180_647,
    1.476_826_145_939_499_3, 1.492_907_728_291_264_8, 1.509_164_427_593_422_8, 1.525_598_150_744_538_4,
    1.542_210_825_407_940_7, 1.559_004_400_237_837, 1.575_980_845_107_886_5, 1.593_142_151_342_267,
    1.610_490_331_949_254_3, 1.628_027_421_857_347_8, 1.645_755_478_153_965, 1.663_676_580_326_736_4,
    1.681_792_830_507_429, 1.700_106_353_718_523_5, 1.718_619_298_122_478, 1.737_333_835_273_706_2,
    1.756_252_160_373_299_5, 1.775_376_492_526_521_2, 1.794_709_075_003_107_2, 1.814_252_175_500_398_9,
    1.834_008_086_409_342_4, 1.853_979_125_083_385_5, 1.874_167_634_110_3, 1.894_575_981_586_965_6,
    1.915_206_561_397_147_4, 1.936_061_793_492_294_3, 1.957_144_124_175_400_2, 1.978_456_026_387_951,
];

/// exp(x) for x <= 0, within 1 unit in the last place; 0 below -708; NaN stays NaN.
#[inline(always)]
pub(crate) fn exp<const L: usize>(x: Lanes<L>) -> Lanes<L> {
    exp_of_sum(x, Lanes::ZERO)
}

/// exp(x + low) for x <= 0 and |low| <= 2e-5, within 1 unit in the last place; 0 where x is below -708, whatever `low`; NaN
/// stays NaN.
///
/// x = k log(2)/64 + r with |r| <= log(2)/128; the power of two is put together from its bits. No branches, no fused
/// operations: the same bits on every target.
#[inline(always)]
pub(crate) fn exp_of_sum<const L: usize>(x: Lanes<L>, low: Lanes<L>) -> Lanes<L> {
    // Written so that NaN is kept.
    let bounded = x.map(|x| if x < LOWEST { LOWEST } else { x });
    let shifted = bounded * Lanes::all(64.0 * LOG2_E) + Lanes::all(SHIFT);
    let k = shifted - Lanes::all(SHIFT);
    let r = bounded - k * Lanes::all(STEP_HIGH) - (k * Lanes::all(STEP_LOW) - low);
    let power = shifted.map(|shifted| {
        let k = shifted.to_bits();
        f64::from_bits(POWERS[(k % 64) as usize].to_bits().wrapping_add((k >> 6) << 52))
    });
    let [c0, c1, c2, c3] = SERIES.map(Lanes::all);
    let square = r * r;
    let rest = r + square * (c0 + c1 * r + square * (c2 + c3 * r));
    (power + power * rest).zip(x, |result, x| if x < LOWEST { 0.0 } else { result })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exponential_stays_within_one_unit_of_the_standard_one() {
        let mut most = 0;
        // Steps that share no factor with the table of powers of two.
        for i in 0..1_000_000 {
            let x = [-i as f64 * 4.0000001e-5, -i as f64 * 7.079e-4, -i as f64 * 1e-9, -(i as f64).exp2().recip()];
            let found = exp(Lanes(x));
            for (x, found) in x.into_iter().zip(found.0) {
                most = most.max(found.to_bits().abs_diff(x.exp().to_bits()));
            }
        }
        assert!(most <= 1, "{most} units");
    }

    #[test]
    fn exponential_ends_in_one_zero_and_nan() {
        assert_eq!(exp(Lanes([0.0, -0.0, -f64::MIN_POSITIVE])).0, [1.0; 3]);
        assert_eq!(exp(Lanes([-709.0, -1e300, f64::NEG_INFINITY])).0, [0.0; 3]);
        let [first, second, third] = exp(Lanes([f64::NAN, -708.0, -1.0])).0;
        assert!(first.is_nan());
        assert!(second >= f64::MIN_POSITIVE && second.to_bits().abs_diff((-708.0_f64).exp().to_bits()) <= 1);
        assert_eq!(exp(Lanes([-1.0])).0, [third]);
    }
}
