//! Whether a stepper keeps the promises of [`Stepper`].

use super::stepper_fault::StepperFault;
use crate::error::{Error, ErrorKind, Result, TimeError};
use crate::time::Stepper;

/// What [`check_stepper`] measured on a stepper without fault.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepperReport {
    /// The order observed.
    pub order: f64,
    /// Evaluations of the right-hand side in the first step.
    pub stages: usize,
}

type Checked<T = ()> = std::result::Result<T, StepperFault>;

/// Checks that a stepper keeps the promises of [`Stepper`]; `make` makes a new one for every part.
///
/// 1. The order observed on a nonlinear, time-dependent problem with known solution is the stated one within 0.2; a
///    higher one is a fault as well.
/// 2. u' = lambda u stays below 100 in 20000 steps inside the stated intervals, up to 1 % below their ends, and exceeds
///    1000 at 1 % above them (at 1 for an interval of length 0).
/// 3. A failing step, at any evaluation of the first three steps, hands the error on, changes nothing, and leaves later
///    steps what they would have been.
/// 4. NaN is reported with stage, time and particle; illegal steps and a rate of another shape are refused.
/// 5. A zero right-hand side changes no bit.
///
/// ```
/// use parops::{Rk4, testing::check_stepper};
/// let report = check_stepper(Rk4::new).unwrap();
/// assert_eq!(report.stages, 4);
/// ```
///
/// # Errors
/// The first [`StepperFault`] found.
pub fn check_stepper<P: Stepper<Vec<f64>>>(make: impl Fn() -> P) -> Checked<StepperReport> {
    let stages = rest(&mut make())?;
    refusals(&make)?;
    let mut evaluation = 1;
    while failure(&make, evaluation)? {
        evaluation += 1;
    }
    let order = order(&make)?;
    intervals(&make)?;
    Ok(StepperReport { order, stages })
}

fn refused(error: Error) -> StepperFault {
    StepperFault::Refused { error }
}

/// Entries of many magnitudes, so that a rounding of any of them shows.
fn entries() -> Vec<f64> {
    vec![1.0, -0.1, 1e300, -3e-308, 5e-324, 0.0]
}

fn bits(u: &[f64]) -> Vec<u64> {
    u.iter().map(|x| x.to_bits()).collect()
}

/// A zero right-hand side changes nothing; the number of evaluations in the first step.
fn rest(stepper: &mut impl Stepper<Vec<f64>>) -> Checked<usize> {
    let mut u = entries();
    let (mut calls, mut first) = (0, 0);
    for n in 0..10 {
        let mut zero = |_: f64, _: &Vec<f64>, du: &mut Vec<f64>| {
            calls += 1;
            du.fill(0.0);
            Ok(())
        };
        stepper.step(0.1 * f64::from(n), 0.1, &mut u, &mut zero).map_err(refused)?;
        if n == 0 {
            first = calls;
        }
    }
    let drifted = entries().into_iter().zip(&u).enumerate().find(|(_, (before, after))| before != *after);
    match drifted {
        None => Ok(first),
        Some((index, (before, &after))) => Err(StepperFault::Drift { index, before, after }),
    }
}

/// Illegal steps, and a right-hand side that changes the shape of the rates.
fn refusals<P: Stepper<Vec<f64>>>(make: &impl Fn() -> P) -> Checked {
    let zero = |_: f64, _: &Vec<f64>, du: &mut Vec<f64>| {
        du.fill(0.0);
        Ok(())
    };
    let shrink = |_: f64, _: &Vec<f64>, du: &mut Vec<f64>| {
        du.clear();
        Ok(())
    };
    let illegal = |dt: f64| (0.0, dt, TimeError::Step { dt });
    let steps = [
        illegal(0.0),
        illegal(-0.1),
        illegal(f64::NAN),
        illegal(f64::INFINITY),
        (1.0, 1e-17, TimeError::NoProgress { t: 1.0, dt: 1e-17 }),
    ];
    for (t, dt, due) in steps {
        refusal(make, t, dt, due, zero)?;
    }
    refusal(make, 0.0, 0.1, TimeError::Shape { found: 0, needed: entries().len() }, shrink)
}

