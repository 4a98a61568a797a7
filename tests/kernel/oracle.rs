//! Kernels and moments against tables derived elsewhere.

use parops::{
    CenterTerm, Exchange, Gaussian, Kernel, MultiIndex, Neighbor, Rational, Stencil, Term, Volumes, WideGaussian,
    continuous_moment, discrete_moment, graded, testing::Promise,
};
use serde_json::Value;

fn table(text: &str) -> Value {
    serde_json::from_str(text).expect("the table is JSON")
}

fn rational(text: &Value) -> Rational {
    let text = text.as_str().expect("rationals are strings");
    let (n, d) = text.split_once('/').unwrap_or((text, "1"));
    Rational::new(n.parse().expect("numerator"), d.parse().expect("denominator")).expect("in range")
}

fn index<const D: usize>(key: &str) -> MultiIndex<D> {
    let exponents: Vec<u8> = key.split(',').map(|n| n.parse().expect("exponent")).collect();
    MultiIndex::new(exponents.try_into().expect("as many exponents as dimensions"))
}

fn terms<const D: usize>(operator: &str) -> Vec<Term<D>> {
    let one = |degrees: &[(usize, u8)]| {
        let mut exponents = [0; D];
        for &(axis, degree) in degrees {
            exponents[axis] = degree;
        }
        Term { index: MultiIndex::new(exponents), factor: 1.0 }
    };
    match operator {
        "identity" => vec![one(&[])],
        "d_dz1" => vec![one(&[(0, 1)])],
        "laplacian" => (0..D).map(|axis| one(&[(axis, 2)])).collect(),
        "d2_dz1dz1" => vec![one(&[(0, 2)])],
        "d2_dz1dz2" => vec![one(&[(0, 1), (1, 1)])],
        other => panic!("unknown operator {other}"),
    }
}

/// Compares one entry of the table and returns how many rationals were compared.
fn compare<const D: usize>(operator: &str, order: u32, entry: &Value) -> usize {
    let kernel = Exchange::<D>::new(&terms(operator), order).expect("kernel");
    let polynomial = kernel.exact().expect("exact");
    let monomials = entry["monomials"].as_object().expect("monomials");
    assert_eq!(polynomial.iter().count(), monomials.len(), "{operator} d{D} r{order}");
    let same = |what: &str| {
        let name = format!("{operator} d{D} r{order} {what}");
        Promise::new("Kernels", "Exchange coefficients and moments against the table, as fractions").case(name)
    };
    for (key, value) in monomials {
        same(key).equal(&polynomial.coefficient(index(key)), &rational(value));
    }
    same("M_0").equal(&kernel.moment(MultiIndex::ZERO).expect("M_0"), &rational(&entry["M_0"]));
    let leading = entry["leading_error_moments"].as_object().expect("leading_error_moments");
    let degree = terms::<D>(operator)[0].index.degree() + order;
    for alpha in graded::<D>(degree, degree) {
        let key = alpha.exponents().map(|n| n.to_string()).join(",");
        let expected = leading.get(&key).map_or(Rational::ZERO, rational);
        same(&key).equal(&kernel.moment(alpha).expect("moment"), &expected);
    }
    monomials.len() + 1 + leading.len()
}

#[test]
fn exchange_kernels_equal_every_full_space_entry_exactly() {
    let table = table(include_str!("../data/pse_kernels.json"));
    let mut entries = 0;
    for (operator, kernels) in table["full_space"].as_object().expect("full_space") {
        for (key, entry) in kernels.as_object().expect("kernels") {
            let (dim, order) = key.split_once("_r").expect("d?_r?");
            let order = order.parse().expect("order");
            let compared = match dim {
                "d1" => compare::<1>(operator, order, entry),
                "d2" => compare::<2>(operator, order, entry),
                "d3" => compare::<3>(operator, order, entry),
                other => panic!("unknown dimension {other}"),
            };
            assert!(compared >= 3);
            entries += 1;
        }
    }
    // Four operators in three dimensions and the mixed derivative in two, four orders each.
    assert_eq!(entries, (4 * 3 + 2) * 4);
}

/// Rounding of the quadrature against the absolute moment: 10^4 terms, random walk, with a margin of ten.
const SUM: f64 = 1e3 * f64::EPSILON;

/// The moment by quadrature against the table.
fn quadrature_equals<const D: usize>(kernel: &dyn Kernel<f64, D>, alpha: MultiIndex<D>, expected: &Value) {
    let found = continuous_moment(kernel, alpha).expect("radii");
    let expected = rational(expected).to_f64();
    assert!((found.value - expected).abs() <= SUM * found.absolute, "{alpha}: {found:?} {expected}");
}

#[test]
fn gaussian_moments_in_one_dimension_equal_the_table() {
    let table = table(include_str!("../data/moments.json"));
    let narrow = Exchange::<1>::new(&terms("laplacian"), 2).expect("kernel");
    let first = Exchange::<1>::new(&terms("d_dz1"), 2).expect("kernel");
    let (gaussian, wide) = (Gaussian::<1>::new(), WideGaussian::<1>::new());
    let kernels: [(&str, &dyn Kernel<f64, 1>, Option<&Exchange<1>>); 4] = [
        ("mollifier exp(-z^2/2)/sqrt(2 pi)", &gaussian, None),
        ("diffusion exp(-z^2/4)/(2 sqrt(pi))", &wide, None),
        ("diffusion 4 exp(-z^2)/sqrt(pi)", &narrow, Some(&narrow)),
        ("first derivative -2 z exp(-z^2)/sqrt(pi)", &first, Some(&first)),
    ];
    let mut compared = 0;
    for (name, kernel, exact) in kernels {
        for (degree, expected) in table["one_dimension"][name].as_object().expect("moments") {
            let alpha = index(degree);
            quadrature_equals(kernel, alpha, expected);
            if let Some(exact) = exact {
                assert_eq!(exact.moment(alpha).expect("small"), rational(expected), "{name} {alpha}");
            }
            compared += 1;
        }
    }
    assert_eq!(compared, 5 + 5 + 5 + 4);
}

