//! Time: states, the steppers that move them, and the steps they may take.

mod entry;
mod euler;
mod integrate;
mod leapfrog;
mod limit;
mod plan;
mod rk4;
mod state;
mod stepper;

pub use entry::Entry;
pub use euler::Euler;
pub use integrate::{Run, integrate};
pub use leapfrog::Leapfrog;
pub use limit::{Binding, Policy, StepLimit};
pub use plan::Plan;
pub use rk4::Rk4;
pub use state::State;
pub use stepper::{Rhs, Stepper};
