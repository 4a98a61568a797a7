//! Why methods are refused.

use super::kinds;
use crate::stencil::Side;

kinds! {
    /// Refusals of the methods that turn a stencil into weights.
    OperatorError {
        /// Particles too far apart for the kernel.
        Overlap {
            /// h / epsilon at the worst particle.
            h_over_epsilon: f64,
            /// The largest legal value.
            limit: f64,
        } => "h/epsilon = {h_over_epsilon} is above {limit}, the kernels do not overlap enough",
        /// Discrete moments too far from their conditions.
        Moment {
            /// The relative defect at the worst particle.
            defect: f64,
            /// The largest legal value.
            limit: f64,
        } => "the discrete moments miss their conditions by {defect}, more than {limit}: the set is too irregular for a fixed kernel, DC-PSE solves for its weights",
        /// A target that is no particle, for an operator that needs f_p.
        NoCenter {
            /// Number of neighbors of the target.
            neighbors: usize,
        } => "the target is no particle (it has {neighbors} neighbors), so the difference f_q - f_p does not exist",
        /// No neighbor on the side that a one-sided derivative takes its sources from.
        EmptySide {
            /// Axis of the derivative.
            axis: usize,
            /// The side without neighbors.
            side: Side,
            /// Number of neighbors on the other side and beside the target.
            neighbors: usize,
        } => "axis {axis}: none of the {neighbors} neighbors is on the {side}",
        /// Too few neighbors on one side, or in places that do not determine a derivative.
        ThinSide {
            /// Axis of the derivative.
            axis: usize,
            /// The side.
            side: Side,
            /// Number of neighbors of the stencil on that side.
            neighbors: usize,
            /// Number of moment conditions.
            conditions: usize,
        } => "axis {axis}: the {neighbors} neighbors on the {side} do not determine the {conditions} moment conditions",
        /// Rows of a lower order than an operator made of them needs.
        LowOrder {
            /// The order of the rows; 0 where they state none.
            found: u32,
            /// The order needed.
            needed: u32,
        } => "the rows have order {found} where {needed} is needed",
        /// An odd image, for rows that tell the side of a source from the sign of its weight.
        OddImage {
            /// The source whose image it is.
            q: usize,
        } => "source {q} stands behind an odd mirror: build the rows for the velocities at hand instead",
        /// Weights that are not of the form f_q - f_p, where an operator needs them to be.
        NotDifference {
            /// The factor of f_p on the diagonal.
            found: f64,
            /// What odd images leave there.
            expected: f64,
        } => "the diagonal is {found} where differences f_q - f_p leave {expected}",
        /// Per-particle data for another number of particles.
        Length {
            /// Entries held.
            found: usize,
            /// Index that was needed.
            index: usize,
        } => "index {index} is beyond the {found} entries held",
        /// The strength form asked with an epsilon that varies.
        VariableEpsilon {
            /// Smallest epsilon.
            low: f64,
            /// Largest epsilon.
            high: f64,
        } => "the strength form conserves only with one epsilon, not {low} to {high}",
        /// A weight that is not finite.
        Weight {
            /// The neighbor.
            q: usize,
            /// The weight.
            weight: f64,
        } => "the weight of neighbor {q} is {weight}",
        /// A draft that a method has left in disorder.
        Draft {
            /// The target its stencil names.
            target: usize,
            /// Number of neighbors in its stencil.
            neighbors: usize,
            /// Number of weights.
            weights: usize,
        } => "the method left {weights} weights for {neighbors} neighbors of target {target}",
        /// A moment system without a solution.
        Singular {
            /// Number of neighbors n.
            neighbors: usize,
            /// Number of conditions l.
            conditions: usize,
            /// Rank of the conditions on this stencil.
            rank: usize,
        } => "the {neighbors} neighbors give the {conditions} moment conditions rank {rank} only",
        /// No neighbor but at the place of the particle, or so near that the square of the distance is 0.
        OnePlace {
            /// Number of neighbors n.
            neighbors: usize,
        } => "all {neighbors} neighbors lie at the place of the particle",
        /// Fewer neighbors than the moment conditions need.
        TooFew {
            /// Number of neighbors n.
            neighbors: usize,
            /// Number of conditions l.
            conditions: usize,
            /// The fewest legal neighbors.
            needed: usize,
        } => "{neighbors} neighbors are fewer than the {needed} needed for {conditions} moment conditions",
        /// A row whose moments miss their conditions by more than rounding.
        Uncertified {
            /// Number of neighbors n.
            neighbors: usize,
            /// Number of conditions l.
            conditions: usize,
            /// Rank of the conditions on this stencil.
            rank: usize,
            /// Estimated condition number.
            condition: f64,
            /// The largest miss, in scaled units.
            residual: f64,
            /// cutoff / epsilon.
            ratio: f64,
        } => "the {neighbors} neighbors miss the {conditions} moment conditions by {residual:e} (rank {rank}, condition {condition:e}, cutoff/epsilon {ratio})",
        /// A window that is flat or has vanished inside the cutoff.
        Window {
            /// cutoff / epsilon.
            ratio: f64,
            /// Smallest legal value.
            low: f64,
            /// Largest legal value.
            high: f64,
        } => "cutoff/epsilon = {ratio} is outside {low} to {high}",
        /// The '+' sign asked for an even degree.
        PlusEven {
            /// The degree.
            degree: u32,
        } => "the sign '+' belongs to odd degrees, not to {degree}",
        /// A degree the method does not serve.
        Degree {
            /// The degree.
            degree: u32,
            /// The smallest legal degree.
            low: u32,
        } => "degree {degree} is below {low}",
        /// A tolerance, limit or radius that is not positive.
        Setting {
            /// The value.
            value: f64,
        } => "setting {value} is not a positive number",
        /// A kernel that is neither even nor odd as its degree demands, where one value serves both partners of a pair.
        Parity {
            /// eta(z).
            value: f64,
            /// eta(-z).
            opposite: f64,
        } => "the kernel is {value:e} at one particle and {opposite:e} at its partner: it has not the parity of its degree",
    }
}
