//! Sparse matrices made of rows, and the linear systems they pose.

mod condition;
mod csr;
mod export;
#[cfg(feature = "faer")]
mod faer_matrix;
mod gmres;
mod ilu;
#[cfg(feature = "faer")]
mod lu;
mod matrix_market;
mod replace;
mod solver;

pub use csr::CsrMatrix;
pub use gmres::{Gmres, SolveReport};
pub use ilu::Ilu0;
pub(crate) use matrix_market::Counted;
pub use solver::SparseSolver;
