//! Central DC-PSE advection of order 4 and 6 on scattered particles: it grows, and hyperviscosity bounds it.

use parops::{
    AdvectionDiffusion, DcPse, Domain, ErrorKind, Eulerian, Gradient, GrowthPolicy, Laplacian, Limit, Nearest,
    Particles, Result, Rk4, Scene, Sign, SolverError, Stabilized, StepPolicy,
};

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
    // What the spectrum was tuned to, 1e-3 |v|/h.
    assert!(run.ledger().growth * h.0 <= 1.1e-3, "{}", run.ledger().growth * h.0);
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
