//! What the curves must satisfy, printed line by line.

/// Points per unit of length in sums that stand for integrals.
const FINE: f64 = 512.0;

/// The claims made so far.
#[derive(Default)]
pub struct Claims {
    failed: usize,
}

impl Claims {
    /// |found - expected| <= tolerance.
    pub fn equal(&mut self, text: String, found: f64, expected: f64, tolerance: f64) {
        let holds = (found - expected).abs() <= tolerance;
        self.failed += usize::from(!holds);
        println!("{} {text} = {expected}: off by {:.1e}", if holds { "holds" } else { "FAILS" }, found - expected);
    }

    /// Whether all of them hold.
    pub fn hold(&self) -> bool {
        self.failed == 0
    }
}

/// Int f over [-radius, radius] by the midpoint rule.
pub fn integral(radius: f64, f: impl Fn(f64) -> f64) -> f64 {
    let steps = (radius * FINE) as i32;
    (-steps..steps).map(|i| f((f64::from(i) + 0.5) / FINE)).sum::<f64>() / FINE
}

/// Where the slope of a curve jumps by J in all, the midpoint rule is off by J/24 h^2; here J is at most 24.
pub const KINKS: f64 = 1.0 / (FINE * FINE);
/// Smooth curves leave the rounding of a few thousand terms.
pub const SMOOTH: f64 = 1e-11;

/// `points` places in [low, high] with the values of f.
pub fn curve(low: f64, high: f64, points: usize, f: impl Fn(f64) -> f64) -> Vec<(f64, f64)> {
    let place = |i| low + (high - low) * i as f64 / points as f64;
    (0..=points).map(place).map(|x| (x, f(x))).collect()
}
