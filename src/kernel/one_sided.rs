//! One-sided kernels: a first or higher derivative along one axis from the sources on one side alone.

use super::decay::decay;
use super::exchange::{Exchange, horner};
use super::twofold::{Twofold, solve};
use super::{Kernel, gaussian_constant};
use crate::error::{KernelError, Result};
use crate::multi_index::{MultiIndex, Term};
use crate::scalar::Scalar;
use crate::stencil::Side;

/// The largest degree plus order of a one-sided kernel.
const HIGHEST: u32 = 8;

/// The kernel of c d^beta/dx_i^beta, beta >= 1, to order r that is zero but on one side of the axis i.
///
/// On the left, z_i > 0 (sources x_q < x_p),
/// eta(z) = c pi^(-D/2) (sum_(j=1)^(beta+r-1) a_j z_i^j) (prod_(k != i) P(z_k^2)) exp(-|z|^2),
/// and on the right eta_R(z) = (-1)^beta eta_L(z with z_i turned). The a_j are solved from the half-line moments
/// pi^(-1/2) Int_0^inf z^n exp(-z^2) dz = Gamma((n+1)/2)/(2 sqrt(pi)); P exp(-z^2) is the identity kernel of one
/// dimension, of the lowest even order that is at least beta + r. beta + r <= 8.
///
/// It serves differences f_q - f_p only: M_0 is not zero. As it has a kink at z_i = 0, sums over particles miss its
/// moments by O((h/epsilon)^4), so [`overlap_limit`](Kernel::overlap_limit) is 0.15 to 0.005 unless beta = r = 1.
/// Methods on particles correct it to its discrete moments: [`OneSided`](crate::OneSided), [`Upwind`](crate::Upwind).
///
/// ```
/// use parops::{Kernel, MultiIndex, OneSidedGaussian, Side, Term};
/// let slope = Term { index: MultiIndex::new([1]), factor: 1.0 };
/// let left = OneSidedGaussian::new(slope, Side::Left, 1)?;
/// let expected = -4.0 * 0.5 * f64::exp(-0.25) / std::f64::consts::PI.sqrt();
/// assert!((left.value(&[0.5]) - expected).abs() < 1e-15);
/// assert_eq!(left.value(&[-0.5]), 0.0);
/// # parops::Result::Ok(())
/// ```
///
/// Source: notes 001, eq. 6.28 (beta = r = 1), with errata 28 to 32; the others from the same moment conditions.
#[derive(Clone, Debug)]
pub struct OneSidedGaussian<const D: usize> {
    term: [Term<D>; 1],
    axis: usize,
    side: Side,
    order: u32,
    exact: Vec<Twofold>,
    coefficients: Vec<f64>,
    /// The factor of the term, pi^(-D/2) and the sign of the right side.
    front: f64,
    /// The identity kernel across, without its constant.
    across: Vec<f64>,
}

impl<const D: usize> OneSidedGaussian<D> {
    /// The kernel of this derivative along one axis, from the sources on `side`, to order r = `order`.
    ///
    /// # Errors
    /// [`KernelError::NotAlongAxis`] where the term is no derivative along one axis; [`KernelError::OneSided`] for
    /// order 0 and for degree + order above 8.
    pub fn new(term: Term<D>, side: Side, order: u32) -> Result<Self> {
        let axis = along_axis(term.index)?;
        let degree = term.index.degree();
        let refused = KernelError::OneSided { degree, order, limit: HIGHEST };
        if order == 0 || degree.saturating_add(order) > HIGHEST {
            return Err(refused.into());
        }
        let exact = derive(degree, order).ok_or(refused)?;
        let identity = Term { index: MultiIndex::ZERO, factor: 1.0 };
        let across = Exchange::<1>::new(&[identity], (degree + order).next_multiple_of(2))?;
        let constant = gaussian_constant::<1>(std::f64::consts::PI);
        let across = across.radial().unwrap_or(&[]).iter().map(|c| c / constant).collect();
        let turned = if side == Side::Right { f64::from(term.index.sign()) } else { 1.0 };
        let front = gaussian_constant::<D>(std::f64::consts::PI) * turned * term.factor;
        let coefficients = exact.iter().map(|a| a.to_f64()).collect();
        Ok(Self { term: [term], axis, side, order, exact, coefficients, front, across })
    }

