//! div(D grad f) for a symmetric diffusion tensor per particle, by the weights of all second derivatives.

use std::sync::Arc;

use super::contraction::{ContractionScratch, contracted, contracted_method, dot, through};
use super::draft::Draft;
use super::expression::Operator;
use super::method::{Method, spread};
use super::named::Hessian;
use super::row_report::RowReport;
use super::tensor::pack;
use super::{CONTRAST_LIMIT, Mean};
use crate::error::{Error, OperatorError, ParticleError, Result};
use crate::stencil::Stencil;

/// div(D grad f) = sum_ij d_i (D_ij d_j f) for a symmetric tensor D per particle,
/// (Q f)_p = sum_q sum_ij (D_ij(p) + D_ij(q))/2 w_pq,ij (f_q - f_p), with the weights w_pq,ij of d_i d_j, that is of a
/// method for [`Hessian`].
///
/// Where D is smooth the mean keeps the order of the method, since sum_ij d_i d_j ((D_ij(p) + D_ij)(f - f_p)/2) at p is
/// div(D grad f). Constants are annihilated exactly. PSE conserves sum_p V_p (Q f)_p for any volumes, since its pair
/// weights over V_q are symmetric; DC-PSE does not conserve, and is exact where the degrees of D and f add up to
/// R + 1 at most. With D = d I it is [`DivGrad`](super::DivGrad) of d to rounding, for kernels that add up to those of the
/// Laplacian. An isotropic share must not be added: it is in D. D may be zero or singular.
///
/// Three choices of the method, for D = 1 to 3:
/// [`Pse::anisotropic`](super::Pse::anisotropic), order 2, without negative weights up to a moderate anisotropy;
/// [`Pse::new`](super::Pse::new) of `Hessian`, orders 2 to 8, with negative weights at a distance for any anisotropy;
/// [`DcPse`](super::DcPse) of `Hessian` for scattered particles.
///
/// The certificate is that of the method; its count of negative weights is of those of the pairs, each of which costs the
/// maximum principle: expect undershoots there. The contrast is that of the traces within the stencil.
///
/// D counts at the sources and images have the tensor of their source: at a mirror its entries that couple the normal
/// with another axis must vanish.
///
/// ```
/// use parops::{Apply, CellList, DivTensorGrad, Domain, Hessian, Particles, Pse};
/// let set = Particles::lattice([0.0; 2], [1.0; 2], [32; 2])?;
/// let pse = Pse::anisotropic(Hessian::<2>, set.spacing()?.epsilon(2.0)?, set.volumes()?)?;
/// let neighbors = CellList::build(&set, &Domain::periodic([0.0; 2], [1.0; 2])?, pse.cutoff())?;
/// let rows = DivTensorGrad::new(pse, &vec![[[2.0, 0.5], [0.5, 1.0]]; set.len()])?.assemble(&neighbors)?;
/// let wave = |x: &[f64; 2]| (std::f64::consts::TAU * (x[0] + x[1])).sin();
/// let f: Vec<f64> = set.points().iter().map(wave).collect();
/// let mut out = vec![0.0; f.len()];
/// rows.apply(&f, &mut out)?;
/// // k . D k = 4 (2 pi)^2, to order 2 in epsilon
/// assert!((out[7] / f[7] / (-16.0 * std::f64::consts::PI.powi(2)) - 1.0).abs() < 0.1);
/// assert_eq!(rows.report().negative_weights, 0);
/// # parops::Result::Ok(())
/// ```
///
/// Source: notes 001, eq. 5.18 to 5.24 with errata 13 to 15; from one kernel to any for the second derivatives.
#[derive(Clone, Debug)]
pub struct DivTensorGrad<M, const K: usize> {
    method: M,
    /// D_ii, and D_ij + D_ji for i < j, in the order of the outputs of `Hessian`.
    tensors: Arc<[[f64; K]]>,
}

