//! Eulerian runs that fail: one typed error with its numbers, and everything as it was; and what the policies allow.

use std::f64::consts::TAU;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicUsize, Ordering};

use parops::{
    AdvectionDiffusion, ApplyError, Boundary, BoundaryCondition, BoundaryError, CellList, DcPse, Domain, ErrorKind,
    Euler, Eulerian, Gradient, GrowthPolicy, ImplicitScheme, Laplacian, Leapfrog, Ledger, Limit, Mean, Nearest,
    Particles, Pse, Result, Rk4, Rkl2, SolverError, StepPolicy, TimeError, testing::Promise,
};

fn set(n: usize) -> Result<(Particles<2>, Nearest<2>)> {
    let particles = Particles::jittered([0.0; 2], [1.0; 2], [n; 2], 0.2, 2)?;
    let neighbors = Nearest::build(&particles, &Domain::periodic([0.0; 2], [1.0; 2])?, 20)?;
    Ok((particles, neighbors))
}

fn laplacian() -> DcPse<Laplacian<2>, 2> {
    DcPse::new()
}

type Diffusing = AdvectionDiffusion<2, f64, (parops::Diffusion<f64, DcPse<Laplacian<2>, 2>>, (), (), ())>;

fn diffusion(d: f64) -> Diffusing {
    AdvectionDiffusion::new().diffusion(d, laplacian())
}

fn wave(particles: &Particles<2>) -> Vec<f64> {
    particles.points().iter().map(|x| (6.3 * x[0]).sin() + x[1]).collect()
}

fn bits(u: &[f64]) -> Vec<u64> {
    u.iter().map(|u| u.to_bits()).collect()
}

#[test]
fn a_source_that_is_no_number_names_particle_stage_and_time() -> Result<()> {
    const DT: f64 = 1.0 / 1024.0;
    let (particles, neighbors) = set(10)?;
    let bad = particles.points()[37];
    for (steps, from, stage, t) in [(0, 0.0, 1, 0.0), (4, 4.25 * DT, 2, 4.5 * DT), (4, 4.75 * DT, 4, 5.0 * DT)] {
        let source = move |x: &[f64; 2], t: f64, u: f64| if *x == bad && t >= from { f64::NAN } else { -u };
        let mut run = Eulerian::new(diffusion(0.01).source(source), &particles, &neighbors, Rk4::new())?;
        let mut u = wave(&particles);
        for _ in 0..steps {
            run.step(&mut u, DT)?;
        }
        let (before, ledger) = (bits(&u), run.ledger().clone());
        let error = run.step(&mut u, DT).err().unwrap();
        assert_eq!(*error.kind(), ErrorKind::Time(TimeError::NotFinite { stage, t }), "{error}");
        assert_eq!((error.particle(), bits(&u)), (Some(37), before));
        assert_eq!((run.time(), run.ledger()), (f64::from(steps) * DT, &ledger));
    }
    Ok(())
}

#[test]
fn a_panic_in_a_function_of_the_scene_leaves_the_field_and_the_run() -> Result<()> {
    let (particles, neighbors) = set(10)?;
    let left = AtomicUsize::new(usize::MAX);
    let source = |_: &[f64; 2], _: f64, u: f64| {
        if left.fetch_sub(1, Ordering::Relaxed) == 0 {
            panic!("the caller's own");
        }
        -u
    };
    // In every stage of a step that is cut into substeps, too.
    for (policy, dt) in [(StepPolicy::Refuse, 1e-3), (StepPolicy::Adapt { most: 50 }, 0.5)] {
        left.store(usize::MAX, Ordering::Relaxed);
        let mut run =
            Eulerian::new(diffusion(0.05).source(source), &particles, &neighbors, Rk4::new())?.step_policy(policy);
        let mut u = wave(&particles);
        run.step(&mut u, dt)?;
        let (before, t) = (bits(&u), run.time());
        // Two values a particle for the limit, then four stages; the last is in the second substep where there is one.
        for after in [0, 250, 350, if policy == StepPolicy::Refuse { 599 } else { 910 }] {
            left.store(after, Ordering::Relaxed);
            assert!(catch_unwind(AssertUnwindSafe(|| run.step(&mut u, dt).map(|_| ()))).is_err());
            assert_eq!((bits(&u), run.time()), (before.clone(), t));
        }
        left.store(usize::MAX, Ordering::Relaxed);
        run.step(&mut u, dt)?;
        let mut again =
            Eulerian::new(diffusion(0.05).source(source), &particles, &neighbors, Rk4::new())?.step_policy(policy);
        let mut v = wave(&particles);
        again.step(&mut v, dt)?;
        again.step(&mut v, dt)?;
        assert_eq!(bits(&u), bits(&v));
    }
    Ok(())
}

