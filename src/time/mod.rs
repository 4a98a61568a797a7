//! Time: states, the steppers that move them, and the steps they may take.

mod entry;
mod euler;
mod exponential;
mod implicit;
mod integrate;
mod lattice;
mod leapfrog;
mod limit;
mod plan;
mod rk4;
mod rkl2;
mod ssp_rk3;
mod state;
mod stepper;
mod symbol;
mod wide_gaussian;

pub use entry::Entry;
pub use euler::Euler;
pub use exponential::Exponential;
pub use implicit::Implicit;
pub use integrate::{Run, integrate};
pub use lattice::LatticeSpectrum;
pub use leapfrog::Leapfrog;
pub use limit::{Binding, Policy, StepLimit};
pub use plan::Plan;
pub use rk4::Rk4;
pub use rkl2::{Rkl2, RowSymmetry};
pub use ssp_rk3::SspRk3;
pub use state::State;
pub use stepper::{Rhs, Stepper};
pub use wide_gaussian::wide_gaussian_decay;
