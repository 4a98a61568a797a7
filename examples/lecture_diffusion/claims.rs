//! What the table must show, asserted.

use crate::benchmark::Record;

/// A sentence about the table, and whether it is true.
pub struct Claim {
    pub text: String,
    pub holds: bool,
}

/// Errors below this are round-off, in f64: 400 stages each round u <= 0.43 by up to 1.1e-16, twice over, 4e-14, and as
/// much again for the sums.
const FLOOR: f64 = 1e-13;

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
    let walked = slope(&walks);
    claim((walked + 0.5).abs() <= 0.15, format!("random walk converges like N^-1/2: fitted slope {walked:.3}"));

    let single: Vec<&Record> = series("pse", "f32", 2, "rk4").into_iter().filter(|r| r.n >= 400).collect();
    let errors: Vec<f64> = single.iter().map(|r| r.l2).collect();
    claim(
        !errors.is_empty() && errors.iter().all(|l2| (1e-7..=2e-6).contains(l2)),
        format!("the f32 error (rk4) stays between 1e-7 and 2e-6 from N = 400 on: {}", powers(&errors)),
    );
    if single.len() > 1 {
        let fitted = -slope(&single);
        claim(fitted < 1.5, format!("and does not follow order 2 there: fitted order {fitted:.2}"));
    }

    let at_50 = |runs: &[&Record]| runs.iter().find(|r| r.n == 50).map(|r| r.l2);
    if let (Some(walk), Some(exchange)) = (at_50(&walks), at_50(&second)) {
        let ratio = walk / exchange;
        claim(ratio >= 1000.0, format!("at N = 50 PSE is {ratio:.0} times more accurate than the random walk (rms)"));
    }
    claims
}

/// Where the time error of Euler shows: it has the opposite sign of the space error of order 2, so that the observed
/// order first rises and then falls, and no band is claimed for it.
pub fn euler_against_rk4(records: &[Record]) -> String {
    let error = |stepper: &str, order: u32, n: usize| {
        let run = |r: &&Record| (r.method, r.scalar, r.stepper, r.order, r.n) == ("pse", "f64", stepper, order, n);
        records.iter().find(run).map(|r| r.l2)
    };
    let mut lines = Vec::new();
    for order in [2, 4, 6, 8] {
        let mut sizes = records.iter().filter(|r| (r.method, r.order) == ("pse", order)).map(|r| r.n);
        let first = sizes.find(|&n| match (error("euler", order, n), error("rk4", order, n)) {
            (Some(euler), Some(rk4)) => (euler - rk4).abs() > 0.1 * rk4,
            _ => false,
        });
        lines.push(match first {
            Some(n) => format!("order {order}: the time error of Euler exceeds a tenth of the error from N = {n} on"),
            None => format!("order {order}: the time error of Euler does not show"),
        });
    }
    lines.join("\n")
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
