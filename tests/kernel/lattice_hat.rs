//! The lattice hat kernel: PSE with it is the second-order finite difference, and nothing else is accepted.

use crate::cases::cases;
use crate::properties::properties;
use parops::{
    Apply, CellList, CenterTerm, Cutoff, Domain, Epsilon, Error, ErrorKind, Form, Kernel, LatticeHat, MultiIndex,
    Neighbor, OperatorError, Particles, Pse, Random, Rows, Spacing, Stencil, Volumes, discrete_moments, graded,
    testing::Promise,
};
use proptest::prelude::*;

type Failure = Result<(), Error>;

fn pse<const D: usize>(particles: &Particles<D>, epsilon: Epsilon) -> Result<Pse<LatticeHat<D>>, Error> {
    Pse::with_kernels([LatticeHat::new()], epsilon, particles.volumes()?)
}

/// Noise on the n^D lattice of the unit torus, its PSE Laplacian, and sum_i (f_(i+1) - 2 f_i + f_(i-1))/h^2 by indices.
fn both<const D: usize>(n: usize, seed: u64) -> Result<(Vec<f64>, Vec<f64>, Rows), Error> {
    let particles = Particles::lattice([0.0; D], [1.0; D], [n; D])?;
    let h = 1.0 / n as f64;
    let pse = pse(&particles, Spacing(h).epsilon(1.0)?)?;
    let rows = pse.assemble(&CellList::build(&particles, &Domain::periodic([0.0; D], [1.0; D])?, pse.cutoff())?)?;
    let mut random = Random::new(seed);
    let f: Vec<f64> = (0..particles.len()).map(|_| random.uniform() - 0.5).collect();
    let mut found = vec![f64::NAN; f.len()];
    rows.apply(&f, &mut found)?;
    let cell = |x: &[f64; D]| x.map(|x| (x * n as f64) as usize);
    let mut at = std::collections::HashMap::new();
    for (p, x) in particles.points().iter().enumerate() {
        at.insert(cell(x), p);
    }
    let difference = particles.points().iter().enumerate().map(|(p, x)| {
        let mut sum = 0.0;
        for axis in 0..D {
            for step in [1, n - 1] {
                let mut other = cell(x);
                other[axis] = (other[axis] + step) % n;
                sum += f[at[&other]] - f[p];
            }
        }
        sum / h / h
    });
    Ok((found, difference.collect(), rows))
}

fn equal_to_rounding<const D: usize>(n: usize, seed: u64) -> Failure {
    let (found, difference, rows) = both::<D>(n, seed)?;
    assert_eq!(rows.report().most, 2 * D, "the unit steps and no others");
    // Separations of positions up to 1 are rounded to eps/2 of 1, n eps/2 of a step, which is the error of a weight;
    // two such positions, and as much again for weights, volumes and sums. |f_q - f_p| <= 1, 2 D weights of n^2.
    let unit = (n as f64 + 4.0) * f64::EPSILON * (2 * D * n * n) as f64;
    for (found, difference) in found.iter().zip(&difference) {
        Promise::new("Kernels", "PSE with the lattice hat against finite differences, h = 1/n")
            .in_units("(n + 4) eps sum w", unit)
            .at_most(4.0, (found - difference).abs());
    }
    Ok(())
}

proptest! {
    #![proptest_config(properties(cases() / 10))]

    #[test]
    fn pse_with_the_hat_is_the_finite_difference_to_rounding_on_any_lattice(n in 3..40_usize, seed in any::<u64>()) {
        equal_to_rounding::<1>(n, seed).unwrap();
        equal_to_rounding::<2>(n.min(12), seed).unwrap();
        equal_to_rounding::<3>(n.min(6), seed).unwrap();
    }

    #[test]
    fn hat_is_even_bounded_and_zero_outside(z in prop::array::uniform3(-3.0..3.0_f64)) {
        let hat = LatticeHat::<3>::new();
        let value: f64 = hat.value(&z);
        let sum: f64 = z.iter().map(|x| x.abs()).sum();
        prop_assert_eq!(value, hat.value(&z.map(|x| -x)));
        prop_assert!((value - (2.0 - sum).max(0.0)).abs() <= 8.0 * f64::EPSILON);
        let single: f32 = hat.value(&z.map(|x| x as f32));
        prop_assert!((f64::from(single) - value).abs() <= 16.0 * f64::from(f32::EPSILON));
    }
}

#[test]
fn pse_with_the_hat_is_the_finite_difference_bit_for_bit_where_h_is_a_power_of_two() -> Failure {
    for seed in 0..10 {
        for (found, difference, _) in [both::<1>(64, seed)?, both::<2>(16, seed)?, both::<3>(8, seed)?] {
            // The sums differ in order only.
            let bound = 12.0 * f64::EPSILON * 6.0 * 64.0 * 64.0;
            assert!(found.iter().zip(&difference).all(|(a, b)| (a - b).abs() <= bound));
        }
        let (found, difference, _) = both::<1>(64, seed)?;
        // Two terms have no order.
        Promise::new("Kernels", "PSE with the lattice hat in 1D, h = 1/64, bits of the finite difference")
            .equal(&found, &difference);
    }
    Ok(())
}

