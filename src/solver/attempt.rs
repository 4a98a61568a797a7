//! A step on trial: taken whole or in parts, particles replaced where it is time, and nothing of it left if it fails.

use super::fields::Fields;
use super::lagrangian::Lagrangian;
use super::limits::Limits;
use super::moving::{Held, MovingScene, MovingState};
use super::remeshing::{Trigger, overlap_is_lost};
use super::source::slack;
use super::substeps::Substeps;
use crate::error::{Error, ErrorKind, Limit, Result, SolverError};
use crate::mesh::{Dropped, Remeshed};
use crate::time::{Entry, State, Stepper};

/// What a step does to a run until it is kept. Dropped before, by an error or a panic, it leaves the run as it was.
pub(super) struct Attempt<'a, const D: usize, S: MovingScene<D>, St: Stepper<MovingState<D, S::Value>>> {
    run: &'a mut Lagrangian<D, S, St>,
    work: MovingState<D, S::Value>,
    /// The particles there were, once they are replaced.
    before: Option<Held<D, S>>,
    turns: u64,
    surveyed: u64,
    remeshings: u64,
    dropped: Dropped<S::Value>,
    /// Whether the stepper has taken a step.
    stepped: bool,
    kept: bool,
}

impl<'a, const D: usize, S: MovingScene<D>, St: Stepper<MovingState<D, S::Value>>> Attempt<'a, D, S, St> {
    /// Nothing done yet; growth is known for the neighbors of search number `surveyed`.
    pub(super) fn new(run: &'a mut Lagrangian<D, S, St>, surveyed: u64) -> Self {
        let mut work = std::mem::take(&mut run.work);
        // A clone of a pair would allocate.
        work.assign(&run.state);
        run.moving.keep_searches();
        let dropped = Dropped { count: 0, sum: S::Value::ZERO, absolute: S::Value::ZERO };
        let (turns, before, stepped, kept) = (run.turns, None, false, false);
        Self { run, work, before, turns, surveyed, remeshings: 0, dropped, stepped, kept }
    }

    /// Takes the step as it is, and says how many substeps that were.
    pub(super) fn whole(&mut self, dt: f64, end: f64) -> Result<u32> {
        self.substep(self.run.t, dt)?;
        self.turn(end)?;
        Ok(1)
    }

    /// Cuts the step into substeps, and says how many. The particles have a turn before a substep, taken to be as long as the
    /// one before, that would distort them by more than the limit since the last turn.
    pub(super) fn cut(&mut self, dt: f64, end: f64, mut limits: Limits) -> Result<u32> {
        let mut left = Substeps::new(self.run.policy, self.run.t, dt, end);
        let mut distorted = 0.0;
        loop {
            let (limit, binding) = (limits.step(&self.run.stepper), limits.binding(&self.run.stepper));
            let t = left.t;
            let part = left.next(limit * slack::<D, S::Value, S::Source>(), binding)?;
            self.substep(t, part)?;
            if left.done() {
                self.turn(end)?;
                return Ok(left.taken);
            }
            let share = part * limits.rate(Limit::Distortion).frequency;
            distorted += share;
            if distorted + share > 1.0 {
                self.turn(left.t)?;
                distorted = 0.0;
            }
            limits = self.run.limits_of(left.t, left.rest(), Some(&self.work))?.0;
        }
    }

    /// The largest hole and the least gap at the end, where they are due.
    pub(super) fn watched(&mut self, end: f64) -> Result<Option<(f64, f64)>> {
        self.run.watched(&self.work, end)
    }

    /// Makes the run what the step has made of it.
    pub(super) fn keep(mut self) {
        let Self { run, work, before, turns, surveyed, remeshings, dropped, kept, .. } = &mut self;
        std::mem::swap(&mut run.state, work);
        run.moving.keep_searches();
        *before = None;
        (run.turns, run.surveyed) = (*turns, *surveyed);
        run.ledger.remeshings += *remeshings;
        for (i, totals) in run.ledger.fields.iter_mut().enumerate() {
            totals.dropped += dropped.sum.get(i);
            totals.dropped_size += dropped.absolute.get(i);
        }
        *kept = true;
    }

    /// One step of the stepper, volumes and places checked.
    fn substep(&mut self, t: f64, dt: f64) -> Result<()> {
        let Self { run, work, stepped, .. } = self;
        let Lagrangian { moving, stepper, state: checked, .. } = &mut **run;
        stepper.step(t, dt, work, &mut |t, state, rates| moving.rate(t, state, checked, rates))?;
        *stepped = true;
        if let Some((p, &volume)) = work.1.1.iter().enumerate().find(|(_, volume)| !(**volume > 0.0)) {
            return Err(Error::from(SolverError::Volume { volume, t: t + dt }).at(p));
        }
        for (p, x) in work.0.iter_mut().enumerate() {
            *x = moving.domain.wrap(x).map_err(|error| error.at(p))?;
        }
        Ok(())
    }

    /// The particles' turn to be replaced, at time t.
    fn turn(&mut self, t: f64) -> Result<()> {
        self.turns += 1;
        let Self { run, work, .. } = self;
        let Lagrangian { moving, remesher: Some(remesher), values, courant, .. } = &mut **run else { return Ok(()) };
        let due = match remesher.trigger() {
            Trigger::Steps(steps) => self.turns.is_multiple_of(steps),
            Trigger::Overlap { hole, gap } => {
                moving.place(t, work)?;
                overlap_is_lost(remesher.mesh(), moving.held.site.particles(), &moving.domain, hole, gap)?
            }
            Trigger::Condition(limit) => match moving.limits(t, 0.0, work, *courant) {
                Ok((_, report)) => report.is_some_and(|report| report.condition > limit),
                // Rows that are refused are worse than those that are not.
                Err(error) if matches!(error.kind(), ErrorKind::Operator(_)) => true,
                Err(error) => return Err(error),
            },
        };
        if !due {
            return Ok(());
        }
        let fresh = remesher.remesh(moving.points(work), moving.omega(work), values)?;
        let Remeshed { particles, strengths, dropped } = fresh;
        let kept = moving.restart(&particles)?;
        let (held, state) = Held::new(particles, strengths, kept)?;
        let old = std::mem::replace(&mut moving.held, held);
        self.before.get_or_insert(old);
        *work = state;
        // What a mesh leaves is as regular as can be.
        self.surveyed = moving.searches().0;
        run.stepper.reset();
        self.remeshings += 1;
        self.dropped.sum = self.dropped.sum.plus(1.0, dropped.sum);
        self.dropped.absolute = self.dropped.absolute.plus(1.0, dropped.absolute);
        Ok(())
    }
}

impl<const D: usize, S: MovingScene<D>, St: Stepper<MovingState<D, S::Value>>> Drop for Attempt<'_, D, S, St> {
    fn drop(&mut self) {
        self.run.work = std::mem::take(&mut self.work);
        if let Some(before) = self.before.take() {
            self.run.moving.held = before;
        }
        if !self.kept {
            self.run.moving.undo_searches();
            // A step of its own that fails leaves a stepper as it was.
            if self.stepped {
                self.run.stepper.reset();
            }
        }
    }
}
