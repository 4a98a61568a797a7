//! Implicit steps: orders, stiff systems, algebraic rows, several fields, and what a failing step leaves.

use std::panic::{AssertUnwindSafe, catch_unwind};

use crate::cases::cases;
use crate::properties::properties;
use nalgebra::{Complex, DMatrix, DVector, SVector};
use parops::{
    Allowance, BiCgStab, BoundaryCondition, BoundaryRows, CellList, CsrMatrix, Cutoff, DcPse, Domain, Epsilon, Error,
    ErrorKind, Gmres, Implicit, Laplacian, LinearError, Particles, Pse, Random, Result, SparseSolver, TimeError,
    testing::Promise,
};
use proptest::prelude::*;

fn linear(error: &Error) -> LinearError {
    match error.kind() {
        ErrorKind::Linear(kind) => *kind,
        other => panic!("{other:?} is no refusal of the linear layer"),
    }
}

type Scheme<E> = fn(CsrMatrix) -> Result<Implicit<E>>;

fn schemes<E: parops::Entry>() -> [Scheme<E>; 2] {
    [Implicit::euler, Implicit::crank_nicolson]
}

type Prepare = fn(CsrMatrix) -> Result<SparseSolver>;

/// Every way to solve the system.
fn solvers() -> impl Iterator<Item = Prepare> {
    let all: &[Prepare] = &[
        |matrix| SparseSolver::bicgstab(matrix, BiCgStab::new()),
        |matrix| SparseSolver::gmres(matrix, Gmres::new()),
        #[cfg(feature = "faer")]
        SparseSolver::lu,
    ];
    all.iter().copied()
}

/// No source.
fn none<E>(_: f64, g: &mut [E]) -> Result<()>
where
    E: Default + Clone,
{
    g.fill(E::default());
    Ok(())
}

/// The PSE Laplacian of a jittered torus.
fn torus(m: usize) -> CsrMatrix {
    let particles = Particles::jittered([0.0; 2], [1.0; 2], [m; 2], 0.2, 7).unwrap();
    let epsilon = Epsilon::global(1.6 / m as f64).unwrap();
    let pse = Pse::new(Laplacian::<2>, 2, epsilon, particles.volumes().unwrap()).unwrap();
    let pse = pse.support(4.5).unwrap().allow(Allowance::Everywhere);
    let domain = Domain::periodic([0.0; 2], [1.0; 2]).unwrap();
    let rows = pse.assemble(&CellList::build(&particles, &domain, pse.cutoff()).unwrap()).unwrap();
    rows.to_csr(0).unwrap()
}

