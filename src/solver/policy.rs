//! What happens to steps and modes beyond their limits.

/// What a run does with a step above the limit of the moment.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum StepPolicy {
    /// It is refused before anything changes.
    #[default]
    Refuse,
    /// It is cut into substeps, each within the limit of its own moment; the ledger counts them. Remeshed particles have a
    /// turn to be replaced before each substep that would take their distortion since the last turn above its limit, so
    /// that a step cut for distortion gives what the shorter steps give.
    Adapt {
        /// The most substeps of one step; where more are needed the step is refused.
        most: u32,
    },
    /// It is taken, and the ledger says so.
    Allow,
}

/// What is done about modes that grow whatever the step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum GrowthPolicy {
    /// The largest growth rate is estimated when the rows are made, and refused above 1e-8 of the spectral radius; beside
    /// a term u div v above max div v/10, since truncation moves eigenvalues from zero there. Again where a flow has become
    /// twice as fast, or particles have moved to other neighbors, but not where a flow only turns.
    #[default]
    Refuse,
    /// It is estimated, and the ledger records it.
    Allow,
    /// Nothing is estimated, and the ledger records that.
    Unknown,
}
