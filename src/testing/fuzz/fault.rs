//! What comes of a case, and what may be wrong with it.

use std::fmt;

use crate::error::Error;
use crate::testing::ProviderFault;

/// What became of the input the bytes stand for, all of it being right.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FuzzOutcome {
    /// Something was built, and is what it ought to be.
    Built,
    /// The input breaks a rule, and the error says which and where.
    Refused,
}

/// The promise that is broken by the input the bytes stand for.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum FuzzFault {
    /// A refusal whose particle and numbers are not those of the input, or break no rule.
    Refused {
        /// What was built.
        build: &'static str,
        /// The refusal.
        error: Error,
    },
    /// Input that breaks a rule was accepted.
    Accepted {
        /// What was built.
        build: &'static str,
        /// The particle or target; 0 where the rule concerns none.
        p: usize,
        /// The number that breaks the rule.
        value: f64,
    },
    /// Neighbors that differ from those of the oracle.
    Provider {
        /// What was built.
        build: &'static str,
        /// How they differ.
        fault: ProviderFault,
    },
    /// A number that is not what it must be.
    Number {
        /// Which number.
        what: &'static str,
        /// The target.
        p: usize,
        /// The number found.
        found: f64,
        /// The number it must be.
        required: f64,
        /// How far they may differ.
        tolerance: f64,
    },
}

impl fmt::Display for FuzzFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Refused { build, error } => write!(f, "{build}: refused without cause: {error}"),
            Self::Accepted { build, p, value } => write!(f, "{build}: {value:e} of {p} breaks a rule but is accepted"),
            Self::Provider { build, fault } => write!(f, "{build}: {fault}"),
            Self::Number { what, p, found, required, tolerance } => {
                write!(f, "target {p}: {what} is {found:e}, not {required:e} to {tolerance:e}")
            }
        }
    }
}

impl std::error::Error for FuzzFault {}

/// Refuses a number farther from the required one than the tolerance, and NaN.
pub(super) fn close(what: &'static str, p: usize, found: f64, required: f64, tolerance: f64) -> Result<(), FuzzFault> {
    let close = (found - required).abs() <= tolerance;
    if close { Ok(()) } else { Err(FuzzFault::Number { what, p, found, required, tolerance }) }
}
