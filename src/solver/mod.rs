//! Advection-diffusion solvers.
//!
//! A scene ([`AdvectionDiffusion`]) names its physics, term by term; a solver makes the rows of a particle set from it
//! once, and knows before each step whether the step is legal ([`Limits`]). What a step did stands in the ledger
//! ([`LedgerRow`]).
//!
//! The scene, its coefficients, [`Limits`], [`Ledger`] and the policies know nothing of how the particles move: every
//! solver is made of them. [`SceneTerm`] is the seam of a term, [`Transport`] that of an advection scheme,
//! [`FlowDivergence`] that of div v, [`Edge`] that of the boundary. [`SemiDiscrete`] and [`Eulerian`] are for particles
//! that stay, [`Lagrangian`] for particles that the flow carries: there [`Flow`] and [`MovingDiffusion`] are the seams.

mod advection;
mod attempt;
mod carried;
mod central;
mod coefficient;
mod damping;
mod diffusion;
mod divergence;
mod edge;
mod eulerian;
mod fields;
mod flow;
mod growth;
mod lagrangian;
mod lagrangian_record;
mod lagrangian_step;
mod ledger;
mod limits;
mod moving;
mod moving_diffusion;
mod policy;
mod remeshing;
mod saved;
mod scene;
mod scheme;
mod semi_discrete;
mod sides;
mod source;
mod stabilized;
mod steady;
mod substeps;
mod symmetry;
mod term;
mod transport;
mod upwind;
mod upwind_dcpse;
mod watch;

pub use advection::{Advection, AdvectionRows};
pub use carried::{Carried, CarriedRows};
pub use central::{Central, CentralRows};
pub use coefficient::{Diffusivity, Steady, Velocity};
pub use diffusion::{Diffusion, DiffusionRows};
pub use divergence::{ComputedDivergence, DivergenceValues, FlowDivergence, GivenDivergence};
pub use edge::{Boundary, Bounded, BoundedState, Edge};
pub use eulerian::Eulerian;
pub use fields::Fields;
pub use flow::Flow;
pub use lagrangian::{COURANT, Lagrangian};
pub use ledger::{Ledger, LedgerRow, Totals};
pub use limits::{Limits, Rate};
pub use moving::{MovingScene, MovingState};
pub use moving_diffusion::{MovingDiffusion, MovingRows, MovingSettings};
pub use policy::{GrowthPolicy, StepPolicy};
pub use remeshing::{Remeshing, Trigger};
pub use saved::{SavedParticles, SavedRun};
pub use scene::{AdvectionDiffusion, NoTerms, Scene};
pub use scheme::{ImplicitScheme, Stages, TimeScheme};
pub use semi_discrete::SemiDiscrete;
pub use source::Source;
pub use stabilized::{Stabilized, StabilizedRows};
pub use steady::{SteadyState, steady};
pub use term::{SceneTerm, Site};
pub use transport::{Transport, TransportRows};
pub use upwind::OneSidedRows;
pub use upwind_dcpse::UpwindDcPseRows;
pub use watch::OverlapWatch;
