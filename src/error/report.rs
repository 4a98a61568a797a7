//! What tables of samples and their pages refuse.

super::kinds! {
    /// What tables of samples and their pages refuse.
    ReportError {
        /// A sample without a name it must have.
        Unnamed {
            /// The sample, counted from 0.
            sample: usize,
            /// The column.
            column: &'static str,
        } => "sample {sample} has no {column}",
        /// A number that is not finite, or below zero.
        Value {
            /// The sample, counted from 0.
            sample: usize,
            /// The column.
            column: &'static str,
            /// The number.
            value: f64,
        } => "sample {sample}: {column} is {value}, where finite numbers from 0 on are legal",
        /// A first line that does not name the columns of a table.
        Header {
            /// The first column that differs, counted from 0.
            column: usize,
        } => "the header differs from that of a table in column {column}",
        /// A line with another number of cells than there are columns.
        Cells {
            /// The line, counted from 1.
            line: usize,
            /// Cells found.
            found: usize,
            /// Cells needed.
            needed: usize,
        } => "line {line} has {found} cells for {needed} columns",
        /// A cell that is no number its column can hold.
        Number {
            /// The line, counted from 1.
            line: usize,
            /// The column.
            column: &'static str,
        } => "line {line}: the {column} cannot be read as a number",
        /// A quoted cell without an end, or with more behind it.
        Quote {
            /// The line on which it begins, counted from 1.
            line: usize,
        } => "line {line} has a quoted cell that does not end where its cell ends",
        /// A total that is not the sum of its parts.
        Total {
            /// The line, counted from 1.
            line: usize,
            /// What it says.
            found: f64,
            /// The sum.
            sum: f64,
        } => "line {line}: the total is {found}, its parts add up to {sum}",
        /// Numbers of runs that cannot be.
        Repeats {
            /// Fewest runs.
            least: usize,
            /// Most runs.
            most: usize,
        } => "from {least} to {most} runs, where 1 and more are legal, and no more than the most",
        /// A figure or a note of a scene that has no samples.
        NoSamples {
            /// Which of the two.
            item: &'static str,
            /// Its number among its kind, counted from 0.
            place: usize,
        } => "{item} {place} is of a scene without samples",
        /// A figure that is not one SVG element.
        NotSvg {
            /// The figure, counted from 0.
            figure: usize,
        } => "figure {figure} does not begin with <svg and end with </svg>",
    }
}
