//! The Wendland functions C2, C4 and C6, the polynomials of least degree that are positive definite.

use super::compact::{Compact, Part, Step, compact_kernel};
use super::{Kernel, SmoothingKernel};
use crate::error::Result;
use crate::multi_index::{MultiIndex, Term};
use crate::scalar::Scalar;

/// The Wendland function C2, W(z) = sigma (1 - q)_+^4 (1 + 4q) for D = 2, 3 and sigma (1 - q)_+^3 (1 + 3q) for D = 1,
/// with q = |z|/2; of order 2.
///
/// sigma = 5/8, 7/(4 pi), 21/(16 pi) for D = 1, 2, 3; any D is normalized. The support radius is 2 epsilon, so epsilon
/// is half of the H of the source. Twice continuously differentiable: D^beta W exists to |beta| = 2. Value and
/// derivatives are within a few eps of their absolute terms, which have one sign but for powers of z.
///
/// Overlap: up to the limit, h/epsilon = 0.93, 0.76, 0.77 for D = 1, 2, 3, a sum over a lattice is 1 to 1 %; to 0.47 it
/// is to 0.1 %. Positive definite in D dimensions: no pairing for any number of neighbors. Weakness: at equal epsilon
/// it is narrower than the splines and its sums over few neighbors are worse. For D >= 4 the power grows as Wendland's
/// theorem asks, the limit is that of D = 3.
///
/// ```
/// use parops::{Kernel, SmoothingKernel, WendlandC2};
/// let w = WendlandC2::<2>::new();
/// let sigma = 7.0 / (4.0 * std::f64::consts::PI);
/// assert!((w.value(&[0.6, 0.8]) - sigma * 3.0 / 16.0).abs() < 1e-16);
/// assert_eq!(w.gradient(&[0.0, 0.0])?, [0.0, 0.0]);
/// # parops::Result::Ok(())
/// ```
///
/// Source: Wendland 1995; Dehnen and Aly 2012, table 1 (1D apart from 2D and 3D) and sec. 3 (pairing).
#[derive(Clone, Debug)]
pub struct WendlandC2<const D: usize>(Compact<D>);

/// The Wendland function C4, W(z) = sigma (1 - q)_+^6 (1 + 6q + 35/3 q^2) for D = 2, 3 and sigma (1 - q)_+^5
/// (1 + 5q + 8q^2) for D = 1, with q = |z|/2; of order 2.
///
/// sigma = 3/4, 9/(4 pi), 495/(256 pi) for D = 1, 2, 3; any D is normalized. The support radius is 2 epsilon, so
/// epsilon is half of the H of the source. Four times continuously differentiable: D^beta W exists to |beta| = 4. Value
/// and derivatives are within a few eps of their absolute terms, which have one sign but for powers of z.
///
/// Overlap: up to the limit, h/epsilon = 1, 0.79, 0.79 for D = 1, 2, 3, a sum over a lattice is 1 to 1 %; to 0.56 it is
/// to 0.1 %. Positive definite in D dimensions: no pairing for any number of neighbors. Weakness: as for C2, it wants
/// more neighbors than a spline of the same epsilon. For D >= 4 the power grows as Wendland's theorem asks, the limit
/// is that of D = 3.
///
/// ```
/// use parops::{Kernel, WendlandC4};
/// let w = WendlandC4::<1>::new();
/// assert_eq!([0.0, 1.0, 2.0].map(|x| w.value(&[x])), [0.75, 0.75 * 5.5 / 32.0, 0.0]);
/// ```
///
/// Source: Wendland 1995; Dehnen and Aly 2012, table 1 (1D apart from 2D and 3D) and sec. 3 (pairing).
#[derive(Clone, Debug)]
pub struct WendlandC4<const D: usize>(Compact<D>);

