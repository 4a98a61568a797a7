//! Steppers, plans and runs: orders, start-up, states of every kind, and bad input.

use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind};

use crate::cases::cases;
use crate::properties::properties;
use nalgebra::{Complex, DVector, SVector, Vector3};
use parops::{
    Apply, CellList, Domain, Epsilon, Error, ErrorKind, Euler, Exponential, Laplacian, Leapfrog, ParticleError,
    Particles, Plan, Policy, Pse, Result, Rk4, Rkl2, SspRk3, State, StepLimit, Stepper, TimeError, integrate,
    testing::Promise,
};
use proptest::prelude::*;

fn kind(error: Error) -> ErrorKind {
    error.kind().clone()
}

/// One of every stepper.
fn steppers<S: State + 'static>() -> [Box<dyn Stepper<S>>; 6] {
    [
        Box::new(Euler::new()),
        Box::new(Rk4::new()),
        Box::new(Leapfrog::new()),
        Box::new(SspRk3::new()),
        Box::new(Rkl2::new(4).unwrap()),
        Box::new(Rkl2::new(2).unwrap().with_substeps(2)),
    ]
}

/// z' = i z as two entries.
fn rotate(_: f64, u: &[f64; 2], du: &mut [f64; 2]) -> Result<()> {
    *du = [-u[1], u[0]];
    Ok(())
}

/// |z(T) - exp(i T)| after n steps of z' = i z from `u`.
fn rotation_error<S: Stepper<[f64; 2]> + ?Sized>(stepper: &mut S, end: f64, n: u32) -> f64 {
    let mut u = [1.0, 0.0];
    integrate(stepper, &mut u, &Plan::new(0.0, end, end / f64::from(n)).unwrap(), rotate, |_, _, _| {}).unwrap();
    (u[0] - end.cos()).hypot(u[1] - end.sin())
}

#[test]
fn leapfrog_started_by_euler_has_the_reference_errors_of_order_two() {
    // Errata 53, to the digits of the log of its check.
    const DIGITS: f64 = 1e-12;
    let reference = [(100, 0.0191504637634472), (200, 0.004760645951750199), (400, 0.0011884802231654293)];
    for (n, expected) in reference {
        let error = rotation_error(&mut Leapfrog::new(), 10.0, n);
        let leapfrog = Promise::new("Orders", "errors of leapfrog started by Euler against the reference");
        leapfrog.at_most(DIGITS, (error - expected).abs());
    }
}

#[test]
fn leapfrog_grows_linearly_at_its_limit() {
    // Errata 53: the double root grows linearly, whatever the start that excites it.
    let growth = |n: u32| {
        let mut leapfrog = Leapfrog::new();
        let mut u = [1.0, 0.0];
        for step in 0..n {
            leapfrog.step(f64::from(step), 1.0, &mut u, &mut rotate).unwrap();
        }
        u[0].hypot(u[1])
    };
    let (tenth, whole) = (growth(100), growth(1000));
    assert!(tenth > 10.0 && (whole / tenth - 10.0).abs() < 0.2, "{tenth} {whole}");
}

#[test]
fn leapfrog_grows_on_decay_at_any_step() {
    // The parasitic root is -x - sqrt(1 + x^2), x = |lambda| dt.
    let (mut leapfrog, mut u) = (Leapfrog::new(), 1.0_f64);
    for n in 0..400 {
        let decay = &mut |_: f64, u: &f64, du: &mut f64| {
            *du = -u;
            Ok(())
        };
        leapfrog.step(0.1 * f64::from(n), 0.1, &mut u, decay).unwrap();
    }
    assert!(u.abs() > 1e10, "{u}");
}

#[test]
fn leapfrog_starts_anew_when_dt_changes_and_after_reset() {
    let euler = |u: [f64; 2], dt: f64| [u[0] - dt * u[1], u[1] + dt * u[0]];
    let (mut leapfrog, mut u) = (Leapfrog::new(), [1.0, 0.0]);
    leapfrog.step(0.0, 0.1, &mut u, &mut rotate).unwrap();
    assert_eq!(u, euler([1.0, 0.0], 0.1));
    let before = u;
    leapfrog.step(0.1, 0.1, &mut u, &mut rotate).unwrap();
    assert_eq!(u, [1.0 - 0.2 * before[1], 0.2 * before[0]]);

    let before = u;
    leapfrog.step(0.2, 0.05, &mut u, &mut rotate).unwrap();
    assert_eq!(u, euler(before, 0.05));
    let before = u;
    leapfrog.step(7.0, 0.05, &mut u, &mut rotate).unwrap();
    assert_eq!(u, euler(before, 0.05));
    let before = u;
    leapfrog.reset();
    leapfrog.step(7.05, 0.05, &mut u, &mut rotate).unwrap();
    assert_eq!(u, euler(before, 0.05));
}

