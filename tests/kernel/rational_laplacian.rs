//! The rational exchange kernel: moments, truncation, lattices, and the bound on eigenvalues it must not be given.

use std::f64::consts::PI;

use crate::cases::cases;
use crate::properties::properties;
use num_dual::Dual64;
use parops::{
    CellList, Domain, Epsilon, Error, ErrorKind, Kernel, LatticeSpectrum, OperatorError, Particles, Pse,
    RationalLaplacian, Rk4, Spacing, StepLimit, TimeError,
};
use proptest::prelude::*;
use serde_json::Value;

type Failure = Result<(), Error>;

fn value(z: [f64; 3]) -> f64 {
    RationalLaplacian::new().value(&z)
}

/// Int_0^inf r^n g(r) eta(r) dr by the trapezoidal rule in log r: poles are pi/10 off the axis, so a step of 1/20
/// leaves exp(-2 pi^2 20/10) = 7e-18, for g without fast waves.
fn radial(n: i32, g: impl Fn(f64) -> f64) -> f64 {
    let at = |i: i32| {
        let r = (f64::from(i) / 20.0).exp();
        r.powi(n + 1) * g(r) * value([r, 0.0, 0.0])
    };
    (-800..=800).map(at).sum::<f64>() / 20.0
}

/// 1601 terms of which some hundred count, and pow and exp of a few eps each times their exponents up to 10.
const INTEGRAL: f64 = 100.0 * f64::EPSILON;

#[test]
fn moments_are_those_of_the_table() {
    let table: Value = serde_json::from_str(include_str!("../data/moments.json")).expect("json");
    let entries = &table["rational_3d 15/(pi^2 (1+|z|^10))"];
    // The mean of z^alpha over the unit sphere.
    for (key, degree, mean) in
        [("M_0", 0, 1.0), ("2,0,0", 2, 1.0 / 3.0), ("4,0,0", 4, 0.2), ("2,2,0", 4, 1.0 / 15.0), ("6,0,0", 6, 1.0 / 7.0)]
    {
        let expected: f64 = entries[key]["value"].as_str().expect("text").parse().expect("number");
        let found = 4.0 * PI * mean * radial(degree + 2, |_| 1.0);
        assert!((found / expected - 1.0).abs() <= INTEGRAL, "{key}: {found} {expected}");
    }
}

#[test]
fn lost_part_is_the_second_moment_beyond_the_radius_and_decays_algebraically() {
    let whole = radial(4, |_| 1.0);
    for radius in [0.5, 1.0, 2.0, 5.0, 10.0, 30.0] {
        // Int_R^inf r^4 eta dr = Int_0^(1/R) v^-6 eta(1/v) dv, by Simpson's rule.
        let n = 2000;
        let h = 1.0 / radius / f64::from(n);
        let f = |i: i32| {
            if i == 0 { 0.0 } else { (f64::from(i) * h).powi(-6) * value([0.0, 1.0 / (f64::from(i) * h), 0.0]) }
        };
        let weight = |i: i32| {
            if i == 0 || i == n {
                1.0
            } else if i % 2 == 1 {
                4.0
            } else {
                2.0
            }
        };
        let beyond = (0..=n).map(|i| weight(i) * f(i)).sum::<f64>() * h / 3.0;
        let found = RationalLaplacian::lost(radius);
        // Simpson's error is h^4 of a function that bends within 1.
        assert!((found - beyond / whole).abs() <= 1e-10 * found, "{radius}: {found:e} {:e}", beyond / whole);
    }
    for radius in [3.0, 5.0, 20.0] {
        let order = (RationalLaplacian::lost(radius) / RationalLaplacian::lost(2.0 * radius)).log2();
        // arctan x = x - x^3/3 with x = R^-5 <= 1/243.
        assert!((order - 5.0).abs() < 1e-5, "{order}");
    }
    let at_support = RationalLaplacian::lost(Kernel::<f64, 3>::support(&RationalLaplacian::new()));
    assert!((at_support - 2.04e-4).abs() < 1e-6, "{at_support}");
}

fn bounds() -> Value {
    let table: Value = serde_json::from_str(include_str!("../data/stability_bounds.json")).expect("json");
    table["diffusion"]["rational_3d_15/(pi^2(1+|z|^10))"].clone()
}

/// The accuracies the reference states for this kernel.
const ON_LATTICES: f64 = 1e-6;
const IN_INTEGRAL_FORM: f64 = 1e-8;

