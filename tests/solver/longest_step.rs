//! The longest step a run names is one that it takes: with sources, whose rates are difference quotients, and where flow and
//! source change during the step.

use std::f64::consts::TAU;

use parops::{
    AdvectionDiffusion, Carried, DcPse, Domain, ErrorKind, Eulerian, Fields, Lagrangian, Laplacian, Nearest, Particles,
    Result, Rk4, SolverError, StepPolicy, UpwindDcPse,
};

/// 50 steps of the length that is the longest at the first, on a ring: steps that were cut, where that is allowed.
fn ring<E: Fields>(number: impl Fn(f64) -> E, source: impl Fn(f64, E) -> E + Sync, cut: bool) -> Result<u64> {
    let ring = Particles::lattice([0.0], [1.0], [40])?;
    let neighbors = Nearest::build(&ring, &Domain::periodic([0.0], [1.0])?, 6)?;
    let scene = AdvectionDiffusion::<1>::new()
        .fields::<E>()
        .diffusion(1.0, DcPse::<Laplacian<1>, 2>::new())
        .source(move |x: &[f64; 1], _, u: E| source(x[0], u));
    let mut u: Vec<E> = ring.points().iter().map(|x| number((TAU * x[0]).sin())).collect();
    let mut run = Eulerian::new(scene, &ring, &neighbors, Rk4::new())?;
    if cut {
        run = run.step_policy(StepPolicy::Adapt { most: 4 });
    }
    let dt = run.longest_step(&u)?;
    (0..50).try_for_each(|_| run.step(&mut u, dt).map(|_| ()))?;
    Ok(run.ledger().retries)
}

#[test]
fn longest_step_stays_legal_beside_sources_that_are_linear() -> Result<()> {
    for k in [1.0, 50.0, 1000.0] {
        for cut in [false, true] {
            assert_eq!(ring(|x| x, |x, u: f64| x - k * u, cut)?, 0, "k = {k}");
            assert_eq!(ring(|x| x as f32, |x, u: f32| x as f32 - k as f32 * u, cut)?, 0, "f32, k = {k}");
        }
    }
    let set = Particles::lattice([0.0; 2], [1.0; 2], [16; 2])?;
    let u: Vec<f64> = set.points().iter().map(|x| (TAU * x[0]).sin()).collect();
    let scene = AdvectionDiffusion::<2>::new()
        .diffusion(0.1, DcPse::<Laplacian<2>, 2>::new())
        .source(|x: &[f64; 2], _, u: f64| x[0] - 5.0 * u);
    let mut run = Lagrangian::new(scene, &set, &u, &Domain::periodic([0.0; 2], [1.0; 2])?, Rk4::new())?;
    let dt = run.longest_step()?;
    (0..50).try_for_each(|_| run.step(dt).map(|_| ()))
}

#[test]
fn longest_step_is_legal_where_the_flow_grows() -> Result<()> {
    let set = Particles::lattice([0.0; 2], [1.0; 2], [16; 2])?;
    let torus = Domain::periodic([0.0; 2], [1.0; 2])?;
    let start: Vec<f64> = set.points().iter().map(|x| (TAU * x[0]).sin()).collect();

    let upwind = UpwindDcPse::half_stencils();
    let neighbors = Nearest::build(&set, &torus, upwind.neighbors::<2>()?)?;
    let scene = AdvectionDiffusion::<2>::new()
        .diffusion(0.01, DcPse::<Laplacian<2>, 2>::new())
        .advection(|_: &[f64; 2], t: f64| [1.0 + 20.0 * t, 0.0], upwind);
    let (mut run, mut u) = (Eulerian::new(scene, &set, &neighbors, Rk4::new())?, start.clone());
    for _ in 0..10 {
        let (dt, most) = (run.longest_step(&u)?, run.limits(&u)?.step(run.stepper()));
        let row = run.step(&mut u, dt)?;
        // The flow is at most 1.2 times as fast at the end of half of the step legal at the start, and so on.
        assert!(row.within_limit && dt <= most && dt > 0.3 * most, "{dt} of {most}");
    }

    let shear = |x: &[f64; 2], t: f64| [0.1 * (1.0 + 20.0 * t) * (TAU * x[1]).sin(), 0.0];
    let scene =
        AdvectionDiffusion::<2>::new().diffusion(0.01, DcPse::<Laplacian<2>, 2>::new()).advection(shear, Carried);
    let mut run = Lagrangian::new(scene, &set, &start, &torus, Rk4::new())?;
    for _ in 0..3 {
        let dt = run.longest_step()?;
        assert!(dt > 0.0 && run.step(dt)?.within_limit);
    }
    Ok(())
}

