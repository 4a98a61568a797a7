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
//! What makes A_BB regular is the weight of u_p in its own row: positive, and not small beside the others. Rows are
//! widened until it is, and condition numbers of A_BB are then 1.2 (1D) to some ten, however many particles there are;
//! a Robin term with a b >= 0 only helps. A_BB can be singular for a b < 0, where a u_p cancels what du/dn takes of u_p
//! (a ~ -b/h), and a normal that points inwards is refused, for u_p then has the wrong sign.
//! A steady problem with Neumann conditions only is singular whatever the rows: a constant can be added to u. Its solver
//! says so; fix one value, or take a Robin condition somewhere.

mod chosen;
mod condition;
mod coupled;
mod outward;
mod rows;

pub use condition::{BoundaryCondition, NORMAL_TOLERANCE};
pub use coupled::BoundaryReport;
pub use rows::BoundaryRows;
