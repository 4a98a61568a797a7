//! Multi-indices: the typed and the run-time form agree, and their combinatorics are exact.

use std::collections::HashSet;

use crate::cases::cases;
use crate::properties::properties;
use parops::{
    Beta, D1, D2, D3, Error, ErrorKind, Exponents, HasLen, MultiIndex, MultiIndexError, Term, common_degree,
    condition_count, graded,
};
use proptest::prelude::*;
use typenum::{U0, U1, U2, U3, U4, U5, U7, U255, Unsigned, tarr};

fn kind(error: Error) -> ErrorKind {
    assert_eq!(error.particle(), None);
    error.kind().clone()
}

/// Everything the two forms both know, at a point where rounding shows.
fn agree<L: HasLen<D> + Exponents, const D: usize>(exponents: [u8; D]) {
    let (typed, at_run_time) = (Beta::<L>::default(), MultiIndex::new(exponents));
    assert_eq!(MultiIndex::from(typed), at_run_time);
    assert_eq!(Beta::<L>::index(), at_run_time);
    assert_eq!(L::EXPONENTS, exponents);
    assert_eq!(<L::Degree as Unsigned>::U32, at_run_time.degree());
    assert_eq!(typed.to_string(), at_run_time.to_string());
    assert_eq!(format!("{typed:?}"), typed.to_string());
    let z: [f64; D] = std::array::from_fn(|axis| 0.1 + axis as f64 / 3.0);
    assert_eq!(Beta::<L>::index().power(&z).to_bits(), at_run_time.power(&z).to_bits());
}

#[test]
fn typed_and_run_time_forms_agree_in_one_to_six_dimensions() {
    agree::<tarr![U0], 1>([0]);
    agree::<tarr![U255], 1>([255]);
    agree::<tarr![U2, U0], 2>([2, 0]);
    agree::<tarr![U0, U3], 2>([0, 3]);
    agree::<tarr![U1, U1, U2], 3>([1, 1, 2]);
    agree::<tarr![U0, U0, U4], 3>([0, 0, 4]);
    agree::<tarr![U1, U0, U2, U7], 4>([1, 0, 2, 7]);
    agree::<tarr![U5, U0, U0, U0, U1], 5>([5, 0, 0, 0, 1]);
    agree::<tarr![U0, U1, U2, U3, U4, U5], 6>([0, 1, 2, 3, 4, 5]);
}

#[test]
fn aliases_are_the_general_form() {
    type One = Beta<tarr![U3]>;
    type Two = Beta<tarr![U2, U1]>;
    type Three = Beta<tarr![U1, U0, U2]>;
    let (one, two, three): (One, Two, Three) = (D1::<3>::default(), D2::<2, 1>::default(), D3::<1, 0, 2>::default());
    assert_eq!(format!("{one} {two} {three}"), "D^(3) D^(2,1) D^(1,0,2)");
    assert_eq!(std::mem::size_of_val(&three), 0);
}

#[test]
fn display_and_debug_show_the_exponents() {
    assert_eq!(MultiIndex::new([2, 0]).to_string(), "D^(2,0)");
    assert_eq!(MultiIndex::<4>::ZERO.to_string(), "D^(0,0,0,0)");
    assert_eq!(format!("{:?}", MultiIndex::new([2, 10])), "MultiIndex([2, 10])");
}

#[test]
fn unit_has_one_exponent_and_refuses_an_axis_beyond_the_last() {
    for axis in 0..3 {
        let unit = MultiIndex::<3>::unit(axis).unwrap();
        let expected: [u8; 3] = std::array::from_fn(|i| u8::from(i == axis));
        assert_eq!((unit.exponents(), unit.degree()), (expected, 1));
    }
    let refused = kind(MultiIndex::<3>::unit(3).unwrap_err());
    assert_eq!(refused, ErrorKind::MultiIndex(MultiIndexError::Output { output: 3, outputs: 3 }));
}

/// Prime factors with multiplicity of n!, so that factorials beyond any integer can be compared.
fn prime_exponents(exponents: &[u8]) -> Vec<(u32, u32)> {
    let primes = (2..=255_u32).filter(|&n| (2..n).all(|d| n % d != 0));
    primes
        .map(|prime| {
            let of_factor = |mut factor: u32| {
                let mut times = 0;
                while factor.is_multiple_of(prime) {
                    (factor, times) = (factor / prime, times + 1);
                }
                times
            };
            (prime, exponents.iter().flat_map(|&e| 1..=u32::from(e)).map(of_factor).sum())
        })
        .filter(|&(_, times)| times > 0)
        .collect()
}

