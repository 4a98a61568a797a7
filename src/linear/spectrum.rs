//! Where the eigenvalues of an operator lie: the rightmost and the largest, estimated from products.

use nalgebra::{Complex, DMatrix};

use super::invariant::eigenvalues;
use super::krylov::Search;
use super::norm::norm;
use super::pseudospectrum::reach;
use crate::apply::Apply;
use crate::error::{Error, ErrorKind, LinearError, Result};
use crate::particles::{Random, reserved};

/// Estimates the rightmost eigenvalue max Re(lambda) and the spectral radius max |lambda| of a linear map u -> A u, from
/// products with A alone: stored rows, an operator without weights, a sum of both, or what boundary conditions leave of
/// one.
///
/// Up to 640 entries all eigenvalues are found from the matrix: n products, some 25 n^3 operations (0.1 s at n = 400) and
/// n^2 numbers. None is missed then, but for rounding: they are those of a matrix within eps |A| of this one, which lie far
/// off where eigenvectors are all but parallel (0.85 for a shift of 200 entries, whose eigenvalues are 0), and are what
/// a run in rounded numbers sees. Beyond that, two runs of the Krylov-Schur method with m vectors from a fixed
/// pseudo-random start, and up to two more where growth below 0.1 of the radius may be made by rounding. Equal maps
/// give equal bits. A run ends when the residual |A x - lambda x| of its unit vector x is below the tolerance times the
/// radius and restarts have not moved lambda by more; the radius is found to 1e-3. Cost: 150 to 500 products where the
/// rightmost eigenvalue stands apart (diffusion; advection that grows fast), with N m^2 operations beside every m of
/// them; memory m + 1 vectors.
///
/// Accuracy of the runs on sets of 144 to 1024 particles, against dense eigenvalues, in units of the radius: 1e-9 where the
/// rightmost eigenvalue stands apart. Amid a spectrum along the imaginary axis (advection with '+', or stabilized) growth
/// below about 0.01 is missed with m = 32, also by runs that converged, to an eigenvalue further left; with m = 128 the
/// estimate was within 4e-4 after 3000 products. Among eigenvalues crowded at zero growth below about (10/products)^2 is
/// missed: an abscissa far above its [`error`](Spectrum::error) shows growth, one below shows stability only where
/// [`exact`](Spectrum::exact).
///
/// Defaults: m = 32, tolerance 1e-9, at most 3000 products a run.
///
/// ```
/// use parops::{CsrMatrix, SpectrumEstimator};
/// let spiral = CsrMatrix::from_triplets(3, 3, [(0, 0, 0.1), (0, 1, 2.0), (1, 0, -2.0), (1, 1, 0.1), (2, 2, -3.0)])?;
/// let spectrum = SpectrumEstimator::new().of(&spiral)?;
/// assert!((spectrum.abscissa - 0.1).abs() < 1e-12 && (spectrum.frequency - 2.0).abs() < 1e-12);
/// assert!((spectrum.radius - 3.0).abs() < 1e-12 && spectrum.converged);
/// # parops::Result::Ok(())
/// ```
///
/// Source: G. W. Stewart, A Krylov-Schur algorithm for large eigenproblems, 2001; the eigenvalues of the small matrix are
/// nalgebra's, shifted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpectrumEstimator {
    subspace: usize,
    tolerance: f64,
    most: usize,
    dense: usize,
    rounding: f64,
}

/// An abscissa below this, over the radius, is rounding: that of all eigenvalues of rings of 640 entries is up to 7e-12.
const ROUNDING: f64 = 2e-11;

/// One below this may be what rounding tears equal eigenvalues apart by: 0.004 where five have one eigenvector, as 0 has
/// where rows of order 8 take x^8 to x^6 and so on, and 0.006 where three have in `f32`.
const TORN: f64 = 0.1;

/// Times what another rounding moves an eigenvalue by.
const MARGIN: f64 = 8.0;

/// Roundings of eigenvalues, in eps of the norm of the matrix.
const ROUNDED: f64 = 64.0 * f64::EPSILON;

/// Rounding of products with rows whose weights are rounded themselves, in units of the radius.
const PRODUCTS: f64 = 128.0 * f64::EPSILON;

/// Other roundings that a run which claims slow growth is made again with: one alone may move a chain by chance too little.
const AGAIN: u64 = 2;

/// du = A u; one type for all maps, so that a program holds the search once.
type Product<'a> = dyn FnMut(&[f64], &mut [f64]) -> Result<()> + 'a;

