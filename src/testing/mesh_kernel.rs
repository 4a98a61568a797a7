//! Whether a mesh kernel keeps what its trait promises.

use std::fmt;

use crate::kernel::MeshKernel;

/// A promise of [`MeshKernel`] that is broken, with the numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum MeshKernelFault {
    /// A weight that is not finite.
    NotFinite {
        /// Place of the particle.
        u: f64,
        /// Node.
        node: usize,
        /// The weight.
        weight: f64,
    },
    /// Two calls with the same place, or of the two scalars, that differ.
    Different {
        /// Place of the particle.
        u: f64,
        /// Node.
        node: usize,
        /// The two weights.
        weights: [f64; 2],
    },
    /// Weights that do not mirror: w_k(u) is not w_(S-1-k)(-u).
    NotEven {
        /// Place of the particle.
        u: f64,
        /// Node.
        node: usize,
        /// w_k(u) and w_(S-1-k)(-u).
        weights: [f64; 2],
    },
    /// A moment sum_k s_k^a w_k that is not 1 (a = 0) or 0.
    Moment {
        /// Degree a.
        degree: u32,
        /// Place of the particle.
        u: f64,
        /// By how much it misses.
        defect: f64,
        /// What rounding may leave.
        tolerance: f64,
    },
}

impl fmt::Display for MeshKernelFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotFinite { u, node, weight } => write!(f, "weight {node} at u = {u} is {weight}"),
            Self::Different { u, node, weights } => write!(f, "weight {node} at u = {u} is both of {weights:?}"),
            Self::NotEven { u, node, weights } => {
                write!(f, "weight {node} at u = {u} and its mirror image are {weights:?}")
            }
            Self::Moment { degree, u, defect, tolerance } => {
                write!(f, "moment {degree} misses by {defect:e} at u = {u}, {tolerance:e} is rounding")
            }
        }
    }
}

impl std::error::Error for MeshKernelFault {}

/// Checks that weights are finite, repeatable and even, add up to 1 within `ulps` eps, and have the moments
/// sum_k s_k^a w_k = 0 for 1 <= a <= exactness, at places that fill -1/2 <= u <= 1/2, both ends included.
///
/// The moments about the particle are those of the promise sum_k k^a K(x - k) = x^a, expanded about x. A weight is made of
/// terms of size 1 even where it vanishes, so that rounding may leave `ulps` eps sum_k |s_k^a|.
///
/// ```
/// use parops::{Lambda, testing::check_mesh_kernel};
/// check_mesh_kernel(&Lambda::<4, 4>::new().unwrap(), 4.0).unwrap();
/// ```
///
/// # Errors
/// The first promise broken.
pub fn check_mesh_kernel<const S: usize>(
    kernel: &(impl MeshKernel<f64, S> + ?Sized),
    ulps: f64,
) -> Result<(), MeshKernelFault> {
    const PLACES: u32 = 2048;
    for i in 0..=PLACES {
        let u = f64::from(i) / f64::from(PLACES) - 0.5;
        // Most places fall on no short fraction.
        for u in [u, (u * 0.999_876_543_21).clamp(-0.5, 0.5)] {
            check_place(kernel, u, ulps)?;
        }
    }
    Ok(())
}

fn check_place<const S: usize>(
    kernel: &(impl MeshKernel<f64, S> + ?Sized),
    u: f64,
    ulps: f64,
) -> Result<(), MeshKernelFault> {
    let (weights, again, mirrored) = (kernel.weights(u), kernel.weights(u), kernel.weights(-u));
    for node in 0..S {
        let weight = weights[node];
        if !weight.is_finite() {
            return Err(MeshKernelFault::NotFinite { u, node, weight });
        }
        if weight.to_bits() != again[node].to_bits() {
            return Err(MeshKernelFault::Different { u, node, weights: [weight, again[node]] });
        }
        let mirror = mirrored[S - 1 - node];
        // A weight is 1 at most in size where it matters; both sides are rounded.
        if !((weight - mirror).abs() <= 2.0 * ulps * f64::EPSILON) {
            return Err(MeshKernelFault::NotEven { u, node, weights: [weight, mirror] });
        }
    }
    for degree in 0..=kernel.exactness() {
        let (mut sum, mut size) = (0.0, 0.0);
        for (node, weight) in weights.iter().enumerate() {
            let power = (u + (0.5 * (S as f64 - 1.0) - node as f64)).powi(degree as i32);
            (sum, size) = (sum + power * weight, size + power.abs());
        }
        let (defect, size) = if degree == 0 { (sum - 1.0, 1.0) } else { (sum, size) };
        let tolerance = ulps * f64::EPSILON * size;
        if !(defect.abs() <= tolerance) {
            return Err(MeshKernelFault::Moment { degree, u, defect, tolerance });
        }
    }
    Ok(())
}
