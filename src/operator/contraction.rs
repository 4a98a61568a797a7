//! Operators whose coefficients are given per particle: v . grad, A : Hessian, a scalar times an operator.

use std::sync::Arc;

use super::draft::Draft;
use super::method::Method;
use super::row_report::RowReport;
use crate::error::{Error, OperatorError, ParticleError, Result};
use crate::stencil::Stencil;

/// A method with K outputs contracted with K coefficients per target, (Q f)_p = sum_k c_k(p) (L_k f)_p: one stored
/// weight per pair, sum_k c_k(p) w_pq,k.
///
/// v . grad for [`Gradient`](super::Gradient) and a velocity; A : Hessian for [`Hessian`](super::Hessian) and
/// [`Hessian::packed`](super::Hessian::packed); c Lap for a scalar, K = 1; advection and diffusion together for
/// [`Several`](super::Several). Exactness, order and signs are those of the
/// method, whose rows are computed and certified as they stand. Where the coefficients are constant, [`Along`](super::Along),
/// [`AlongTwice`](super::AlongTwice) and [`Times`](super::Times) give the same for fewer solves.
///
/// ```
/// use parops::{Apply, CellList, Contraction, DcPse, Domain, Gradient, Particles};
/// let scattered = Particles::jittered([0.0; 2], [1.0; 2], [12; 2], 0.3, 1)?;
/// let gradient = DcPse::<Gradient<2>, 2>::new();
/// let neighbors = CellList::build(&scattered, &Domain::open(), gradient.cutoff(&scattered)?)?;
/// let turning: Vec<_> = scattered.points().iter().map(|x| [-x[1], x[0]]).collect();
/// let rows = Contraction::new(gradient, turning)?.assemble(&neighbors)?;
/// let f: Vec<_> = scattered.points().iter().map(|x| x[0] * x[0] + 2.0 * x[1]).collect();
/// let mut out = vec![0.0; f.len()];
/// rows.apply(&f, &mut out)?;
/// // (-y, x) . (2 x, 2)
/// assert!(scattered.points().iter().zip(&out).all(|(x, out)| (out - 2.0 * x[0] * (1.0 - x[1])).abs() < 1e-9));
/// # parops::Result::Ok(())
/// ```
///
/// See also: [`DivGrad`](super::DivGrad), where the coefficient stands inside the derivative; `apply_along` of gradient
/// rows, for velocities that change from application to application.
#[derive(Clone, Debug)]
pub struct Contraction<M, const K: usize> {
    method: M,
    coefficients: Arc<[[f64; K]]>,
}

impl<M, const K: usize> Contraction<M, K> {
    /// The contraction with these coefficients, K per target.
    ///
    /// # Errors
    /// [`ParticleError::Coefficient`] naming the first particle and output whose coefficient is not finite.
    pub fn new(method: M, coefficients: impl Into<Arc<[[f64; K]]>>) -> Result<Self> {
        let coefficients = coefficients.into();
        for (p, values) in coefficients.iter().enumerate() {
            if let Some((output, &coefficient)) = values.iter().enumerate().find(|(_, c)| !c.is_finite()) {
                return Err(Error::from(ParticleError::Coefficient { output, coefficient }).at(p));
            }
        }
        Ok(Self { method, coefficients })
    }

    /// The method that is contracted.
    pub fn method(&self) -> &M {
        &self.method
    }

    fn lengths(&self, targets: usize, _: usize) -> Result<()> {
        let found = self.coefficients.len();
        if found == targets { Ok(()) } else { Err(ParticleError::Length { found, needed: targets }.into()) }
    }

    fn coefficients_of(&self, p: usize) -> Result<&[f64; K]> {
        let found = self.coefficients.len();
        self.coefficients.get(p).ok_or_else(|| OperatorError::Length { found, index: p }.into())
    }

    /// Contracts a row of the method.
    fn contract<const D: usize>(
        &self,
        row: &Stencil<D>,
        whole: (&[[f64; K]], &[f64; K]),
        w: &mut [[f64; 1]],
        diagonal: &mut [f64; 1],
    ) -> Result<()> {
        let coefficients = self.coefficients_of(row.target())?;
        w.iter_mut().zip(whole.0).for_each(|(w, outputs)| w[0] = dot(coefficients, outputs));
        diagonal[0] = dot(coefficients, whole.1);
        Ok(())
    }

    /// What the coefficients change in the report of the method.
    fn certify<const D: usize>(
        &self,
        row: &Stencil<D>,
        w: &[[f64; 1]],
        diagonal: &[f64; 1],
        known: RowReport,
    ) -> Result<RowReport> {
        Ok(contracted(row, w, diagonal, known))
    }
}

/// Working memory of an operator that contracts the rows of another, [`Contraction`] or
/// [`DivTensorGrad`](super::DivTensorGrad): that of the method, and the rows it makes.
#[derive(Clone, Debug)]
pub struct ContractionScratch<S, const D: usize, const K: usize> {
    pub(super) method: S,
    /// The first holds the row of a single target; its stencil is not used.
    pub(super) drafts: Vec<Draft<D, [f64; K]>>,
}

