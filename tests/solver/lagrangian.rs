//! Moving particles without remeshing: what is conserved, what binds a step, what is refused, and runs taken up again.

use std::f64::consts::TAU;

use parops::{
    AdvectionDiffusion, Allowance, Carried, CellList, Cutoff, DcPse, Domain, Error, ErrorKind, Euler, Eulerian, Face,
    Gradient, GrowthPolicy, Lagrangian, Lambda, Laplacian, Leapfrog, Limit, Mesh, MovingDiffusion, MovingScene,
    MovingSettings, MovingState, ParticleError, Particles, Pse, Rate, Remeshing, Result, Rk4, SavedParticles,
    SolverError, Spacing, SspRk3, Steady, StepPolicy, Stepper, TimeError, Trigger, Volumes, testing::Promise,
};

const EPS: f64 = f64::EPSILON;

fn swirl(x: &[f64; 2]) -> [f64; 2] {
    let [a, b] = x.map(|x| TAU * x);
    [0.3 * a.sin() * b.cos(), -0.3 * a.cos() * b.sin()]
}

fn torus() -> Domain<2> {
    Domain::periodic([0.0; 2], [1.0; 2]).unwrap()
}

fn bits(u: &[f64]) -> Vec<u64> {
    u.iter().map(|u| u.to_bits()).collect()
}

/// What a run looks like from outside, bit for bit.
fn picture<const D: usize, S, St>(run: &Lagrangian<D, S, St>) -> (Vec<u64>, Vec<u64>, Vec<u64>, u64, String)
where
    S: MovingScene<D, Value = f64>,
    St: Stepper<MovingState<D, f64>>,
{
    let points = bits(run.points().as_flattened());
    // As text, where not a number equals itself.
    (points, bits(run.strengths()), bits(run.volumes()), run.time().to_bits(), format!("{:?}", run.ledger()))
}

#[test]
fn pure_advection_keeps_every_bit_of_every_strength() -> Result<()> {
    let particles = Particles::jittered([0.0; 2], [1.0; 2], [20; 2], 0.3, 1)?;
    let mut u: Vec<f64> = particles.points().iter().map(|x| (7.0 * x[0]).sin() / 3.0 + x[1]).collect();
    u[3] = -0.0;
    let expected: Vec<f64> = {
        let volumes = particles.volumes()?;
        u.iter().enumerate().map(|(p, u)| 0.0 + volumes.get(p).unwrap() * u).collect()
    };
    let still = AdvectionDiffusion::<2>::new().advection(Steady(swirl), Carried);
    let mut run = Lagrangian::new(still, &particles, &u, &torus(), Rk4::new())?;
    let volumes = bits(run.volumes());
    run.advance(2.0, 0.02)?;
    let kept = Promise::new("Conservation", "strengths under pure advection, bits");
    kept.equal(&bits(run.strengths()), &bits(&expected));
    assert_eq!(bits(run.volumes()), volumes);
    assert_ne!(run.points(), particles.points());

    let squeezing = |x: &[f64; 2], t: f64| [0.1 * (TAU * x[0]).sin() * t.cos(), 0.0];
    let squeezed = AdvectionDiffusion::<2>::new()
        .advection(squeezing, Carried)
        .divergence(|x: &[f64; 2], t: f64| 0.1 * TAU * (TAU * x[0]).cos() * t.cos());
    let mut run = Lagrangian::new(squeezed, &particles, &u, &torus(), SspRk3::new())?;
    run.advance(2.0, 0.02)?;
    kept.equal(&bits(run.strengths()), &bits(&expected));
    assert_ne!(bits(run.volumes()), volumes);
    assert!(run.volumes().iter().all(|&volume| volume > 0.0));
    assert!(run.ledger().fields[0].drift == 0.0);
    Ok(())
}

#[test]
fn volumes_and_values_follow_the_divergence_at_the_order_of_the_stepper() -> Result<()> {
    // v = -a x, div v = -2 a: V = V_0 exp(-2 a t) and u = u_0 exp(2 a t), at x_0 exp(-a t).
    const A: f64 = 0.4;
    let particles = Particles::jittered([-1.0; 2], [1.0; 2], [6; 2], 0.3, 2)?;
    let u = vec![1.5; 36];
    let worst = |computed: bool, steps: u32| -> Result<f64> {
        let inward = Steady(|x: &[f64; 2]| x.map(|x| -A * x));
        let scene = AdvectionDiffusion::<2>::new().advection(inward, Carried);
        let dt = 1.0 / f64::from(steps);
        let factor = (-A).exp();
        let check = |points: &[[f64; 2]], values: Vec<f64>| {
            let at = points.iter().zip(particles.points()).map(|(x, start)| (x[0] - start[0] * factor).abs());
            let of = values.iter().map(|u| (u - 1.5 / (factor * factor)).abs());
            at.chain(of).fold(0.0, f64::max)
        };
        if computed {
            let mut run = Lagrangian::new(scene.computed_divergence(), &particles, &u, &Domain::open(), Rk4::new())?;
            run.advance(1.0, dt)?;
            Ok(check(run.points(), run.values().collect()))
        } else {
            let scene = scene.divergence(|_: &[f64; 2], _: f64| -2.0 * A);
            let mut run = Lagrangian::new(scene, &particles, &u, &Domain::open(), Rk4::new())?;
            run.advance(1.0, dt)?;
            Ok(check(run.points(), run.values().collect()))
        }
    };
    let order = (worst(false, 4)? / worst(false, 8)?).log2();
    Promise::new("Orders", "volumes and values in a divergent flow, RK4").within(3.7, 4.4, order);
    // Differences of a linear velocity are exact but for rounding, eps/step of them.
    assert!((worst(true, 8)? - worst(false, 8)?).abs() < 1e-9);
    Ok(())
}

