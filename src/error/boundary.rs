//! Why boundary conditions are refused.

use super::kinds;

kinds! {
    /// Refusals of boundary conditions.
    BoundaryError {
        /// A condition at a particle that does not exist, or is not among the targets of the provider.
        Particle {
            /// The particle named.
            particle: usize,
            /// Number of particles.
            particles: usize,
        } => "there is no particle {particle} among the {particles} of the set",
        /// Two conditions at one particle.
        Repeated {
            /// Place of the first one among the conditions.
            first: usize,
            /// Place of the second one.
            second: usize,
        } => "conditions {first} and {second} are both at this particle",
        /// A normal that is no unit vector.
        Normal {
            /// Its length.
            length: f64,
            /// How far the length may be from 1.
            tolerance: f64,
        } => "the normal has length {length}, not 1 to {tolerance:e}",
        /// Factors a and b that are both zero, or not finite.
        Factors {
            /// The factor of u.
            a: f64,
            /// The factor of du/dn.
            b: f64,
        } => "a u + b du/dn = g with a = {a} and b = {b} is no condition",
        /// A normal derivative that hardly depends on the value at its own particle.
        OwnWeight {
            /// The weight of that value in the sum of all absolute weights.
            share: f64,
            /// What is asked for.
            least: f64,
        } => "the value here has the share {share} in the weights of its normal derivative, not {least}",
        /// A right side g that is not finite.
        Value {
            /// The value.
            value: f64,
        } => "the right side of the condition is {value}",
    }
}
