//! The promises of a stepper, broken.

use std::fmt;

use crate::error::{Error, TimeError};

/// The promise a stepper breaks, with the numbers.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum StepperFault {
    /// A step that is legal was refused.
    Refused {
        /// Why.
        error: Error,
    },
    /// The order observed on a nonlinear problem is not the one stated, be it lower or higher.
    Order {
        /// The order stated.
        stated: u32,
        /// The order observed.
        observed: f64,
    },
    /// u' = lambda u does not stay bounded inside a stated interval.
    Unbounded {
        /// (Re, Im) of lambda dt.
        lambda_dt: [f64; 2],
        /// The largest |u|, from |u| = 1.
        largest: f64,
    },
    /// u' = lambda u stays bounded outside a stated interval, which is therefore not sharp.
    Bounded {
        /// (Re, Im) of lambda dt.
        lambda_dt: [f64; 2],
        /// The largest |u|, from |u| = 1.
        largest: f64,
    },
    /// The state differs after a step that failed at this evaluation (from 1; 0 for a step refused before the first).
    Changed {
        /// The evaluation.
        evaluation: usize,
    },
    /// The error of the right-hand side at this evaluation did not come back as it was.
    Swallowed {
        /// The evaluation, from 1.
        evaluation: usize,
        /// What came back.
        found: Option<Error>,
    },
    /// Steps after a failed one differ from those of a stepper that never failed.
    History {
        /// The evaluation that failed, from 1.
        evaluation: usize,
    },
    /// A rate of change that is not finite was not reported with its stage, time and particle.
    NotReported {
        /// The evaluation, from 1.
        evaluation: usize,
        /// What came back.
        found: Option<Error>,
    },
    /// A step or shape that is illegal was not refused as it should be.
    Accepted {
        /// The refusal due.
        due: TimeError,
        /// What came back.
        found: Option<Error>,
    },
    /// The state drifts where nothing changes.
    Drift {
        /// The entry.
        index: usize,
        /// Its value before.
        before: f64,
        /// Its value after.
        after: f64,
    },
}

impl fmt::Display for StepperFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let came = |found: &Option<Error>| found.as_ref().map_or("no error".to_string(), |error| format!("'{error}'"));
        match self {
            Self::Refused { error } => write!(f, "a legal step was refused: {error}"),
            Self::Order { stated, observed } => write!(f, "the order is {observed:.3}, stated {stated}"),
            Self::Unbounded { lambda_dt: [re, im], largest } => {
                write!(f, "lambda dt = {re} + {im}i lies inside the stated intervals, but |u| reaches {largest:e}")
            }
            Self::Bounded { lambda_dt: [re, im], largest } => {
                write!(f, "lambda dt = {re} + {im}i lies outside the stated intervals, but |u| stays below {largest:e}")
            }
            Self::Changed { evaluation } => {
                write!(f, "a step that failed at evaluation {evaluation} changed the state")
            }
            Self::Swallowed { evaluation, found } => {
                write!(f, "the error of evaluation {evaluation} came back as {}", came(found))
            }
            Self::History { evaluation } => {
                write!(f, "steps after a failure at evaluation {evaluation} are not what they were without it")
            }
            Self::NotReported { evaluation, found } => {
                write!(f, "NaN in evaluation {evaluation} came back as {}", came(found))
            }
            Self::Accepted { due, found } => write!(f, "instead of '{due}' came {}", came(found)),
            Self::Drift { index, before, after } => {
                write!(f, "entry {index} drifts from {before:e} to {after:e} at rest")
            }
        }
    }
}

impl std::error::Error for StepperFault {}
