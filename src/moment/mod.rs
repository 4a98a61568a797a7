//! Moments: of kernels, over particles, and the systems that correct a kernel to its discrete moments.

mod batch;
mod cholesky;
mod integral;
mod ladder;
mod lu;
mod monomials;
mod nodes;
mod qr;
mod solver;
mod system;
mod triangle;
mod window;

pub(crate) use batch::{BatchScratch, BatchSystem};
pub use cholesky::Cholesky;
pub use integral::{
    CenterTerm, Quadrature, continuous_moment, continuous_moments, discrete_moment, discrete_moments,
    moment_conditions, required_moment,
};
pub use ladder::Ladder;
pub use lu::Lu;
pub use qr::{PivotedQr, Qr};
pub use solver::{MomentScratch, MomentSolver, Rung, Solution};
pub use system::{MomentSystem, Residual};
pub use window::Window;
pub(crate) use window::Windows;