#[test]
fn source_that_quickens_during_a_step_bounds_it() -> Result<()> {
    let ring = Particles::lattice([0.0], [1.0], [8])?;
    let neighbors = Nearest::build(&ring, &Domain::periodic([0.0], [1.0])?, 2)?;
    let scene = || AdvectionDiffusion::<1>::new().source(|_, t, u: f64| -(1.0 + 1e4 * t) * u);
    let mut u = vec![1.0; 8];
    let mut run = Eulerian::new(scene(), &ring, &neighbors, Rk4::new())?;
    // Legal at the start, where the rate is 1; at the end it is 2e4.
    let error = run.step(&mut u, 2.0).unwrap_err();
    let ErrorKind::Solver(SolverError::Limit { dt, limit, .. }) = *error.kind() else { panic!("{error}") };
    assert!(dt == 2.0 && limit < 2e-4 && u == [1.0; 8], "{error}");
    for _ in 0..100 {
        let dt = run.longest_step(&u)?;
        assert!(run.step(&mut u, dt)?.within_limit);
    }
    assert!(u.iter().all(|u| u.abs() < 1.0), "{u:?}");

    // On moving particles the same.
    let domain = Domain::periodic([0.0], [1.0])?;
    let mut run = Lagrangian::new(scene(), &ring, &[1.0; 8], &domain, Rk4::new())?;
    assert!(matches!(run.step(2.0).unwrap_err().kind(), ErrorKind::Solver(SolverError::Limit { .. })));
    let dt = run.longest_step()?;
    assert!(dt > 0.0 && run.step(dt)?.within_limit);
    Ok(())
}

#[test]
fn longest_step_looks_no_further_than_flow_and_source_are_defined() -> Result<()> {
    type Flow = fn(&[f64; 2], f64) -> [f64; 2];
    let flows: [Flow; 3] = [
        |_, t| [1e-6 * t.exp(), 0.0],
        |_, t| [1e-3 * (1.0 - t / 10.0).sqrt(), 0.0],
        |_, t| [1e-40 * (1.0 - t / 10.0).sqrt(), 0.0],
    ];
    let set = Particles::lattice([0.0; 2], [1.0; 2], [16; 2])?;
    let upwind = UpwindDcPse::half_stencils();
    let neighbors = Nearest::build(&set, &Domain::periodic([0.0; 2], [1.0; 2])?, upwind.neighbors::<2>()?)?;
    for flow in flows {
        let scene = AdvectionDiffusion::<2>::new().advection(flow, upwind);
        let (mut run, mut u) = (Eulerian::new(scene, &set, &neighbors, Rk4::new())?, vec![1.0; set.len()]);
        let dt = run.longest_step(&u)?;
        assert!(dt > 1.0 && dt < 100.0, "{dt}");
        run.step(&mut u, dt)?;
    }
    // What is not defined at any later time is an error.
    let scene = AdvectionDiffusion::<2>::new().advection(|_: &[f64; 2], t: f64| [(-t).sqrt() + 1.0, 0.0], upwind);
    let mut run = Eulerian::new(scene, &set, &neighbors, Rk4::new())?;
    let error = run.longest_step(&vec![1.0; set.len()]).unwrap_err();
    assert!(matches!(error.kind(), ErrorKind::Solver(SolverError::Velocity { .. })), "{error}");
    Ok(())
}

#[test]
fn longest_step_ends_where_a_source_does() -> Result<()> {
    let ring = Particles::lattice([0.0], [1.0], [40])?;
    let torus = Domain::periodic([0.0], [1.0])?;
    let neighbors = Nearest::build(&ring, &torus, 6)?;
    type Sources = [fn(&[f64; 1], f64, f64) -> f64; 2];
    let sources: Sources = [|_, t, _| (1.0 - t).sqrt(), |_, t, u| -1e-3 * u * (1.0 - t).sqrt()];
    for source in sources {
        let scene = || AdvectionDiffusion::<1>::new().diffusion(1e-6, DcPse::<Laplacian<1>, 2>::new()).source(source);
        let (mut run, mut u) = (Eulerian::new(scene(), &ring, &neighbors, Rk4::new())?, vec![1.0; 40]);
        let dt = run.longest_step(&u)?;
        assert!(dt > 0.5 && dt <= 1.0, "{dt}");
        run.step(&mut u, dt)?;
        let mut run = Lagrangian::new(scene(), &ring, &[1.0; 40], &torus, Rk4::new())?;
        let dt = run.longest_step()?;
        assert!(dt > 0.5 && dt <= 1.0, "{dt}");
        run.step(dt)?;
    }
    Ok(())
}

/// The longest step of RK4 at a uniform field, times the rate 1 of a source.
fn uniform<E: Fields>(u: E, source: impl Fn(E) -> E + Sync) -> Result<f64> {
    let ring = Particles::lattice([0.0], [1.0], [8])?;
    let neighbors = Nearest::build(&ring, &Domain::periodic([0.0], [1.0])?, 2)?;
    let scene = AdvectionDiffusion::<1>::new().fields::<E>().source(move |_: &[f64; 1], _, u: E| source(u));
    Eulerian::new(scene, &ring, &neighbors, Rk4::new())?.longest_step(&[u; 8])
}

#[test]
fn source_bounds_a_step_however_small_the_field() -> Result<()> {
    // The interval of RK4 on the negative axis.
    let legal = uniform(1.0, |u: f64| -u)?;
    assert!((legal - 2.785).abs() < 1e-3, "{legal}");
    for power in 0..320 {
        let u = 10.0_f64.powi(-power);
        for found in [uniform(u, |u: f64| -u)?, uniform(u, |u: f64| 5.0 - u)?, uniform(u, |u: f64| 1e6 - u)?] {
            assert!((found / legal - 1.0).abs() < 0.02, "1e-{power}: {found}");
        }
        if power < 45 {
            let u = u as f32;
            for found in [uniform(u, |u: f32| -u)?, uniform(u, |u: f32| 5.0 - u)?] {
                assert!((found / legal - 1.0).abs() < 0.02, "f32, 1e-{power}: {found}");
            }
        }
    }
    Ok(())
}
