//! The fastest decay of the wide Gaussian on a lattice, in closed form.

use std::f64::consts::PI;

use crate::error::{ParticleError, Result};

/// About the h/epsilon = sqrt(2 pi) at which the sum over images and its Poisson dual converge equally fast.
const DUAL: f64 = 2.5;

/// Terms after which either sum is at rounding: the m-th is below exp(-1.5 m^2).
const TERMS: i32 = 6;

/// lambda_max of the wide Gaussian eta(z) = (2 sqrt pi)^-D exp(-|z|^2/4) on an infinite lattice, in units of eps^-2:
/// theta(0)^D - theta(pi/delta)^D with theta(kappa) = sum_m exp(-(kappa + 2 pi m/delta)^2), delta = h/epsilon.
///
/// No cutoff. It is 1 to rounding for delta <= 0.5 and decreases with delta; the relative accuracy is that of rounding for
/// every delta.
///
/// ```
/// use parops::{Euler, StepLimit, wide_gaussian_decay};
/// let (h, epsilon, diffusion) = (0.1, 0.1, 1.0);
/// let bound = wide_gaussian_decay::<1>(h / epsilon)? / (epsilon * epsilon);
/// let dt = StepLimit::from_spectral_bound(bound, diffusion)?.step(&Euler::<f64>::new());
/// assert!((dt - 2.000206914149333 * epsilon * epsilon).abs() < 1e-14);
/// # parops::Result::Ok(())
/// ```
///
/// # Errors
/// [`ParticleError::Spacing`] where h/epsilon is not positive and finite.
///
/// Source: errata 26, which corrects notes 001, eq. 6.23.
/// See also: [`LatticeSpectrum`](crate::LatticeSpectrum) for a cutoff and for other kernels.
pub fn wide_gaussian_decay<const D: usize>(h_over_epsilon: f64) -> Result<f64> {
    let delta = h_over_epsilon;
    if !(delta > 0.0 && delta.is_finite()) {
        return Err(ParticleError::Spacing { spacing: delta }.into());
    }
    let (at_zero, at_edge, difference) = if delta < DUAL { by_images(delta) } else { by_lattice(delta) };
    if difference == 0.0 {
        return Ok(0.0);
    }
    // a^D - b^D = (a - b) (a^(D-1) + a^(D-2) b + ... + b^(D-1)) keeps the digits of a - b.
    let sum: f64 = (0..D as i32).map(|i| at_zero.powi(D as i32 - 1 - i) * at_edge.powi(i)).sum();
    Ok(difference * sum)
}

/// theta(0), theta(pi/delta) and their difference, by the sum over images.
fn by_images(delta: f64) -> (f64, f64, f64) {
    let image = |m: f64| (-(2.0 * PI * m / delta).powi(2)).exp();
    let at_zero = 1.0 + 2.0 * (1..TERMS).map(|m| image(f64::from(m))).sum::<f64>();
    let at_edge = 2.0 * (0..TERMS).map(|m| image(f64::from(m) + 0.5)).sum::<f64>();
    (at_zero, at_edge, at_zero - at_edge)
}

/// The same by the sum over lattice points: theta(kappa) = delta/(2 sqrt pi) sum_j exp(-(j delta)^2/4) cos(j delta kappa).
fn by_lattice(delta: f64) -> (f64, f64, f64) {
    let point = |j: i32| (-(f64::from(j) * delta / 2.0).powi(2)).exp();
    let factor = delta / (2.0 * PI.sqrt());
    let even: f64 = 1.0 + 2.0 * (1..TERMS).map(|j| point(2 * j)).sum::<f64>();
    let odd: f64 = 2.0 * (0..TERMS).map(|j| point(2 * j + 1)).sum::<f64>();
    (factor * (even + odd), factor * (even - odd), factor * 2.0 * odd)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Twenty operations of relative error eps; the difference loses at most the factor theta(0)/difference < 3.
    const ROUNDING: f64 = 64.0 * f64::EPSILON;

    #[test]
    fn sum_over_images_equals_its_poisson_dual() {
        for delta in [1.8, 2.0, 2.4999, 2.5, 2.7, 3.0, 3.3] {
            let ((a, b, c), (x, y, z)) = (by_images(delta), by_lattice(delta));
            for (images, lattice) in [(a, x), (b, y), (c, z)] {
                assert!((images - lattice).abs() <= ROUNDING * a, "{delta}: {images} {lattice}");
            }
        }
    }
}
