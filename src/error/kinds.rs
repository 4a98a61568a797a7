//! The kinds of error, one enum a layer; every variant carries the numbers that broke its rule.

use std::fmt;

/// Declares an enum of error kinds together with the sentence each variant is shown as.
macro_rules! kinds {
    ($(#[$doc:meta])* $name:ident { $( $(#[$vdoc:meta])* $variant:ident { $( $(#[$fdoc:meta])* $field:ident : $ty:ty ),* $(,)? } => $text:literal, )* }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq)]
        #[non_exhaustive]
        pub enum $name { $( $(#[$vdoc])* $variant { $( $(#[$fdoc])* $field: $ty ),* }, )* }

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                match self { $( $name::$variant { $( $field ),* } => write!(f, $text), )* }
            }
        }
    };
}

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

kinds! {
    /// Refusals of the kernel layer.
    KernelError {
        /// An order for which no such kernel exists.
        Order {
            /// The order asked for.
            order: u32,
        } => "full-space kernels exist for orders 2, 4, 6 and 8, not {order}",
        /// The exact derivation left the range of 128-bit integers, or would have too many monomials.
        Overflow {
            /// Degree |beta|.
            degree: u32,
            /// Order r.
            order: u32,
        } => "the exact kernel of degree {degree} and order {order} does not fit 128-bit rationals, or has too many monomials",
        /// A derivative of higher degree than the kernel has.
        Regularity {
            /// Degree asked for.
            degree: u32,
            /// Highest degree the kernel is differentiable to.
            limit: u32,
        } => "the kernel has derivatives to degree {limit}, not {degree}",
        /// A support radius or overlap limit that is not positive and finite, or whose square or volume is not.
        Radii {
            /// Support, in units of epsilon.
            support: f64,
            /// Largest h / epsilon.
            overlap_limit: f64,
        } => "support {support} and overlap limit {overlap_limit} must be positive and finite, the volume within too",
        /// A quadrature of too many points.
        Points {
            /// Number of points.
            points: f64,
            /// Largest legal number.
            limit: f64,
        } => "a quadrature of {points:e} points is beyond the {limit:e} allowed",
    }
}

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
        /// A strength or field value that is not finite.
        Strength {
            /// The value.
            value: f64,
        } => "value {value} is not finite",
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

kinds! {
    /// Refusals of the methods that turn a stencil into weights.
    OperatorError {
        /// Particles too far apart for the kernel.
        Overlap {
            /// h / epsilon at the worst particle.
            h_over_epsilon: f64,
            /// The largest legal value.
            limit: f64,
        } => "h/epsilon = {h_over_epsilon} is above {limit}, the kernels do not overlap enough",
        /// Discrete moments too far from their conditions.
        Moment {
            /// The relative defect at the worst particle.
            defect: f64,
            /// The largest legal value.
            limit: f64,
        } => "the discrete moments miss their conditions by {defect}, more than {limit}",
        /// A target that is no particle, for an operator that needs f_p.
        NoCenter {
            /// Number of neighbors of the target.
            neighbors: usize,
        } => "the target is no particle (it has {neighbors} neighbors), so the difference f_q - f_p does not exist",
        /// Per-particle data for another number of particles.
        Length {
            /// Entries held.
            found: usize,
            /// Index that was needed.
            index: usize,
        } => "index {index} is beyond the {found} entries held",
        /// The strength form asked with an epsilon that varies.
        VariableEpsilon {
            /// Smallest epsilon.
            low: f64,
            /// Largest epsilon.
            high: f64,
        } => "the strength form conserves only with one epsilon, not {low} to {high}",
        /// A weight that is not finite.
        Weight {
            /// The neighbor.
            q: usize,
            /// The weight.
            weight: f64,
        } => "the weight of neighbor {q} is {weight}",
        /// A moment system without a solution.
        Singular {
            /// Number of neighbors n.
            neighbors: usize,
            /// Number of conditions l.
            conditions: usize,
            /// Rank of the conditions on this stencil.
            rank: usize,
        } => "the {neighbors} neighbors give the {conditions} moment conditions rank {rank} only",
        /// Fewer neighbors than the moment conditions need.
        TooFew {
            /// Number of neighbors n.
            neighbors: usize,
            /// Number of conditions l.
            conditions: usize,
            /// The fewest legal neighbors.
            needed: usize,
        } => "{neighbors} neighbors are fewer than the {needed} needed for {conditions} moment conditions",
        /// A row whose moments miss their conditions by more than rounding.
        Uncertified {
            /// Number of neighbors n.
            neighbors: usize,
            /// Number of conditions l.
            conditions: usize,
            /// Rank of the conditions on this stencil.
            rank: usize,
            /// Estimated condition number.
            condition: f64,
            /// The largest miss, in scaled units.
            residual: f64,
            /// cutoff / epsilon.
            ratio: f64,
        } => "the {neighbors} neighbors miss the {conditions} moment conditions by {residual:e} (rank {rank}, condition {condition:e}, cutoff/epsilon {ratio})",
        /// A window that is flat or has vanished inside the cutoff.
        Window {
            /// cutoff / epsilon.
            ratio: f64,
            /// Smallest legal value.
            low: f64,
            /// Largest legal value.
            high: f64,
        } => "cutoff/epsilon = {ratio} is outside {low} to {high}",
        /// The '+' sign asked for an even degree.
        PlusEven {
            /// The degree.
            degree: u32,
        } => "the sign '+' belongs to odd degrees, not to {degree}",
        /// A degree the method does not serve.
        Degree {
            /// The degree.
            degree: u32,
            /// The smallest legal degree.
            low: u32,
        } => "degree {degree} is below {low}",
        /// A tolerance, limit or radius that is not positive.
        Setting {
            /// The value.
            value: f64,
        } => "setting {value} is not a positive number",
    }
}

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

kinds! {
    /// Refusals of steppers and step limits.
    TimeError {
        /// A step that is not positive and finite.
        Step {
            /// The step.
            dt: f64,
        } => "step {dt} is not positive and finite",
        /// A time that is not finite, or an end before the start.
        Span {
            /// Start.
            start: f64,
            /// End.
            end: f64,
        } => "the time span from {start} to {end} is not legal",
        /// A step too small to advance the time.
        NoProgress {
            /// Time.
            t: f64,
            /// The step.
            dt: f64,
        } => "at t = {t} a step of {dt} does not change the time",
        /// A step above the stability limit.
        Limit {
            /// The step.
            dt: f64,
            /// The limit.
            limit: f64,
        } => "step {dt} is above the stability limit {limit}",
        /// A right-hand side or state that is not finite.
        NotFinite {
            /// Stage of the stepper, from 1; one past the last for the new state.
            stage: usize,
            /// Time of the stage.
            t: f64,
        } => "stage {stage} at t = {t} is not finite",
        /// An operator some mode of which grows, so that no step is stable.
        Growing {
            /// The decay rate of that mode, negative.
            rate: f64,
        } => "a mode grows: its decay rate is {rate}, so no step is stable",
        /// A coefficient that is negative or not finite.
        Coefficient {
            /// The coefficient.
            value: f64,
        } => "coefficient {value} must be finite and not negative",
        /// A kernel that approximates no sum of second derivatives D^2_i.
        NotDiffusion {
            /// The degree of what it approximates.
            degree: u32,
        } => "a kernel of degree {degree} that approximates no sum of second derivatives along axes has no diffusion limit",
        /// A kernel that is not even along an axis.
        Uneven {
            /// Axis.
            axis: usize,
            /// Largest difference at mirrored points, relative to the kernel.
            defect: f64,
        } => "the kernel is not even along axis {axis}: mirrored points differ by {defect:e} of it",
        /// States of different shape in one step.
        Shape {
            /// Length found.
            found: usize,
            /// Length needed.
            needed: usize,
        } => "a state of length {found} where {needed} is needed",
    }
}
