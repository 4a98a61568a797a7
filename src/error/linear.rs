//! Why matrices and linear solves are refused.

use super::kinds;

kinds! {
    /// Refusals of sparse matrices, of their solvers and of writing them; the particle of the error is the row.
    LinearError {
        /// An entry outside the matrix.
        Index {
            /// Its row.
            row: usize,
            /// Its column.
            column: usize,
            /// Number of rows.
            rows: usize,
            /// Number of columns.
            columns: usize,
        } => "entry ({row}, {column}) lies outside a matrix of {rows} rows and {columns} columns",
        /// An entry that is not finite.
        Entry {
            /// Its column.
            column: usize,
            /// The value.
            value: f64,
        } => "the entry in column {column} is {value}",
        /// More columns than their index type can name.
        Columns {
            /// Number of columns.
            columns: usize,
            /// Largest legal number.
            limit: usize,
        } => "{columns} columns are more than the {limit} an index can name",
        /// A matrix that must be square.
        NotSquare {
            /// Number of rows.
            rows: usize,
            /// Number of columns.
            columns: usize,
        } => "a matrix of {rows} rows and {columns} columns is not square",
        /// Two matrices, or a matrix and a vector, that do not fit.
        Length {
            /// Length found.
            found: usize,
            /// Length needed.
            needed: usize,
        } => "length {found} where {needed} is needed",
        /// A right-hand side or vector that is not finite.
        Value {
            /// The value.
            value: f64,
        } => "the vector is {value} here",
        /// An incomplete factor with a pivot that is zero to rounding.
        ZeroPivot {
            /// The pivot.
            pivot: f64,
            /// Largest entry of the row.
            largest: f64,
        } => "pivot {pivot:e} is zero beside the largest entry {largest:e} of its row",
        /// A matrix that is singular to working precision.
        Singular {
            /// Estimated condition number, infinite where a pivot is zero.
            condition: f64,
        } => "the matrix is singular to working precision: its condition is {condition:e}",
        /// An iteration that ended above its tolerance.
        NotConverged {
            /// Number of iterations.
            iterations: usize,
            /// The relative residual reached.
            residual: f64,
            /// The relative residual asked for.
            tolerance: f64,
        } => "relative residual {residual:e} after {iterations} iterations is above {tolerance:e}",
        /// Modes that grow faster than they may, whatever the strength of the stabilization.
        Growing {
            /// The estimated rate of growth.
            abscissa: f64,
            /// The largest legal rate.
            limit: f64,
            /// The strongest stabilization tried.
            gamma: f64,
        } => "modes grow at the rate {abscissa:e}, above {limit:e}, even with gamma = {gamma}",
        /// A setting out of range.
        Setting {
            /// The value.
            value: f64,
            /// Smallest legal value.
            low: f64,
            /// Largest legal value.
            high: f64,
        } => "setting {value} is outside {low} to {high}",
        /// A writer that failed.
        Write {
            /// What it failed with.
            kind: std::io::ErrorKind,
            /// Number of bytes it had taken before.
            bytes: u64,
        } => "the writer failed after {bytes} bytes: {kind}",
    }
}
