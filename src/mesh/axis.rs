//! One axis of a mesh: where its values sit, and which of them a kernel reaches.

use super::Centering;
use crate::domain::{Domain, Face};
use crate::error::{MeshError, ParticleError, Result};
use crate::particles::COORDINATE_HIGH;

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Axis {
    lower: f64,
    upper: f64,
    spacing: f64,
    count: usize,
    periodic: bool,
    /// Where value 0 sits, in spacings: 0 for nodes, 1/2 for cells.
    start: f64,
    /// What a place in spacings may be off by: the coordinate is rounded, the distance from the face, and the quotient.
    round_off: f64,
}

impl Axis {
    pub(super) fn new<const D: usize>(
        domain: &Domain<D>,
        axis: usize,
        count: usize,
        centering: Centering,
    ) -> Result<Self> {
        let (lower, upper) = (domain.lower()[axis], domain.upper()[axis]);
        if !(lower.is_finite() && upper.is_finite()) {
            return Err(MeshError::Infinite { axis, lower, upper }.into());
        }
        let periodic = domain.faces()[axis][0] == Face::Periodic;
        let ends = !periodic && centering == Centering::Nodes;
        let (low, high) = (1 + usize::from(ends), super::Mesh::<1>::COUNT_HIGH);
        if !(low..=high).contains(&count) {
            return Err(MeshError::Count { axis, count, low, high }.into());
        }
        let intervals = (count - usize::from(ends)) as f64;
        let spacing = (upper - lower) / intervals;
        let start = if centering == Centering::Cells { 0.5 } else { 0.0 };
        let round_off = 4.0 * f64::EPSILON * (lower.abs().max(upper.abs()) / spacing + intervals);
        Ok(Self { lower, upper, spacing, count, periodic, start, round_off })
    }

    pub(super) fn spacing(&self) -> f64 {
        self.spacing
    }

    pub(super) fn point(&self, index: usize) -> f64 {
        (self.lower + (index as f64 + self.start) * self.spacing).clamp(self.lower, self.upper)
    }

    /// The first of the S values around x, before it is wrapped, and the place u of x in their middle, |u| <= 1/2.
    ///
    /// What is not finite gives values of no meaning, so that the hot loops need not ask again; see
    /// [`check`](Self::check).
    #[inline(always)]
    pub(super) fn locate<const S: usize>(&self, x: f64) -> (i64, f64) {
        let (mut distance, width) = (x - self.lower, self.upper - self.lower);
        if self.periodic && !(0.0 <= distance && distance < width) {
            distance %= width;
            distance += if distance < 0.0 { width } else { 0.0 };
        }
        let place = distance / self.spacing + (Self::middle::<S>() - self.start);
        let base = floor(place);
        let (first, u) = (base - Self::below::<S>(), (place - base as f64) - 0.5);
        if self.periodic || self.covers::<S>(first) { (first, u) } else { self.at_the_edge::<S>(first, u) }
    }

    /// A place on the edge of two cells belongs to the one whose support stays on the mesh; round-off of x decides
    /// nothing.
    #[cold]
    fn at_the_edge<const S: usize>(&self, first: i64, u: f64) -> (i64, f64) {
        if u <= self.round_off - 0.5 && self.covers::<S>(first - 1) {
            (first - 1, 0.5)
        } else if u >= 0.5 - self.round_off && self.covers::<S>(first + 1) {
            (first + 1, -0.5)
        } else {
            (first, u)
        }
    }

    /// 1/2 where the S values are centered on a value, 0 where on an interval.
    const fn middle<const S: usize>() -> f64 {
        if S % 2 == 1 { 0.5 } else { 0.0 }
    }

    /// How many of the S values come before the one that `locate` finds first.
    const fn below<const S: usize>() -> i64 {
        (S as i64 - 1) / 2
    }

    #[inline(always)]
    fn covers<const S: usize>(&self, first: i64) -> bool {
        first >= 0 && first + S as i64 <= self.count as i64
    }

    /// Refuses a coordinate that is not a legal number or whose S values leave the mesh.
    #[inline]
    pub(super) fn check<const S: usize>(&self, axis: usize, x: f64) -> Result<()> {
        if !(x.abs() <= COORDINATE_HIGH) {
            return Err(if x.is_finite() {
                ParticleError::Range { axis, value: x, high: COORDINATE_HIGH }.into()
            } else {
                ParticleError::Coordinate { axis, coordinate: x }.into()
            });
        }
        if self.periodic || self.covers::<S>(self.locate::<S>(x).0) {
            return Ok(());
        }
        let [low, high] = self.limits::<S>(0.0);
        Err(MeshError::Support { axis, coordinate: x, low, high }.into())
    }

    /// The coordinates between which the S values are on a bounded mesh, `inside` spacings away from them.
    fn limits<const S: usize>(&self, inside: f64) -> [f64; 2] {
        let shift = Self::below::<S>() as f64 - (Self::middle::<S>() - self.start);
        let ends = [inside, self.count as f64 - S as f64 + 1.0 - inside];
        ends.map(|first| self.lower + self.spacing * (first + shift))
    }

    /// Coordinates that surely pass [`check`](Self::check), so that most need no division there.
    pub(super) fn surely_legal<const S: usize>(&self) -> [f64; 2] {
        let limits = if self.periodic { [self.lower, self.upper] } else { self.limits::<S>(0.001 + self.round_off) };
        limits.map(|x| x.clamp(-COORDINATE_HIGH, COORDINATE_HIGH))
    }

    /// The S values from `first` on, wrapped, times the stride.
    #[inline(always)]
    pub(super) fn offsets<const S: usize>(&self, first: i64, stride: usize) -> [usize; S] {
        if self.covers::<S>(first) {
            return std::array::from_fn(|k| (first as usize + k) * stride);
        }
        std::array::from_fn(|k| (first + k as i64).rem_euclid(self.count as i64) as usize * stride)
    }
}

/// floor(x) for |x| < 2^31, without the library call that a baseline x86-64 needs for it.
#[inline(always)]
fn floor(x: f64) -> i64 {
    let truncated = x as i32;
    i64::from(truncated) - i64::from(f64::from(truncated) > x)
}