#[test]
fn illegal_steps_and_fields_are_refused() -> Result<()> {
    let (particles, neighbors) = set(10)?;
    let mut run = Eulerian::new(diffusion(0.01), &particles, &neighbors, Rk4::new())?;
    let mut u = wave(&particles);
    let before = bits(&u);
    for dt in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let error = run.step(&mut u, dt).err().unwrap();
        let step = matches!(error.kind(), ErrorKind::Time(TimeError::Step { .. }));
        Promise::new("Input", "steps that are not positive numbers are refused").case(error).holds(step);
    }
    assert!(run.advance(&mut u, -1.0, 0.1).is_err());
    let mut short = vec![1.0; 99];
    let error = run.step(&mut short, 1e-3).err().unwrap();
    assert_eq!(*error.kind(), ErrorKind::Time(TimeError::Shape { found: 99, needed: 100 }));
    let mut broken = u.clone();
    broken[5] = f64::INFINITY;
    let error = run.step(&mut broken, 1e-3).err().unwrap();
    assert_eq!((error.particle(), broken[5]), (Some(5), f64::INFINITY));
    Promise::new("Input", "refused steps leave field, time and ledger as they were")
        .equal(&(bits(&u), run.time(), run.ledger().step), &(before, 0.0, 0));

    let other = Particles::jittered([0.0; 2], [1.0; 2], [10; 2], 0.2, 9)?;
    let error = Eulerian::new(diffusion(0.01), &other, &neighbors, Rk4::new()).err().unwrap();
    assert!(matches!(error.kind(), ErrorKind::Apply(ApplyError::Stale { .. })), "{error}");
    let fewer = Particles::jittered([0.0; 2], [1.0; 2], [9; 2], 0.2, 9)?;
    let error = Eulerian::new(diffusion(0.01), &fewer, &neighbors, Rk4::new()).err().unwrap();
    assert_eq!(*error.kind(), ErrorKind::Solver(SolverError::Targets { targets: 100, particles: 81 }));

    let gust = |x: &[f64; 2], t: f64| [if t > 0.0 && x[0] > 0.5 { f64::NAN } else { 0.0 }, 0.0];
    let scene = diffusion(0.01).advection(gust, DcPse::<Gradient<2>, 2>::new());
    let mut run = Eulerian::new(scene, &particles, &neighbors, Rk4::new())?.at(0.5);
    let error = run.step(&mut u, 1e-3).err().unwrap();
    let first = particles.points().iter().position(|x| x[0] > 0.5);
    assert!(matches!(error.kind(), ErrorKind::Solver(SolverError::Velocity { axis: 0, t: 0.5, .. })), "{error}");
    assert_eq!(error.particle(), first);

    let walls = Boundary::new(2).conditions([3, 4].map(BoundaryCondition::dirichlet)).inflow([(4, [1.0, 0.0])]);
    let scene = diffusion(0.01).boundary(walls, |_, _, _| 0.0);
    let error = Eulerian::new(scene, &particles, &neighbors, Rk4::new()).err().unwrap();
    assert_eq!(*error.kind(), ErrorKind::Boundary(BoundaryError::Repeated { first: 1, second: 2 }));
    Ok(())
}

#[test]
fn steps_above_the_limit_are_refused_cut_or_taken_as_the_policy_says() -> Result<()> {
    let (particles, neighbors) = set(12)?;
    let start = |policy| -> Result<_> {
        Ok(Eulerian::new(diffusion(0.05), &particles, &neighbors, Euler::new())?.step_policy(policy))
    };
    let mut u = wave(&particles);
    let before = bits(&u);
    let limit = start(StepPolicy::Refuse)?.limits(&u)?.step(&Euler::<Vec<f64>>::new());
    let dt = 4.5 * limit;

    let error = start(StepPolicy::Refuse)?.step(&mut u, dt).err().unwrap();
    assert_eq!(*error.kind(), ErrorKind::Solver(SolverError::Limit { dt, limit, binding: Limit::Diffusion }));
    let error = start(StepPolicy::Adapt { most: 4 })?.step(&mut u, dt).err().unwrap();
    let binding = Limit::Diffusion;
    assert_eq!(*error.kind(), ErrorKind::Solver(SolverError::Substeps { dt, limit, binding, most: 4 }));
    assert_eq!(bits(&u), before);

    let mut run = start(StepPolicy::Adapt { most: 5 })?;
    let row = run.step(&mut u, dt)?;
    assert_eq!((row.substeps, row.retries, row.within_limit, row.binding), (5, 4, true, Some(binding)));
    let mut by_hand = wave(&particles);
    let mut hand = start(StepPolicy::Refuse)?;
    hand.advance(&mut by_hand, dt, dt / 5.0)?;
    let apart = u.iter().zip(&by_hand).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    // Times differ by rounding, the steps are the same five.
    assert!(apart < 1e-12 && hand.ledger().step == 5 && hand.ledger().retries == 0, "{apart}");

    // What is exactly legal in so many parts takes no more of them, wherever the clock stands.
    for t in [0.0, 0.3, 1000.0] {
        for most in 2..60 {
            let (mut run, mut u) = (start(StepPolicy::Adapt { most })?.at(t), wave(&particles));
            assert_eq!(run.step(&mut u, f64::from(most) * limit)?.substeps, most, "from {t}");
        }
    }

    let mut run = start(StepPolicy::Allow)?;
    for _ in 0..60 {
        run.step(&mut u, dt)?;
    }
    assert!(!run.ledger().within_limit && u.iter().any(|u| u.abs() > 1e3));
    Ok(())
}

