//! A scene on particles that move: positions, strengths and volumes, ready to be stepped.

use super::fields::Fields;
use super::flow::Flow;
use super::limits::{Limits, Rate};
use super::moving_diffusion::{MovingDiffusion, MovingSettings};
use super::scene::Scene;
use super::symmetry::{probes, symmetry};
use super::term::{SceneTerm, Site};
use crate::apply::Report;
use crate::apply::blocks::each_row;
use crate::domain::Domain;
use crate::error::{Error, Limit, Result, SolverError, TimeError};
use crate::linear::{Spectrum, SpectrumEstimator};
use crate::particles::Particles;
use crate::scale::Volumes;
use crate::time::{Entry, RowSymmetry};

/// What a stepper moves: positions, and strengths and volumes. What a scene leaves as it is has no entries in it.
pub type MovingState<const D: usize, E> = (Vec<[f64; D]>, (Vec<E>, Vec<f64>));

/// A scene that particles can move in: any flow, any [`MovingMethod`](crate::MovingMethod) for the diffusion, any source.
///
/// Conditions at boundary particles are not among it: these would have to stay. Periodic and mirror faces are those of the
/// domain.
#[diagnostic::on_unimplemented(
    message = "`{Self}` is no scene for moving particles in {D} dimensions",
    label = "its diffusion must be by `Pse` or `DcPse` (any `MovingMethod`), and without conditions at boundary particles"
)]
pub trait MovingScene<const D: usize>:
    Scene<
        D,
        Edge = (),
        Advection: Flow<D>,
        Diffusion: MovingDiffusion<D, Self::Value>,
        Source: SceneTerm<D, Self::Value, Rows = ()>,
    >
{
}

impl<S, const D: usize> MovingScene<D> for S where
    S: Scene<
            D,
            Edge = (),
            Advection: Flow<D>,
            Diffusion: MovingDiffusion<D, S::Value>,
            Source: SceneTerm<D, S::Value, Rows = ()>,
        >
{
}

type KeptOf<const D: usize, S> = <<S as Scene<D>>::Diffusion as MovingDiffusion<D, <S as Scene<D>>::Value>>::Kept;
type ValuesOf<const D: usize, S> = <<S as Scene<D>>::Advection as Flow<D>>::Values;

/// The particles of the last stage with their neighbors, and what of them the scene leaves as it is.
pub(super) struct Held<const D: usize, S: MovingScene<D>> {
    pub(super) site: Site<D>,
    kept: KeptOf<D, S>,
    values: ValuesOf<D, S>,
    /// Strengths and volumes that no term changes.
    omega: Vec<S::Value>,
    volume: Vec<f64>,
}

impl<const D: usize, S: MovingScene<D>> Held<D, S> {
    /// Particles of these strengths, and their state.
    pub(super) fn new(
        particles: Particles<D>,
        omega: Vec<S::Value>,
        kept: KeptOf<D, S>,
    ) -> Result<(Self, MovingState<D, S::Value>)> {
        let volumes = particles.volumes()?;
        let volume = (0..particles.len()).map(|p| volumes.get(p)).collect::<Result<Vec<f64>>>()?;
        let points = if S::Advection::MOVES { particles.points().to_vec() } else { Vec::new() };
        let (own, omega) = if Moving::<D, S>::EXCHANGES { (Vec::new(), omega) } else { (omega, Vec::new()) };
        let (fixed, volume) = if S::Advection::SOLENOIDAL { (volume, Vec::new()) } else { (Vec::new(), volume) };
        let site = Site::moving(particles);
        Ok((Self { site, kept, values: Default::default(), omega: own, volume: fixed }, (points, (omega, volume))))
    }
}

/// The right-hand side.
pub(super) struct Moving<const D: usize, S: MovingScene<D>> {
    pub(super) scene: S,
    pub(super) domain: Domain<D>,
    pub(super) held: Held<D, S>,
    u: Vec<S::Value>,
    places: Vec<[f64; D]>,
    spare: Volumes,
    /// div(D grad u) as the last check found it, and its time; no time once it was used.
    spread: Vec<S::Value>,
    spread_at: Option<f64>,
}

impl<const D: usize, S: MovingScene<D>> Moving<D, S> {
    /// Whether strengths change between two remeshings.
    const EXCHANGES: bool =
        <S::Diffusion as MovingDiffusion<D, S::Value>>::SPREADS || <S::Source as SceneTerm<D, S::Value>>::PRESENT;

