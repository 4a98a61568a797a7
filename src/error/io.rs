//! What writing files refuses.

super::kinds! {
    /// What writing files refuses.
    IoError {
        /// A name without characters.
        Unnamed {
            /// The field or file, counted from 0.
            entry: usize,
        } => "entry {entry} has no name",
        /// A name with a character that XML cannot hold, or not on one line.
        Name {
            /// The field or file, counted from 0.
            entry: usize,
            /// The character, counted from 0.
            place: usize,
            /// What it is.
            character: char,
        } => "the name of entry {entry} has the character {character:?} at {place}, which XML cannot hold",
        /// A name given twice.
        Repeated {
            /// The later field or file, counted from 0.
            entry: usize,
            /// The earlier one.
            first: usize,
        } => "entry {entry} has the name of entry {first}",
        /// A field with another number of values than there are particles.
        Length {
            /// The field, counted from 0.
            field: usize,
            /// Values given.
            found: usize,
            /// Values needed.
            needed: usize,
        } => "field {field} has {found} values for {needed} particles",
        /// A value that is not finite.
        Value {
            /// The field, counted from 0.
            field: usize,
            /// The component, counted from 0.
            component: usize,
            /// The value.
            value: f64,
        } => "component {component} of field {field} is {value}",
        /// A time that is not finite, or not above the time before.
        Time {
            /// The file, counted from 0.
            entry: usize,
            /// Its time.
            time: f64,
            /// The time before it, minus infinity for the first.
            last: f64,
        } => "entry {entry} has the time {time} after {last}",
        /// A writer that failed.
        Write {
            /// What it failed with.
            kind: std::io::ErrorKind,
            /// Number of bytes it had taken before.
            bytes: u64,
        } => "the writer failed after {bytes} bytes: {kind}",
    }
}
