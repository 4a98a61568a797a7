//! Why multi-indices are refused.

use super::kinds;

kinds! {
    /// Refusals of the multi-index layer.
    MultiIndexError {
        /// A degree |beta| above what is held.
        Degree {
            /// The degree asked for.
            degree: u32,
            /// The largest legal degree.
            limit: u32,
        } => "degree {degree} is above the limit {limit}",
        /// Terms of different degree in one expression.
        UnequalDegree {
            /// Degree of the first term.
            first: u32,
            /// Degree of the term that differs.
            other: u32,
        } => "a sum has one degree, not {first} and {other}; sweep operators of different degree side by side",
        /// A factor that is no finite number.
        Factor {
            /// The factor.
            factor: f64,
        } => "factor {factor} of a term is not finite",
        /// An order of accuracy out of range.
        Order {
            /// The order asked for.
            order: u32,
            /// Smallest legal order.
            low: u32,
            /// Largest legal order.
            high: u32,
        } => "order {order} is outside {low} to {high}",
        /// More moment conditions than can be counted.
        Count {
            /// Number of dimensions.
            dim: u32,
            /// Degree |beta|.
            degree: u32,
            /// Order r.
            order: u32,
        } => "the moment conditions of degree {degree} and order {order} in {dim} dimensions do not fit 128 bits",
        /// An expression without terms, or an output without terms.
        Empty {
            /// The output that has no term.
            output: usize,
        } => "output {output} has no term",
        /// A term for an output that does not exist.
        Output {
            /// The output named.
            output: usize,
            /// Number of outputs.
            outputs: usize,
        } => "output {output} does not exist among {outputs}",
    }
}
