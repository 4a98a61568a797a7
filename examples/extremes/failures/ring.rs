//! u_t + (v u)_x = 0 on a ring, v = mean + amplitude sin x: moving particles, remeshed or not, and a naive remeshing.

use std::f64::consts::TAU;

use parops::{
    AdvectionDiffusion, Carried, Domain, Lagrangian, Lambda, Mesh, MeshKernel, MovingScene, MovingState, Particles,
    Remeshing, Result, Rk4, Steady, Trigger,
};

pub fn domain() -> Result<Domain<1>> {
    Domain::periodic([0.0], [TAU])
}

/// The field at the start.
pub fn start(x: f64) -> f64 {
    x.sin().exp()
}

/// Runs of this module are of one type.
pub trait Ring: MovingScene<1, Value = f64> {}

impl<S: MovingScene<1, Value = f64>> Ring for S {}

fn scene(mean: f64, amplitude: f64) -> impl Ring {
    AdvectionDiffusion::<1>::new()
        .advection(Steady(move |x: &[f64; 1]| [mean + amplitude * x[0].sin()]), Carried)
        .divergence(move |x: &[f64; 1], _: f64| amplitude * x[0].cos())
}

/// n particles with the field of the start.
pub fn run(n: usize, mean: f64, amplitude: f64) -> Result<Lagrangian<1, impl Ring, Rk4<MovingState<1, f64>>>> {
    run_from(n, mean, amplitude, start)
}

/// n particles on the nodes of the mesh.
pub fn run_from(
    n: usize,
    mean: f64,
    amplitude: f64,
    u: impl Fn(f64) -> f64,
) -> Result<Lagrangian<1, impl Ring, Rk4<MovingState<1, f64>>>> {
    let mesh = mesh(n)?;
    let particles = Particles::new(mesh.points().collect())?.with_equal_volumes(TAU)?;
    let u: Vec<f64> = particles.points().iter().map(|x| u(x[0])).collect();
    Lagrangian::new(scene(mean, amplitude), &particles, &u, &domain()?, Rk4::new())
}

pub fn mesh(n: usize) -> Result<Mesh<1>> {
    Mesh::nodes(&domain()?, [n])
}

/// Remeshing with Lambda_{4,2} after every step.
pub fn each_step(n: usize) -> Result<Remeshing<1, Lambda<4, 2>>> {
    Ok(Remeshing { kernel: Lambda::new()?, mesh: mesh(n)?, trigger: Trigger::Steps(1), threshold: 0.0 })
}

fn rk4(x: f64, dt: f64, v: impl Fn(f64) -> f64) -> f64 {
    let a = v(x);
    let b = v(x + 0.5 * dt * a);
    let c = v(x + 0.5 * dt * b);
    let d = v(x + dt * c);
    x + dt / 6.0 * (a + 2.0 * b + 2.0 * c + d)
}

/// Where a particle of the flow 1 + 0.5 sin x was a time t before.
fn origin(x: f64, t: f64) -> f64 {
    const STEPS: u32 = 200;
    (0..STEPS).fold(x, |x, _| rk4(x, -t / f64::from(STEPS), |x| 1.0 + 0.5 * x.sin()))
}

/// u(x, t) for v = 1 + 0.5 sin x: v u is carried unchanged.
pub fn exact(x: f64, t: f64) -> f64 {
    let (v, from) = (|x: f64| 1.0 + 0.5 * x.sin(), origin(x, t));
    start(from) * v(from) / v(x)
}

/// What a naive remeshing leaves on the nodes: each step moves them by RK4 and deposits their strengths again, whatever dt.
pub struct Naive {
    pub u: Vec<f64>,
    /// sum of strengths over that of the start, less 1.
    pub drift: f64,
}

pub fn naive(n: usize, mean: f64, amplitude: f64, dt: f64, steps: usize, u: impl Fn(f64) -> f64) -> Result<Naive> {
    let (h, kernel) = (TAU / n as f64, Lambda::<4, 2>::new()?);
    let mut values: Vec<f64> = (0..n).map(|i| u(i as f64 * h)).collect();
    let before: f64 = values.iter().sum();
    for _ in 0..steps {
        let mut next = vec![0.0; n];
        for (i, u) in values.iter().enumerate() {
            let s = rk4(i as f64 * h, dt, |x| mean + amplitude * x.sin()) / h;
            let cell = s.floor();
            let weights: [f64; 6] = kernel.weights(s - cell - 0.5);
            for (k, w) in weights.iter().enumerate() {
                next[(cell as i64 + k as i64 - 2).rem_euclid(n as i64) as usize] += w * u;
            }
        }
        values = next;
    }
    let drift = values.iter().sum::<f64>() / before - 1.0;
    Ok(Naive { u: values, drift })
}
