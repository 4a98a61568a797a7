//! One error type: a kind, the particle it concerns, and the numbers that broke the rule.

mod apply;
mod boundary;
mod domain;
mod io;
mod kernel;
mod linear;
mod mesh;
mod multi_index;
mod neighbor;
mod number;
mod operator;
mod particle;
mod report;
mod solver;
mod time;

pub use apply::ApplyError;
pub use boundary::BoundaryError;
pub use domain::DomainError;
pub use io::IoError;
pub use kernel::KernelError;
pub use linear::LinearError;
pub use mesh::MeshError;
pub use multi_index::MultiIndexError;
pub use neighbor::NeighborError;
pub use operator::OperatorError;
pub use particle::ParticleError;
pub use report::ReportError;
pub use solver::{Limit, SolverError};
pub use time::TimeError;

use std::fmt;

use number::Shown;

/// Declares an enum of error kinds together with the sentence each variant is shown as.
macro_rules! kinds {
    ($(#[$doc:meta])* $name:ident { $( $(#[$vdoc:meta])* $variant:ident { $( $(#[$fdoc:meta])* $field:ident : $ty:ty ),* $(,)? } => $text:literal, )* }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq)]
        #[non_exhaustive]
        pub enum $name { $( $(#[$vdoc])* $variant { $( $(#[$fdoc])* $field: $ty ),* }, )* }

        impl std::fmt::Display for $name {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                match self { $( $name::$variant { $( $field ),* } => {
                    $( let $field = $crate::error::number::Shown::shown(*$field); )*
                    write!(f, $text)
                } )* }
            }
        }
    };
}

use kinds;

/// What every fallible function of the crate returns.
pub type Result<T> = std::result::Result<T, Error>;

/// Why a call was refused. A failing call changes nothing but the contents of an `out` buffer.
///
/// ```
/// use parops::{Epsilon, Error, ErrorKind, ParticleError};
/// let error: Error = Epsilon::global(-1.0).unwrap_err();
/// assert_eq!(*error.kind(), ErrorKind::Particle(ParticleError::Epsilon { epsilon: -1.0 }));
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Error {
    kind: ErrorKind,
    particle: Option<usize>,
    remedy: Option<Remedy>,
}

/// What may help.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Remedy {
    /// A provider built with this cutoff.
    Cutoff(f64),
    /// Nothing but more particles: there are `found`, and at least `needed` are needed.
    Particles { found: u32, needed: u32 },
}

impl Error {
    /// An error of the given kind that concerns no particle in particular.
    pub fn new(kind: impl Into<ErrorKind>) -> Self {
        Self { kind: kind.into(), particle: None, remedy: None }
    }

    /// An error of the user's own, for right-hand sides, providers and methods outside this crate.
    ///
    /// `code` is handed back unchanged in [`ErrorKind::User`].
    pub fn user(code: i64) -> Self {
        Self::new(ErrorKind::User { code })
    }

    /// Names the particle (or target) concerned.
    #[must_use]
    pub fn at(mut self, particle: usize) -> Self {
        self.particle = Some(particle);
        self
    }

    /// Names the cutoff a neighbor provider should be built with before the call is tried again.
    #[must_use]
    pub fn wanting(mut self, cutoff: f64) -> Self {
        self.remedy = Some(Remedy::Cutoff(cutoff));
        self
    }

    /// Says that the whole set of `found` particles is too small, whatever the cutoff.
    pub(crate) fn lacking(mut self, found: usize, needed: usize) -> Self {
        // Both are less than the neighbors of a row; in 32 bits an error stays as small as it was.
        let [found, needed] = [found, needed].map(|count| u32::try_from(count).unwrap_or(u32::MAX));
        self.remedy = Some(Remedy::Particles { found, needed });
        self
    }

    /// The same refusal under another name.
    pub(crate) fn renamed(self, kind: impl Into<ErrorKind>) -> Self {
        Self { kind: kind.into(), ..self }
    }

    /// What went wrong, with its numbers.
    pub fn kind(&self) -> &ErrorKind {
        &self.kind
    }

    /// The particle (or target) it went wrong at, in the caller's numbering.
    pub fn particle(&self) -> Option<usize> {
        self.particle
    }

    /// The cutoff to build the neighbor provider with, where a wider one may help.
    pub fn wanted_cutoff(&self) -> Option<f64> {
        match self.remedy {
            Some(Remedy::Cutoff(cutoff)) => Some(cutoff),
            _ => None,
        }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(particle) = self.particle {
            write!(f, "particle {particle}: ")?;
        }
        self.kind.fmt(f)?;
        match self.remedy {
            Some(Remedy::Particles { found, needed }) => {
                write!(f, "; the whole set has {found} particles, at least {needed} are needed")
            }
            Some(Remedy::Cutoff(cutoff)) => {
                write!(f, "; a provider built with the cutoff {} may serve", cutoff.shown())
            }
            None => Ok(()),
        }
    }
}

impl fmt::Display for ErrorKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            ErrorKind::MultiIndex(kind) => kind.fmt(f),
            ErrorKind::Kernel(kind) => kind.fmt(f),
            ErrorKind::Domain(kind) => kind.fmt(f),
            ErrorKind::Particle(kind) => kind.fmt(f),
            ErrorKind::Neighbor(kind) => kind.fmt(f),
            ErrorKind::Operator(kind) => kind.fmt(f),
            ErrorKind::Io(kind) => kind.fmt(f),
            ErrorKind::Apply(kind) => kind.fmt(f),
            ErrorKind::Mesh(kind) => kind.fmt(f),
            ErrorKind::Linear(kind) => kind.fmt(f),
            ErrorKind::Boundary(kind) => kind.fmt(f),
            ErrorKind::Time(kind) => kind.fmt(f),
            ErrorKind::Solver(kind) => kind.fmt(f),
            ErrorKind::Report(kind) => kind.fmt(f),
            ErrorKind::User { code } => write!(f, "the caller's own error, code {code}"),
        }
    }
}

