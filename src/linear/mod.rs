//! Sparse matrices made of rows, and the linear systems they pose.

mod csr;
mod gmres;
mod ilu;
mod replace;

pub use csr::CsrMatrix;
pub use gmres::{Gmres, SolveReport};
pub use ilu::Ilu0;