/// What is known of a spectrum, in the units of the operator, 1/time for a right-hand side.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Spectrum {
    /// max Re(lambda): the rate at which the fastest mode grows.
    pub abscissa: f64,
    /// |Im(lambda)| of that mode.
    pub frequency: f64,
    /// |A x - lambda x| of its unit vector x; the rounding of the matrix where all eigenvalues were found.
    pub residual: f64,
    /// How far left of it residual and rounding let that eigenvalue be, to a factor of some 2: far more where another
    /// one has nearly the same eigenvector. From below where not [`exact`](Self::exact), at least
    /// 2e-11 of the radius where so.
    pub error: f64,
    /// max |lambda|, from below unless exact.
    pub radius: f64,
    /// Products with A.
    pub applies: usize,
    /// Whether the residual is below the tolerance times the radius; where not, the abscissa is a guess.
    pub converged: bool,
    /// Whether all eigenvalues were found; where not, one further right may have been missed, converged or not.
    pub exact: bool,
}

/// The spectrum of a map to zero.
impl Default for Spectrum {
    fn default() -> Self {
        let (converged, exact) = (true, true);
        Self { abscissa: 0.0, frequency: 0.0, residual: 0.0, error: 0.0, radius: 0.0, applies: 0, converged, exact }
    }
}

impl Spectrum {
    /// Abscissa over radius; 0 for the zero map.
    ///
    /// Rounding of the estimate is below 2e-11, so that a limit of 1e-8 tells growth from it.
    pub fn relative_growth(&self) -> f64 {
        if self.radius > 0.0 { self.abscissa / self.radius } else { 0.0 }
    }
}

impl Default for SpectrumEstimator {
    fn default() -> Self {
        Self::new()
    }
}

impl SpectrumEstimator {
    /// The estimator at its defaults.
    #[inline]
    pub fn new() -> Self {
        Self { subspace: 32, tolerance: 1e-9, most: 3000, dense: 640, rounding: PRODUCTS }
    }

    /// Sets the number m of vectors, at least 8.
    #[must_use]
    #[inline]
    pub fn subspace(self, vectors: usize) -> Self {
        Self { subspace: vectors.max(8), ..self }
    }

    /// Sets after how many products a run ends, at the next restart.
    #[must_use]
    #[inline]
    pub fn most(self, products: usize) -> Self {
        Self { most: products, ..self }
    }

    /// Sets up to how many entries all eigenvalues are found, if as many products may be made; 0 for none.
    #[must_use]
    pub fn dense(self, entries: usize) -> Self {
        Self { dense: entries, ..self }
    }

    /// Sets what sums of a product are rounded to, in units of the radius, where it is more than in `f64`.
    #[must_use]
    pub(crate) fn rounded(self, epsilon: f64) -> Self {
        Self { rounding: epsilon.max(PRODUCTS), ..self }
    }

    /// Sets the residual in units of the radius.
    ///
    /// # Errors
    /// [`LinearError::Setting`] outside 1e-14 to 0.1.
    pub fn tolerance(self, tolerance: f64) -> Result<Self> {
        let (low, high) = (1e-14, 0.1);
        if !(low..=high).contains(&tolerance) {
            return Err(LinearError::Setting { value: tolerance, low, high }.into());
        }
        Ok(Self { tolerance, ..self })
    }

    /// Whether all eigenvalues of a map of n entries are looked for; where QR does not find them the runs are made.
    pub fn is_exact(&self, n: usize) -> bool {
        n <= self.dense.min(self.most)
    }

    /// The spectrum of an operator that maps a field onto one of the same particles.
    ///
    /// # Errors
    /// [`LinearError::NotSquare`] where targets and sources differ in number: use [`estimate`](Self::estimate) with a
    /// closure that fills in the other sources; and those of `estimate`.
    pub fn of<A: Apply<f64> + ?Sized>(&self, operator: &A) -> Result<Spectrum> {
        let (rows, columns) = (operator.targets(), operator.sources());
        if rows != columns {
            return Err(LinearError::NotSquare { rows, columns }.into());
        }
        self.estimate(rows, |u, du| operator.apply(u, du))
    }

    /// The spectrum of the linear map `apply(u, du)`, du = A u, of vectors of length n; `du` is zero before.
    ///
    /// # Errors
    /// Those of `apply`; [`LinearError::Value`] naming the first entry of a product that is not finite;
    /// [`LinearError::NotConverged`] where the eigenvalues of the small matrix are not found;
    /// [`ParticleError::Memory`](crate::ParticleError::Memory) where m + 1 vectors, or the matrix, do not fit.
    pub fn estimate(&self, n: usize, mut apply: impl FnMut(&[f64], &mut [f64]) -> Result<()>) -> Result<Spectrum> {
        self.found(n, &mut apply)
    }

    fn found(&self, n: usize, mut apply: &mut Product<'_>) -> Result<Spectrum> {
        if n == 0 {
            return Ok(Spectrum::default());
        }
        if self.is_exact(n)
            && let Some(spectrum) = all(n, &mut apply, self.rounding)?
        {
            return Ok(spectrum);
        }
        self.runs(n, apply, AGAIN)
    }

