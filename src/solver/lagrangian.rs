//! Particles that are carried by the flow.

use super::fields::Fields;
use super::flow::Flow;
use super::ledger::LedgerRow;
use super::limits::{Limits, Rate};
use super::moving::{Moving, MovingScene, MovingState};
use super::moving_diffusion::{MovingDiffusion, MovingSettings};
use super::policy::{GrowthPolicy, StepPolicy};
use super::remeshing::{Nodes, Remesher, Remeshing, check};
use super::substeps::longest;
use super::watch::OverlapWatch;
use crate::domain::Domain;
use crate::error::{Limit, Result, SolverError};
use crate::kernel::MeshKernel;
use crate::particles::Particles;
use crate::scale::Volumes;
use crate::time::{Entry, Plan, Stepper};

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
    pub(super) policy: StepPolicy,
    pub(super) courant: f64,
    pub(super) growth: GrowthPolicy,
    /// The search of the neighbors after which growth was estimated last.
    pub(super) surveyed: u64,
    pub(super) sharp: Vec<(Limit, Rate)>,
    pub(super) remesher: Option<Box<dyn Remesher<D, S::Value>>>,
    /// Turns of the remesher so far.
    pub(super) turns: u64,
    pub(super) watch: Option<OverlapWatch<D>>,
    pub(super) ledger: LedgerRow<D>,
    /// Masses at the start.
    pub(super) start: Vec<f64>,
    pub(super) t: f64,
    pub(super) work: MovingState<D, S::Value>,
    pub(super) values: Vec<S::Value>,
}

impl<const D: usize, S: MovingScene<D>, St: Stepper<MovingState<D, S::Value>>> Lagrangian<D, S, St> {
    /// Puts the scene on these particles, which have the values u; the run starts at t = 0.
    ///
    /// # Errors
    /// [`ParticleError::NoVolumes`](crate::ParticleError::NoVolumes) without volumes;
    /// [`TimeError::Shape`](crate::TimeError::Shape) for another number of values;
    /// [`DomainError::Outside`](crate::DomainError::Outside) naming a particle outside the domain; as
    /// [`MovingDiffusion::start`], [`MovingDiffusion::check`] and [`MovingDiffusion::spectrum`];
    /// [`SolverError::Unstable`] where no step is stable for a term; [`SolverError::Growing`] where modes of the
    /// diffusion term grow.
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
            turns: 0,
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

    /// The longest legal step from here: infinite where nothing limits it now. Where flow or source depend on time, one that
    /// is legal at both its ends, and no longer than the limit at its start.
    ///
    /// # Errors
    /// As [`limits`](Self::limits).
    pub fn longest_step(&mut self) -> Result<f64> {
        longest(self.t, |dt| {
            let limits = self.limits_of(self.t, dt, None)?.0;
            // A step may come to where the source is not defined, but is not named as one that is legal there.
            self.moving.source_limits(self.t + dt)?;
            Ok(limits.step(&self.stepper))
        })
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
    /// [`MovingDiffusion::check`] and [`MovingDiffusion::rates`]. The run is then as it was, and a step that is taken after
    /// all has the bits it would have had; but a stepper that remembers earlier steps starts anew where its own step was done
    /// and something else was refused.
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
}
