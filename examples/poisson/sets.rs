//! The particle sets: boundary particles exactly on the boundary, with their normals; the others scattered inside.

use parops::{BoundaryCondition, Particles, Random};

/// Largest displacement along an axis, in units of h: inside, and along the sides of the square.
const JITTER: f64 = 0.3;
/// Least distance of inner particles from the boundary, in units of h.
const CLEAR: f64 = 0.5;
const SEED: u64 = 11;
const HOLE: [f64; 2] = [0.55, 0.45];
const HOLE_RADIUS: f64 = 0.2;

/// Particles, and what is asked for at those on the boundary.
pub struct Scattered<const D: usize> {
    pub h: f64,
    pub particles: Particles<D>,
    pub conditions: Vec<Boundary<D>>,
}

/// A boundary particle with its outward unit normal; the normal derivative is given there, or else the value.
pub struct Boundary<const D: usize> {
    pub condition: BoundaryCondition<D>,
    pub normal: Option<[f64; D]>,
}

struct Builder<const D: usize> {
    points: Vec<[f64; D]>,
    conditions: Vec<Boundary<D>>,
}

impl<const D: usize> Builder<D> {
    fn value(&mut self, x: [f64; D]) {
        let condition = BoundaryCondition::dirichlet(self.points.len());
        self.conditions.push(Boundary { condition, normal: None });
        self.points.push(x);
    }

    fn slope(&mut self, x: [f64; D], normal: [f64; D]) {
        let condition = BoundaryCondition::neumann(self.points.len(), normal);
        self.conditions.push(Boundary { condition, normal: Some(normal) });
        self.points.push(x);
    }

    /// The points of a lattice of n + 1 points per axis over the box, jittered, where `inside` says so.
    fn fill(&mut self, lower: f64, h: f64, n: usize, random: &mut Random, inside: impl Fn(&[f64; D]) -> bool) {
        for number in 0..(n + 1).pow(D as u32) {
            let mut rest = number;
            let x = std::array::from_fn(|_| {
                let i = rest % (n + 1);
                rest /= n + 1;
                lower + h * (i as f64 + JITTER * (2.0 * random.uniform() - 1.0))
            });
            if inside(&x) {
                self.points.push(x);
            }
        }
    }

    fn finish(self, h: f64) -> parops::Result<Scattered<D>> {
        Ok(Scattered { h, particles: Particles::new(self.points)?, conditions: self.conditions })
    }
}

/// The unit square without a disc: u is given left and right and at the corners, du/dn below, above and at the disc.
pub fn square_with_hole(n: usize) -> parops::Result<Scattered<2>> {
    let h = 1.0 / n as f64;
    let mut random = Random::new(SEED);
    let mut set = Builder { points: Vec::new(), conditions: Vec::new() };
    for x in [0.0, 1.0] {
        set.value([x, 0.0]);
        set.value([x, 1.0]);
    }
    for i in 1..n {
        let mut along = || h * (i as f64 + JITTER * (2.0 * random.uniform() - 1.0));
        let places = [along(), along(), along(), along()];
        set.value([0.0, places[0]]);
        set.value([1.0, places[1]]);
        set.slope([places[2], 0.0], [0.0, -1.0]);
        set.slope([places[3], 1.0], [0.0, 1.0]);
    }
    let around = (std::f64::consts::TAU * HOLE_RADIUS / h).round();
    for i in 0..around as usize {
        let angle = std::f64::consts::TAU / around * (i as f64 + JITTER * (2.0 * random.uniform() - 1.0));
        let (sin, cos) = angle.sin_cos();
        set.slope([HOLE[0] + HOLE_RADIUS * cos, HOLE[1] + HOLE_RADIUS * sin], [-cos, -sin]);
    }
    set.fill(0.0, h, n, &mut random, |x| {
        let wall = x.iter().fold(f64::INFINITY, |wall: f64, x| wall.min(*x).min(1.0 - x));
        let hole = (x[0] - HOLE[0]).hypot(x[1] - HOLE[1]) - HOLE_RADIUS;
        wall.min(hole) >= CLEAR * h
    });
    set.finish(h)
}

/// The ball of radius 1/2 around 0: u is given on the upper half of the sphere, du/dn on the lower one. The points of
/// the sphere lie on a spiral, each with the area h^2.
pub fn ball(n: usize) -> parops::Result<Scattered<3>> {
    const RADIUS: f64 = 0.5;
    let h = 2.0 * RADIUS / n as f64;
    let mut random = Random::new(SEED);
    let mut set = Builder { points: Vec::new(), conditions: Vec::new() };
    let count = (4.0 * std::f64::consts::PI * (RADIUS / h).powi(2)).round();
    let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    for i in 0..count as usize {
        let z = 1.0 - (2.0 * i as f64 + 1.0) / count;
        let (across, (sin, cos)) = ((1.0 - z * z).sqrt(), (golden * i as f64).sin_cos());
        let normal = [across * cos, across * sin, z];
        let x = normal.map(|n| RADIUS * n);
        if z > 0.0 { set.value(x) } else { set.slope(x, normal) }
    }
    set.fill(-RADIUS, h, n, &mut random, |x| {
        let distance = x.iter().map(|x| x * x).sum::<f64>().sqrt();
        distance <= RADIUS - CLEAR * h
    });
    set.finish(h)
}
