//! Fixed particles: rows made once, stepped many times.

use super::edge::Edge;
use super::fields::Fields;
use super::ledger::LedgerRow;
use super::limits::{Limits, Rate};
use super::policy::{GrowthPolicy, StepPolicy};
use super::saved::SavedRun;
use super::scene::Scene;
use super::scheme::TimeScheme;
use super::semi_discrete::SemiDiscrete;
use super::source::slack;
use super::substeps::{Substeps, longest};
use super::watch::{check_budget, check_drift};
use crate::error::{Limit, Result, TimeError};
use crate::neighbors::Neighbors;
use crate::particles::Particles;
use crate::time::Plan;

/// A scene on fixed particles, advanced by any stepper, or implicitly ([`ImplicitScheme`](crate::ImplicitScheme)).
///
/// Before each step the limits of the moment are computed from the actual rows; a step above them is refused unless
/// [`step_policy`](Self::step_policy) says otherwise. After an error, and after a panic in a function of the scene, field
/// and run are what they were before the step, but that a stepper that remembers earlier steps starts anew where it was amid
/// substeps. A scene without a boundary allocates nothing after the first step.
///
/// ```
/// use parops::{AdvectionDiffusion, CellList, DcPse, Domain, Eulerian, Laplacian, Particles, Rk4};
/// let particles = Particles::jittered([0.0; 2], [1.0; 2], [24; 2], 0.2, 1)?;
/// let laplacian = DcPse::<Laplacian<2>, 2>::new();
/// let torus = Domain::periodic([0.0; 2], [1.0; 2])?;
/// let neighbors = CellList::build(&particles, &torus, laplacian.cutoff(&particles)?)?;
/// let scene = AdvectionDiffusion::<2>::new().diffusion(0.05, laplacian);
/// let mut run = Eulerian::new(scene, &particles, &neighbors, Rk4::new())?;
/// let wave = |x: &[f64; 2]| (std::f64::consts::TAU * x[0]).sin();
/// let mut u: Vec<f64> = particles.points().iter().map(wave).collect();
/// run.advance(&mut u, 0.1, 2e-3)?;
/// let decay = (-0.05 * std::f64::consts::TAU.powi(2) * 0.1).exp();
/// let worst = particles.points().iter().zip(&u).map(|(x, u)| (u - decay * wave(x)).abs()).fold(0.0, f64::max);
/// assert!(worst < 0.02, "{worst}");
/// # parops::Result::Ok(())
/// ```
pub struct Eulerian<const D: usize, S: Scene<D>, St> {
    discrete: SemiDiscrete<D, S>,
    stepper: St,
    steps: StepPolicy,
    growth: GrowthPolicy,
    /// The rate of the advection that growth was estimated at.
    estimated: f64,
    sharp: Vec<(Limit, Rate)>,
    ledger: LedgerRow<D>,
    /// Masses at the start, once there is one.
    start: Vec<f64>,
    t: f64,
    work: Vec<S::Value>,
    /// Whether the stepper has taken a step of the one on trial.
    stepped: bool,
}

impl<const D: usize, S: Scene<D>, St: TimeScheme<D, S>> Eulerian<D, S, St> {
    /// Makes the rows of the scene on these particles; the run starts at t = 0.
    ///
    /// # Errors
    /// As [`SemiDiscrete::new`]; [`SolverError::Growing`](crate::SolverError::Growing) where modes grow whatever the
    /// step, as those of central schemes on scattered particles without enough diffusion;
    /// [`SolverError::Unstable`](crate::SolverError::Unstable) where no step is stable for a term, such as explicit
    /// Euler with a central scheme for the advection.
    pub fn new<P: Neighbors<D>>(scene: S, particles: &Particles<D>, neighbors: &P, stepper: St) -> Result<Self> {
        Self::with_policy(scene, particles, neighbors, stepper, StepPolicy::default(), GrowthPolicy::default())
    }

