//! The random walk: particles keep their strength and move; the field is read from bins.

use parops::Random;

use crate::benchmark::{D, DT, T, X_RW, exact};

/// Number of bins M.
pub const BINS: usize = 20;
/// Width of a bin.
pub const WIDTH: f64 = X_RW / BINS as f64;

/// Centers of the bins.
pub fn centers() -> impl Iterator<Item = f64> {
    (0..BINS).map(|bin| (bin as f64 + 0.5) * WIDTH)
}

/// Walks n particles to time T and returns the mean field of every bin.
///
/// The particles start at independent uniform places with strengths u_0 X / N, so that the sum over a bin is a Monte
/// Carlo quadrature. One that crosses x = 0 is reflected and its strength changes sign: the odd image of the notes.
pub fn walk(n: usize, seed: u64) -> Vec<f64> {
    let mut random = Random::new(seed);
    let step = (2.0 * D * DT).sqrt();
    let steps = (T / DT).round() as usize;
    let mut bins = vec![0.0; BINS];
    for _ in 0..n {
        let mut x = X_RW * random.uniform();
        let mut strength = exact(x, 0.0) * X_RW / n as f64;
        for _ in 0..steps {
            x += step * random.normal();
            if x < 0.0 {
                (x, strength) = (-x, -strength);
            }
        }
        if let Some(bin) = bins.get_mut((x / WIDTH) as usize) {
            *bin += strength / WIDTH;
        }
    }
    bins
}
