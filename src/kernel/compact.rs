//! Radial smoothing kernels of compact support: piecewise polynomials in r = |z|, with all the derivatives they have.
//!
//! As a function of s = |z|^2 the profile w has the derivatives g_m = (d/ds)^m w = ((1/2r) d/dr)^m w, and D^beta W is a
//! sum of z^(beta - 2k) g_(|beta| - |k|). Each g_m is kept as a sum of parts (edge - r)^a r^-b P(r) in which nothing
//! cancels at the edge, and b is the true pole at r = 0: it is lower than the degree of the z^(beta - 2k) it meets.

use std::array;

use super::BLOCK;
use super::decay::in_lanes;
use super::exchange::{horner, horner_lanes};
use super::high_order::{constant, for_each_half};
use crate::error::{KernelError, Result};
use crate::multi_index::{MultiIndex, Term};
use crate::scalar::{Scalar, square};

/// (edge - r)^exponent r^-pole P(r) for low <= r < edge, and 0 elsewhere.
#[derive(Clone, Debug)]
pub(super) struct Part {
    pub(super) low: f64,
    pub(super) edge: f64,
    pub(super) exponent: u32,
    pub(super) pole: u32,
    /// P by powers of r: integers over a power of two, so that deriving them is exact.
    pub(super) coefficients: Vec<f64>,
}

/// t^exponent P(t) or, where P is `radial`, t^exponent P(r), with t = edge - r kept within 0 and `width`.
#[derive(Clone, Debug)]
pub(super) struct Step {
    pub(super) edge: f64,
    pub(super) width: f64,
    pub(super) exponent: u32,
    pub(super) radial: bool,
    pub(super) coefficients: Vec<f64>,
}

/// W(z) = sum of parts of g_0 over their integral.
#[derive(Clone, Debug)]
pub(super) struct Compact<const D: usize> {
    name: &'static str,
    pub(super) term: [Term<D>; 1],
    pub(super) support: f64,
    /// 1 / Int sum of parts of g_0.
    pub(super) front: f64,
    /// The sum of parts of g_0 where the profile w, as the docs of the kernel state it, is 1.
    pub(super) unit: f64,
    /// g_0 as a sum of terms that do not cancel.
    steps: Vec<Step>,
    /// The parts of g_0, g_1, ..., one entry a degree.
    derivatives: Vec<Vec<Part>>,
}

impl Part {
    /// (1/2r) d/dr of the part: (edge - r)^(a-1) r^-(b+2) ((edge - r)(r P' - b P) - a r P)/2.
    fn differentiated(&self) -> Self {
        let (a, b) = (f64::from(self.exponent), f64::from(self.pole));
        let mut next = vec![0.0; self.coefficients.len() + 1];
        for (i, &c) in self.coefficients.iter().enumerate() {
            let inner = 0.5 * (i as f64 - b) * c;
            if self.exponent == 0 {
                next[i] += inner;
            } else {
                next[i] += self.edge * inner;
                next[i + 1] -= inner + 0.5 * a * c;
            }
        }
        let pole = self.pole + 2;
        let common = next.iter().zip(0..pole).take_while(|&(&c, _)| c == 0.0).count();
        next.drain(..common);
        while next.last() == Some(&0.0) {
            next.pop();
        }
        Self { exponent: self.exponent.saturating_sub(1), pole: pole - common as u32, coefficients: next, ..*self }
    }

    /// Int_0^edge r^(D-1) (edge - r)^a P(r) dr, by the Beta function B(n, a + 1) = 1/(n C(n + a, a)).
    fn radial_integral<const D: usize>(&self) -> f64 {
        let a = self.exponent;
        let terms = self.coefficients.iter().zip(D..).map(|(&c, n)| {
            let binomial = (1..=a).fold(1.0, |product, j| product * (n as f64 + f64::from(j)) / f64::from(j));
            c * power(self.edge, n as u32 + a) / (n as f64 * binomial)
        });
        terms.sum()
    }