/// How far particles are from where they began after the flow has run forth and, turned round, back.
fn miss<St: Stepper<MovingState<2, f64>>>(stepper: impl Fn() -> St, dt: f64) -> Result<f64> {
    const TIME: f64 = 0.75;
    let particles = Particles::lattice([0.0; 2], [1.0; 2], [8; 2])?;
    let u = [1.0; 64];
    let scene = |sign: f64| {
        AdvectionDiffusion::<2>::new().advection(Steady(move |x: &[f64; 2]| swirl(x).map(|v| sign * v)), Carried)
    };
    let mut forth = Lagrangian::new(scene(1.0), &particles, &u, &torus(), stepper())?;
    forth.advance(TIME, dt)?;
    let mut back = Lagrangian::new(scene(-1.0), &forth.particles()?, &u, &torus(), stepper())?;
    back.advance(TIME, dt)?;
    let apart = |(x, y): (&[f64; 2], &[f64; 2])| (x[0] - y[0]).hypot(x[1] - y[1]);
    Ok(back.points().iter().zip(particles.points()).map(apart).fold(0.0, f64::max))
}

#[test]
fn flow_turned_round_takes_particles_back_at_the_order_of_the_stepper() -> Result<()> {
    // The errors of an even order cancel on the way back but for the next order: 5 for RK4.
    let order = |a: f64, b: f64| (a / b).log2();
    let (a, b) = (miss(Rk4::new, 0.05)?, miss(Rk4::new, 0.025)?);
    let back = |text| Promise::new("Metamorphic relations", text);
    back("M13 order at which particles come back, RK4").within(4.7, 5.3, order(a, b));
    let (a, b) = (miss(SspRk3::new, 0.05)?, miss(SspRk3::new, 0.025)?);
    back("M13 order at which particles come back, SSP-RK3").within(2.7, 3.5, order(a, b));
    let (a, b) = (miss(Euler::new, 0.01)?, miss(Euler::new, 0.005)?);
    back("M13 order at which particles come back, Euler").within(0.8, 1.2, order(a, b));
    Ok(())
}

/// PSE of order 2 on short supports, for what does not depend on accuracy.
fn loose<const D: usize>(particles: &Particles<D>, ratio: f64) -> Pse<parops::Exchange<D>> {
    let epsilon = particles.spacing().unwrap().epsilon(ratio).unwrap();
    let pse = Pse::new(Laplacian::<D>, 2, epsilon, particles.volumes().unwrap()).unwrap();
    pse.support(2.5).unwrap().allow(Allowance::Everywhere)
}

#[test]
fn symmetric_pse_conserves_the_mass_over_ten_thousand_steps() -> Result<()> {
    const STEPS: u32 = 10_000;
    const DRIFT: f64 = 1e-12;
    let particles = Particles::jittered([0.0; 2], [1.0; 2], [8; 2], 0.2, 3)?;
    let u: Vec<f64> = particles.points().iter().map(|x| (TAU * x[0]).sin() + (TAU * x[1]).cos()).collect();
    // To and fro, so that the set stays one.
    let rock = |x: &[f64; 2], t: f64| swirl(x).map(|v| v * (TAU * t).cos());
    let scene = AdvectionDiffusion::<2>::new().diffusion(1e-3, loose(&particles, 1.0)).advection(rock, Carried);
    let mut run = Lagrangian::new(scene, &particles, &u, &torus(), Euler::new())?;
    let size = run.ledger().fields[0].size;
    let mut worst = 0.0_f64;
    run.advance_with(f64::from(STEPS) * 1e-3, 1e-3, |row, _| worst = worst.max(row.fields[0].drift.abs()))?;
    println!("drift {:e} of {size}", worst / size);
    assert_eq!(run.ledger().step, u64::from(STEPS));
    let mass = Promise::new("Conservation", "mass over 10^4 Lagrangian steps of PSE, relative");
    mass.at_most(DRIFT, worst / size);

    // Volumes of their own that change with a flow.
    let ring = Domain::periodic([0.0], [1.0])?;
    let particles = Particles::jittered([0.0], [1.0], [24], 0.3, 4)?.with_midpoint_volumes(&ring)?;
    let u: Vec<f64> = particles.points().iter().map(|x| (TAU * x[0]).sin()).collect();
    let breathe = |x: &[f64; 1], t: f64| [0.02 * (TAU * x[0]).sin() * (TAU * t).cos()];
    let scene = AdvectionDiffusion::<1>::new()
        .diffusion(1e-3, loose(&particles, 1.5))
        .advection(breathe, Carried)
        .divergence(|x: &[f64; 1], t: f64| 0.02 * TAU * (TAU * x[0]).cos() * (TAU * t).cos());
    let mut run = Lagrangian::new(scene, &particles, &u, &ring, Euler::new())?;
    let size = run.ledger().fields[0].size;
    run.advance_with(f64::from(STEPS) * 1e-3, 1e-3, |row, _| {
        mass.at_most(DRIFT, row.fields[0].drift.abs() / size);
    })?;
    assert!(run.ledger().fields[0].size < 0.9 * size, "something was exchanged");
    Ok(())
}

