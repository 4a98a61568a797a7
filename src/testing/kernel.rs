//! Whether a kernel keeps what its trait promises.

use std::fmt;

use crate::error::{Error, KernelError, Result as Fallible};
use crate::kernel::Kernel;
use crate::moment::{continuous_moments, moment_conditions, required_moment};
use crate::multi_index::{MultiIndex, common_degree, graded};
use crate::testing::sample::{lattice, sphere, spread};

/// How well a kernel must keep its promises, in units of alpha! max |c_i| for the moment M_alpha.
///
/// Divided by alpha!, a moment is the coefficient of epsilon^(|alpha| - m) D^alpha f in the error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KernelLimits {
    /// Defect of a moment in integral form, beyond what the quadrature itself may be wrong by.
    pub moment: f64,
    /// Defect of a moment over a lattice with h/epsilon at the overlap limit.
    pub lattice: f64,
    /// What may lie outside the support.
    pub truncation: f64,
}

impl Default for KernelLimits {
    /// 1e-10, 1e-4 and 1e-5, which all kernels of this crate with an exponential keep. The lattice sums of compact kernels
    /// are good to 1e-2 at their overlap limit, and a rational kernel loses more outside its support.
    fn default() -> Self {
        Self { moment: 1e-10, lattice: 1e-4, truncation: 1e-5 }
    }
}

/// The promise a kernel breaks.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum KernelFault<const D: usize> {
    /// The terms, support or overlap limit are refused, or a function of the kernel returned an error.
    Refused {
        /// Why.
        error: Error,
    },
    /// A value, or a derivative, that is not finite.
    NotFinite {
        /// Where.
        z: [f64; D],
        /// The value.
        value: f64,
    },
    /// `values` differs from `value`.
    Values {
        /// Where.
        z: [f64; D],
        /// eta(z) of `value`.
        one: f64,
        /// eta(z) of `values`.
        many: f64,
    },
    /// A moment that misses its condition.
    Moment {
        /// Which.
        alpha: MultiIndex<D>,
        /// M_alpha.
        found: f64,
        /// What the terms demand.
        required: f64,
        /// How far they may differ.
        tolerance: f64,
    },
    /// All moments of degree m + r vanish, so that the order is higher than stated, or every term is zero.
    Order {
        /// The order stated.
        order: u32,
        /// The largest |M_alpha| of degree m + r, over the absolute moment.
        largest: f64,
    },
    /// At the overlap limit a lattice misses a condition.
    Overlap {
        /// Which.
        alpha: MultiIndex<D>,
        /// h/epsilon, the overlap limit.
        h_over_epsilon: f64,
        /// The lattice moment.
        found: f64,
        /// What the terms demand.
        required: f64,
        /// How far they may differ.
        tolerance: f64,
    },
    /// Too much of a moment lies outside the support.
    Support {
        /// Which.
        alpha: MultiIndex<D>,
        /// The support.
        support: f64,
        /// The moment of what is outside.
        lost: f64,
        /// How much may lie there.
        tolerance: f64,
    },
    /// A kernel said to be positive definite has a negative transform.
    Transform {
        /// The wave vector.
        wave: [f64; D],
        /// Int eta(z) cos(k z) dz.
        found: f64,
    },
    /// A smoothing kernel must approximate f itself.
    NotSmoothing {
        /// Number of terms found, where there must be the one D^0 with factor 1.
        terms: usize,
        /// Degree of the first.
        degree: u32,
        /// Its factor.
        factor: f64,
    },
    /// A smoothing kernel that is not even.
    NotEven {
        /// Where.
        z: [f64; D],
        /// W(z).
        value: f64,
        /// W(-z).
        mirrored: f64,
    },
    /// The constant of a smoothing kernel is not positive and finite.
    Normalization {
        /// The constant.
        found: f64,
    },
    /// A derivative that differs from difference quotients, from the gradient, the batched derivatives or a combination.
    Derivative {
        /// Which.
        beta: MultiIndex<D>,
        /// Where.
        z: [f64; D],
        /// D^beta W(z).
        found: f64,
        /// What it should be.
        expected: f64,
        /// How far they may differ.
        tolerance: f64,
    },
}