type Numbers = Vec<f64>;

/// u_0' = -u_0^2 cos t, u_1' = u_1 (1 - u_1), u_2' = u_0 cos t: coupled, nonlinear, time-dependent.
fn nonlinear(t: f64, u: &Numbers, du: &mut Numbers) -> Result<()> {
    du[0] = -u[0] * u[0] * t.cos();
    du[1] = u[1] * (1.0 - u[1]);
    du[2] = u[0] * t.cos();
    Ok(())
}

#[test]
fn every_stepper_has_its_order_and_no_higher() {
    /// The next term of the error is below this at the steps taken.
    const SLACK: f64 = 0.1;
    for mut stepper in steppers::<Vec<f64>>() {
        let mut error = |n: u32| {
            let mut u = vec![1.0, 0.2, 0.0];
            let plan = Plan::new(0.0, 2.0, 2.0 / f64::from(n)).unwrap();
            integrate(&mut stepper, &mut u, &plan, nonlinear, |_, _, _| {}).unwrap();
            let sine = 1.0 + 2.0_f64.sin();
            let exact = [1.0 / sine, 1.0 / (1.0 + 4.0 * (-2.0_f64).exp()), sine.ln()];
            u.iter().zip(exact).map(|(u, exact)| (u - exact).abs()).fold(0.0, f64::max)
        };
        let observed = (error(160) / error(320)).log2();
        let stated = f64::from(stepper.order());
        let promise = Promise::new("Orders", "explicit steppers, order less the stated one");
        promise.within(-SLACK, SLACK, observed - stated);
    }
}

#[test]
fn single_precision_runs_follow_double_precision_to_their_rounding() {
    // n steps of four roundings each of values near 1, half of them assumed to cancel.
    const STEPS: u32 = 64;
    const TOLERANCE: f64 = 2.0 * STEPS as f64 * f32::EPSILON as f64;
    for (mut single, mut double) in steppers::<Vec<[f32; 2]>>().into_iter().zip(steppers::<Vec<[f64; 2]>>()) {
        let plan = Plan::new(0.0, 1.0, 1.0 / f64::from(STEPS)).unwrap();
        let (mut u, mut v) = (vec![[1.0_f32, 0.5]; 3], vec![[1.0_f64, 0.5]; 3]);
        let f = |_: f64, u: &Vec<[f32; 2]>, du: &mut Vec<[f32; 2]>| {
            du.iter_mut().zip(u).for_each(|(du, u)| *du = [-u[1], u[0]]);
            Ok(())
        };
        let g = |_: f64, u: &Vec<[f64; 2]>, du: &mut Vec<[f64; 2]>| {
            du.iter_mut().zip(u).for_each(|(du, u)| *du = [-u[1], u[0]]);
            Ok(())
        };
        integrate(&mut single, &mut u, &plan, f, |_, _, _| {}).unwrap();
        integrate(&mut double, &mut v, &plan, g, |_, _, _| {}).unwrap();
        for (u, v) in u.iter().zip(&v) {
            for (u, v) in u.iter().zip(v) {
                let difference = (f64::from(*u) - v).abs();
                assert!(difference < TOLERANCE, "{difference:e}");
            }
        }
    }
}

/// The state after ten steps of u' = -u + t, entry by entry alike.
fn ten_steps<S: State + 'static>(start: S, rhs: impl Fn(f64, &S, &mut S) + Copy) -> [S; 6] {
    let plan = Plan::new(0.0, 1.0, 0.1).unwrap();
    steppers::<S>().map(|mut stepper| {
        let mut u = start.clone();
        let f = |t: f64, u: &S, du: &mut S| {
            rhs(t, u, du);
            Ok(())
        };
        integrate(&mut stepper, &mut u, &plan, f, |_, _, _| {}).unwrap();
        u
    })
}