    /// The particles with the values u, and their state.
    pub(super) fn new(
        scene: S,
        particles: &Particles<D>,
        u: &[S::Value],
        domain: &Domain<D>,
        settings: MovingSettings,
    ) -> Result<(Self, MovingState<D, S::Value>)> {
        let (found, needed) = (u.len(), particles.len());
        if found != needed {
            return Err(TimeError::Shape { found, needed }.into());
        }
        scene.advection_term().validate(needed)?;
        let volumes = particles.volumes()?;
        let mut omega = Vec::with_capacity(needed);
        for (p, &u) in u.iter().enumerate() {
            omega.push(S::Value::ZERO.plus(volumes.get(p)?, u));
        }
        let particles = Particles::new(wrapped(particles.points(), domain)?)?.with_volumes(volumes.clone())?;
        let kept = scene.diffusion_term().start(&particles, domain, settings)?;
        let (held, state) = Held::new(particles, omega, kept)?;
        let moving = Self {
            scene,
            domain: *domain,
            held,
            u: Vec::new(),
            places: Vec::new(),
            spare: Volumes::equal(1.0)?,
            spread: Vec::new(),
            spread_at: None,
        };
        Ok((moving, state))
    }

    /// The neighbors of other particles, with the settings of now.
    pub(super) fn restart(&self, particles: &Particles<D>) -> Result<KeptOf<D, S>> {
        self.scene.diffusion_term().restart(&self.held.kept, particles, self.searches().0 + 1)
    }

    /// The neighbors of particles that were last searched at other places, as search number `searches`.
    pub(super) fn resumed(
        &self,
        particles: &Particles<D>,
        searched_at: &[[f64; D]],
        searches: u64,
    ) -> Result<KeptOf<D, S>> {
        let mut before = particles.clone();
        if <S::Diffusion as MovingDiffusion<D, S::Value>>::SPREADS {
            before.set_points(searched_at)?;
        }
        let mut kept = self.scene.diffusion_term().restart(&self.held.kept, &before, searches)?;
        self.scene.diffusion_term().follow(&mut kept, particles)?;
        Ok(kept)
    }

    pub(super) fn points<'a>(&'a self, state: &'a MovingState<D, S::Value>) -> &'a [[f64; D]] {
        if S::Advection::MOVES { &state.0 } else { self.held.site.points() }
    }

    pub(super) fn omega<'a>(&'a self, state: &'a MovingState<D, S::Value>) -> &'a [S::Value] {
        if Self::EXCHANGES { &state.1.0 } else { &self.held.omega }
    }

    pub(super) fn volume<'a>(&'a self, state: &'a MovingState<D, S::Value>) -> &'a [f64] {
        if S::Advection::SOLENOIDAL { &self.held.volume } else { &state.1.1 }
    }

    /// How often the neighbors were searched anew, and where the particles were then.
    pub(super) fn searches(&self) -> (u64, &[[f64; D]]) {
        self.scene.diffusion_term().searches(&self.held.kept)
    }

    pub(super) fn keep_searches(&mut self) {
        self.scene.diffusion_term().keep_searches(&mut self.held.kept);
    }

    pub(super) fn undo_searches(&mut self) {
        self.scene.diffusion_term().undo_searches(&mut self.held.kept);
    }

    pub(super) fn admits(&self, spacing: crate::scale::Spacing) -> Result<()> {
        self.scene.diffusion_term().admits(&self.held.kept, spacing)
    }

    /// Brings the particles to the places and volumes of a state at time t.
    pub(super) fn place(&mut self, t: f64, state: &MovingState<D, S::Value>) -> Result<()> {
        if let Some((p, &volume)) = state.1.1.iter().enumerate().find(|(_, volume)| !(**volume > 0.0)) {
            return Err(Error::from(SolverError::Volume { volume, t }).at(p));
        }
        if S::Advection::MOVES {
            self.places.clear();
            for (p, x) in state.0.iter().enumerate() {
                self.places.push(self.domain.wrap(x).map_err(|error| error.at(p))?);
            }
            self.held.site.particles_mut().set_points(&self.places)?;
        }
        if !S::Advection::SOLENOIDAL {
            // The diffusion term shares the volumes of before until it follows; those before them are free.
            let mut volumes = std::mem::replace(&mut self.spare, self.held.site.particles().volumes()?.clone());
            volumes.renew(&state.1.1)?;
            self.held.site.particles_mut().set_volumes(volumes)?;
        }
        self.scene.advection_term().renew(&mut self.held.values, &self.held.site, &self.domain, t)?;
        if S::Advection::MOVES {
            self.scene.diffusion_term().follow(&mut self.held.kept, self.held.site.particles())?;
        }
        Ok(())
    }

    /// u_p = omega_p / V_p.
    fn evaluate(&mut self, state: &MovingState<D, S::Value>) {
        let mut u = std::mem::take(&mut self.u);
        u.clear();
        let of = |(&omega, &volume): (&S::Value, &f64)| S::Value::ZERO.plus(1.0 / volume, omega);
        u.extend(self.omega(state).iter().zip(self.volume(state)).map(of));
        self.u = u;
    }

