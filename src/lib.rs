//! Discretized differential operators on particles: SPH, PSE and DC-PSE, with their moment conditions checked per row.
//!
//! One equation holds the crate together,
//!
//! ```text
//! D^beta f(x_p)  ~  epsilon^-|beta|  sum_q w_pq (f_q -/+ f_p)
//! ```
//!
//! and every module is one factor of it: [`MultiIndex`] and [`Beta`] name D^beta, kernels ([`Exchange`], [`Gaussian`])
//! give w, [`CellList`] and its kin give the q, [`Pse`], [`Sph`] and [`DcPse`] turn a stencil into weights, [`Rows`] and
//! [`MatrixFree`] apply them to fields, and [`integrate`] advances u' = D u within a [`StepLimit`] known beforehand.
//!
//! ```
//! use parops::{Apply, CellList, Domain, Laplacian, Particles, Pse, Result};
//! # fn main() -> Result<()> {
//! let particles = Particles::lattice([0.0, 0.0], [1.0, 1.0], [64, 64])?;
//! let laplacian = Pse::new(Laplacian::<2>, 4, particles.spacing()?.epsilon(2.0)?, particles.volumes()?)?;
//! let torus = Domain::periodic([0.0, 0.0], [1.0, 1.0])?;
//! let rows = laplacian.assemble(&CellList::build(&particles, &torus, laplacian.cutoff())?)?;
//!
//! let wave = |x: &[f64; 2]| (std::f64::consts::TAU * x[0]).sin();
//! let u: Vec<f64> = particles.points().iter().map(wave).collect();
//! let mut lap_u = vec![0.0; u.len()];
//! rows.apply(&u, &mut lap_u)?;
//! assert!((lap_u[7] / u[7] / -39.478417604 - 1.0).abs() < 1e-3);
//! # Ok(())
//! # }
//! ```
//!
//! # Features
//! `faer`: sparse LU for coupled boundary conditions, steady problems and implicit steps; matrices as those of that
//! package.
//! `kiddo`: a neighbor provider over an immutable k-d tree.
//! `rayon`: rows are built and applied by several threads, with the same bits for any number of them.
//! `serde`: rows and reports saved and read back bit for bit.
//! `testing`: conformance checkers for kernels, providers, methods and steppers, ours and the user's own, and a harness
//! that puts methods on curves of error against run time.

mod apply;
mod boundary;
mod domain;
mod error;
mod exp;
mod io;
mod kernel;
mod lanes;
mod linear;
mod mesh;
mod moment;
mod multi_index;
mod neighbors;
mod operator;
mod particles;
mod scalar;
mod scale;
mod solver;
mod stencil;
mod time;

pub use apply::{
    Advect, Apply, Field, Histogram, Hyperviscosity, MatrixFree, MovingMethod, RawRows, Report, Row, Rows, SidedRows,
    Strided, SymmetricPse, UpwindDcPse, UpwindRows, Vector,
};
pub use boundary::*;
pub use domain::{Domain, Face, LENGTH_HIGH, LENGTH_LOW};
pub use error::*;
pub use io::{Pvd, Vtu, VtuValues};
pub use kernel::{
    AnisotropicGaussian, Cic, CubicSpline, ExactPolynomial, Exchange, Gaussian, HighOrderGaussian, Kernel, Lambda,
    LatticeHat, MeshKernel, Ngp, OneSidedGaussian, QuinticSpline, Rational, RationalLaplacian, SmoothingKernel, Tsc,
    WendlandC2, WendlandC4, WendlandC6, WideGaussian,
};
pub use linear::*;
pub use mesh::{Centering, Dropped, Mesh, MeshStencil, Remeshed};
pub use moment::{
    CenterTerm, Cholesky, Ladder, Lu, MomentScratch, MomentSolver, MomentSystem, PivotedQr, Qr, Quadrature, Residual,
    Rung, Solution, Window, continuous_moment, continuous_moments, discrete_moment, discrete_moments,
    moment_conditions, required_moment,
};
pub use multi_index::*;
#[cfg(feature = "kiddo")]
pub use neighbors::KdTree;
pub use neighbors::{
    BruteForce, Canonical, CellList, HalfList, Nearest, NeighborList, Neighbors, Pair, Selected, SetQuality, Symmetry,
    Upstream, VerletList, epsilon_from_neighbors, fill_distance, least_gap, mean_neighbor_distance,
    volumes_from_neighbors,
};
pub use operator::*;
pub use particles::{COORDINATE_HIGH, PARTICLES_HIGH, Particles, Random};
pub use scalar::Scalar;
pub use scale::{Cutoff, Epsilon, Spacing, Volumes};
pub use solver::*;
pub use stencil::{Neighbor, Side, Stencil};
pub use time::*;

pub mod guide;
#[cfg(feature = "testing")]
pub mod report;
#[cfg(feature = "testing")]
pub mod testing;

/// The program of the README, compiled and run as a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
