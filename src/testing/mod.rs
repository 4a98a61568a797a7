//! Conformance checkers, for what this crate provides and for what its users plug in.
//!
//! Each returns the first promise that is broken, with the numbers.

mod fuzz;
mod kernel;
mod mesh_kernel;
mod method;
mod method_fault;
mod provider;
mod sample;
mod smoothing;
mod stepper;
mod stepper_fault;

pub use fuzz::{FuzzFault, FuzzOutcome, fuzz_neighbor_build, fuzz_operator_build};
pub use kernel::{KernelFault, KernelLimits, check_kernel};
pub use mesh_kernel::{MeshKernelFault, check_mesh_kernel};
pub use method::{check_method, check_method_moments};
pub use method_fault::MethodFault;
pub use provider::{ProviderFault, check_provider, check_provider_against};
pub use smoothing::check_smoothing_kernel;
pub use stepper::{StepperReport, check_stepper};
pub use stepper_fault::StepperFault;
