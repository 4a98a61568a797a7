//! The box the particles live in, and what lies behind each of its faces.

mod image;

pub(crate) use image::Image;

use crate::error::{DomainError, Result};
use crate::scale::Cutoff;

/// Smallest legal width of a box and smallest legal cutoff, 2^-200: squares stay far from underflow.
pub const LENGTH_LOW: f64 = f64::from_bits((1023 - 200) << 52);

/// Largest legal width of a box and largest legal cutoff, 2^200: squares stay far from overflow.
pub const LENGTH_HIGH: f64 = f64::from_bits((1023 + 200) << 52);

/// By how much a cutoff that is half a width by design may exceed it: h is rounded by 2 eps at most, and multiplied
/// twice, by epsilon/h and by the support.
const ROUND_OFF: f64 = 4.0 * f64::EPSILON;

/// What lies behind a face of the box.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Face {
    /// The box again, shifted by its width. Both faces of an axis are periodic, or none.
    Periodic,
    /// Nothing. Only an open face may lie at infinity.
    Open,
    /// The reflected box, in which a field keeps its sign (zero normal derivative at the face).
    MirrorEven,
    /// The reflected box, in which a field changes its sign (zero value at the face).
    MirrorOdd,
}

impl Face {
    fn is_mirror(self) -> bool {
        matches!(self, Self::MirrorEven | Self::MirrorOdd)
    }
}

/// A box with any mix of periodic, open and mirror faces, and the method of images for it.
///
/// The images of a source x_q are, axis by axis, x_q + k w (periodic, w = upper - lower, k = -1, 0, 1) and 2 f - x_q
/// (mirror at f); the images of several axes combine. A target sees each image within the cutoff as a neighbor, its
/// own images included. The separations are evaluated as
///
/// - direct: x_p - x_q,
/// - periodic: (x_p - x_q) - k w,
/// - mirror: (x_p - f) + (x_q - f),
///
/// so that they are the same bits in every provider, and exactly antisymmetric (symmetric along a mirrored axis) when
/// p and q change roles. The sign of an image is -1 behind an odd number of odd mirrors, otherwise +1.
///
/// Coordinates on periodic axes wrap into [lower, upper); on the others a particle must lie in [lower, upper].
///
/// ```
/// use parops::{Domain, Face};
/// let half_line = Domain::new([0.0], [f64::INFINITY], [[Face::MirrorOdd, Face::Open]])?;
/// assert_eq!(half_line.wrap(&[0.25])?, [0.25]);
/// let ring = Domain::periodic([0.0], [1.0])?;
/// assert_eq!(ring.wrap(&[-1e-17])?, [0.0]);
/// assert_eq!(ring.wrap(&[2.25])?, [0.25]);
/// # parops::Result::Ok(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Domain<const D: usize> {
    lower: [f64; D],
    upper: [f64; D],
    faces: [[Face; 2]; D],
}

impl<const D: usize> Domain<D> {
    /// All of space.
    pub fn open() -> Self {
        Self { lower: [f64::NEG_INFINITY; D], upper: [f64::INFINITY; D], faces: [[Face::Open; 2]; D] }
    }

