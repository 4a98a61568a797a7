//! The stepper checker: it passes the steppers that keep their promises and catches every one that breaks one.

use parops::testing::{Promise, StepperFault, check_stepper};
use parops::{Error, Euler, Leapfrog, Result, Rhs, Rk4, Rkl2, SspRk3, Stepper, TimeError};

#[test]
fn steppers_of_the_crate_keep_their_promises() {
    /// The slack of the observed order that the checker itself allows.
    const SLACK: f64 = 0.2;
    let reports = [
        (check_stepper(Euler::new), 1, 1.0),
        (check_stepper(Rk4::new), 4, 4.0),
        (check_stepper(Leapfrog::new), 1, 2.0),
        (check_stepper(SspRk3::new), 3, 3.0),
        (check_stepper(|| Rkl2::new(2).unwrap()), 2, 2.0),
        (check_stepper(|| Rkl2::new(3).unwrap()), 3, 2.0),
        (check_stepper(|| Rkl2::new(10).unwrap()), 10, 2.0),
        (check_stepper(|| Rkl2::new(15).unwrap()), 15, 2.0),
        (check_stepper(|| Rkl2::new(3).unwrap().with_substeps(2)), 6, 2.0),
        (check_stepper(|| Rkl2::new(4).unwrap().with_substeps(3)), 12, 2.0),
    ];
    for (report, stages, order) in reports {
        let report = report.unwrap_or_else(|fault| panic!("{fault}"));
        Promise::new("Conformance", "steppers pass their checker with the stages and the order they state")
            .case(format!("{report:?}"))
            .holds(report.stages == stages && (report.order - order).abs() <= SLACK);
    }
}

type Field = Vec<f64>;

/// Heun's scheme as a user would write it: u + dt/2 (f(u) + f(u + dt f(u))).
struct Heun;

impl Stepper<Field> for Heun {
    fn order(&self) -> u32 {
        2
    }
    fn negative_real_interval(&self) -> f64 {
        2.0
    }
    fn imaginary_interval(&self) -> f64 {
        0.0
    }
    fn step(&mut self, t: f64, dt: f64, u: &mut Field, rhs: &mut Rhs<'_, Field>) -> Result<()> {
        if !(dt > 0.0 && dt.is_finite()) {
            return Err(TimeError::Step { dt }.into());
        }
        if t + dt == t {
            return Err(TimeError::NoProgress { t, dt }.into());
        }
        let mut rates = [u.clone(), u.clone()];
        let mut stage = u.clone();
        for (i, rate) in rates.iter_mut().enumerate() {
            let t = t + i as f64 * dt;
            rhs(t, &stage, rate)?;
            if rate.len() != u.len() {
                return Err(TimeError::Shape { found: rate.len(), needed: u.len() }.into());
            }
            if let Some(p) = rate.iter().position(|x| !x.is_finite()) {
                return Err(Error::from(TimeError::NotFinite { stage: i + 1, t }).at(p));
            }
            stage.iter_mut().zip(u.iter()).zip(rate.iter()).for_each(|((s, u), k)| *s = u + dt * k);
        }
        for (p, u) in u.iter_mut().enumerate() {
            *u += dt / 2.0 * (rates[0][p] + rates[1][p]);
        }
        Ok(())
    }
}

#[test]
fn a_foreign_stepper_passes() {
    let report = check_stepper(|| Heun).unwrap_or_else(|fault| panic!("{fault}"));
    assert_eq!(report.stages, 2);
}

/// What is wrong with a stepper.
#[derive(Clone, Copy, PartialEq)]
enum Wrong {
    OrderTooLow,
    OrderTooHigh,
    StageTime,
    RealTooLong,
    RealTooShort,
    ImaginaryTooLong,
    ImaginaryTooShort,
    WritesEarly,
    Swallows,
    ForgetsNothing,
    StageNumber,
    Drifts,
    AcceptsZero,
    AcceptsNoProgress,
    RefusesAll,
}

/// RK4 with one fault.
struct Faulty {
    inner: Rk4<Field>,
    wrong: Wrong,
    failures: u32,
}

