//! Operators as data, and methods: how a stencil becomes weights.

mod expression;
mod method;
mod named;
mod typed;

pub use expression::{Expression, Operator, Outputs, ShowSum, Value};
pub use method::{Allowance, Breach, Method, RowReport};
pub use named::{Along, Divergence, Gradient, Laplacian};
pub use typed::{Homogeneous, Plus, Times};