#[test]
fn lattice_moments_and_step_limits_are_those_of_the_table() -> Failure {
    let bounds = bounds();
    for entry in bounds["lattice"].as_array().expect("list") {
        let number = |key: &str| entry[key].as_f64();
        let delta = number("h_over_eps").expect("number");
        let spectrum = LatticeSpectrum::scan(&RationalLaplacian::new(), delta, number("cutoff").expect("number"))?;
        let second = number("discrete_second_moment_over_2").expect("number");
        assert!((spectrum.coefficient[1] / second - 1.0).abs() <= ON_LATTICES, "{delta}: {spectrum:?}");
        // The finest lattice has no limit in the table: too many terms for its scan.
        if let (Some(fastest), Some(bound)) = (number("lambda_max"), number("bound")) {
            assert!((spectrum.lambda_max / fastest - 1.0).abs() <= ON_LATTICES, "{delta}: {spectrum:?}");
            let limit = spectrum.limit(0.5, 0.1)?.step_of_interval(2.0);
            assert!((limit / (bound * 0.1 * 0.1 / 0.5) - 1.0).abs() <= ON_LATTICES, "{delta}: {limit}");
        }
    }
    Ok(())
}

#[test]
fn fastest_mode_in_integral_form_decays_faster_than_the_zeroth_moment() {
    // lambda(k) = 4 pi Int r^2 (1 - sin(kr)/(kr)) eta dr; near the maximum k r is moderate where eta counts.
    let zeroth = 4.0 * PI * radial(2, |_| 1.0);
    let decay = |k: f64| {
        4.0 * PI * radial(2, |r| if k * r < 1e-4 { (k * r).powi(2) / 6.0 } else { 1.0 - (k * r).sin() / (k * r) })
    };
    let (mut low, mut high) = (3.0, 8.0);
    while high - low > 1e-6 {
        let (a, b) = (low + 0.382 * (high - low), high - 0.382 * (high - low));
        if decay(a) < decay(b) { low = a } else { high = b }
    }
    let (fastest, bounds) = (decay(low), bounds());
    let expected = bounds["integral_lambda_max"].as_f64().expect("number");
    assert!((fastest / expected - 1.0).abs() <= IN_INTEGRAL_FORM, "{fastest} {expected}");
    assert!((2.0 / fastest / bounds["integral_bound"].as_f64().expect("number") - 1.0).abs() <= IN_INTEGRAL_FORM);
    // A positive definite kernel has none above M_0: this one is not.
    assert!(fastest > 1.04 * zeroth);
    assert!(!Kernel::<f64, 3>::positive_definite(&RationalLaplacian::new()));
}

#[test]
fn rows_bound_the_eigenvalues_by_gershgorin_where_the_sum_of_the_kernel_does_not() -> Failure {
    let (n, h) = (17, 1.0 / 17.0);
    let particles = Particles::lattice([0.0; 3], [1.0; 3], [n; 3])?;
    let epsilon = Spacing(h).epsilon(4.0)?;
    let pse = Pse::<_, 1>::with_kernels([RationalLaplacian::new()], epsilon, particles.volumes()?)?.support(2.0)?;
    let torus = Domain::periodic([0.0; 3], [1.0; 3])?;
    let row = CellList::build(&particles, &torus, pse.cutoff())?;
    let report = *pse.matrix_free(&row)?.report();
    let spectrum = LatticeSpectrum::scan(&RationalLaplacian::new(), 0.25, 2.0)?;
    let fastest = spectrum.lambda_max * 17.0 * 17.0 / 16.0;
    // sum_q V_q eta, q = p included: what errata 26 takes for Gaussians.
    let mut sum = 0.0;
    for i in -8..=8 {
        for j in -8..=8 {
            for k in -8..=8 {
                if i * i + j * j + k * k <= 64 {
                    sum += value([i, j, k].map(|i| 0.25 * f64::from(i))) / 64.0;
                }
            }
        }
    }
    let wrong = sum * 17.0 * 17.0 / 16.0;
    assert!(fastest > 1.03 * wrong, "{fastest} {wrong}");
    let gershgorin = 2.0 * (wrong - value([0.0; 3]) / 64.0 * 17.0 * 17.0 / 16.0);
    assert!((report.spectral_bound / gershgorin - 1.0).abs() < 1e-12, "{} {gershgorin}", report.spectral_bound);
    let limit = StepLimit::from_spectral_bound(report.spectral_bound, 1.0)?;
    assert!(limit.step(&Rk4::<f64>::new()) < StepLimit::from_spectral_bound(fastest, 1.0)?.step(&Rk4::<f64>::new()));
    Ok(())
}

#[test]
fn coarse_lattices_are_refused_for_their_overlap() -> Failure {
    let particles = Particles::lattice([0.0; 3], [1.0; 3], [8; 3])?;
    let pse = Pse::<_, 1>::with_kernels([RationalLaplacian::new()], Epsilon::global(0.25)?, particles.volumes()?)?;
    let error = pse.assemble(&CellList::build(&particles, &Domain::open(), pse.cutoff())?).unwrap_err();
    let ErrorKind::Operator(OperatorError::Overlap { h_over_epsilon, limit }) = *error.kind() else {
        panic!("{error}")
    };
    assert_eq!((h_over_epsilon, limit), (0.5, 0.25));
    Ok(())
}

