//! What the table must show, asserted.

use crate::benchmark::Record;

/// A sentence about the table, and whether it is true.
pub struct Claim {
    pub text: String,
    pub holds: bool,
}

/// Errors below this are round-off, in f64: the 100 to 1000 steps each add a few units in the last place of u <= 0.43,
/// and the truncated kernels leave their own 1e-14.
const FLOOR: f64 = 2e-13;

/// Checks every claim of the benchmark against the table.
pub fn check(records: &[Record]) -> Vec<Claim> {
    let series = |method: &'static str, scalar: &'static str, order: u32, stepper: &'static str| -> Vec<&Record> {
        let wanted = (method, scalar, order, stepper);
        records.iter().filter(|r| (r.method, r.scalar, r.order, r.stepper) == wanted).collect()
    };
    let mut claims = Vec::new();
    let mut claim = |holds: bool, text: String| claims.push(Claim { text, holds });

    let second = series("pse", "f64", 2, "rk4");
    let observed: Vec<f64> = second.iter().filter(|r| r.n >= 100).filter_map(|r| r.observed_order).collect();
    claim(
        !observed.is_empty() && observed.iter().all(|order| (1.9..=2.1).contains(order)),
        format!("order-2 PSE with RK4 converges with order 1.9 to 2.1 from N = 50/100 on: {}", list(&observed)),
    );

    for order in [4, 6, 8] {
        for stepper in ["rk4", "exact"] {
            let runs = series("pse", "f64", order, stepper);
            let above: Vec<f64> =
                runs.iter().filter(|r| r.n >= 100 && r.l2 > FLOOR).filter_map(|r| r.observed_order).collect();
            claim(
                !above.is_empty() && above.iter().all(|observed| (observed - f64::from(order)).abs() <= 0.3),
                format!("order-{order} PSE ({stepper}) is within 0.3 of design above round-off: {}", list(&above)),
            );
        }
    }

    let walks = series("rw", "f64", 0, "euler");
    let slope = slope(&walks);
    claim((slope + 0.5).abs() <= 0.15, format!("random walk converges like N^-1/2: fitted slope {slope:.3}"));

    for stepper in ["euler", "rk4"] {
        let single: Vec<&Record> = series("pse", "f32", 2, stepper).into_iter().filter(|r| r.n >= 400).collect();
        let errors: Vec<f64> = single.iter().map(|r| r.l2).collect();
        claim(
            !errors.is_empty() && errors.iter().all(|l2| (1e-7..=2e-6).contains(l2)),
            format!("the f32 error ({stepper}) stays between 1e-7 and 2e-6 from N = 400 on: {}", powers(&errors)),
        );
        if let [first, .., last] = single.as_slice() {
            let ratio = first.l2 / last.l2;
            let following = (last.n as f64 / first.n as f64).powi(2);
            claim(
                ratio < following / 4.0,
                format!(
                    "and does not follow order 2: it falls {ratio:.2} times where order 2 falls {following:.0} times"
                ),
            );
        }
    }

    let at_50 = |runs: &[&Record]| runs.iter().find(|r| r.n == 50).map(|r| r.l2);
    if let (Some(walk), Some(exchange)) = (at_50(&walks), at_50(&second)) {
        let ratio = walk / exchange;
        claim(ratio >= 1000.0, format!("at N = 50 PSE is {ratio:.0} times more accurate than the random walk (rms)"));
    }
    claims
}

/// Slope of ln l2 over ln N by least squares.
fn slope(runs: &[&Record]) -> f64 {
    let points: Vec<(f64, f64)> = runs.iter().map(|r| ((r.n as f64).ln(), r.l2.ln())).collect();
    let count = points.len() as f64;
    let (mx, my) = points.iter().fold((0.0, 0.0), |(mx, my), (x, y)| (mx + x / count, my + y / count));
    let (xy, xx) =
        points.iter().fold((0.0, 0.0), |(xy, xx), (x, y)| (xy + (x - mx) * (y - my), xx + (x - mx) * (x - mx)));
    xy / xx
}

fn list(values: &[f64]) -> String {
    values.iter().map(|v| format!("{v:.2}")).collect::<Vec<_>>().join(", ")
}

fn powers(values: &[f64]) -> String {
    values.iter().map(|v| format!("{v:.1e}")).collect::<Vec<_>>().join(", ")
}