impl<M, const K: usize> DivTensorGrad<M, K> {
    /// The operator for these tensors, `tensors[p][i][j]` = D_ij at source p.
    ///
    /// # Errors
    /// Naming the first particle concerned, [`ParticleError::TensorEntry`] for an entry that is not finite,
    /// [`ParticleError::Asymmetric`] and [`ParticleError::Indefinite`] for a tensor that is not symmetric or has a negative
    /// eigenvalue, by more than 16 eps of its largest entry.
    pub fn new<const D: usize>(method: M, tensors: &[[[f64; D]; D]]) -> Result<Self>
    where
        M: Method<D, Out = [f64; K]>,
        Hessian<D>: Operator<D, Out = [f64; K]>,
    {
        let packed = tensors.iter().enumerate().map(|(p, tensor)| pack(tensor).map_err(|error| error.at(p)));
        Ok(Self { method, tensors: packed.collect::<Result<_>>()? })
    }

    /// The method that gives the weights of the second derivatives.
    pub fn method(&self) -> &M {
        &self.method
    }

    fn lengths(&self, _: usize, sources: usize) -> Result<()> {
        let found = self.tensors.len();
        if found == sources { Ok(()) } else { Err(ParticleError::Length { found, needed: sources }.into()) }
    }

    fn tensor_of(&self, q: usize) -> Result<&[f64; K]> {
        let found = self.tensors.len();
        self.tensors.get(q).ok_or_else(|| OperatorError::Length { found, index: q }.into())
    }

    /// Multiplies the weights of the second derivatives by the means of the tensors of their pairs, and the shares of odd
    /// images with them.
    fn contract<const D: usize>(
        &self,
        row: &Stencil<D>,
        (outputs, own): (&[[f64; K]], &[f64; K]),
        w: &mut [[f64; 1]],
        diagonal: &mut [f64; 1],
    ) -> Result<()> {
        let Some(center) = row.center() else {
            return Err(OperatorError::NoCenter { neighbors: row.len() }.into());
        };
        let tensor = self.tensor_of(center)?;
        let (mut expected, mut size) = ([0.0; K], [0.0; K]);
        diagonal[0] = 0.0;
        for (((w, outputs), &sign), &q) in w.iter_mut().zip(outputs).zip(row.signs()).zip(row.sources()) {
            let other = self.tensor_of(q as usize)?;
            let mean: [f64; K] = std::array::from_fn(|k| Mean::Arithmetic.of(tensor[k], other[k]));
            w[0] = dot(&mean, outputs);
            if sign != 1 {
                let share = outputs.map(|w| spread(w * f64::from(sign), -w * f64::from(sign), sign).1);
                diagonal[0] += dot(&mean, &share);
                for k in 0..K {
                    expected[k] += share[k];
                    size[k] += share[k].abs();
                }
            }
        }
        // What is left of f_p beside the shares of odd images belongs to no pair; n shares are known to n eps of their size.
        let rounding = row.len() as f64 * f64::EPSILON;
        match (0..K).find(|&k| !((own[k] - expected[k]).abs() <= rounding * size[k])) {
            Some(k) => Err(OperatorError::NotDifference { found: own[k], expected: expected[k] }.into()),
            None => Ok(()),
        }
    }

    /// What the tensors change in the report of the method.
    fn certify<const D: usize>(
        &self,
        row: &Stencil<D>,
        w: &[[f64; 1]],
        diagonal: &[f64; 1],
        known: RowReport,
    ) -> Result<RowReport> {
        let mut report = contracted(row, w, diagonal, known);
        let (mut low, mut high) = (f64::INFINITY, 0.0_f64);
        for q in row.sources().iter().map(|&q| q as usize).chain(row.center()) {
            let tensor = self.tensor_of(q)?;
            // Output k of the diagonal entry (i, i) is followed by the D - 1 - i entries to its right.
            let diagonal = (0..D).scan(0, |k, i| Some(std::mem::replace(k, *k + D - i)));
            let trace: f64 = diagonal.map(|k| tensor[k]).sum();
            (low, high) = (low.min(trace), high.max(trace));
        }
        report.contrast = if high > low { high / low } else { 1.0 };
        let free = report.order.is_none_or(|order| order > 2) && report.negative_weights > 0;
        report.growing = free && report.contrast > CONTRAST_LIMIT;
        Ok(report)
    }
}

contracted_method!(DivTensorGrad where Hessian<D>: Operator<D, Out = [f64; K]>);