    /// The same with a choice of what happens to steps above their limit and to modes that grow.
    ///
    /// # Errors
    /// As [`new`](Self::new) for what the policies refuse.
    pub fn with_policy<P: Neighbors<D>>(
        scene: S,
        particles: &Particles<D>,
        neighbors: &P,
        stepper: St,
        steps: StepPolicy,
        growth: GrowthPolicy,
    ) -> Result<Self> {
        let mut discrete = SemiDiscrete::new(scene, particles, neighbors, growth)?;
        let mut ledger = LedgerRow::new(S::Value::FIELDS);
        ledger.growth = discrete.growth(0.0, growth)?;
        for report in discrete.reports() {
            ledger.condition = ledger.condition.max(report.condition);
            ledger.residual = ledger.residual.max(report.residual);
        }
        // What the source adds shows before the first step: it may not be defined without a field.
        let limits = discrete.linear_limits(0.0)?;
        if steps != StepPolicy::Allow {
            limits.possible_within(|limit| stepper.intervals(limit))?;
            stepper.check_symmetry(discrete.symmetry())?;
        }
        let (estimated, sharp) = (limits.rate(Limit::Advection).fastest(), Vec::new());
        let (start, t, work, stepped) = (Vec::new(), 0.0, Vec::new(), false);
        Ok(Self { discrete, stepper, steps, growth, estimated, sharp, ledger, start, t, work, stepped })
    }

    /// Sets what happens to a step above the limit.
    #[must_use]
    pub fn step_policy(mut self, policy: StepPolicy) -> Self {
        self.steps = policy;
        self
    }

    /// Puts a sharp rate, such as one from eigenvalues or a lattice table, in the place of the bound from the rows.
    #[must_use]
    pub fn sharp(mut self, limit: Limit, rate: Rate) -> Self {
        self.sharp.push((limit, rate));
        self
    }

    /// Refuses steps after which the mass of a field has drifted by more than this share of sum_p |omega_p|, such as 1e-3:
    /// methods that are exact on scattered particles do not conserve. What sources and boundaries add counts as drift.
    ///
    /// # Errors
    /// [`SolverError::Budget`](crate::SolverError::Budget) where it is not positive.
    pub fn drift_budget(mut self, budget: f64) -> Result<Self> {
        self.ledger.budget = check_budget(budget)?;
        Ok(self)
    }

    /// Sets the time the run is at.
    #[must_use]
    pub fn at(mut self, t: f64) -> Self {
        self.t = t;
        self
    }

    /// The time the run is at.
    pub fn time(&self) -> f64 {
        self.t
    }

    /// The longest legal step from here: infinite where nothing limits it now. Where flow or source depend on time, one that
    /// is legal at both its ends, and no longer than the limit at its start.
    ///
    /// # Errors
    /// As [`limits`](Self::limits).
    pub fn longest_step(&mut self, u: &[S::Value]) -> Result<f64> {
        longest(self.t, |dt| {
            // A step may come to where the source is not defined, but is not named as one that is legal there.
            self.discrete.source_limits(self.t + dt, u)?;
            let limits = self.limits_of(self.t, dt, u)?;
            Ok(self.bound(&limits).0)
        })
    }

    /// The ledger after the last step.
    pub fn ledger(&self) -> &LedgerRow<D> {
        &self.ledger
    }

    /// The scene on its particles.
    pub fn discrete(&self) -> &SemiDiscrete<D, S> {
        &self.discrete
    }

    /// What moves the scene in time.
    pub fn stepper(&self) -> &St {
        &self.stepper
    }

    /// The run as it stands, with the field it has come to; the scene is not in it.
    pub fn save(&self, u: &[S::Value]) -> SavedRun<S::Value, St>
    where
        St: Clone,
    {
        let (t, step, retries) = (self.t, self.ledger.step, self.ledger.retries);
        SavedRun { t, step, retries, start: self.start.clone(), u: u.to_vec(), stepper: self.stepper.clone() }
    }

    /// Takes up a saved run with the same scene on the same particles, and returns the field: the steps that follow have
    /// the bits they would have had. Policies and sharp rates stay those of this run.
    ///
    /// # Errors
    /// [`TimeError::Shape`] for another number of particles or fields; the run is then as it was.
    pub fn resume(&mut self, saved: SavedRun<S::Value, St>) -> Result<Vec<S::Value>> {
        let SavedRun { t, step, retries, start, u, stepper } = saved;
        let (points, fields) = (self.discrete.site().points().len(), <S::Value as Fields>::FIELDS);
        let fits = [(u.len(), points), (start.len(), if start.is_empty() { 0 } else { fields })];
        if let Some((found, needed)) = fits.into_iter().find(|(found, needed)| found != needed) {
            return Err(TimeError::Shape { found, needed }.into());
        }
        (self.t, self.start, self.stepper) = (t, start, stepper);
        (self.ledger.step, self.ledger.t, self.ledger.retries) = (step, t, retries);
        Ok(u)
    }

