//! Conformance checkers (feature `testing`): whether an implementation, ours or the user's own, keeps its promises.

mod stepper;

pub use stepper::{StepperFault, StepperReport, check_stepper};