    /// dx/dt = v, dV/dt = V div v, domega/dt = V div(D grad u) + V S; what the check of the rows at `checked` found for
    /// this time and state is not computed again.
    pub(super) fn rate(
        &mut self,
        t: f64,
        state: &MovingState<D, S::Value>,
        checked: &MovingState<D, S::Value>,
        rates: &mut MovingState<D, S::Value>,
    ) -> Result<()> {
        let known = self.spread_at.take() == Some(t) && state == checked;
        self.place(t, state)?;
        if Self::EXCHANGES {
            self.evaluate(state);
        }
        let (flow, values, points) = (self.scene.advection_term(), &self.held.values, self.held.site.points());
        let (dx, (domega, dvolume)) = rates;
        if S::Advection::MOVES {
            each_row(dx, |p| flow.at(p, &points[p], t));
        }
        if !S::Advection::SOLENOIDAL {
            each_row(dvolume, |p| state.1.1[p] * flow.divergence(values, p, &points[p], t));
        }
        if Self::EXCHANGES {
            let (u, volume, source) = (&self.u, self.volume(state), self.scene.source_term());
            let finish = |p: usize, rate: S::Value| {
                let rate = source.rate(&(), p, &points[p], t, u, rate);
                S::Value::ZERO.plus(volume[p], rate)
            };
            if known {
                each_row(domega, |p| finish(p, self.spread[p]));
            } else {
                self.scene.diffusion_term().rates(&self.held.kept, u, domega, finish)?;
            }
        }
        Ok(())
    }

    /// What bounds a step of length dt from this state, the flow at both ends of it, and what the check of the diffusion rows
    /// found.
    pub(super) fn limits(
        &mut self,
        t: f64,
        dt: f64,
        state: &MovingState<D, S::Value>,
        courant: f64,
    ) -> Result<(Limits, Option<Report>)> {
        self.spread_at = None;
        self.place(t, state)?;
        if Self::EXCHANGES {
            self.evaluate(state);
        }
        let mut limits = Limits::default();
        self.spread.resize(self.u.len(), S::Value::ZERO);
        let checked = self.scene.diffusion_term().check(&self.held.kept, &self.u, &mut self.spread)?;
        self.spread_at = checked.is_some().then_some(t);
        if let Some((report, factor)) = &checked {
            limits.add(Limit::Diffusion, Rate::decay(factor * report.spectral_bound));
        }
        let flow = self.scene.advection_term();
        flow.bound(&self.held.values, &self.held.site, &self.domain, t, courant, &mut limits)?;
        if dt > 0.0 && !SceneTerm::<D, S::Value>::steady(flow) {
            let mut end = Limits::default();
            flow.bound(&self.held.values, &self.held.site, &self.domain, t + dt, courant, &mut end)?;
            limits = limits.larger(&end);
        }
        if checked.is_none() {
            // Expansion adds to the decay of what diffuses (eq. 7.11); by themselves strengths and volumes bear any.
            limits.set(Limit::Compression, Rate::default());
        }
        limits = limits.larger(&self.source_limits(t)?);
        if dt > 0.0 {
            // Where it is not finite at the end the stepper finds it so, if it comes there.
            limits = limits.larger(&self.source_limits(t + dt).unwrap_or_default());
        }
        Ok((limits, checked.map(|(report, _)| report)))
    }

    /// What the source alone bounds at time t.
    pub(super) fn source_limits(&self, t: f64) -> Result<Limits> {
        let mut limits = Limits::default();
        if <S::Source as SceneTerm<D, S::Value>>::PRESENT {
            self.scene.source_term().limit(&mut (), &self.held.site, t, &self.u, &mut limits)?;
        }
        Ok(limits)
    }

    /// The rightmost eigenvalue and the spectral radius of the diffusion rows of now.
    pub(super) fn spectrum(&self, estimator: SpectrumEstimator) -> Result<Spectrum> {
        self.scene.diffusion_term().spectrum(&self.held.kept, estimator)
    }

    /// Whether V_p w_pq = V_q w_qp in the rows of now, found by applying them to two fields.
    pub(super) fn symmetry(&self, state: &MovingState<D, S::Value>) -> Result<RowSymmetry> {
        let fields = probes::<S::Value>(self.held.site.points().len());
        let mut images = fields.clone();
        for (u, image) in fields.iter().zip(&mut images) {
            self.scene.diffusion_term().rates(&self.held.kept, u, image, |_, rate| rate)?;
        }
        let volumes = self.volume(state);
        Ok(symmetry(&fields, &images, |p| volumes.get(p).copied().unwrap_or(1.0)))
    }
}

/// The points inside their domain.
pub(super) fn wrapped<const D: usize>(points: &[[f64; D]], domain: &Domain<D>) -> Result<Vec<[f64; D]>> {
    points.iter().enumerate().map(|(p, x)| domain.wrap(x).map_err(|error| error.at(p))).collect()
}
