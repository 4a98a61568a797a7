//! Super time stepping: where it is stable, what it chooses for a step, how accurate it is; and sharp limits of all
//! explicit schemes on particle sets.

use std::f64::consts::PI;

use crate::cases::cases;
use crate::dense;
use crate::properties::properties;
use nalgebra::{Complex, DMatrix, SymmetricEigen};
use parops::{
    Allowance, Apply, CellList, DcPse, Domain, Epsilon, Error, ErrorKind, Euler, Exponential, Laplacian,
    LatticeSpectrum, Nearest, Particles, Plan, Pse, Rk4, Rkl2, RowSymmetry, Rows, SspRk3, StepLimit, Stepper,
    TimeError, integrate, testing::Promise,
};
use proptest::prelude::*;

fn time(error: Error) -> TimeError {
    match error.kind() {
        ErrorKind::Time(kind) => *kind,
        other => panic!("{other:?} is no refusal of the time layer"),
    }
}

type Field = Vec<f64>;

fn rkl2(stages: u32) -> Rkl2<Field> {
    Rkl2::new(stages).unwrap()
}

/// (s^2 + s - 2)/2.
fn interval(stages: u32) -> f64 {
    f64::from(stages * stages + stages - 2) / 2.0
}

/// What one step multiplies modes z = lambda dt by.
fn factors(stepper: &mut Rkl2<Field>, modes: &[Complex<f64>]) -> Vec<Complex<f64>> {
    let mut u: Field = modes.iter().flat_map(|_| [1.0, 0.0]).collect();
    let rhs = &mut |_: f64, u: &Field, du: &mut Field| {
        for ((z, u), du) in modes.iter().zip(u.chunks(2)).zip(du.chunks_mut(2)) {
            let rate = z * Complex::new(u[0], u[1]);
            du.copy_from_slice(&[rate.re, rate.im]);
        }
        Ok(())
    };
    stepper.step(0.0, 1.0, &mut u, rhs).unwrap();
    u.chunks(2).map(|u| Complex::new(u[0], u[1])).collect()
}

fn sloped(stages: u32, slope: f64) -> Rkl2<Field> {
    rkl2(stages).with_slope(slope).unwrap()
}

fn reach(stepper: &Rkl2<Field>) -> f64 {
    stepper.negative_real_interval()
}

/// The largest factor on the line from 0 to `end`, at points that are dense where the polynomial turns fastest.
fn largest_to(stages: u32, end: Complex<f64>) -> f64 {
    let points = 200 * stages;
    let part = |i: u32| (1.0 - (PI * f64::from(i) / f64::from(points)).cos()) / 2.0;
    let modes: Vec<_> = (1..=points).map(|i| end * part(i)).collect();
    largest(&mut rkl2(stages), &modes)
}

fn largest(stepper: &mut Rkl2<Field>, modes: &[Complex<f64>]) -> f64 {
    factors(stepper, modes).iter().map(|factor| factor.norm()).fold(0.0, f64::max)
}

#[test]
fn factor_of_super_time_stepping_is_the_shifted_legendre_polynomial() {
    // Rounding of the recurrence and of the step, measured at 76 eps for 1000 stages, times the factors of up to 3.
    const TOLERANCE: f64 = 300.0 * f64::EPSILON;
    for stages in [2_u32, 3, 4, 7, 16, 41, 200, 1000] {
        let modes: Vec<_> = (0..50).map(|i| Complex::new(-interval(stages) * f64::from(i) / 50.0, 0.0)).collect();
        let s = f64::from(stages);
        let b = (s * s + s - 2.0) / (2.0 * s * (s + 1.0));
        for (z, factor) in modes.iter().zip(factors(&mut rkl2(stages), &modes)) {
            let x = 1.0 + 4.0 * z.re / (s * s + s - 2.0);
            let (mut before, mut last) = (1.0, x);
            for j in 2..=stages {
                let j = f64::from(j);
                (before, last) = (last, ((2.0 * j - 1.0) * x * last - (j - 1.0) * before) / j);
            }
            let expected = 1.0 - b + b * last;
            assert!((factor.re - expected).abs() < TOLERANCE && factor.im == 0.0, "{stages} {z}: {factor} {expected}");
        }
    }
}

