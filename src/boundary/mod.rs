//! Boundary conditions as rows.
//!
//! At a boundary particle p with outward unit normal n a condition is the equation a u + b du/dn = g: Dirichlet (b = 0),
//! Neumann (a = 0), Robin. The normal derivative is a row of DC-PSE, so the condition is a sparse equation in the values
//! at p and at its nearest particles. With u_B at the boundary and u_I elsewhere all of them read
//!
//! ```text
//! A_BB u_B + A_BI u_I = g
//! ```
//!
//! An evolution knows u_I and needs u_B: A_BB, as large as there are Neumann and Robin particles, is solved once an
//! application. A steady problem has one row a particle, the operator's inside and the condition's at the boundary.
//!
//! When these are singular: see [`BoundaryRows`].

mod chosen;
mod condition;
mod coupled;
mod outward;
mod rows;

pub use condition::{BoundaryCondition, NORMAL_TOLERANCE};
pub use coupled::BoundaryReport;
pub use rows::BoundaryRows;
