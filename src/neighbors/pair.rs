//! A pair of particles, and what one of them receives from what the other does.

/// Two particles, or a particle and an image, as a [`HalfList`](crate::HalfList) visits them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pair<const D: usize> {
    /// The particle that receives the contribution.
    pub p: usize,
    /// The particle it comes from, or whose image it comes from.
    pub q: usize,
    /// x_p - x_q, with x_q the image meant.
    pub separation: [f64; D],
    /// +1, or -1 for an image behind an odd number of odd mirrors; +1 where the pair is mutual.
    pub sign: i8,
    /// Whether q receives its share in the same visit; the pair (q, p) is then not visited.
    pub mutual: bool,
}

/// How what q receives follows from what p receives, for one component of an interaction K.
///
/// Source: notes 001, sec. 2.3: K(p, q) = +/- K(q, p).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Symmetry {
    /// The negative: what one gains the other loses, as momentum or heat.
    Conserved,
    /// The same: both gain it, as a density or a count.
    Replicating,
}