impl<const D: usize> fmt::Display for KernelFault<D> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Refused { error } => write!(f, "the kernel is refused: {error}"),
            Self::NotFinite { z, value } => write!(f, "at {z:?} the kernel is {value}"),
            Self::Values { z, one, many } => write!(f, "at {z:?} value gives {one:e} and values {many:e}"),
            Self::Moment { alpha, found, required, tolerance } => {
                write!(f, "moment of {alpha}: {found:e} instead of {required:e} (tolerance {tolerance:e})")
            }
            Self::Order { order, largest } => {
                write!(f, "order {order} is understated: the moments above vanish too, the largest is {largest:e}")
            }
            Self::Overlap { alpha, h_over_epsilon, found, required, tolerance } => write!(
                f,
                "at h/epsilon = {h_over_epsilon} the lattice moment of {alpha} is {found:e} instead of {required:e} \
                 (tolerance {tolerance:e})"
            ),
            Self::Support { alpha, support, lost, tolerance } => {
                write!(f, "outside {support} lies {lost:e} of the moment of {alpha} (tolerance {tolerance:e})")
            }
            Self::Transform { wave, found } => write!(f, "the transform at {wave:?} is {found:e}, so not positive"),
            Self::NotSmoothing { terms, degree, factor } => {
                write!(
                    f,
                    "a smoothing kernel has the one term D^0, not {terms} beginning with {factor} of degree {degree}"
                )
            }
            Self::NotEven { z, value, mirrored } => write!(f, "W({z:?}) = {value:e} but mirrored {mirrored:e}"),
            Self::Normalization { found } => write!(f, "the normalization {found} is not positive and finite"),
            Self::Derivative { beta, z, found, expected, tolerance } => {
                write!(f, "{beta} at {z:?}: {found:e} instead of {expected:e} (tolerance {tolerance:e})")
            }
        }
    }
}

impl<const D: usize> std::error::Error for KernelFault<D> {}

impl<const D: usize> From<Error> for KernelFault<D> {
    fn from(error: Error) -> Self {
        Self::Refused { error }
    }
}

/// Checks that a kernel is what its trait says: terms of one degree, finite values, `values` equal to `value`, every
/// moment condition, an order that is not understated, an overlap limit and a support that suffice, and a transform
/// that is nowhere negative where the kernel says so.
///
/// Costs some 10^6 evaluations, and (2.5 support / overlap limit)^D.
///
/// ```
/// use parops::{WideGaussian, testing::{KernelLimits, check_kernel}};
/// check_kernel(&WideGaussian::<2>::new(), KernelLimits::default()).unwrap();
/// ```
///
/// # Errors
/// The first promise broken.
pub fn check_kernel<const D: usize>(
    kernel: &(impl Kernel<f64, D> + ?Sized),
    limits: KernelLimits,
) -> Result<(), KernelFault<D>> {
    let degree = common_degree(kernel.terms())?;
    let (support, overlap_limit) = (kernel.support(), kernel.overlap_limit());
    if !(support > 0.0 && support.is_finite() && overlap_limit > 0.0 && overlap_limit.is_finite()) {
        return Err(Error::from(KernelError::Radii { support, overlap_limit }).into());
    }
    check_values(kernel)?;
    let conditions: Vec<_> = moment_conditions(degree, kernel.order()).collect();
    let scales = scales(kernel, &conditions)?;
    // First, as the quadrature of the others trusts the support.
    check_support(kernel, &conditions, &scales, limits.truncation)?;
    check_moments(kernel, &conditions, &scales, limits.moment)?;
    check_order(kernel, degree)?;
    check_overlap(kernel, &conditions, &scales, limits.lattice)?;
    if kernel.positive_definite() { check_transform(kernel) } else { Ok(()) }
}

/// alpha! max |c_i|.
fn scales<const D: usize>(kernel: &(impl Kernel<f64, D> + ?Sized), alphas: &[MultiIndex<D>]) -> Fallible<Vec<f64>> {
    let largest = kernel.terms().iter().fold(0.0, |largest: f64, term| largest.max(term.factor.abs()));
    alphas.iter().map(|alpha| Ok(largest * alpha.factorial()? as f64)).collect()
}

fn check_values<const D: usize>(kernel: &(impl Kernel<f64, D> + ?Sized)) -> Result<(), KernelFault<D>> {
    let points = spread(kernel.support());
    let mut many = vec![0.0; points.len()];
    kernel.values(&points, &mut many);
    let one: Vec<f64> = points.iter().map(|z| kernel.value(z)).collect();
    let largest = one.iter().fold(0.0, |largest: f64, value| largest.max(value.abs()));
    for ((&z, &one), &many) in points.iter().zip(&one).zip(&many) {
        if !one.is_finite() {
            return Err(KernelFault::NotFinite { z, value: one });
        }
        // Another order of evaluation may round differently: 64 operations of a kernel, each relative to its size.
        let off = (one - many).abs() <= 64.0 * f64::EPSILON * largest;
        if !off {
            return Err(KernelFault::Values { z, one, many });
        }
    }
    Ok(())
}

