//! The scene by one method on one set, from t = 0 to the end.

use parops::{
    AdvectionDiffusion, Carried, CellList, DcPse, Eulerian, Lagrangian, Lambda, Laplacian, Ledger, Mesh, MeshKernel,
    Method as Discretization, Neighbors, Particles, Pse, Remeshing, Result, Rk4, StepPolicy, Transport, Trigger,
    UpwindGradient,
};

use crate::exact::{DIFFUSIVITY, exact, velocity};
use crate::scattered::{Gammas, nearest, scattered, stabilized, torus};

/// A way to solve the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Method {
    /// Particles that stay, scattered: advection from upwind to order 1, diffusion by DC-PSE of order 2.
    Upwind,
    /// Particles that stay, scattered: DC-PSE of order 2 or 4 for both, with hyperviscosity.
    DcPse(u32),
    /// Particles that move: PSE of order 2 or 4, remeshed by Lambda_{2,2} or Lambda_{4,4} after every step.
    Moving(u32),
}

impl Method {
    pub const ALL: [Self; 5] = [Self::Upwind, Self::DcPse(2), Self::DcPse(4), Self::Moving(2), Self::Moving(4)];

    pub fn name(self) -> String {
        match self {
            Self::Upwind => "upwind".into(),
            Self::DcPse(order) => format!("DC-PSE r = {order}"),
            Self::Moving(order) => format!("Lagrangian r = {order}"),
        }
    }

    pub fn order(self) -> u32 {
        match self {
            Self::Upwind => 1,
            Self::DcPse(order) | Self::Moving(order) => order,
        }
    }
}

/// When runs end.
pub const END: f64 = 0.5;
/// The step of a run over the longest that is legal at its start: the velocity changes.
const SAFETY: f64 = 0.9;
/// Steps of particles that move, in h: as many steps in proportion on every set.
const STEP: f64 = 0.625;
/// epsilon/h of PSE.
const OVERLAP: f64 = 1.5;
/// Moments that are kept beside the start.
const KEPT: u32 = 4;

/// The particles and their values at a time.
pub struct Moment {
    pub t: f64,
    pub particles: Particles<2>,
    pub u: Vec<f64>,
}

impl Moment {
    pub fn errors(&self) -> Vec<f64> {
        self.particles.points().iter().zip(&self.u).map(|(x, u)| u - exact(x, self.t)).collect()
    }
}

/// A run: what it came to, and its ledger.
pub struct Solved {
    pub method: Method,
    pub n: usize,
    pub moments: Vec<Moment>,
    pub ledger: Ledger<2>,
    /// The largest numerical viscosity over D.
    pub viscosity: f64,
}

/// The scene with n particles along an axis.
pub fn solve(method: Method, n: usize, gammas: &Gammas) -> Result<Solved> {
    match method {
        Method::Upwind => {
            let set = scattered(n)?;
            let h = set.spacing()?;
            let upwind = UpwindGradient::new(h.epsilon(1.0)?, set.volumes()?);
            let cells = CellList::build(&set, &torus()?, upwind.cutoff())?;
            // Of the many neighbors of the upwind rows the window takes the nearest.
            fixed(method, n, &set, &cells, DcPse::<Laplacian<2>, 2>::new().epsilon(h.epsilon(1.4)?), upwind)
        }
        Method::DcPse(4) => central::<4>(method, n, gammas.fourth),
        Method::DcPse(_) => central::<2>(method, n, gammas.second),
        Method::Moving(4) => moving(method, n, Lambda::<4, 4>::new()?),
        Method::Moving(_) => moving(method, n, Lambda::<2, 2>::new()?),
    }
}

fn central<const R: u32>(method: Method, n: usize, gamma: f64) -> Result<Solved> {
    let set = scattered(n)?;
    let scheme = stabilized::<R>(n).gamma(gamma);
    fixed(method, n, &set, &nearest::<R>(&set)?, DcPse::<Laplacian<2>, R>::new(), scheme)
}

/// Particles that stay.
fn fixed<N: Neighbors<2>, L: Discretization<2, Out = [f64; 1]> + Clone, X: Transport<2>>(
    method: Method,
    n: usize,
    set: &Particles<2>,
    neighbors: &N,
    laplacian: L,
    scheme: X,
) -> Result<Solved> {
    let scene = AdvectionDiffusion::<2>::new().diffusion(DIFFUSIVITY, laplacian).advection(velocity, scheme);
    let mut run = Eulerian::new(scene, set, neighbors, Rk4::new())?;
    let mut u: Vec<f64> = set.points().iter().map(|x| exact(x, 0.0)).collect();
    let dt = SAFETY * run.longest_step(&u)?;
    let mut solved = Solved::new(method, n, set.clone(), u.clone());
    solved.viscosity = run.discrete().numerical_viscosity(0.0) / DIFFUSIVITY;
    for part in 1..=KEPT {
        let end = END * f64::from(part) / f64::from(KEPT);
        run.advance_with(&mut u, end, dt, |row, _| solved.ledger.push(row))?;
        solved.moments.push(Moment { t: end, particles: set.clone(), u: u.clone() });
    }
    Ok(solved)
}

/// Particles that move.
fn moving<K: MeshKernel<f64, S> + 'static, const S: usize>(method: Method, n: usize, kernel: K) -> Result<Solved> {
    let set = Particles::lattice([0.0; 2], [1.0; 2], [n; 2])?;
    let u: Vec<f64> = set.points().iter().map(|x| exact(x, 0.0)).collect();
    let h = set.spacing()?;
    let pse = Pse::new(Laplacian::<2>, method.order(), h.epsilon(OVERLAP)?, set.volumes()?)?;
    let scene = AdvectionDiffusion::<2>::new().diffusion(DIFFUSIVITY, pse).advection(velocity, Carried);
    let mesh = Mesh::cells(&torus()?, [n; 2])?;
    let remeshing = Remeshing { kernel, mesh, trigger: Trigger::Steps(1), threshold: 0.0 };
    let mut run = Lagrangian::new(scene, &set, &u, &torus()?, Rk4::new())?
        .step_policy(StepPolicy::Adapt { most: 20 })
        .remeshing(remeshing)?;
    let mut solved = Solved::new(method, n, set, u);
    for part in 1..=KEPT {
        let end = END * f64::from(part) / f64::from(KEPT);
        run.advance_with(end, STEP * h.0, |row, _| solved.ledger.push(row))?;
        solved.moments.push(Moment { t: end, particles: run.particles()?, u: run.values().collect() });
    }
    Ok(solved)
}