/// The largest error of a decaying wave in a swirl-free shear at t = 0.2 on n by n particles by DC-PSE, unremeshed.
fn sheared_decay(n: usize) -> Result<(f64, f64)> {
    const NU: f64 = 0.02;
    const END: f64 = 0.2;
    let particles = Particles::jittered([0.0; 2], [1.0; 2], [n; 2], 0.2, 5)?;
    // A wave in y is left alone by a shear in x.
    let wave = |x: &[f64; 2], t: f64| (-NU * TAU * TAU * t).exp() * (TAU * x[1]).sin();
    let u: Vec<f64> = particles.points().iter().map(|x| wave(x, 0.0)).collect();
    let shear = Steady(|x: &[f64; 2]| [0.8 * (TAU * x[1]).cos(), 0.0]);
    let scene = AdvectionDiffusion::<2>::new().diffusion(NU, DcPse::<Laplacian<2>, 2>::new()).advection(shear, Carried);
    let mut run =
        Lagrangian::new(scene, &particles, &u, &torus(), Rk4::new())?.step_policy(StepPolicy::Adapt { most: 50 });
    run.advance(END, 0.4 / n as f64)?;
    let row = run.ledger();
    assert!(row.condition > 1.0 && row.residual > 0.0 && row.residual < 1e-9, "{row:?}");
    let errors = run.points().iter().zip(run.values()).map(|(x, u)| (u - wave(x, END)).abs());
    Ok((errors.fold(0.0, f64::max), row.fields[0].drift.abs()))
}

#[test]
fn dcpse_diffuses_on_a_distorted_set_without_remeshing_at_its_order() -> Result<()> {
    let [(a, _), (b, drift)] = [sheared_decay(16)?, sheared_decay(32)?];
    let order = (a / b).log2();
    println!("errors {a:e} {b:e}, order {order}, drift {drift:e}");
    assert!(b < 0.02, "{a:e} {b:e}");
    // Of the largest error: the band of L-inf orders on scattered sets.
    Promise::new("Orders", "DC-PSE diffusion on a distorted set, r = 2").within(1.65, 2.5, order);
    // Rows that are not symmetric do not conserve, and the ledger says so.
    assert!(drift > 1e-12);
    Ok(())
}

#[test]
fn source_acts_on_values_and_strengths_follow() -> Result<()> {
    let particles = Particles::jittered([0.0; 2], [1.0; 2], [5; 2], 0.3, 6)?;
    let u: Vec<[f64; 2]> = particles.points().iter().map(|x| [1.0 + x[0], 2.0]).collect();
    let scene = AdvectionDiffusion::<2>::new()
        .fields::<[f64; 2]>()
        .advection([0.5, 0.25], Carried)
        .source(|_, t, u: [f64; 2]| [-u[0], 3.0 * t * t]);
    let mut run = Lagrangian::new(scene, &particles, &u, &torus(), Rk4::new())?;
    run.advance(1.0, 0.05)?;
    // Order 4 with step 0.05: dt^4/120 of a unit of time.
    for (u, start) in run.values().zip(&u) {
        assert!((u[0] - start[0] * (-1.0_f64).exp()).abs() < 1e-7 && (u[1] - 3.0).abs() < 1e-12, "{u:?}");
    }
    assert_eq!(run.ledger().binding, Some(Limit::Source));
    Ok(())
}

#[test]
fn particles_cross_just_above_the_sharp_limit_and_not_below() -> Result<()> {
    // 7.14: dt dv/dx > -1. Explicit Euler in v = -a x maps x to (1 - a dt) x.
    const A: f64 = 3.0;
    let line = Particles::new(vec![[0.1], [0.2], [0.4]])?.with_equal_volumes(0.3)?;
    let ordered = |dt: f64| -> Result<bool> {
        let scene = AdvectionDiffusion::<1>::new().advection(Steady(|x: &[f64; 1]| [-A * x[0]]), Carried);
        let mut run =
            Lagrangian::new(scene, &line, &[1.0; 3], &Domain::open(), Euler::new())?.step_policy(StepPolicy::Allow);
        run.step(dt)?;
        Ok(run.points().windows(2).all(|pair| pair[0][0] < pair[1][0]))
    };
    let sharp = Promise::new("Limits of steps", "particles cross at 1.01 of the limit of distortion and not at 0.99");
    sharp.holds(ordered(0.99 / A)? && !ordered(1.01 / A)?);

    // 7.16 in the plane, with the matrix of errata 37: the largest entry is 1, the norm 2. Particles in a row along the
    // diagonal change places beyond dt = 1/2, half of what the largest entry would allow.
    let diagonal = Particles::new(vec![[0.0, 0.0], [0.1, 0.1]])?.with_equal_volumes(1.0)?;
    let apart = |dt: f64| -> Result<f64> {
        let squeeze = Steady(|x: &[f64; 2]| [-x[0] - x[1]; 2]);
        let scene = AdvectionDiffusion::<2>::new().advection(squeeze, Carried);
        let mut run = Lagrangian::new(scene, &diagonal, &[1.0; 2], &Domain::open(), Euler::new())?
            .courant(0.999)?
            .step_policy(StepPolicy::Allow);
        let within = dt <= run.longest_step()?;
        run.step(dt)?;
        assert_eq!(run.ledger().within_limit, within);
        assert_eq!(within, dt < 0.5);
        Ok(run.points()[1][0] - run.points()[0][0])
    };
    sharp.holds(apart(0.99 * 0.5)? > 0.0 && apart(1.01 * 0.5)? < 0.0);
    Ok(())
}