/// The Wendland function C6, W(z) = sigma (1 - q)_+^8 (1 + 8q + 25q^2 + 32q^3) for D = 2, 3 and sigma (1 - q)_+^7
/// (1 + 7q + 19q^2 + 21q^3) for D = 1, with q = |z|/2; of order 2.
///
/// sigma = 55/64, 39/(14 pi), 1365/(512 pi) for D = 1, 2, 3; any D is normalized. The support radius is 2 epsilon, so
/// epsilon is half of the H of the source. Six times continuously differentiable: D^beta W exists to |beta| = 6. Value
/// and derivatives are within a few eps of their absolute terms, which have one sign but for powers of z.
///
/// Overlap: up to the limit, h/epsilon = 0.93, 0.77, 0.75 for D = 1, 2, 3, a sum over a lattice is 1 to 1 %; to 0.58 it
/// is to 0.1 %. Positive definite in D dimensions: no pairing for any number of neighbors. Weakness: as for C2; at
/// equal epsilon the narrowest of the three. For D >= 4 the power grows as Wendland's theorem asks, the limit is that
/// of D = 3.
///
/// ```
/// use parops::{Kernel, MultiIndex, SmoothingKernel, WendlandC6};
/// let w = WendlandC6::<3>::new();
/// let top = 1365.0 / (512.0 * std::f64::consts::PI);
/// assert!((w.value(&[0.0; 3]) - top).abs() < 1e-15);
/// let second: f64 = w.derivative(MultiIndex::new([2, 0, 0]), &[0.0; 3])?;
/// assert!((second + 5.5 * top).abs() < 1e-14);
/// # parops::Result::Ok(())
/// ```
///
/// Source: Wendland 1995; Dehnen and Aly 2012, table 1 (1D apart from 2D and 3D) and sec. 3 (pairing).
#[derive(Clone, Debug)]
pub struct WendlandC6<const D: usize>(Compact<D>);

impl<const D: usize> WendlandC2<D> {
    /// The highest |beta| of a derivative.
    pub const DERIVATIVE_LIMIT: u32 = 2;

    const OVERLAP_LIMITS: [f64; 3] = [0.93, 0.76, 0.77];

    /// The kernel.
    pub fn new() -> Self {
        Self(wendland("WendlandC2", 1, |l| vec![1.0, l + 1.0]))
    }
}

impl<const D: usize> WendlandC4<D> {
    /// The highest |beta| of a derivative.
    pub const DERIVATIVE_LIMIT: u32 = 4;

    const OVERLAP_LIMITS: [f64; 3] = [1.0, 0.79, 0.79];

    /// The kernel.
    pub fn new() -> Self {
        Self(wendland("WendlandC4", 2, |l| vec![3.0, 3.0 * l + 6.0, (l + 4.0) * l + 3.0]))
    }
}

impl<const D: usize> WendlandC6<D> {
    /// The highest |beta| of a derivative.
    pub const DERIVATIVE_LIMIT: u32 = 6;

    const OVERLAP_LIMITS: [f64; 3] = [0.93, 0.77, 0.75];

    /// The kernel.
    pub fn new() -> Self {
        let polynomial =
            |l| vec![15.0, 15.0 * l + 45.0, (6.0 * l + 36.0) * l + 45.0, ((l + 9.0) * l + 23.0) * l + 15.0];
        Self(wendland("WendlandC6", 3, polynomial))
    }
}

compact_kernel!(WendlandC2, true);
compact_kernel!(WendlandC4, true);
compact_kernel!(WendlandC6, true);

/// (1 - q)^(l + k) P(q), q = r/2, with l = floor(D/2) + k + 1, the least for which it is positive definite; P of degree
/// k is a function of l.
///
/// Kept as (2 - r)^(l + k) P(r/2). The operator (1/r) d/dr turns it into a multiple of the same with k less by one, so
/// all parts of derivatives have coefficients of one sign.
fn wendland<const D: usize>(name: &'static str, k: u32, polynomial: impl Fn(f64) -> Vec<f64>) -> Compact<D> {
    let l = D as u32 / 2 + k + 1;
    let mut coefficients = polynomial(f64::from(l));
    let mut scale = 1.0;
    for coefficient in &mut coefficients {
        *coefficient *= scale;
        scale *= 0.5;
    }
    let unit = coefficients[0] * 2.0_f64.powi((l + k) as i32);
    let steps = vec![Step { edge: 2.0, width: 2.0, exponent: l + k, radial: true, coefficients: coefficients.clone() }];
    let whole = vec![Part { low: 0.0, edge: 2.0, exponent: l + k, pole: 0, coefficients }];
    Compact::new(name, whole.clone(), steps, whole, unit, 2 * k)
}
