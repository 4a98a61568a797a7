//! Why solvers refuse scenes and steps.

use std::fmt;

use super::kinds;

/// What bounds the step of a solver.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Limit {
    /// The diffusion term: D dt lambda_max of the actual rows.
    Diffusion,
    /// The advection term: the CFL condition of the actual rows.
    Advection,
    /// Compression of the flow: u div v.
    Compression,
    /// The source term: dS/du.
    Source,
    /// Hyperviscosity.
    Hyperviscosity,
    /// Distortion of a moving set: dt times the largest singular value of grad v, the Lagrangian CFL condition.
    Distortion,
}

impl Limit {
    /// All of them, in the order of their declaration.
    pub const ALL: [Self; 6] =
        [Self::Diffusion, Self::Advection, Self::Compression, Self::Source, Self::Hyperviscosity, Self::Distortion];

    /// Its name, in one lower-case word.
    pub fn name(self) -> &'static str {
        match self {
            Self::Diffusion => "diffusion",
            Self::Advection => "advection",
            Self::Compression => "compression",
            Self::Source => "source",
            Self::Hyperviscosity => "hyperviscosity",
            Self::Distortion => "distortion",
        }
    }
}

impl fmt::Display for Limit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

kinds! {
    /// Refusals of the advection-diffusion solvers.
    SolverError {
        /// A step above the limit of the moment.
        Limit {
            /// The step.
            dt: f64,
            /// The largest legal step.
            limit: f64,
            /// What binds it.
            binding: Limit,
        } => "step {dt} is above {limit}, to which {binding} binds it",
        /// More substeps than allowed would be needed.
        Substeps {
            /// The step.
            dt: f64,
            /// The largest legal step.
            limit: f64,
            /// What binds it.
            binding: Limit,
            /// The most substeps allowed.
            most: u32,
        } => "step {dt} is above {limit}, to which {binding} binds it, by more than {most} substeps make up for",
        /// A term no step is stable for with this stepper.
        Unstable {
            /// The term.
            term: Limit,
            /// The largest decay rate of a mode, in 1/time.
            decay: f64,
            /// The largest frequency of a mode, in 1/time.
            oscillation: f64,
            /// The negative real interval of the stepper.
            negative_real: f64,
            /// The imaginary interval of the stepper.
            imaginary: f64,
        } => "no step is stable for {term}: modes decay at up to {decay} and oscillate at up to {oscillation}, the stepper is stable to {negative_real} on the real and {imaginary} on the imaginary axis",
        /// Modes that grow whatever the step.
        Growing {
            /// The largest growth rate found, in 1/time.
            rate: f64,
            /// The spectral radius.
            radius: f64,
            /// The largest legal rate over radius.
            limit: f64,
        } => "modes grow at the rate {rate}, above {limit:e} of the spectral radius {radius}",
        /// Rows of the diffusion term whose coefficients make modes grow with every stepper.
        Contrast {
            /// The contrast of the diffusivities in the stencil.
            contrast: f64,
        } => "an arithmetic mean across a contrast of {contrast} grows at orders above 2",
        /// A set whose targets are not its particles, each in its place.
        Targets {
            /// Targets of the provider.
            targets: usize,
            /// Particles of the set.
            particles: usize,
        } => "the {targets} targets of the provider are not the {particles} particles",
        /// A velocity that is not finite.
        Velocity {
            /// Axis.
            axis: usize,
            /// The component.
            value: f64,
            /// Time.
            t: f64,
        } => "component {axis} of the velocity at t = {t} is {value}",
        /// A gradient of the velocity that is not finite.
        VelocityGradient {
            /// Its largest singular value.
            value: f64,
            /// Time.
            t: f64,
        } => "the largest singular value of the velocity gradient at t = {t} is {value}",
        /// A divergence of the velocity that is to be computed by a scheme without central rows, as upwind ones are.
        NoDivergence {
            /// Time.
            t: f64,
        } => "the divergence of the velocity at t = {t} is to be computed by the advection scheme, which has no central rows: give it as a function",
        /// A divergence of the velocity that is not finite.
        Divergence {
            /// The divergence.
            value: f64,
            /// Time.
            t: f64,
        } => "the divergence of the velocity at t = {t} is {value}",
        /// An image of a domain the provider does not name, where the divergence of a velocity is to be computed: behind a mirror
        /// its normal component is turned.
        UnknownImage {
            /// The particle whose image it is.
            q: usize,
        } => "an image of particle {q} is within reach, and the provider does not say of which domain",
        /// A flow across a mirror, where its divergence is to be computed: behind a mirror the normal component is turned.
        CrossesMirror {
            /// The axis of the mirror.
            axis: usize,
            /// The component along it, at the foot of the particle on the mirror.
            value: f64,
            /// Time.
            t: f64,
        } => "component {axis} of the velocity is {value} on the mirror beside it at t = {t}, where it must vanish for a divergence computed from images",
        /// A source, or its change with u, that is not finite.
        Source {
            /// The field.
            field: usize,
            /// Time.
            t: f64,
        } => "the source of field {field} at t = {t} is not finite",
        /// A velocity that depends on time, where a scene is to be at rest.
        Unsteady {
            /// The time at which it was asked for.
            t: f64,
        } => "the velocity depends on time: nothing is at rest at t = {t}",
        /// A source that is not affine in u, where a steady problem needs one.
        NotAffine {
            /// The field, the first of several.
            u: f64,
            /// The source there.
            found: f64,
            /// What an affine source would have there.
            expected: f64,
        } => "the source at u = {u} is {found}, where one affine in u would be {expected}",
        /// A steady problem to whose solution any constant may be added.
        OpenLevel {
            /// Number of particles.
            particles: usize,
        } => "nothing fixes the level of u at the {particles} particles: give a value somewhere, a Robin condition or a source that decays",
        /// Too few neighbors upstream for a row, and no inflow condition.
        NoUpstream {
            /// Axis along which the flow comes in, or the nearest one.
            axis: usize,
            /// The velocity along it.
            velocity: f64,
        } => "too little lies upstream along axis {axis} for a row, where the velocity is {velocity}: the value must be given there, by an inflow condition, at as many particles as the stencil reaches over",
        /// A volume of a moving particle that is not positive: it was compressed to nothing within a step.
        Volume {
            /// The volume.
            volume: f64,
            /// Time.
            t: f64,
        } => "the volume at t = {t} is {volume}, it must stay positive",
        /// The scheme of particles that move, where they stay.
        Stays {
            /// Number of particles.
            particles: usize,
        } => "the scheme is that of moving particles, these {particles} stay: name a scheme for v . grad u",
        /// A constant of the Lagrangian CFL condition that is not between 0 and 1.
        Courant {
            /// The constant.
            constant: f64,
        } => "dt times the largest singular value of grad v must stay below a number between 0 and 1, not {constant}",
        /// A remeshing kernel of less exactness than the order of the operator.
        Exactness {
            /// Exactness P of the kernel.
            exactness: u32,
            /// Order r of the operator.
            order: u32,
        } => "remeshing with exactness {exactness} would spoil the order {order} of the operator",
        /// A remeshing mesh whose axis is not that of the domain.
        MeshAxis {
            /// Axis.
            axis: usize,
            /// Faces of the mesh.
            mesh: [f64; 2],
            /// Faces of the domain.
            domain: [f64; 2],
        } => "axis {axis}: the mesh from {mesh:?} is not periodic where the domain from {domain:?} is, or the other way round, or with another period",
        /// Particles that have moved too far apart or too close together.
        OverlapLost {
            /// The largest hole, in spacings of the mesh.
            hole: f64,
            /// The largest legal hole.
            most: f64,
            /// The least gap, in spacings of the mesh; infinite above 1.
            gap: f64,
            /// The least legal gap.
            least: f64,
        } => "overlap is lost: the largest hole is {hole} spacings wide (at most {most}), the least gap {gap} (at least {least}): remesh, or take shorter steps",
        /// A mass that has drifted by more than its budget.
        Drift {
            /// The field.
            field: usize,
            /// Mass less mass at the start.
            drift: f64,
            /// sum_p |omega_p|.
            size: f64,
            /// The largest legal drift over size.
            budget: f64,
        } => "field {field}: the mass has drifted by {drift:e}, more than {budget:e} of {size:e}",
        /// A drift budget that is not positive.
        Budget {
            /// The budget.
            value: f64,
        } => "a drift budget is a positive number, not {value}",
        /// A remeshing trigger, or a watch, that would never, or always, be met.
        Trigger {
            /// Its number.
            value: f64,
        } => "remeshing cannot be triggered by {value}",
    }
}
