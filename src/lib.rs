//! lib
mod error;
mod kernel;
mod moment;
mod multi_index;
mod neighbors;
mod operator;
mod scalar;
mod scale;
mod stencil;
pub use error::*;
pub use kernel::{
    ExactPolynomial, Exchange, Gaussian, HighOrderGaussian, Kernel, Rational, SmoothingKernel, WideGaussian,
};
pub use moment::{
    CenterTerm, Quadrature, continuous_moment, continuous_moments, discrete_moment, discrete_moments,
    moment_conditions, required_moment,
};
pub use multi_index::*;
pub use neighbors::{Canonical, Neighbors};
pub use operator::*;
pub use scalar::Scalar;
pub use scale::{Cutoff, Epsilon, Spacing, Volumes};
pub use stencil::{Neighbor, Stencil};

#[cfg(feature = "testing")]
pub mod testing;
