//! lib
mod apply;
mod domain;
mod error;
mod kernel;
mod multi_index;
mod neighbors;
mod operator;
mod particles;
mod scalar;
mod scale;
mod stencil;
mod time;
pub use apply::{Apply, Field, MatrixFree, Report, Row, Rows};
pub use domain::{Domain, Face, LENGTH_HIGH, LENGTH_LOW};
pub use error::*;
pub use kernel::{
    ExactPolynomial, Exchange, Gaussian, HighOrderGaussian, Kernel, Rational, SmoothingKernel, WideGaussian,
};
pub use multi_index::*;
pub use neighbors::{BruteForce, Canonical, CellList, Neighbors};
pub use operator::*;
pub use particles::{COORDINATE_HIGH, PARTICLES_HIGH, Particles, Random};
pub use scalar::Scalar;
pub use scale::{Cutoff, Epsilon, Spacing, Volumes};
pub use stencil::{Neighbor, Stencil};
pub use time::*;