#[test]
fn lagrangian_cfl_refuses_adapts_and_allows_by_policy() -> Result<()> {
    // A shear of 4/time has |grad v|_2 = 4: C = 0.5 leaves 0.125.
    let particles = Particles::jittered([-1.0; 2], [1.0; 2], [6; 2], 0.3, 7)?;
    let run = |policy: StepPolicy| -> Result<_> {
        let scene = AdvectionDiffusion::<2>::new().advection(Steady(|x: &[f64; 2]| [4.0 * x[1], 0.0]), Carried);
        Ok(Lagrangian::new(scene, &particles, &[1.0; 36], &Domain::open(), Rk4::new())?.step_policy(policy))
    };
    let mut refusing = run(StepPolicy::Refuse)?;
    let before = picture(&refusing);
    let error = refusing.step(0.2).unwrap_err();
    let ErrorKind::Solver(SolverError::Limit { dt, limit, binding }) = error.kind() else { panic!("{error}") };
    assert_eq!((*dt, *binding), (0.2, Limit::Distortion));
    assert!((limit - 0.125).abs() < 1e-9);
    assert_eq!(refusing.longest_step()?, *limit);
    assert_eq!(picture(&refusing), before);
    let mut adapting = run(StepPolicy::Adapt { most: 2 })?;
    let row = adapting.step(0.2)?;
    assert!((row.substeps, row.retries, row.within_limit) == (2, 1, true));
    let error = adapting.step(0.4).unwrap_err();
    assert!(matches!(error.kind(), ErrorKind::Solver(SolverError::Substeps { most: 2, .. })), "{error}");
    let mut allowing = run(StepPolicy::Allow)?;
    assert!(!allowing.step(0.2)?.within_limit);
    for constant in [0.0, 1.0, -0.5, f64::NAN] {
        let error = run(StepPolicy::Refuse)?.courant(constant).err();
        assert!(matches!(error.as_ref().map(Error::kind), Some(ErrorKind::Solver(SolverError::Courant { .. }))));
    }
    Ok(())
}

#[test]
fn diffusion_and_compression_bind_together_as_corrected() -> Result<()> {
    // 7.11 with errata 36: dt <= 2/(D lambda + dv/dx), dv/dx > 0.
    let particles = Particles::jittered([-1.0], [1.0], [20], 0.2, 8)?.with_equal_volumes(2.0)?;
    let limit = |growth: f64| -> Result<(f64, f64)> {
        let scene = AdvectionDiffusion::<1>::new()
            .diffusion(0.05, loose(&particles, 1.5))
            .advection(Steady(move |x: &[f64; 1]| [growth * x[0]]), Carried)
            .divergence(move |_: &[f64; 1], _: f64| growth);
        let mut run = Lagrangian::new(scene, &particles, &[1.0; 20], &Domain::open(), Euler::new())?.courant(0.99)?;
        let limits = run.limits()?;
        Ok((limits.step(&Euler::<MovingState<1, f64>>::new()), limits.rate(Limit::Diffusion).decay))
    };
    let (still, decay) = limit(0.0)?;
    assert!((still * decay - 2.0).abs() < 4.0 * EPS * 2.0 && decay > 1.0);
    let (growing, _) = limit(1.0)?;
    assert!((growing * (decay + 1.0) - 2.0).abs() < 1e-12);
    // Where a flow is compressed nothing but the distortion binds: u grows physically.
    let (shrinking, _) = limit(-1.0)?;
    assert!((shrinking - still.min(0.99)).abs() < 1e-9);
    Ok(())
}