    /// Adds front z^monomial times the part, at points of lengths r.
    #[inline]
    fn add<T: Scalar, const D: usize>(
        &self,
        monomial: MultiIndex<D>,
        front: T,
        (z, r): (&[[T; D]], &[T]),
        out: &mut [T],
    ) {
        let (low, edge) = (T::lift(self.low), T::lift(self.edge));
        let degree = monomial.degree();
        for ((z, &r), out) in z.iter().zip(r).zip(out) {
            // Written so that NaN goes on into the sum.
            if r < low || r >= edge {
                continue;
            }
            let angular = if self.pole == 0 {
                monomial.power(z)
            } else if r == T::zero() {
                continue;
            } else {
                // By the direction z/r no power of a small r over- or underflows.
                let direction = monomial.power(&z.map(|x| x / r));
                if degree >= self.pole {
                    direction * power(r, degree - self.pole)
                } else {
                    direction * power(T::one() / r, self.pole - degree)
                }
            };
            *out += front * angular * (power(edge - r, self.exponent) * horner(&self.coefficients, r));
        }
    }
}

impl<const D: usize> Compact<D> {
    /// The kernel with the parts `whole`, all of low = 0; `steps` and `split` have the same sum, `split` is what is
    /// differentiated, up to degree `limit`.
    pub(super) fn new(
        name: &'static str,
        whole: Vec<Part>,
        steps: Vec<Step>,
        split: Vec<Part>,
        unit: f64,
        limit: u32,
    ) -> Self {
        let support = whole.iter().fold(0.0, |support: f64, part| support.max(part.edge));
        let integral: f64 = whole.iter().map(Part::radial_integral::<D>).sum();
        let mut derivatives = vec![whole];
        let mut parts = split;
        for _ in 0..limit {
            parts = parts.iter().map(Part::differentiated).collect();
            derivatives.push(parts.clone());
        }
        let term = [Term { index: MultiIndex::ZERO, factor: 1.0 }];
        Self { name, term, support, front: 1.0 / (sphere::<D>() * integral), unit, steps, derivatives }
    }

    #[inline]
    pub(super) fn value<T: Scalar>(&self, z: &[T; D]) -> T {
        let [value] = self.at(&[*z]);
        value
    }

    #[inline]
    pub(super) fn values<T: Scalar>(&self, z: &[[T; D]], out: &mut [T]) {
        in_lanes(z, out, |z| self.at(z));
    }

    /// W at L points.
    #[inline(always)]
    fn at<T: Scalar, const L: usize>(&self, z: &[[T; D]; L]) -> [T; L] {
        // Comparisons are written so that NaN stays and no branch is needed.
        let lengths: [T; L] = array::from_fn(|i| length(&z[i]));
        let mut sum = [T::zero(); L];
        for step in &self.steps {
            let (edge, width) = (T::lift(step.edge), T::lift(step.width));
            // Beyond the edge powers of r may overflow. At a knot one step alone may have a derivative for dual numbers.
            let r = lengths.map(|r| if r >= edge { edge } else { r });
            let t = r.map(|r| edge - r).map(|t| if t > width { width } else { t });
            let polynomial = horner_lanes(&step.coefficients, if step.radial { &r } else { &t });
            for i in 0..L {
                sum[i] += power(t[i], step.exponent) * polynomial[i];
            }
        }
        sum.map(|sum| sum * T::lift(self.front))
    }

    /// sum_i c_i D^beta_i W.
    #[inline]
    pub(super) fn combination<T: Scalar>(&self, terms: &[Term<D>], z: &[[T; D]], out: &mut [T]) -> Result<()> {
        let limit = self.derivatives.len() - 1;
        for term in terms {
            let degree = term.index.degree();
            if degree as usize > limit {
                return Err(KernelError::Regularity { kernel: self.name, degree, limit: limit as u32 }.into());
            }
        }
        let mut lengths = [T::zero(); BLOCK];
        for (z, out) in z.chunks(BLOCK).zip(out.chunks_mut(BLOCK)) {
            out.fill(T::zero());
            let r = &mut lengths[..z.len()];
            for (r, z) in r.iter_mut().zip(z) {
                *r = length(z);
            }
            for &Term { index, factor } in terms {
                let degree = index.degree();
                for_each_half(index, |halves, taken| {
                    let mut front = T::lift(factor) * T::lift(self.front);
                    let mut exponents = index.exponents();
                    for (n, &k) in exponents.iter_mut().zip(halves) {
                        front *= T::lift(constant(*n, k));
                        *n -= 2 * k;
                    }
                    for part in self.derivatives.get((degree - taken) as usize).into_iter().flatten() {
                        part.add(MultiIndex::new(exponents), front, (z, r), out);
                    }
                });
            }
        }
        Ok(())
    }

