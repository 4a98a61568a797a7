//! Where a caller allows rows to break their limits.

/// A set of targets.
#[derive(Clone, Debug, PartialEq)]
pub struct Targets {
    sorted: Vec<usize>,
}

/// Where a caller allows rows to break their limits.
///
/// ```
/// use parops::Allowance;
/// let some = Allowance::at([9, 5, 1]);
/// assert!(some.covers(1) && some.covers(9) && !some.covers(2));
/// assert!(Allowance::Everywhere.covers(2) && !Allowance::default().covers(1));
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Allowance {
    /// Nowhere: a breach fails the build.
    #[default]
    Nowhere,
    /// At these targets; made by [`Allowance::at`].
    At(Targets),
    /// Everywhere; the report still says where.
    Everywhere,
}

impl Allowance {
    /// At these targets, in any order.
    pub fn at(targets: impl IntoIterator<Item = usize>) -> Self {
        let mut sorted: Vec<_> = targets.into_iter().collect();
        sorted.sort_unstable();
        sorted.dedup();
        Self::At(Targets { sorted })
    }

    /// Whether it covers target p.
    pub fn covers(&self, p: usize) -> bool {
        match self {
            Self::Nowhere => false,
            Self::At(targets) => targets.sorted.binary_search(&p).is_ok(),
            Self::Everywhere => true,
        }
    }
}