#[test]
fn volume_that_would_vanish_is_refused_and_changes_nothing() -> Result<()> {
    let particles = Particles::new(vec![[0.1], [0.2], [0.4]])?.with_equal_volumes(0.3)?;
    // Twice as strong a sink at the last particle as elsewhere.
    let sink = |x: &[f64; 1], _: f64| if x[0] > 0.3 { -2.0 } else { -1.0 };
    let scene = || AdvectionDiffusion::<1>::new().advection(Steady(|x: &[f64; 1]| [-x[0]]), Carried).divergence(sink);
    let mut run = Lagrangian::new(scene(), &particles, &[1.0, 2.0, 3.0], &Domain::open(), Euler::new())?
        .step_policy(StepPolicy::Allow);
    run.step(0.1)?;
    let before = picture(&run);
    let error = run.step(0.55).unwrap_err();
    let ErrorKind::Solver(SolverError::Volume { volume, t }) = error.kind() else { panic!("{error}") };
    assert!((volume + 0.1 * 0.8 * 0.1).abs() < 1e-15 && (t - 0.65).abs() < 1e-15, "{volume} {t}");
    assert_eq!((error.particle(), picture(&run)), (Some(2), before.clone()));
    run.step(0.4)?;
    assert!(run.volumes().iter().all(|&volume| volume > 0.0));
    // A stage may be the one: SSP-RK3 takes a whole step of Euler first.
    let mut run = Lagrangian::new(scene(), &particles, &[1.0, 2.0, 3.0], &Domain::open(), SspRk3::new())?
        .step_policy(StepPolicy::Allow);
    let before = picture(&run);
    let error = run.step(0.6).unwrap_err();
    assert!(matches!(error.kind(), ErrorKind::Solver(SolverError::Volume { .. })), "{error}");
    assert_eq!((error.particle(), picture(&run)), (Some(2), before));
    Ok(())
}

#[test]
fn velocities_of_particles_are_differentiated_by_rows() -> Result<()> {
    // A linear velocity is differentiated exactly: singular values of [[0.5, 2], [-1, 0.25]], trace 0.75.
    let flow = |x: &[f64; 2]| [0.5 * x[0] + 2.0 * x[1], -x[0] + 0.25 * x[1]];
    let particles = Particles::jittered([0.0; 2], [1.0; 2], [8; 2], 0.3, 9)?;
    let each: Vec<[f64; 2]> = particles.points().iter().map(flow).collect();
    let u = [1.0; 64];
    let known = AdvectionDiffusion::<2>::new().advection(Steady(flow), Carried).computed_divergence();
    let held = AdvectionDiffusion::<2>::new().advection(each, Carried).computed_divergence();
    let mut known = Lagrangian::new(known, &particles, &u, &Domain::open(), Rk4::new())?;
    let mut held = Lagrangian::new(held, &particles, &u, &Domain::open(), Rk4::new())?;
    let (a, b) = (known.limits()?, held.limits()?);
    // |A|^2 is the larger root of s^2 - (sum a_ij^2) s + (det A)^2.
    let (sum, determinant) = (0.25_f64 + 4.0 + 1.0 + 0.0625, 0.125_f64 + 2.0);
    let norm = (0.5 * (sum + (sum * sum - 4.0 * determinant * determinant).sqrt())).sqrt();
    for limits in [a, b] {
        assert!((limits.rate(Limit::Distortion).frequency - 2.0 * norm).abs() < 1e-7);
        // Without diffusion there is nothing that an expansion could make decay too fast.
        assert_eq!(limits.rate(Limit::Compression), Rate::default());
    }
    // Each going straight on, the particles fill det(1 + dt A) of their volume.
    held.step(0.01)?;
    let volume = particles.volumes()?.get(0)? * (1.0 + 0.75 * 0.01 + determinant * 0.01 * 0.01);
    assert!(held.volumes().iter().all(|v| (v / volume - 1.0).abs() < 1e-8));
    Ok(())
}

#[test]
fn numbers_that_are_not_finite_are_refused_with_particle_and_time() -> Result<()> {
    let particles = Particles::lattice([0.0; 2], [1.0; 2], [4; 2])?;
    let u = [1.0; 16];
    let scene = AdvectionDiffusion::<2>::new()
        .advection([0.1, 0.0], Carried)
        .source(|x, t, _| if x[1] > 0.8 && t > 0.12 { f64::NAN } else { 0.0 });
    let mut run = Lagrangian::new(scene, &particles, &u, &torus(), Rk4::new())?;
    run.step(0.1)?;
    let before = picture(&run);
    let error = run.step(0.1).unwrap_err();
    let ErrorKind::Time(TimeError::NotFinite { stage, t }) = error.kind() else { panic!("{error}") };
    assert_eq!((*stage, error.particle()), (2, Some(3)));
    assert!((t - 0.15).abs() < 1e-15);
    assert_eq!(picture(&run), before);

    let torn = |x: &[f64; 2], t: f64| [if t > 0.05 && x[0] > 0.6 { f64::INFINITY } else { 0.0 }, 0.0];
    let scene = AdvectionDiffusion::<2>::new().advection(torn, Carried);
    let mut run = Lagrangian::new(scene, &particles, &u, &torus(), Euler::new())?;
    run.step(0.04)?;
    let error = run.step(0.1).unwrap_err();
    assert!(matches!(error.kind(), ErrorKind::Solver(SolverError::Velocity { axis: 0, .. })), "{error}");
    assert_eq!(error.particle(), Some(8));
    Ok(())
}

