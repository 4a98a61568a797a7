//! The rules for boxes, points and cutoffs, as they are documented: what may be refused and what must be.

use super::scene::Scene;
use crate::domain::{Face, LENGTH_HIGH, LENGTH_LOW};
use crate::error::{DomainError, Error, ErrorKind, NeighborError, ParticleError};
use crate::particles::COORDINATE_HIGH;

/// An axis closed on both sides is two cutoffs wide but for this, which covers the 4 eps of the rule.
const ROUND_OFF: f64 = 8.0 * f64::EPSILON;

/// The most cells along an axis, and how much finer than a cutoff they may be.
const CELLS_HIGH: f64 = (1_u64 << 53) as f64;
const FINEST: f64 = 0.125;

/// Two numbers that print alike: NaN is NaN.
pub(super) fn same(a: f64, b: f64) -> bool {
    a == b || (a.is_nan() && b.is_nan())
}

fn closed(faces: [Face; 2]) -> bool {
    !faces.contains(&Face::Open)
}

fn half_periodic(faces: [Face; 2]) -> bool {
    (faces[0] == Face::Periodic) != (faces[1] == Face::Periodic)
}

impl<const D: usize> Scene<D> {
    fn unbounded(&self, axis: usize) -> bool {
        let ends = [self.lower[axis], self.upper[axis]];
        self.faces[axis].iter().zip(ends).any(|(&face, end)| face != Face::Open && end.is_infinite())
    }

    fn wide(&self, axis: usize) -> bool {
        let (lower, upper) = (self.lower[axis], self.upper[axis]);
        let legal = LENGTH_LOW <= upper - lower && upper - lower <= LENGTH_HIGH;
        lower.is_finite() && upper.is_finite() && !legal
    }

    fn outside(&self, axis: usize, x: f64) -> bool {
        let inside = self.lower[axis] <= x && x <= self.upper[axis];
        if self.faces[axis][0] == Face::Periodic { !x.is_finite() } else { !inside }
    }

    /// The first number that makes the box, the points or the cutoff illegal, with the point it belongs to.
    pub(super) fn illegal(&self, points: &[[f64; D]], cutoff: f64) -> Option<(usize, f64)> {
        for axis in 0..D {
            let (lower, upper) = (self.lower[axis], self.upper[axis]);
            if !(lower < upper) || half_periodic(self.faces[axis]) || self.unbounded(axis) || self.wide(axis) {
                return Some((0, upper - lower));
            }
            if closed(self.faces[axis]) && upper - lower < 2.0 * cutoff * (1.0 - ROUND_OFF) {
                return Some((0, cutoff));
            }
        }
        if !(LENGTH_LOW..=LENGTH_HIGH).contains(&cutoff) {
            return Some((0, cutoff));
        }
        let coordinates =
            points.iter().enumerate().flat_map(|(p, point)| (0..D).map(move |axis| (p, axis, point[axis])));
        let bad = |&(_, axis, x): &(usize, usize, f64)| !(x.abs() <= COORDINATE_HIGH) || self.outside(axis, x);
        coordinates.into_iter().find(bad).map(|(p, _, x)| (p, x))
    }

    /// Whether the refusal names a rule that the box, the points or the cutoff break, with their numbers. `finest`: cells
    /// were to be made.
    pub(super) fn deserves(&self, error: &Error, points: &[[f64; D]], cutoff: f64, finest: bool) -> bool {
        let own = |axis: usize, x: f64| {
            error.particle().and_then(|p| points.get(p)).is_some_and(|point| axis < D && same(point[axis], x))
        };
        let ends = |axis: usize, lower: f64, upper: f64| {
            axis < D && same(self.lower[axis], lower) && same(self.upper[axis], upper)
        };
        match *error.kind() {
            ErrorKind::Domain(DomainError::Faces { axis, lower, upper }) => {
                ends(axis, lower, upper) && !(lower < upper)
            }
            ErrorKind::Domain(DomainError::HalfPeriodic { axis }) => axis < D && half_periodic(self.faces[axis]),
            ErrorKind::Domain(DomainError::Unbounded { axis, lower, upper }) => {
                ends(axis, lower, upper) && self.unbounded(axis)
            }
            ErrorKind::Domain(DomainError::Width { axis, width, low, high }) => {
                (low, high) == (LENGTH_LOW, LENGTH_HIGH)
                    && axis < D
                    && same(width, self.upper[axis] - self.lower[axis])
                    && self.wide(axis)
            }
            ErrorKind::Domain(DomainError::Narrow { axis, width, cutoff: found }) => {
                axis < D
                    && same(found, cutoff)
                    && width == self.upper[axis] - self.lower[axis]
                    && closed(self.faces[axis])
                    && !(width >= 2.0 * cutoff)
            }
            ErrorKind::Domain(DomainError::Outside { axis, coordinate, lower, upper }) => {
                own(axis, coordinate) && ends(axis, lower, upper) && self.outside(axis, coordinate)
            }
            ErrorKind::Particle(ParticleError::Coordinate { axis, coordinate }) => {
                own(axis, coordinate) && !coordinate.is_finite()
            }
            ErrorKind::Particle(ParticleError::Range { axis, value, high }) => {
                own(axis, value) && high == COORDINATE_HIGH && value.abs() > high
            }
            ErrorKind::Neighbor(NeighborError::Cutoff { cutoff: found }) => {
                same(found, cutoff) && !(cutoff > 0.0 && cutoff.is_finite())
            }
            ErrorKind::Neighbor(NeighborError::CutoffRange { cutoff: found, low, high }) => {
                (low, high) == (LENGTH_LOW, LENGTH_HIGH) && same(found, cutoff) && !(low <= cutoff && cutoff <= high)
            }
            ErrorKind::Neighbor(NeighborError::Cells { axis, cells, limit }) => {
                finest && axis < D && limit == CELLS_HIGH && cells > limit && self.cells(axis, points, cutoff) > limit
            }
            _ => false,
        }
    }

    /// More cells than points and images can need along an axis.
    fn cells(&self, axis: usize, points: &[[f64; D]], cutoff: f64) -> f64 {
        let along = points.iter().map(|point| point[axis]).filter(|x| x.is_finite());
        let (low, high) = along.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (x.min(low), x.max(high)));
        let extent = if self.faces[axis] == [Face::Open; 2] { high - low } else { self.upper[axis] - self.lower[axis] };
        // Images lie a cutoff outside, and a little for rounding.
        2.0 + (extent.max(high - low) + 3.0 * cutoff) / (FINEST * cutoff)
    }
}
