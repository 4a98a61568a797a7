//! The exact propagator of a small linear system.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use super::stepper::check_finite;
use crate::error::{Error, Result, TimeError};
use crate::particles::reserved;

/// The exact propagator u(t) = exp(t A) u(0) of u' = A u, A a small dense matrix.
///
/// An oracle: it has no time error, so that what is left is the error in space. Symmetric matrices (to (16 + N) eps
/// of the largest entry) are propagated by their eigenvectors, with an error of about N eps |t| |A|; others by
/// nalgebra's scaling and squaring. Memory N^2, time of order N^3: for N up to about 1000.
///
/// ```
/// use parops::Exponential;
/// let rotation = Exponential::new(2, |u, du| {
///     du.copy_from_slice(&[u[1], -u[0]]);
///     Ok(())
/// })?;
/// let mut u = [1.0, 0.0];
/// rotation.propagate(0.5, &mut u)?;
/// assert!((u[0] - 0.5_f64.cos()).abs() < 1e-15 && (u[1] + 0.5_f64.sin()).abs() < 1e-15);
/// # parops::Result::Ok(())
/// ```
///
/// Source: the variation of constants, u(t) = exp(t A) u(0); scaling and squaring by Higham (2005), as in nalgebra.
#[derive(Clone, Debug)]
pub struct Exponential(Form);

#[derive(Clone, Debug)]
enum Form {
    /// A = Q diag(lambda) Q^T.
    Symmetric { lambda: DVector<f64>, q: DMatrix<f64> },
    /// A itself.
    General(DMatrix<f64>),
}

/// Largest |t| |A| of the general form; its squarings, log2 of it, are exact enough and few.
const MOST: f64 = 1e6;

impl Exponential {
    /// The propagator of the linear map `apply(u, du)`, du = A u, called once for every unit vector u of length N =
    /// `size`; `du` is zero before.
    ///
    /// # Errors
    /// [`ParticleError::Memory`](crate::ParticleError::Memory) where there is no memory for N^2 entries, before `apply`
    /// is called; [`TimeError::NotFinite`] (stage 1, t = 0) naming the row of the first entry that is not finite; and those of
    /// `apply`.
    pub fn new(size: usize, mut apply: impl FnMut(&[f64], &mut [f64]) -> Result<()>) -> Result<Self> {
        let count = size.saturating_mul(size);
        let mut entries = reserved(count)?;
        entries.resize(count, 0.0);
        let mut a = DMatrix::from_vec(size, size, entries);
        let mut unit = vec![0.0; size];
        for (q, mut column) in a.column_iter_mut().enumerate() {
            unit[q] = 1.0;
            apply(&unit, column.as_mut_slice())?;
            unit[q] = 0.0;
            if let Some(p) = column.iter().position(|x: &f64| !x.is_finite()) {
                return Err(Error::from(TimeError::NotFinite { stage: 1, t: 0.0 }).at(p));
            }
        }
        if size == 0 {
            return Ok(Self(Form::General(a)));
        }
        let scale = if a.amax() > 0.0 { a.amax() } else { 1.0 };
        // What `apply` rounds in an entry, and then what the eigenvectors are wrong by anyway.
        let round_off = (16.0 + size as f64) * f64::EPSILON * scale;
        let symmetric = (0..size).all(|q| (0..q).all(|p| (a[(p, q)] - a[(q, p)]).abs() <= round_off));
        if !symmetric {
            return Ok(Self(Form::General(a)));
        }
        let unscaled = (&a + a.transpose()) / (2.0 * scale);
        let most_sweeps = 100 * size.max(10);
        Ok(Self(match SymmetricEigen::try_new(unscaled, f64::EPSILON, most_sweeps) {
            Some(eigen) => Form::Symmetric { lambda: eigen.eigenvalues * scale, q: eigen.eigenvectors },
            None => Form::General(a),
        }))
    }

    /// N.
    pub fn size(&self) -> usize {
        match &self.0 {
            Form::Symmetric { lambda, .. } => lambda.len(),
            Form::General(a) => a.nrows(),
        }
    }

    /// The largest eigenvalue modulus of A where A is symmetric, `None` otherwise: the sharp bound for
    /// [`StepLimit::from_spectral_bound`](crate::StepLimit::from_spectral_bound).
    pub fn spectral_radius(&self) -> Option<f64> {
        match &self.0 {
            Form::Symmetric { lambda, .. } => Some(lambda.amax()),
            Form::General(_) => None,
        }
    }

    /// u = exp(t A) u.
    ///
    /// # Errors
    /// [`TimeError::Shape`] where u is not of length N; [`TimeError::Span`] where t is not finite;
    /// [`TimeError::NotFinite`] naming the particle where u (stage 1) or the result (stage 2) is not finite;
    /// [`TimeError::Limit`] where A is not symmetric and |t| times its largest column sum is above 1e6.
    pub fn propagate(&self, t: f64, u: &mut [f64]) -> Result<()> {
        if u.len() != self.size() {
            return Err(TimeError::Shape { found: u.len(), needed: self.size() }.into());
        }
        if !t.is_finite() {
            return Err(TimeError::Span { start: 0.0, end: t }.into());
        }
        if u.is_empty() {
            return Ok(());
        }
        let start = DVector::from_column_slice(u);
        check_finite(&start, 1, 0.0)?;
        let end = match &self.0 {
            Form::Symmetric { lambda, q } => {
                let mut modes = q.tr_mul(&start);
                modes.iter_mut().zip(lambda.iter()).for_each(|(mode, lambda)| *mode *= (lambda * t).exp());
                q * modes
            }
            Form::General(a) => {
                let norm = a.column_iter().map(|column| column.lp_norm(1)).fold(0.0, f64::max);
                let limit = MOST / norm;
                if t.abs() > limit {
                    return Err(TimeError::Limit { dt: t, limit }.into());
                }
                (a * t).exp() * start
            }
        };
        check_finite(&end, 2, t)?;
        u.copy_from_slice(end.as_slice());
        Ok(())
    }
}