    /// A box that is periodic along every axis.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn periodic(lower: [f64; D], upper: [f64; D]) -> Result<Self> {
        Self::new(lower, upper, [[Face::Periodic; 2]; D])
    }

    /// The box between `lower` and `upper`; `faces[axis]` is what lies behind its lower and its upper face.
    ///
    /// # Errors
    /// [`DomainError::Faces`] where lower < upper does not hold,
    /// [`DomainError::HalfPeriodic`] where one face of an axis is periodic and the other is not,
    /// [`DomainError::Unbounded`] where a face other than an open one is infinite,
    /// [`DomainError::Width`] where a finite width is outside [`LENGTH_LOW`] to [`LENGTH_HIGH`].
    pub fn new(lower: [f64; D], upper: [f64; D], faces: [[Face; 2]; D]) -> Result<Self> {
        for (axis, pair) in faces.into_iter().enumerate() {
            let (lower, upper) = (lower[axis], upper[axis]);
            if !(lower < upper) {
                return Err(DomainError::Faces { axis, lower, upper }.into());
            }
            if (pair[0] == Face::Periodic) != (pair[1] == Face::Periodic) {
                return Err(DomainError::HalfPeriodic { axis }.into());
            }
            let closed_at_infinity = |face: Face, at: f64| face != Face::Open && at.is_infinite();
            if closed_at_infinity(pair[0], lower) || closed_at_infinity(pair[1], upper) {
                return Err(DomainError::Unbounded { axis, lower, upper }.into());
            }
            let width = upper - lower;
            let finite = lower.is_finite() && upper.is_finite();
            if finite && !(LENGTH_LOW..=LENGTH_HIGH).contains(&width) {
                return Err(DomainError::Width { axis, width, low: LENGTH_LOW, high: LENGTH_HIGH }.into());
            }
        }
        Ok(Self { lower, upper, faces })
    }

    /// Lower corner.
    pub fn lower(&self) -> [f64; D] {
        self.lower
    }

    /// Upper corner.
    pub fn upper(&self) -> [f64; D] {
        self.upper
    }

    /// What lies behind the lower and upper face of every axis.
    pub fn faces(&self) -> [[Face; 2]; D] {
        self.faces
    }

    /// The places of the mirrors of an axis.
    pub(crate) fn mirrors(&self, axis: usize) -> impl Iterator<Item = f64> {
        let [lower, upper] = self.faces[axis];
        let places = [(lower, self.lower[axis]), (upper, self.upper[axis])];
        places.into_iter().filter_map(|(face, place)| face.is_mirror().then_some(place))
    }

    /// The same box with open faces in the place of mirrors.
    pub(crate) fn without_mirrors(&self) -> Self {
        let open = |face: Face| if face.is_mirror() { Face::Open } else { face };
        Self { faces: self.faces.map(|faces| faces.map(open)), ..*self }
    }

    /// The widths w_i = upper_i - lower_i.
    pub fn widths(&self) -> [f64; D] {
        std::array::from_fn(|axis| self.upper[axis] - self.lower[axis])
    }

    /// The volume prod_i w_i; infinite where a face is.
    pub fn volume(&self) -> f64 {
        self.widths().iter().product()
    }

    /// The point itself with its periodic coordinates wrapped into [lower, upper).
    ///
    /// The interval is half-open in floating point too: what would round to the upper face becomes the lower one.
    /// A point already inside keeps its bits.
    ///
    /// # Errors
    /// [`DomainError::Outside`] where a coordinate on an axis that does not wrap is outside [lower, upper] or is not
    /// a number, and where one on a periodic axis is not finite.
    #[inline]
    pub fn wrap(&self, point: &[f64; D]) -> Result<[f64; D]> {
        let mut wrapped = *point;
        for (axis, x) in wrapped.iter_mut().enumerate() {
            let (lower, upper) = (self.lower[axis], self.upper[axis]);
            let coordinate = *x;
            let legal = match self.faces[axis][0] {
                Face::Periodic => {
                    if !(lower <= coordinate && coordinate < upper) {
                        *x = wrap_into(coordinate, lower, upper);
                    }
                    coordinate.is_finite()
                }
                _ => lower <= coordinate && coordinate <= upper,
            };
            if !legal {
                return Err(DomainError::Outside { axis, coordinate, lower, upper }.into());
            }
        }
        Ok(wrapped)
    }

    /// Whether images are counted rightly up to this cutoff: an axis closed on both sides must be two cutoffs wide, to
    /// the 4 eps that a cutoff of so many spacings may be rounded by.
    ///
    /// That much less is safe: only below one cutoff would an image be missed, and the two images of one source that
    /// come within the cutoff are those that a width of exactly two cutoffs has at a tie, where both are in.
    ///
    /// # Errors
    /// [`DomainError::Narrow`] where it is not.
    pub fn admits(&self, cutoff: Cutoff) -> Result<()> {
        for (axis, faces) in self.faces.iter().enumerate() {
            let width = self.upper[axis] - self.lower[axis];
            let closed = faces[0] == Face::Periodic || faces.iter().all(|face| face.is_mirror());
            if closed && !(width >= 2.0 * cutoff.0 * (1.0 - ROUND_OFF)) {
                return Err(DomainError::Narrow { axis, width, cutoff: cutoff.0 }.into());
            }
        }
        Ok(())
    }
}

fn wrap_into(x: f64, lower: f64, upper: f64) -> f64 {
    let width = upper - lower;
    // The remainder is exact, so only the two sums can round across a face.
    let remainder = (x - lower) % width;
    let above = lower + if remainder < 0.0 { remainder + width } else { remainder };
    if lower <= above && above < upper { above } else { lower }
}