#[test]
fn real_interval_ends_where_stated_for_even_and_odd_stages() {
    for stages in 2..=60 {
        let mut stepper = rkl2(stages);
        let end = stepper.negative_real_interval();
        let beyond = end / interval(stages);
        assert!(if stages % 2 == 0 { beyond == 1.0 } else { beyond > 1.0 && beyond < 1.17 }, "{stages} {beyond}");
        let at = |part: f64| Complex::new(-part * end, 0.0);
        let inside: Vec<_> = (0..=1000).map(|i| at(f64::from(i) / 1000.0)).collect();
        let rounding = 1.0 + 300.0 * f64::EPSILON * f64::from(stages);
        assert!(factors(&mut stepper, &inside).iter().all(|factor| factor.norm() <= rounding), "{stages}");
        assert!(factors(&mut stepper, &[at(1.001)])[0].norm() > 1.0 + 1e-4, "{stages}");
    }
}

#[test]
fn wedges_of_a_slope_are_stable_to_the_interval_stated_and_little_beyond() {
    // Rounding of the recurrence, 300 eps.
    const ONE: f64 = 1.0 + 1e-13;
    for slope in [0.02, 0.05, 0.1, 0.2, 0.4, 0.5] {
        let most = (3.2 / slope) as u32;
        let mut last = 0.0;
        for stages in (2..=most.min(20)).chain([most]) {
            let end = reach(&sloped(stages, slope));
            assert!(end >= last && end <= interval(stages), "{stages} {slope}: {end} after {last}");
            last = end;
            for part in [0.25, 0.5, 0.75, 1.0] {
                let factor = largest_to(stages, Complex::new(-1.0, part * slope) * end);
                assert!(factor <= ONE, "{stages} stages, {part} of {slope}: {factor}");
            }
            let across: Vec<_> = (0..=200).map(|i| Complex::new(-1.0, slope * f64::from(i) / 200.0) * end).collect();
            assert!(largest(&mut rkl2(stages), &across) <= ONE, "{stages} {slope}");
            // 2 % more of slope, and a part of the distance between two extrema farther.
            let beyond = Complex::new(-1.0, 1.02 * slope) * (end * (1.0 + 0.6 / f64::from(stages)));
            assert!(largest_to(stages, beyond) > 1.0, "{stages} {slope}: {end}");
        }
    }
    // As documented.
    for (slope, stages, stated) in [(0.05, 64, 1023.0), (0.1, 32, 209.0), (0.2, 16, 60.0), (0.4, 8, 13.4)] {
        let found = reach(&sloped(stages, slope));
        assert!((stated..1.01 * stated).contains(&found), "{slope}: {found}");
    }
}

#[test]
fn super_time_stepping_is_chosen_by_the_rate_and_refused_for_rows_that_do_not_suit() {
    let limit = |rate| StepLimit::from_spectral_bound(rate, 1.0).unwrap();
    let chosen = |rate, dt, symmetry| {
        let stepper = Rkl2::<Field>::for_decay(&limit(rate), dt, symmetry).unwrap();
        (stepper.stages(), stepper.substeps(), stepper.evaluations())
    };
    // A diffusion number of 10^6 with lambda_max = 4: 2 10^6 explicit Euler steps.
    assert_eq!(chosen(4e6, 1.0, RowSymmetry::Symmetric), (2828, 1, 2828));
    let reach = reach(&sloped(16, 0.2));
    let substeps = (4e6 / reach).ceil();
    assert_eq!(chosen(4e6, 1.0, RowSymmetry::General), (16, substeps as u32, 16 * substeps as u64));
    assert_eq!(chosen(60.0, 1.0, RowSymmetry::General), (16, 1, 16));
    assert_eq!(chosen(61.0, 1.0, RowSymmetry::General).1, 2);
    assert_eq!(chosen(0.0, 1.0, RowSymmetry::General), (2, 1, 2));
    let mild = Rkl2::<Field>::for_slope(&limit(1000.0), 1.0, 0.05).unwrap();
    assert_eq!((mild.stages(), mild.substeps(), mild.slope()), (63, 1, 0.05));

    assert_eq!(rkl2(2000).check_rows(RowSymmetry::Symmetric), Ok(()));
    for slope in [0.02, 0.2, 0.5] {
        assert_eq!(sloped(40, slope).check_rows(RowSymmetry::General), Ok(()));
    }
    let no_slope = |slope| TimeError::Slope { slope, low: 0.02, high: 0.5 };
    assert_eq!(time(rkl2(2).check_rows(RowSymmetry::General).unwrap_err()), no_slope(0.0));
    for slope in [-1.0, 0.0, 0.019, 0.51, f64::INFINITY] {
        assert_eq!(time(rkl2(4).with_slope(slope).unwrap_err()), no_slope(slope));
        assert_eq!(time(Rkl2::<Field>::for_slope(&limit(1.0), 1.0, slope).unwrap_err()), no_slope(slope));
    }
    assert!(matches!(time(rkl2(4).with_slope(f64::NAN).unwrap_err()), TimeError::Slope { .. }));
    for stages in [0, 1, 65_537, u32::MAX] {
        let refused = time(Rkl2::<Field>::new(stages).unwrap_err());
        assert_eq!(refused, TimeError::Stages { stages, low: 2, high: 65_536 });
    }
    let refused = |rate, dt, symmetry| time(Rkl2::<Field>::for_decay(&limit(rate), dt, symmetry).unwrap_err());
    assert_eq!(refused(1.0, -1.0, RowSymmetry::Symmetric), TimeError::Step { dt: -1.0 });
    assert!(matches!(refused(1.0, f64::NAN, RowSymmetry::Symmetric), TimeError::Step { .. }));
    let reach = 4_294_967_295.0 * reach;
    assert_eq!(refused(1.0, 1e13, RowSymmetry::General), TimeError::Limit { dt: 1e13, limit: reach });
    let with_step = limit(1.0).and(StepLimit::from_step(0.5).unwrap());
    let refused = time(Rkl2::<Field>::for_decay(&with_step, 1.0, RowSymmetry::Symmetric).unwrap_err());
    assert_eq!(refused, TimeError::Limit { dt: 1.0, limit: 0.5 });
}

