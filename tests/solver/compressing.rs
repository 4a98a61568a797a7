//! Growth beside a term u div v: no field is annihilated there, and truncation moves the eigenvalue of v u = const from zero.

use std::f64::consts::TAU;

use parops::{
    AdvectionDiffusion, DcPse, Domain, Error, ErrorKind, Euler, Eulerian, Gradient, Nearest, Particles, Result, Rk4,
    SolverError, Stabilized, Steady, Stepper, Transport, UpwindDcPse, UpwindGradient,
};

const MOST: f64 = 0.3 * TAU;

fn speed(x: f64) -> f64 {
    1.0 + 0.3 * (TAU * x).sin()
}

/// The growth the ledger has of u_t = -(v u)_x on a ring, and the largest |u| at t = 10.
fn ring<X: Transport<1>, St: Stepper<Vec<f64>>>(n: usize, scheme: X, stepper: St) -> Result<(f64, f64)> {
    let set = Particles::lattice([0.0], [1.0], [n])?;
    let neighbors = Nearest::build(&set, &Domain::periodic([0.0], [1.0])?, 12)?;
    let scene = AdvectionDiffusion::<1>::new()
        .advection(Steady(|x: &[f64; 1]| [speed(x[0])]), scheme)
        .divergence(|x, _| MOST * (TAU * x[0]).cos());
    let mut run = Eulerian::new(scene, &set, &neighbors, stepper)?;
    let mut u = vec![1.0; n];
    let dt = 0.9 * run.longest_step(&u)?;
    let row = run.advance(&mut u, 10.0, dt)?;
    Ok((row.growth, u.iter().fold(0.0, |most, u| most.max(u.abs()))))
}

#[test]
fn growth_by_truncation_beside_a_compressing_flow_is_no_reason_to_refuse_it() -> Result<()> {
    for n in [32, 64, 128] {
        let set = Particles::lattice([0.0], [1.0], [n])?;
        let h = set.spacing()?;
        let upwind = UpwindGradient::new(h.epsilon(1.0)?, set.volumes()?).support(3.0)?;
        let all = [
            ring(n, UpwindDcPse::biased(h), Rk4::new())?,
            ring(n, UpwindDcPse::half_stencils(), Rk4::new())?,
            ring(n, upwind, Euler::new())?,
        ];
        for (i, (growth, largest)) in all.into_iter().enumerate() {
            // Order 3, 2 and 1; what starts as 1 never exceeds the fastest over the slowest speed.
            assert!(growth.abs() < 0.06 * 32.0 / n as f64, "{n} {i}: {growth:e}");
            assert!(largest < 1.02 * 1.3 / 0.7 * (10.0 * growth).exp(), "{n} {i}: {largest}");
        }
    }
    Ok(())
}

#[test]
fn hyperviscosity_is_found_with_the_divergence_and_its_absence_refused() -> Result<()> {
    for n in [64, 128] {
        let h = Particles::lattice([0.0], [1.0], [n])?.spacing()?;
        let (growth, largest) = ring(n, Stabilized::<1, 2>::new(h), Rk4::new())?;
        assert!(growth < 0.05 * MOST && largest < 1.3 / 0.7, "{n}: {growth:e} {largest}");
        // Waves as short as two spacings run against the flow and pile up where it comes from.
        let refused = ring(n, DcPse::<Gradient<1>, 4>::new(), Rk4::new()).unwrap_err();
        let ErrorKind::Solver(SolverError::Growing { rate, radius, limit }) = *refused.kind() else {
            panic!("{refused}")
        };
        assert!(rate > 0.8 * MOST && (limit * radius / MOST - 0.1).abs() < 0.01, "{refused}");
    }
    Ok(())
}

#[test]
fn scattered_sets_in_a_compressing_flow_run_with_every_scheme() -> Result<()> {
    fn growth<X: Transport<2>>(set: &Particles<2>, scheme: X) -> Result<f64> {
        let neighbors = Nearest::build(set, &Domain::periodic([0.0; 2], [1.0; 2])?, 45)?;
        let flow = Steady(|x: &[f64; 2]| [speed(x[0]), 0.5 * speed(x[1] + 0.2)]);
        let scene = AdvectionDiffusion::<2>::new()
            .advection(flow, scheme)
            .divergence(|x, _| MOST * ((TAU * x[0]).cos() + 0.5 * (TAU * (x[1] + 0.2)).cos()));
        let run = Eulerian::new(scene, set, &neighbors, Rk4::<Vec<f64>>::new())?;
        Ok::<_, Error>(run.ledger().growth)
    }
    for seed in 0..3 {
        let set = Particles::jittered([0.0; 2], [1.0; 2], [20; 2], 0.2, seed)?;
        let h = set.spacing()?;
        for growth in [growth(&set, UpwindDcPse::biased(h))?, growth(&set, Stabilized::<2, 2>::new(h))?] {
            assert!(growth.abs() < 0.1 * 1.5 * MOST, "{seed}: {growth:e}");
        }
    }
    let set = Particles::jittered([0.0; 2], [1.0; 2], [20; 2], 0.2, 0)?;
    let bare = growth(&set, DcPse::<Gradient<2>, 2>::new());
    assert!(bare.is_err_and(|error| matches!(error.kind(), ErrorKind::Solver(SolverError::Growing { .. }))));
    Ok(())
}