#[test]
fn states_of_every_kind_move_alike() {
    let scalar = ten_steps(0.7, |t, u, du| *du = t - u);
    let vector = ten_steps(vec![0.7; 3], |t, u, du| du.iter_mut().zip(u).for_each(|(du, u)| *du = t - u));
    let array = ten_steps([0.7; 3], |t, u, du| *du = u.map(|u| t - u));
    let fixed = ten_steps(Vector3::repeat(0.7), |t, u, du| *du = u.map(|u| t - u));
    let dynamic = ten_steps(DVector::repeat(3, 0.7), |t, u, du| du.zip_apply(u, |du, u| *du = t - u));
    let points = ten_steps(vec![SVector::repeat(0.7); 2], |t, u: &Vec<SVector<f64, 2>>, du| {
        du.iter_mut().zip(u).for_each(|(du, u)| *du = u.map(|u| t - u));
    });
    let pair = ten_steps((vec![[0.7; 2]; 2], vec![0.7]), |t, u, du| {
        du.0.iter_mut().zip(&u.0).for_each(|(du, u)| *du = u.map(|u| t - u));
        du.1.iter_mut().zip(&u.1).for_each(|(du, u)| *du = t - u);
    });
    for (i, &x) in scalar.iter().enumerate() {
        assert_eq!((vector[i].as_slice(), array[i]), (&[x; 3][..], [x; 3]));
        assert_eq!((fixed[i], dynamic[i].as_slice()), (Vector3::repeat(x), &[x; 3][..]));
        assert_eq!((&points[i], &pair[i]), (&vec![SVector::repeat(x); 2], &(vec![[x; 2]; 2], vec![x])));
    }
}

#[test]
fn first_non_finite_names_the_particle_wherever_it_is() {
    for n in [1, 255, 256, 257, 1000] {
        for p in [0, n / 2, n - 1] {
            let mut u = vec![[1.0_f32; 3]; n];
            assert_eq!(u.first_non_finite(), None);
            u[p][2] = f32::INFINITY;
            assert_eq!(u.first_non_finite(), Some(p));
            assert_eq!((vec![0.0; n], u).first_non_finite(), Some(p));
        }
    }
}

/// The largest modulus of the amplification factors on u' = lambda u, from the definition of the schemes.
fn amplification(stepper: usize, z: Complex<f64>) -> f64 {
    match stepper {
        0 => (z + 1.0).norm(),
        1 => ((((z / 4.0 + 1.0) * z / 3.0 + 1.0) * z / 2.0 + 1.0) * z + 1.0).norm(),
        2 => {
            let root = (z * z + 1.0).sqrt();
            (z + root).norm().max((z - root).norm())
        }
        3 => (((z / 3.0 + 1.0) * z / 2.0 + 1.0) * z + 1.0).norm(),
        // 1 - b + b P_4(x), b = 9/20, and twice 1 - b + b P_2(x), b = 1/3.
        4 => {
            let square = (z * 2.0 / 9.0 + 1.0) * (z * 2.0 / 9.0 + 1.0);
            (((square * 35.0 - 30.0) * square + 3.0) / 8.0 * 0.45 + 0.55).norm()
        }
        _ => ((z / 4.0 + 1.0) * z / 2.0 + 1.0).norm_sqr(),
    }
}

#[test]
fn growth_per_step_on_complex_lambda_is_the_amplification_factor() {
    // Over n steps the other root of leapfrog, and the part of each root in the start, are a constant: its n-th root.
    const STEPS: u32 = 400;
    const TOLERANCE: f64 = 0.02;
    for (which, re, im) in (0..6).flat_map(|which| {
        let axis = [-2.9, -2.5, -1.5, -0.6, -0.1];
        axis.into_iter().flat_map(move |re| [0.0, 0.4, 1.2, 2.6].map(|im| (which, re, im)))
    }) {
        let mut stepper = steppers::<[f64; 2]>().into_iter().nth(which).unwrap();
        let mut u = [1.0, 0.0];
        let mut growth = 0.0;
        for n in 0..STEPS {
            let rhs = &mut |_: f64, u: &[f64; 2], du: &mut [f64; 2]| {
                *du = [re * u[0] - im * u[1], re * u[1] + im * u[0]];
                Ok(())
            };
            stepper.step(f64::from(n), 1.0, &mut u, rhs).unwrap();
            // A leapfrog step uses two states: it is scaled by starting anew only where one step says it all.
            if which != 2 {
                let norm = u[0].hypot(u[1]);
                growth += norm.ln();
                u = u.map(|x| x / norm);
            } else {
                growth = u[0].hypot(u[1]).ln();
            }
            if growth.abs() > 300.0 && which == 2 {
                growth *= f64::from(STEPS) / f64::from(n + 1);
                break;
            }
        }
        let expected = amplification(which, Complex::new(re, im)).ln();
        assert!((growth / f64::from(STEPS) - expected).abs() < TOLERANCE, "{which} {re}+{im}i: {expected}");
    }
}