impl std::error::Error for Error {}

/// The kinds of [`Error`], grouped by the layer that refuses.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum ErrorKind {
    /// Multi-indices, degrees and orders.
    MultiIndex(MultiIndexError),
    /// Kernels and their derivation.
    Kernel(KernelError),
    /// Domains and their faces.
    Domain(DomainError),
    /// Positions, volumes, strengths, epsilon.
    Particle(ParticleError),
    /// Neighbor providers.
    Neighbor(NeighborError),
    /// Methods that turn a stencil into weights.
    Operator(OperatorError),
    /// Files written.
    Io(IoError),
    /// Applying rows to fields.
    Apply(ApplyError),
    /// Meshes, and what goes between them and particles.
    Mesh(MeshError),
    /// Sparse matrices and linear solves.
    Linear(LinearError),
    /// Boundary conditions.
    Boundary(BoundaryError),
    /// Steppers and step limits.
    Time(TimeError),
    /// Solvers: scenes and their steps.
    Solver(SolverError),
    /// Tables of samples and their pages.
    Report(ReportError),
    /// An error made by the caller's own code, see [`Error::user`].
    User {
        /// The number the caller chose.
        code: i64,
    },
}

macro_rules! from_kind {
    ($($variant:ident: $kind:ident),* $(,)?) => { $(
        impl From<$kind> for ErrorKind {
            fn from(kind: $kind) -> Self {
                ErrorKind::$variant(kind)
            }
        }
        impl From<$kind> for Error {
            fn from(kind: $kind) -> Self {
                Error::new(kind)
            }
        }
    )* };
}

from_kind! {
    MultiIndex: MultiIndexError,
    Kernel: KernelError,
    Domain: DomainError,
    Particle: ParticleError,
    Neighbor: NeighborError,
    Operator: OperatorError,
    Io: IoError,
    Apply: ApplyError,
    Mesh: MeshError,
    Linear: LinearError,
    Boundary: BoundaryError,
    Time: TimeError,
    Solver: SolverError,
    Report: ReportError,
}
