//! Stiff scenes: they run with the right scheme, or are refused with the limit named and the explicit steps counted.

use parops::{
    AdvectionDiffusion, CellList, DcPse, Domain, ErrorKind, Euler, Eulerian, Gradient, ImplicitScheme, Laplacian,
    Limit, Nearest, Neighbors, Particles, Pse, Result, Rkl2, RowSymmetry, Scene, SolverError, SspRk3, StepLimit,
    StepPolicy, Stepper, UpwindGradient, testing::Promise,
};
use std::f64::consts::TAU;

/// What one number per step is worth: dt in units of the longest step of explicit Euler.
const NUMBER: f64 = 1e6;

fn set() -> Result<(Particles<2>, Nearest<2>)> {
    let particles = Particles::jittered([0.0; 2], [1.0; 2], [14; 2], 0.2, 2)?;
    let neighbors = Nearest::build(&particles, &Domain::periodic([0.0; 2], [1.0; 2])?, 20)?;
    Ok((particles, neighbors))
}

fn scene() -> impl Scene<2, Value = f64> {
    AdvectionDiffusion::<2>::new().diffusion(1.0, DcPse::<Laplacian<2>, 2>::new())
}

fn wave(particles: &Particles<2>) -> Vec<f64> {
    particles.points().iter().map(|x| (6.3 * x[0]).sin() + x[1]).collect()
}

#[test]
fn implicit_steps_of_a_million_explicit_ones_are_stable() -> Result<()> {
    let (particles, neighbors) = set()?;
    let explicit = Euler::<Vec<f64>>::new();
    let spread = |u: &[f64]| {
        let (low, high) = u.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), u| (a.min(*u), b.max(*u)));
        high - low
    };
    let mut euler = Eulerian::new(scene(), &particles, &neighbors, ImplicitScheme::euler())?;
    let mut u = wave(&particles);
    let dt = NUMBER * euler.limits(&u)?.step(&explicit);
    assert!((euler.limits(&u)?.steps(dt, &explicit) - NUMBER).abs() <= 1.0);
    let start = spread(&u);
    euler.step(&mut u, dt)?;
    // The slowest mode decays by 1/(1 + 4 pi^2 dt).
    assert!(spread(&u) < 2.0 * start / (39.4 * dt), "{} {dt}", spread(&u));

    let mut crank = Eulerian::new(scene(), &particles, &neighbors, ImplicitScheme::crank_nicolson())?;
    let mut u = wave(&particles);
    for _ in 0..50 {
        crank.step(&mut u, dt)?;
        // Every mode keeps its size; rows of DC-PSE are not normal, so their sum is bounded by more than 1.
        assert!(spread(&u) < 3.0 * start && crank.ledger().within_limit);
    }
    Ok(())
}

#[test]
fn super_time_stepping_takes_substeps_or_refuses_with_their_number() -> Result<()> {
    let (particles, neighbors) = set()?;
    let mut u = wave(&particles);
    let stages = || -> Result<Rkl2<Vec<f64>>> { Rkl2::new(16)?.with_slope(RowSymmetry::General.slope()) };
    let mut run = Eulerian::new(scene(), &particles, &neighbors, stages()?)?;
    let rate = run.limits(&u)?.rate(Limit::Diffusion).decay;
    let dt = NUMBER * 2.0 / rate;
    // 16 stages reach 60.06 where eigenvalues may lie beside the axis by a slope of 0.2.
    let reach = stages()?.negative_real_interval();
    let needed = (2.0 * NUMBER / reach).ceil();
    assert_eq!(run.limits(&u)?.steps(dt, &stages()?), needed);
    let error = run.step(&mut u, dt).err().unwrap();
    assert!(matches!(error.kind(), ErrorKind::Solver(SolverError::Limit { binding: Limit::Diffusion, .. })), "{error}");
    let mut run = run.step_policy(StepPolicy::Adapt { most: 100 });
    let error = run.step(&mut u, dt).err().unwrap();
    assert!(matches!(error.kind(), ErrorKind::Solver(SolverError::Substeps { most: 100, .. })), "{error}");
    // A thousandth of that: 34 substeps, by policy or by the scheme itself.
    let row = run.step(&mut u, dt / 1000.0)?;
    assert_eq!((row.substeps, row.within_limit), (34, true));
    let limit = StepLimit::from_spectral_bound(rate, 1.0)?;
    let own = Rkl2::for_decay(&limit, dt / 1000.0, RowSymmetry::General)?;
    assert_eq!(own.substeps(), 34);
    let mut run = Eulerian::new(scene(), &particles, &neighbors, own)?.step_policy(StepPolicy::Allow);
    run.step(&mut u, dt / 1000.0)?;
    assert!(u.iter().all(|u| u.abs() < 2.0));
    Ok(())
}

