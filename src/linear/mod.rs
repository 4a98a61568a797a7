//! Sparse matrices made of rows, and the linear systems they pose.

mod condition;
mod csr;
mod export;
#[cfg(feature = "faer")]
mod faer_matrix;
mod gmres;
mod ilu;
mod invariant;
mod krylov;
#[cfg(feature = "faer")]
mod lu;
mod matrix_market;
mod replace;
mod solver;
mod spectrum;
mod tuning;

pub use csr::CsrMatrix;
pub use gmres::{Gmres, SolveReport};
pub use ilu::Ilu0;
pub use solver::SparseSolver;
pub use spectrum::{Spectrum, SpectrumEstimator};
pub use tuning::Tuning;
