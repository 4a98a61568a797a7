//! div(D grad f) for a diffusivity D per particle, by the weights of the Laplacian.

use std::sync::Arc;

use super::draft::Draft;
use super::method::{Method, spread};
use super::row_report::RowReport;
use crate::error::{Error, OperatorError, ParticleError, Result};
use crate::stencil::Stencil;

/// The contrast of a stencil above which the arithmetic mean of orders above 2 is reported as growing.
pub const CONTRAST_LIMIT: f64 = 10.0;

/// The mean of two diffusivities that a pair exchanges with; both are D where the two are equal.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Mean {
    /// (D_p + D_q)/2, for smooth D. **Across a contrast above [`CONTRAST_LIMIT`] in a stencil it is several times less
    /// accurate than the harmonic mean, and at orders above 2 some modes grow there**.
    #[default]
    Arithmetic,
    /// 2 D_p D_q/(D_p + D_q), zero where either is zero: two layers in series, so that the flux through a jump of D is
    /// continuous; of first order there.
    Harmonic,
}

impl Mean {
    /// The mean of two diffusivities that are not negative; symmetric to the bit, and without overflow.
    ///
    /// ```
    /// use parops::Mean;
    /// assert_eq!((Mean::Arithmetic.of(1.0, 3.0), Mean::Harmonic.of(1.0, 3.0)), (2.0, 1.5));
    /// assert_eq!((Mean::Arithmetic.of(0.0, 3.0), Mean::Harmonic.of(0.0, 3.0)), (1.5, 0.0));
    /// ```
    #[inline(always)]
    pub fn of(self, a: f64, b: f64) -> f64 {
        match self {
            Self::Arithmetic => 0.5 * a + 0.5 * b,
            Self::Harmonic => {
                let (low, high) = if a < b { (a, b) } else { (b, a) };
                // 2 D_p D_q may overflow where the mean does not.
                if low > 0.0 { low / (0.5 + 0.5 * (low / high)) } else { 0.0 }
            }
        }
    }
}

/// div(D grad f) for a diffusivity per particle,
/// (Q f)_p = sum_q m(D_p, D_q) w_pq (f_q - f_p), with the weights w_pq of a Laplacian of the form f_q - f_p.
///
/// Where D is smooth either mean keeps the order of the Laplacian, since Lap(m(D_p, D) (f - f_p)) at p is
/// D Lap f + 2 m_2 grad D . grad f, and m_2 = dm/dD = 1/2 at D_p for both. With the arithmetic one DC-PSE of order R is
/// exact where D and f are polynomials whose degrees add up to R + 1 at most. An operator sum_ij A_ij d_i d_j in place of
/// the Laplacian gives div(D A grad f). Constants are annihilated exactly, and PSE
/// conserves as it does with a constant D: both means are symmetric. D counts at the sources; its images are even. D = 0
/// is legal: an insulator with [`Mean::Harmonic`].
///
/// The certificate is that of the Laplacian, with the contrast max D / min D of the stencil and whether modes may grow
/// there ([`RowReport::growing`]).
///
/// ```
/// use parops::{Apply, CellList, DcPse, DivGrad, Domain, Laplacian, Particles};
/// let scattered = Particles::jittered([0.0; 2], [1.0; 2], [12; 2], 0.3, 1)?;
/// let of = |f: fn(&[f64; 2]) -> f64| scattered.points().iter().map(f).collect::<Vec<_>>();
/// let laplacian = DcPse::<Laplacian<2>, 2>::new();
/// let neighbors = CellList::build(&scattered, &Domain::open(), laplacian.cutoff(&scattered)?)?;
/// let rows = DivGrad::new(laplacian, of(|x| 1.0 + x[0]))?.assemble(&neighbors)?;
/// let mut out = vec![0.0; scattered.len()];
/// rows.apply(&of(|x| x[0] * x[0] - 3.0 * x[1]), &mut out)?;
/// // div((1 + x) (2 x, -3)) = 2 + 4 x
/// assert!(scattered.points().iter().zip(&out).all(|(x, out)| (out - 2.0 - 4.0 * x[0]).abs() < 1e-9));
/// # parops::Result::Ok(())
/// ```
///
#[derive(Clone, Debug)]
pub struct DivGrad<M> {
    laplacian: M,
    diffusivity: Arc<[f64]>,
    mean: Mean,
}

impl<M> DivGrad<M> {
    /// The operator for this diffusivity, one value per source; [`Mean::Arithmetic`] until [`mean`](Self::mean) says
    /// otherwise.
    ///
    /// # Errors
    /// [`ParticleError::Diffusivity`] naming the first particle whose diffusivity is negative or not finite.
    pub fn new(laplacian: M, diffusivity: impl Into<Arc<[f64]>>) -> Result<Self> {
        let diffusivity = diffusivity.into();
        match diffusivity.iter().enumerate().find(|&(_, &d)| !(d >= 0.0 && d.is_finite())) {
            Some((p, &d)) => Err(Error::from(ParticleError::Diffusivity { diffusivity: d }).at(p)),
            None => Ok(Self { laplacian, diffusivity, mean: Mean::default() }),
        }
    }

    /// Sets the mean of the two diffusivities of a pair.
    #[must_use]
    pub fn mean(mut self, mean: Mean) -> Self {
        self.mean = mean;
        self
    }