#[test]
fn peclet_numbers_of_a_million_run_upwind_and_name_what_binds() -> Result<()> {
    let (n, d) = (100, 1e-6);
    let ring = Particles::lattice([0.0], [1.0], [n])?;
    let (epsilon, volumes) = (ring.spacing()?.epsilon(1.5)?, ring.volumes()?);
    let laplacian = Pse::new(Laplacian::<1>, 2, epsilon.clone(), volumes)?;
    let upwind = UpwindGradient::new(epsilon, volumes);
    let neighbors = CellList::build(&ring, &Domain::periodic([0.0], [1.0])?, upwind.cutoff())?;
    let scene = || AdvectionDiffusion::<1>::new().diffusion(d, laplacian.clone());
    let mut run = Eulerian::new(scene().advection([1.0], upwind), &ring, &neighbors, SspRk3::new())?;
    let mut u: Vec<f64> = (0..n).map(|p| f64::from(u8::from(p > 30 && p < 60))).collect();
    let limits = run.limits(&u)?;
    let stepper = SspRk3::<Vec<f64>>::new();
    assert_eq!(limits.binding(&stepper), Some(Limit::Advection));
    run.advance(&mut u, 2.0, limits.step(&stepper))?;
    // No weight is negative: the step of rows keeps the extrema, but for what Runge-Kutta adds.
    assert!(u.iter().all(|u| *u > -0.05 && *u < 1.05));
    let gradient = Pse::new(Gradient::<1>, 2, ring.spacing()?.epsilon(1.5)?, volumes)?;
    let error = Eulerian::new(scene().advection([1.0], gradient), &ring, &neighbors, Euler::new()).err().unwrap();
    assert!(matches!(error.kind(), ErrorKind::Solver(SolverError::Unstable { term: Limit::Advection, .. })), "{error}");
    Ok(())
}

#[test]
fn upwind_steps_of_euler_make_no_new_extrema() -> Result<()> {
    const STEPS: usize = 50;
    let set = Particles::jittered([0.0; 2], [1.0; 2], [24; 2], 0.3, 9)?;
    let upwind = UpwindGradient::new(set.spacing()?.epsilon(1.2)?, set.volumes()?);
    let cutoff = upwind.cutoff();
    let neighbors = CellList::build(&set, &Domain::periodic([0.0; 2], [1.0; 2])?, cutoff)?;
    let terms = (0..set.len()).map(|p| neighbors.count(p, cutoff.0)).max().unwrap_or(0);
    let swirl = |x: &[f64; 2], _: f64| [(TAU * x[1]).sin(), 0.5 - (TAU * x[0]).cos()];
    let scene = AdvectionDiffusion::<2>::new().advection(swirl, upwind);
    let mut run = Eulerian::new(scene, &set, &neighbors, Euler::new())?;
    let mut u: Vec<f64> = set.points().iter().map(|x| f64::from(u8::from(x[0] < 0.5))).collect();
    let extrema = |u: &[f64]| u.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), u| (a.min(*u), b.max(*u)));
    for _ in 0..STEPS {
        let (low, high) = extrema(&u);
        let dt = run.longest_step(&u)?;
        run.step(&mut u, dt)?;
        let (lowest, highest) = extrema(&u);
        // A step is a mean with weights that are not negative, and rounds as many terms as a row has.
        Promise::new("Limits of steps", "upwind steps of Euler at their limit make no new extrema")
            .in_units("n eps", terms as f64 * f64::EPSILON)
            .at_most(1.0, (low - lowest).max(highest - high));
    }
    Ok(())
}
