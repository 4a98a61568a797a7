//! Central DC-PSE advection on scattered particles: it grows, and hyperviscosity bounds it.

use parops::{
    AdvectionDiffusion, DcPse, Domain, ErrorKind, Eulerian, Gradient, GrowthPolicy, Laplacian, Limit, Nearest,
    Particles, Result, Rk4, Scene, SemiDiscrete, Sign, SolverError, Spacing, Stabilized, Steady, StepPolicy, Velocity,
    testing::Promise,
};

use crate::dense;

const N: usize = 18;
const VELOCITY: [f64; 2] = [0.8, -0.6];

fn applies<S: Scene<2>>(_: &S) -> usize {
    S::APPLIES
}

/// The size of a spike and a wave after so long, or infinity where it left the range of numbers.
fn largest<S: Scene<2, Value = f64>>(run: &mut Eulerian<2, S, Rk4<Vec<f64>>>, dt: f64, end: f64) -> Result<f64> {
    let points = run.discrete().site().points();
    let spike = |p: usize| f64::from(u8::from(p == 60));
    let mut u: Vec<f64> = points.iter().enumerate().map(|(p, x)| (6.3 * x[0]).sin() + spike(p)).collect();
    match run.advance(&mut u, end, dt) {
        Ok(_) => Ok(u.iter().fold(0.0, |largest, u| u.abs().max(largest))),
        Err(error) if matches!(error.kind(), ErrorKind::Time(_)) => Ok(f64::INFINITY),
        Err(error) => Err(error),
    }
}

/// Order R with k = `power` and so many neighbors.
fn bounded<const R: u32>(power: usize, neighbors: usize) -> Result<()> {
    let set = Particles::jittered([0.0; 2], [1.0; 2], [N; 2], 0.3, 2)?;
    let around = Nearest::build(&set, &Domain::periodic([0.0; 2], [1.0; 2])?, neighbors)?;
    let h = set.spacing()?;
    let gradient = || DcPse::<Gradient<2>, R>::new().sign(Sign::Minus);

    let bare = || AdvectionDiffusion::<2>::new().advection(VELOCITY, gradient());
    let error = Eulerian::new(bare(), &set, &around, Rk4::new()).err().unwrap();
    assert!(matches!(error.kind(), ErrorKind::Solver(SolverError::Growing { .. })), "{error}");
    let (refuse, allow) = (StepPolicy::Refuse, GrowthPolicy::Allow);
    let mut grown = Eulerian::with_policy(bare(), &set, &around, Rk4::new(), refuse, allow)?;
    assert!(grown.ledger().growth * h.0 > 0.1, "{}", grown.ledger().growth * h.0);

    let scheme = Stabilized::<2, R>::new(h).rows(gradient(), DcPse::<Laplacian<2>, R>::new());
    let scene = AdvectionDiffusion::<2>::new().advection(VELOCITY, scheme);
    assert_eq!(applies(&scene), 1 + power);
    let mut run = Eulerian::with_policy(scene, &set, &around, Rk4::new(), refuse, allow)?;
    // What the spectrum is tuned to at worst, 1e-3 |v|/h; the ledger has all eigenvalues.
    assert!(run.ledger().growth * h.0 <= 1e-3, "{}", run.ledger().growth * h.0);
    let limits = run.limits(&vec![0.0; set.len()])?;
    assert!(limits.rate(Limit::Hyperviscosity).decay > 0.0 && limits.rate(Limit::Advection).oscillation > 0.0);
    let dt = limits.step(&Rk4::<Vec<f64>>::new());
    let (without, with) = (largest(&mut grown, dt, 5.0)?, largest(&mut run, dt, 5.0)?);
    assert!(without > 50.0 && with < 1.5, "{R}: {without} {with}");
    Ok(())
}

#[test]
fn hyperviscosity_of_three_laplacians_bounds_advection_of_order_4() -> Result<()> {
    bounded::<4>(3, 30)
}

#[test]
fn hyperviscosity_of_four_laplacians_bounds_advection_of_order_6() -> Result<()> {
    bounded::<6>(4, 56)
}

/// The largest growth that the defaults leave in this flow on jittered sets of n^2 particles, in |v|/h, from all eigenvalues.
fn left<const R: u32>(n: usize, neighbors: usize, sets: &[(f64, u64)], flow: impl Velocity<2> + Copy) -> Result<f64> {
    let mut largest = f64::NEG_INFINITY;
    for &(jitter, seed) in sets {
        let set = Particles::jittered([0.0; 2], [1.0; 2], [n; 2], jitter, seed)?;
        let around = Nearest::build(&set, &Domain::periodic([0.0; 2], [1.0; 2])?, neighbors)?;
        let h = 1.0 / n as f64;
        let scene = AdvectionDiffusion::<2>::new().advection(flow, Stabilized::<2, R>::new(Spacing(h)));
        let mut discrete = SemiDiscrete::new(scene, &set, &around, GrowthPolicy::Refuse)?;
        let (mut field, mut rate) = (vec![0.0; set.len()], vec![0.0; set.len()]);
        let matrix = dense::matrix(set.len(), |u, du| {
            field.copy_from_slice(u);
            discrete.rate(0.0, &field, &mut rate)?;
            du.copy_from_slice(&rate);
            Ok(())
        });
        largest = largest.max(dense::extremes(&matrix).0 * h);
    }
    Ok(largest)
}