#[test]
fn illegal_steps_are_refused_by_every_stepper() {
    for mut stepper in steppers::<Vec<f64>>() {
        let mut u = vec![1.0, 2.0];
        let mut step = |t, dt| {
            let rhs = &mut |_: f64, _: &Vec<f64>, _: &mut Vec<f64>| panic!("refused before the first evaluation");
            kind(stepper.step(t, dt, &mut u, rhs).unwrap_err())
        };
        for dt in [0.0, -0.1, f64::INFINITY] {
            assert_eq!(step(0.0, dt), ErrorKind::Time(TimeError::Step { dt }));
        }
        assert!(matches!(step(0.0, f64::NAN), ErrorKind::Time(TimeError::Step { dt }) if dt.is_nan()));
        assert_eq!(step(1e9, 1e-8), ErrorKind::Time(TimeError::NoProgress { t: 1e9, dt: 1e-8 }));
        assert!(matches!(step(f64::NAN, 0.1), ErrorKind::Time(TimeError::Span { .. })));
        assert_eq!(u, [1.0, 2.0]);
    }
}

#[test]
fn a_rate_that_is_not_finite_is_reported_with_particle_stage_and_time() {
    for (mut stepper, times) in
        steppers::<Vec<[f64; 2]>>().into_iter().zip([vec![1.0], vec![1.0, 1.25, 1.25, 1.5], vec![1.0]])
    {
        for (evaluation, &t) in times.iter().enumerate() {
            let mut u = vec![[1.0, 2.0]; 5];
            let mut calls = 0;
            let error = stepper
                .step(1.0, 0.5, &mut u, &mut |_, _, du| {
                    du.fill([0.5, -0.5]);
                    if calls == evaluation {
                        du[3][1] = f64::NAN;
                    }
                    calls += 1;
                    Ok(())
                })
                .unwrap_err();
            assert_eq!(error, Error::from(TimeError::NotFinite { stage: evaluation + 1, t }).at(3));
            assert_eq!(u, [[1.0, 2.0]; 5]);
        }
    }
}

#[test]
fn states_that_are_not_finite_before_or_after_a_step_are_reported() {
    let rate = |rate: f64| {
        move |_: f64, _: &Vec<f64>, du: &mut Vec<f64>| {
            du.fill(rate);
            Ok(())
        }
    };
    for (mut stepper, stages) in steppers::<Vec<f64>>().into_iter().zip([1, 4, 1, 3, 4, 4]) {
        let error = stepper.step(0.0, 1.0, &mut vec![0.0, f64::INFINITY], &mut rate(0.0)).unwrap_err();
        assert_eq!(error, Error::from(TimeError::NotFinite { stage: 1, t: 0.0 }).at(1));
        let mut u = vec![1e308, 1.0];
        let error = stepper.step(0.0, 1.0, &mut u, &mut rate(1e308)).unwrap_err();
        assert_eq!(error, Error::from(TimeError::NotFinite { stage: stages + 1, t: 1.0 }).at(0));
        assert_eq!(u, [1e308, 1.0]);
    }
}

#[test]
fn a_right_hand_side_that_changes_the_shape_is_refused() {
    for mut stepper in steppers::<(Vec<f64>, Vec<[f64; 2]>)>() {
        let mut u = (vec![1.0; 3], vec![[1.0; 2]; 3]);
        let error = stepper.step(0.0, 0.1, &mut u, &mut |_, _, du| {
            du.1.pop();
            Ok(())
        });
        assert_eq!(kind(error.unwrap_err()), ErrorKind::Time(TimeError::Shape { found: 2, needed: 3 }));
        assert_eq!(u, (vec![1.0; 3], vec![[1.0; 2]; 3]));
    }
}

