//! Operators as data, and methods: how a stencil becomes weights.

mod expression;
mod method;
mod pairwise;
mod pse;
mod sph;

pub use expression::{Along, Divergence, Expression, Gradient, Homogeneous, Laplacian, Operator, Outputs, Plus, Times};
pub use method::{Allowance, Breach, Method, RowReport, spread};
pub use pairwise::{MOMENT_TOLERANCE, PairScratch};
pub use pse::{Form, Pse, Sign};
pub use sph::{Differentiated, Sph, SphForm};
