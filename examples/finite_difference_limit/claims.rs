//! What the table must show, asserted.

use crate::limit::{Case, Outcome, Record};

/// A sentence about the table, and whether it is true.
pub struct Claim {
    pub text: String,
    pub holds: bool,
}

/// The bound of the issue on the distance from a finite difference where double precision allows it (errata 25).
const MISS: f64 = 1e-8;
/// A row this badly conditioned says so itself: with 16 digits, 10 are left.
const SUSPECT: f64 = 1e6;
/// Eq. 5.51 against the solve: the weights are at most 1/2 and 30 l eps of it, for l <= 6, is 2e-14.
const CLOSED: f64 = 2e-14;

/// eps cond(B) exp(c^2) at c = 3 is 4e-7: rounding of a miss in units of exp(-c^2).
const ROUNDING: f64 = 1e-6;

/// Checks every claim against the table.
pub fn check(records: &[Record]) -> Vec<Claim> {
    let rows = |case: Case| records.iter().filter(move |record| record.case == case);
    let largest = |case: Case, low: f64, high: f64| {
        let within = rows(case).filter(|record| (low..=high).contains(&record.c));
        within.map(|record| record.outcome.miss().unwrap_or(f64::INFINITY)).fold(0.0, f64::max)
    };
    let refused = |case: Case| rows(case).all(|record| matches!(record.outcome, Outcome::Refused(_)));
    let mut claims = Vec::new();
    let mut claim = |holds: bool, text: String| claims.push(Claim { text, holds });

    let fourth = [2.0, 2.5].map(|c| largest(Case::FirstFourth, c, c));
    claim(
        fourth.iter().all(|&miss| miss <= MISS),
        format!(
            "5.54: d/dx of order 4 misses 1/12, -2/3, 2/3, -1/12 by {:.1e} at c = 2 and {:.1e} at c = 2.5",
            fourth[0], fourth[1]
        ),
    );
    let second = largest(Case::FirstSecond, 1.0, 3.5);
    claim(second <= MISS, format!("5.52: d/dx of order 2 with cutoff h misses -1/2, 1/2 by at most {second:.1e}"));

    let closed = |record: &Record| match record.outcome {
        Outcome::Accepted { from_closed_form: Some(miss), .. } => miss,
        _ => f64::INFINITY,
    };
    let form = [Case::FirstSecond, Case::PlaneFirst].into_iter().flat_map(rows).map(closed).fold(0.0, f64::max);
    claim(form <= CLOSED, format!("5.51: at every c the weights of order 2 are its closed form to {form:.1e}"));

    // Where the polynomial is even along each axis, w is proportional to |k|^2 exp(-c^2 |k|^2) near the target, and
    // sum k_1^2 w = 2 makes the weight on the axis 1 - 4 exp(-c^2) to leading order from above; for the first
    // derivative w ~ k_1 exp(-c^2 |k|^2) makes it (1 - 2 exp(-c^2))/2.
    for (case, equation, factor) in [(Case::PlaneFirst, "5.52", 1.0), (Case::LaplacianShells, "5.53", 4.0)] {
        let accepted: Vec<(f64, f64)> =
            rows(case).filter_map(|record| Some((record.c, record.outcome.miss()?))).collect();
        let falls = accepted.windows(2).all(|pair| pair[1].1 < pair[0].1);
        let high = accepted.iter().map(|&(c, miss)| miss * (c * c).exp()).fold(0.0, f64::max);
        claim(
            accepted.len() >= 3 && falls && high <= factor * (1.0 + ROUNDING),
            format!("{equation}: {} comes closer with every c, miss <= {high:.2} exp(-c^2)", case.name()),
        );
    }

    let beyond: Vec<&Record> = rows(Case::FirstFourth).filter(|record| record.c > 3.0).collect();
    let told = |record: &&Record| record.outcome.condition().is_none_or(|condition| condition > SUSPECT);
    claim(
        !beyond.is_empty() && beyond.iter().all(told),
        format!("beyond c = 3 the {} rows of 5.54 have a condition above {SUSPECT:.0e} or are refused", beyond.len()),
    );
    let hats = Case::HATS.map(|case| largest(case, 1.0, 1.0));
    let nodes: Vec<usize> = Case::HATS.into_iter().flat_map(rows).map(|record| record.neighbors).collect();
    claim(
        nodes == [2, 4, 6] && hats.iter().all(|&miss| miss <= f64::EPSILON),
        format!(
            "000, eq. 31: PSE with the hat kernel on {nodes:?} nodes is the difference to {:.0e}",
            hats.into_iter().fold(0.0, f64::max)
        ),
    );
    let shells = largest(Case::LaplacianShells, 3.0, 3.0);
    claim(
        shells.is_finite() && shells > f64::EPSILON,
        format!("DC-PSE on 12 nodes is still {shells:.1e} away at c = 3, where the hat has 4 nodes and no error"),
    );
    claim(refused(Case::FirstFourthNear), "5.54 with cutoff h, two neighbors for five conditions, is refused".into());
    claim(refused(Case::LaplacianBlock), "the Laplacian on the block of 3 x 3 is refused (errata 21)".into());
    claims
}
