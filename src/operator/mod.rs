//! Operators as data, and methods: how a stencil becomes weights.

mod expression;
mod method;

pub use expression::{Along, Divergence, Expression, Gradient, Homogeneous, Laplacian, Operator, Outputs, Plus, Times};
pub use method::{Allowance, Breach, Method, RowReport};
