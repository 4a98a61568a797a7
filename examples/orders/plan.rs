//! Which sets and waves the order of each operator is observed with.

use crate::measure::Series;
use crate::sets::Set;

/// Seeds whose median counts.
const SEEDS: u64 = 5;

impl Series {
    /// The series of all derivatives of one degree on one kind of set.
    pub fn plan<const D: usize>(set: Set, degree: u32, order: u32, conditions: usize) -> Self {
        let sides = match (D, set) {
            // The gaps of a Kronecker sequence are similar at Fibonacci numbers only.
            (1, Set::QuasiRandom) => [55, 89, 144, 233],
            (1, _) => [64, 102, 161, 256],
            // Between a wave too short for stencils at corners, 2.1 times as wide, and the floor there is little room.
            (2, _) if (order, degree) == (6, 3) => [24, 36, 54, 72],
            // Halton points fill the square evenly where their number is 2^a 3^b.
            (2, Set::QuasiRandom) => [24, 36, 72, 96],
            (2, _) => [24, 38, 60, 96],
            _ => [16, 24, 36, 54],
        };
        // Rows of many conditions take milliseconds.
        let most = [usize::MAX, 1500, 200][D - 1];
        let targets = if conditions > 50 { (most * 50 / conditions).max(60) } else { most };
        Self {
            set,
            even: false,
            order,
            sides: sides.to_vec(),
            wave: wave::<D>(degree, order),
            targets,
            seeds: if set == Set::Lattice { 1 } else { SEEDS },
            copies: if D == 2 && set != Set::Lattice { 4 } else { 1 },
            faces: true,
        }
    }
}

/// kappa times the radius of the stencil on the coarsest set: small enough that the leading error leads, at faces too,
/// where stencils are twice as wide; large enough that the finest set is far above rounding.
fn wave<const D: usize>(degree: u32, order: u32) -> f64 {
    match (order, degree) {
        (1, _) => 0.1,
        (2 | 3, _) => 0.3,
        (4, _) => 0.7,
        (_, 0 | 1) => 0.9,
        (_, 2) => 1.0,
        _ if D == 2 => 0.78,
        _ => 1.05,
    }
}