impl Stepper<Field> for Faulty {
    fn order(&self) -> u32 {
        match self.wrong {
            Wrong::OrderTooLow => 5,
            Wrong::OrderTooHigh => 3,
            _ => 4,
        }
    }
    fn negative_real_interval(&self) -> f64 {
        match self.wrong {
            Wrong::RealTooLong => 2.9,
            Wrong::RealTooShort => 2.5,
            _ => Stepper::<Field>::negative_real_interval(&self.inner),
        }
    }
    fn imaginary_interval(&self) -> f64 {
        match self.wrong {
            Wrong::ImaginaryTooLong => 3.0,
            Wrong::ImaginaryTooShort => 1.0,
            _ => Stepper::<Field>::imaginary_interval(&self.inner),
        }
    }
    fn step(&mut self, t: f64, dt: f64, u: &mut Field, rhs: &mut Rhs<'_, Field>) -> Result<()> {
        let before = u.clone();
        match self.wrong {
            Wrong::RefusesAll => return Err(Error::user(1)),
            Wrong::AcceptsZero if dt == 0.0 => return Ok(()),
            Wrong::AcceptsNoProgress if dt > 0.0 && t + dt == t => return Ok(()),
            _ => {}
        }
        let mut late =
            |t: f64, u: &Field, du: &mut Field| rhs(if self.wrong == Wrong::StageTime { t + dt } else { t }, u, du);
        match self.inner.step(t, dt, u, &mut late) {
            Ok(()) => {
                if self.wrong == Wrong::Drifts {
                    u.iter_mut().for_each(|u| *u *= 1.0 + f64::EPSILON);
                }
                if self.wrong == Wrong::ForgetsNothing && self.failures > 0 {
                    u[0] += f64::from(self.failures) * f64::EPSILON;
                }
                Ok(())
            }
            Err(error) => {
                self.failures += 1;
                match (self.wrong, error.kind()) {
                    (Wrong::WritesEarly, parops::ErrorKind::User { .. }) => {
                        u.iter_mut().zip(&before).for_each(|(u, before)| *u = before + dt);
                        Err(error)
                    }
                    (Wrong::Swallows, parops::ErrorKind::User { .. }) => Ok(()),
                    (Wrong::StageNumber, parops::ErrorKind::Time(TimeError::NotFinite { stage, t })) => {
                        Err(Error::from(TimeError::NotFinite { stage: stage - 1, t: *t })
                            .at(error.particle().unwrap_or(0)))
                    }
                    _ => Err(error),
                }
            }
        }
    }
}

/// The fault found in a stepper that is wrong in this way.
fn fault(wrong: Wrong) -> StepperFault {
    let fault = check_stepper(|| Faulty { inner: Rk4::new(), wrong, failures: 0 }).unwrap_err();
    assert!(!fault.to_string().is_empty());
    fault
}

#[test]
fn a_wrong_order_is_caught_be_it_too_high_or_too_low() {
    assert!(matches!(fault(Wrong::OrderTooLow), StepperFault::Order { stated: 5, observed } if observed < 4.2));
    assert!(matches!(fault(Wrong::OrderTooHigh), StepperFault::Order { stated: 3, observed } if observed > 3.8));
}

#[test]
fn intervals_that_are_not_sharp_are_caught() {
    assert!(matches!(fault(Wrong::RealTooLong), StepperFault::Unbounded { lambda_dt: [re, _], .. } if re < -2.8));
    assert!(matches!(fault(Wrong::RealTooShort), StepperFault::Bounded { lambda_dt: [re, _], .. } if re < -2.5));
    assert!(matches!(fault(Wrong::ImaginaryTooLong), StepperFault::Unbounded { lambda_dt: [_, im], .. } if im > 2.9));
    assert!(matches!(fault(Wrong::ImaginaryTooShort), StepperFault::Bounded { lambda_dt: [_, im], .. } if im > 1.0));
}

#[test]
fn failures_that_change_or_hide_something_are_caught() {
    assert_eq!(fault(Wrong::WritesEarly), StepperFault::Changed { evaluation: 1 });
    assert_eq!(fault(Wrong::Swallows), StepperFault::Swallowed { evaluation: 1, found: None });
    assert_eq!(fault(Wrong::ForgetsNothing), StepperFault::History { evaluation: 1 });
    assert!(matches!(fault(Wrong::StageNumber), StepperFault::NotReported { evaluation: 1, found: Some(_) }));
    // Evaluated a step late, the time reported is not the time of the stage.
    assert!(matches!(fault(Wrong::StageTime), StepperFault::NotReported { evaluation: 1, found: Some(_) }));
}

#[test]
fn drift_and_illegal_steps_are_caught() {
    assert!(matches!(fault(Wrong::Drifts), StepperFault::Drift { index: 0, before: 1.0, .. }));
    assert_eq!(fault(Wrong::AcceptsZero), StepperFault::Accepted { due: TimeError::Step { dt: 0.0 }, found: None });
    assert!(matches!(
        fault(Wrong::AcceptsNoProgress),
        StepperFault::Accepted { due: TimeError::NoProgress { .. }, found: None }
    ));
    assert_eq!(fault(Wrong::RefusesAll), StepperFault::Refused { error: Error::user(1) });
}

/// Leapfrog that keeps no old state, as printed in the notes: u^(n+1) = u^n + 2 dt f, errata 52.
#[derive(Default)]
struct LeapfrogAsPrinted(Euler<Field>);

impl Stepper<Field> for LeapfrogAsPrinted {
    fn order(&self) -> u32 {
        2
    }
    fn negative_real_interval(&self) -> f64 {
        0.0
    }
    fn imaginary_interval(&self) -> f64 {
        1.0
    }
    fn step(&mut self, t: f64, dt: f64, u: &mut Field, rhs: &mut Rhs<'_, Field>) -> Result<()> {
        self.0.step(t, dt, u, &mut |t, u: &Field, du: &mut Field| {
            rhs(t, u, du)?;
            du.iter_mut().for_each(|du| *du *= 2.0);
            Ok(())
        })
    }
}

#[test]
fn leapfrog_as_printed_in_the_notes_is_caught() {
    let fault = check_stepper(LeapfrogAsPrinted::default).unwrap_err();
    assert!(matches!(fault, StepperFault::Order { stated: 2, observed } if observed < 0.5), "{fault}");
}
