//! Boxes and points from bytes.

use super::bytes::Bytes;
use crate::domain::{Domain, Face};
use crate::error::Result;
use crate::particles::Particles;

/// A box and points, before anything has looked at them.
#[derive(Clone, Debug)]
pub(super) struct Scene<const D: usize> {
    pub(super) lower: [f64; D],
    pub(super) upper: [f64; D],
    pub(super) faces: [[Face; 2]; D],
    pub(super) points: Vec<[f64; D]>,
}

/// Which parts of an input may be anything at all.
#[derive(Clone, Copy, Debug)]
pub(super) struct Wild(u8);

impl Wild {
    /// None for half of the bytes.
    pub(super) fn from(bytes: &mut Bytes) -> Self {
        let byte = bytes.byte();
        Self(if byte < 128 { 0 } else { byte })
    }

    pub(super) fn faces(self) -> bool {
        self.0 & 1 != 0
    }

    pub(super) fn points(self) -> bool {
        self.0 & 2 != 0
    }

    pub(super) fn lengths(self) -> bool {
        self.0 & 4 != 0
    }

    pub(super) fn particles(self) -> bool {
        self.0 & 8 != 0
    }

    pub(super) fn settings(self) -> bool {
        self.0 & 16 != 0
    }

    pub(super) fn nowhere(self) -> bool {
        self.0 & 31 == 0
    }
}

const FACES: [Face; 4] = [Face::Periodic, Face::Open, Face::MirrorEven, Face::MirrorOdd];

impl<const D: usize> Scene<D> {
    /// A box and `count` points at most.
    pub(super) fn from(bytes: &mut Bytes, wild: Wild, count: usize) -> Self {
        let (mut lower, mut upper, mut faces) = ([0.0; D], [1.0; D], [[Face::Periodic; 2]; D]);
        for axis in 0..D {
            let pair = [bytes.choose(FACES), bytes.choose(FACES)];
            let half = (pair[0] == Face::Periodic) != (pair[1] == Face::Periodic);
            faces[axis] = if half && !wild.faces() { [pair[0]; 2] } else { pair };
            let low = bytes.choose([0.0, 0.0, -0.3, 0.7, -1.0, 1e3]);
            let width = bytes.choose([1.0, 1.0, 1.0, 0.75, 1.5, 1e-6]);
            lower[axis] = bytes.or_any(wild.faces(), 8, low);
            upper[axis] = bytes.or_any(wild.faces(), 8, low + width);
            if faces[axis] == [Face::Open; 2] && bytes.once_in(2) {
                (lower[axis], upper[axis]) = (f64::NEG_INFINITY, f64::INFINITY);
            }
        }
        let points = points(bytes, wild, count, &lower, &upper);
        Self { lower, upper, faces, points }
    }

    pub(super) fn domain(&self) -> Result<Domain<D>> {
        Domain::new(self.lower, self.upper, self.faces)
    }

    pub(super) fn particles(&self) -> Result<Particles<D>> {
        Particles::new(self.points.clone())
    }

    /// The narrowest finite width, or 1.
    pub(super) fn width(&self) -> f64 {
        let widths = self.lower.iter().zip(&self.upper).map(|(lower, upper)| upper - lower);
        let narrow = widths.filter(|width| width.is_finite() && *width > 0.0).fold(f64::INFINITY, f64::min);
        if narrow.is_finite() { narrow } else { 1.0 }
    }
}

/// Points inside the box: anywhere, on a coarse grid, on a lattice with displacements, in a cluster.
fn points<const D: usize>(
    bytes: &mut Bytes,
    wild: Wild,
    count: usize,
    lower: &[f64; D],
    upper: &[f64; D],
) -> Vec<[f64; D]> {
    let corner: [f64; D] = std::array::from_fn(|axis| if lower[axis].is_finite() { lower[axis] } else { 0.0 });
    let widths: [f64; D] = std::array::from_fn(|axis| {
        let width = upper[axis] - lower[axis];
        if width.is_finite() && width > 0.0 { width } else { 1.0 }
    });
    let (shape, single) = (bytes.byte(), bytes.once_in(8));
    let side = (1..=count).rev().find(|side| side.pow(D as u32) <= count).unwrap_or(1);
    let wanted = if shape % 4 < 2 { side.pow(D as u32) } else { bytes.up_to(count) };
    let jitter = bytes.choose([0.0, 0.1, 0.3, 0.5]);
    let mut points: Vec<[f64; D]> = Vec::with_capacity(wanted);
    for i in 0..wanted {
        // A few stand where another one does.
        if shape & 64 != 0 && i > 0 && bytes.once_in(8) {
            points.push(points[bytes.up_to(i - 1)]);
            continue;
        }
        let mut rest = i;
        let point = std::array::from_fn(|axis| {
            let node = rest % side;
            rest /= side;
            let part = match shape % 4 {
                0 | 1 => {
                    let moved = if jitter > 0.0 { jitter * (f64::from(bytes.byte()) / 128.0 - 1.0) } else { 0.0 };
                    (node as f64 + 0.5 + moved) / side as f64
                }
                2 => f64::from(bytes.byte() % 9) / 8.0,
                _ if shape & 32 != 0 => 0.5 + 0.05 * bytes.fraction(),
                _ => bytes.fraction(),
            };
            let inside = (corner[axis] + part * widths[axis]).clamp(corner[axis], corner[axis] + widths[axis]);
            let inside = if single { f64::from(inside as f32) } else { inside };
            bytes.or_any(wild.points(), 64, inside)
        });
        points.push(point);
    }
    points
}
