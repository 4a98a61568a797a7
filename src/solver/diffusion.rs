//! div(D grad u): a diffusivity and a method for the Laplacian.

use super::coefficient::{Diffusivity, diffusivities};
use super::fields::Fields;
use super::growth::legal;
use super::limits::{Limits, Rate};
use super::term::{SceneTerm, Site};
use crate::apply::{Report, Rows};
use crate::error::{Error, Limit, ParticleError, Result, SolverError};
use crate::neighbors::Neighbors;
use crate::operator::{DivGrad, Mean, Method};
use crate::scalar::Scalar;

/// The term div(D grad u) of a scene.
///
/// A constant D multiplies the rows of the method; any other lowers to [`DivGrad`] with the mean of the scene.
#[derive(Clone, Debug)]
pub struct Diffusion<C, M> {
    pub(super) diffusivity: C,
    pub(super) method: M,
    pub(super) mean: Mean,
}

/// The rows of a diffusion term, and the constant they are multiplied by.
#[derive(Clone, Debug)]
pub struct DiffusionRows<E: Fields> {
    rows: Rows<[f64; 1], E::Scalar>,
    factor: f64,
    monotone: bool,
}

impl<E: Fields> DiffusionRows<E> {
    fn new(rows: Rows<[f64; 1], E::Scalar>, factor: f64) -> Self {
        Self { monotone: rows.cannot_grow(legal::<E>()), rows, factor }
    }
}

impl<C, M> Diffusion<C, M> {
    /// The diffusivity.
    pub fn diffusivity(&self) -> &C {
        &self.diffusivity
    }

    /// The method for the Laplacian.
    pub fn method(&self) -> &M {
        &self.method
    }

    /// The mean of two diffusivities.
    pub fn mean(&self) -> Mean {
        self.mean
    }
}

impl<C: Diffusivity<D>, M: Method<D, Out = [f64; 1]> + Clone, const D: usize, E: Fields> SceneTerm<D, E>
    for Diffusion<C, M>
{
    type Rows = DiffusionRows<E>;
    const APPLIES: usize = 1;

    fn build<P: Neighbors<D>>(&self, site: &Site<D>, neighbors: &P) -> Result<DiffusionRows<E>> {
        if let Some(diffusivity) = self.diffusivity.constant() {
            if !(diffusivity >= 0.0 && diffusivity.is_finite()) {
                return Err(ParticleError::Diffusivity { diffusivity }.into());
            }
            let rows = Rows::assemble(&site.screened(&self.method), neighbors)?;
            return Ok(DiffusionRows::new(rows, diffusivity));
        }
        let values = diffusivities(&self.diffusivity, site.points())?;
        let method = DivGrad::new(self.method.clone(), values)?.mean(self.mean);
        let rows = Rows::assemble(&site.screened(&method), neighbors)?;
        Ok(DiffusionRows::new(rows, 1.0))
    }

    #[inline(always)]
    fn rate(&self, rows: &DiffusionRows<E>, p: usize, _: &[f64; D], _: f64, u: &[E], rate: E) -> E {
        let (own, mut sum) = (u[p], E::ZERO);
        let (diagonal, pairs) = rows.rows.pairs(p);
        if let Some([d]) = diagonal {
            sum = sum.plus_product(d, own);
        }
        for (q, [w]) in pairs {
            sum = sum.plus_difference(w, u[q], own);
        }
        rate.plus_product(E::Scalar::lift(rows.factor), sum)
    }

    fn limit(&self, rows: &mut DiffusionRows<E>, _: &Site<D>, _: f64, _: &[E], limits: &mut Limits) -> Result<()> {
        limits.add(Limit::Diffusion, Rate::decay(rows.factor * rows.rows.report().spectral_bound));
        Ok(())
    }

    fn entries(&self, rows: &DiffusionRows<E>, p: usize, _: &[f64; D], _: f64, entry: &mut dyn FnMut(usize, f64)) {
        rows.rows.entries_of(p, |w| rows.factor * w[0], entry);
    }

    fn monotone(&self, rows: &DiffusionRows<E>) -> bool {
        rows.monotone
    }

    fn report<'a>(&self, rows: &'a DiffusionRows<E>) -> Option<&'a Report> {
        Some(rows.rows.report())
    }
}

/// Refuses rows whose report says that modes may grow with every stepper.
pub(super) fn check_contrast(report: &Report) -> Result<()> {
    if report.growing == 0 {
        return Ok(());
    }
    let refused = Error::from(SolverError::Contrast { contrast: report.contrast });
    Err(match report.worst_rows().find(|row| row.growing) {
        Some(row) => refused.at(row.target),
        None => refused,
    })
}
