//! What the runs must show.

use parops::Limit;

use crate::scheme::{EXPLICIT, Record, STIFF, Scheme};
use crate::study::cheapest;

/// Every claim, and whether it holds.
pub fn check(costs: &[Record], numbers: &[Record]) -> Vec<(String, bool)> {
    let mut claims = Vec::new();
    for set in ["lattice", "scattered"] {
        let of = |scheme: Scheme| -> Vec<&Record> {
            costs.iter().filter(|r| r.set == set && r.scheme == scheme && r.refused.is_none()).collect()
        };
        for scheme in STIFF {
            let order = order(&of(scheme));
            let holds = (order - scheme.order()).abs() < 0.25;
            claims.push((format!("{set}: {} has order {order:.2} in time", scheme.name()), holds));
        }
        let refusals: Vec<_> =
            costs.iter().chain(numbers).filter(|r| r.set == set).filter_map(|r| Some((r, r.refused?))).collect();
        let explicit = refusals.iter().all(|(r, (limit, binding))| {
            EXPLICIT.contains(&r.scheme) && *binding == Limit::Diffusion && r.dt > *limit && r.explicit > 1.0
        });
        let text = format!("{set}: {} steps beyond a limit are refused, by diffusion, and no others", refusals.len());
        claims.push((text, explicit && refusals.len() >= EXPLICIT.len() * 6));
        for scheme in EXPLICIT {
            let limited = refusals.iter().filter(|(r, _)| r.scheme == scheme).all(|(r, (limit, _))| {
                numbers
                    .iter()
                    .chain(costs)
                    .filter(|s| s.set == r.set && s.scheme == scheme && s.refused.is_none())
                    .all(|s| s.dt <= *limit)
            });
            claims.push((format!("{set}: {} runs up to its limit", scheme.name()), limited));
        }
        let steps: Vec<_> = numbers.iter().filter(|r| r.set == set && r.refused.is_none()).collect();
        let stable = steps.iter().all(|r| r.left <= 1.0 + 1e-9);
        let reached = STIFF.iter().all(|&scheme| steps.iter().any(|r| r.scheme == scheme && r.number > 0.99e6));
        claims.push((format!("{set}: no scheme widens the field at numbers to 10^6"), stable && reached));
        let million = |scheme| steps.iter().find(|r| r.scheme == scheme && r.number > 0.99e6);
        let applies = million(Scheme::Rkl2).map_or(0, |r| r.applies);
        // 2828 stages, or 64 a substep at the slope counted on, which reach 1023 of 2 10^6.
        claims.push((
            format!("{set}: RKL2 makes up for 10^6 explicit steps with {applies} applies"),
            (1000..126_000).contains(&applies),
        ));
        let flat = million(Scheme::ImplicitEulerLu).map_or(f64::NAN, |r| r.left);
        claims.push((format!("{set}: a step of 10^6 by implicit Euler leaves {flat:.1e}"), flat < 0.1));
        let [euler, rkl2] = [Scheme::Euler, Scheme::Rkl2]
            .map(|scheme| cheapest(costs, set, scheme, 1e-3).map_or(f64::NAN, |r| r.applies as f64));
        let text = format!("{set}: at error 1e-3 RKL2 needs {rkl2} applies, Euler {euler}");
        claims.push((text, rkl2 < 0.25 * euler));
    }
    claims
}

/// The observed order from the third run to the last above the errors of rounding and of the exact propagator.
fn order(runs: &[&Record]) -> f64 {
    const FLOOR: f64 = 1e-9;
    let fine: Vec<_> = runs.iter().skip(2).filter(|run| run.error > FLOOR).collect();
    match (fine.first(), fine.last()) {
        (Some(first), Some(last)) => (first.error / last.error).ln() / (first.dt / last.dt).ln(),
        _ => f64::NAN,
    }
}
