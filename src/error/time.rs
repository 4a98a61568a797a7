//! Why time steps are refused.

use super::kinds;

kinds! {
    /// Refusals of steppers and step limits.
    TimeError {
        /// A step that is not positive and finite.
        Step {
            /// The step.
            dt: f64,
        } => "step {dt} is not positive and finite",
        /// A time that is not finite, or an end before the start.
        Span {
            /// Start.
            start: f64,
            /// End.
            end: f64,
        } => "the time span from {start} to {end} is not legal",
        /// A step too small to advance the time.
        NoProgress {
            /// Time.
            t: f64,
            /// The step.
            dt: f64,
        } => "at t = {t} a step of {dt} does not change the time",
        /// A step above the stability limit.
        Limit {
            /// The step.
            dt: f64,
            /// The limit.
            limit: f64,
        } => "step {dt} is above the stability limit {limit}",
        /// A number of stages that is not legal.
        Stages {
            /// Number of stages.
            stages: u32,
            /// Smallest legal number.
            low: u32,
            /// Largest legal number.
            high: u32,
        } => "{stages} stages are outside {low} to {high}",
        /// A slope |Im lambda| / |Re lambda| of eigenvalues that is not legal, or none where the rows need one.
        Slope {
            /// The slope.
            slope: f64,
            /// Smallest legal slope.
            low: f64,
            /// Largest legal slope.
            high: f64,
        } => "a slope of {slope} for eigenvalues beside the real axis is outside {low} to {high}; rows that are not symmetric, as those of DC-PSE, need one",
        /// A right-hand side or state that is not finite.
        NotFinite {
            /// Stage of the stepper, from 1; one past the last for the new state.
            stage: usize,
            /// Time of the stage.
            t: f64,
        } => "stage {stage} at t = {t} is not finite",
        /// An operator some mode of which grows, so that no step is stable.
        Growing {
            /// The decay rate of that mode, negative.
            rate: f64,
        } => "a mode grows: its decay rate is {rate}, so no step is stable",
        /// A coefficient that is negative or not finite.
        Coefficient {
            /// The coefficient.
            value: f64,
        } => "coefficient {value} must be finite and not negative",
        /// A kernel that approximates no sum of second derivatives D^2_i.
        NotDiffusion {
            /// The degree of what it approximates.
            degree: u32,
        } => "a kernel of degree {degree} that approximates no sum of second derivatives along axes has no diffusion limit",
        /// A kernel that is not even along an axis.
        Uneven {
            /// Axis.
            axis: usize,
            /// Largest difference at mirrored points, relative to the kernel.
            defect: f64,
        } => "the kernel is not even along axis {axis}: mirrored points differ by {defect:e} of it",
        /// States of different shape in one step.
        Shape {
            /// Length found.
            found: usize,
            /// Length needed.
            needed: usize,
        } => "a state of length {found} where {needed} is needed",
    }
}