    /// a_1, ..., a_(beta+r-1), for the left side.
    pub fn coefficients(&self) -> &[f64] {
        &self.coefficients
    }

    /// The moment pi^(-1/2) Int_0^inf z^n sum_j a_j z^j exp(-z^2) dz along the axis, on the left and for c = 1:
    /// (-1)^beta beta! for n = beta, zero for the other 1 <= n <= beta + r - 1, and M_0 for n = 0.
    pub fn axis_moment(&self, n: u32) -> f64 {
        let half = half_moments(n as usize + self.exact.len());
        let terms = self.exact.iter().zip(half.iter().skip(n as usize + 1));
        terms.fold(Twofold::default(), |sum, (&a, &half)| sum + a * half).to_f64()
    }

    /// The axis of the derivative.
    pub fn axis(&self) -> usize {
        self.axis
    }

    /// The side of the sources.
    pub fn side(&self) -> Side {
        self.side
    }
}

/// The axis of a derivative along one.
pub(crate) fn along_axis<const D: usize>(index: MultiIndex<D>) -> Result<usize> {
    let mut axes = index.exponents().into_iter().enumerate().filter(|&(_, exponent)| exponent > 0);
    match (axes.next(), axes.count()) {
        (Some((axis, _)), 0) => Ok(axis),
        (first, others) => {
            Err(KernelError::NotAlongAxis { degree: index.degree(), axes: usize::from(first.is_some()) + others }
                .into())
        }
    }
}

/// pi^(-1/2) Int_0^inf z^n exp(-z^2) dz for n = 0 to `highest`.
fn half_moments(highest: usize) -> Vec<Twofold> {
    let mut half = vec![Twofold::from(0.5), Twofold::FRAC_1_SQRT_PI * 0.5.into()];
    for n in 2..=highest {
        half.push(half[n - 2] * (0.5 * (n - 1) as f64).into());
    }
    half
}

/// The a_j with sum_j a_j half(j + alpha) = (-1)^beta beta! [alpha = beta], alpha = 1, ..., beta + r - 1.
fn derive(degree: u32, order: u32) -> Option<Vec<Twofold>> {
    let n = (degree + order - 1) as usize;
    let half = half_moments(2 * n);
    let required = (1..=degree).fold(1.0, |product, k| -product * f64::from(k));
    let rows = (1..=n).map(|alpha| {
        let right = if alpha == degree as usize { required } else { 0.0 };
        half[alpha + 1..=alpha + n].iter().copied().chain([right.into()]).collect()
    });
    solve(rows.collect())
}

impl<T: Scalar, const D: usize> Kernel<T, D> for OneSidedGaussian<D> {
    fn value(&self, z: &[T; D]) -> T {
        let along = if self.side == Side::Left { z[self.axis] } else { -z[self.axis] };
        // Written so that NaN stays.
        if along <= T::zero() {
            return T::zero();
        }
        let mut product = horner(&self.coefficients, along) * along * T::lift(self.front);
        for (axis, &x) in z.iter().enumerate() {
            if axis != self.axis {
                product *= horner(&self.across, x * x);
            }
        }
        let (_, [decay]) = decay(&[*z], 1.0);
        product * decay
    }

    fn terms(&self) -> &[Term<D>] {
        &self.term
    }

    fn order(&self) -> u32 {
        self.order
    }

    /// 6, 6.5 for beta + r = 7 and 7 for beta + r = 8: outside lies less than 1e-5 alpha! |c| of any moment M_alpha with a
    /// condition, for D <= 3.
    fn support(&self) -> f64 {
        6.0 + 0.5 * f64::from((self.term[0].index.degree() + self.order).saturating_sub(6))
    }

    /// 2/3 for beta = r = 1. For the others the spacing at which the first term of the Euler-Maclaurin formula for M_1,
    /// (h/epsilon)^4 pi^(-1/2) |a_2|/120, is 5e-5; those of the other M_n/n! are smaller.
    fn overlap_limit(&self) -> f64 {
        let &[_, second, ..] = self.coefficients.as_slice() else { return 2.0 / 3.0 };
        (5e-5 * 120.0 * std::f64::consts::PI.sqrt() / second.abs()).powf(0.25)
    }
}