#[test]
fn a_closure_that_panics_leaves_state_and_stepper_usable() {
    for (mut stepper, mut fresh) in steppers::<Vec<f64>>().into_iter().zip(steppers::<Vec<f64>>()) {
        let (mut u, mut v) = (vec![1.0, 0.2, 0.0], vec![1.0, 0.2, 0.0]);
        for n in 0..4 {
            let t = 0.1 * f64::from(n);
            for evaluation in 1..=4 {
                let before = u.clone();
                let mut calls = 0;
                let result = catch_unwind(AssertUnwindSafe(|| {
                    stepper.step(t, 0.1, &mut u, &mut |t, u, du| {
                        calls += 1;
                        if calls == evaluation {
                            std::panic::resume_unwind(Box::new("the caller's panic"));
                        }
                        nonlinear(t, u, du)
                    })
                }));
                if calls < evaluation {
                    // There are fewer evaluations, so this was a step like any other.
                    result.unwrap().unwrap();
                    break;
                }
                assert!(result.is_err());
                assert_eq!(u, before);
                if evaluation == 4 {
                    stepper.step(t, 0.1, &mut u, &mut nonlinear).unwrap();
                }
            }
            fresh.step(t, 0.1, &mut v, &mut nonlinear).unwrap();
            assert_eq!(u, v);
        }
    }
}

#[test]
fn a_failing_run_leaves_the_state_as_it_was_whether_by_error_or_panic() {
    // Whose stages lie at most half a step ahead comes a step farther.
    for (mut stepper, last) in steppers::<Vec<f64>>().into_iter().zip([6, 5, 6, 5, 5, 5]) {
        let plan = Plan::new(0.0, 1.0, 0.1).unwrap();
        let mut u = vec![1.0, 0.2, 0.0];
        let seen = Cell::new(0);
        let rhs = |t: f64, u: &Vec<f64>, du: &mut Vec<f64>| {
            if t > 0.55 { Err(Error::user(7)) } else { nonlinear(t, u, du) }
        };
        let error = integrate(&mut stepper, &mut u, &plan, rhs, |n, _, _| seen.set(n)).unwrap_err();
        assert_eq!((kind(error), seen.get()), (ErrorKind::User { code: 7 }, last));
        assert_eq!(u, [1.0, 0.2, 0.0]);
        let panic = catch_unwind(AssertUnwindSafe(|| {
            integrate(&mut stepper, &mut u, &plan, nonlinear, |n, _, _| {
                if n == 3 {
                    std::panic::resume_unwind(Box::new("the caller's panic"));
                }
            })
        }));
        assert!(panic.is_err());
        assert_eq!(u, [1.0, 0.2, 0.0]);
        integrate(&mut stepper, &mut u, &plan, nonlinear, |_, _, _| {}).unwrap();
    }
}

#[test]
fn a_step_above_the_limit_is_refused_unless_allowed_and_then_reported() {
    let limit = StepLimit::from_spectral_bound(100.0, 1.0).unwrap();
    let plan = Plan::new(0.0, 1.0, 0.1).unwrap().limit(limit);
    let (mut euler, mut u) = (Euler::new(), 1.0);
    let decay = |_: f64, u: &f64, du: &mut f64| {
        *du = -100.0 * u;
        Ok(())
    };
    let refused = integrate(&mut euler, &mut u, &plan, decay, |_, _, _| panic!("no step was taken"));
    assert_eq!(kind(refused.unwrap_err()), ErrorKind::Time(TimeError::Limit { dt: 0.1, limit: 0.02 }));
    assert_eq!(u, 1.0);

    let run = integrate(&mut euler, &mut u, &plan.policy(Policy::Allow), decay, |_, _, _| {}).unwrap();
    assert_eq!((run.within_limit, run.limit, run.steps), (false, 0.02, 10));
    assert!(u.abs() > 1e9);

    u = 1.0;
    let cut = plan.cut_for(&euler).unwrap();
    assert_eq!((cut.steps(), cut.dt()), (50, 0.02));
    assert!(integrate(&mut euler, &mut u, &cut, decay, |_, _, _| {}).unwrap().within_limit);
    assert!(u.abs() <= 1.0);
}

