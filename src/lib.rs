//! lib
mod apply;
mod error;
mod kernel;
mod multi_index;
mod neighbors;
mod operator;
mod scalar;
mod scale;
mod stencil;
#[cfg(feature = "testing")]
pub mod testing;
mod time;
pub use apply::{Apply, Field, MatrixFree, Report, Row, Rows};
pub use error::*;
pub use kernel::{
    ExactPolynomial, Exchange, Gaussian, HighOrderGaussian, Kernel, Rational, SmoothingKernel, WideGaussian,
};
pub use multi_index::*;
pub use neighbors::{Canonical, Neighbors};
pub use operator::*;
pub use scalar::Scalar;
pub use scale::{Cutoff, Epsilon, Spacing, Volumes};
pub use stencil::{Neighbor, Stencil};
pub use time::*;
