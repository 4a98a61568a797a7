//! Particles that are carried by the flow.

use super::fields::Fields;
use super::flow::Flow;
use super::ledger::LedgerRow;
use super::limits::{Limits, Rate};
use super::moving::{Moving, MovingScene, MovingState};
use super::moving_diffusion::{MovingDiffusion, MovingSettings};
use super::policy::{GrowthPolicy, StepPolicy};
use super::remeshing::{Nodes, Remesher, Remeshing, Trigger, check, overlap_is_lost};
use super::watch::OverlapWatch;
use crate::apply::Report;
use crate::domain::Domain;
use crate::error::{ErrorKind, Limit, Result, SolverError, TimeError};
use crate::kernel::MeshKernel;
use crate::mesh::Remeshed;
use crate::particles::Particles;
use crate::scale::Volumes;
use crate::time::{Entry, Plan, State, Stepper};

/// The default constant C of the Lagrangian CFL condition dt |grad v|_2 <= C.
pub const COURANT: f64 = 0.5;

/// A scene on particles that move with the flow, advanced by any stepper:
///
/// ```text
/// dx_p/dt = v(x_p, t)   dV_p/dt = V_p div v   domega_p/dt = V_p div(D grad u)_p + V_p S(x_p, t, u_p)   u_p = omega_p/V_p
/// ```
///
/// The strengths omega_p are what is conserved; the values u_p are never stored. What a scene leaves as it is has no
/// equation: under pure advection every strength keeps its bits, and volumes do in a flow without divergence. A volume that
/// a step would make zero or less is a refusal of that step. Positions are kept inside periodic faces; a particle that
/// leaves other faces is refused. Particles may be replaced by those of a mesh ([`remeshing`](Self::remeshing)).
///
/// Before each step the limits of the moment are computed: the diffusion number from the actual rows, the Lagrangian CFL
/// condition dt |grad v|_2 <= C, compression, and the rate of the source. A step above them is refused unless
/// [`step_policy`](Self::step_policy) says otherwise. After an error, and after a panic in a function of the scene, the run is
/// what it was before the step. Order tests refine dt with h: a bounded dt |grad v| is stability, not convergence.
///
/// ```
/// use parops::{AdvectionDiffusion, Carried, Domain, Lagrangian, Particles, Rk4, Steady};
/// let particles = Particles::lattice([0.0; 2], [1.0; 2], [10; 2])?;
/// let ring = Domain::periodic([0.0; 2], [1.0; 2])?;
/// let shear = Steady(|x: &[f64; 2]| [(std::f64::consts::TAU * x[1]).sin(), 0.0]);
/// let scene = AdvectionDiffusion::<2>::new().advection(shear, Carried);
/// let u: Vec<f64> = particles.points().iter().map(|x| x[0]).collect();
/// let mut run = Lagrangian::new(scene, &particles, &u, &ring, Rk4::new())?;
/// let before = run.strengths().to_vec();
/// run.advance(1.0, 0.05)?;
/// assert_eq!(run.strengths(), before);
/// # parops::Result::Ok(())
/// ```
///
/// Source: notes 001, sec. 7.1 to 7.4, with errata 36 to 38.
pub struct Lagrangian<const D: usize, S: MovingScene<D>, St> {
    pub(super) moving: Moving<D, S>,
    pub(super) state: MovingState<D, S::Value>,
    pub(super) stepper: St,
    policy: StepPolicy,
    courant: f64,
    growth: GrowthPolicy,
    /// The search of the neighbors after which growth was estimated last.
    pub(super) surveyed: u64,
    sharp: Vec<(Limit, Rate)>,
    remesher: Option<Box<dyn Remesher<D, S::Value>>>,
    pub(super) watch: Option<OverlapWatch<D>>,
    pub(super) ledger: LedgerRow<D>,
    /// Masses at the start.
    pub(super) start: Vec<f64>,
    pub(super) t: f64,
    work: MovingState<D, S::Value>,
    values: Vec<S::Value>,
}

impl<const D: usize, S: MovingScene<D>, St: Stepper<MovingState<D, S::Value>>> Lagrangian<D, S, St> {
    /// Puts the scene on these particles, which have the values u; the run starts at t = 0.
    ///
    /// # Errors
    /// [`ParticleError::NoVolumes`](crate::ParticleError::NoVolumes) without volumes; [`TimeError::Shape`] for another
    /// number of values; [`DomainError::Outside`](crate::DomainError::Outside) naming a particle outside the domain; as
    /// [`MovingDiffusion::start`], [`MovingDiffusion::check`] and [`MovingDiffusion::spectrum`];
    /// [`SolverError::Unstable`] where no step is stable for a term; [`SolverError::Growing`] where modes of the diffusion
    /// term grow.
    pub fn new(scene: S, particles: &Particles<D>, u: &[S::Value], domain: &Domain<D>, stepper: St) -> Result<Self> {
        Self::with_settings(scene, particles, u, domain, stepper, MovingSettings::default())
    }

