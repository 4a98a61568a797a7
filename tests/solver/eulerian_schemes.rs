//! Advection schemes for scattered particles: upwind DC-PSE, and central DC-PSE with hyperviscosity.

use std::f64::consts::TAU;

use nalgebra::Complex;
use parops::{
    AdvectionDiffusion, Boundary, DcPse, Domain, ErrorKind, Euler, Eulerian, Gradient, GrowthPolicy, Laplacian, Limit,
    Nearest, Particles, Result, Rk4, Scene, Side, Sign, SolverError, SspRk3, Stabilized, Steady, StepPolicy,
    UpwindDcPse, testing::Promise,
};

use crate::eulerian_order::order;

const END: f64 = 0.25;

fn torus() -> Result<Domain<2>> {
    Domain::periodic([0.0; 2], [1.0; 2])
}

fn wave(x: &[f64; 2], t: f64) -> f64 {
    (TAU * (x[0] - t)).sin() * (TAU * (x[1] + 0.5 * t)).cos()
}

/// Root mean square error of a wave carried along (1, -1/2) at jitter 0.3.
fn carried<S: Scene<2, Value = f64>>(n: usize, k: usize, make: impl Fn(&Particles<2>) -> Result<S>) -> Result<f64> {
    let set = Particles::jittered([0.0; 2], [1.0; 2], [n; 2], 0.3, 6)?;
    let neighbors = Nearest::build(&set, &torus()?, k)?;
    let (steps, growth) = (StepPolicy::Refuse, GrowthPolicy::Unknown);
    let mut run = Eulerian::with_policy(make(&set)?, &set, &neighbors, Rk4::new(), steps, growth)?;
    let mut u: Vec<f64> = set.points().iter().map(|x| wave(x, 0.0)).collect();
    let dt = run.limits(&u)?.step(&Rk4::<Vec<f64>>::new());
    run.advance(&mut u, END, dt)?;
    let sum: f64 = set.points().iter().zip(&u).map(|(x, u)| (u - wave(x, END)).powi(2)).sum();
    Ok((sum / u.len() as f64).sqrt())
}

#[test]
fn upwind_dcpse_carries_waves_at_order_2_and_3() -> Result<()> {
    let scene = |upwind| AdvectionDiffusion::<2>::new().advection([1.0, -0.5], upwind);
    let half = UpwindDcPse::half_stencils();
    let second = |n| carried(n, half.neighbors::<2>()?, |_| Ok(scene(half)));
    let third = |n: usize| {
        let k = UpwindDcPse::biased(parops::Spacing(1.0 / n as f64)).neighbors::<2>()?;
        carried(n, k, |set| Ok(scene(UpwindDcPse::biased(set.spacing()?))))
    };
    let (mut seconds, mut thirds) = (Vec::new(), Vec::new());
    for n in [45, 64, 91, 128] {
        let h = 1.0 / n as f64;
        seconds.push((h, second(n)?));
        thirds.push((h, third(n)?));
    }
    let orders = [order(&seconds), order(&thirds)];
    Promise::new("Orders", "waves carried by upwind DC-PSE, half-stencils").within(1.9, 2.1, orders[0]);
    Promise::new("Orders", "waves carried by upwind DC-PSE, biased").within(2.9, 3.1, orders[1]);
    Ok(())
}

#[test]
fn upwind_dcpse_is_for_runge_kutta_and_refuses_euler() -> Result<()> {
    let set = Particles::jittered([0.0; 2], [1.0; 2], [16; 2], 0.3, 6)?;
    let half = UpwindDcPse::half_stencils();
    let neighbors = Nearest::build(&set, &torus()?, half.neighbors::<2>()?)?;
    let turning = Steady(|x: &[f64; 2]| [(TAU * x[1]).sin(), (TAU * x[0]).cos()]);
    let scene = || AdvectionDiffusion::<2>::new().advection(turning, half);
    let error = Eulerian::new(scene(), &set, &neighbors, Euler::new()).err().unwrap();
    assert!(matches!(error.kind(), ErrorKind::Solver(SolverError::Unstable { term: Limit::Advection, .. })), "{error}");
    // Growth is estimated, and there is none.
    let mut run = Eulerian::new(scene(), &set, &neighbors, SspRk3::new())?;
    assert!(run.ledger().growth < 1e-3, "{}", run.ledger().growth);
    let mut u: Vec<f64> = (0..256).map(|p| f64::from(u8::from(p % 7 == 0))).collect();
    let dt = run.longest_step(&u)?;
    assert_eq!(dt, run.limits(&u)?.step(&SspRk3::<Vec<f64>>::new()));
    run.advance(&mut u, 5.0, dt)?;
    assert!(u.iter().all(|u| u.abs() < 2.0));
    Ok(())
}

