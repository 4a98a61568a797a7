//! Sparse matrices made of rows, and the linear systems they pose.

mod bicgstab;
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
mod norm;
mod pseudospectrum;
mod replace;
mod shifted;
mod solver;
mod spectrum;
mod stop;
mod tuning;

pub use bicgstab::BiCgStab;
pub use csr::CsrMatrix;
pub use gmres::Gmres;
pub use ilu::Ilu0;
pub use solver::SparseSolver;
pub use spectrum::{Spectrum, SpectrumEstimator};
pub use stop::SolveReport;
pub use tuning::Tuning;
pub(crate) use tuning::{OPEN, least};
