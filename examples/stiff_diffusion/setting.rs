//! The scene on its particles, and its exact solution in time.

use std::f64::consts::TAU;

use parops::{
    AdvectionDiffusion, CellList, Cutoff, DcPse, Diffusion, Domain, Euler, Eulerian, Exchange, Exponential,
    GrowthPolicy, Laplacian, Mean, Method, Particles, Pse, Result, Rk4, RowSymmetry, SemiDiscrete, SspRk3, StepPolicy,
    Stepper, TimeScheme,
};

use crate::scheme::Scheme;

/// The length of a run: the slowest mode decays to a quarter.
pub const END: f64 = 0.02;
/// How long a wave has diffused before, so that no fast mode is left of it at the start.
const BEFORE: f64 = 0.005;

/// A layer that conducts 300 times better than the rest.
fn diffusivity(x: &[f64; 2]) -> f64 {
    if (x[0] - 0.5).abs() < 0.25 { 300.0 } else { 1.0 }
}

fn wave(x: &[f64; 2]) -> f64 {
    1.0 + 0.5 * (TAU * x[0]).cos() + 0.3 * (TAU * (x[1] - x[0])).sin()
}

fn torus() -> Result<Domain<2>> {
    Domain::periodic([0.0; 2], [1.0; 2])
}

/// div(D grad u) by this method.
pub type Physics<M> = AdvectionDiffusion<2, f64, (Diffusion<fn(&[f64; 2]) -> f64, M>, (), (), ())>;

fn physics<M: Method<2, Out = [f64; 1]>>(method: M) -> Physics<M> {
    AdvectionDiffusion::new().diffusion(diffusivity as fn(&[f64; 2]) -> f64, method).mean(Mean::Harmonic)
}

/// A scene that a method discretizes on one set.
pub struct Setting<M> {
    pub name: &'static str,
    pub particles: Particles<2>,
    cutoff: Cutoff,
    method: M,
    pub start: Vec<f64>,
    pub symmetry: RowSymmetry,
    /// The bound of the rows on |lambda|.
    pub rate: f64,
    /// The exact field at the end.
    pub end: Vec<f64>,
}

/// PSE of order 2 on a lattice: symmetric rows.
pub fn lattice(side: usize) -> Result<Setting<Pse<Exchange<2>>>> {
    let particles = Particles::lattice([0.0; 2], [1.0; 2], [side; 2])?;
    let pse = Pse::new(Laplacian::<2>, 2, particles.spacing()?.epsilon(1.5)?, particles.volumes()?)?.support(4.5)?;
    let cutoff = pse.cutoff();
    Setting::new("lattice", particles, cutoff, pse)
}

/// DC-PSE of order 2 on a jittered set: rows that are not.
pub fn scattered(side: usize) -> Result<Setting<DcPse<Laplacian<2>, 2>>> {
    let particles = Particles::jittered([0.0; 2], [1.0; 2], [side; 2], 0.2, 1)?;
    let dcpse = DcPse::new();
    let cutoff = dcpse.cutoff(&particles)?;
    Setting::new("scattered", particles, cutoff, dcpse)
}

impl<M: Method<2, Out = [f64; 1]> + Clone> Setting<M> {
    fn new(name: &'static str, particles: Particles<2>, cutoff: Cutoff, method: M) -> Result<Self> {
        let neighbors = CellList::build(&particles, &torus()?, cutoff)?;
        // No mode grows: once looked for.
        Eulerian::new(physics(method.clone()), &particles, &neighbors, Euler::new())?;
        let mut discrete = SemiDiscrete::new(physics(method.clone()), &particles, &neighbors, GrowthPolicy::Refuse)?;
        let mut start: Vec<f64> = particles.points().iter().map(wave).collect();
        let exact = Exponential::new(particles.len(), |u, du| discrete.rate(0.0, u, du))?;
        exact.propagate(BEFORE, &mut start)?;
        let rate = 2.0 / discrete.limits(0.0, &start)?.step(&Euler::<Vec<f64>>::new());
        let mut end = start.clone();
        exact.propagate(END, &mut end)?;
        Ok(Self { name, symmetry: discrete.symmetry(), particles, cutoff, method, start, rate, end })
    }

    /// The longest step of explicit Euler, which is that of diffusion number 1.
    pub fn explicit_step(&self) -> f64 {
        2.0 / self.rate
    }

    /// The longest step of an explicit scheme.
    pub fn limit(&self, scheme: Scheme) -> f64 {
        let interval = match scheme {
            Scheme::SspRk3 => Stepper::<Vec<f64>>::negative_real_interval(&SspRk3::new()),
            Scheme::Rk4 => Stepper::<Vec<f64>>::negative_real_interval(&Rk4::new()),
            _ => Stepper::<Vec<f64>>::negative_real_interval(&Euler::new()),
        };
        interval / self.rate
    }

    /// Root mean square of the difference to the exact field at the end, over that of what is left of the field there.
    pub fn error(&self, u: &[f64]) -> f64 {
        let mean = self.end.iter().sum::<f64>() / self.end.len() as f64;
        let (miss, size) = u.iter().zip(&self.end).fold((0.0, 0.0), |(miss, size), (u, exact)| {
            (miss + (u - exact) * (u - exact), size + (exact - mean) * (exact - mean))
        });
        f64::sqrt(miss / size)
    }

    /// The neighbors of all particles.
    pub fn search(&self) -> Result<CellList<2>> {
        CellList::build(&self.particles, &torus()?, self.cutoff)
    }

    /// A run by this scheme with what `search` found; growth was looked for once.
    pub fn run<St>(&self, neighbors: &CellList<2>, stepper: St) -> Result<Eulerian<2, Physics<M>, St>>
    where
        St: TimeScheme<2, Physics<M>>,
    {
        let (steps, growth) = (StepPolicy::Refuse, GrowthPolicy::Unknown);
        Eulerian::with_policy(physics(self.method.clone()), &self.particles, neighbors, stepper, steps, growth)
    }
}
