//! What the table must show, asserted.

use crate::degenerate::Line;
use crate::study::Record;

/// A sentence about the table, and whether it is true; nothing is claimed where that is `None`.
pub struct Claim {
    pub text: String,
    pub holds: Option<bool>,
}

/// How far the observed order of even r may be from r: over interior particles on the jittered set, in the middle of the
/// box on the clustered one.
const BAND: f64 = 0.3;
/// Fewest sets whose order is claimed on the clustered set, where two share no lattice.
const FITTED: usize = 3;
/// Errors below this many times their rounding are not fitted.
const ABOVE_ROUNDING: f64 = 10.0;
/// The certificate lets a moment miss by sqrt(eps) max|b|, 1.5e-8: once for the quadratic part of the polynomial and
/// cutoff/epsilon = 2.2 times for the linear one.
const MISS: f64 = 3.2 * 1.5e-8;

/// Checks every claim against the tables.
pub fn check(records: &[Record], degenerate: &[Line]) -> Vec<Claim> {
    let mut claims = Vec::new();
    let mut claim = |holds: Option<bool>, text: String| claims.push(Claim { text, holds });

    for series in records.chunk_by(|a, b| a.key() == b.key()) {
        let Some(first) = series.first() else { continue };
        let (dim, set, operator, order) = first.key();
        let above: Vec<&Record> = series.iter().filter(|r| r.l2 > ABOVE_ROUNDING * r.floor).collect();
        let name = format!("{dim}D {operator}, r = {order}, {set}");
        let left = series.len() - above.len();
        let note = if left > 0 { format!(" ({left} of {} sets reach rounding)", series.len()) } else { String::new() };
        if above.len() < 2 {
            claim(None, format!("{name}: no order to observe, {} set above rounding{note}", above.len()));
            continue;
        }
        let (inner, middle) = (slope(&above, |r| r.l2), slope(&above, |r| r.l2_middle));
        let (fitted, claimed) = if set == "jittered" { (inner, true) } else { (middle, above.len() >= FITTED) };
        let text = format!("{name}: observed order {inner:.2} inside, {middle:.2} in the middle{note}");
        claim(claimed.then_some((fitted - f64::from(order)).abs() <= BAND), text);
    }

    let rows: usize = records.iter().map(|r| r.particles).sum();
    let certified: usize = records.iter().flat_map(|r| r.rungs).sum();
    let residual = records.iter().map(|r| r.residual).fold(0.0, f64::max);
    claim(
        Some(rows == certified),
        format!("all {rows} rows have a certificate; the largest residual is {residual:.1e}"),
    );

    for line in degenerate {
        let Line { name, operator, accepted, miss, dim, .. } = line;
        let all_refused = matches!(*name, "line" | "axis" | "plane");
        let some_refused = matches!(*name, "block and line") || (*name == "lattice n=l" && *operator == "laplacian");
        let holds = match (all_refused, some_refused) {
            (true, _) => line.singular == line.rows(),
            (_, true) => line.refused() > 0,
            _ => line.refused() == 0,
        };
        claim(
            Some(holds && *miss <= MISS),
            format!(
                "{dim}D {operator} on {name}: {accepted} of {} rows accepted, with an error of {miss:.0e} for a quadratic",
                line.rows()
            ),
        );
    }
    claims
}

/// Slope of the logarithm of an error over ln h by least squares.
fn slope(runs: &[&Record], error: fn(&Record) -> f64) -> f64 {
    let points: Vec<(f64, f64)> = runs.iter().map(|r| (r.h().ln(), error(r).ln())).collect();
    let count = points.len() as f64;
    let (mx, my) = points.iter().fold((0.0, 0.0), |(mx, my), (x, y)| (mx + x / count, my + y / count));
    let (xy, xx) =
        points.iter().fold((0.0, 0.0), |(xy, xx), (x, y)| (xy + (x - mx) * (y - my), xx + (x - mx) * (x - mx)));
    xy / xx
}