proptest! {
    #![proptest_config(properties(cases()))]

    #[test]
    fn stages_and_substeps_chosen_keep_the_limit_and_are_the_fewest(exponent in -3.0..9.0_f64, dt in 1e-3..1e3_f64) {
        let rate = 10.0_f64.powf(exponent) / dt;
        let limit = StepLimit::from_spectral_bound(rate, 1.0).unwrap();
        for (symmetry, most) in [(RowSymmetry::Symmetric, 65_536_u32), (RowSymmetry::General, 16)] {
            let interval = |s: u32| match symmetry {
                RowSymmetry::Symmetric => (f64::from(s) * f64::from(s + 1) - 2.0) / 2.0,
                RowSymmetry::General => reach(&sloped(s, symmetry.slope())),
            };
            let stepper = Rkl2::<Field>::for_decay(&limit, dt, symmetry).unwrap();
            prop_assert!(limit.check(dt, &stepper).is_ok() && stepper.check_rows(symmetry).is_ok());
            let (s, n) = (stepper.stages(), f64::from(stepper.substeps()));
            let reach = |s: u32, n: f64| n * interval(s) / rate;
            prop_assert!(s == 2 || reach(s - 1, n) < dt);
            prop_assert!(n == 1.0 || reach(most, n - 1.0) < dt);
        }
    }
}

/// Rows of an order-r PSE Laplacian on a torus, from a lattice or a jittered one.
fn laplacian<const D: usize>(counts: [usize; D], order: u32, overlap: f64, jitter: f64) -> Rows {
    let particles = Particles::jittered([0.0; D], [1.0; D], counts, jitter, 5).unwrap();
    let epsilon = Epsilon::global(overlap / counts[0] as f64).unwrap();
    let pse = Pse::new(Laplacian::<D>, order, epsilon, particles.volumes().unwrap()).unwrap();
    let pse = if D == 1 { pse } else { pse.support(4.5).unwrap() }.allow(Allowance::Everywhere);
    let domain = Domain::periodic([0.0; D], [1.0; D]).unwrap();
    pse.assemble(&CellList::build(&particles, &domain, pse.cutoff()).unwrap()).unwrap()
}