    /// What bounds a step from here.
    ///
    /// # Errors
    /// As [`SemiDiscrete::limits`]; [`TimeError::Shape`] for another number of particles.
    pub fn limits(&mut self, u: &[S::Value]) -> Result<Limits> {
        self.limits_of(self.t, 0.0, u)
    }

    /// What bounds a step from t over dt: the larger rates of its ends.
    fn limits_of(&mut self, t: f64, dt: f64, u: &[S::Value]) -> Result<Limits> {
        let (found, needed) = (u.len(), self.discrete.site().points().len());
        if found != needed {
            return Err(TimeError::Shape { found, needed }.into());
        }
        let mut limits = self.discrete.limits(t, u)?;
        if dt > 0.0 && !self.discrete.steady() {
            limits = limits.larger(&self.discrete.linear_limits(t + dt)?);
        }
        if dt > 0.0 {
            // Where a source is not finite at the end the stepper finds it so, if it comes there.
            limits = limits.larger(&self.discrete.source_limits(t + dt, u).unwrap_or_default());
        }
        self.sharp.iter().for_each(|&(limit, rate)| limits.set(limit, rate));
        Ok(limits)
    }

    /// Advances u by one step.
    ///
    /// # Errors
    /// [`SolverError::Limit`](crate::SolverError::Limit) for a step above the limit,
    /// [`SolverError::Substeps`](crate::SolverError::Substeps) where cutting it does not help;
    /// [`SolverError::Drift`](crate::SolverError::Drift) above the [`drift_budget`](Self::drift_budget);
    /// [`TimeError::NotFinite`] with particle, stage and time; as [`TimeScheme::step`] and [`SemiDiscrete::rate`].
    /// Field and run are then as they were.
    pub fn step(&mut self, u: &mut Vec<S::Value>, dt: f64) -> Result<&LedgerRow<D>> {
        self.step_to(u, dt, self.t + dt)
    }

    /// Advances u by equal steps to t = `end`, the fewest that are not longer than `dt` but for rounding.
    ///
    /// # Errors
    /// As [`step`](Self::step) and [`Plan::new`]. Field and run are as they were before the step that failed.
    pub fn advance(&mut self, u: &mut Vec<S::Value>, end: f64, dt: f64) -> Result<&LedgerRow<D>> {
        self.advance_with(u, end, dt, |_, _| {})
    }

    /// The same; `progress` sees the ledger and the field after every step.
    ///
    /// # Errors
    /// As [`advance`](Self::advance).
    pub fn advance_with(
        &mut self,
        u: &mut Vec<S::Value>,
        end: f64,
        dt: f64,
        mut progress: impl FnMut(&LedgerRow<D>, &[S::Value]),
    ) -> Result<&LedgerRow<D>> {
        let plan = Plan::new(self.t, end, dt)?;
        for n in 0..plan.steps() {
            self.step_to(u, plan.dt(), plan.time(n + 1))?;
            progress(&self.ledger, u);
        }
        Ok(&self.ledger)
    }