fn refusal<P: Stepper<Vec<f64>>>(
    make: &impl Fn() -> P,
    t: f64,
    dt: f64,
    due: TimeError,
    mut rhs: impl FnMut(f64, &Vec<f64>, &mut Vec<f64>) -> Result<()>,
) -> Checked {
    let mut u = entries();
    let found = make().step(t, dt, &mut u, &mut rhs).err();
    // NaN differs from itself: the numbers are compared as they print.
    let same = matches!(&found, Some(error) if format!("{:?}", error.kind()) == format!("{:?}", ErrorKind::Time(due)));
    if !same {
        return Err(StepperFault::Accepted { due, found });
    }
    if bits(&u) != bits(&entries()) {
        return Err(StepperFault::Changed { evaluation: 0 });
    }
    Ok(())
}

/// The steps whose evaluations are made to fail one by one: a multistep scheme has left its start by then.
const STEPS: u32 = 3;

/// How evaluation `evaluation` fails.
#[derive(Clone, Copy, PartialEq)]
enum Fault {
    Raised,
    Nan,
}

/// Lets one evaluation of the first steps fail, in both ways; false beyond the last evaluation.
fn failure<P: Stepper<Vec<f64>>>(make: &impl Fn() -> P, evaluation: usize) -> Checked<bool> {
    let whole = fail_at(make, 0, Fault::Raised)?;
    let mut reached = false;
    for fault in [Fault::Raised, Fault::Nan] {
        let run = fail_at(make, evaluation, fault)?;
        reached |= run.failed;
        if run.u != whole.u {
            return Err(StepperFault::History { evaluation });
        }
    }
    Ok(reached)
}

struct Outcome {
    u: Vec<u64>,
    failed: bool,
}

/// Runs a few steps of u_p' = -u_p + t; the given evaluation fails once, and its step is repeated.
fn fail_at<P: Stepper<Vec<f64>>>(make: &impl Fn() -> P, evaluation: usize, fault: Fault) -> Checked<Outcome> {
    const CODE: i64 = 20_477;
    const PARTICLE: usize = 1;
    let (dt, mut stepper) = (0.125, make());
    let mut u = vec![1.0, 2.0, -3.0];
    let (mut calls, mut failed) = (0, false);
    for n in 0..STEPS {
        let t = dt * f64::from(n);
        loop {
            let before = bits(&u);
            // Stage and time of the evaluation made to fail in this attempt.
            let (mut stage, mut hit) = (0, None);
            let result = stepper.step(t, dt, &mut u, &mut |t, u: &Vec<f64>, du: &mut Vec<f64>| {
                calls += 1;
                stage += 1;
                du.iter_mut().zip(u).for_each(|(du, u)| *du = t - u);
                if calls == evaluation {
                    hit = Some((stage, t));
                    match fault {
                        Fault::Raised => return Err(Error::user(CODE)),
                        Fault::Nan => du[PARTICLE] = f64::NAN,
                    }
                }
                Ok(())
            });
            let Some((stage, t)) = hit else {
                result.map_err(refused)?;
                break;
            };
            failed = true;
            if bits(&u) != before {
                return Err(StepperFault::Changed { evaluation });
            }
            let found = result.err();
            let due = match fault {
                Fault::Raised => Error::user(CODE),
                Fault::Nan => Error::from(TimeError::NotFinite { stage, t }).at(PARTICLE),
            };
            if found.as_ref() != Some(&due) {
                return Err(match fault {
                    Fault::Raised => StepperFault::Swallowed { evaluation, found },
                    Fault::Nan => StepperFault::NotReported { evaluation, found },
                });
            }
        }
    }
    Ok(Outcome { u: bits(&u), failed })
}

/// The largest legal distance of the observed order from the stated one. On the finest pair of steps the next term of
/// the error is below a hundredth of the leading one for orders up to 4; fractional or missing orders are far off.
const ORDER_SLACK: f64 = 0.2;

/// The error of the error problem at t = 1 with n steps: u_0' = -u_0^2 cos t, u_1' = u_1 (1 - u_1).
fn error_of<P: Stepper<Vec<f64>>>(make: &impl Fn() -> P, n: u32) -> Checked<f64> {
    let (dt, mut stepper) = (1.0 / f64::from(n), make());
    let mut u = vec![1.0, 0.2];
    for step in 0..n {
        let rhs = &mut |t: f64, u: &Vec<f64>, du: &mut Vec<f64>| {
            du[0] = -u[0] * u[0] * t.cos();
            du[1] = u[1] * (1.0 - u[1]);
            Ok(())
        };
        stepper.step(f64::from(step) * dt, dt, &mut u, rhs).map_err(refused)?;
    }
    let exact = [1.0 / (1.0 + 1.0_f64.sin()), 1.0 / (1.0 + 4.0 * (-1.0_f64).exp())];
    Ok(u.iter().zip(exact).map(|(u, exact)| (u - exact).abs()).fold(0.0, f64::max))
}