    /// The method that gives the weights of the Laplacian.
    pub fn laplacian(&self) -> &M {
        &self.laplacian
    }

    /// The method and the diffusivities, to be brought up to date.
    pub(crate) fn parts_mut(&mut self) -> (&mut M, &mut [f64]) {
        (&mut self.laplacian, Arc::make_mut(&mut self.diffusivity))
    }

    /// Multiplies the weights of the Laplacian by the means of their pairs, and the share of odd images with them.
    fn scale<const D: usize>(&self, row: &Stencil<D>, w: &mut [[f64; 1]], diagonal: &mut [f64; 1]) -> Result<()> {
        let Some(center) = row.center() else {
            return Err(OperatorError::NoCenter { neighbors: row.len() }.into());
        };
        let own = self.diffusivity_of(center)?;
        let (mut expected, mut size, mut scaled) = (0.0, 0.0, 0.0);
        for ((w, &sign), &q) in w.iter_mut().zip(row.signs()).zip(row.sources()) {
            let a = w[0] * f64::from(sign);
            let share = spread(a, -a, sign).1;
            expected += share;
            size += share.abs();
            let mean = self.mean.of(own, self.diffusivity_of(q as usize)?);
            w[0] *= mean;
            scaled += mean * share;
        }
        // What is left of f_p when the shares of odd images are taken away belongs to no pair; the sum of n shares is
        // known to n eps of their size.
        let found = diagonal[0];
        if !((found - expected).abs() <= row.len() as f64 * f64::EPSILON * size) {
            return Err(OperatorError::NotDifference { found, expected }.into());
        }
        diagonal[0] = scaled;
        Ok(())
    }

    /// What the diffusivities change in the report of the Laplacian.
    fn certify<const D: usize>(
        &self,
        row: &Stencil<D>,
        w: &[[f64; 1]],
        diagonal: &[f64; 1],
        mut report: RowReport,
    ) -> Result<RowReport> {
        let general = RowReport::of(row, w, diagonal);
        (report.sum_abs, report.spectral_bound) = (general.sum_abs, general.spectral_bound);
        let (mut low, mut high) = (f64::INFINITY, 0.0_f64);
        for q in row.sources().iter().map(|&q| q as usize).chain(row.center()) {
            let d = self.diffusivity_of(q)?;
            (low, high) = (low.min(d), high.max(d));
        }
        report.contrast = if high > low { high / low } else { 1.0 };
        // Without a negative weight every eigenvalue lies in a Gershgorin disc left of zero, whatever the contrast.
        let free = report.order.is_none_or(|order| order > 2) && report.negative_weights > 0;
        report.growing = free && self.mean == Mean::Arithmetic && report.contrast > CONTRAST_LIMIT;
        Ok(report)
    }

    /// Turns a row of the Laplacian, where there is one, into a row of this operator.
    fn finish<const D: usize>(&self, draft: &mut Draft<D, [f64; 1]>) {
        let Ok(report) = draft.report.clone() else { return };
        draft.report = self
            .scale(&draft.stencil, &mut draft.weights, &mut draft.diagonal)
            .and_then(|()| draft.finite())
            .and_then(|()| self.certify(&draft.stencil, &draft.weights, &draft.diagonal, report));
    }

    fn diffusivity_of(&self, q: usize) -> Result<f64> {
        let found = self.diffusivity.len();
        self.diffusivity.get(q).copied().ok_or_else(|| OperatorError::Length { found, index: q }.into())
    }
}

impl<M: Method<D, Out = [f64; 1]>, const D: usize> Method<D> for DivGrad<M> {
    type Out = [f64; 1];
    type Scratch = M::Scratch;

    fn scratch(&self) -> Result<M::Scratch> {
        self.laplacian.scratch()
    }

    fn validate(&self, targets: usize, sources: usize) -> Result<()> {
        let found = self.diffusivity.len();
        if found != sources {
            return Err(ParticleError::Length { found, needed: sources }.into());
        }
        self.laplacian.validate(targets, sources)
    }

    fn cutoff(&self, p: usize) -> Result<Option<f64>> {
        self.laplacian.cutoff(p)
    }

    fn weights(
        &self,
        row: &Stencil<D>,
        scratch: &mut M::Scratch,
        w: &mut [[f64; 1]],
        diagonal: &mut [f64; 1],
    ) -> Result<()> {
        self.laplacian.weights(row, scratch, w, diagonal)?;
        self.scale(row, w, diagonal)
    }

    fn report(&self, row: &Stencil<D>, scratch: &M::Scratch, w: &[[f64; 1]], diagonal: &[f64; 1]) -> Result<RowReport> {
        self.certify(row, w, diagonal, self.laplacian.report(row, scratch, w, diagonal)?)
    }

    fn weights_batch(&self, drafts: &mut [Draft<D, [f64; 1]>], scratch: &mut M::Scratch) {
        self.laplacian.weights_batch(drafts, scratch);
        drafts.iter_mut().for_each(|draft| self.finish(draft));
    }

    fn growths(&self) -> u32 {
        self.laplacian.growths()
    }

    fn can_grow(&self, refusal: &Error) -> bool {
        self.laplacian.can_grow(refusal)
    }

    fn stand_in(&self, draft: &mut Draft<D, [f64; 1]>, scratch: &mut M::Scratch) {
        self.laplacian.stand_in(draft, scratch);
        self.finish(draft);
    }
}
