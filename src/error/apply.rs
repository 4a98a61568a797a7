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
        /// A value that is not finite, of one of several fields.
        FieldOf {
            /// Which field.
            field: usize,
            /// The value.
            value: f64,
        } => "field {field} is {value} here",
        /// As many results as fields were asked for, and the output holds another number.
        Fields {
            /// Fields of the output.
            found: usize,
            /// Fields of the input.
            needed: usize,
        } => "the output has {found} fields, the input {needed}",
        /// Strides with which values share a place or lie beyond the slice.
        Strides {
            /// Number of particles.
            particles: usize,
            /// Number of fields.
            fields: usize,
            /// From particle to particle and from field to field.
            strides: [usize; 2],
            /// Length of the slice.
            places: usize,
        } => "{fields} fields of {particles} particles do not fit {places} places with strides {strides:?}",
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
        /// A result that is not finite, of one of several fields.
        OverflowOf {
            /// Which field.
            field: usize,
            /// The result.
            value: f64,
        } => "the result of field {field} is {value} here: it overflows",
    }
}