/// The order observed on the finest pair of steps whose error is still above rounding.
fn order<P: Stepper<Vec<f64>>>(make: &impl Fn() -> P) -> Checked<f64> {
    // n steps round n times; a hundred times that is left as room.
    let floor = |n: u32| 100.0 * f64::from(n) * f64::EPSILON;
    let (mut observed, mut coarse) = (0.0, error_of(make, 8)?);
    let mut n = 16;
    while n <= 2048 {
        let fine = error_of(make, n)?;
        if fine < floor(n) {
            break;
        }
        observed = (coarse / fine).log2();
        (coarse, n) = (fine, 2 * n);
    }
    let stated = make().order();
    // NaN fails too.
    if (observed - f64::from(stated)).abs() <= ORDER_SLACK {
        Ok(observed)
    } else {
        Err(StepperFault::Order { stated, observed })
    }
}

/// How far inside and outside an end the intervals are tried, relative to it.
const SHARPNESS: f64 = 0.01;

/// Where growth must show for an interval of length 0: an interval of more than this is not to be stated as none.
const OUTSIDE_ZERO: f64 = 0.1;

/// By how much the second half of the steps must outgrow the first there: rounding of 10^4 steps of some eps is below 1e-11,
/// the weak growth of n substeps of RKL2, |R| - 1 ~ n (y/n)^4/36, reaches 1e-9 up to n = 300.
const OUTGROWN: f64 = 1e-9;

/// Above this |u| has grown; leapfrog at 1 % below its limit reaches 7.
const GROWN: f64 = 1000.0;

/// Below this |u| is bounded.
const BOUNDED: f64 = 100.0;

/// Both stated intervals, inside and just outside.
fn intervals<P: Stepper<Vec<f64>>>(make: &impl Fn() -> P) -> Checked {
    let stepper = make();
    let ends = [([-1.0, 0.0], stepper.negative_real_interval()), ([0.0, 1.0], stepper.imaginary_interval())];
    for ([re, im], end) in ends {
        for part in [0.01, 0.1, 0.3, 0.5, 0.7, 0.9, 1.0 - SHARPNESS] {
            let at = part * if end.is_finite() { end } else { 1e3 };
            let lambda_dt = [re * at, im * at];
            let largest = largest(&mut make(), lambda_dt)?;
            let bounded = largest <= BOUNDED;
            if end > 0.0 && !bounded {
                return Err(StepperFault::Unbounded { lambda_dt, largest });
            }
        }
        if end.is_finite() {
            let at = if end > 0.0 { (1.0 + SHARPNESS) * end } else { OUTSIDE_ZERO };
            let lambda_dt = [re * at, im * at];
            let [first, largest] = halves(&mut make(), lambda_dt)?;
            let grown = largest >= GROWN || (end == 0.0 && largest > first * (1.0 + OUTGROWN));
            if !grown {
                return Err(StepperFault::Bounded { lambda_dt, largest });
            }
        }
    }
    Ok(())
}

/// Steps in which growth must show.
const MANY: u32 = 20_000;

/// The largest |u| of u' = lambda u in so many steps of length 1 from |u| = 1, or the first that has grown.
fn largest(stepper: &mut impl Stepper<Vec<f64>>, lambda_dt: [f64; 2]) -> Checked<f64> {
    let [first, second] = halves(stepper, lambda_dt)?;
    Ok(first.max(second).max(1.0))
}

/// The same for the first and the second half of the steps.
fn halves(stepper: &mut impl Stepper<Vec<f64>>, [re, im]: [f64; 2]) -> Checked<[f64; 2]> {
    let mut u = vec![1.0, 0.0];
    let mut halves = [0.0_f64; 2];
    for n in 0..MANY {
        let rhs = &mut |_: f64, u: &Vec<f64>, du: &mut Vec<f64>| {
            du[0] = re * u[0] - im * u[1];
            du[1] = re * u[1] + im * u[0];
            Ok(())
        };
        stepper.step(f64::from(n), 1.0, &mut u, rhs).map_err(refused)?;
        let half = &mut halves[usize::from(2 * n >= MANY)];
        *half = half.max(u[0].hypot(u[1]));
        if *half >= GROWN {
            return Ok([*half; 2]);
        }
    }
    Ok(halves)
}