#[test]
fn scenes_and_steppers_that_do_not_fit_are_refused_at_construction() -> Result<()> {
    let particles = Particles::lattice([0.0; 2], [1.0; 2], [8; 2])?;
    let u = [1.0; 64];
    let diffusing =
        || AdvectionDiffusion::<2>::new().diffusion(0.1, loose(&particles, 1.5)).advection([1.0, 0.0], Carried);
    let leapfrog = Lagrangian::new(diffusing(), &particles, &u, &torus(), Leapfrog::new()).err();
    assert!(matches!(
        leapfrog.as_ref().map(Error::kind),
        Some(ErrorKind::Solver(SolverError::Unstable { term: Limit::Diffusion, .. }))
    ));
    let short = Lagrangian::new(diffusing(), &particles, &u[1..], &torus(), Rk4::new()).err();
    assert!(matches!(
        short.as_ref().map(Error::kind),
        Some(ErrorKind::Time(TimeError::Shape { found: 63, needed: 64 }))
    ));
    let bare = Particles::new(particles.points().to_vec())?;
    let bare = Lagrangian::new(diffusing(), &bare, &u, &torus(), Rk4::new()).err();
    assert!(matches!(bare.as_ref().map(Error::kind), Some(ErrorKind::Particle(ParticleError::NoVolumes { .. }))));
    let small = Domain::new([0.0; 2], [0.9; 2], [[Face::Open; 2]; 2])?;
    let outside = Lagrangian::new(diffusing(), &particles, &u, &small, Rk4::new()).err();
    assert_eq!(outside.and_then(|error| error.particle()), Some(7));
    let strict = Pse::new(Laplacian::<2>, 2, Spacing(0.125).epsilon(0.4)?, particles.volumes()?)?;
    let scene = AdvectionDiffusion::<2>::new().diffusion(0.1, strict).advection([1.0, 0.0], Carried);
    let overlap = Lagrangian::new(scene, &particles, &u, &torus(), Rk4::new()).err();
    assert!(matches!(overlap.as_ref().map(Error::kind), Some(ErrorKind::Operator(_))), "{overlap:?}");
    // Particles that stay cannot be carried.
    let scene = AdvectionDiffusion::<2>::new().advection([1.0, 0.0], Carried);
    let cells = CellList::build(&particles, &torus(), Cutoff(0.25))?;
    let stays = Eulerian::new(scene, &particles, &cells, Rk4::new()).err();
    assert!(matches!(stays.as_ref().map(Error::kind), Some(ErrorKind::Solver(SolverError::Stays { particles: 64 }))));
    Ok(())
}

#[test]
fn growing_modes_of_the_start_are_refused_or_recorded() -> Result<()> {
    let particles = Particles::random([0.0; 2], [1.0; 2], 400, 3)?.with_equal_volumes(1.0)?;
    let u = vec![1.0; 400];
    let run = |growth: GrowthPolicy| {
        let laplacian = DcPse::<Laplacian<2>, 2>::new().neighbors_per_condition(1.0).unwrap();
        let scene = AdvectionDiffusion::<2>::new().diffusion(1e-3, laplacian).advection([1.0, 0.0], Carried);
        let mut settings = MovingSettings::default();
        settings.growth = growth;
        Lagrangian::with_settings(scene, &particles, &u, &torus(), Euler::new(), settings)
    };
    let refused = run(GrowthPolicy::Refuse).err();
    let rate = match refused.as_ref().map(Error::kind) {
        Some(ErrorKind::Solver(SolverError::Growing { rate, .. })) => *rate,
        other => panic!("{other:?}"),
    };
    assert!(rate > 0.0);
    assert_eq!(run(GrowthPolicy::Allow)?.ledger().growth, rate);
    assert!(run(GrowthPolicy::Unknown)?.ledger().growth.is_nan());
    Ok(())
}

#[test]
fn scene_of_an_eulerian_run_serves_a_lagrangian_one() -> Result<()> {
    let particles = Particles::lattice([0.0; 2], [1.0; 2], [24; 2])?;
    let wave = |x: &[f64; 2]| (TAU * x[0]).sin();
    let u: Vec<f64> = particles.points().iter().map(wave).collect();
    let scene = || {
        AdvectionDiffusion::<2>::new()
            .diffusion(0.01, DcPse::<Laplacian<2>, 2>::new())
            .advection([0.5, 0.0], DcPse::<Gradient<2>, 2>::new())
    };
    let reach = DcPse::<Laplacian<2>, 2>::new().cutoff(&particles)?;
    let cells = CellList::build(&particles, &torus(), reach)?;
    let (mut still, mut field) = (Eulerian::new(scene(), &particles, &cells, Rk4::new())?, u.clone());
    still.advance(&mut field, 0.5, 0.01)?;
    let mut moving = Lagrangian::new(scene(), &particles, &u, &torus(), Rk4::new())?;
    moving.advance(0.5, 0.01)?;
    let exact = |x: f64| (-0.01 * TAU * TAU * 0.5).exp() * (TAU * (x - 0.25)).sin();
    let worst =
        |points: &[[f64; 2]], u: &[f64]| points.iter().zip(u).map(|(x, u)| (u - exact(x[0])).abs()).fold(0.0, f64::max);
    let (a, b) = (worst(particles.points(), &field), worst(moving.points(), &moving.values().collect::<Vec<_>>()));
    println!("eulerian {a:e}, lagrangian {b:e}");
    assert!(a < 0.1 && b < 0.2 * a);
    Ok(())
}

