//! Eulerian runs against manufactured solutions: periodic, a box with boundary rows, discs and balls; orders in space, and in
//! time on a frozen set.

use std::f64::consts::TAU;

use parops::{
    AdvectionDiffusion, Boundary, BoundaryCondition, DcPse, Domain, Eulerian, Gradient, GrowthPolicy, Laplacian,
    Nearest, Particles, Random, Result, Rk4, Steady, StepPolicy, testing::Promise,
};

/// The observed order may miss the design order by this on periodic sets.
const PERIODIC: f64 = 0.1;
/// It may be this much lower where there are boundaries. There truncation errors of order r, whose factors are larger as
/// stencils are wider by as much as twice, act on a layer of some h, and values at walls miss by order r + 1: together an
/// error of order r + 1 beside that of order r from within, so that orders are between r and r + 1.
const BOUNDED: f64 = 0.3;
const D0: f64 = 0.05;

/// Least-squares slope of log error over log h.
pub fn order(errors: &[(f64, f64)]) -> f64 {
    let logs: Vec<_> = errors.iter().map(|(h, e)| (h.ln(), e.ln())).collect();
    let n = logs.len() as f64;
    let (x, y) = logs.iter().fold((0.0, 0.0), |(a, b), (x, y)| (a + x / n, b + y / n));
    let (xy, xx) = logs.iter().fold((0.0, 0.0), |(a, b), (u, v)| (a + (u - x) * (v - y), b + (u - x) * (u - x)));
    xy / xx
}

/// Root mean square of the difference from the exact values.
fn rms<const D: usize>(points: &[[f64; D]], u: &[f64], exact: impl Fn(&[f64; D]) -> f64) -> f64 {
    let sum: f64 = points.iter().zip(u).map(|(x, u)| (u - exact(x)).powi(2)).sum();
    (sum / points.len() as f64).sqrt()
}

/// u = 2 + sin(2 pi k x_0 - t) prod_i cos(2 pi k x_i) with its derivatives: value, du/dt, gradient, Laplacian.
struct Wave {
    k: f64,
}

impl Wave {
    fn value<const D: usize>(&self, x: &[f64; D], t: f64) -> f64 {
        2.0 + self.product(x, t, usize::MAX)
    }

    /// The product with the factor of one axis differentiated.
    fn product<const D: usize>(&self, x: &[f64; D], t: f64, along: usize) -> f64 {
        let k = TAU * self.k;
        (0..D).fold(1.0, |product, i| {
            let phase = k * x[i] - if i == 0 { t } else { 0.0 };
            let (sin, cos) = phase.sin_cos();
            product
                * match (i == 0, i == along) {
                    (true, false) => sin,
                    (true, true) => k * cos,
                    (false, false) => cos,
                    (false, true) => -k * sin,
                }
        })
    }

    fn gradient<const D: usize>(&self, x: &[f64; D], t: f64) -> [f64; D] {
        std::array::from_fn(|i| self.product(x, t, i))
    }

    fn laplacian<const D: usize>(&self, x: &[f64; D], t: f64) -> f64 {
        -(D as f64) * (TAU * self.k).powi(2) * self.product(x, t, usize::MAX)
    }

    fn rate<const D: usize>(&self, x: &[f64; D], t: f64) -> f64 {
        -self.product(x, t, 0) / (TAU * self.k)
    }

    /// du/dt + v . grad u - D lap u, for a solenoidal v.
    fn source<const D: usize>(&self, x: &[f64; D], t: f64, v: &[f64; D]) -> f64 {
        let along: f64 = self.gradient(x, t).iter().zip(v).map(|(g, v)| g * v).sum();
        self.rate(x, t) + along - D0 * self.laplacian(x, t)
    }
}

/// A solenoidal flow, periodic on the unit cube; the third axis is idle.
fn flow<const D: usize>(x: &[f64; D]) -> [f64; D] {
    let (a, b) = ((TAU * x[0]).sin_cos(), (TAU * x[1]).sin_cos());
    let mut v = [0.3; D];
    (v[0], v[1]) = (0.5 * a.0 * b.1, -0.5 * a.1 * b.0);
    v
}

