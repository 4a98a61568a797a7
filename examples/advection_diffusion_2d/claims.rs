//! What the table must show, asserted.

use crate::record::Record;
use crate::runs::Method;

/// The order fitted over all sets lies within these.
const ORDERS: [(Method, f64, f64); 5] = [
    // The numerical viscosity is as large as D: order 1 is seen on finer sets only.
    (Method::Upwind, 0.6, 1.1),
    (Method::DcPse(2), 1.8, 2.5),
    (Method::DcPse(4), 3.6, 4.5),
    (Method::Moving(2), 1.8, 2.5),
    (Method::Moving(4), 3.6, 4.5),
];

/// Remeshing and exchanges between pairs keep the mass to this times the mass.
const ROUNDING: f64 = 1e-13;

/// Sentences about the table, and whether they are true.
pub fn check(records: &[Record]) -> Vec<(String, bool)> {
    let series = |method: Method| records.iter().filter(move |record| record.method == method);
    let mut claims = Vec::new();
    for (method, low, high) in ORDERS {
        let order = slope(series(method).map(|record| (record.n as f64, record.l2)));
        claims.push((
            format!("{}: order {order:.2}, between {low} and {high}", method.name()),
            (low..=high).contains(&order),
        ));
    }
    let error = |method: Method| series(method).next_back().map_or(f64::NAN, |record| record.l2);
    for (method, most) in
        [(Method::DcPse(2), 0.05), (Method::DcPse(4), 2e-3), (Method::Moving(2), 0.05), (Method::Moving(4), 2e-3)]
    {
        let error = error(method);
        claims.push((format!("{}: error {error:.1e}, at most {most:.0e}", method.name()), error <= most));
    }
    let most = |of: fn(&Record) -> f64, moves: bool| {
        let chosen = records.iter().filter(|record| moves == matches!(record.method, Method::Moving(_)));
        chosen.fold(0.0_f64, |most, record| most.max(of(record).abs()))
    };
    let kept = most(|record| record.drift, true);
    claims.push((format!("particles that move keep the mass: drift {kept:.1e}"), kept <= ROUNDING));
    let sums = most(|record| record.drift, false);
    let own = |method: Method| {
        series(method).fold(0.0_f64, |most, record| most.max((record.drift - record.drift_of_exact).abs()))
    };
    let [second, fourth] = [own(Method::DcPse(2)), own(Method::DcPse(4))];
    claims.push((
        format!(
            "sums over scattered particles drift by {sums:.1e}; of DC-PSE all but {second:.1e} (r = 2) \
             and {fourth:.1e} (r = 4) is so with exact values too"
        ),
        fourth > ROUNDING && fourth < 0.1 * second && second < sums && sums < 5e-3,
    ));
    let remeshed = records.iter().filter(|record| matches!(record.method, Method::Moving(_)));
    claims.push((
        "every step of them was remeshed".into(),
        remeshed.clone().all(|record| record.remeshings == record.steps),
    ));
    let viscous = series(Method::Upwind).all(|record| record.viscosity > 0.3 && record.min > 0.0 && record.max < 2.0);
    claims.push(("upwind stays within the extrema of the start, by a viscosity of its own".into(), viscous));
    claims
}

/// The least-squares slope of -ln(error) over ln(n).
fn slope(points: impl Iterator<Item = (f64, f64)>) -> f64 {
    let logs: Vec<(f64, f64)> = points.map(|(n, error)| (n.ln(), -error.ln())).collect();
    let count = logs.len() as f64;
    let (x, y) = logs.iter().fold((0.0, 0.0), |(x, y), log| (x + log.0 / count, y + log.1 / count));
    let (above, below) = logs
        .iter()
        .fold((0.0, 0.0), |(above, below), log| (above + (log.0 - x) * (log.1 - y), below + (log.0 - x) * (log.0 - x)));
    above / below
}