/// Has `make` turn the drafts of the method into rows, and `contract` those that came out.
pub(super) fn through<const D: usize, const K: usize>(
    drafts: &mut [Draft<D, [f64; 1]>],
    whole: &mut Vec<Draft<D, [f64; K]>>,
    make: impl FnOnce(&mut [Draft<D, [f64; K]>]),
    contract: impl Fn(&Draft<D, [f64; K]>, RowReport, &mut Draft<D, [f64; 1]>) -> Result<RowReport>,
) {
    if whole.len() < drafts.len() {
        whole.resize(drafts.len(), Draft::default());
    }
    let whole = &mut whole[..drafts.len()];
    for (draft, whole) in drafts.iter_mut().zip(whole.iter_mut()) {
        std::mem::swap(&mut draft.stencil, &mut whole.stencil);
        whole.clear();
        whole.report = draft.report.clone();
    }
    make(whole);
    for (draft, whole) in drafts.iter_mut().zip(whole) {
        std::mem::swap(&mut draft.stencil, &mut whole.stencil);
        draft.clear();
        draft.report = whole.report.clone().and_then(|known| contract(whole, known, draft));
        if let (true, Err(error)) = (draft.report.is_ok(), draft.finite()) {
            draft.report = Err(error);
        }
    }
}

/// The report of a method after its outputs were contracted to one.
pub(super) fn contracted<const D: usize>(
    row: &Stencil<D>,
    w: &[[f64; 1]],
    diagonal: &[f64; 1],
    mut report: RowReport,
) -> RowReport {
    let general = RowReport::of(row, w, diagonal);
    (report.sum_abs, report.spectral_bound) = (general.sum_abs, general.spectral_bound);
    report.negative_weights = w.iter().zip(row.signs()).filter(|&(w, &sign)| w[0] * f64::from(sign) < 0.0).count();
    report
}

#[inline(always)]
pub(super) fn dot<const K: usize>(coefficients: &[f64; K], outputs: &[f64; K]) -> f64 {
    coefficients.iter().zip(outputs).map(|(c, w)| c * w).sum()
}

/// The [`Method`] of an operator that contracts the K outputs of its field `method` to one, by its own `lengths`,
/// `contract` and `certify`.
macro_rules! contracted_method {
    ($name:ident $(where $($bound:tt)*)?) => {
        impl<M, const D: usize, const K: usize> Method<D> for $name<M, K>
        where
            M: Method<D, Out = [f64; K]>,
            $($($bound)*)?
        {
            type Out = [f64; 1];
            type Scratch = ContractionScratch<M::Scratch, D, K>;

            fn scratch(&self) -> Result<Self::Scratch> {
                Ok(ContractionScratch { method: self.method.scratch()?, drafts: vec![Draft::default()] })
            }

            fn validate(&self, targets: usize, sources: usize) -> Result<()> {
                self.lengths(targets, sources)?;
                self.method.validate(targets, sources)
            }

            fn cutoff(&self, p: usize) -> Result<Option<f64>> {
                self.method.cutoff(p)
            }

            fn weights(
                &self,
                row: &Stencil<D>,
                scratch: &mut Self::Scratch,
                w: &mut [[f64; 1]],
                diagonal: &mut [f64; 1],
            ) -> Result<()> {
                let Draft { weights: outputs, diagonal: own, .. } = &mut scratch.drafts[0];
                outputs.clear();
                outputs.resize(row.len(), [0.0; K]);
                self.method.weights(row, &mut scratch.method, outputs, own)?;
                self.contract(row, (outputs, own), w, diagonal)
            }

            fn report(
                &self,
                row: &Stencil<D>,
                scratch: &Self::Scratch,
                w: &[[f64; 1]],
                diagonal: &[f64; 1],
            ) -> Result<RowReport> {
                let Draft { weights: outputs, diagonal: own, .. } = &scratch.drafts[0];
                self.certify(row, w, diagonal, self.method.report(row, &scratch.method, outputs, own)?)
            }

            fn weights_batch(&self, drafts: &mut [Draft<D, [f64; 1]>], scratch: &mut Self::Scratch) {
                let ContractionScratch { method, drafts: whole } = scratch;
                through(
                    drafts,
                    whole,
                    |whole| self.method.weights_batch(whole, method),
                    |whole, known, Draft { stencil, weights, diagonal, .. }| {
                        self.contract(stencil, (&whole.weights, &whole.diagonal), weights, diagonal)?;
                        self.certify(stencil, weights, diagonal, known)
                    },
                );
            }

            fn growths(&self) -> u32 {
                self.method.growths()
            }

            fn can_grow(&self, refusal: &Error) -> bool {
                self.method.can_grow(refusal)
            }

            fn stand_in(&self, draft: &mut Draft<D, [f64; 1]>, scratch: &mut Self::Scratch) {
                let ContractionScratch { method, drafts: whole } = scratch;
                through(
                    std::slice::from_mut(draft),
                    whole,
                    |whole| whole.iter_mut().for_each(|whole| self.method.stand_in(whole, method)),
                    |whole, known, Draft { stencil, weights, diagonal, .. }| {
                        self.contract(stencil, (&whole.weights, &whole.diagonal), weights, diagonal)?;
                        self.certify(stencil, weights, diagonal, known)
                    },
                );
            }
        }
    };
}

pub(super) use contracted_method;

contracted_method!(Contraction);