#[test]
fn gaussian_moments_of_several_axes_equal_the_table() {
    let table = table(include_str!("../data/moments.json"));
    let narrow = Exchange::<3>::new(&terms("laplacian"), 2).expect("kernel");
    let wide = WideGaussian::<3>::new();
    let mut compared = 0;
    for (name, kernel) in [
        ("diffusion (2 sqrt(pi))^-d exp(-|z|^2/4)", &wide as &dyn Kernel<f64, 3>),
        ("diffusion 4 pi^(-d/2) exp(-|z|^2)", &narrow),
    ] {
        for (key, expected) in table["gaussian_multi_index"][name].as_object().expect("moments") {
            let mut exponents = [0; 3];
            for (exponent, text) in exponents.iter_mut().zip(key.split(',')) {
                *exponent = text.parse().expect("exponent");
            }
            let alpha = MultiIndex::new(exponents);
            quadrature_equals(kernel, alpha, expected);
            if name.contains("4 pi") {
                assert_eq!(narrow.moment(alpha).expect("small"), rational(expected), "{alpha}");
            }
            compared += 1;
        }
    }
    assert_eq!(compared, 14);
}

/// The fraction of Int |z|^power eta outside the radius, for a radial kernel, by Simpson's rule along one axis.
fn lost<const D: usize>(kernel: &dyn Kernel<f64, D>, radius: f64, power: i32) -> f64 {
    let integral = |low: f64, high: f64| {
        let intervals = 40_000;
        let h = (high - low) / f64::from(intervals);
        let mut sum = 0.0;
        for i in 0..=intervals {
            let x = low + h * f64::from(i);
            let mut z = [0.0; D];
            z[0] = x;
            let weight = if i == 0 || i == intervals { 1.0 } else { f64::from(2 + 2 * (i % 2)) };
            sum += weight * x.powi(power + D as i32 - 1) * kernel.value(&z);
        }
        sum * h / 3.0
    };
    // exp(-30^2/4) = 2e-98 is all that lies beyond.
    integral(radius, 30.0) / (integral(0.0, radius) + integral(radius, 30.0))
}

fn truncation_equals<const D: usize>(table: &Value) {
    // The table has twelve digits. Simpson's rule with h = 30/40000 and a fourth derivative of (2 x)^4 times the
    // integrand, x <= 6, is wrong by h^4/180 * 20736 = 4e-11.
    const DIGITS: f64 = 1e-10;
    let narrow = Exchange::<D>::new(&terms("laplacian"), 2).expect("kernel");
    let wide = WideGaussian::<D>::new();
    for (radius, losses) in table.as_object().expect("radii") {
        let radius: f64 = radius.parse().expect("radius");
        for (power, name) in [(0, "lost_zeroth"), (2, "lost_second")] {
            let expected: f64 = losses[name].as_str().expect("decimals").parse().expect("number");
            for (kernel, radius) in [(&wide as &dyn Kernel<f64, D>, radius), (&narrow, radius / 2.0)] {
                let found = lost(kernel, radius, power);
                assert!((found / expected - 1.0).abs() <= DIGITS, "d{D} R = {radius}: {found:e} {expected:e}");
            }
        }
    }
}

#[test]
fn truncation_losses_equal_the_table() {
    let table = table(include_str!("../data/moments.json"));
    let losses = &table["truncation_of_exp(-|z|^2/4)_at_radius"];
    truncation_equals::<1>(&losses["d1"]);
    truncation_equals::<2>(&losses["d2"]);
    truncation_equals::<3>(&losses["d3"]);
}

#[test]
fn lattice_moments_equal_the_table_by_spacing() {
    let table = table(include_str!("../data/moments.json"));
    let narrow = Exchange::<1>::new(&terms("laplacian"), 2).expect("kernel");
    let first = Exchange::<1>::new(&terms("d_dz1"), 2).expect("kernel");
    let wide = WideGaussian::<1>::new();
    let kernels: [(&str, &dyn Kernel<f64, 1>, u8); 3] = [
        ("exp(-z^2/4)/(2 sqrt pi): M2", &wide, 2),
        ("4 exp(-z^2)/sqrt pi: M2", &narrow, 2),
        ("-2 z exp(-z^2)/sqrt pi: M1", &first, 1),
    ];
    let mut compared = 0;
    for (spacing, moments) in table["lattice_moments_by_h_over_eps"].as_object().expect("spacings") {
        let Ok(delta) = spacing.parse::<f64>() else { continue };
        let mut row = Stencil::<1>::default();
        row.reset(0, Some(0), 30.0);
        for q in 1..=(30.0 / delta) as usize {
            let x = q as f64 * delta;
            row.push(Neighbor { q: 2 * q - 1, separation: [x], sign: 1 });
            row.push(Neighbor { q: 2 * q, separation: [-x], sign: 1 });
        }
        let volumes = Volumes::equal(delta).expect("volume");
        for (name, kernel, degree) in kernels {
            let expected = moments[name].as_f64().expect("number");
            let alpha = MultiIndex::new([degree]);
            let found = discrete_moment(kernel, &row, &volumes, 1.0, alpha, CenterTerm::Excluded).expect("finite");
            // Both sums have at most 240 terms, all of one sign.
            assert!(
                (found - expected).abs() <= 240.0 * f64::EPSILON * expected.abs(),
                "{name} {delta}: {found} {expected}"
            );
            compared += 1;
        }
    }
    assert_eq!(compared, 7 * 3);
}