#[test]
fn default_hyperviscosity_leaves_no_growth_on_sets_whose_eigenvalues_are_all_found() -> Result<()> {
    let promise = |text| Promise::new("Limits of steps", text);
    let seeds = |count| (0..count).map(|seed| (0.3, seed)).collect::<Vec<_>>();
    promise("growth left by Stabilized at its defaults, v/h, r = 2, 40 sets")
        .at_most(1e-9, left::<2>(12, 18, &seeds(40), VELOCITY)?);
    promise("growth left by Stabilized at its defaults, v/h, r = 4, 15 sets")
        .at_most(1e-9, left::<4>(12, 42, &seeds(15), VELOCITY)?);
    Ok(())
}

#[test]
fn default_hyperviscosity_leaves_next_to_no_growth_where_eigenvalues_are_estimated() -> Result<()> {
    // Estimates of the whole alone left 1e-3 on the first of these.
    let sets = [(0.2, 1), (0.3, 1)];
    let steady = [left::<2>(26, 18, &sets, [0.8, 0.6])?, left::<4>(26, 42, &sets, [0.8, 0.6])?];
    let swirl = Steady(|x: &[f64; 2]| [(6.3 * x[1]).sin() + 0.3, (6.3 * x[0]).sin()]);
    let turning = [left::<2>(26, 18, &sets, swirl)?, left::<4>(26, 42, &sets, swirl)?];
    assert!(steady.iter().chain(&turning).all(|growth| *growth <= 2e-4), "{steady:?} {turning:?}");
    Ok(())
}

#[test]
fn hyperviscosity_is_found_in_any_unit_of_time() -> Result<()> {
    let set = Particles::jittered([0.0; 2], [1.0; 2], [12; 2], 0.3, 21)?;
    let around = Nearest::build(&set, &Domain::periodic([0.0; 2], [1.0; 2])?, 18)?;
    let damped = |unit: f64| {
        let scheme = Stabilized::<2, 2>::new(set.spacing()?);
        let scene = AdvectionDiffusion::<2>::new().advection(VELOCITY.map(|v| v * unit), scheme);
        let mut run = Eulerian::new(scene, &set, &around, Rk4::new())?;
        let limits = run.limits(&vec![0.0; set.len()])?;
        Ok::<f64, parops::Error>(limits.rate(Limit::Hyperviscosity).decay / unit)
    };
    let (second, powers) = (damped(1.0)?, [-900, -600, 500, 900]);
    for unit in powers.map(|power| 2.0_f64.powi(power)) {
        let found = damped(unit)?;
        assert!((found / second - 1.0).abs() < 1e-6, "{unit:e}: {found} for {second}");
    }
    Ok(())
}

#[test]
fn set_on_which_estimates_missed_the_growth_is_carried_for_thousands_of_steps() -> Result<()> {
    let set = Particles::jittered([0.0; 2], [1.0; 2], [12; 2], 0.3, 21)?;
    let around = Nearest::build(&set, &Domain::periodic([0.0; 2], [1.0; 2])?, 18)?;
    let scene = AdvectionDiffusion::<2>::new().advection(VELOCITY, Stabilized::<2, 2>::new(set.spacing()?));
    let mut run = Eulerian::new(scene, &set, &around, Rk4::new())?;
    let mut u: Vec<f64> = set.points().iter().map(|x| (std::f64::consts::TAU * x[0]).sin()).collect();
    let dt = 0.9 * run.longest_step(&u)?;
    run.advance(&mut u, 300.0, dt)?;
    assert!(run.ledger().step > 2000 && run.ledger().growth.abs() <= 1e-9, "{:?}", run.ledger());
    assert!(u.iter().all(|u| u.abs() <= 1.0), "{:?}", run.ledger().fields[0]);
    Ok(())
}

#[test]
fn growth_that_an_estimate_does_not_settle_is_recorded_as_unknown() -> Result<()> {
    // Too many particles for all eigenvalues, and a spectrum along the imaginary axis.
    let set = Particles::jittered([0.0; 2], [1.0; 2], [26; 2], 0.3, 1)?;
    let around = Nearest::build(&set, &Domain::periodic([0.0; 2], [1.0; 2])?, 18)?;
    for policy in [GrowthPolicy::Refuse, GrowthPolicy::Allow] {
        let scheme = Stabilized::<2, 2>::new(set.spacing()?).gamma(0.05);
        let scene = AdvectionDiffusion::<2>::new().advection(VELOCITY, scheme);
        let run = Eulerian::with_policy(scene, &set, &around, Rk4::new(), StepPolicy::Refuse, policy)?;
        assert!(run.ledger().growth.is_nan(), "{policy:?} {}", run.ledger().growth);
    }
    // Growth that is found is refused there, and recorded where it is allowed.
    let bare = || {
        let gradient = DcPse::<Gradient<2>, 2>::new().sign(Sign::Minus);
        AdvectionDiffusion::<2>::new().advection(VELOCITY, gradient)
    };
    let error = Eulerian::new(bare(), &set, &around, Rk4::new()).err().unwrap();
    assert!(matches!(error.kind(), ErrorKind::Solver(SolverError::Growing { .. })), "{error}");
    let (refuse, allow) = (StepPolicy::Refuse, GrowthPolicy::Allow);
    let run = Eulerian::with_policy(bare(), &set, &around, Rk4::new(), refuse, allow)?;
    assert!(run.ledger().growth / 26.0 > 0.01, "{}", run.ledger().growth);
    Ok(())
}