#[test]
fn progress_sees_every_step_and_the_exact_end() {
    let plan = Plan::new(-0.3, 0.4, 0.1).unwrap();
    let mut seen = Vec::new();
    let mut u = 0.0;
    let rhs = |_: f64, _: &f64, du: &mut f64| {
        *du = 1.0;
        Ok(())
    };
    integrate(&mut Rk4::new(), &mut u, &plan, rhs, |n, t, &u| seen.push((n, t, u))).unwrap();
    assert_eq!((plan.steps(), seen.len()), (7, 7));
    assert_eq!(seen[6], (7, 0.4, u));
    let none = Plan::new(2.0, 2.0, 0.1).unwrap();
    let run = integrate(&mut Rk4::new(), &mut u, &none, rhs, |_, _, _| panic!("there is no step")).unwrap();
    assert_eq!(run.steps, 0);
}

#[test]
fn plans_refuse_illegal_spans_and_steps_that_make_no_progress() {
    let plan = |start, end, dt| kind(Plan::new(start, end, dt).unwrap_err());
    for dt in [0.0, -1.0, f64::INFINITY] {
        assert_eq!(plan(0.0, 1.0, dt), ErrorKind::Time(TimeError::Step { dt }));
    }
    assert!(matches!(plan(0.0, 1.0, f64::NAN), ErrorKind::Time(TimeError::Step { .. })));
    for (start, end) in [(1.0, 0.0), (0.0, f64::INFINITY), (-1e308, 1e308)] {
        assert_eq!(plan(start, end, 0.1), ErrorKind::Time(TimeError::Span { start, end }));
    }
    assert!(matches!(plan(f64::NAN, 1.0, 0.1), ErrorKind::Time(TimeError::Span { .. })));
    for (start, end, dt) in [(1e9, 1e9 + 1.0, 1e-8), (-1e9, 0.0, 1e-8), (0.0, 1.0, 1e-300)] {
        assert!(matches!(plan(start, end, dt), ErrorKind::Time(TimeError::NoProgress { .. })));
    }
    let hopeless = Plan::new(1e9, 1e9 + 1.0, 0.5).unwrap().limit(StepLimit::from_step(1e-8).unwrap());
    assert!(matches!(
        kind(hopeless.cut_for(&Euler::<f64>::new()).unwrap_err()),
        ErrorKind::Time(TimeError::NoProgress { .. })
    ));
}

proptest! {
    #![proptest_config(properties(cases()))]

    #[test]
    fn plans_take_the_fewest_steps_that_keep_step_and_limit(
        start in -10.0..10.0, span in 1e-3..10.0, dt in 1e-3..2.0, limit in 1e-3..2.0,
    ) {
        let plan = Plan::new(start, start + span, dt).unwrap();
        let span = plan.end() - plan.start();
        // The quotient that counts the steps is rounded, and forgiven four units of rounding.
        let slack = 1.0 + 8.0 * f64::EPSILON;
        prop_assert!(plan.dt() <= dt * slack);
        prop_assert!(plan.steps() == 1 || span / (plan.steps() - 1) as f64 > dt);
        let cut = plan.limit(StepLimit::from_step(limit).unwrap()).cut_for(&Leapfrog::<f64>::new()).unwrap();
        prop_assert!(cut.dt() <= limit && cut.dt() <= plan.dt());
        let fewer = span / (cut.steps() - 1).max(1) as f64;
        prop_assert!(cut.steps() == 1 || fewer > limit.min(dt) / slack);
        prop_assert_eq!(cut.time(cut.steps()), plan.end());
    }

    #[test]
    fn steps_commute_with_scaling_by_powers_of_two(u in prop::collection::vec(-1.0..1.0_f64, 1..20), exponent in -20..20) {
        let factor = 2.0_f64.powi(exponent);
        for (mut one, mut other) in steppers::<Vec<f64>>().into_iter().zip(steppers::<Vec<f64>>()) {
            let (mut u, mut v) = (u.clone(), u.iter().map(|x| x * factor).collect::<Vec<_>>());
            let mut decay = |_: f64, u: &Vec<f64>, du: &mut Vec<f64>| {
                du.iter_mut().zip(u).for_each(|(du, u)| *du = -u);
                Ok(())
            };
            for n in 0..5 {
                one.step(0.3 * f64::from(n), 0.3, &mut u, &mut decay).unwrap();
                other.step(0.3 * f64::from(n), 0.3, &mut v, &mut decay).unwrap();
            }
            let scaled = u.iter().map(|x| x * factor).collect::<Vec<_>>();
            Promise::new("Metamorphic relations", "M14 steps of states scaled by 2^k").equal(&scaled, &v);
        }
    }
}