#[test]
fn strengths_exchange_as_in_equation_thirty_one() -> Failure {
    let n = 50;
    let particles = Particles::lattice([0.0], [2.0], [n])?;
    let h = 2.0 / n as f64;
    let pse = pse(&particles, Spacing(h).epsilon(1.0)?)?.form(Form::Strengths)?;
    let torus = Domain::periodic([0.0], [2.0])?;
    let neighbors = CellList::build(&particles, &torus, pse.cutoff())?;
    let q: Vec<f64> = (0..n).map(|i| (0.3 * i as f64).sin()).collect();
    let (mut stored, mut free) = (vec![f64::NAN; n], vec![f64::NAN; n]);
    pse.assemble(&neighbors)?.apply(&q, &mut stored)?;
    pse.matrix_free(&neighbors)?.apply(&q, &mut free)?;
    assert_eq!(stored, free);
    // As above, with |Q_p - Q_i| <= 0.3.
    let bound = 4.0 * (n as f64 + 4.0) * f64::EPSILON * 2.0 / h / h;
    for i in 0..n {
        let expected = (q[(i + n - 1) % n] - 2.0 * q[i] + q[(i + 1) % n]) / h / h;
        assert!((stored[i] - expected).abs() <= bound, "{i}: {} {expected}", stored[i]);
    }
    assert!(stored.iter().sum::<f64>().abs() <= bound);
    Ok(())
}

#[test]
fn single_precision_rows_are_the_finite_difference_to_their_rounding() -> Failure {
    let n = 32;
    let particles = Particles::lattice([0.0; 2], [1.0; 2], [n; 2])?;
    let pse = pse(&particles, Spacing(1.0 / n as f64).epsilon(1.0)?)?;
    let neighbors = CellList::build(&particles, &Domain::periodic([0.0; 2], [1.0; 2])?, pse.cutoff())?;
    let rows = Rows::<_, f32>::assemble(&pse, &neighbors)?;
    let f: Vec<f32> = (0..n * n).map(|p| if p == 5 * n + 7 { 1.0 } else { 0.0 }).collect();
    let mut out = vec![f32::NAN; n * n];
    rows.apply(&f, &mut out)?;
    // A unit peak: every value is one weight, or minus the sum of four, all powers of two.
    let weight = (n * n) as f32;
    for (p, &out) in out.iter().enumerate() {
        let (dx, dy) = ((p / n).abs_diff(5), (p % n).abs_diff(7));
        let expected = [-4.0 * weight, weight].get(dx + dy).copied().unwrap_or(0.0);
        assert_eq!(out, expected, "{p}");
    }
    Ok(())
}

/// The neighbors k h of a particle at the origin with 0 < |k_i| <= 2.
fn lattice_row<const D: usize>(h: f64) -> Stencil<D> {
    let mut row = Stencil::default();
    row.reset(0, Some(0), 4.0 * h * D as f64);
    for q in 1..5_usize.pow(D as u32) {
        let mut rest = q;
        let separation = std::array::from_fn(|_| {
            let k = rest % 5;
            rest /= 5;
            h * (k as f64 - if k > 2 { 5.0 } else { 0.0 })
        });
        row.push(Neighbor { q, separation, sign: 1 });
    }
    row
}

#[test]
fn discrete_moments_are_those_of_the_laplacian_and_of_the_table() -> Failure {
    fn moments<const D: usize>() -> Failure {
        let alphas: Vec<_> = graded::<D>(1, 3).collect();
        let volumes = Volumes::equal(0.25_f64.powi(D as i32))?;
        let (row, hat) = (lattice_row::<D>(0.25), LatticeHat::<D>::new());
        let found = discrete_moments(&hat, &row, &volumes, 0.25, &alphas, CenterTerm::Included)?;
        for (alpha, found) in alphas.iter().zip(found) {
            let pure = alpha.degree() == 2 && alpha.exponents().contains(&2);
            assert_eq!(found, if pure { 2.0 } else { 0.0 }, "{alpha}");
        }
        Ok(())
    }
    moments::<1>()?;
    moments::<2>()?;
    moments::<3>()?;

    let table: serde_json::Value = serde_json::from_str(include_str!("../data/moments.json")).expect("json");
    let entries = table["one_dimension"]["tent, discrete sum over integers"].as_object().expect("table");
    assert_eq!(entries.len(), 4);
    let (row, hat) = (lattice_row::<1>(1.0), LatticeHat::<1>::new());
    for (n, expected) in entries {
        let alpha = MultiIndex::new([n.parse::<u8>().expect("degree")]);
        let found = discrete_moments(&hat, &row, &Volumes::equal(1.0)?, 1.0, &[alpha], CenterTerm::Included)?;
        assert_eq!(found[0], expected.as_str().expect("text").parse::<f64>().expect("integer"), "{n}");
    }
    Ok(())
}

