//! Why domains are refused.

use super::kinds;

kinds! {
    /// Refusals of the domain.
    DomainError {
        /// Lower face not below the upper face, or a face that is not a number.
        Faces {
            /// Axis.
            axis: usize,
            /// Lower face.
            lower: f64,
            /// Upper face.
            upper: f64,
        } => "axis {axis}: lower face {lower} must be below upper face {upper}",
        /// An unbounded face that is periodic or a mirror.
        Unbounded {
            /// Axis.
            axis: usize,
            /// Lower face.
            lower: f64,
            /// Upper face.
            upper: f64,
        } => "axis {axis}: only an open face may lie at infinity, faces are {lower} and {upper}",
        /// A periodic face opposite one that is not.
        HalfPeriodic {
            /// Axis.
            axis: usize,
        } => "axis {axis}: a periodic face needs a periodic face opposite",
        /// A width whose images or squares leave the range of the arithmetic.
        Width {
            /// Axis.
            axis: usize,
            /// The width.
            width: f64,
            /// Smallest legal width.
            low: f64,
            /// Largest legal width.
            high: f64,
        } => "axis {axis}: width {width:e} is outside {low:e} to {high:e}",
        /// A closed axis narrower than two cutoffs, by more than round-off.
        Narrow {
            /// Axis.
            axis: usize,
            /// The width.
            width: f64,
            /// The cutoff.
            cutoff: f64,
        } => "axis {axis}: width {width} is below two cutoffs of {cutoff}, so images would be counted wrongly",
        /// A particle outside the box on an axis that does not wrap.
        Outside {
            /// Axis.
            axis: usize,
            /// Its coordinate.
            coordinate: f64,
            /// Lower face.
            lower: f64,
            /// Upper face.
            upper: f64,
        } => "axis {axis}: coordinate {coordinate} is outside [{lower}, {upper}]",
    }
}
