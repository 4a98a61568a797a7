//! Whether a smoothing kernel keeps what its trait promises.

use super::kernel::{KernelFault, KernelLimits, check_kernel};
use super::sample::spread;
use crate::error::{ErrorKind, KernelError};
use crate::kernel::SmoothingKernel;
use crate::multi_index::{MultiIndex, Term};

/// Checks a smoothing kernel: all of [`check_kernel`] for f itself (so Int W = 1), evenness, and first and second
/// derivatives against difference quotients, the gradient, the batched derivatives and the combinations.
///
/// A kernel may refuse second derivatives, with [`KernelError::Regularity`], but not first ones.
///
/// ```
/// use parops::{Gaussian, testing::{KernelLimits, check_smoothing_kernel}};
/// check_smoothing_kernel(&Gaussian::<2>::new(), KernelLimits::default()).unwrap();
/// ```
///
/// # Errors
/// The first promise broken.
pub fn check_smoothing_kernel<const D: usize>(
    kernel: &(impl SmoothingKernel<f64, D> + ?Sized),
    limits: KernelLimits,
) -> Result<(), KernelFault<D>> {
    match kernel.terms() {
        [term] if term.index == MultiIndex::ZERO && term.factor == 1.0 => {}
        terms => {
            let (degree, factor) = terms.first().map_or((0, 0.0), |term| (term.index.degree(), term.factor));
            return Err(KernelFault::NotSmoothing { terms: terms.len(), degree, factor });
        }
    }
    check_kernel(kernel, limits)?;
    let found = kernel.normalization();
    if !(found > 0.0 && found.is_finite()) {
        return Err(KernelFault::Normalization { found });
    }
    let points = spread(kernel.support());
    let largest = points.iter().fold(0.0, |largest: f64, z| largest.max(kernel.value(z).abs()));
    for &z in &points {
        let (value, mirrored) = (kernel.value(&z), kernel.value(&z.map(|x| -x)));
        let even = (value - mirrored).abs() <= 64.0 * f64::EPSILON * largest;
        if !even {
            return Err(KernelFault::NotEven { z, value, mirrored });
        }
    }
    for axis in 0..D {
        let first = MultiIndex::unit(axis)?;
        check_derivative(kernel, first, axis, &points, largest, |z| Ok(kernel.value(z)))?;
        for &z in &points {
            let (found, expected) = (kernel.gradient(&z)?[axis], kernel.derivative(first, &z)?);
            same(first, z, found, expected, 64.0 * f64::EPSILON * largest)?;
        }
        for other in 0..D {
            let mut exponents = first.exponents();
            exponents[other] += 1;
            let second = MultiIndex::new(exponents);
            match kernel.derivative(second, &[0.0; D]) {
                Err(error) if matches!(error.kind(), ErrorKind::Kernel(KernelError::Regularity { .. })) => continue,
                _ => check_derivative(kernel, second, other, &points, largest, |z| kernel.derivative(first, z))?,
            }
        }
    }
    Ok(())
}

/// D^beta against the difference quotient along `axis` of the derivative below it.
fn check_derivative<const D: usize>(
    kernel: &(impl SmoothingKernel<f64, D> + ?Sized),
    beta: MultiIndex<D>,
    axis: usize,
    points: &[[f64; D]],
    largest: f64,
    below: impl Fn(&[f64; D]) -> crate::error::Result<f64>,
) -> Result<(), KernelFault<D>> {
    // At a kink of the next derivative the quotient is wrong by about STEP times its jump, which is of the size of W
    // over the width to that power: 20 covers polynomials on a unit interval.
    const STEP: f64 = 1e-5;
    let tolerance = 20.0 * STEP * largest;
    let mut many = vec![0.0; points.len()];
    kernel.derivatives(beta, points, &mut many)?;
    for (&z, &many) in points.iter().zip(&many) {
        let found = kernel.derivative(beta, &z)?;
        if !found.is_finite() {
            return Err(KernelFault::NotFinite { z, value: found });
        }
        same(beta, z, many, found, 64.0 * f64::EPSILON * largest)?;
        let mut combined = [0.0];
        let terms = [3.0, -2.0].map(|factor| Term { index: beta, factor });
        kernel.combination(&terms, &[z], &mut combined)?;
        same(beta, z, combined[0], found, 64.0 * f64::EPSILON * largest)?;
        let [ahead, behind] = [STEP, -STEP].map(|step| {
            let mut moved = z;
            moved[axis] += step;
            below(&moved)
        });
        same(beta, z, found, (ahead? - behind?) / (2.0 * STEP), tolerance)?;
    }
    Ok(())
}

fn same<const D: usize>(
    beta: MultiIndex<D>,
    z: [f64; D],
    found: f64,
    expected: f64,
    tolerance: f64,
) -> Result<(), KernelFault<D>> {
    let same = (found - expected).abs() <= tolerance;
    if same { Ok(()) } else { Err(KernelFault::Derivative { beta, z, found, expected, tolerance }) }
}
