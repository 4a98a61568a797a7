//! Windows: the positive weight inside a corrected kernel.

use crate::scalar::Scalar;

/// The positive weight phi(|z|) that every polynomial of a corrected kernel is multiplied by.
///
/// Source: notes 001, eq. 5.40; H. Wendland (1995), the C2 function of three dimensions.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Window {
    /// exp(-|z|^2), cut off at the support.
    #[default]
    Exponential,
    /// (1 - s)^4 (4 s + 1), s = |z| / radius: zero at the cutoff.
    Wendland,
}

/// The windows of L stencils.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Windows<const D: usize, const L: usize> {
    pub(crate) shape: Window,
    /// Cutoff over epsilon.
    pub(crate) radius: [f64; L],
    /// Where each window is centered, as a scaled separation; zero where that is the target.
    pub(crate) middle: [[f64; D]; L],
}

impl Window {
    /// sqrt(phi), from |z|^2 and the support radius in units of epsilon; zero outside the radius for Wendland.
    #[inline]
    pub fn root<T: Scalar>(self, squared: T, radius: T) -> T {
        match self {
            Self::Exponential => (-squared * T::lift(0.5)).exp(),
            // Branching before the root keeps derivatives finite at z = 0.
            Self::Wendland if squared == T::zero() => T::one(),
            Self::Wendland => {
                let s = squared.sqrt() / radius;
                let inside = T::one() - s;
                if inside <= T::zero() {
                    return T::zero();
                }
                inside * inside * (T::lift(4.0) * s + T::one()).sqrt()
            }
        }
    }
}