    fn step_to(&mut self, u: &mut Vec<S::Value>, dt: f64, end: f64) -> Result<&LedgerRow<D>> {
        if !(dt > 0.0 && dt.is_finite()) {
            return Err(TimeError::Step { dt }.into());
        }
        let limits = self.limits_of(self.t, dt, u)?;
        let (limit, binding) = self.bound(&limits);
        let within = dt <= limit * slack::<D, S::Value, S::Source>();
        if !within && self.steps == StepPolicy::Refuse {
            return Err(limits.refuse(dt, limit, binding));
        }
        let (growth, estimated) = self.estimate(&limits, dt)?;
        let start = if self.start.is_empty() { Some(self.masses(u)) } else { None };
        let whole = within || self.steps == StepPolicy::Allow;
        let in_place = !<S::Edge as Edge<D, S::Value>>::PRESENT && self.ledger.budget == f64::INFINITY;
        let substeps = if whole && in_place {
            let Self { discrete, stepper, t, .. } = self;
            stepper.step(*t, dt, u, discrete)?;
            1
        } else {
            let mut work = std::mem::take(&mut self.work);
            work.clone_from(u);
            self.stepped = false;
            let done =
                if whole { self.substep(&mut work, self.t, dt).map(|()| 1) } else { self.cut(&mut work, dt, limits) };
            let done = done
                .and_then(|substeps| self.drifted(&work, start.as_deref().unwrap_or(&self.start)).map(|()| substeps));
            if done.is_ok() {
                std::mem::swap(u, &mut work);
            } else if self.stepped {
                // A step of its own that fails leaves a stepper as it was.
                self.stepper.reset();
            }
            self.work = work;
            done?
        };
        (self.t, self.estimated) = (end, estimated);
        self.start.extend(start.into_iter().flatten());
        let ledger = &mut self.ledger;
        ledger.growth = growth;
        ledger.measure(self.discrete.site().particles(), u, &self.start);
        (ledger.t, ledger.dt, ledger.limit, ledger.binding) = (end, dt, limit, binding);
        (ledger.within_limit, ledger.substeps) = (within || substeps > 1, substeps);
        ledger.step += 1;
        ledger.retries += u64::from(substeps) - 1;
        Ok(&self.ledger)
    }

    /// The mass of every field.
    fn masses(&self, u: &[S::Value]) -> Vec<f64> {
        let mut row = LedgerRow::new(S::Value::FIELDS);
        row.measure(self.discrete.site().particles(), u, &[]);
        row.fields.iter().map(|field| field.mass).collect()
    }

    /// The growth rate of modes and the rate of the advection it was estimated at: anew where the flow has become twice as
    /// fast, at the end of the step where it is at rest before.
    fn estimate(&mut self, limits: &Limits, dt: f64) -> Result<(f64, f64)> {
        let rate = limits.rate(Limit::Advection).fastest();
        if self.discrete.steady() || !(rate > 2.0 * self.estimated) {
            return Ok((self.ledger.growth, self.estimated));
        }
        Ok((self.discrete.growth(self.t + dt, self.growth)?, rate))
    }

    /// The longest legal step, and what binds it.
    fn bound(&self, limits: &Limits) -> (f64, Option<Limit>) {
        let intervals = |limit| self.stepper.intervals(limit);
        (limits.step_within(intervals), limits.binding_within(intervals))
    }

    /// Refuses a field that has drifted from the masses at the start by more than the budget.
    fn drifted(&self, u: &[S::Value], start: &[f64]) -> Result<()> {
        let particles = self.discrete.site().particles();
        let volumes = particles.volumes().ok();
        let volume = |p: usize| volumes.and_then(|volumes| volumes.get(p).ok()).unwrap_or(1.0);
        let strength = |p: usize, i: usize| u.get(p).map_or(0.0, |u| volume(p) * u.get(i));
        check_drift::<D, S::Value>(particles.points(), strength, start, self.ledger.budget)
    }

    /// One substep of a scene, boundary values included.
    fn substep(&mut self, u: &mut Vec<S::Value>, t: f64, dt: f64) -> Result<()> {
        let Self { discrete, stepper, .. } = self;
        stepper.step(t, dt, u, discrete)?;
        self.stepped = true;
        self.discrete.impose(t + dt, u)
    }

    /// Cuts a step into substeps, and says how many.
    fn cut(&mut self, u: &mut Vec<S::Value>, dt: f64, mut limits: Limits) -> Result<u32> {
        let mut left = Substeps::new(self.steps, self.t, dt, self.t + dt);
        loop {
            let (limit, binding) = self.bound(&limits);
            let t = left.t;
            let part = left.next(limit * slack::<D, S::Value, S::Source>(), binding)?;
            self.substep(u, t, part)?;
            if left.done() {
                return Ok(left.taken);
            }
            limits = self.limits_of(left.t, left.rest(), u)?;
        }
    }
}
