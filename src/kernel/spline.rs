//! The cubic and the quintic B-spline, the classical smoothing kernels of SPH.

use super::compact::{Compact, Part, Step, compact_kernel};
use super::{Kernel, SmoothingKernel};
use crate::error::Result;
use crate::multi_index::{MultiIndex, Term};
use crate::scalar::Scalar;

/// The cubic spline W(z) = sigma ((2 - r)_+^3 - 4 (1 - r)_+^3), r = |z|, (x)_+ = max(x, 0); of order 2.
///
/// sigma = 1/6, 5/(14 pi), 1/(4 pi) for D = 1, 2, 3; any D is normalized. epsilon is the distance between the knots, so
/// the support radius is 2 epsilon. Twice continuously differentiable: D^beta W exists to |beta| = 2. Value and
/// derivatives are within a few eps of their absolute terms, which do not cancel at z = 0, at the knots or at the edge.
///
/// Overlap: h/epsilon of 0.77 to 0.85 is customary (epsilon of 1.2 to 1.3 spacings). Up to the limit of 1 a sum over a
/// lattice is 1 to 0.5 %, up to 0.56 to 0.1 %. Weakness: from D = 2 on the transform is negative for some waves, and
/// particles that move along -grad sum_q W form pairs where the overlap is large: in two dimensions from epsilon = 1.3 h
/// on (measured: the least gap of a square lattice falls to 0.4 h at 1.3 h and to 0 at 1.5 h).
/// [`WendlandC2`](crate::WendlandC2) does not pair. Under tension particles clump where W'' is positive, from
/// r = 2/3 on; no artificial stress is ever added.
///
/// ```
/// use parops::{CubicSpline, ErrorKind, Kernel, KernelError, MultiIndex, SmoothingKernel};
/// let w = CubicSpline::<1>::new();
/// assert_eq!([0.0, 1.0, 2.0].map(|x| w.value(&[x])), [4.0 / 6.0, 1.0 / 6.0, 0.0]);
/// let second: f64 = w.derivative(MultiIndex::new([2]), &[1.0])?;
/// assert!((second - 1.0).abs() < 1e-15);
/// let third = SmoothingKernel::<f64, 1>::derivative(&w, MultiIndex::new([3]), &[1.0]).unwrap_err();
/// let expected = KernelError::Regularity { kernel: "CubicSpline", degree: 3, limit: 2 };
/// assert_eq!(*third.kind(), ErrorKind::Kernel(expected));
/// # parops::Result::Ok(())
/// ```
///
/// Source: Schoenberg 1946 (B-splines); Monaghan and Lattanzio 1985 (as smoothing kernel); Dehnen and Aly 2012, table 1
/// (constants) and sec. 3 (pairing).
#[derive(Clone, Debug)]
pub struct CubicSpline<const D: usize>(Compact<D>);

/// The quintic spline W(z) = sigma ((3 - r)_+^5 - 6 (2 - r)_+^5 + 15 (1 - r)_+^5), r = |z|, (x)_+ = max(x, 0); of order
/// 2.
///
/// sigma = 1/120, 7/(478 pi), 1/(120 pi) for D = 1, 2, 3; any D is normalized. epsilon is the distance between the
/// knots, so the support radius is 3 epsilon. Four times continuously differentiable: D^beta W exists to |beta| = 4.
/// Value and derivatives are within a few eps of their absolute terms, which do not cancel at z = 0, at the knots or at
/// the edge.
///
/// Overlap: up to the limit of 1 a sum over a lattice is 1 to 3e-4. It has 3.4 times the neighbors of [`CubicSpline`]
/// in three dimensions. Weakness: from D = 2 on the transform is negative for some waves; in two dimensions pairs form
/// at epsilon of 1.4 to 1.6 h (measured as for the cubic spline: least gaps of 0.3 and 0.1 h).
///
/// ```
/// use parops::{Kernel, QuinticSpline};
/// let w = QuinticSpline::<1>::new();
/// assert_eq!([0.0, 1.0, 2.0, 3.0].map(|x| w.value(&[x])), [66.0, 26.0, 1.0, 0.0].map(|w| w / 120.0));
/// ```
///
/// Source: Schoenberg 1946 (B-splines); Morris 1996 (as smoothing kernel); Dehnen and Aly 2012, sec. 3 (pairing).
#[derive(Clone, Debug)]
pub struct QuinticSpline<const D: usize>(Compact<D>);

impl<const D: usize> CubicSpline<D> {
    /// The highest |beta| of a derivative.
    pub const DERIVATIVE_LIMIT: u32 = 2;

    const OVERLAP_LIMITS: [f64; 3] = [1.0; 3];

    /// The kernel.
    pub fn new() -> Self {
        Self(spline("CubicSpline", 3))
    }
}

impl<const D: usize> QuinticSpline<D> {
    /// The highest |beta| of a derivative.
    pub const DERIVATIVE_LIMIT: u32 = 4;

    const OVERLAP_LIMITS: [f64; 3] = [1.0; 3];

    /// The kernel.
    pub fn new() -> Self {
        Self(spline("QuinticSpline", 5))
    }
}

compact_kernel!(CubicSpline, D == 1);
compact_kernel!(QuinticSpline, D == 1);

/// The B-spline of odd degree n, sum_j (-1)^j C(n + 1, j) (R - j - r)_+^n, R = (n + 1)/2.
///
/// Values are sums over the units of r: from its edge inwards each adds a polynomial in t = edge - r <= 1 that grows from 0.
/// For derivatives the truncated powers are kept from r = 1 on, and below expanded: there their odd powers of r below n
/// cancel exactly, which would be the poles of their derivatives.
fn spline<const D: usize>(name: &'static str, n: u32) -> Compact<D> {
    let reach = n.div_ceil(2);
    let mut whole = Vec::new();
    let mut weight = 1.0;
    for j in 0..reach {
        let edge = f64::from(reach - j);
        whole.push(Part { low: 0.0, edge, exponent: n, pole: 0, coefficients: vec![weight] });
        weight *= -f64::from(n + 1 - j) / f64::from(j + 1);
    }
    let steps = whole.iter().map(|inner: &Part| {
        // Of t^k in sum_j c_j (t + edge_j - edge)^n, where t^0 is what is left of the others at t = 1.
        let outer = || whole.iter().filter(|part| part.edge >= inner.edge);
        let powers =
            |k: u32| outer().map(move |part| part.coefficients[0] * (part.edge - inner.edge).powi((n - k) as i32));
        let mut binomial = 1.0;
        let all = (1..=n).map(|k| {
            binomial *= f64::from(n + 1 - k) / f64::from(k);
            binomial * powers(k).sum::<f64>()
        });
        let coefficients: Vec<f64> = all.skip_while(|&c| c == 0.0).collect();
        let exponent = n + 1 - coefficients.len() as u32;
        Step { edge: inner.edge, width: 1.0, exponent, radial: false, coefficients }
    });
    let steps = steps.collect();
    let mut inner = Vec::new();
    let mut binomial = 1.0;
    for i in 0..=n {
        let powers = whole.iter().map(|part| part.coefficients[0] * part.edge.powi((n - i) as i32));
        inner.push(binomial * powers.sum::<f64>());
        binomial *= -f64::from(n - i) / f64::from(i + 1);
    }
    let mut split = vec![Part { low: 0.0, edge: 1.0, exponent: 0, pole: 0, coefficients: inner }];
    split.extend(whole.iter().filter(|part| part.edge > 1.0).map(|part| Part { low: 1.0, ..part.clone() }));
    Compact::new(name, whole, steps, split, 1.0, n - 1)
}
