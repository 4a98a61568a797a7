//! What the table must show, asserted. Nothing is said about seconds.

use crate::lost::Wound;
use crate::record::Record;
use crate::runs::Method;

/// The order observed at T/2 over the two finest sets lies within these.
const ORDERS: [(Method, f64, f64); 8] = [
    // The numerical viscosity |v| h/sqrt(pi) still is as large as what the swirl does: order 1 is far.
    (Method::Upwind, 0.4, 1.1),
    (Method::Biased, 2.2, 3.3),
    (Method::Central(2), 1.6, 2.4),
    (Method::Central(4), 3.2, 4.5),
    (Method::Remeshed(2, 1), 1.9, 2.6),
    (Method::Remeshed(2, 2), 1.9, 2.6),
    (Method::Remeshed(4, 2), 3.5, 4.6),
    (Method::Remeshed(4, 4), 3.5, 4.6),
];

/// Sentences about the table, and whether they are true.
pub fn check(records: &[Record], wound: &[Wound; 2]) -> Vec<(String, bool)> {
    let series = |method: Method| records.iter().filter(move |record| record.method == method);
    let finest = |method: Method| series(method).next_back();
    let mut claims = Vec::new();
    for (method, low, high) in ORDERS {
        let runs: Vec<&Record> = series(method).collect();
        let order = match runs[..] {
            [.., a, b] => (a.half / b.half).ln() / (b.n as f64 / a.n as f64).ln(),
            _ => f64::NAN,
        };
        let text = format!("{}: order {order:.2} at T/2, between {low} and {high}", method.name());
        claims.push((text, (low..=high).contains(&order)));
    }
    claims.extend(ranks(&finest));
    claims.extend(masses(records));
    claims.extend(overlap(records));
    claims.extend(winding(wound));
    claims
}

/// Which method is how much better on the finest sets.
fn ranks<'a>(finest: &impl Fn(Method) -> Option<&'a Record>) -> Vec<(String, bool)> {
    let half = |method| finest(method).map_or(f64::NAN, |record| record.half);
    let end = |method| finest(method).map_or(f64::NAN, |record| record.l2);
    let (upwind, biased) = (half(Method::Upwind), half(Method::Biased));
    let (central, remeshed) = (half(Method::Central(4)), half(Method::Remeshed(4, 2)));
    let home = half(Method::Central(2)) / end(Method::Central(2));
    let free = end(Method::Free);
    vec![
        (
            format!("upwind DC-PSE of order 3 is {:.0} times as accurate as order 1", upwind / biased),
            biased < upwind / 10.0,
        ),
        (
            format!("Lambda 4 2 and DC-PSE of order 4 are better than 2 %: {remeshed:.1e}, {central:.1e}"),
            remeshed.max(central) < 0.02,
        ),
        (format!("central DC-PSE of order 2 comes home {home:.1} times as accurate as it was at T/2"), home > 3.0),
        (format!("particles that are not remeshed come home: {free:.1e}"), free < 1e-4),
    ]
}

/// Remeshing keeps the mass to this times the mass.
const ROUNDING: f64 = 1e-13;

fn masses(records: &[Record]) -> Vec<(String, bool)> {
    let most = |of: fn(Method) -> bool| {
        records.iter().filter(|record| of(record.method)).fold(0.0_f64, |most, record| most.max(record.drift.abs()))
    };
    let carried = most(|method| !method.stays());
    let central = most(|method| matches!(method, Method::Central(_)));
    let upwind = most(|method| method == Method::Upwind);
    let free = most(|method| method == Method::Free);
    vec![
        (format!("particles that move keep the mass: {carried:.1e}"), carried <= ROUNDING),
        (format!("without remeshing they keep every bit of it: {free:.1e}"), free == 0.0),
        (
            format!("rows at particles that stay do not: drift {upwind:.1e} (upwind), {central:.1e} (DC-PSE)"),
            central > ROUNDING && central < 3e-3 && upwind > 0.01 && upwind < 0.3,
        ),
    ]
}

fn overlap(records: &[Record]) -> Vec<(String, bool)> {
    let of = |method: Method| records.iter().filter(move |record| record.method == method);
    let (least, late) = of(Method::Late)
        .fold((f64::INFINITY, 0), |(least, count), record| (least.min(record.half), count.max(record.remeshings)));
    let fresh = of(Method::Remeshed(4, 2)).fold(0.0_f64, |most, record| most.max(record.hole));
    let (hole, gap) =
        of(Method::Free).fold((0.0_f64, 1.0_f64), |(hole, gap), record| (hole.max(record.hole), gap.min(record.gap)));
    let field = of(Method::Free).fold(f64::INFINITY, |least, record| least.min(record.half));
    vec![
        (
            format!(
                "without remeshing overlap is lost at T/2: hole {hole:.2} h, gap {gap:.2} h; remeshed {fresh:.2} h"
            ),
            hole > 1.1 && gap < 0.5 && fresh < 0.75,
        ),
        (format!("the field that such particles deposit misses by {field:.0e} on every mesh"), field > 0.1),
        (
            format!("remeshed as late as that, {late} times, the error stays at {least:.0e} whatever h"),
            least > 0.1 && late <= 4,
        ),
    ]
}

fn winding([left, remeshed]: &[Wound; 2]) -> Vec<(String, bool)> {
    let [worn, fresh] = [left.condition, remeshed.condition];
    let [lost, kept] = [left.drift.abs(), remeshed.drift.abs()];
    let refused = left.refused.unwrap_or(f64::NAN);
    vec![
        (
            format!(
                "not remeshed, diffusion by DC-PSE comes to grow and is refused at t = {refused:.2}; remeshed it is not"
            ),
            refused > 0.0 && remeshed.refused.is_none(),
        ),
        (
            format!("allowed to, it goes on at conditions to {worn:.0} where remeshing keeps {fresh:.1}"),
            worn > 4.0 * fresh && worn < 1e3,
        ),
        (format!("and loses more of the mass: {lost:.0e} against {kept:.0e}"), lost > 2.0 * kept),
    ]
}
