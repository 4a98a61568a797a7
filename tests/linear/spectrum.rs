//! Estimates of spectra against dense eigenvalues, known spectra and legal maps of every size.

use crate::cases::cases;
use crate::dense;
use crate::properties::properties;
use parops::{
    Allowance, Along, Apply, CellList, CsrMatrix, DcPse, Domain, ErrorKind, Laplacian, LinearError, Nearest,
    ParticleError, Particles, Pse, Result, Rows, Sign, Spectrum, SpectrumEstimator, testing::Promise,
};
use proptest::prelude::*;

const SIDE: usize = 16;

/// The tolerance of the estimator is 1e-9 of the radius; eigenvalues of operators that are not normal are worse
/// conditioned than their residuals.
const CONVERGED: f64 = 1e-8;

fn torus() -> Domain<2> {
    Domain::periodic([0.0; 2], [1.0; 2]).unwrap()
}

fn sets() -> [(&'static str, Particles<2>); 3] {
    let (lower, upper) = ([0.0; 2], [1.0; 2]);
    [
        ("lattice", Particles::lattice(lower, upper, [SIDE; 2]).unwrap()),
        ("jitter", Particles::jittered(lower, upper, [SIDE; 2], 0.3, 1).unwrap()),
        ("random", Particles::random(lower, upper, SIDE * SIDE, 1).unwrap()),
    ]
}

fn advection(set: &Particles<2>, sign: Sign, k: usize) -> Result<Rows> {
    DcPse::<_, 2>::of(Along([-0.8, 0.6])).sign(sign).assemble(&Nearest::build(set, &torus(), k)?)
}

fn diffusion(set: &Particles<2>) -> Result<Rows> {
    let dcpse = DcPse::<Laplacian<2>, 2>::new();
    dcpse.assemble(&Nearest::build(set, &torus(), dcpse.fewest_neighbors::<2>()?)?)
}

fn pse(set: &Particles<2>) -> Result<Rows> {
    let pse = Pse::new(Laplacian::<2>, 2, set.spacing()?.epsilon(1.5)?, set.volumes()?)?.allow(Allowance::Everywhere);
    let pse = pse.support(3.0)?;
    pse.assemble(&CellList::build(set, &torus(), pse.cutoff())?)
}

/// By products alone.
fn estimate(rows: &Rows) -> Spectrum {
    SpectrumEstimator::new().dense(0).of(rows).unwrap()
}

#[test]
fn estimates_agree_with_dense_eigenvalues_on_lattice_jittered_and_random_sets() {
    for (name, set) in sets() {
        let operators = [
            ("pse", pse(&set)),
            ("laplacian", diffusion(&set)),
            ("advection", advection(&set, Sign::Minus, if name == "lattice" { 20 } else { 14 })),
        ];
        for (operator, rows) in operators {
            let rows = rows.unwrap();
            let (right, outer) = dense::extremes(&dense::matrix(rows.targets(), |u, du| rows.apply(u, du)));
            let found = estimate(&rows);
            assert!(found.converged && found.residual <= 1e-9 * found.radius, "{name} {operator} {found:?}");
            let against = |text| Promise::new("Limits of steps", text).case(format!("{name} {operator}"));
            against("estimated growth against all eigenvalues, of the radius")
                .at_most(CONVERGED, (found.abscissa - right).abs() / outer);
            // The radius is found to a residual of 1e-3.
            against("estimated spectral radius over that of all eigenvalues, less 1").within(
                -1e-3,
                1e-3,
                found.radius / outer - 1.0,
            );
            assert!(found.applies <= 3000 && !found.exact, "{name} {operator} {found:?}");

            let all = SpectrumEstimator::new().of(&rows).unwrap();
            assert!(all.exact && all.converged && all.applies == rows.targets(), "{name} {operator} {all:?}");
            // Rounding of two QR iterations on matrices that are not normal.
            let same = |a: f64, b: f64| (a - b).abs() <= 1e-11 * outer;
            assert!(same(all.abscissa, right) && same(all.radius, outer), "{name} {operator} {right} {outer} {all:?}");
        }
    }
}

#[test]
fn slow_growth_amid_the_imaginary_axis_is_found_to_half_a_percent_of_the_radius() {
    for seed in 1..=2 {
        let set = Particles::jittered([0.0; 2], [1.0; 2], [SIDE; 2], 0.3, seed).unwrap();
        let rows = advection(&set, Sign::Plus, 26).unwrap();
        let (right, outer) = dense::extremes(&dense::matrix(rows.targets(), |u, du| rows.apply(u, du)));
        let found = estimate(&rows);
        Promise::new("Limits of steps", "slow growth estimated amid the imaginary axis against all eigenvalues")
            .in_units("of the radius", outer)
            .at_most(0.005, (found.abscissa - right).abs());
        assert!(right > 0.0 && found.abscissa > 1e-8 * found.radius, "{found:?}");
    }
}

#[test]
fn diffusion_grows_on_random_sets_and_on_no_jittered_one() {
    for seed in 1..=3 {
        let jittered = Particles::jittered([0.0; 2], [1.0; 2], [SIDE; 2], 0.3, seed).unwrap();
        let random = Particles::random([0.0; 2], [1.0; 2], SIDE * SIDE, seed).unwrap();
        let quiet = estimate(&diffusion(&jittered).unwrap());
        let growing = estimate(&diffusion(&random).unwrap());
        assert!(quiet.converged && quiet.relative_growth().abs() <= 1e-11, "{quiet:?}");
        assert!(growing.converged && growing.relative_growth() > 1e-8, "{growing:?}");
    }
}

#[test]
fn closure_over_the_inner_particles_gives_the_dirichlet_spectrum() {
    // u'' on 40 inner nodes of a line with zero ends: -4/h^2 sin^2(pi k h/2).
    let n = 40;
    let h = 1.0 / (n + 1) as f64;
    let found = SpectrumEstimator::new()
        .dense(0)
        .estimate(n, |u, du| {
            for p in 0..n {
                let left = if p > 0 { u[p - 1] } else { 0.0 };
                let right = if p + 1 < n { u[p + 1] } else { 0.0 };
                du[p] = (left - 2.0 * u[p] + right) / (h * h);
            }
            Ok(())
        })
        .unwrap();
    let value = |k: f64| -4.0 / (h * h) * (std::f64::consts::PI * k * h / 2.0).sin().powi(2);
    assert!((found.abscissa - value(1.0)).abs() <= CONVERGED * found.radius, "{found:?}");
    assert!((found.radius / -value(n as f64) - 1.0).abs() <= 1e-3, "{found:?}");
    assert_eq!(found.frequency, 0.0);
}

#[test]
fn rectangular_rows_are_refused_by_their_numbers() {
    let wide = CsrMatrix::from_triplets(2, 3, [(0, 2, 1.0)]).unwrap();
    let refused = SpectrumEstimator::new().of(&wide).unwrap_err();
    assert_eq!(*refused.kind(), ErrorKind::Linear(LinearError::NotSquare { rows: 2, columns: 3 }));
}

#[test]
fn values_that_are_not_finite_are_named_and_settings_are_checked() {
    for estimator in [SpectrumEstimator::new(), SpectrumEstimator::new().dense(0)] {
        let refused = estimator.estimate(5, |_, du| {
            du[3] = f64::INFINITY;
            Ok(())
        });
        let refused = refused.unwrap_err();
        assert_eq!(refused.particle(), Some(3));
        assert_eq!(*refused.kind(), ErrorKind::Linear(LinearError::Value { value: f64::INFINITY }));
    }
    for tolerance in [0.0, f64::NAN, 0.2] {
        assert!(SpectrumEstimator::new().tolerance(tolerance).is_err(), "{tolerance}");
    }
}

#[test]
fn maps_of_no_entry_or_no_size_have_a_spectrum_of_zero() {
    for n in [0, 1, 2, 7, 60] {
        for estimator in [SpectrumEstimator::new(), SpectrumEstimator::new().dense(0)] {
            let found = estimator.estimate(n, |_, _| Ok(())).unwrap();
            assert!(found.converged, "{n} {found:?}");
            assert_eq!((found.abscissa, found.radius, found.relative_growth()), (0.0, 0.0, 0.0), "{n}");
        }
    }
}

#[test]
fn matrix_that_does_not_fit_is_refused() {
    let all = SpectrumEstimator::new().dense(usize::MAX).most(usize::MAX);
    let error = all.estimate(3_000_000, |_, _| Ok(())).unwrap_err();
    assert!(matches!(error.kind(), ErrorKind::Particle(ParticleError::Memory { .. })), "{error}");
}

#[test]
fn error_of_an_eigenvalue_is_that_of_its_eigenvector_too() -> Result<()> {
    // One eigenvalue -1 of two with one eigenvector, and others further left: found to the root of the residual.
    let n = 200;
    let diagonal = (0..n).map(|i: usize| (i, i, -1.0 - 0.02 * i.saturating_sub(1) as f64));
    let entries = diagonal.chain([(0, 1, 0.5)]).map(|(i, j, a)| (j, i, a)).collect::<Vec<_>>();
    let matrix = CsrMatrix::from_triplets(n, n, entries)?;
    let found = SpectrumEstimator::new().dense(0).of(&matrix)?;
    let off = (found.abscissa + 1.0).hypot(found.frequency);
    assert!(found.converged && off <= found.error && found.error >= 1e3 * found.residual, "{off} {found:?}");
    assert!(found.error <= 1e-3 * found.radius, "{found:?}");
    // Without that entry an eigenvalue is as good as its residual.
    let matrix = CsrMatrix::from_triplets(n, n, (0..n).map(|i| (i, i, -1.0 - 0.02 * i as f64)))?;
    let found = SpectrumEstimator::new().dense(0).of(&matrix)?;
    assert!((found.abscissa + 1.0).abs() <= found.error.max(1e-12) && found.error <= 1e-7, "{found:?}");
    Ok(())
}

#[test]
fn chain_torn_by_rounding_is_within_its_error() -> Result<()> {
    // A chain of 0 of length k, seen through a reflection that rounds it, beside eigenvalues from -1 on.
    let n = 120;
    let v: Vec<f64> = (0..n).map(|i| ((i * i) as f64).sin()).collect();
    let square: f64 = v.iter().map(|v| v * v).sum();
    let reflect = |u: &mut [f64]| {
        let along: f64 = 2.0 * v.iter().zip(u.iter()).map(|(v, u)| v * u).sum::<f64>() / square;
        u.iter_mut().zip(&v).for_each(|(u, v)| *u -= along * v);
    };
    for chain in 2..=6 {
        let map = |u: &[f64], du: &mut [f64]| {
            let mut w = u.to_vec();
            reflect(&mut w);
            (0..n).for_each(|i| {
                du[i] = match i {
                    _ if i + 1 < chain => w[i + 1],
                    _ if i < chain => 0.0,
                    _ => w[i] * (-1.0 - (i - chain) as f64 / n as f64),
                }
            });
            reflect(du);
            Ok(())
        };
        for (estimator, change) in [(SpectrumEstimator::new(), f64::EPSILON), (SpectrumEstimator::new().dense(0), 1e-9)]
        {
            let found = estimator.estimate(n, map)?;
            let torn = change.powf(1.0 / chain as f64);
            assert!(
                found.abscissa <= found.error.max(1e-12) && found.abscissa <= torn && found.error <= 100.0 * torn,
                "{chain}: {found:?}"
            );
        }
    }
    Ok(())
}

#[test]
fn rounding_of_all_eigenvalues_is_within_the_error() -> Result<()> {
    // Circulants: every eigenvalue has the condition 1, and none lies right of 0.
    let (left, right) = (|n: usize, p: usize| (p + n - 1) % n, |n: usize, p: usize| (p + 1) % n);
    for n in [100, 300, 640] {
        let upwind = |p: usize| vec![(p, p, -1.0), (p, left(n, p), 1.0)];
        let central = |p: usize| vec![(p, left(n, p), 0.5), (p, right(n, p), -0.5)];
        let second = |p: usize| vec![(p, left(n, p), 1.0), (p, p, -2.0), (p, right(n, p), 1.0)];
        for row in [&upwind as &dyn Fn(usize) -> Vec<(usize, usize, f64)>, &central, &second] {
            let found = SpectrumEstimator::new().of(&CsrMatrix::from_triplets(n, n, (0..n).flat_map(row))?)?;
            assert!(found.exact && found.abscissa <= found.error, "{n}: {found:?}");
            assert!(found.error < 1e-10 * found.radius, "{n}: {found:?}");
        }
    }
    Ok(())
}

#[test]
fn maps_of_subnormal_numbers_are_found_too() -> Result<()> {
    for scale in [1e-309, 1e-312, 1e-318] {
        for n in [1, 5, 40] {
            let low = (1..n).map(|i| (i, i - 1, 0.1 * scale));
            let entries = (0..n).map(|i| (i, i, -scale * (i + 1) as f64 / n as f64)).chain(low);
            let matrix = CsrMatrix::from_triplets(n, n, entries)?;
            for estimator in [SpectrumEstimator::new(), SpectrumEstimator::new().dense(0)] {
                let found = estimator.of(&matrix)?;
                assert!((found.radius / scale - 1.0).abs() < 0.01 && found.abscissa < 0.0, "{scale:e} {n} {found:?}");
            }
        }
    }
    Ok(())
}

#[test]
fn slow_growth_that_stands_apart_is_no_rounding() -> Result<()> {
    for (n, growth) in [(120, 1e-3), (120, 0.05), (700, 1e-3), (700, 1e-6)] {
        let lambda = |i: usize| if i == 0 { growth } else { -(i as f64) / n as f64 };
        // Below the diagonal as much as on it: eigenvectors are not orthogonal.
        let below = (1..n).map(|i| (i, i - 1, 0.3 / n as f64));
        let matrix = CsrMatrix::from_triplets(n, n, (0..n).map(|i| (i, i, lambda(i))).chain(below))?;
        let found = SpectrumEstimator::new().of(&matrix)?;
        assert!((found.abscissa - growth).abs() <= found.error.max(1e-12), "{n}: {found:?}");
        assert!(found.converged && found.error <= 0.1 * growth, "{n}: {found:?}");
    }
    Ok(())
}

#[test]
fn estimates_are_repeated_bit_for_bit_and_scale_with_the_operator() {
    let set = Particles::jittered([0.0; 2], [1.0; 2], [SIDE; 2], 0.3, 5).unwrap();
    let rows = advection(&set, Sign::Minus, 14).unwrap();
    for estimator in [SpectrumEstimator::new(), SpectrumEstimator::new().dense(0)] {
        let found = estimator.of(&rows).unwrap();
        assert_eq!(found, estimator.of(&rows).unwrap());
        for scale in [300, 650, 900, -300, -650, -900].map(|power| 2.0_f64.powi(power)) {
            let scaled = estimator.estimate(rows.targets(), |u, du| {
                rows.apply(u, du)?;
                du.iter_mut().for_each(|du| *du *= scale);
                Ok(())
            });
            let scaled = scaled.unwrap();
            assert!((scaled.abscissa / scale - found.abscissa).abs() <= CONVERGED * found.radius, "{scaled:?}");
        }
    }
}

proptest! {
    #![proptest_config(properties(cases().div_ceil(4)))]

    #[test]
    fn known_spectra_are_found(
        turning in prop::collection::vec((-1.0_f64..1.0, 0.1_f64..2.0), 0..4),
        real in prop::collection::vec(-2.0_f64..1.0, 1..6),
        mixing in prop::collection::vec(-0.3_f64..0.3, 400),
    ) {
        // Blocks [[a, b], [-b, a]] and numbers on the diagonal, turned by a product of plane rotations.
        let n = 2 * turning.len() + real.len();
        let mut entries = vec![vec![0.0; n]; n];
        for (i, &(a, b)) in turning.iter().enumerate() {
            (entries[2 * i][2 * i], entries[2 * i + 1][2 * i + 1]) = (a, a);
            (entries[2 * i][2 * i + 1], entries[2 * i + 1][2 * i]) = (b, -b);
        }
        for (i, &a) in real.iter().enumerate() {
            entries[2 * turning.len() + i][2 * turning.len() + i] = a;
        }
        let mut a = nalgebra::DMatrix::from_fn(n, n, |i, j| entries[i][j]);
        let planes = (0..n).flat_map(|i| (0..i).map(move |j| (i, j)));
        for ((i, j), angle) in planes.zip(&mixing) {
            let mut turn = nalgebra::DMatrix::<f64>::identity(n, n);
            (turn[(i, i)], turn[(j, j)]) = (angle.cos(), angle.cos());
            (turn[(i, j)], turn[(j, i)]) = (angle.sin(), -angle.sin());
            a = &turn * a * turn.transpose();
        }
        let product = |u: &[f64], du: &mut [f64]| {
            du.copy_from_slice((&a * nalgebra::DVector::from_column_slice(u)).as_slice());
            Ok(())
        };
        let found = SpectrumEstimator::new().dense(0).estimate(n, product).unwrap();
        let all = SpectrumEstimator::new().estimate(n, product).unwrap();
        let right = turning.iter().map(|t| t.0).chain(real.iter().copied()).fold(f64::NEG_INFINITY, f64::max);
        let outer = turning.iter().map(|t| t.0.hypot(t.1)).chain(real.iter().map(|x| x.abs())).fold(0.0, f64::max);
        // A normal matrix; eigenvalues that nearly coincide are told apart only down to the breakdown of the subspace.
        let known = |text, size| Promise::new("Limits of steps", text).in_units("of the radius", size);
        known("growth of matrices of known spectra", outer.max(1.0)).at_most(1e-7, (found.abscissa - right).abs());
        known("spectral radius of matrices of known spectra", outer).at_most(1e-3, (found.radius - outer).abs());
        // Rounding of a normal matrix of norm 10 at most.
        let size = outer.max(1.0);
        prop_assert!((all.abscissa - right).abs() <= 1e-12 * size && (all.radius - outer).abs() <= 1e-12 * size, "{all:?}");
    }
}