/// A diffusion of N particles on a periodic line whose exact decay rates are known.
fn ring(u: &[f64], du: &mut [f64]) -> Result<()> {
    let n = u.len();
    for p in 0..n {
        du[p] = u[(p + 1) % n] + u[(p + n - 1) % n] - 2.0 * u[p];
    }
    Ok(())
}

#[test]
fn exponential_propagates_modes_of_a_ring_exactly() {
    const N: usize = 40;
    // The eigenvectors are orthogonal to N eps, and the exponents are wrong by eps |t| |A| = 4 t eps.
    const TOLERANCE: f64 = (N as f64 + 40.0) * f64::EPSILON;
    let exponential = Exponential::new(N, ring).unwrap();
    assert!((exponential.spectral_radius().unwrap() - 4.0).abs() < TOLERANCE);
    for k in [0, 1, 7, 20] {
        let phase = std::f64::consts::TAU * k as f64 / N as f64;
        let mode = |p: usize| (phase * p as f64).cos();
        let mut u: Vec<f64> = (0..N).map(mode).collect();
        exponential.propagate(10.0, &mut u).unwrap();
        let decay = ((2.0 * phase.cos() - 2.0) * 10.0).exp();
        for (p, u) in u.iter().enumerate() {
            assert!((u - decay * mode(p)).abs() < TOLERANCE, "{k} {p} {u}");
        }
    }
}

#[test]
fn exponential_of_advection_is_a_semigroup_and_its_own_inverse_in_time() {
    // Upwind differences: not symmetric. Each propagation is exact to N eps |t| |A|.
    const N: usize = 12;
    const TOLERANCE: f64 = N as f64 * 12.0 * f64::EPSILON;
    let upwind = |u: &[f64], du: &mut [f64]| {
        (0..N).for_each(|p| du[p] = u[(p + N - 1) % N] - u[p]);
        Ok(())
    };
    let exponential = Exponential::new(N, upwind).unwrap();
    assert_eq!(exponential.spectral_radius(), None);
    let start: Vec<f64> = (0..N).map(|p| (p as f64).sin()).collect();
    let (mut once, mut twice) = (start.clone(), start.clone());
    exponential.propagate(3.0, &mut once).unwrap();
    exponential.propagate(1.0, &mut twice).unwrap();
    exponential.propagate(2.0, &mut twice).unwrap();
    assert!(once.iter().zip(&twice).all(|(a, b)| (a - b).abs() < TOLERANCE));
    // exp(-tA) of a decaying A grows by exp(2 t), and so do errors.
    exponential.propagate(-3.0, &mut once).unwrap();
    assert!(once.iter().zip(&start).all(|(a, b)| (a - b).abs() < TOLERANCE * 6.0_f64.exp()));
    // RK4 converges to it.
    let mut u = start.clone();
    let plan = Plan::new(0.0, 3.0, 1.0 / 64.0).unwrap();
    integrate(&mut Rk4::new(), &mut u, &plan, |_, u: &Vec<f64>, du: &mut Vec<f64>| upwind(u, du), |_, _, _| {})
        .unwrap();
    let mut exact = start;
    exponential.propagate(3.0, &mut exact).unwrap();
    // T/120 dt^4 |A|^5 with |A| = 2.
    let truncation = 3.0 / 120.0 * (1.0_f64 / 64.0).powi(4) * 32.0;
    let error = u.iter().zip(&exact).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(error < truncation && error > truncation / 1e3, "{error:e} {truncation:e}");
}