fn periodic<const D: usize, const R: u32>(sizes: [usize; 4], k: usize, jitter: f64) -> Result<f64> {
    const END: f64 = 0.02;
    let wave = Wave { k: 1.0 };
    let mut errors = Vec::new();
    for m in sizes {
        let particles = Particles::jittered([0.0; D], [1.0; D], [m; D], jitter, 3)?;
        let neighbors = Nearest::build(&particles, &Domain::periodic([0.0; D], [1.0; D])?, k)?;
        let scene = AdvectionDiffusion::<D>::new()
            .diffusion(D0, DcPse::<Laplacian<D>, R>::new())
            .advection(Steady(flow::<D>), DcPse::<Gradient<D>, R>::new())
            .source(|x, t, _| Wave { k: 1.0 }.source(x, t, &flow(x)));
        // The estimate of growth costs as many products as hundreds of steps.
        let (steps, growth) = (StepPolicy::Refuse, GrowthPolicy::Unknown);
        let mut run = Eulerian::with_policy(scene, &particles, &neighbors, Rk4::new(), steps, growth)?;
        let mut u: Vec<f64> = particles.points().iter().map(|x| wave.value(x, 0.0)).collect();
        let dt = run.limits(&u)?.step(&Rk4::<Vec<f64>>::new());
        run.advance(&mut u, END, dt.min(END / 4.0))?;
        errors.push((1.0 / m as f64, rms(particles.points(), &u, |x| wave.value(x, END))));
    }
    Ok(order(&errors))
}

fn promised(text: &'static str) -> Promise {
    Promise::new("Orders", text)
}

#[test]
fn dcpse_has_its_order_on_periodic_sets_in_2d() -> Result<()> {
    let second = periodic::<2, 2>([24, 34, 48, 68], 20, 0.2)?;
    let fourth = periodic::<2, 4>([24, 34, 48, 68], 42, 0.2)?;
    promised("Eulerian runs in 2D, r = 2").within(2.0 - PERIODIC, 2.0 + PERIODIC, second);
    promised("Eulerian runs in 2D, r = 4").within(4.0 - PERIODIC, 4.0 + PERIODIC, fourth);
    Ok(())
}

#[test]
fn dcpse_has_its_order_on_periodic_sets_in_3d() -> Result<()> {
    let second = periodic::<3, 2>([14, 18, 23, 29], 40, 0.2)?;
    let fourth = periodic::<3, 4>([18, 21, 25, 29], 112, 0.2)?;
    promised("Eulerian runs in 3D, r = 2").within(2.0 - PERIODIC, 2.0 + PERIODIC, second);
    promised("Eulerian runs in 3D, r = 4").within(4.0 - PERIODIC, 4.0 + PERIODIC, fourth);
    Ok(())
}

/// A set with boundary particles exactly on the boundary, each with its outward normal.
struct Scattered<const D: usize> {
    h: f64,
    particles: Particles<D>,
    normals: Vec<[f64; D]>,
}

/// Scattered points of the cube [-1/2, 1/2]^D where `depth`, the distance from the boundary, is at least h/2, behind the
/// boundary points given with their normals.
fn scattered<const D: usize>(
    m: usize,
    boundary: Vec<([f64; D], [f64; D])>,
    depth: impl Fn(&[f64; D]) -> f64,
) -> Result<Scattered<D>> {
    let h = 1.0 / m as f64;
    let mut random = Random::new(7);
    let (mut points, normals): (Vec<_>, Vec<_>) = boundary.into_iter().unzip();
    for number in 0..(m + 1).pow(D as u32) {
        let mut rest = number;
        let x: [f64; D] = std::array::from_fn(|_| {
            let i = rest % (m + 1);
            rest /= m + 1;
            h * (i as f64 + 0.2 * (2.0 * random.uniform() - 1.0)) - 0.5
        });
        if depth(&x) >= 0.5 * h {
            points.push(x);
        }
    }
    Ok(Scattered { h, particles: Particles::new(points)?, normals })
}

fn square(m: usize) -> Result<Scattered<2>> {
    let mut boundary = Vec::new();
    for i in 0..m {
        let s = i as f64 / m as f64 - 0.5;
        let corner = if i == 0 { 0.5_f64.sqrt() } else { 0.0 };
        let normal = |n: [f64; 2], next: [f64; 2]| {
            if i == 0 { [n[0] * corner + next[0] * corner, n[1] * corner + next[1] * corner] } else { n }
        };
        boundary.push(([s, -0.5], normal([0.0, -1.0], [-1.0, 0.0])));
        boundary.push(([0.5, s], normal([1.0, 0.0], [0.0, -1.0])));
        boundary.push(([-s, 0.5], normal([0.0, 1.0], [1.0, 0.0])));
        boundary.push(([-0.5, -s], normal([-1.0, 0.0], [0.0, 1.0])));
    }
    scattered(m, boundary, |x| x.iter().fold(0.5, |depth: f64, x| depth.min(0.5 - x.abs())))
}

fn disc(m: usize) -> Result<Scattered<2>> {
    let count = (std::f64::consts::PI * m as f64).round();
    let around = (0..count as usize).map(|i| {
        let (sin, cos) = (TAU * i as f64 / count).sin_cos();
        ([0.5 * cos, 0.5 * sin], [cos, sin])
    });
    scattered(m, around.collect(), |x| 0.5 - x[0].hypot(x[1]))
}

