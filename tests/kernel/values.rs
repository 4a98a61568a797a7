//! Kernels: exact derivation, values, derivatives, scalars, limits.

use std::time::{Duration, Instant};

use crate::cases::cases;
use crate::properties::properties;
use num_dual::Dual64;
use parops::{
    Error, ErrorKind, ExactPolynomial, Exchange, Gaussian, HighOrderGaussian, Kernel, KernelError, MultiIndex,
    MultiIndexError, Rational, SmoothingKernel, Term, WideGaussian, graded, moment_conditions,
};
use proptest::prelude::*;

fn one<const D: usize>(exponents: [u8; D]) -> Vec<Term<D>> {
    vec![Term { index: MultiIndex::new(exponents), factor: 1.0 }]
}

fn laplacian<const D: usize>(factor: f64) -> Vec<Term<D>> {
    (0..D)
        .map(|axis| {
            let mut exponents = [0; D];
            exponents[axis] = 2;
            Term { index: MultiIndex::new(exponents), factor }
        })
        .collect()
}

fn kind(error: Error) -> ErrorKind {
    error.kind().clone()
}

/// Moments of an exact kernel against the conditions, as rationals: difference exactly 0.
fn conditions_hold_exactly<const D: usize>(terms: &[Term<D>], order: u32) {
    let kernel = Exchange::new(terms, order).expect("within the limit");
    let polynomial = kernel.exact().expect("small");
    let degree = terms[0].index.degree();
    for alpha in moment_conditions::<D>(degree, order) {
        let mut required = Rational::ZERO;
        for term in terms.iter().filter(|term| term.index == alpha) {
            let factorial = i128::try_from(alpha.factorial().expect("small")).expect("small");
            let part = Rational::from_f64(term.factor).expect("dyadic").checked_mul(Rational::integer(factorial));
            required = required.checked_add(part.expect("small")).expect("small");
        }
        if alpha.sign() < 0 {
            required = required.checked_mul(Rational::integer(-1)).expect("small");
        }
        assert_eq!(polynomial.gaussian_moment(alpha).expect("small"), required, "{terms:?} r = {order} {alpha}");
    }
}

fn order() -> impl Strategy<Value = u32> {
    prop_oneof![Just(2_u32), Just(4), Just(6), Just(8)]
}

/// Terms of one degree up to 6, with factors that are multiples of 1/8.
fn sums<const D: usize>() -> impl Strategy<Value = Vec<Term<D>>> {
    (0_u32..=6, prop::collection::vec((any::<prop::sample::Index>(), -64_i32..=64), 1..4)).prop_map(
        |(degree, picks)| {
            let all: Vec<_> = graded::<D>(degree, degree).collect();
            let term = |(pick, eighths): (prop::sample::Index, i32)| Term {
                index: all[pick.index(all.len())],
                factor: f64::from(eighths) / 8.0,
            };
            picks.into_iter().map(term).collect()
        },
    )
}

proptest! {
    #![proptest_config(properties(cases()))]

    #[test]
    fn exchange_satisfies_every_condition_exactly_for_random_sums_in_one_dimension(terms in sums::<1>(), order in order()) {
        conditions_hold_exactly(&terms, order);
    }

    #[test]
    fn exchange_satisfies_every_condition_exactly_for_random_sums_in_two_dimensions(terms in sums::<2>(), order in order()) {
        conditions_hold_exactly(&terms, order);
    }

    #[test]
    fn exchange_is_linear_in_its_terms(a in sums::<2>(), order in order(), z in prop::array::uniform2(-4.0..4.0_f64)) {
        let whole = Exchange::new(&a, order).expect("kernel");
        let (mut sum, mut size) = (0.0, 0.0);
        for term in &a {
            let part = Exchange::new(&one(term.index.exponents()), order).expect("kernel");
            sum += term.factor * part.value(&z);
            size += (term.factor * absolute(&part, &z)).abs();
        }
        // Each kernel is within ROUNDINGS eps of its absolute terms, and so is the sum of up to three.
        prop_assert!((whole.value(&z) - sum).abs() <= 2.0 * ROUNDINGS * f64::EPSILON * size);
    }

    #[test]
    fn exchange_value_equals_its_exact_polynomial(terms in sums::<2>(), order in order(), z in prop::array::uniform2(-6.0..6.0_f64)) {
        let kernel = Exchange::new(&terms, order).expect("kernel");
        let expected = polynomial(&kernel.exact().expect("exact"), &z) * gaussian(&z);
        prop_assert!((kernel.value(&z) - expected).abs() <= ROUNDINGS * f64::EPSILON * absolute(&kernel, &z));
    }

    #[test]
    fn exchange_has_the_parity_of_its_degree(terms in sums::<2>(), order in order(), z in prop::array::uniform2(-6.0..6.0_f64)) {
        let kernel = Exchange::new(&terms, order).expect("kernel");
        let mirrored = kernel.value(&z.map(|x| -x)) * f64::from(terms[0].index.sign());
        prop_assert_eq!(kernel.value(&z), mirrored);
    }
}