#[test]
fn absent_terms_take_no_room_and_lists_are_reused() -> Result<()> {
    assert_eq!(size_of::<<() as MovingDiffusion<2, f64>>::Kept>(), 0);
    let particles = Particles::lattice([0.0; 2], [1.0; 2], [16; 2])?;
    let u = vec![1.0; 256];
    let rebuilds = |skin: f64| -> Result<u64> {
        let scene =
            AdvectionDiffusion::<2>::new().diffusion(1e-3, loose(&particles, 1.0)).advection(Steady(swirl), Carried);
        let mut list = MovingSettings::default();
        list.skin = Some(skin);
        let mut run = Lagrangian::with_settings(scene, &particles, &u, &torus(), Rk4::new(), list)?;
        run.advance(0.2, 0.01)?;
        Ok(run.ledger().rebuilds)
    };
    // 20 steps of four stages, of which the second and third are at places of their own.
    assert!(rebuilds(0.0)? >= 40);
    // At most 0.3 in 0.2 of time is 0.06, twice that 0.12: three skins of 0.04.
    assert!((1..=3).contains(&rebuilds(0.04)?));

    // Without a flow nothing moves, and nothing is searched twice.
    let scene = AdvectionDiffusion::<2>::new().diffusion(1e-3, loose(&particles, 1.0));
    let mut still = Lagrangian::new(scene, &particles, &u, &torus(), Rk4::new())?;
    still.advance(0.1, 0.01)?;
    assert_eq!((still.ledger().rebuilds, still.points()), (0, particles.points()));
    Ok(())
}

#[test]
fn sharp_rates_take_the_place_of_bounds() -> Result<()> {
    let particles = Particles::lattice([0.0], [1.0], [32])?;
    let ring = Domain::periodic([0.0], [1.0])?;
    let scene = AdvectionDiffusion::<1>::new().diffusion(0.1, loose(&particles, 1.5)).advection([0.2], Carried);
    let mut run = Lagrangian::new(scene, &particles, &[1.0; 32], &ring, Euler::new())?;
    let bound = run.limits()?.rate(Limit::Diffusion).decay;
    let mut run = run.sharp(Limit::Diffusion, Rate::decay(0.5 * bound));
    assert_eq!(run.limits()?.step(&Euler::<MovingState<1, f64>>::new()), 4.0 / bound);
    Ok(())
}

/// What comes back of what was put aside: through a file where there are files, otherwise as it was.
trait Stored: Sized {
    fn stored(self) -> Self;
}

#[cfg(feature = "serde")]
impl<T: serde::Serialize + serde::de::DeserializeOwned> Stored for T {
    fn stored(self) -> Self {
        serde_json::from_str(&serde_json::to_string(&self).unwrap()).unwrap()
    }
}

#[cfg(not(feature = "serde"))]
impl<T> Stored for T {
    fn stored(self) -> Self {
        self
    }
}

/// 100 steps at once, and 50 and 50 with a file between them.
fn both_ways<S: MovingScene<2, Value = f64>, St>(start: impl Fn() -> Result<Lagrangian<2, S, St>>) -> Result<()>
where
    St: Stepper<MovingState<2, f64>> + Clone,
    SavedParticles<f64, St>: Stored,
{
    const DT: f64 = 1.0 / 512.0;
    let mut whole = start()?;
    (0..100).try_for_each(|_| whole.step(DT).map(|_| ()))?;
    let mut first = start()?;
    (0..50).try_for_each(|_| first.step(DT).map(|_| ()))?;
    let saved = first.save().stored();
    drop(first);
    let mut second = start()?;
    second.resume(saved)?;
    (50..100).try_for_each(|_| second.step(DT).map(|_| ()))?;
    assert_eq!(picture(&whole), picture(&second));
    assert_eq!(whole.ledger().step, 100);
    Ok(())
}

#[test]
fn runs_resume_with_equal_bits() -> Result<()> {
    let particles = Particles::jittered([0.0; 2], [1.0; 2], [12; 2], 0.2, 10)?;
    let u: Vec<f64> = particles.points().iter().map(|x| (TAU * x[0]).sin() + x[1]).collect();
    let gust = |x: &[f64; 2], t: f64| swirl(x).map(|v| v * (1.0 + t));
    both_ways(|| {
        let scene = AdvectionDiffusion::<2>::new()
            .diffusion(1e-3, loose(&particles, 1.0))
            .advection(gust, Carried)
            .source(|x, t, u| x[0] * t - u);
        let mut list = MovingSettings::default();
        // Searched anew every few steps.
        list.skin = Some(0.004);
        Lagrangian::with_settings(scene, &particles, &u, &torus(), Rk4::new(), list)
    })?;
    both_ways(|| {
        let scene =
            AdvectionDiffusion::<2>::new().diffusion(1e-3, DcPse::<Laplacian<2>, 2>::new()).advection(gust, Carried);
        let mesh = Mesh::cells(&torus(), [12; 2])?;
        let remeshing = Remeshing { kernel: Lambda::<2, 1>::new()?, mesh, trigger: Trigger::Steps(7), threshold: 1e-9 };
        Lagrangian::new(scene, &particles, &u, &torus(), SspRk3::new())?.remeshing(remeshing)
    })?;
    both_ways(|| {
        let scene = AdvectionDiffusion::<2>::new().advection(gust, Carried).computed_divergence();
        Lagrangian::new(scene, &particles, &u, &torus(), Leapfrog::new())
    })
}