    /// 2 z g_1.
    #[inline]
    pub(super) fn gradient<T: Scalar>(&self, z: &[T; D]) -> [T; D] {
        let r = [length(z)];
        let mut slope = [T::zero()];
        for part in self.derivatives.get(1).into_iter().flatten() {
            part.add(MultiIndex::ZERO, T::lift(2.0 * self.front), (std::slice::from_ref(z), &r), &mut slope);
        }
        z.map(|x| x * slope[0])
    }
}

/// |z|; a constant at z = 0, where the root has no derivative for dual numbers to carry.
#[inline(always)]
fn length<T: Scalar, const D: usize>(z: &[T; D]) -> T {
    if let [x] = z.as_slice() {
        return x.abs();
    }
    let s = square(z);
    if s == T::zero() { T::zero() } else { s.sqrt() }
}

/// x^n by repeated squaring.
#[inline(always)]
fn power<T: Scalar>(mut x: T, mut n: u32) -> T {
    let mut product = T::one();
    while n > 0 {
        if n % 2 == 1 {
            product *= x;
        }
        n /= 2;
        if n > 0 {
            x *= x;
        }
    }
    product
}

/// The area of the unit sphere in D dimensions, 2 pi^(D/2) / Gamma(D/2): 2, 2 pi, 4 pi, ...
fn sphere<const D: usize>() -> f64 {
    use std::f64::consts::TAU;
    let (first, dimension) = if D % 2 == 1 { (2.0, 1) } else { (TAU, 2) };
    (dimension..D).step_by(2).fold(first, |area, d| area * TAU / d as f64)
}

/// The traits of a kernel that is a tuple struct around a [`Compact`] and has a constant `OVERLAP_LIMITS` for D = 1, 2,
/// 3; the expression says whether it is positive definite.
macro_rules! compact_kernel {
    ($name:ident, $definite:expr) => {
        impl<const D: usize> Default for $name<D> {
            fn default() -> Self {
                Self::new()
            }
        }

        impl<T: Scalar, const D: usize> Kernel<T, D> for $name<D> {
            #[inline]
            fn value(&self, z: &[T; D]) -> T {
                self.0.value(z)
            }

            fn values(&self, z: &[[T; D]], out: &mut [T]) {
                self.0.values(z, out);
            }

            fn terms(&self) -> &[Term<D>] {
                &self.0.term
            }

            fn order(&self) -> u32 {
                2
            }

            fn support(&self) -> f64 {
                self.0.support
            }

            fn overlap_limit(&self) -> f64 {
                Self::OVERLAP_LIMITS[D.clamp(1, 3) - 1]
            }

            fn positive_definite(&self) -> bool {
                $definite
            }
        }

        impl<T: Scalar, const D: usize> SmoothingKernel<T, D> for $name<D> {
            fn derivative(&self, beta: MultiIndex<D>, z: &[T; D]) -> Result<T> {
                let mut out = [T::zero()];
                self.derivatives(beta, std::slice::from_ref(z), &mut out)?;
                Ok(out[0])
            }

            fn derivatives(&self, beta: MultiIndex<D>, z: &[[T; D]], out: &mut [T]) -> Result<()> {
                self.0.combination(&[Term { index: beta, factor: 1.0 }], z, out)
            }

            fn combination(&self, terms: &[Term<D>], z: &[[T; D]], out: &mut [T]) -> Result<()> {
                self.0.combination(terms, z, out)
            }

            fn gradient(&self, z: &[T; D]) -> Result<[T; D]> {
                Ok(self.0.gradient(z))
            }

            fn normalization(&self) -> f64 {
                self.0.front * self.0.unit
            }
        }
    };
}

pub(super) use compact_kernel;