/// Roundings along one path of a kernel of degree up to 12: 12 products and sums by Horner, 6 powers, the sum of squares
/// under exp times its size 72, constants and normalization.
const ROUNDINGS: f64 = 160.0;

fn gaussian<const D: usize>(z: &[f64; D]) -> f64 {
    z.iter().map(|x| (-x * x).exp() / std::f64::consts::PI.sqrt()).product()
}

fn polynomial<const D: usize>(polynomial: &ExactPolynomial<D>, z: &[f64; D]) -> f64 {
    polynomial.iter().map(|(alpha, p)| p.to_f64() * alpha.power(z)).sum()
}

/// The absolute terms of P(z) exp(-|z|^2), as evaluated: harmonic monomials times powers of |z|^2, bounded by the
/// monomials of |p_alpha| with an allowance for those that cancel between the harmonics.
fn absolute<const D: usize>(kernel: &Exchange<D>, z: &[f64; D]) -> f64 {
    let polynomial = kernel.exact().expect("exact");
    let s: f64 = z.iter().map(|x| x * x).sum();
    // By degree: the sum of |p_alpha| times |z|^degree bounds what each harmonic part contributes.
    let sum: f64 = polynomial.iter().map(|(alpha, p)| p.to_f64().abs() * s.sqrt().powi(alpha.degree() as i32)).sum();
    sum * gaussian(z)
}

#[test]
fn exchange_satisfies_every_condition_exactly_in_three_dimensions() {
    for degree in 0..=6 {
        for beta in graded::<3>(degree, degree) {
            for order in [2, 4, 6, 8] {
                conditions_hold_exactly(&one(beta.exponents()), order);
            }
        }
    }
    conditions_hold_exactly(&laplacian::<3>(0.3), 8);
    let kernel = Exchange::new(&laplacian::<3>(0.5), 8).expect("kernel");
    assert_eq!(kernel.moment(MultiIndex::new([0, 2, 0])), Ok(Rational::ONE));
}

#[test]
fn exchange_in_four_dimensions_satisfies_every_condition_exactly() {
    conditions_hold_exactly(&one([2, 1, 0, 1]), 4);
    conditions_hold_exactly(&laplacian::<4>(1.0), 6);
}

#[test]
fn laplacian_kernel_is_purely_radial() {
    let kernel = Exchange::new(&laplacian::<2>(1.0), 4).expect("kernel");
    let polynomial = kernel.exact().expect("exact");
    assert_eq!(polynomial.coefficient(MultiIndex::ZERO), Rational::integer(12));
    assert_eq!(polynomial.coefficient(MultiIndex::new([2, 0])), Rational::integer(-4));
    assert_eq!(polynomial.iter().count(), 3);
}

