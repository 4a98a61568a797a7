//! The derivative along the outward normal, on supports wide enough that the boundary value itself counts.

use crate::error::{BoundaryError, Error, ErrorKind, Result};
use crate::operator::{Contraction, ContractionScratch, Draft, Method, RowReport};
use crate::stencil::Stencil;

/// Gradient rows contracted with the normals of their targets; a row in which u_p has too small a share is widened.
///
/// du/dn = c_p u_p + sum_q w_pq u_q, and a condition on it can be solved for u_p only where c_p > 0 is not small beside
/// the others. On a lattice that is so; on scattered particles some of the 3 l nearest ones lie such that c_p is nearly
/// zero, or negative (down to -0.16 of the sum of all in a ball, r = 2). Between walls such rows give growing modes, in a
/// steady problem an error at p ten times that of the others.
pub(super) struct Outward<M, const D: usize> {
    normal: Contraction<M, D>,
}

/// How many times a support is widened.
const WIDENINGS: u32 = 3;

impl<M, const D: usize> Outward<M, D> {
    pub(super) fn new(normal: Contraction<M, D>) -> Self {
        Self { normal }
    }
}

/// The least share of c_p in the sum of all: a quarter of what it is in the one-sided difference of order r on a lattice,
/// c_p = H_r and |w_k| = C(r, k)/k, so 0.094 for r = 2 and 0.049 for r = 4.
fn least_share(order: u32) -> f64 {
    let (mut own, mut others, mut binomial) = (0.0, 0.0, 1.0);
    for k in 1..=order.max(1) {
        let [r, k] = [order.max(1), k].map(f64::from);
        binomial *= (r - k + 1.0) / k;
        own += 1.0 / k;
        others += binomial / k;
    }
    0.25 * own / (own + others)
}

fn share(w: &[[f64; 1]], diagonal: &[f64; 1]) -> f64 {
    let (own, others) = w.iter().fold((diagonal[0], 0.0), |(own, others), [w]| (own - w, others + w.abs()));
    own / (own.abs() + others)
}

impl<M: Method<D, Out = [f64; D]>, const D: usize> Method<D> for Outward<M, D> {
    type Out = [f64; 1];
    type Scratch = ContractionScratch<M::Scratch, D, D>;

    fn scratch(&self) -> Result<Self::Scratch> {
        self.normal.scratch()
    }

    fn validate(&self, targets: usize, sources: usize) -> Result<()> {
        self.normal.validate(targets, sources)
    }

    fn cutoff(&self, p: usize) -> Result<Option<f64>> {
        self.normal.cutoff(p)
    }

    fn weights(
        &self,
        row: &Stencil<D>,
        scratch: &mut Self::Scratch,
        w: &mut [[f64; 1]],
        diagonal: &mut [f64; 1],
    ) -> Result<()> {
        self.normal.weights(row, scratch, w, diagonal)
    }

    fn report(
        &self,
        row: &Stencil<D>,
        scratch: &Self::Scratch,
        w: &[[f64; 1]],
        diagonal: &[f64; 1],
    ) -> Result<RowReport> {
        let report = self.normal.report(row, scratch, w, diagonal)?;
        let (share, least) = (share(w, diagonal), least_share(report.order.unwrap_or(1)));
        if share >= least { Ok(report) } else { Err(BoundaryError::OwnWeight { share, least }.into()) }
    }

    fn growths(&self) -> u32 {
        self.normal.method().growths().max(WIDENINGS)
    }

    fn can_grow(&self, refusal: &Error) -> bool {
        let weak = matches!(refusal.kind(), ErrorKind::Boundary(BoundaryError::OwnWeight { .. }));
        weak || self.normal.method().can_grow(refusal)
    }

    /// A share that is small but positive is taken where the reach ends; the condition number of the coupled system
    /// shows what it costs. Other refusals are for the method to settle, on the same terms.
    fn stand_in(&self, draft: &mut Draft<D, [f64; 1]>, scratch: &mut Self::Scratch) {
        let Err(refusal) = draft.report.clone() else { return };
        match refusal.kind() {
            ErrorKind::Boundary(BoundaryError::OwnWeight { share, .. }) if *share > 0.0 => {
                let made = self.normal.weights(&draft.stencil, scratch, &mut draft.weights, &mut draft.diagonal);
                draft.report =
                    made.and_then(|()| self.normal.report(&draft.stencil, scratch, &draft.weights, &draft.diagonal));
            }
            ErrorKind::Boundary(_) => {}
            _ => {
                self.normal.stand_in(draft, scratch);
                if draft.report.is_ok() && !(share(&draft.weights, &draft.diagonal) > 0.0) {
                    draft.report = Err(refusal);
                }
            }
        }
    }
}
