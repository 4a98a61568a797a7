//! Why meshes and transfers are refused.

use super::kinds;

kinds! {
    /// Refusals of meshes and of the transfer between them and particles.
    MeshError {
        /// An axis of the domain that has no end.
        Infinite {
            /// Axis.
            axis: usize,
            /// Lower face.
            lower: f64,
            /// Upper face.
            upper: f64,
        } => "axis {axis}: a mesh needs finite faces, they are {lower} and {upper}",
        /// A number of values along an axis that is out of range.
        Count {
            /// Axis.
            axis: usize,
            /// The number.
            count: usize,
            /// Smallest legal number.
            low: usize,
            /// Largest legal number.
            high: usize,
        } => "axis {axis}: {count} values, where {low} to {high} are legal",
        /// More values than can be indexed.
        TooLarge {
            /// The product of the counts.
            values: f64,
            /// Largest legal number.
            limit: f64,
        } => "a mesh of {values:e} values is beyond the {limit:e} allowed",
        /// A particle whose support leaves a bounded mesh.
        Support {
            /// Axis.
            axis: usize,
            /// Its coordinate.
            coordinate: f64,
            /// Smallest coordinate with the whole support on the mesh.
            low: f64,
            /// Largest such coordinate; below `low` where the mesh has fewer nodes than the kernel.
            high: f64,
        } => "axis {axis}: the support at {coordinate} leaves the mesh, coordinates of {low} to {high} are within",
        /// An array of another length than the mesh has values.
        Length {
            /// Length found.
            found: usize,
            /// Number of values of the mesh.
            needed: usize,
        } => "{found} entries for a mesh of {needed} values",
        /// A value on the mesh that is not finite.
        Value {
            /// Its index.
            node: usize,
            /// Which field.
            field: usize,
            /// The value.
            value: f64,
        } => "field {field} is {value} at mesh value {node}",
        /// A threshold that is negative or not a number.
        Threshold {
            /// Which field.
            field: usize,
            /// The threshold.
            threshold: f64,
        } => "the threshold of field {field} is {threshold}, it must be 0 or more",
    }
}