/// The points of the sphere lie on a spiral, each with the area h^2.
fn ball(m: usize) -> Result<Scattered<3>> {
    let count = (std::f64::consts::PI * (m * m) as f64).round();
    let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    let around = (0..count as usize).map(|i| {
        let z = 1.0 - (2.0 * i as f64 + 1.0) / count;
        let (across, (sin, cos)) = ((1.0 - z * z).sqrt(), (golden * i as f64).sin_cos());
        let normal = [across * cos, across * sin, z];
        (normal.map(|n| 0.5 * n), normal)
    });
    scattered(m, around.collect(), |x| 0.5 - x.iter().map(|x| x * x).sum::<f64>().sqrt())
}

/// Rigid rotation: tangential at discs and balls, through the sides of the square.
fn turning<const D: usize>(x: &[f64; D]) -> [f64; D] {
    let mut v = [0.0; D];
    (v[0], v[1]) = (-x[1], x[0]);
    v
}

/// Which condition stands at a boundary particle: values on the upper half, and below them fluxes and mixtures in turns.
fn condition<const D: usize>(p: usize, x: &[f64; D], normal: [f64; D]) -> BoundaryCondition<D> {
    match (x[1] > 0.0, p % 2) {
        (true, _) => BoundaryCondition::dirichlet(p),
        (false, 0) => BoundaryCondition::neumann(p, normal),
        (false, _) => BoundaryCondition::robin(p, normal, 1.0, 1.0),
    }
}

fn bounded<const D: usize, const R: u32>(
    sizes: [usize; 4],
    k: usize,
    make: impl Fn(usize) -> Result<Scattered<D>>,
) -> Result<f64> {
    const END: f64 = 0.02;
    let mut errors = Vec::new();
    for m in sizes {
        let Scattered { h, particles, normals } = make(m)?;
        let points = particles.points().to_vec();
        let neighbors = Nearest::build(&particles, &Domain::open(), k)?;
        let conditions = normals.iter().enumerate().map(|(p, normal)| condition(p, &points[p], *normal));
        let value = {
            let normals = normals.clone();
            move |p: usize, x: &[f64; D], t: f64| {
                let wave = Wave { k: 0.75 };
                let (a, b) = condition(p, x, normals[p]).factors();
                let slope: f64 = wave.gradient(x, t).iter().zip(&normals[p]).map(|(g, n)| g * n).sum();
                a * wave.value(x, t) + b * slope
            }
        };
        let scene = AdvectionDiffusion::<D>::new()
            .diffusion(D0, DcPse::<Laplacian<D>, R>::new())
            .advection(Steady(turning::<D>), DcPse::<Gradient<D>, R>::new())
            .source(|x, t, _| Wave { k: 0.75 }.source(x, t, &turning(x)))
            .boundary(Boundary::new(R).conditions(conditions), value);
        let mut run = Eulerian::new(scene, &particles, &neighbors, Rk4::new())?;
        let wave = Wave { k: 0.75 };
        let mut u: Vec<f64> = points.iter().map(|x| wave.value(x, 0.0)).collect();
        let dt = run.limits(&u)?.step(&Rk4::<Vec<f64>>::new());
        run.advance(&mut u, END, dt.min(END / 4.0))?;
        errors.push((h, rms(&points, &u, |x| wave.value(x, END))));
    }
    Ok(order(&errors))
}

/// Between r and r + 1.
fn within(text: &'static str, r: f64, found: f64) {
    println!("{text}: {found:.3}");
    promised(text).within(r - BOUNDED, r + 1.0 + PERIODIC, found);
}

#[test]
fn dcpse_keeps_its_order_in_a_box_with_boundary_rows() -> Result<()> {
    let second = bounded::<2, 2>([16, 23, 32, 45], 20, square)?;
    let fourth = bounded::<2, 4>([16, 23, 32, 45], 44, square)?;
    within("Eulerian runs in a box with boundary rows, r = 2", 2.0, second);
    within("Eulerian runs in a box with boundary rows, r = 4", 4.0, fourth);
    Ok(())
}

#[test]
fn dcpse_keeps_its_order_in_a_disc() -> Result<()> {
    let second = bounded::<2, 2>([16, 23, 32, 45], 20, disc)?;
    let fourth = bounded::<2, 4>([16, 23, 32, 45], 44, disc)?;
    within("Eulerian runs in a disc with boundary rows, r = 2", 2.0, second);
    within("Eulerian runs in a disc with boundary rows, r = 4", 4.0, fourth);
    Ok(())
}

#[test]
fn dcpse_keeps_its_order_in_a_ball() -> Result<()> {
    let second = bounded::<3, 2>([10, 13, 17, 22], 44, ball)?;
    let fourth = bounded::<3, 4>([11, 13, 16, 19], 120, ball)?;
    within("Eulerian runs in a ball with boundary rows, r = 2", 2.0, second);
    within("Eulerian runs in a ball with boundary rows, r = 4", 4.0, fourth);
    Ok(())
}