#[test]
fn single_factorials_fit_up_to_thirty_four() {
    assert_eq!(MultiIndex::new([34]).factorial().unwrap(), 295_232_799_039_604_140_847_618_609_643_520_000_000);
    for exponent in 35..=255 {
        let refused = kind(MultiIndex::new([exponent]).factorial().unwrap_err());
        let degree = u32::from(exponent);
        assert_eq!(refused, ErrorKind::MultiIndex(MultiIndexError::Degree { degree, limit: 34 }));
    }
}

#[test]
fn graded_starts_with_the_larger_first_exponents() {
    let listed: Vec<_> = graded::<3>(1, 2).map(|alpha| alpha.exponents()).collect();
    let expected = [[1, 0, 0], [0, 1, 0], [0, 0, 1], [2, 0, 0], [1, 1, 0], [1, 0, 1], [0, 2, 0], [0, 1, 1], [0, 0, 2]];
    assert_eq!(listed, expected);
}

#[test]
fn graded_is_empty_for_a_reversed_range_and_ends_at_eight_bits() {
    assert_eq!(graded::<2>(3, 2).count(), 0);
    assert_eq!(graded::<0>(0, 5).count(), 0);
    assert_eq!(graded::<1>(254, 1000).map(|alpha| alpha.degree()).collect::<Vec<_>>(), [254, 255]);
    assert_eq!(graded::<2>(256, 256).count(), 0);
}

/// C(n, k) by Pascal's triangle, another way than the library's product.
fn binomial(n: usize, k: usize) -> u128 {
    let mut row = vec![1_u128];
    for _ in 0..n {
        let sums = row.windows(2).map(|pair| pair[0] + pair[1]);
        row = std::iter::once(1).chain(sums).chain(std::iter::once(1)).collect();
    }
    row.get(k).copied().unwrap_or(0)
}

fn graded_is_complete<const D: usize>(high: u32) {
    let listed: Vec<_> = graded::<D>(0, high).collect();
    let unique: HashSet<_> = listed.iter().collect();
    // As many different ones as there are, and none of another degree: none is missing.
    assert_eq!(listed.len() as u128, binomial(D + high as usize, D), "D = {D}, degree {high}");
    assert_eq!(unique.len(), listed.len());
    assert!(listed.iter().all(|alpha| alpha.degree() <= high));
    for pair in listed.windows(2) {
        let (first, second) = (pair[0], pair[1]);
        // By degree; within one, lexicographically descending.
        let ordered = (first.degree(), second.exponents()) < (second.degree(), first.exponents());
        assert!(ordered, "{first} before {second}");
    }
    for low in 0..=high {
        let tail: Vec<_> = listed.iter().copied().filter(|alpha| alpha.degree() >= low).collect();
        assert_eq!(graded::<D>(low, high).collect::<Vec<_>>(), tail);
    }
}

#[test]
fn graded_is_complete_unique_and_ordered_in_one_to_six_dimensions() {
    for high in 0..=9 {
        graded_is_complete::<1>(high);
        graded_is_complete::<2>(high);
        graded_is_complete::<3>(high);
        graded_is_complete::<4>(high);
        graded_is_complete::<5>(high);
        graded_is_complete::<6>(high);
    }
}

#[test]
fn condition_count_has_the_values_of_the_literature() {
    // Errata 21: (1,0) at r = 2 needs 6, (2,0) needs 9. The rest by hand from notes 001, eq. 5.39.
    let known = [
        ((2, 1, 2), 6),
        ((2, 2, 2), 9),
        ((2, 2, 4), 20),
        ((3, 2, 2), 19),
        ((3, 2, 4), 55),
        ((3, 1, 2), 10),
        ((1, 2, 2), 3),
        ((1, 1, 1), 2),
        ((2, 0, 2), 2),
    ];
    for ((dim, degree, order), count) in known {
        assert_eq!(condition_count(dim, degree, order).unwrap(), count, "d = {dim}, |beta| = {degree}, r = {order}");
    }
}

fn count_equals_enumeration<const D: usize>() {
    for degree in 0..=4_u32 {
        for order in 1..=5 {
            let alpha_min = u32::from(degree.is_multiple_of(2));
            let listed = graded::<D>(alpha_min, degree + order - 1).count();
            assert_eq!(condition_count(D as u32, degree, order).unwrap(), listed as u128);
        }
    }
}

#[test]
fn condition_count_equals_the_enumeration() {
    count_equals_enumeration::<1>();
    count_equals_enumeration::<2>();
    count_equals_enumeration::<3>();
    count_equals_enumeration::<4>();
    count_equals_enumeration::<5>();
    count_equals_enumeration::<6>();
}