fn check_moments<const D: usize>(
    kernel: &(impl Kernel<f64, D> + ?Sized),
    conditions: &[MultiIndex<D>],
    scales: &[f64],
    limit: f64,
) -> Result<(), KernelFault<D>> {
    let moments = continuous_moments(kernel, conditions)?;
    for ((&alpha, moment), scale) in conditions.iter().zip(&moments).zip(scales) {
        let required = required_moment(kernel.terms(), alpha)?;
        let tolerance = limit * scale + 2.0 * moment.error;
        let kept = (moment.value - required).abs() <= tolerance;
        if !kept {
            return Err(KernelFault::Moment { alpha, found: moment.value, required, tolerance });
        }
    }
    Ok(())
}

fn check_order<const D: usize>(kernel: &(impl Kernel<f64, D> + ?Sized), degree: u32) -> Result<(), KernelFault<D>> {
    let next: Vec<_> = graded(degree + kernel.order(), degree + kernel.order()).collect();
    let mut largest = 0.0_f64;
    for (&alpha, moment) in next.iter().zip(continuous_moments(kernel, &next)?) {
        // An order of 0 leaves the required moments themselves.
        let defect = (moment.value - required_moment(kernel.terms(), alpha)?).abs();
        if moment.absolute > 0.0 {
            largest = largest.max((defect - 2.0 * moment.error).max(0.0) / moment.absolute);
        }
    }
    // A moment that should vanish is certain to less than its own quadrature error.
    if largest > 1e-8 { Ok(()) } else { Err(KernelFault::Order { order: kernel.order(), largest }) }
}

fn check_overlap<const D: usize>(
    kernel: &(impl Kernel<f64, D> + ?Sized),
    conditions: &[MultiIndex<D>],
    scales: &[f64],
    limit: f64,
) -> Result<(), KernelFault<D>> {
    let h = kernel.overlap_limit();
    let mut sums = vec![0.0; conditions.len()];
    lattice(1.25 * kernel.support(), h, |z| {
        let weight = kernel.value(&z) * h.powi(D as i32);
        for (sum, alpha) in sums.iter_mut().zip(conditions) {
            *sum += weight * alpha.power(&z);
        }
    });
    for ((&alpha, &found), scale) in conditions.iter().zip(&sums).zip(scales) {
        let required = required_moment(kernel.terms(), alpha)?;
        let tolerance = limit * scale;
        let kept = (found - required).abs() <= tolerance;
        if !kept {
            return Err(KernelFault::Overlap { alpha, h_over_epsilon: h, found, required, tolerance });
        }
    }
    Ok(())
}

fn check_support<const D: usize>(
    kernel: &(impl Kernel<f64, D> + ?Sized),
    conditions: &[MultiIndex<D>],
    scales: &[f64],
    limit: f64,
) -> Result<(), KernelFault<D>> {
    let support = kernel.support();
    // About 2^18 points, so that the sum follows the steep fall at the edge of the ball.
    let h = 3.0 * support / f64::powf(262144.0, 1.0 / D as f64);
    let mut lost = vec![0.0; conditions.len()];
    lattice(1.5 * support, h, |z| {
        if z.iter().map(|x| x * x).sum::<f64>() > support * support {
            let weight = kernel.value(&z) * h.powi(D as i32);
            for (lost, alpha) in lost.iter_mut().zip(conditions) {
                *lost += weight * alpha.power(&z);
            }
        }
    });
    for ((&alpha, &lost), scale) in conditions.iter().zip(&lost).zip(scales) {
        let tolerance = limit * scale;
        let kept = lost.abs() <= tolerance;
        if !kept {
            return Err(KernelFault::Support { alpha, support, lost, tolerance });
        }
    }
    Ok(())
}

fn check_transform<const D: usize>(kernel: &(impl Kernel<f64, D> + ?Sized)) -> Result<(), KernelFault<D>> {
    // Wave numbers up to the one a lattice at the overlap limit resolves; the sum resolves twice that.
    let h = 0.5 * kernel.overlap_limit();
    let highest = std::f64::consts::PI / kernel.overlap_limit();
    let waves: Vec<[f64; D]> =
        sphere().iter().flat_map(|d| (0..=8).map(|i| d.map(|x| x * highest * f64::from(i) / 8.0))).collect();
    let mut sums = vec![0.0; waves.len()];
    let mut absolute = 0.0;
    lattice(1.25 * kernel.support(), h, |z| {
        let eta = kernel.value(&z);
        absolute += eta.abs();
        for (sum, wave) in sums.iter_mut().zip(&waves) {
            let phase: f64 = wave.iter().zip(&z).map(|(k, x)| k * x).sum();
            *sum += eta * phase.cos();
        }
    });
    for (&wave, &found) in waves.iter().zip(&sums) {
        // The lattice folds waves onto each other, and the kernel may be cut off: both are allowed 1e-5.
        if found < -1e-5 * absolute {
            return Err(KernelFault::Transform { wave, found: found * h.powi(D as i32) });
        }
    }
    Ok(())
}