#[test]
fn factors_far_apart_are_still_derived_and_summed() {
    let far = [(MultiIndex::new([2, 0]), 1.0), (MultiIndex::new([0, 2]), 1e-60)]
        .map(|(index, factor)| Term { index, factor });
    let kernel = Exchange::new(&far, 4).expect("kernel");
    assert!(kernel.exact().is_none());
    assert!(matches!(
        kind(kernel.moment(MultiIndex::ZERO).unwrap_err()),
        ErrorKind::Kernel(KernelError::Overflow { .. })
    ));
    let alone = Exchange::new(&one([2, 0]), 4).expect("kernel");
    // Beyond 1e-60 both are the same kernel, evaluated alike.
    assert_eq!(kernel.value(&[0.3, -0.7]), alone.value(&[0.3, -0.7]));
}

#[test]
fn tiny_and_huge_factors_scale_the_kernel_exactly() {
    let unit = Exchange::new(&laplacian::<3>(1.0), 6).expect("kernel");
    for power in [-900, -60, 60, 900] {
        let factor = 2.0_f64.powi(power);
        let scaled = Exchange::new(&laplacian::<3>(factor), 6).expect("kernel");
        assert_eq!(scaled.value(&[0.1, 0.2, 0.3]), factor * unit.value(&[0.1, 0.2, 0.3]));
        assert!(Kernel::<f64, 3>::positive_definite(&scaled));
    }
}

#[test]
fn illegal_orders_degrees_and_factors_are_refused() {
    for order in [0, 1, 3, 5, 7, 9, 10, u32::MAX] {
        let refused = Exchange::new(&one([1]), order).unwrap_err();
        assert_eq!(kind(refused), ErrorKind::Kernel(KernelError::Order { order }));
        assert_eq!(
            kind(HighOrderGaussian::<2>::new(order).unwrap_err()),
            ErrorKind::Kernel(KernelError::Order { order })
        );
    }
    let mixed = [one([2, 0]), one([1, 0])].concat();
    assert_eq!(
        kind(Exchange::new(&mixed, 2).unwrap_err()),
        ErrorKind::MultiIndex(MultiIndexError::UnequalDegree { first: 2, other: 1 })
    );
    assert_eq!(
        kind(Exchange::<2>::new(&[], 2).unwrap_err()),
        ErrorKind::MultiIndex(MultiIndexError::Empty { output: 0 })
    );
    let infinite = [Term { index: MultiIndex::new([1]), factor: f64::INFINITY }];
    assert!(Exchange::new(&infinite, 2).is_err());
}

#[test]
fn every_kernel_up_to_the_degree_limit_is_derived() {
    for order in [2, 4, 6, 8] {
        for degree in 0..=Exchange::<1>::DEGREE_LIMIT {
            Exchange::new(&one([degree as u8]), order).expect("one dimension");
        }
    }
    for beta in graded::<2>(Exchange::<2>::DEGREE_LIMIT, Exchange::<2>::DEGREE_LIMIT) {
        Exchange::new(&one(beta.exponents()), 8).expect("two dimensions");
    }
    // The harmonics do not depend on the order, and the order 8 has the largest numbers. Derivations commute with a
    // permutation of the axes; of the sorted ones the thin, the flat and the round are tried.
    let limit = Exchange::<3>::DEGREE_LIMIT as u8;
    for (b, c) in
        [(0, 0), (1, 0), (1, 1), (limit / 2, 0), (limit / 2, 1), (limit / 3, limit / 3), (limit / 4, limit / 5)]
    {
        Exchange::new(&one([limit - b - c, b, c]), 8).expect("three dimensions");
    }
}

#[test]
fn beyond_the_degree_limit_overflow_is_a_typed_error() {
    let mut refused = 0;
    for degree in Exchange::<1>::DEGREE_LIMIT as u8 + 1..=255 {
        match Exchange::new(&one([degree]), 8) {
            Ok(kernel) => {
                // What is derived is right: the condition of the kernel's own monomial holds, or does not fit.
                let moment = kernel.moment(MultiIndex::new([degree]));
                let factorial = MultiIndex::new([degree]).factorial();
                if let (Ok(moment), Ok(factorial)) = (moment, factorial) {
                    assert_eq!(moment.numerator().unsigned_abs(), factorial);
                }
            }
            Err(error) => {
                let degree = u32::from(degree);
                assert_eq!(kind(error), ErrorKind::Kernel(KernelError::Overflow { degree, order: 8 }));
                refused += 1;
            }
        }
    }
    assert!(refused > 200, "{refused}");
    assert!(Exchange::new(&one([255, 255, 255]), 2).is_err());
}

