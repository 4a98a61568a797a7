//! The neighbors of one particle, as offsets: all that a method ever sees of the geometry.

/// One neighbor of a target p.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Neighbor<const D: usize> {
    /// Index of the source particle whose position or image this is.
    pub q: usize,
    /// x_p - x_q, with x_q the image meant.
    pub separation: [f64; D],
    /// +1, or -1 for an image behind an odd number of odd mirrors, where the field changes sign.
    pub sign: i8,
}

/// One side of a target along an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// Sources with x_q < x_p: upwind of a velocity above zero.
    Left,
    /// Sources with x_q > x_p: upwind of a velocity below zero.
    Right,
}

impl Side {
    /// Where a velocity component comes from; `None` for zero.
    ///
    /// ```
    /// use parops::Side;
    /// assert_eq!([2.0, 0.0, -1.0].map(Side::upwind), [Some(Side::Left), None, Some(Side::Right)]);
    /// ```
    pub fn upwind(velocity: f64) -> Option<Self> {
        if velocity > 0.0 {
            Some(Self::Left)
        } else if velocity < 0.0 {
            Some(Self::Right)
        } else {
            None
        }
    }

    /// +1 on the left, -1 on the right: the sign of x_p - x_q.
    #[inline(always)]
    pub fn sign(self) -> f64 {
        match self {
            Self::Left => 1.0,
            Self::Right => -1.0,
        }
    }
}

impl std::fmt::Display for Side {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Left => "left",
            Self::Right => "right",
        })
    }
}

/// The neighbors of one target, gathered into flat arrays that are reused from target to target.
///
/// The target's own particle, its center, is not among the neighbors; images of it may be.
///
/// ```
/// use parops::{Neighbor, Stencil};
/// let mut row = Stencil::<1>::default();
/// row.reset(7, Some(7), 0.5);
/// row.push(Neighbor { q: 3, separation: [0.25], sign: 1 });
/// assert_eq!((row.target(), row.len(), row.separations()[0]), (7, 1, [0.25]));
/// ```
#[derive(Clone, Debug)]
pub struct Stencil<const D: usize> {
    target: usize,
    center: Option<usize>,
    cutoff: f64,
    middle: [f64; D],
    sources: Vec<u32>,
    separations: Vec<[f64; D]>,
    signs: Vec<i8>,
    /// Room for sorting, kept so that sorting a row allocates nothing.
    sorting: Vec<Neighbor<D>>,
}

impl<const D: usize> Default for Stencil<D> {
    fn default() -> Self {
        Self {
            target: 0,
            center: None,
            cutoff: 0.0,
            middle: [0.0; D],
            sources: Vec::new(),
            separations: Vec::new(),
            signs: Vec::new(),
            sorting: Vec::new(),
        }
    }
}

impl<const D: usize> Stencil<D> {
    /// Empties the stencil and names the target it is about to hold; its allocations are kept.
    ///
    /// `center` is the source particle that is the target, or `None` off the particles.
    pub fn reset(&mut self, target: usize, center: Option<usize>, cutoff: f64) {
        (self.target, self.center, self.cutoff, self.middle) = (target, center, cutoff, [0.0; D]);
        self.sources.clear();
        self.separations.clear();
        self.signs.clear();
    }

    /// Names another target for the neighbors it holds.
    pub(crate) fn rename(&mut self, target: usize) {
        self.target = target;
    }

    /// Says that the neighbors were asked around another place m than the target, `middle` = x_p - m; call it after
    /// [`reset`](Self::reset), which sets it to zero.
    pub fn set_middle(&mut self, middle: [f64; D]) {
        self.middle = middle;
    }

    /// Adds a neighbor. Providers hold fewer than 2^32 sources, so that an index fits 32 bits.
    #[inline(always)]
    pub fn push(&mut self, neighbor: Neighbor<D>) {
        self.sources.push(neighbor.q as u32);
        self.separations.push(neighbor.separation);
        self.signs.push(neighbor.sign);
    }

    /// Adds as many sources as separations, of sign +1; room is made once.
    #[inline(always)]
    pub(crate) fn extend(&mut self, sources: impl Iterator<Item = u32>, separations: impl Iterator<Item = [f64; D]>) {
        self.sources.extend(sources);
        self.separations.extend(separations);
        self.signs.resize(self.sources.len(), 1);
    }

    /// Index p of the target.
    pub fn target(&self) -> usize {
        self.target
    }

    /// The source that is the target, or `None` off the particles.
    pub fn center(&self) -> Option<usize> {
        self.center
    }

    /// The cutoff r_c the neighbors were asked with.
    pub fn cutoff(&self) -> f64 {
        self.cutoff
    }

    /// x_p - m, m being the middle of the ball the neighbors were asked in: zero but for providers of upwind-biased
    /// stencils. Windows are centered there, polynomials stay at the target.
    pub fn middle(&self) -> [f64; D] {
        self.middle
    }

    /// Number of neighbors.
    pub fn len(&self) -> usize {
        self.sources.len()
    }

    /// Whether there is no neighbor.
    pub fn is_empty(&self) -> bool {
        self.sources.is_empty()
    }

    /// Source indices q.
    pub fn sources(&self) -> &[u32] {
        &self.sources
    }

    /// Separations x_p - x_q.
    pub fn separations(&self) -> &[[f64; D]] {
        &self.separations
    }

    /// Signs of the images.
    pub fn signs(&self) -> &[i8] {
        &self.signs
    }

    /// The neighbors one by one.
    pub fn iter(&self) -> impl Iterator<Item = Neighbor<D>> + '_ {
        (0..self.len()).map(|i| Neighbor {
            q: self.sources[i] as usize,
            separation: self.separations[i],
            sign: self.signs[i],
        })
    }

    /// Sorts the neighbors by separation (axis by axis, then sign, then source), which fixes the order of
    /// summation whatever the provider and, unless two neighbors lie at one place, the numbering.
    pub fn sort(&mut self) {
        let mut all = std::mem::take(&mut self.sorting);
        all.clear();
        all.extend(self.iter());
        all.sort_unstable_by(|a, b| {
            let axes = a.separation.iter().zip(&b.separation).map(|(x, y)| x.total_cmp(y));
            axes.fold(std::cmp::Ordering::Equal, |known, axis| known.then(axis))
                .then(a.sign.cmp(&b.sign))
                .then(a.q.cmp(&b.q))
        });
        let middle = self.middle;
        self.reset(self.target, self.center, self.cutoff);
        self.middle = middle;
        for &neighbor in &all {
            self.push(neighbor);
        }
        self.sorting = all;
    }
}