fn largest(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

fn noise(n: usize, seed: u64) -> Vec<f64> {
    let mut random = Random::new(seed);
    (0..n).map(|_| random.uniform() - 0.5).collect()
}

#[test]
fn implicit_schemes_have_their_order_on_a_stiff_system_with_a_source() {
    // u = w (1 + sin t) for a smooth w, with the source that makes it so; |lambda| dt reaches 100.
    const SLACK: f64 = 0.1;
    let a = torus(15);
    let w: Vec<f64> = (0..225).map(|p| (0.02 * f64::from(p)).cos()).collect();
    let mut aw = vec![0.0; 225];
    a.multiply(&w, &mut aw).unwrap();
    for scheme in schemes::<f64>() {
        let error = |n: u32| {
            let mut stepper = scheme(a.clone()).unwrap();
            let (dt, mut u) = (1.0 / f64::from(n), w.clone());
            for step in 0..n {
                let source = &mut |t: f64, g: &mut [f64]| {
                    g.iter_mut()
                        .zip(w.iter().zip(&aw))
                        .for_each(|(g, (w, aw))| *g = t.cos() * w - (1.0 + t.sin()) * aw);
                    Ok(())
                };
                let report = stepper.step(f64::from(step) * dt, dt, &mut u, source).unwrap();
                Promise::new("Residuals", "implicit steps, relative").at_most(1e-13, report.residual);
            }
            let exact: Vec<f64> = w.iter().map(|w| w * (1.0 + 1.0_f64.sin())).collect();
            largest(&u, &exact)
        };
        let observed = (error(32) / error(64)).log2();
        let stated = f64::from(scheme(a.clone()).unwrap().order());
        Promise::new("Orders", "implicit schemes on a stiff system, order less the stated one").within(
            -SLACK,
            SLACK,
            observed - stated,
        );
    }
}

#[test]
fn boundary_rows_of_the_moment_keep_the_order_in_time() {
    // u = x^2 (1 + sin t) on scattered points of a rod: u(0) = 0 + t as an offset, du/dx(1) given; exact in space for r = 2.
    const SLACK: f64 = 0.1;
    let mut points: Vec<_> = (0..=40).map(|i| [0.025 * f64::from(i)]).collect();
    points[1..40].iter_mut().zip(noise(39, 3)).for_each(|(x, noise)| x[0] += 0.01 * noise);
    let rod = Particles::new(points).unwrap();
    let neighbors = CellList::build(&rod, &Domain::open(), Cutoff(0.3)).unwrap();
    let ends = [BoundaryCondition::dirichlet(0), BoundaryCondition::neumann(40, [1.0])];
    let boundary = BoundaryRows::build(&ends, 2, &neighbors).unwrap();
    let mut a = DcPse::<Laplacian<1>, 2>::new().assemble(&neighbors).unwrap().to_csr(0).unwrap();
    boundary.replace_in(&mut a).unwrap();
    let x: Vec<f64> = rod.points().iter().map(|x| x[0]).collect();
    let exact = |t: f64| -> Vec<f64> { x.iter().map(|x| x * x * (1.0 + t.sin()) + t).collect() };
    let mut source = |t: f64, g: &mut [f64]| {
        g.iter_mut().zip(&x).for_each(|(g, x)| *g = x * x * t.cos() + 1.0 - 2.0 * (1.0 + t.sin()));
        (g[0], g[40]) = (t, 2.0 * (1.0 + t.sin()));
        Ok(())
    };
    for (scheme, prepare) in schemes::<f64>().into_iter().flat_map(|scheme| solvers().map(move |s| (scheme, s))) {
        let mut error = |n: u32| {
            let rows = boundary.particles().iter().copied();
            let mut stepper = scheme(a.clone()).unwrap().algebraic(rows).unwrap().solver(prepare);
            let (dt, mut u) = (1.0 / f64::from(n), exact(0.0));
            for step in 0..n {
                stepper.step(f64::from(step) * dt, dt, &mut u, &mut source).unwrap();
            }
            // The boundary value is that of the end to the residual promised.
            assert!((u[0] - 1.0).abs() < 1e-11, "{}", u[0]);
            largest(&u, &exact(1.0))
        };
        let observed = (error(40) / error(80)).log2();
        let stated = f64::from(scheme(a.clone()).unwrap().order());
        Promise::new("Orders", "implicit schemes with boundary rows, order less the stated one").within(
            -SLACK,
            SLACK,
            observed - stated,
        );
    }
}

/// A as a dense matrix.
fn dense(a: &CsrMatrix) -> DMatrix<f64> {
    let mut full = DMatrix::zeros(a.rows(), a.columns());
    a.triplets().for_each(|(row, column, value)| full[(row, column)] = value);
    full
}

#[test]
fn diffusion_numbers_of_a_million_are_stable_and_solved_as_promised() {
    let a = torus(15);
    let (n, full) = (225, dense(&a));
    let rate = full.clone().symmetric_eigenvalues().amax();
    let dt = 1e6 / rate;
    let identity = DMatrix::identity(n, n);
    for (scheme, theta) in schemes::<f64>().into_iter().zip([1.0, 0.5]) {
        let left = (&identity - &full * (theta * dt)).lu();
        let right = &identity + &full * ((1.0 - theta) * dt);
        for prepare in solvers() {
            let mut stepper = scheme(a.clone()).unwrap().solver(prepare);
            let mut amplification = DMatrix::zeros(n, n);
            for (q, mut column) in amplification.column_iter_mut().enumerate() {
                let mut unit = vec![0.0; n];
                unit[q] = 1.0;
                stepper.step(0.0, dt, &mut unit, &mut none).unwrap();
                column.copy_from_slice(&unit);
            }
            // Both sides are solved to a residual of N eps |A| |x|, and |(I - theta dt A)^-1| is 1.
            let unit = n as f64 * f64::EPSILON;
            let tolerance = 1e6 * unit;
            let error = (&amplification - left.solve(&right).unwrap()).amax();
            assert!(error < tolerance, "{error:e}");
            let radius = ((&amplification + amplification.transpose()) / 2.0).symmetric_eigenvalues().amax();
            // The exact radius is 1, of the constant mode, which is solved no better than the others.
            let million =
                Promise::new("Limits of steps", "spectral radius of implicit steps of diffusion number 10^6, less 1");
            million.in_units("N eps", unit).at_most(1e6, radius - 1.0);
        }
    }
}

#[test]
fn stiff_steps_of_rough_fields_keep_their_mass() {
    let a = torus(30);
    let rate = a.triplets().map(|entry| entry.2.abs()).fold(0.0, f64::max);
    for scheme in schemes::<f64>() {
        let mut stepper = scheme(a.clone()).unwrap();
        let mut u = noise(900, 5);
        let (before, size) = (u.iter().sum::<f64>(), u.iter().map(|u| u.abs()).sum::<f64>());
        for n in 0..20 {
            stepper.step(f64::from(n), 1e4 / rate, &mut u, &mut none).unwrap();
        }
        // Columns of A sum to rounding, |A| eps, which dt takes to 10^4 eps a step.
        let drift = (u.iter().sum::<f64>() - before).abs() / size;
        let stiff = Promise::new("Conservation", "mass over 20 implicit steps of diffusion number 10^4");
        stiff.in_units("eps dt/dt_explicit", 1e4 * f64::EPSILON).at_most(20.0, drift);
    }
}

#[test]
fn fast_modes_are_damped_by_implicit_euler_and_turned_over_by_crank_nicolson() {
    let fast = || CsrMatrix::from_triplets(2, 2, [(0, 0, -1e6), (1, 1, 3.0)]).unwrap();
    let step = |scheme: Scheme<f64>| {
        let mut u = [1.0, 1.0];
        scheme(fast()).unwrap().step(0.0, 1.0, &mut u, &mut none).unwrap();
        u
    };
    let [euler, crank_nicolson] = schemes().map(step);
    // 1/(1 - z) and (1 + z/2)/(1 - z/2), for z = -1e6 and the growing z = 3.
    assert!((euler[0] - 1.0 / 1_000_001.0).abs() < 1e-13 && (euler[1] + 0.5).abs() < 1e-13);
    assert!((crank_nicolson[0] + 499_999.0 / 500_001.0).abs() < 1e-13 && (crank_nicolson[1] + 5.0).abs() < 1e-12);
}

#[test]
fn no_mode_of_the_left_half_plane_grows_at_any_step() {
    for (scheme, re, im) in [0.0, -1e-3, -1.0, -30.0, -1e6]
        .into_iter()
        .flat_map(|re| [0.0, 0.1, 1.0, 50.0, 1e6].map(|im| (re, im)))
        .flat_map(|(re, im)| schemes::<f64>().map(|scheme| (scheme, re, im)))
    {
        let a = CsrMatrix::from_triplets(2, 2, [(0, 0, re), (0, 1, -im), (1, 0, im), (1, 1, re)]).unwrap();
        let mut stepper = scheme(a).unwrap();
        let mut u = [1.0, 0.0];
        stepper.step(0.0, 1.0, &mut u, &mut none).unwrap();
        let z = Complex::new(re, im);
        let factor = if stepper.order() == 1 { 1.0 / (-z + 1.0) } else { (z / 2.0 + 1.0) / (-z / 2.0 + 1.0) };
        let error = (Complex::new(u[0], u[1]) - factor).norm();
        // A residual of 1e-13 of the right side, |1 + z/2|, and the inverse undoes it.
        assert!(error < 1e-12 && u[0].hypot(u[1]) <= 1.0 + 1e-12, "{z}: {u:?}, due {factor}");
        assert_eq!((stepper.negative_real_interval(), stepper.imaginary_interval()), (f64::INFINITY, f64::INFINITY));
    }
}

#[test]
fn single_precision_states_follow_double_precision_to_their_rounding() {
    // One rounding of values below 1 a step, and errors are not amplified.
    const STEPS: u32 = 20;
    let a = torus(15);
    let start = noise(225, 9);
    for (single, double) in schemes::<f32>().into_iter().zip(schemes::<f64>()) {
        let (mut single, mut double) = (single(a.clone()).unwrap(), double(a.clone()).unwrap());
        let (mut u, mut v) = (start.iter().map(|&x| x as f32).collect::<Vec<_>>(), start.clone());
        for n in 0..STEPS {
            let t = 0.01 * f64::from(n);
            single.step(t, 0.01, &mut u, &mut none).unwrap();
            double.step(t, 0.01, &mut v, &mut none).unwrap();
        }
        let wide: Vec<f64> = u.iter().map(|&x| f64::from(x)).collect();
        assert!(largest(&wide, &v) < f64::from(STEPS * 15) * f64::from(f32::EPSILON) / 2.0);
        assert!(largest(&wide, &v) > 0.0);
    }
}

#[test]
fn every_field_of_an_entry_gets_the_bits_it_has_alone() {
    let a = torus(15);
    let fields: [Vec<f64>; 3] = std::array::from_fn(|k| noise(225, k as u64));
    for scheme in schemes::<f64>() {
        let alone = fields.clone().map(|mut u| {
            scheme(a.clone()).unwrap().step(0.0, 0.1, &mut u, &mut |t, g| {
                g.fill(t);
                Ok(())
            })?;
            Result::Ok(u)
        });
        let mut arrays: Vec<[f64; 3]> = (0..225).map(|p| std::array::from_fn(|k| fields[k][p])).collect();
        let mut vectors: Vec<SVector<[f64; 1], 3>> = arrays.iter().map(|u| SVector::from_fn(|k, _| [u[k]])).collect();
        let implicit = |euler: bool, a: CsrMatrix| if euler { Implicit::euler(a) } else { Implicit::crank_nicolson(a) };
        let euler = scheme(a.clone()).unwrap().order() == 1;
        implicit(euler, a.clone())
            .unwrap()
            .step(0.0, 0.1, &mut arrays, &mut |t, g: &mut [[f64; 3]]| {
                g.fill([t; 3]);
                Ok(())
            })
            .unwrap();
        let vector = if euler { Implicit::euler(a.clone()) } else { Implicit::crank_nicolson(a.clone()) };
        vector
            .unwrap()
            .step(0.0, 0.1, &mut vectors, &mut |t, g: &mut [SVector<[f64; 1], 3>]| {
                g.fill(SVector::repeat([t]));
                Ok(())
            })
            .unwrap();
        for (k, alone) in alone.into_iter().enumerate() {
            let alone = alone.unwrap();
            assert!((0..225).all(|p| arrays[p][k] == alone[p] && vectors[p][k][0] == alone[p]));
        }
    }
}

#[test]
fn system_is_kept_while_step_and_matrix_stay_and_made_anew_when_they_change() {
    use std::cell::Cell;
    thread_local!(static MADE: Cell<u32> = const { Cell::new(0) });
    fn counted(matrix: CsrMatrix) -> Result<SparseSolver> {
        MADE.set(MADE.get() + 1);
        SparseSolver::new(matrix)
    }
    let a = torus(15);
    let mut stepper = Implicit::crank_nicolson(a.clone()).unwrap().solver(counted);
    let start = noise(225, 2);
    let mut u = start.clone();
    let mut made = |stepper: &mut Implicit, t, dt| {
        stepper.step(t, dt, &mut u, &mut none).unwrap();
        MADE.get()
    };
    assert_eq!([0.0, 0.1, 0.2].map(|t| made(&mut stepper, t, 0.1)), [1; 3]);
    assert_eq!([0.3, 0.35].map(|t| made(&mut stepper, t, 0.05)), [2; 2]);
    stepper.set_matrix(a.clone()).unwrap();
    assert_eq!([0.4, 0.45].map(|t| made(&mut stepper, t, 0.05)), [3; 2]);

    let mut v = start;
    for (t, dt) in [(0.0, 0.1), (0.1, 0.1), (0.2, 0.1), (0.3, 0.05), (0.35, 0.05), (0.4, 0.05), (0.45, 0.05)] {
        Implicit::crank_nicolson(a.clone()).unwrap().solver(SparseSolver::new).step(t, dt, &mut v, &mut none).unwrap();
    }
    assert!(u == v);
}

#[test]
fn state_at_rest_keeps_its_bits() {
    let rest = CsrMatrix::from_triplets(6, 6, []).unwrap();
    let start = [1.0, -0.1, 1e300, -3e-308, 5e-324, 0.0];
    for (scheme, prepare) in schemes::<f64>().into_iter().flat_map(|scheme| solvers().map(move |s| (scheme, s))) {
        let (mut u, mut stepper) = (start, scheme(rest.clone()).unwrap().solver(prepare));
        for n in 0..10 {
            stepper.step(f64::from(n), 1.0, &mut u, &mut none).unwrap();
        }
        assert_eq!(u, start);
    }
}

#[test]
fn failing_steps_change_nothing_and_leave_later_ones_what_they_would_have_been() {
    let a = torus(15);
    let start = noise(225, 4);
    let time = |error: &Error| match error.kind() {
        ErrorKind::Time(kind) => *kind,
        other => panic!("{other:?}"),
    };
    for scheme in schemes::<f64>() {
        let (mut stepper, mut fresh) = (scheme(a.clone()).unwrap(), scheme(a.clone()).unwrap());
        let (mut u, mut v) = (start.clone(), start.clone());
        for n in 0..2 {
            let t = 0.5 * f64::from(n);
            let calls = stepper.order();
            for call in 1..=calls {
                let mut at = 0;
                let mut failing = |how: u32, u: &mut Vec<f64>| {
                    at = 0;
                    stepper.step(t, 0.5, u, &mut |_, g: &mut [f64]| {
                        g.fill(0.0);
                        at += 1;
                        match how {
                            _ if at != call => {}
                            0 => return Err(Error::user(11)),
                            1 => g[7] = f64::NAN,
                            _ => std::panic::resume_unwind(Box::new("the caller's panic")),
                        }
                        Ok(())
                    })
                };
                let before = u.clone();
                assert_eq!(failing(0, &mut u).unwrap_err(), Error::user(11));
                // Implicit Euler asks for the end only.
                let (stage, end) = if calls == 1 || call == 2 { (2, t + 0.5) } else { (1, t) };
                let due = Error::from(TimeError::NotFinite { stage, t: end }).at(7);
                assert_eq!(failing(1, &mut u).unwrap_err(), due);
                assert!(catch_unwind(AssertUnwindSafe(|| failing(2, &mut u))).is_err());
                assert_eq!(u, before);
            }
            for dt in [0.0, -1.0, f64::NAN, f64::INFINITY] {
                assert!(matches!(time(&stepper.step(t, dt, &mut u, &mut none).unwrap_err()), TimeError::Step { .. }));
            }
            let shape = stepper.step(t, 0.5, &mut u[1..], &mut none).unwrap_err();
            assert_eq!(time(&shape), TimeError::Shape { found: 224, needed: 225 });
            let mut bad = u.clone();
            bad[3] = f64::INFINITY;
            let error = stepper.step(t, 0.5, &mut bad, &mut none).unwrap_err();
            assert_eq!((error.particle(), time(&error)), (Some(3), TimeError::NotFinite { stage: 1, t }));

            stepper.step(t, 0.5, &mut u, &mut none).unwrap();
            fresh.step(t, 0.5, &mut v, &mut none).unwrap();
            assert_eq!(u, v);
        }
    }
}

#[test]
fn systems_that_cannot_be_solved_are_refused_and_change_nothing() {
    let mut u = vec![1.0; 225];
    u[0] = 2.0;
    let before = u.clone();
    let slow: [Prepare; 2] = [
        |matrix| SparseSolver::bicgstab(matrix, BiCgStab::new().most(3)),
        |matrix| SparseSolver::gmres(matrix, Gmres::new().most(3)),
    ];
    for prepare in slow {
        let error = Implicit::euler(torus(15)).unwrap().solver(prepare).step(0.0, 1.0, &mut u, &mut none).unwrap_err();
        assert!(
            matches!(linear(&error), LinearError::NotConverged { iterations: 3, residual, tolerance: 1e-13 } if residual > 1e-13)
        );
        assert_eq!(u, before);
    }

    // 1 - dt lambda = 0.
    let mut v = [1.0_f64, 2.0];
    for prepare in solvers() {
        let growing = CsrMatrix::from_triplets(2, 2, [(0, 0, -1.0), (1, 1, 4.0)]).unwrap();
        let mut stepper = Implicit::euler(growing).unwrap().solver(prepare);
        let error = stepper.step(0.0, 0.25, &mut v, &mut none).unwrap_err();
        assert!(matches!(linear(&error), LinearError::ZeroPivot { pivot: 0.0, .. } | LinearError::Singular { .. }));
        assert_eq!(v, [1.0, 2.0]);
        stepper.step(0.0, 0.125, &mut v, &mut none).unwrap();
        assert!((v[1] - 4.0).abs() < 1e-12);
        v = [1.0, 2.0];
    }
    let huge = CsrMatrix::from_triplets(2, 2, [(0, 0, -1.0), (1, 0, 1e300)]).unwrap();
    let error = Implicit::euler(huge).unwrap().step(0.0, 1e100, &mut v, &mut none).unwrap_err();
    assert_eq!(error.particle(), Some(1));
    assert!(matches!(linear(&error), LinearError::Entry { column: 0, .. }));

    let wide = CsrMatrix::from_triplets(2, 3, []).unwrap();
    let square = |n| CsrMatrix::identity(n).unwrap();
    let due = LinearError::NotSquare { rows: 2, columns: 3 };
    assert_eq!(linear(&Implicit::<f64>::euler(wide.clone()).unwrap_err()), due);
    let mut stepper = Implicit::<f64>::crank_nicolson(square(2)).unwrap();
    assert_eq!(linear(&stepper.set_matrix(wide).unwrap_err()), due);
    assert_eq!(linear(&stepper.set_matrix(square(3)).unwrap_err()), LinearError::Length { found: 3, needed: 2 });
    assert_eq!(
        linear(&stepper.algebraic([0, 2]).unwrap_err()),
        LinearError::Index { row: 2, column: 2, rows: 2, columns: 2 }
    );
}

proptest! {
    #![proptest_config(properties(cases()))]

    #[test]
    fn steps_satisfy_their_equations(seed in any::<u64>(), n in 1_usize..20, dt in 1e-3..1e3_f64, mask in any::<u32>()) {
        // Decaying rows, dominated by their diagonal; algebraic ones positive.
        let mut random = Random::new(seed);
        let mut entries = Vec::new();
        for p in 0..n {
            let mut sum = 0.1;
            for _ in 0..3 {
                let (q, value) = (random.uniform() * n as f64, random.uniform() - 0.5);
                sum += value.abs();
                entries.push((p, (q as usize).min(n - 1), value));
            }
            entries.push((p, p, if mask >> p & 1 == 1 { sum } else { -sum }));
        }
        let a = CsrMatrix::from_triplets(n, n, entries).unwrap();
        let algebraic = (0..n).filter(|p| mask >> p & 1 == 1);
        let (start, g) = (noise(n, seed ^ 1), [noise(n, seed ^ 2), noise(n, seed ^ 3)]);
        for (scheme, theta) in schemes::<f64>().into_iter().zip([1.0, 0.5]) {
            for prepare in solvers() {
                let mut stepper = scheme(a.clone()).unwrap().algebraic(algebraic.clone()).unwrap().solver(prepare);
                let mut u = start.clone();
                stepper.step(1.0, dt, &mut u, &mut |t, out| {
                    out.copy_from_slice(&g[usize::from(t > 1.0)]);
                    Ok(())
                }).unwrap();
                let full = dense(&a);
                let (before, after) = (&full * DVector::from_column_slice(&start), &full * DVector::from_column_slice(&u));
                // A residual of 1e-13 of the right sides, rows weighted within a factor of 2.
                let scale = 1.0 + dt * (before.amax() + after.amax() + 1.0);
                for p in 0..n {
                    let left = if mask >> p & 1 == 1 {
                        after[p] - g[1][p]
                    } else {
                        u[p] - start[p]
                            - dt * ((1.0 - theta) * (before[p] + g[0][p]) + theta * (after[p] + g[1][p]))
                    };
                    prop_assert!(left.abs() < 1e-12 * scale * n as f64, "{p}: {left:e} of {scale:e}");
                }
            }
        }
    }
}