/// The spectral radius of the matrix that one step of `stepper` multiplies a state by.
fn radius(rows: &Rows, stepper: &mut dyn Stepper<Field>, dt: f64) -> f64 {
    let n = rows.targets();
    let mut matrix = DMatrix::zeros(n, n);
    let mut unit = vec![0.0; n];
    for (q, mut column) in matrix.column_iter_mut().enumerate() {
        unit.fill(0.0);
        unit[q] = 1.0;
        stepper.step(0.0, dt, &mut unit, &mut |_, u: &Field, du: &mut Field| rows.apply(u, du)).unwrap();
        column.copy_from_slice(&unit);
    }
    // A polynomial of a symmetric matrix is symmetric, but for rounding.
    let symmetric = (&matrix + matrix.transpose()) / 2.0;
    assert!((&matrix - &symmetric).amax() < 1e-12 * matrix.amax());
    SymmetricEigen::new(symmetric).eigenvalues.amax()
}

fn explicit() -> Vec<Box<dyn Stepper<Field>>> {
    let mut steppers: Vec<Box<dyn Stepper<Field>>> =
        vec![Box::new(Euler::new()), Box::new(Rk4::new()), Box::new(SspRk3::new())];
    for stages in [2, 4, 5, 10] {
        steppers.push(Box::new(rkl2(stages)));
    }
    steppers.push(Box::new(rkl2(4).with_substeps(3)));
    steppers
}

/// Asserts that steps of 0.99 and 1.01 of the limit of every explicit scheme are stable and not.
fn sharp(rows: &Rows, rate: f64) {
    let limit = StepLimit::from_spectral_bound(rate, 1.0).unwrap();
    for mut stepper in explicit() {
        let largest = limit.step(&*stepper);
        let (inside, outside) =
            (radius(rows, &mut *stepper, 0.99 * largest), radius(rows, &mut *stepper, 1.01 * largest));
        let radius = |text| Promise::new("Limits of steps", text);
        radius("spectral radius of explicit schemes at 0.99 of their limit, less 1").at_most(1e-12, inside - 1.0);
        let beyond = radius("spectral radius of explicit schemes at 1.01 of their limit, less 1");
        beyond.at_least(1e-6, outside - 1.0);
    }
}

#[test]
fn limits_of_explicit_schemes_are_sharp_on_lattices_with_the_rate_of_the_kernel() {
    for order in [2, 4, 6, 8] {
        let overlap = if order == 8 { 2.0 } else { 1.5 };
        let rows = laplacian([64], order, overlap, 0.0);
        let kernel = parops::Exchange::new(&[parops::Term { index: parops::MultiIndex::new([2]), factor: 1.0 }], order);
        let spectrum = LatticeSpectrum::scan(&kernel.unwrap(), 1.0 / overlap, 6.0).unwrap();
        sharp(&rows, spectrum.lambda_max * (64.0 / overlap) * (64.0 / overlap));
    }
}

#[test]
fn limits_of_explicit_schemes_are_sharp_on_scattered_sets_with_their_eigenvalues() {
    let rate = |rows: &Rows| Exponential::new(rows.targets(), |u, du| rows.apply(u, du)).unwrap().spectral_radius();
    for order in [2, 4, 6, 8] {
        let rows = laplacian([70], order, 2.0, 0.1);
        sharp(&rows, rate(&rows).unwrap());
    }
    let rows = laplacian([15, 15], 4, 1.6, 0.1);
    sharp(&rows, rate(&rows).unwrap());
}

/// All eigenvalues of a DC-PSE Laplacian with the neighbors it asks for, on a torus, and the bound of its rows.
fn dcpse_spectrum(order: u32, side: usize, jitter: f64, seed: u64) -> (Vec<Complex<f64>>, f64) {
    let particles = Particles::jittered([0.0; 2], [1.0; 2], [side; 2], jitter, seed).unwrap();
    let dcpse = DcPse::at_order(Laplacian::<2>, order).unwrap();
    let domain = Domain::periodic([0.0; 2], [1.0; 2]).unwrap();
    let near = Nearest::build(&particles, &domain, dcpse.fewest_neighbors().unwrap()).unwrap();
    let rows = dcpse.assemble(&near).unwrap();
    (dense::eigenvalues(&dense::matrix(side * side, |u, du| rows.apply(u, du))), rows.report().spectral_bound)
}

