//! The bands an observed order must lie in.

use crate::measure::{Observed, Series};
use crate::sets::Set;

/// How far the interior L2 order may be from the design order, for even and for odd r.
const EVEN: f64 = 0.1;
const ODD: f64 = 0.2;
/// How far the order in L-inf may stay below, and any order above, on sets that are no lattice.
const LINF: f64 = 0.35;
const ABOVE_EVEN: f64 = 0.5;
const ABOVE_ODD: f64 = 1.2;
/// How far the order at faces may stay below in one and two dimensions, and in three.
const FACE: f64 = 0.25;
const FACE_3D: f64 = 0.5;
/// Errors closer than this to their round-off floor are not fitted.
pub const ABOVE_FLOOR: f64 = 10.0;

/// The order in the interior: r, and r + 1 where r is odd and the shells of a lattice are whole.
pub fn design(set: Set, order: u32) -> f64 {
    f64::from(order + u32::from(set == Set::Lattice && order % 2 == 1))
}

/// Which bands are left, each in words.
pub fn violations(series: &Series, dimensions: usize, observed: &Observed) -> Vec<String> {
    let &Series { set, order, faces, .. } = series;
    let r = f64::from(order);
    let even = order.is_multiple_of(2);
    let mut found = Vec::new();
    // A comparison that NaN fails.
    let mut must = |holds: bool, what: &str, value: f64| {
        if !holds {
            found.push(format!("{what} {value:.2}"));
        }
    };
    let design = design(set, order);
    let band = if even || set == Set::Lattice { EVEN } else { ODD };
    let (l2, linf, face) = (observed.interior, observed.interior_linf, observed.face);
    must((l2 - design).abs() <= band, "L2", l2);
    if even {
        must(linf >= r - LINF, "L-inf", linf);
    }
    if set != Set::Lattice {
        must(linf <= r + if even { ABOVE_EVEN } else { ABOVE_ODD }, "L-inf", linf);
    }
    if faces {
        must(face >= r - if dimensions < 3 { FACE } else { FACE_3D }, "face", face);
    }
    must(observed.above_floor >= ABOVE_FLOOR, "error over floor", observed.above_floor);
    found
}