#[test]
fn waves_are_damped_with_an_error_of_second_order() {
    // sum_j delta^3 eta (1 - cos k z_1) over a lattice, in the place of k^2.
    let symbol = |k: f64| {
        let mut sum = 0.0;
        for i in -32..=32_i32 {
            let wave = 1.0 - (k * 0.25 * f64::from(i)).cos();
            for j in -32..=32_i32 {
                for l in -32..=32_i32 {
                    if i * i + j * j + l * l <= 32 * 32 {
                        sum += wave * value([i, j, l].map(|i| 0.25 * f64::from(i))) / 64.0;
                    }
                }
            }
        }
        sum
    };
    let error = |k: f64| 1.0 - symbol(k) / (k * k);
    let (coarse, fine) = (error(0.8), error(0.4));
    // M_400/24 k^2; the next term is M_600/720 k^4, which is 0.06 k^2 of it, and the lattice misses by 4e-4.
    let expected = 0.061_803_398_874_989_48 * 0.16;
    assert!((fine / expected - 1.0).abs() < 0.06, "{fine} {expected}");
    let order = (coarse / fine).log2();
    assert!((order - 2.0).abs() < 0.12, "{order}");
}

proptest! {
    #![proptest_config(properties(cases()))]

    #[test]
    fn value_is_the_formula_in_all_scalars(z in prop::array::uniform3(-5.0..5.0_f64)) {
        let s: f64 = z.iter().map(|x| x * x).sum();
        let expected = 15.0 / (PI * PI * (1.0 + s.powi(5)));
        // Five products of s, each with the rounding of three squares, the sum, quotient and constant.
        let rounding = 24.0;
        prop_assert!((value(z) / expected - 1.0).abs() <= rounding * f64::EPSILON);
        prop_assert_eq!(value(z), value(z.map(|x| -x)));
        let single: f32 = RationalLaplacian::new().value(&z.map(|x| x as f32));
        prop_assert!((f64::from(single) / expected - 1.0).abs() <= 2.0 * rounding * f64::from(f32::EPSILON));
        let dual = [Dual64::from_re(z[0]).derivative(), Dual64::from_re(z[1]), Dual64::from_re(z[2])];
        let slope = RationalLaplacian::new().value(&dual).eps;
        let exact = -10.0 * z[0] * s.powi(4) / (1.0 + s.powi(5)) * expected;
        prop_assert!((slope - exact).abs() <= 2.0 * rounding * f64::EPSILON * (exact.abs() + expected));
    }
}

#[test]
fn extreme_arguments_give_zero_or_nan() {
    for x in [1e60, 1e160, f64::MAX, f64::INFINITY, f64::NEG_INFINITY] {
        assert!(value([x, 0.0, 0.0]) <= 1e-300 && value([x, x, -x]) <= 1e-300);
        assert!(value([x, f64::NAN, 0.0]).is_nan());
    }
    assert_eq!(value([0.0; 3]), 15.0 / (PI * PI));
    assert_eq!(Kernel::<f32, 3>::value(&RationalLaplacian::new(), &[f32::MAX; 3]), 0.0);
}

#[test]
fn lattice_spectrum_refuses_where_the_kernel_does_not_overlap() {
    let error = LatticeSpectrum::scan(&RationalLaplacian::new(), 6.0, 5.0).unwrap_err();
    assert!(matches!(error.kind(), ErrorKind::Time(TimeError::Growing { .. })), "{error}");
}

#[cfg(feature = "testing")]
mod checkers {
    use super::*;
    use parops::testing::{KernelFault, KernelLimits, check_kernel};

    #[test]
    fn kernel_passes_the_checker_with_limits_for_its_tail() {
        // Beyond the support of 5 lie 2.0e-4 of the second moment, beyond the 8.75 of the quadrature 1.2e-5; at
        // h/epsilon = 1/4 the lattice, cut off by a cube of 6.25, misses 2e-4 for its poles.
        let limits = KernelLimits { moment: 2e-5, lattice: 4e-4, truncation: 2.1e-4 };
        check_kernel(&RationalLaplacian::new(), limits).unwrap_or_else(|fault| panic!("{fault}"));
    }

    #[test]
    fn limits_of_gaussians_are_too_sharp_for_its_tail() {
        let fault = check_kernel(&RationalLaplacian::new(), KernelLimits::default()).unwrap_err();
        assert!(matches!(fault, KernelFault::Support { .. }), "{fault}");
    }
}