#[test]
fn super_time_stepping_amplifies_no_mode_of_dcpse_laplacians_on_a_hundred_sets_a_jitter() {
    // Below lies the eigenvalue of constants alone, zero but for rounding of up to 1e-12.
    const ZERO: f64 = 1e-3;
    let section = |text| Promise::new("Limits of steps", text);
    let mut undone = 0.0_f64;
    for (order, side, jitter) in [(2, 9, 0.3), (2, 9, 0.45), (2, 12, 0.45), (4, 9, 0.45)] {
        for seed in 0..100 {
            let case = format!("order {order}, side {side}, jitter {jitter}, seed {seed}");
            let (mut eigenvalues, bound) = dcpse_spectrum(order, side, jitter, seed);
            let outer = eigenvalues.iter().map(|z| z.norm()).fold(0.0, f64::max);
            eigenvalues.retain(|z| z.norm() > ZERO * outer);
            assert!(eigenvalues.len() == side * side - 1 && eigenvalues.iter().all(|z| z.re < 0.0), "{case}");
            let slope = eigenvalues.iter().map(|z| z.im.abs() / -z.re).fold(0.0, f64::max);
            let general = section("slope beside the real axis of eigenvalues of DC-PSE Laplacians, jitter to 0.45 h");
            general.case(&case).at_most(RowSymmetry::General.slope(), slope);
            for number in [30.0, 60.0, 800.0] {
                // By the bound of the rows, and by the radius itself.
                for rate in [bound, outer] {
                    let (limit, dt) = (StepLimit::from_spectral_bound(rate, 1.0).unwrap(), number / rate);
                    let mut stepper = Rkl2::for_decay(&limit, dt, RowSymmetry::General).unwrap();
                    let modes: Vec<_> = eigenvalues.iter().map(|z| z * dt).collect();
                    let factor = section("factor of super time stepping on spectra of DC-PSE, less 1").case(&case);
                    factor.at_most(1e-10, largest(&mut stepper, &modes) - 1.0);
                }
            }
            let modes: Vec<_> = eigenvalues.iter().map(|z| z * (819.0 / bound)).collect();
            undone = undone.max(largest(&mut rkl2(40), &modes));
        }
    }
    // Without a slope, 40 stages to the end of their interval: measured 1.22.
    assert!(undone > 1.2, "{undone}");
}

#[test]
fn super_steps_of_two_to_four_hundred_stages_converge_with_order_two() {
    // Against the exact propagator.
    let rows = laplacian([15, 15], 2, 1.6, 0.1);
    let exact = Exponential::new(225, |u, du| rows.apply(u, du)).unwrap();
    let start: Field = (0..225).map(|p| (0.7 * f64::from(p)).sin()).collect();
    let mut end = start.clone();
    exact.propagate(0.02, &mut end).unwrap();
    for stages in [2_u32, 3, 4, 9, 20, 100, 400] {
        let fewest = 0.02 * exact.spectral_radius().unwrap() / interval(stages);
        let steps = (32.0 * fewest.ceil()).max(64.0);
        let error = |steps: f64| {
            let mut u = start.clone();
            let plan = Plan::new(0.0, 0.02, 0.02 / steps).unwrap();
            integrate(&mut rkl2(stages), &mut u, &plan, rows.rhs(), |_, _, _| {}).unwrap();
            u.iter().zip(&end).map(|(u, end)| (u - end).powi(2)).sum::<f64>().sqrt()
        };
        let observed = (error(steps) / error(2.0 * steps)).log2();
        Promise::new("Orders", "super time stepping of 2 to 400 stages").within(1.9, 2.1, observed);
    }
}

#[test]
fn stages_see_the_time_at_which_they_are_accurate() {
    // u' = g(t): what is left is the error of a quadrature, exact for g linear in t.
    for stages in [2, 3, 8, 33] {
        let mut u = vec![0.0];
        let mut times = Vec::new();
        let rhs = &mut |t: f64, _: &Field, du: &mut Field| {
            times.push(t);
            du[0] = 2.0 * t;
            Ok(())
        };
        rkl2(stages).step(1.0, 0.5, &mut u, rhs).unwrap();
        assert!((u[0] - 1.25).abs() < 20.0 * f64::EPSILON * f64::from(stages), "{stages}: {}", u[0]);
        assert!(times.is_sorted() && times[0] == 1.0 && times[times.len() - 1] < 1.5);
        let scale = f64::from(stages * stages + stages - 2);
        let expected = |j: u32| if j == 1 { 4.0 / (3.0 * scale) } else { f64::from(j * j + j - 2) / scale };
        for (j, t) in (1..stages).zip(&times[1..]) {
            assert!((t - 1.0 - 0.5 * expected(j)).abs() < 4.0 * f64::EPSILON);
        }
    }
}