#[test]
fn exponential_refuses_illegal_matrices_states_and_times() {
    let error = Exponential::new(3, |u, du| {
        du.copy_from_slice(u);
        du[2] /= u[1];
        Ok(())
    });
    assert_eq!(error.unwrap_err(), Error::from(TimeError::NotFinite { stage: 1, t: 0.0 }).at(2));
    assert_eq!(kind(Exponential::new(1, |_, _| Err(Error::user(3))).unwrap_err()), ErrorKind::User { code: 3 });

    // The square of the first wraps to zero; that of the last does not, but its bytes do.
    for size in [1 << 32, usize::MAX, 1 << 31] {
        let refused = Exponential::new(size, |_, _| panic!("memory comes first"));
        let count = size.saturating_mul(size);
        assert_eq!(kind(refused.unwrap_err()), ErrorKind::Particle(ParticleError::Memory { count }));
    }

    let ring = Exponential::new(4, ring).unwrap();
    let refuse = |t, u: &mut [f64]| ring.propagate(t, u).unwrap_err();
    assert_eq!(kind(refuse(1.0, &mut [0.0; 3])), ErrorKind::Time(TimeError::Shape { found: 3, needed: 4 }));
    assert!(matches!(kind(refuse(f64::NAN, &mut [0.0; 4])), ErrorKind::Time(TimeError::Span { .. })));
    let mut u = [0.0, 0.0, f64::NAN, 0.0];
    assert_eq!(refuse(1.0, &mut u), Error::from(TimeError::NotFinite { stage: 1, t: 0.0 }).at(2));
    let mut u = [1.0, 0.0, 0.0, 0.0];
    assert!(matches!(kind(refuse(-1e4, &mut u)), ErrorKind::Time(TimeError::NotFinite { stage: 2, .. })));
    assert_eq!(u, [1.0, 0.0, 0.0, 0.0]);

    let shear = Exponential::new(2, |u, du| {
        du.copy_from_slice(&[u[1], 0.0]);
        Ok(())
    })
    .unwrap();
    assert_eq!(
        kind(shear.propagate(1e7, &mut [1.0; 2]).unwrap_err()),
        ErrorKind::Time(TimeError::Limit { dt: 1e7, limit: 1e6 })
    );
    let mut sheared = [1.0; 2];
    shear.propagate(2.0, &mut sheared).unwrap();
    assert!((sheared[0] - 3.0).abs() < 8.0 * f64::EPSILON && (sheared[1] - 1.0).abs() < 8.0 * f64::EPSILON);
    let zero = Exponential::new(2, |_, _| Ok(())).unwrap();
    zero.propagate(5.0, &mut sheared).unwrap();
    Exponential::new(0, |_, _| Ok(())).unwrap().propagate(1.0, &mut []).unwrap();
}

/// Diffusion on a ring, rows and all: du/dt = D Lap u by RK4, `steps` steps of `dt`.
fn diffuse(u: &[f64], diffusivity: f64, dt: f64, steps: u32) -> Vec<f64> {
    let ring = Particles::jittered([0.0], [1.0], [u.len()], 0.02, 3).unwrap();
    let epsilon = Epsilon::global(2.0 / u.len() as f64).unwrap();
    let pse = Pse::new(Laplacian::<1>, 4, epsilon, ring.volumes().unwrap()).unwrap();
    let domain = Domain::periodic([0.0], [1.0]).unwrap();
    let rows = pse.assemble(&CellList::build(&ring, &domain, pse.cutoff()).unwrap()).unwrap();
    let limit = StepLimit::from_spectral_bound(rows.report().spectral_bound, diffusivity).unwrap();
    let plan = Plan::new(0.0, dt * f64::from(steps), dt).unwrap().limit(limit);
    let mut u = u.to_vec();
    let rhs = |_, u: &Vec<f64>, du: &mut Vec<f64>| {
        rows.apply(u, du)?;
        du.iter_mut().for_each(|du| *du *= diffusivity);
        Ok(())
    };
    let run = integrate(&mut Rk4::new(), &mut u, &plan, rhs, |_, _, _| {}).unwrap();
    assert_eq!(run.steps, u64::from(steps));
    u
}

#[test]
fn scaling_the_field_or_time_against_diffusivity_by_powers_of_two_keeps_the_bits() {
    // M14 of the metamorphic relations.
    let start: Vec<f64> = (0..48).map(|p| (0.13 * f64::from(p)).sin() + 0.2).collect();
    let (dt, steps) = (f64::exp2(-13.0), 32);
    let reference = diffuse(&start, 0.5, dt, steps);
    assert_ne!(reference, start);
    for k in [-60, 17] {
        let factor = f64::exp2(f64::from(k));
        let scaled: Vec<f64> = start.iter().map(|u| u * factor).collect();
        let expected: Vec<f64> = reference.iter().map(|u| u * factor).collect();
        let same = |text| Promise::new("Metamorphic relations", text);
        same("M14 diffusion of a field scaled by 2^k").equal(&diffuse(&scaled, 0.5, dt, steps), &expected);
        let faster = diffuse(&start, 0.5 * factor, dt / factor, steps);
        same("M14 diffusion with time scaled against diffusivity").equal(&faster, &reference);
    }
}