#[test]
fn derivations_of_too_many_monomials_are_refused_at_once() {
    fn refused<const D: usize>(exponents: [u8; D]) {
        let start = Instant::now();
        let error = Exchange::new(&one(exponents), 8).expect_err("too many");
        let degree = MultiIndex::new(exponents).degree();
        assert_eq!(kind(error), ErrorKind::Kernel(KernelError::Overflow { degree, order: 8 }));
        assert!(start.elapsed() < Duration::from_secs(1), "{exponents:?}: {:?}", start.elapsed());
    }
    // The lowest degrees beyond the limit: 1140, 1365 and 1287 monomials.
    refused([34, 0, 0, 0]);
    refused([22, 0, 0, 0, 0]);
    refused([16, 0, 0, 0, 0, 0]);
    refused([14; 4]);
    refused([42; 6]);
    refused([255; 6]);
    refused([255; 3]);
    // Every monomial of the limit at once, in all four parities: C(43, 2) = 903 of them.
    let limit = Exchange::<3>::DEGREE_LIMIT;
    let all: Vec<_> = graded::<3>(limit, limit).map(|index| Term { index, factor: 1.0 }).collect();
    assert_eq!(all.len(), 903);
    assert!(Exchange::new(&all, 2).is_ok());
}

#[test]
fn derivations_near_the_monomial_limit_succeed_in_four_to_six_dimensions() {
    // The highest degrees within the limit, all of even parity: 969, 1001 and 792 monomials.
    assert!(Exchange::new(&one([8; 4]), 8).is_ok());
    assert!(Exchange::new(&one([4; 5]), 8).is_ok());
    assert!(Exchange::new(&one([4, 2, 2, 2, 2, 2]), 8).is_ok());
}

#[test]
fn combinations_equal_the_sums_of_their_derivatives() {
    fn agree<const D: usize>(kernel: &impl SmoothingKernel<f64, D>, terms: &[Term<D>], points: &[[f64; D]]) {
        let mut combined = vec![f64::NAN; points.len()];
        kernel.combination(terms, points, &mut combined).expect("smooth");
        for (z, combined) in points.iter().zip(combined) {
            let parts = terms.iter().map(|term| term.factor * kernel.derivative(term.index, z).expect("smooth"));
            let (sum, absolute) = parts.fold((0.0, 0.0), |(sum, size), part| (sum + part, size + part.abs()));
            // The parts of a derivative cancel by up to the value of the absolute polynomial at |z| <= 5, 5^4 times.
            let tolerance =
                64.0 * f64::EPSILON * (absolute + 625.0 * (-0.5 * z.iter().map(|x| x * x).sum::<f64>()).exp());
            assert!((combined - sum).abs() <= tolerance, "{terms:?} at {z:?}: {combined:e} and {sum:e}");
        }
    }
    // More points than a block holds.
    let points: Vec<[f64; 2]> = (0..150).map(|i| [0.03 * f64::from(i) - 2.0, 2.5 - 0.04 * f64::from(i)]).collect();
    for degree in 0..=4 {
        let terms: Vec<_> = graded::<2>(degree, degree)
            .zip([1.0, -0.5, 3.0, 0.0, 2.0])
            .map(|(index, factor)| Term { index, factor })
            .collect();
        agree(&Gaussian::<2>::new(), &terms, &points);
        for order in [2, 4, 6, 8] {
            agree(&HighOrderGaussian::<2>::new(order).expect("order"), &terms, &points);
        }
    }
    let none = [Term { index: MultiIndex::<2>::ZERO, factor: 0.0 }; 0];
    agree(&Gaussian::<2>::new(), &none, &points);
    agree(&HighOrderGaussian::<2>::new(4).expect("order"), &none, &points);
}

