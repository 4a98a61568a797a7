//! Operators as data, and methods: how a stencil becomes weights.

mod contraction;
mod dcpse;
mod div_grad;
mod expression;
mod method;
mod named;
mod pair_report;
mod pairwise;
mod pse;
mod sph;
mod typed;

pub use contraction::{Contraction, ContractionScratch};
pub use dcpse::{CUTOFF_OVER_EPSILON, DcPse, DcPseScratch};
pub use div_grad::{DivGrad, Mean};
pub use expression::{Expression, Operator, Outputs, ShowSum, Value};
pub use method::{Allowance, Breach, Method, RowReport, Targets, spread};
pub use named::{Along, AlongTwice, BiLaplacian, Curl, Divergence, Gradient, Hessian, Laplacian};
pub use pairwise::{MOMENT_TOLERANCE, PairScratch};
pub use pse::{Form, Pse, Sign};
pub use sph::{Differentiated, Sph, SphForm};
pub use typed::{Homogeneous, Plus, Times};