#[test]
fn continuous_moments_are_those_of_the_table_and_wrong_by_a_third() {
    let table: serde_json::Value = serde_json::from_str(include_str!("../data/moments.json")).expect("json");
    let entries = table["one_dimension"]["tent 2(1-|z|/2), |z|<=2, continuous"].as_object().expect("table");
    let hat = LatticeHat::<1>::new();
    for (n, expected) in entries {
        let n: i32 = n.parse().expect("degree");
        let mut parts = expected.as_str().expect("text").split('/').map(|part| part.parse::<f64>().expect("number"));
        let expected = parts.next().expect("numerator") / parts.next().unwrap_or(1.0);
        // Gauss-Legendre with 4 points, exact to degree 7, on [0, 2] and doubled.
        let nodes = [(0.339981043584856, 0.652145154862546), (0.861136311594053, 0.347854845137454)];
        let sum: f64 = nodes
            .iter()
            .flat_map(|&(x, w)| [(1.0 + x, w), (1.0 - x, w)])
            .map(|(x, w): (f64, f64)| 2.0 * w * x.powi(n) * Kernel::<f64, 1>::value(&hat, &[x]))
            .sum();
        // Nodes and weights have 15 digits.
        assert!((sum / expected - 1.0).abs() < 1e-13, "{n}: {sum} {expected}");
    }
}

#[test]
fn scattered_sets_and_other_overlaps_are_refused() -> Failure {
    let torus = Domain::periodic([0.0; 2], [1.0; 2])?;
    let refused = |particles: &Particles<2>, overlap: f64| -> Result<ErrorKind, Error> {
        let pse = pse(particles, Spacing(1.0 / 16.0).epsilon(overlap)?)?.support(2.0)?;
        let neighbors = CellList::build(particles, &torus, Cutoff(2.0 * overlap / 16.0))?;
        Ok(pse.assemble(&neighbors).map(|_| ()).unwrap_err().kind().clone())
    };
    let jittered = Particles::jittered([0.0; 2], [1.0; 2], [16; 2], 0.2, 3)?;
    assert!(
        matches!(refused(&jittered, 1.0)?, ErrorKind::Operator(OperatorError::Moment { defect, .. }) if defect > 0.3)
    );
    let lattice = Particles::lattice([0.0; 2], [1.0; 2], [16; 2])?;
    // In two dimensions the moment at h/epsilon = 1/2 happens to be near: 17/16 of the one required.
    let half = refused(&lattice, 2.0)?;
    assert!(
        matches!(half, ErrorKind::Operator(OperatorError::Moment { defect, .. }) if (defect - 1.0 / 16.0).abs() < 1e-12),
        "{half:?}"
    );
    let wide = refused(&lattice, 0.9)?;
    assert!(matches!(wide, ErrorKind::Operator(OperatorError::Overlap { limit: 1.0, .. })), "{wide:?}");
    Ok(())
}

#[test]
fn bound_on_the_eigenvalues_is_that_of_the_finite_difference() -> Failure {
    fn sharp<const D: usize>(n: usize) -> Failure {
        let (_, _, rows) = both::<D>(n, 1)?;
        let expected = (4 * D * n * n) as f64;
        // The chessboard attains it on an even lattice.
        assert!((rows.report().spectral_bound / expected - 1.0).abs() <= 16.0 * n as f64 * f64::EPSILON);
        Ok(())
    }
    sharp::<1>(10)?;
    sharp::<2>(10)?;
    sharp::<3>(6)
}

#[test]
fn extreme_arguments_give_zero_or_nan() {
    let hat = LatticeHat::<2>::new();
    for x in [2.0, -1e300, f64::MAX, f64::INFINITY, f64::NEG_INFINITY] {
        assert_eq!(hat.value(&[x, 0.0]), 0.0);
        assert_eq!(hat.value(&[x, x]), 0.0);
        assert!(hat.value(&[x, f64::NAN]).is_nan());
    }
    assert_eq!(hat.value(&[0.0, -0.0]), 2.0);
    assert!(hat.value(&[f64::NAN, 0.0]).is_nan());
    assert_eq!(Kernel::<f32, 2>::value(&hat, &[1.0, 0.5]), 0.5);
}

#[cfg(feature = "testing")]
#[test]
fn checker_of_full_space_kernels_finds_the_moment_that_is_wrong() {
    use parops::testing::{KernelFault, KernelLimits, check_kernel};
    let limits = KernelLimits { truncation: 1.0, ..KernelLimits::default() };
    let fault = check_kernel(&LatticeHat::<1>::new(), limits).unwrap_err();
    let KernelFault::Moment { alpha, found, required, .. } = fault else { panic!("{fault}") };
    assert_eq!((alpha, required), (MultiIndex::new([2]), 2.0));
    assert!((found - 8.0 / 3.0).abs() < 1e-4, "{found}");
}