/// Dual numbers differentiate `value`; the derivatives of the kernel are to agree. Returns how many were compared.
fn derivatives_agree_with_dual_numbers<const D: usize, K>(kernel: &K, z: [f64; D]) -> usize
where
    K: SmoothingKernel<f64, D> + SmoothingKernel<Dual64, D>,
{
    // Up to degree 4 a derivative is at most about 100 times W(0), from terms some 10 times as large.
    let tolerance = 1000.0 * ROUNDINGS * f64::EPSILON * Kernel::<f64, D>::value(kernel, &[0.0; D]);
    let mut compared = 0;
    for beta in graded::<D>(0, 4) {
        for axis in 0..D {
            let mut dual = z.map(Dual64::from_re);
            dual[axis] = dual[axis].derivative();
            let derivative: Dual64 = kernel.derivative(beta, &dual).expect("smooth");
            let mut next = beta.exponents();
            next[axis] += 1;
            let expected: f64 = kernel.derivative(MultiIndex::new(next), &z).expect("smooth");
            assert!(
                (derivative.eps - expected).abs() <= tolerance,
                "{beta} {axis} {z:?}: {} {expected}",
                derivative.eps
            );
            compared += 1;
        }
    }
    let gradient: [f64; D] = kernel.gradient(&z).expect("smooth");
    for (axis, component) in gradient.into_iter().enumerate() {
        let expected: f64 = kernel.derivative(MultiIndex::unit(axis).expect("axis"), &z).expect("smooth");
        assert!((component - expected).abs() <= tolerance);
    }
    compared
}

#[test]
fn derivatives_of_smoothing_kernels_agree_with_dual_numbers() {
    for z in [[0.0, 0.0], [0.3, -1.1], [2.0, 0.0], [-3.0, 2.5]] {
        assert_eq!(derivatives_agree_with_dual_numbers(&Gaussian::<2>::new(), z), 30);
        for order in [2, 4, 6, 8] {
            let kernel = HighOrderGaussian::<2>::new(order).expect("order");
            assert_eq!(derivatives_agree_with_dual_numbers(&kernel, z), 30);
        }
    }
    let kernel = HighOrderGaussian::<3>::new(8).expect("order");
    derivatives_agree_with_dual_numbers(&kernel, [0.1, 0.0, -0.7]);
    derivatives_agree_with_dual_numbers(&Gaussian::<3>::new(), [0.1, 0.0, -0.7]);
    derivatives_agree_with_dual_numbers(&Gaussian::<1>::new(), [0.0]);
}

#[test]
fn dual_numbers_pass_the_origin_without_nan() {
    let origin = [Dual64::from_re(0.0).derivative(), Dual64::from_re(0.0)];
    for order in [2, 4, 6, 8] {
        let even = Exchange::new(&laplacian::<2>(1.0), order).expect("kernel");
        assert_eq!(even.value(&origin).eps, 0.0);
        let odd = Exchange::new(&one([1, 0]), order).expect("kernel");
        let slope = odd.exact().expect("exact").coefficient(MultiIndex::new([1, 0])).to_f64() / std::f64::consts::PI;
        // One rounding each of the coefficient, of 1/pi in two steps, and of the product.
        assert!((odd.value(&origin).eps - slope).abs() <= 4.0 * f64::EPSILON * slope.abs());
    }
    assert_eq!(WideGaussian::<2>::new().value(&origin).eps, 0.0);
}

#[test]
fn single_precision_agrees_with_double() {
    let points = [[0.0, 0.0], [0.25, -1.5], [3.0, 0.5], [-2.0, 4.0]];
    let lift = |z: [f64; 2]| z.map(|x| x as f32);
    for order in [2, 4, 6, 8] {
        for beta in graded::<2>(0, 4) {
            let kernel = Exchange::new(&one(beta.exponents()), order).expect("kernel");
            let mut single = [0.0_f32; 4];
            kernel.values(&points.map(lift), &mut single);
            for (z, single) in points.iter().zip(single) {
                let tolerance = ROUNDINGS * f64::from(f32::EPSILON) * absolute(&kernel, z);
                assert!((f64::from(single) - kernel.value(z)).abs() <= tolerance, "{beta} r = {order} {z:?}");
            }
        }
    }
    let (gaussian, wide) = (Gaussian::<2>::new(), WideGaussian::<2>::new());
    for z in points {
        let tolerance = ROUNDINGS * f64::from(f32::EPSILON);
        let (single, double): (f32, f64) = (gaussian.value(&lift(z)), gaussian.value(&z));
        assert!((f64::from(single) - double).abs() <= tolerance * double);
        let (single, double): (f32, f64) = (wide.value(&lift(z)), wide.value(&z));
        assert!((f64::from(single) - double).abs() <= tolerance * double);
    }
}

