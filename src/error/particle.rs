//! Why particle sets are refused.

use super::kinds;

kinds! {
    /// Refusals of particle sets and of what belongs to particles.
    ParticleError {
        /// A coordinate that is not finite.
        Coordinate {
            /// Axis.
            axis: usize,
            /// The coordinate.
            coordinate: f64,
        } => "axis {axis}: coordinate {coordinate} is not finite",
        /// A coordinate or extent outside the legal range.
        Range {
            /// Axis.
            axis: usize,
            /// The coordinate or extent.
            value: f64,
            /// Largest legal magnitude.
            high: f64,
        } => "axis {axis}: magnitude {value:e} is above {high:e}",
        /// A volume that is not positive and finite.
        Volume {
            /// The volume.
            volume: f64,
        } => "volume {volume} is not positive and finite",
        /// An epsilon that is not positive and finite.
        Epsilon {
            /// The epsilon.
            epsilon: f64,
        } => "epsilon {epsilon} is not positive and finite",
        /// A spacing that is not positive and finite.
        Spacing {
            /// The spacing.
            spacing: f64,
        } => "spacing {spacing} is not positive and finite",
        /// A diffusivity that is negative or not finite.
        Diffusivity {
            /// The diffusivity.
            diffusivity: f64,
        } => "diffusivity {diffusivity} is negative or not finite",
        /// A diffusion tensor with an entry that is not finite.
        TensorEntry {
            /// Row i.
            row: usize,
            /// Column j.
            column: usize,
            /// D_ij.
            entry: f64,
        } => "the diffusion tensor has the entry D[{row}][{column}] = {entry}",
        /// A diffusion tensor that is not symmetric.
        Asymmetric {
            /// Row i.
            row: usize,
            /// Column j.
            column: usize,
            /// D_ij.
            upper: f64,
            /// D_ji.
            lower: f64,
        } => "the diffusion tensor is not symmetric: D[{row}][{column}] = {upper}, D[{column}][{row}] = {lower}",
        /// A diffusion tensor with a negative eigenvalue.
        Indefinite {
            /// The smallest eigenvalue.
            smallest: f64,
            /// The largest eigenvalue.
            largest: f64,
        } => "the diffusion tensor has the eigenvalue {smallest:e}, beside {largest:e}",
        /// A velocity component that is not finite.
        Velocity {
            /// Axis.
            axis: usize,
            /// The component.
            velocity: f64,
        } => "axis {axis}: velocity {velocity} is not finite",
        /// A coefficient that is not finite.
        Coefficient {
            /// The output it multiplies.
            output: usize,
            /// The coefficient.
            coefficient: f64,
        } => "the coefficient of output {output} is {coefficient}",
        /// Two arrays that belong together have different lengths.
        Length {
            /// Length found.
            found: usize,
            /// Length needed.
            needed: usize,
        } => "{found} entries where {needed} are needed",
        /// More particles than the index type holds.
        TooMany {
            /// Number of particles.
            count: usize,
            /// Largest legal number.
            limit: usize,
        } => "{count} particles are more than the {limit} an index can name",
        /// Volumes were asked of particles that have none.
        NoVolumes {
            /// Number of particles.
            count: usize,
        } => "these {count} particles carry no volumes; SPH and PSE need them, see Particles::with_volumes",
        /// A set that this construction needs to be larger.
        TooFew {
            /// Number of particles.
            count: usize,
            /// Smallest legal number.
            needed: usize,
        } => "{count} particles are fewer than the {needed} needed",
        /// Two particles at one place, where that has no meaning.
        Coincident {
            /// The other particle.
            other: usize,
        } => "lies on particle {other}",
        /// A displacement from the lattice that leaves the cell.
        Jitter {
            /// The displacement in units of the spacing.
            amount: f64,
            /// Largest legal value.
            high: f64,
        } => "jitter {amount} is outside 0 to {high} spacings",
        /// Memory that the system does not give.
        Memory {
            /// Number of entries asked for.
            count: usize,
        } => "there is no memory for {count} entries",
    }
}
