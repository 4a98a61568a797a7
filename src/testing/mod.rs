//! Conformance checkers, for what this crate provides and for what its users plug in.
//!
//! Each returns the first promise that is broken, with the numbers. A [`Promise`] is a bound that a test asserts and
//! records; a [`Verification`] is the table of all that were recorded.

mod fuzz;
mod kernel;
mod mesh_kernel;
mod method;
mod method_fault;
mod promise;
mod promise_line;
mod provider;
mod sample;
mod smoothing;
mod stepper;
mod stepper_fault;
mod verification;

pub use fuzz::{FuzzFault, FuzzOutcome, fuzz_neighbor_build, fuzz_operator_build};
pub use kernel::{KernelFault, KernelLimits, check_kernel};
pub use mesh_kernel::{MeshKernelFault, check_mesh_kernel};
pub use method::{check_method, check_method_moments};
pub use method_fault::MethodFault;
pub use promise::Promise;
pub use provider::{ProviderFault, check_provider, check_provider_against};
pub use smoothing::check_smoothing_kernel;
pub use stepper::{StepperReport, check_stepper};
pub use stepper_fault::StepperFault;
pub use verification::Verification;
