//! The bands an observed order must lie in.

use crate::measure::{Observed, Series};
use crate::sets::Set;

/// How far the interior L2 order may be from the design order, for even and for odd r.
const EVEN: f64 = 0.1;
const ODD: f64 = 0.2;
/// How far the order in L-inf may stay below, and any order above, on sets that are no lattice.
pub const LINF: f64 = 0.35;
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

/// What is measured, and between which limits it must lie.
pub struct Band {
    pub what: &'static str,
    pub low: f64,
    pub high: f64,
    pub value: f64,
}

/// The bands of what was observed: orders, and how far errors are above their floor.
pub fn bands(series: &Series, dimensions: usize, observed: &Observed) -> Vec<Band> {
    let &Series { set, order, faces, .. } = series;
    let r = f64::from(order);
    let even = order.is_multiple_of(2);
    let design = design(set, order);
    let off = if even || set == Set::Lattice { EVEN } else { ODD };
    let low = if even { r - LINF } else { f64::NEG_INFINITY };
    let high = match set {
        Set::Lattice => f64::INFINITY,
        _ => r + if even { ABOVE_EVEN } else { ABOVE_ODD },
    };
    let face = if faces { r - if dimensions < 3 { FACE } else { FACE_3D } } else { f64::NEG_INFINITY };
    let band = |what, low, high, value| Band { what, low, high, value };
    vec![
        band("L2", design - off, design + off, observed.interior),
        band("L-inf", low, high, observed.interior_linf),
        band("face", face, f64::INFINITY, observed.face),
        band("error over floor", ABOVE_FLOOR, f64::INFINITY, observed.above_floor),
    ]
}

/// Which bands are left, each in words; none may be NaN that is asked for.
pub fn violations(series: &Series, dimensions: usize, observed: &Observed) -> Vec<String> {
    let asked = |band: &Band| band.low > f64::NEG_INFINITY || band.high < f64::INFINITY;
    let left = |band: &Band| asked(band) && !(band.low <= band.value && band.value <= band.high);
    let bands = bands(series, dimensions, observed);
    bands.iter().filter(|band| left(band)).map(|Band { what, value, .. }| format!("{what} {value:.2}")).collect()
}