#[test]
fn schemes_that_suit_no_term_are_refused_at_once() -> Result<()> {
    let (particles, neighbors) = set(10)?;
    let error = Eulerian::new(diffusion(0.1), &particles, &neighbors, Leapfrog::new()).err().unwrap();
    assert!(matches!(error.kind(), ErrorKind::Solver(SolverError::Unstable { term: Limit::Diffusion, .. })), "{error}");
    // Super time stepping bears nothing that oscillates; rows of DC-PSE need a slope to count on.
    let scene = diffusion(0.1).advection([1.0, 0.0], DcPse::<Gradient<2>, 2>::new());
    let error = Eulerian::new(scene, &particles, &neighbors, Rkl2::new(8)?.with_slope(0.2)?).err().unwrap();
    assert!(matches!(error.kind(), ErrorKind::Solver(SolverError::Unstable { term: Limit::Advection, .. })), "{error}");
    assert!(Eulerian::new(diffusion(0.1), &particles, &neighbors, Rkl2::new(40)?.with_slope(0.2)?).is_ok());
    let error = Eulerian::new(diffusion(0.1), &particles, &neighbors, Rkl2::new(2)?).err().unwrap();
    assert!(matches!(error.kind(), ErrorKind::Time(TimeError::Slope { slope: 0.0, .. })), "{error}");
    let lattice = Particles::lattice([0.0; 2], [1.0; 2], [24; 2])?;
    let pse = Pse::new(Laplacian::<2>, 2, lattice.spacing()?.epsilon(1.5)?, lattice.volumes()?)?;
    let near = CellList::build(&lattice, &Domain::periodic([0.0; 2], [1.0; 2])?, pse.cutoff())?;
    let scene = || AdvectionDiffusion::<2>::new().diffusion(0.1, pse.clone());
    assert!(Eulerian::new(scene(), &lattice, &near, Rkl2::new(200)?).is_ok());
    Ok(())
}

#[test]
fn jumps_of_the_diffusivity_want_the_harmonic_mean_above_order_2() -> Result<()> {
    let particles = Particles::jittered([0.0; 2], [1.0; 2], [14; 2], 0.2, 2)?;
    let neighbors = Nearest::build(&particles, &Domain::periodic([0.0; 2], [1.0; 2])?, 44)?;
    let jump = |x: &[f64; 2]| if (x[0] - 0.5).abs() < 0.25 { 1e6 } else { 1.0 };
    let scene = || AdvectionDiffusion::<2>::new().diffusion(jump, DcPse::<Laplacian<2>, 4>::new());
    let error = Eulerian::new(scene(), &particles, &neighbors, ImplicitScheme::euler()).err().unwrap();
    assert_eq!(*error.kind(), ErrorKind::Solver(SolverError::Contrast { contrast: 1e6 }));
    assert!(error.particle().is_some());
    let scene = AdvectionDiffusion::<2>::new().diffusion(jump, laplacian()).mean(Mean::Harmonic);
    let mut run = Eulerian::new(scene, &particles, &neighbors, ImplicitScheme::euler())?;
    let mut u = wave(&particles);
    let (low, high) = u.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), u| (a.min(*u), b.max(*u)));
    // A diffusion number of 10^6: how many explicit steps each of these would take.
    let dt = 1e6 * run.limits(&u)?.step(&Euler::<Vec<f64>>::new());
    assert!((run.limits(&u)?.steps(dt, &Euler::<Vec<f64>>::new()) / 1e6 - 1.0).abs() < 1e-5);
    for _ in 0..5 {
        let row = run.step(&mut u, dt)?;
        assert!(row.within_limit && row.limit.is_infinite() && row.binding.is_none());
    }
    assert!(u.iter().all(|u| *u > low - 0.1 && *u < high + 0.1));
    Ok(())
}

