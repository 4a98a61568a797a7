//! Why neighbor providers are refused.

use super::kinds;

kinds! {
    /// Refusals of neighbor providers.
    NeighborError {
        /// A cutoff that is not positive and finite.
        Cutoff {
            /// The cutoff.
            cutoff: f64,
        } => "cutoff {cutoff} is not positive and finite",
        /// A cutoff whose square leaves the range of the arithmetic.
        CutoffRange {
            /// The cutoff.
            cutoff: f64,
            /// Smallest legal value.
            low: f64,
            /// Largest legal value.
            high: f64,
        } => "cutoff {cutoff:e} is outside {low:e} to {high:e}",
        /// Points that the package of the feature `kiddo` makes no tree of.
        Tree {
            /// Points and images.
            entries: usize,
        } => "no k-d tree could be made of {entries} points and images",
        /// A skin that is negative or not finite.
        Skin {
            /// The skin.
            skin: f64,
        } => "skin {skin} is not a finite number from 0 on",
        /// A list that answers for another generation of the particles.
        Stale {
            /// Generation the list answers for.
            list: u64,
            /// Generation of the set.
            set: u64,
        } => "the list answers for generation {list} of the particles, not for {set}",
        /// A target that is not the particle of its own number, where every target must be one.
        NotParticle {
            /// The source that is the target; the number of sources where it is none.
            center: usize,
            /// Number of sources.
            sources: usize,
        } => "the target is source {center} of {sources}, not the one of its own number",
        /// A target without neighbors, where their mean distance is needed.
        Isolated {
            /// The cutoff.
            cutoff: f64,
        } => "no neighbor lies within the cutoff {cutoff}",
        /// A query beyond what the provider was built for.
        Reach {
            /// The cutoff asked for.
            cutoff: f64,
            /// The largest the provider answers.
            reach: f64,
        } => "cutoff {cutoff} is beyond the reach {reach}; build the provider with at least this cutoff",
        /// More cells along an axis than can be numbered exactly.
        Cells {
            /// Axis.
            axis: usize,
            /// Cells along it.
            cells: f64,
            /// Largest legal number.
            limit: f64,
        } => "axis {axis}: {cells:e} cells are more than {limit:e}",
        /// An axis that does not exist.
        Axis {
            /// The axis named.
            axis: usize,
            /// Number of axes D.
            axes: usize,
        } => "there is no axis {axis} among {axes}",
        /// Row offsets of a list that do not describe its rows.
        Offsets {
            /// Row at which they fail.
            row: usize,
            /// Offset found.
            found: usize,
            /// Offset needed at least (or exactly, for the last).
            needed: usize,
        } => "offset {found} of row {row} must be {needed}",
        /// A neighbor index that names no source.
        Source {
            /// The index.
            q: usize,
            /// Number of sources.
            sources: usize,
        } => "neighbor {q} does not exist among {sources} sources",
        /// A row that was gathered for another target than the one asked for.
        Misnamed {
            /// The target it names.
            found: usize,
        } => "the provider gathered the row of target {found}",
        /// The same image of the same source twice in one row.
        Repeated {
            /// The source.
            q: usize,
        } => "neighbor {q} stands twice in the row",
        /// The target itself in its own row.
        OwnCenter {
            /// The source that is the target.
            q: usize,
        } => "source {q} is the target itself and must not stand in its own row",
        /// A separation that is not finite.
        Separation {
            /// The source.
            q: usize,
            /// Axis.
            axis: usize,
            /// The separation.
            separation: f64,
        } => "neighbor {q}: separation {separation} on axis {axis} is not finite",
        /// A sign that is neither +1 nor -1.
        Sign {
            /// The source.
            q: usize,
            /// The sign.
            sign: i8,
        } => "neighbor {q}: sign {sign} must be 1 or -1",
        /// A neighbor farther away than the cutoff of its list.
        Distance {
            /// The source.
            q: usize,
            /// Its distance.
            distance: f64,
            /// The cutoff.
            cutoff: f64,
        } => "neighbor {q} at distance {distance} is beyond the cutoff {cutoff}",
        /// A target that does not exist.
        Target {
            /// The target.
            p: usize,
            /// Number of targets.
            targets: usize,
        } => "target {p} does not exist among {targets}",
    }
}
