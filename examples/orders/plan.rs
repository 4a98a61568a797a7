//! Which sets and waves the order of each operator is observed with.

use crate::measure::Series;
use crate::sets::Set;

/// Seeds whose median counts.
const SEEDS: u64 = 5;

/// Numbers of particles the order is fitted over on a quasi-random set. Such a set is locally a lattice, which changes
/// with N and the constant of the error with it: 4 numbers would fit the change.
const QUASI_RANDOM: usize = 28;

impl Series {
    /// The series of all derivatives of one degree on one kind of set.
    pub fn plan<const D: usize>(set: Set, degree: u32, order: u32, conditions: usize) -> Self {
        let sides = [&[64, 102, 161, 256], &[24, 38, 60, 96], &[16, 24, 36, 54]][D - 1];
        // Rows of many conditions take milliseconds.
        let most = [usize::MAX, 600, 200][D - 1];
        let targets = if conditions > 50 { (most * 50 / conditions).max(60) } else { most };
        let mut series = Self {
            set,
            even: false,
            order,
            sides: sides.to_vec(),
            wave: wave(degree, order),
            targets,
            seeds: if set == Set::Lattice { 1 } else { SEEDS },
            faces: true,
        };
        if set == Set::QuasiRandom {
            let refined = (sides[3] as f64 / sides[0] as f64).powf(1.0 / (QUASI_RANDOM - 1) as f64);
            let side = |i: usize| (sides[0] as f64 * refined.powi(i as i32)).round() as usize;
            series.sides = (0..QUASI_RANDOM).map(side).collect();
            series.targets = (targets / (QUASI_RANDOM / 4)).max(10);
        }
        series
    }
}

/// kappa times the radius of the stencil on the coarsest set: small enough that the leading error leads, at faces too,
/// where stencils are twice as wide; large enough that the finest set is far above rounding.
fn wave(degree: u32, order: u32) -> f64 {
    match (order, degree) {
        (1, _) => 0.1,
        (2 | 3, _) => 0.3,
        (4, _) => 0.7,
        (_, 0 | 1) => 0.9,
        _ => 1.1,
    }
}
