//! Why applications are refused.

use super::kinds;

kinds! {
    /// Refusals when rows are applied to fields.
    ApplyError {
        /// An input field of the wrong length.
        Input {
            /// Length found.
            found: usize,
            /// Length needed.
            needed: usize,
        } => "the field has {found} values, the operator reads {needed}",
        /// An output of the wrong length.
        Output {
            /// Length found.
            found: usize,
            /// Length needed.
            needed: usize,
        } => "the output has {found} places, the operator writes {needed}",
        /// A field value that is not finite.
        Field {
            /// The value.
            value: f64,
        } => "the field is {value} here",
        /// Rows that belong to another generation of the particles.
        Stale {
            /// Generation the rows were made from.
            rows: u64,
            /// Generation of the set.
            set: u64,
        } => "the rows were built for generation {rows} of the particles, not for {set}",
        /// A result that is not finite, although field and weights are.
        Overflow {
            /// The result.
            value: f64,
        } => "the result is {value} here: it overflows",
    }
}