    /// The same of a map whose eigenvalues do not crowd the imaginary axis, as that of diffusion: there runs that
    /// converge find the rightmost, at n = 625 in a thirtieth of the time that all eigenvalues take. These are found
    /// where no run converges, and where growth is within the error of the run, as where an eigenvalue 0 of two has one
    /// eigenvector.
    pub(crate) fn settle(&self, n: usize, mut apply: impl FnMut(&[f64], &mut [f64]) -> Result<()>) -> Result<Spectrum> {
        if n > 0 && self.is_exact(n) {
            let found = self.runs(n, &mut apply, 0);
            let settled = |found: &Spectrum| {
                !(ROUNDING * found.radius..=found.error.max(TORN * found.radius)).contains(&found.abscissa)
            };
            if found.as_ref().is_ok_and(|found| found.converged && settled(found)) {
                return found;
            }
        }
        self.found(n, &mut apply)
    }

    /// Runs for the largest and the rightmost eigenvalue, the latter `again` with other roundings where it claims slow
    /// growth.
    fn runs(&self, n: usize, mut apply: &mut Product<'_>, again: u64) -> Result<Spectrum> {
        let tolerance = self.tolerance.max(1e-3);
        let outer = Search { subspace: self.subspace, tolerance, rounding: self.rounding, most: self.most };
        let largest = outer.run(n, &mut apply, |value| value.norm(), 0.0)?;
        let right = Search { tolerance: self.tolerance, ..outer };
        // One type each for the map and for what is foremost: a program holds the search for it once.
        let key = |value: Complex<f64>| value.re;
        let rightmost = right.run(n, &mut apply, key, largest.value.norm())?;
        let radius = largest.value.norm().max(rightmost.value.norm());
        let abscissa = rightmost.value.re;
        let (mut error, mut applies) = (rightmost.error, largest.applies + rightmost.applies);
        for seed in 0..again {
            if !(abscissa > ROUNDING * radius + error && abscissa <= TORN * radius) {
                break;
            }
            // What rounding, or what the run leaves, has torn from its like is elsewhere after another rounding.
            let (size, mut random) = (rightmost.residual.max(self.rounding * radius), Random::new(seed));
            let change: Vec<f64> = (0..n).map(|_| size * random.uniform().mul_add(2.0, -1.0)).collect();
            let mut rounded: &mut Product<'_> = &mut |u, du| {
                apply(u, du)?;
                du.iter_mut().zip(u).zip(&change).for_each(|((du, u), change)| *du += change * u);
                Ok(())
            };
            match right.run(n, &mut rounded, key, radius) {
                // Where that finds no eigenvalues all is open.
                Err(error) if !matches!(error.kind(), ErrorKind::Linear(LinearError::NotConverged { .. })) => {
                    return Err(error);
                }
                Err(_) => error = error.max(abscissa),
                Ok(other) => {
                    error = error.max(MARGIN * (other.value.re - abscissa).abs());
                    applies += other.applies;
                }
            }
        }
        Ok(Spectrum {
            abscissa,
            frequency: rightmost.value.im.abs(),
            residual: rightmost.residual,
            error,
            radius,
            applies,
            converged: rightmost.converged,
            exact: false,
        })
    }
}

/// The spectrum from all eigenvalues of the matrix, whose columns are the products with unit vectors; `None` where they are
/// not found.
fn all(n: usize, apply: &mut impl FnMut(&[f64], &mut [f64]) -> Result<()>, rounding: f64) -> Result<Option<Spectrum>> {
    // Room for the matrix, and for what the search for its eigenvalues takes beside it.
    let _: Vec<f64> = reserved(n.saturating_mul(n).saturating_mul(8))?;
    let (mut matrix, mut unit) = (DMatrix::zeros(n, n), vec![0.0; n]);
    for (q, mut column) in matrix.column_iter_mut().enumerate() {
        unit[q] = 1.0;
        apply(&unit, column.as_mut_slice())?;
        unit[q] = 0.0;
        if let Some((p, &value)) = column.iter().enumerate().find(|(_, x)| !x.is_finite()) {
            return Err(Error::from(LinearError::Value { value }).at(p));
        }
    }
    let scale = norm(matrix.as_slice());
    let Some(triangle) = eigenvalues(&matrix) else { return Ok(None) };
    let value = |i: usize| triangle[(i, i)];
    let first = (0..n).fold(0, |first, i| if value(i).re > value(first).re { i } else { first });
    let radius = scale * (0..n).fold(0.0, |radius: f64, i| radius.max(value(i).norm()));
    let (abscissa, frequency) = (scale * value(first).re, scale * value(first).im.abs());
    let (change, least) = ((rounding * radius / scale).max(ROUNDED), ROUNDING * radius);
    let error = if abscissa > least { (scale * reach(&triangle, &[], first, change)).max(least) } else { least };
    let (residual, applies, converged, exact) = (f64::EPSILON * scale, n, true, true);
    Ok(Some(Spectrum { abscissa, frequency, residual, error, radius, applies, converged, exact }))
}
