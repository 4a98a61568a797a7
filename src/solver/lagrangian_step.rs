//! One step of a Lagrangian run: checked, taken whole or in parts, and the particles replaced where it is time.

use super::fields::Fields;
use super::lagrangian::Lagrangian;
use super::ledger::LedgerRow;
use super::limits::Limits;
use super::moving::{MovingScene, MovingState};
use super::moving_diffusion::MovingDiffusion;
use super::policy::StepPolicy;
use super::remeshing::{Trigger, overlap_is_lost};
use super::substeps::Substeps;
use crate::apply::Report;
use crate::error::{Error, ErrorKind, Result, SolverError, TimeError};
use crate::mesh::Remeshed;
use crate::time::{State, Stepper};

impl<const D: usize, S: MovingScene<D>, St: Stepper<MovingState<D, S::Value>>> Lagrangian<D, S, St> {
    pub(super) fn step_to(&mut self, dt: f64, end: f64) -> Result<&LedgerRow<D>> {
        if !(dt > 0.0 && dt.is_finite()) {
            return Err(TimeError::Step { dt }.into());
        }
        let (limits, report) = self.limits_of(self.t, dt, None)?;
        let (limit, binding) = (limits.step(&self.stepper), limits.binding(&self.stepper));
        let within = dt <= limit;
        if !within && self.policy == StepPolicy::Refuse {
            return Err(limits.refuse(dt, limit, binding));
        }
        let searches = self.moving.searches().0;
        let growth = match report {
            Some(_) if searches != self.surveyed => self.moving.growth_on_the_way(self.growth)?,
            _ => self.ledger.growth,
        };
        let mut work = std::mem::take(&mut self.work);
        // A clone of a pair would allocate.
        work.assign(&self.state);
        let whole = within || self.policy == StepPolicy::Allow;
        let t = self.t;
        let done =
            if whole { self.substep(&mut work, t, dt).map(|()| 1) } else { self.cut(&mut work, dt, end, limits) };
        let done = done.and_then(|substeps| {
            let remeshed = self.remeshed(&work, end)?;
            let overlap = self.watched(&work, end, remeshed.as_ref().map(|(fresh, _)| fresh))?;
            Ok((substeps, remeshed, overlap))
        });
        let (substeps, remeshed, overlap) = match done {
            Ok(done) => done,
            Err(error) => {
                self.work = work;
                self.stepper.reset();
                return Err(error);
            }
        };
        self.surveyed = searches;
        match remeshed {
            None => self.work = std::mem::replace(&mut self.state, work),
            Some((fresh, kept)) => {
                self.work = work;
                let Remeshed { particles, strengths, dropped } = fresh;
                self.state = self.moving.replace(particles, strengths, kept)?;
                // What a mesh leaves is as regular as can be.
                self.surveyed = self.moving.searches().0;
                self.stepper.reset();
                self.ledger.remeshings += 1;
                for (i, totals) in self.ledger.fields.iter_mut().enumerate() {
                    totals.dropped += dropped.sum.get(i);
                    totals.dropped_size += dropped.absolute.get(i);
                }
            }
        }
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

    /// One step of the stepper, volumes and places checked.
    fn substep(&mut self, work: &mut MovingState<D, S::Value>, t: f64, dt: f64) -> Result<()> {
        let Self { moving, stepper, state: checked, .. } = self;
        stepper.step(t, dt, work, &mut |t, state, rates| moving.rate(t, state, checked, rates))?;
        if let Some((p, &volume)) = work.1.1.iter().enumerate().find(|(_, volume)| !(**volume > 0.0)) {
            return Err(Error::from(SolverError::Volume { volume, t: t + dt }).at(p));
        }
        for (p, x) in work.0.iter_mut().enumerate() {
            *x = moving.domain.wrap(x).map_err(|error| error.at(p))?;
        }
        Ok(())
    }

    /// Cuts a step into substeps, and says how many.
    fn cut(&mut self, work: &mut MovingState<D, S::Value>, dt: f64, end: f64, mut limits: Limits) -> Result<u32> {
        let mut left = Substeps::new(self.policy, self.t, dt, end);
        loop {
            let (limit, binding) = (limits.step(&self.stepper), limits.binding(&self.stepper));
            let t = left.t;
            let part = left.next(limit, binding)?;
            self.substep(work, t, part)?;
            if left.done() {
                return Ok(left.taken);
            }
            limits = self.limits_of(left.t, left.rest(), Some(work))?.0;
        }
    }

    /// The particles that replace those of a state at time t, with their neighbors, where it is time.
    #[expect(clippy::type_complexity, reason = "the parts of a state that is not there yet")]
    fn remeshed(
        &mut self,
        work: &MovingState<D, S::Value>,
        t: f64,
    ) -> Result<Option<(Remeshed<S::Value, D>, <S::Diffusion as MovingDiffusion<D, S::Value>>::Kept)>> {
        let Some(remesher) = self.remesher.as_deref() else { return Ok(None) };
        let due = match remesher.trigger() {
            Trigger::Steps(steps) => (self.ledger.step + 1).is_multiple_of(steps),
            Trigger::Overlap { hole, gap } => {
                self.moving.place(t, work)?;
                overlap_is_lost(remesher.mesh(), self.moving.site.particles(), &self.moving.domain, hole, gap)?
            }
            Trigger::Condition(limit) => match self.moving.limits(t, 0.0, work, self.courant) {
                Ok((_, report)) => report.is_some_and(|report| report.condition > limit),
                // Rows that are refused are worse than those that are not.
                Err(error) if matches!(error.kind(), ErrorKind::Operator(_)) => true,
                Err(error) => return Err(error),
            },
        };
        if !due {
            return Ok(None);
        }
        let (points, strengths) = (self.moving.points(work), self.moving.omega(work));
        let fresh = remesher.remesh(points, strengths, &mut self.values)?;
        let kept = self.moving.restart(&fresh.particles)?;
        Ok(Some((fresh, kept)))
    }
}