#[test]
fn values_equal_value_in_all_kernels_behind_dyn() {
    let kernels: Vec<Box<dyn Kernel<f64, 2>>> = vec![
        Box::new(Gaussian::new()),
        Box::new(WideGaussian::new()),
        Box::new(HighOrderGaussian::new(6).expect("order")),
        Box::new(Exchange::new(&laplacian(1.0), 4).expect("kernel")),
        Box::new(Exchange::new(&one([1, 0]), 4).expect("kernel")),
        Box::new(Exchange::new(&one([2, 1]), 8).expect("kernel")),
    ];
    let points = [[0.0, 0.0], [0.5, -0.25], [3.0, 1.0]];
    for kernel in &kernels {
        let mut values = [0.0; 3];
        kernel.values(&points, &mut values);
        assert_eq!(values, points.map(|z| kernel.value(&z)));
        assert!(values.iter().any(|&value| value != 0.0));
    }
}

#[test]
fn wide_and_narrow_gaussian_are_one_operator_at_twice_the_epsilon() {
    let narrow = Exchange::new(&laplacian::<2>(1.0), 2).expect("kernel");
    let wide = WideGaussian::<2>::new();
    for z in [[0.0, 0.0], [0.7, -0.2], [2.0, 3.0]] {
        // epsilon^-2 eta_epsilon with epsilon doubled: 2^-(2+D) eta(z/2).
        let scaled = narrow.value(&z.map(|x| x / 2.0)) / 16.0;
        let value: f64 = wide.value(&z);
        assert!((scaled - value).abs() <= ROUNDINGS * f64::EPSILON * value);
    }
}

#[test]
fn identity_kernel_of_order_two_is_narrower_than_the_gaussian() {
    let (narrow, gaussian) = (HighOrderGaussian::<1>::new(2).expect("order"), Gaussian::<1>::new());
    let (a, b): (f64, f64) = (narrow.value(&[1.0]), gaussian.value(&[std::f64::consts::SQRT_2]));
    assert!((a - b * std::f64::consts::SQRT_2).abs() <= ROUNDINGS * f64::EPSILON * a);
    assert_eq!(SmoothingKernel::<f64, 1>::normalization(&narrow), Kernel::<f64, 1>::value(&narrow, &[0.0]));
}

#[test]
fn derivative_beyond_the_limit_is_refused() {
    let kernel = HighOrderGaussian::<2>::new(4).expect("order");
    let derivative =
        |exponents| SmoothingKernel::<f64, 2>::derivative(&kernel, MultiIndex::new(exponents), &[0.5, 0.5]);
    assert!(derivative([128, 127]).expect("at the limit").is_finite());
    let refused = kind(derivative([128, 128]).unwrap_err());
    assert_eq!(
        refused,
        ErrorKind::Kernel(KernelError::Regularity { kernel: "HighOrderGaussian", degree: 256, limit: 255 })
    );
}

#[test]
fn only_identity_and_laplacian_are_called_positive_definite() {
    for order in [2, 4, 6, 8] {
        let definite =
            |terms: &[Term<2>]| Kernel::<f64, 2>::positive_definite(&Exchange::new(terms, order).expect("kernel"));
        assert!(definite(&laplacian(1.0)) && definite(&laplacian(0.1)) && definite(&one([0, 0])));
        assert!(!definite(&laplacian(-1.0)) && !definite(&one([2, 0])) && !definite(&one([1, 0])));
        assert!(!definite(&one([2, 2])));
    }
}
