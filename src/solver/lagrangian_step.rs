//! One step of a Lagrangian run: checked, tried, and entered in the ledger.

use super::attempt::Attempt;
use super::lagrangian::Lagrangian;
use super::ledger::LedgerRow;
use super::limits::Limits;
use super::moving::{MovingScene, MovingState};
use super::policy::StepPolicy;
use super::source::slack;
use crate::apply::Report;
use crate::error::{Result, TimeError};
use crate::time::Stepper;

impl<const D: usize, S: MovingScene<D>, St: Stepper<MovingState<D, S::Value>>> Lagrangian<D, S, St> {
    pub(super) fn step_to(&mut self, dt: f64, end: f64) -> Result<&LedgerRow<D>> {
        if !(dt > 0.0 && dt.is_finite()) {
            return Err(TimeError::Step { dt }.into());
        }
        let (limits, report) = self.limits_of(self.t, dt, None)?;
        let (limit, binding) = (limits.step(&self.stepper), limits.binding(&self.stepper));
        let within = dt <= limit * slack::<D, S::Value, S::Source>();
        if !within && self.policy == StepPolicy::Refuse {
            return Err(limits.refuse(dt, limit, binding));
        }
        let searches = self.moving.searches().0;
        let growth = match report {
            Some(_) if searches != self.surveyed => self.moving.growth_on_the_way(self.growth)?,
            _ => self.ledger.growth,
        };
        let whole = within || self.policy == StepPolicy::Allow;
        let mut attempt = Attempt::new(self, searches);
        let substeps = if whole { attempt.whole(dt, end) } else { attempt.cut(dt, end, limits) }?;
        let overlap = attempt.watched(end)?;
        attempt.keep();
        self.t = end;
        if let Some((hole, gap)) = overlap {
            (self.ledger.hole, self.ledger.gap) = (Some(hole), Some(gap));
        }
        self.certify(report.as_ref());
        self.measure();
        let ledger = &mut self.ledger;
        (ledger.t, ledger.dt, ledger.limit, ledger.binding, ledger.growth) = (end, dt, limit, binding, growth);
        (ledger.within_limit, ledger.substeps) = (within || substeps > 1, substeps);
        ledger.step += 1;
        ledger.retries += u64::from(substeps) - 1;
        Ok(&self.ledger)
    }

    /// What bounds a step of length dt from a state at time t, by default that of the run, and what the check of the rows
    /// found.
    pub(super) fn limits_of(
        &mut self,
        t: f64,
        dt: f64,
        state: Option<&MovingState<D, S::Value>>,
    ) -> Result<(Limits, Option<Report>)> {
        let (mut limits, report) = self.moving.limits(t, dt, state.unwrap_or(&self.state), self.courant)?;
        self.sharp.iter().for_each(|&(limit, rate)| limits.set(limit, rate));
        Ok((limits, report))
    }
}