#[test]
fn condition_count_refuses_order_zero_and_what_does_not_fit() {
    let refused = kind(condition_count(2, 2, 0).unwrap_err());
    assert_eq!(refused, ErrorKind::MultiIndex(MultiIndexError::Order { order: 0, low: 1, high: u32::MAX }));
    for (dim, degree, order) in [(200, 200, 200), (u32::MAX, u32::MAX, u32::MAX), (6, u32::MAX, u32::MAX)] {
        let refused = kind(condition_count(dim, degree, order).unwrap_err());
        assert_eq!(refused, ErrorKind::MultiIndex(MultiIndexError::Count { dim, degree, order }));
    }
    // Large arguments whose count is small: C(2^32, 1) - 1 and C(2^33 - 2, 1).
    assert_eq!(condition_count(u32::MAX, 0, 2).unwrap(), u128::from(u32::MAX));
    assert_eq!(condition_count(1, u32::MAX, u32::MAX).unwrap(), 2 * u128::from(u32::MAX));
}

#[test]
fn common_degree_names_the_first_offender() {
    let term = |exponents: [u8; 2], factor: f64| Term { index: MultiIndex::new(exponents), factor };
    assert_eq!(common_degree(&[term([2, 0], 1.0), term([1, 1], -3.0)]).unwrap(), 2);
    let refused = |terms: &[Term<2>]| kind(common_degree(terms).unwrap_err());
    assert_eq!(refused(&[]), ErrorKind::MultiIndex(MultiIndexError::Empty { output: 0 }));
    let unequal = ErrorKind::MultiIndex(MultiIndexError::UnequalDegree { first: 2, other: 1 });
    assert_eq!(refused(&[term([2, 0], 1.0), term([0, 1], 1.0), term([3, 0], 1.0)]), unequal);
    let infinite = ErrorKind::MultiIndex(MultiIndexError::Factor { factor: f64::INFINITY });
    assert_eq!(refused(&[term([2, 0], 1.0), term([1, 1], f64::INFINITY)]), infinite);
}

/// Each side makes at most one rounding a factor and one an axis, each of relative size eps/2; twice their sum
/// covers the second order.
fn power_bound(degree: u32, eps: f64) -> f64 {
    2.0 * f64::from(degree + 3) * eps
}

proptest! {
    #![proptest_config(properties(cases()))]

    #[test]
    fn degree_parity_and_sign_follow_the_exponents(exponents in any::<[u8; 5]>()) {
        let beta = MultiIndex::new(exponents);
        let degree: u32 = exponents.iter().map(|&e| u32::from(e)).sum();
        prop_assert_eq!(beta.exponents(), exponents);
        prop_assert_eq!(beta.degree(), degree);
        prop_assert_eq!(beta.is_even(), degree & 1 == 0);
        prop_assert_eq!(beta.sign(), (-1_i32).pow(degree));
    }

    #[test]
    fn factorial_has_the_prime_factors_of_the_product_or_is_refused(exponents in prop::array::uniform3(0_u8..20)) {
        let beta = MultiIndex::new(exponents);
        let factors = prime_exponents(&exponents);
        let product = factors.iter().try_fold(1_u128, |product, &(prime, times)| {
            product.checked_mul(u128::from(prime).checked_pow(times)?)
        });
        match product {
            Some(product) => prop_assert_eq!(beta.factorial().unwrap(), product),
            None => prop_assert_eq!(
                kind(beta.factorial().unwrap_err()),
                ErrorKind::MultiIndex(MultiIndexError::Degree { degree: beta.degree(), limit: 34 })
            ),
        }
    }

    #[test]
    fn power_is_the_product_of_powers(exponents in prop::array::uniform3(0_u8..8), z in prop::array::uniform3(-3.0..3.0_f64)) {
        let beta = MultiIndex::new(exponents);
        let expected: f64 = z.iter().zip(exponents).map(|(x, e)| x.powi(i32::from(e))).product();
        let bound = power_bound(beta.degree(), f64::EPSILON);
        prop_assert!((beta.power(&z) - expected).abs() <= bound * expected.abs());
        let single = z.map(|x| x as f32);
        let expected: f64 = single.iter().zip(exponents).map(|(&x, e)| f64::from(x).powi(i32::from(e))).product();
        let bound = power_bound(beta.degree(), f64::from(f32::EPSILON));
        prop_assert!((f64::from(beta.power(&single)) - expected).abs() <= bound * expected.abs() + f64::from(f32::MIN_POSITIVE));
    }

    #[test]
    fn powers_of_small_integers_are_exact(exponents in prop::array::uniform2(0_u8..6), z in prop::array::uniform2(-9_i32..=9)) {
        let exact: i64 = z.iter().zip(exponents).map(|(&x, e)| i64::from(x).pow(u32::from(e))).product();
        prop_assert_eq!(MultiIndex::new(exponents).power(&z.map(f64::from)), exact as f64);
    }
}