#[test]
fn growing_modes_are_refused_unless_allowed_and_then_recorded() -> Result<()> {
    // Central DC-PSE on scattered particles, without diffusion: some modes grow with every step.
    let particles = Particles::jittered([0.0; 2], [1.0; 2], [16; 2], 0.3, 2)?;
    let neighbors = Nearest::build(&particles, &Domain::periodic([0.0; 2], [1.0; 2])?, 14)?;
    let gradient = || DcPse::<Gradient<2>, 2>::new().sign(parops::Sign::Minus);
    let scene = || AdvectionDiffusion::<2>::new().advection([1.0, 0.0], gradient());
    let error = Eulerian::new(scene(), &particles, &neighbors, Rk4::new()).err().unwrap();
    let ErrorKind::Solver(SolverError::Growing { rate, radius, limit }) = *error.kind() else { panic!("{error}") };
    // Max Re(lambda) h from 0.14 to 0.22 with 14 neighbors at jitter 0.3.
    assert!(rate / 16.0 > 0.1 && rate / 16.0 < 0.3 && rate > limit * radius, "{rate} {radius}");

    let steps = StepPolicy::Refuse;
    let mut run = Eulerian::with_policy(scene(), &particles, &neighbors, Rk4::new(), steps, GrowthPolicy::Allow)?;
    let mut u: Vec<f64> = (0..particles.len()).map(|p| f64::from(u8::from(p == 100))).collect();
    // Short enough that RK4 damps nothing of a mode that oscillates.
    let dt = 0.1 * run.limits(&u)?.step(&Rk4::<Vec<f64>>::new());
    let size = |u: &[f64]| u.iter().map(|u| u * u).sum::<f64>().sqrt();
    let mut ledger = Ledger::default();
    run.advance_with(&mut u, 1.0, dt, |row, _| ledger.push(row))?;
    // Until the fastest mode has left the others behind.
    run.advance(&mut u, 20.0, dt)?;
    let early = size(&u);
    run.advance(&mut u, 24.0, dt)?;
    let observed = (size(&u) / early).ln() / 4.0;
    assert!((observed / rate - 1.0).abs() < 0.1, "{observed} {rate}");
    assert!((run.ledger().growth / rate - 1.0).abs() < 1e-6 && ledger.rows().iter().all(|row| row.growth > 0.0));

    let unknown = GrowthPolicy::Unknown;
    let run = Eulerian::with_policy(scene(), &particles, &neighbors, Rk4::new(), steps, unknown)?;
    assert!(run.ledger().growth.is_nan());
    Ok(())
}

#[test]
fn stepper_remembers_through_a_step_of_its_own_that_fails() -> Result<()> {
    let ring = Particles::lattice([0.0], [1.0], [40])?;
    let neighbors = Nearest::build(&ring, &Domain::periodic([0.0], [1.0])?, 6)?;
    let start: Vec<f64> = ring.points().iter().map(|x| (TAU * x[0]).sin()).collect();
    // In place, and on trial since a budget is held. The source is no number when it is asked for so many times late.
    for budget in [f64::INFINITY, 1e9] {
        let run = |wrong: usize| {
            let calls = AtomicUsize::new(0);
            let scene = AdvectionDiffusion::<1>::new().advection([1.0], DcPse::<Gradient<1>, 2>::new()).source(
                move |_: &[f64; 1], t: f64, _: f64| {
                    let now = t > 0.095 && calls.fetch_add(1, Ordering::Relaxed) == wrong;
                    if now { f64::NAN } else { t.cos() }
                },
            );
            let (allow, growth) = (StepPolicy::Allow, GrowthPolicy::Allow);
            let mut run = Eulerian::with_policy(scene, &ring, &neighbors, Leapfrog::new(), allow, growth)?;
            if budget.is_finite() {
                run = run.drift_budget(budget)?;
            }
            let (mut u, mut failed) = (start.clone(), 0);
            while run.ledger().step < 20 {
                failed += usize::from(run.step(&mut u, 0.01).is_err());
            }
            Ok::<_, parops::Error>((u, failed))
        };
        let ((u, none), mut once) = (run(usize::MAX)?, 0);
        assert_eq!(none, 0);
        for wrong in (0..1000).step_by(37) {
            let (again, failed) = run(wrong)?;
            assert!(u.iter().zip(&again).all(|(a, b)| a.to_bits() == b.to_bits()), "{budget}, {wrong}");
            once += failed;
        }
        assert!(once > 8, "{once} steps failed");
    }
    Ok(())
}
