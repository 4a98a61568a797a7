//! The one seam every discretization method implements: a stencil goes in, weights come out.

use super::draft::Draft;
use super::expression::Outputs;
use super::row_report::RowReport;
use crate::error::{Error, Result};
use crate::stencil::Stencil;

/// Factor by which a support is widened where a row is refused.
pub const GROWTH: f64 = 1.15;

/// How a stencil becomes weights: the only trait a new method implements.
///
/// Weights w_pq and diagonal d_p mean
/// out_p = d_p f_p + sum_q w_pq (f_q - f_p) where the target is a particle, and
/// out_p = sum_q w_pq f_q where it is not. Here f_q is the value of the source itself: the sign of a mirror image is
/// already in w_pq and d_p, and [`spread`] puts it there.
#[diagnostic::on_unimplemented(
    message = "`{Self}` is no discretization method in {D} dimensions",
    label = "expected a method in {D} dimensions",
    note = "the method and the neighbor provider must agree on the number of dimensions"
)]
pub trait Method<const D: usize>: Sync {
    /// `[f64; K]`: K weights per pair.
    type Out: Outputs;
    /// Working memory for one row, made once and reused.
    type Scratch: Send;

    /// Makes working memory; the only allocation.
    ///
    /// # Errors
    /// Where a parameter of the method is illegal.
    fn scratch(&self) -> Result<Self::Scratch>;

    /// Checks that what the method holds per particle is there for so many targets and sources. Called once a build.
    ///
    /// # Errors
    /// [`ParticleError::Length`](crate::ParticleError::Length) where it is not.
    fn validate(&self, targets: usize, sources: usize) -> Result<()> {
        let _ = (targets, sources);
        Ok(())
    }

    /// The cutoff this method wants for target p; `None` takes the provider's.
    ///
    /// # Errors
    /// Where the method holds no data for p.
    fn cutoff(&self, p: usize) -> Result<Option<f64>> {
        let _ = p;
        Ok(None)
    }

    /// The weights of one target. `w` is as long as the stencil; `w` and `diagonal` are written whole.
    ///
    /// # Errors
    /// Where no weights exist for this stencil. A row that exists but is poor is no error here: [`report`](Self::report)
    /// says so, and the build decides.
    fn weights(
        &self,
        row: &Stencil<D>,
        scratch: &mut Self::Scratch,
        w: &mut [Self::Out],
        diagonal: &mut Self::Out,
    ) -> Result<()>;

    /// What is known about the row that [`weights`](Self::weights) has just written with the same scratch.
    ///
    /// # Errors
    /// Where the method holds no data for the row.
    fn report(
        &self,
        row: &Stencil<D>,
        scratch: &Self::Scratch,
        w: &[Self::Out],
        diagonal: &Self::Out,
    ) -> Result<RowReport>;

    /// The weights and reports of several targets at once: the same bits as one by one, for less. A method that can
    /// work on many stencils side by side overrides it. The target of a draft stays, and its stencil and weights remain
    /// of equal length.
    fn weights_batch(&self, drafts: &mut [Draft<D, Self::Out>], scratch: &mut Self::Scratch) {
        for draft in drafts {
            draft.report = self
                .weights(&draft.stencil, scratch, &mut draft.weights, &mut draft.diagonal)
                .and_then(|()| draft.finite())
                .and_then(|()| self.report(&draft.stencil, scratch, &draft.weights, &draft.diagonal));
        }
    }

    /// How many times the support of a refused row is widened by [`GROWTH`], as far as the provider reaches, before
    /// [`stand_in`](Self::stand_in) is asked. Where it is not 0, a row counts as refused also where
    /// [`report`](Self::report) refuses it.
    fn growths(&self) -> u32 {
        0
    }

    /// Whether a wider support may help against this refusal.
    fn can_grow(&self, refusal: &Error) -> bool {
        let _ = refusal;
        false
    }

    /// What stands in for a row refused at its widest support: another row and its report, or, as here, the refusal
    /// that `draft.report` holds.
    fn stand_in(&self, draft: &mut Draft<D, Self::Out>, scratch: &mut Self::Scratch) {
        let _ = (draft, scratch);
    }
}

/// Splits the pair term a s f_q + b f_p into its weight on (f_q - f_p) and its share of the diagonal,
/// (a s) (f_q - f_p) + (a s + b) f_p, where s is the sign of the image.
///
/// ```
/// assert_eq!(parops::spread(2.0, -2.0, 1), (2.0, 0.0));
/// assert_eq!(parops::spread(2.0, -2.0, -1), (-2.0, -4.0));
/// ```
#[inline(always)]
pub fn spread(a: f64, b: f64, sign: i8) -> (f64, f64) {
    let w = a * f64::from(sign);
    (w, w + b)
}
