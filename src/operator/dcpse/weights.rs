//! DC-PSE as a method: rows one by one or side by side, their reports, and what stands in for a refused row.

use super::certify::{Certificate, Job, Room, certify};
use super::group::{Group, grouped};
use super::{CUTOFF_OVER_EPSILON, DcPse, Fallback, Settings};
use crate::error::{Error, ErrorKind, OperatorError, ParticleError, Result};
use crate::moment::MomentSolver;
use crate::operator::{Draft, Method, Operator, RowReport};
use crate::scale::Epsilon;
use crate::stencil::Stencil;

/// Targets solved side by side.
const LANES: usize = 4;

/// Working memory of [`DcPse`]: the conditions of the operator, and room for a few rows.
#[derive(Clone, Debug)]
pub struct DcPseScratch<const D: usize> {
    groups: Vec<Group<D>>,
    /// The same to lower orders, the highest first; made where the policy asks for them.
    lower: Vec<Vec<Group<D>>>,
    one: Room<D, 1>,
    many: Room<D, LANES>,
    certificate: Certificate,
}

impl Settings {
    /// 1/epsilon and cutoff/epsilon.
    pub(super) fn scale<const D: usize>(&self, row: &Stencil<D>) -> Result<(f64, f64)> {
        if row.cutoff() == 0.0 && !row.is_empty() {
            return Err(OperatorError::OnePlace { neighbors: row.len() }.into());
        }
        let epsilon = match &self.epsilon {
            Some(epsilon) => epsilon.get(row.target())?,
            None => row.cutoff() / CUTOFF_OVER_EPSILON,
        };
        let ratio = row.cutoff() / epsilon;
        if !(1.0..=6.0).contains(&ratio) {
            return Err(OperatorError::Window { ratio, low: 1.0, high: 6.0 }.into());
        }
        Ok((1.0 / epsilon, ratio))
    }
}

impl Certificate {
    fn report<const D: usize, const K: usize>(
        &self,
        row: &Stencil<D>,
        w: &[[f64; K]],
        diagonal: &[f64; K],
        order: u32,
    ) -> RowReport {
        let mut report = RowReport::of(row, w, diagonal);
        (report.conditions, report.rank) = (self.conditions, self.rank);
        (report.condition, report.residual) = (self.condition, self.residual);
        (report.rung, report.negative_weights) = (self.rung, self.negative);
        report.order = Some(order);
        report
    }
}

impl<Op, const R: u32, S, const D: usize, const K: usize> Method<D> for DcPse<Op, R, S>
where
    Op: Operator<D, Out = [f64; K]>,
    S: MomentSolver,
{
    type Out = [f64; K];
    type Scratch = DcPseScratch<D>;

    fn scratch(&self) -> Result<DcPseScratch<D>> {
        let order = self.settings.order;
        let groups = grouped(&self.operator, &self.settings, order)?;
        let orders = if self.settings.fallback == Fallback::LowerOrder { 1..order } else { 0..0 };
        let lower = orders.rev().map(|order| grouped(&self.operator, &self.settings, order)).collect::<Result<_>>()?;
        let (one, many) = (Room::default(), Room::default());
        Ok(DcPseScratch { groups, lower, one, many, certificate: Certificate::default() })
    }

    fn validate(&self, targets: usize, _: usize) -> Result<()> {
        match self.settings.epsilon.as_ref().and_then(Epsilon::len) {
            Some(found) if found != targets => Err(ParticleError::Length { found, needed: targets }.into()),
            _ => Ok(()),
        }
    }

    fn weights(
        &self,
        row: &Stencil<D>,
        scratch: &mut DcPseScratch<D>,
        w: &mut [[f64; K]],
        diagonal: &mut [f64; K],
    ) -> Result<()> {
        let DcPseScratch { groups, one, certificate, .. } = scratch;
        let [found] = certify(&self.solver, &self.settings, groups, one, &mut [Job { row, w, diagonal }]);
        *certificate = found?;
        Ok(())
    }

    fn report(
        &self,
        row: &Stencil<D>,
        scratch: &DcPseScratch<D>,
        w: &[[f64; K]],
        diagonal: &[f64; K],
    ) -> Result<RowReport> {
        Ok(scratch.certificate.report(row, w, diagonal, self.settings.order))
    }

    fn weights_batch(&self, drafts: &mut [Draft<D, [f64; K]>], scratch: &mut DcPseScratch<D>) {
        let DcPseScratch { groups, one, many, .. } = scratch;
        let (full, rest) = drafts.as_chunks_mut::<LANES>();
        for drafts in full {
            let particles = drafts.iter().filter(|draft| draft.stencil.center().is_some()).count();
            if particles == 0 || particles == LANES {
                self.draft(groups, many, drafts);
            } else {
                drafts.as_chunks_mut::<1>().0.iter_mut().for_each(|draft| self.draft(groups, one, draft));
            }
        }
        rest.as_chunks_mut::<1>().0.iter_mut().for_each(|draft| self.draft(groups, one, draft));
    }

    fn growths(&self) -> u32 {
        3
    }

    fn can_grow(&self, refusal: &Error) -> bool {
        use OperatorError::{OnePlace, Singular, TooFew, Uncertified};
        let ErrorKind::Operator(refusal) = refusal.kind() else { return false };
        matches!(refusal, TooFew { .. } | Singular { .. } | Uncertified { .. } | OnePlace { .. })
    }

    fn stand_in(&self, draft: &mut Draft<D, [f64; K]>, scratch: &mut DcPseScratch<D>) {
        let refused = draft.report.as_ref().is_err_and(|refusal| Method::<D>::can_grow(self, refusal));
        match self.settings.fallback {
            Fallback::LowerOrder if refused => {
                let DcPseScratch { lower, one, .. } = scratch;
                let refusal = draft.report.clone();
                for (lowered, groups) in (1..).zip(lower) {
                    self.draft(groups, one, std::array::from_mut(draft));
                    if let Ok(report) = &mut draft.report {
                        report.order = Some(self.settings.order - lowered);
                        report.lowered = lowered;
                        return;
                    }
                }
                draft.report = refusal;
            }
            Fallback::Empty if refused => {
                let stencil = &mut draft.stencil;
                stencil.reset(stencil.target(), stencil.center(), stencil.cutoff());
                draft.clear();
                let mut report = RowReport::of(&draft.stencil, &draft.weights, &draft.diagonal);
                report.empty = true;
                draft.report = Ok(report);
            }
            _ => {}
        }
    }
}

impl<Op, const R: u32, S: MomentSolver> DcPse<Op, R, S> {
    fn draft<const D: usize, const K: usize, const L: usize>(
        &self,
        groups: &mut [Group<D>],
        room: &mut Room<D, L>,
        drafts: &mut [Draft<D, [f64; K]>; L],
    ) {
        let mut jobs = drafts.each_mut().map(|draft| Job {
            row: &draft.stencil,
            w: &mut draft.weights,
            diagonal: &mut draft.diagonal,
        });
        let found = certify(&self.solver, &self.settings, groups, room, &mut jobs);
        for (draft, found) in drafts.iter_mut().zip(found) {
            let Draft { stencil, weights, diagonal, report } = draft;
            *report = found.map(|found| found.report(stencil, weights, diagonal, self.settings.order));
        }
    }
}