    /// The same with settings for the neighbor list and for modes that grow.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn with_settings(
        scene: S,
        particles: &Particles<D>,
        u: &[S::Value],
        domain: &Domain<D>,
        stepper: St,
        settings: MovingSettings,
    ) -> Result<Self> {
        let (mut moving, state) = Moving::new(scene, particles, u, domain, settings)?;
        let (limits, report) = moving.limits(0.0, 0.0, &state, COURANT)?;
        limits.possible(&stepper)?;
        if report.is_some() {
            stepper.check_symmetry(moving.symmetry(&state)?)?;
        }
        let work = state.clone();
        let mut run = Self {
            moving,
            state,
            stepper,
            policy: StepPolicy::default(),
            courant: COURANT,
            growth: settings.growth,
            surveyed: 0,
            sharp: Vec::new(),
            remesher: None,
            watch: None,
            ledger: LedgerRow::new(S::Value::FIELDS),
            start: Vec::new(),
            t: 0.0,
            work,
            values: Vec::new(),
        };
        if report.is_some() {
            (run.surveyed, run.ledger.growth) =
                (run.moving.searches().0, run.moving.growth_at_the_start(settings.growth)?);
        }
        run.certify(report.as_ref());
        run.measure();
        run.start = run.ledger.fields.iter().map(|field| field.mass).collect();
        run.measure();
        Ok(run)
    }

    /// Sets what happens to a step above the limit.
    #[must_use]
    pub fn step_policy(mut self, policy: StepPolicy) -> Self {
        self.policy = policy;
        self
    }

    /// Puts a sharp rate in the place of the bound from the rows.
    #[must_use]
    pub fn sharp(mut self, limit: Limit, rate: Rate) -> Self {
        self.sharp.push((limit, rate));
        self
    }

    /// Sets the time the run is at.
    #[must_use]
    pub fn at(mut self, t: f64) -> Self {
        self.t = t;
        self.ledger.t = t;
        self
    }

    /// Sets the constant C of dt |grad v|_2 <= C, [`COURANT`] by default.
    ///
    /// # Errors
    /// [`SolverError::Courant`] where it is not between 0 and 1: from 1 on particles may cross within an explicit Euler
    /// step.
    ///
    /// Source: notes 001, eq. 7.14 to 7.17, with errata 37.
    pub fn courant(mut self, constant: f64) -> Result<Self> {
        if !(constant > 0.0 && constant < 1.0) {
            return Err(SolverError::Courant { constant }.into());
        }
        self.courant = constant;
        Ok(self)
    }

    /// Replaces the particles by those of a mesh from time to time.
    ///
    /// # Errors
    /// [`SolverError::Exactness`] for a kernel of less exactness than the order of the diffusion;
    /// [`OperatorError::Overlap`](crate::OperatorError::Overlap) or
    /// [`OperatorError::TooFew`](crate::OperatorError::TooFew) for a mesh that is too coarse for it;
    /// [`SolverError::MeshAxis`] for a mesh that is not periodic as the domain is; [`SolverError::Trigger`] and
    /// [`MeshError::Threshold`](crate::MeshError::Threshold) for illegal numbers;
    /// [`ParticleError::Length`](crate::ParticleError::Length) for a velocity given particle by particle, which would not
    /// survive.
    pub fn remeshing<K: MeshKernel<f64, N> + 'static, const N: usize>(
        mut self,
        remeshing: Remeshing<D, K>,
    ) -> Result<Self> {
        let remesher = Nodes(remeshing);
        let (scene, count) = (&self.moving.scene, self.volumes().len());
        let diffusion = scene.diffusion_term();
        let spacing = check::<D, S::Value>(&remesher, &self.moving.domain, diffusion.order(), diffusion.conditioned())?;
        self.moving.admits(spacing)?;
        scene.advection_term().validate(count + 1)?;
        diffusion.validate(count + 1)?;
        self.remesher = Some(Box::new(remesher));
        Ok(self)
    }

    /// The time the run is at.
    pub fn time(&self) -> f64 {
        self.t
    }

    /// The positions x_p.
    pub fn points(&self) -> &[[f64; D]] {
        self.moving.points(&self.state)
    }

    /// The strengths omega_p = u_p V_p.
    pub fn strengths(&self) -> &[S::Value] {
        self.moving.omega(&self.state)
    }

    /// The volumes V_p.
    pub fn volumes(&self) -> &[f64] {
        self.moving.volume(&self.state)
    }

    /// The values u_p = omega_p / V_p.
    pub fn values(&self) -> impl Iterator<Item = S::Value> + '_ {
        self.strengths().iter().zip(self.volumes()).map(|(&omega, &volume)| S::Value::ZERO.plus(1.0 / volume, omega))
    }

    /// The particles as a set of their own.
    ///
    /// # Errors
    /// As [`Particles::new`] and [`Volumes::each`].
    pub fn particles(&self) -> Result<Particles<D>> {
        Particles::new(self.points().to_vec())?.with_volumes(Volumes::each(self.volumes().to_vec())?)
    }

    /// The ledger after the last step.
    pub fn ledger(&self) -> &LedgerRow<D> {
        &self.ledger
    }

    /// What bounds a step from here.
    ///
    /// # Errors
    /// Naming the particle where a coefficient is not finite or a row is illegal.
    pub fn limits(&mut self) -> Result<Limits> {
        Ok(self.limits_of(self.t, 0.0, None)?.0)
    }

    /// Advances the run by one step, and replaces the particles where it is time.
    ///
    /// # Errors
    /// [`SolverError::Limit`] for a step above the limit, [`SolverError::Substeps`] where cutting it does not help;
    /// [`SolverError::Growing`] where modes of the diffusion term have come to grow since the neighbors were last searched;
    /// [`SolverError::Volume`] naming the particle whose volume would not stay positive; [`SolverError::OverlapLost`] where it
    /// is [watched](Self::watching); [`SolverError::Drift`] above the [`drift_budget`](Self::drift_budget);
    /// [`DomainError::Outside`](crate::DomainError::Outside) naming one that leaves the domain, and
    /// [`MeshError::Support`](crate::MeshError::Support) one whose support leaves the mesh; as [`Stepper::step`],
    /// [`MovingDiffusion::check`] and [`MovingDiffusion::rates`]. The run is then as it was.
    pub fn step(&mut self, dt: f64) -> Result<&LedgerRow<D>> {
        self.step_to(dt, self.t + dt)
    }

    /// Advances the run by equal steps to t = `end`, the fewest that are not longer than `dt` but for rounding.
    ///
    /// # Errors
    /// As [`step`](Self::step) and [`Plan::new`]. The run is as it was before the step that failed.
    pub fn advance(&mut self, end: f64, dt: f64) -> Result<&LedgerRow<D>> {
        self.advance_with(end, dt, |_, _| {})
    }

    /// The same; `progress` sees the ledger and the run after every step.
    ///
    /// # Errors
    /// As [`advance`](Self::advance).
    pub fn advance_with(
        &mut self,
        end: f64,
        dt: f64,
        mut progress: impl FnMut(&LedgerRow<D>, &Self),
    ) -> Result<&LedgerRow<D>> {
        let plan = Plan::new(self.t, end, dt)?;
        for n in 0..plan.steps() {
            self.step_to(plan.dt(), plan.time(n + 1))?;
            progress(&self.ledger, self);
        }
        Ok(&self.ledger)
    }

    fn step_to(&mut self, dt: f64, end: f64) -> Result<&LedgerRow<D>> {
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
    fn limits_of(
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
            return Err(crate::error::Error::from(SolverError::Volume { volume, t: t + dt }).at(p));
        }
        for (p, x) in work.0.iter_mut().enumerate() {
            *x = moving.domain.wrap(x).map_err(|error| error.at(p))?;
        }
        Ok(())
    }

    /// Cuts a step into substeps, each within the limit of its moment, and says how many.
    fn cut(&mut self, work: &mut MovingState<D, S::Value>, dt: f64, end: f64, mut limits: Limits) -> Result<u32> {
        let StepPolicy::Adapt { most } = self.policy else { return Ok(0) };
        let (mut t, mut done) = (self.t, 0);
        loop {
            let rest = end - t;
            let (limit, binding) = (limits.step(&self.stepper), limits.binding(&self.stepper));
            let parts = (rest / limit).ceil().max(1.0);
            if !(parts <= f64::from(most - done.min(most))) {
                let binding = binding.unwrap_or(Limit::Diffusion);
                return Err(SolverError::Substeps { dt, limit, binding, most }.into());
            }
            self.substep(work, t, rest / parts)?;
            done += 1;
            if parts == 1.0 {
                return Ok(done);
            }
            t += rest / parts;
            limits = self.limits_of(t, end - t, Some(work))?.0;
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
