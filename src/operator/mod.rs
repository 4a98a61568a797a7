//! Operators as data, and methods: how a stencil becomes weights.

mod allowance;
mod contraction;
mod dcpse;
mod div_grad;
mod draft;
mod expression;
mod method;
mod mutual;
mod named;
mod pair_report;
mod pairwise;
mod pse;
mod row_report;
mod several;
mod sph;
mod typed;

pub use allowance::{Allowance, Targets};
pub use contraction::{Contraction, ContractionScratch};
pub use dcpse::{CUTOFF_OVER_EPSILON, DcPse, DcPseScratch, Fallback};
pub use div_grad::{CONTRAST_LIMIT, DivGrad, Mean};
pub use draft::Draft;
pub(crate) use draft::finite;
pub use expression::{Expression, Operator, Outputs, ShowSum, Value};
pub use method::{GROWTH, Method, spread};
pub(crate) use mutual::Mutual;
pub use named::{Along, AlongTwice, BiLaplacian, Curl, Divergence, Gradient, Hessian, Laplacian};
pub use pairwise::{MOMENT_TOLERANCE, PairScratch};
pub use pse::{Form, Pse, Sign};
pub use row_report::{Breach, RowReport};
pub use several::Several;
pub use sph::{Differentiated, Sph, SphForm};
pub use typed::{Homogeneous, Plus, Times};