#[test]
fn upwind_dcpse_names_the_particle_without_an_upstream() -> Result<()> {
    let line = Particles::lattice([0.0], [1.0], [40])?;
    let half = UpwindDcPse::half_stencils();
    let neighbors = Nearest::build(&line, &Domain::open(), half.neighbors::<1>()?)?;
    let scene = || AdvectionDiffusion::<1>::new().advection([2.0], half);
    let error = Eulerian::new(scene(), &line, &neighbors, Rk4::new()).err().unwrap();
    assert_eq!(*error.kind(), ErrorKind::Solver(SolverError::NoUpstream { axis: 0, velocity: 2.0 }));
    assert_eq!(error.particle(), Some(0));
    // The first particles have too few on their left; with values there the rest is carried on, and leaves. What comes in at
    // the rate omega goes on as the wave of the rows, 2 sum_q w_q (exp(i k (x_q - x_p)) - 1) = i omega, that starts somewhere
    // among the four particles of the inflow.
    let miss = |n: usize| -> Result<f64> {
        let line = Particles::lattice([0.0], [1.0], [n])?;
        let neighbors = Nearest::build(&line, &Domain::open(), half.neighbors::<1>()?)?;
        let f = |s: f64| (3.0 * s).sin();
        let inflow = Boundary::new(1).inflow((0..4).map(|p| (p, [-1.0])));
        let scene = scene().boundary(inflow, move |_, x, t| f(x[0] - 2.0 * t));
        let mut run = Eulerian::new(scene, &line, &neighbors, SspRk3::new())?;
        let mut u: Vec<f64> = line.points().iter().map(|x| f(x[0])).collect();
        run.advance(&mut u, 1.0, 0.08 / n as f64)?;
        let rows = half.open_sides().assemble(&neighbors)?;
        let row = rows.rows(0, Side::Left).and_then(|rows| rows.row(n / 2)).unwrap();
        let from = |q: u32| line.points()[q as usize][0] - line.points()[n / 2][0];
        let (i, mut k) = (Complex::<f64>::i(), Complex::new(3.0, 0.0));
        for _ in 0..8 {
            let (mut excess, mut slope) = (-3.0 * i, Complex::new(0.0, 0.0));
            for (&q, w) in row.sources.iter().zip(row.weights) {
                let e = (i * k * from(q)).exp();
                excess += (e - 1.0) * w[0];
                slope += i * from(q) * e * w[0];
            }
            k -= excess / slope;
        }
        let inlet = line.points()[3][0];
        let wave = |x: f64| (i * (k * (x - inlet) + 3.0 * (inlet - 2.0))).exp().im;
        let (mut worst, mut largest) = (0.0_f64, 0.0_f64);
        for (x, u) in line.points().iter().zip(&u).skip(4) {
            worst = worst.max((u - wave(x[0])).abs());
            largest = largest.max((wave(x[0]) - f(x[0] - 2.0)).abs());
        }
        // In spacings, of the way along which the largest difference from the exact wave has grown.
        Ok(worst / largest * n as f64)
    };
    let (coarse, fine) = (miss(40)?, miss(80)?);
    assert!(fine < 3.0 && (coarse / fine - 1.0).abs() < 0.02, "{coarse} {fine}");
    Ok(())
}

#[test]
fn hyperviscosity_stops_the_growth_of_central_rows() -> Result<()> {
    let set = Particles::jittered([0.0; 2], [1.0; 2], [14; 2], 0.3, 6)?;
    let neighbors = Nearest::build(&set, &torus()?, 20)?;
    let gradient = || DcPse::<Gradient<2>, 2>::new().sign(Sign::Minus);
    let bare = AdvectionDiffusion::<2>::new().advection([1.0, 0.4], gradient());
    let growth = GrowthPolicy::Allow;
    let bare = Eulerian::with_policy(bare, &set, &neighbors, Rk4::new(), StepPolicy::Refuse, growth)?;
    assert!(bare.ledger().growth / 14.0 > 0.02, "{}", bare.ledger().growth);

    let scheme = Stabilized::<2, 2>::new(set.spacing()?).rows(gradient(), DcPse::<Laplacian<2>, 2>::new());
    let scene = AdvectionDiffusion::<2>::new().advection([1.0, 0.4], scheme);
    fn applies<S: Scene<2>>(_: &S) -> usize {
        S::APPLIES
    }
    assert_eq!(applies(&scene), 3);
    let mut run = Eulerian::with_policy(scene, &set, &neighbors, Rk4::new(), StepPolicy::Refuse, growth)?;
    // What is left is what the spectrum was tuned to, 1e-3 |v|/h.
    assert!(run.ledger().growth <= 1.1e-3 * 1.08 * 14.0, "{}", run.ledger().growth);
    let mut u: Vec<f64> = (0..set.len()).map(|p| f64::from(u8::from(p == 60))).collect();
    let limits = run.limits(&u)?;
    assert!(limits.rate(Limit::Hyperviscosity).decay > 0.0 && limits.rate(Limit::Advection).oscillation > 0.0);
    run.advance(&mut u, 20.0, limits.step(&Rk4::<Vec<f64>>::new()))?;
    assert!(u.iter().all(|u| u.abs() < 1.0), "{:?}", run.ledger().fields[0]);
    Ok(())
}

#[test]
fn hyperviscosity_keeps_the_order_of_the_rows() -> Result<()> {
    let scene = |set: &Particles<2>| {
        Ok(AdvectionDiffusion::<2>::new().advection([1.0, -0.5], Stabilized::<2, 2>::new(set.spacing()?).gamma(0.1)))
    };
    let order = (carried(32, 20, scene)? / carried(64, 20, scene)?).log2();
    Promise::new("Orders", "waves carried by DC-PSE with hyperviscosity, r = 2").within(1.9, 2.1, order);
    Ok(())
}