#[test]
fn saved_run_of_another_shape_is_refused() -> Result<()> {
    let particles = Particles::lattice([0.0; 2], [1.0; 2], [6; 2])?;
    let scene = AdvectionDiffusion::<2>::new().advection(Steady(swirl), Carried);
    let mut run = Lagrangian::new(scene, &particles, &[1.0; 36], &torus(), Rk4::new())?;
    run.step(0.1)?;
    let before = picture(&run);
    type Saved = SavedParticles<f64, Rk4<MovingState<2, f64>>>;
    let spoilt: [fn(&mut Saved); 5] = [
        |saved| saved.points.truncate(1),
        |saved| saved.volumes.truncate(1),
        |saved| saved.start.push(1.0),
        |saved| saved.searched_at.push(1.0),
        |saved| saved.volumes[0] = -1.0,
    ];
    for spoil in spoilt {
        let mut saved = run.save();
        spoil(&mut saved);
        assert!(run.resume(saved).is_err());
        assert_eq!(picture(&run), before);
    }
    let saved = run.save();
    run.step(0.1)?;
    run.resume(saved)?;
    // What is known of a step, its limit say, is known again after the next.
    let after = picture(&run);
    assert_eq!((after.0, after.1, after.2, after.3), (before.0, before.1, before.2, before.3));
    let particles = run.particles()?;
    assert_eq!(particles.volumes()?, &Volumes::each(vec![1.0 / 36.0; 36])?);
    Ok(())
}

#[test]
fn mirror_faces_bound_moving_particles() -> Result<()> {
    // v vanishes at the walls; behind them is the same again, so nothing diffuses through.
    const NU: f64 = 0.05;
    let walls = Domain::new([0.0], [1.0], [[Face::MirrorEven; 2]])?;
    let particles = Particles::lattice([0.0], [1.0], [64])?;
    let pi = std::f64::consts::PI;
    let u: Vec<f64> = particles.points().iter().map(|x| (pi * x[0]).cos()).collect();
    let pse = Pse::new(Laplacian::<1>, 2, particles.spacing()?.epsilon(1.5)?, particles.volumes()?)?;
    let scene = AdvectionDiffusion::<1>::new().diffusion(NU, pse.clone());
    let mut still = Lagrangian::new(scene, &particles, &u, &walls, Rk4::new())?;
    still.advance(0.5, 1e-3)?;
    let decay = (-NU * pi * pi * 0.5).exp();
    let worst = still.values().zip(&u).map(|(u, start)| (u - decay * start).abs()).fold(0.0, f64::max);
    assert!(worst < 1e-3, "{worst}");
    assert!(still.ledger().fields[0].drift.abs() < 1e-13);

    let scene = AdvectionDiffusion::<1>::new()
        .diffusion(NU, pse.allow(Allowance::Everywhere))
        .advection(Steady(move |x: &[f64; 1]| [0.2 * (pi * x[0]).sin()]), Carried)
        .computed_divergence();
    let mut moved = Lagrangian::new(scene, &particles, &vec![1.0; 64], &walls, Rk4::new())?;
    moved.advance(0.3, 1e-3)?;
    let row = moved.ledger();
    // Mass goes to the right wall and stays inside.
    assert!(row.fields[0].drift.abs() < 1e-6 && row.fields[0].first[0] > 0.51, "{row:?}");
    let out = Steady(|_: &[f64; 1]| [0.2]);
    let scene = AdvectionDiffusion::<1>::new().advection(out, Carried);
    let mut run = Lagrangian::new(scene, &particles, &u, &walls, Rk4::new())?;
    let error = run.advance(1.0, 0.01).unwrap_err();
    assert_eq!((error.particle(), run.points()[63][0] <= 1.0), (Some(63), true));
    Ok(())
}

#[test]
fn fields_of_either_precision_move_alike() -> Result<()> {
    let particles = Particles::jittered([0.0; 2], [1.0; 2], [12; 2], 0.2, 11)?;
    let wave = |x: &[f64; 2]| (TAU * x[0]).sin();
    let pse = || loose(&particles, 1.0);
    let steady = Steady(swirl);
    let one: Vec<f64> = particles.points().iter().map(wave).collect();
    let scene = AdvectionDiffusion::<2>::new().diffusion(0.01, pse()).advection(steady, Carried);
    let mut one = Lagrangian::new(scene, &particles, &one, &torus(), Rk4::new())?;
    let two: Vec<[f32; 2]> = particles.points().iter().map(|x| [wave(x) as f32, -2.0 * wave(x) as f32]).collect();
    let scene =
        AdvectionDiffusion::<2>::new().fields::<[f32; 2]>().diffusion(0.01, pse()).advection(Steady(swirl), Carried);
    let mut two = Lagrangian::new(scene, &particles, &two, &torus(), Rk4::new())?;
    one.advance(0.1, 0.005)?;
    two.advance(0.1, 0.005)?;
    // 20 steps of sums of some 20 terms, in eps of f32.
    let limit = 20.0 * 20.0 * f64::from(f32::EPSILON);
    for (one, [same, twice]) in one.values().zip(two.values()) {
        assert!((f64::from(same) - one).abs() < limit && (f64::from(twice) + 2.0 * one).abs() < 2.0 * limit);
    }
    Ok(())
}
