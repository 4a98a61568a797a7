//! What metamorphic relations are tried on, drawn in one to three dimensions: an operator and its order, a set with some
//! of its particles as targets, and one cutoff for all or the nearest neighbors of each.

use parops::{
    BruteForce, Cutoff, DcPse, Domain, Expression, MultiIndex, Nearest, Neighbors, Particles, Random, Rows, Selected,
    Sign, graded,
};

/// Particles along an axis by dimension: a stencil at a corner has its 2 l within the set, on a torus within half of it.
pub const OPEN: [usize; 3] = [20, 10, 7];
pub const TORUS: [usize; 3] = [20, 12, 9];
/// Rows looked at in a case.
pub const TARGETS: [usize; 3] = [20, 16, 8];
/// Derivatives to this degree, and orders to 4.
const DEGREES: [u32; 3] = [3, 3, 2];
/// Volume of the unit ball.
const BALL: [f64; 3] = [2.0, std::f64::consts::PI, 4.188_790_204_786_391];

/// Multiples of 2^-20: translations by such, and images in a box of width 1 or 2, are exact.
fn on_grid(x: f64) -> f64 {
    (x * 1048576.0).floor() / 1048576.0
}

pub fn between(random: &mut Random, low: f64, high: f64) -> f64 {
    low + (high - low) * random.uniform()
}

pub fn below(random: &mut Random, count: usize) -> usize {
    (random.uniform() * count as f64) as usize
}

/// One discretization.
#[derive(Clone, Copy, Debug)]
pub struct Choice<const D: usize> {
    pub beta: MultiIndex<D>,
    pub order: u32,
    pub minus: bool,
}

impl<const D: usize> Choice<D> {
    pub fn draw(random: &mut Random) -> Self {
        let betas: Vec<MultiIndex<D>> = graded(0, DEGREES[D - 1]).collect();
        let beta = betas[below(random, betas.len())];
        Self { beta, order: 1 + below(random, 4) as u32, minus: random.bits().is_multiple_of(2) }
    }

    pub fn degree(&self) -> i32 {
        self.beta.degree() as i32
    }

    pub fn method(&self) -> DcPse<Expression<D>> {
        let operator = Expression::new([(self.beta, 1.0)]).unwrap();
        let sign = if self.minus { Sign::Minus } else { Sign::Plus };
        DcPse::at_order(operator, self.order).unwrap().sign(sign)
    }

    /// Whether f_p stands in no row but as f_q - f_p.
    pub fn is_difference(&self) -> bool {
        self.degree() > 0 && (self.minus || self.degree() % 2 == 0)
    }

    /// The radius, in spacings, of a ball that holds the neighbors a row needs in 1/2^D of it, and a layer more.
    pub fn radius(&self) -> f64 {
        2.0 * (self.needed() as f64 / BALL[D - 1]).powf(1.0 / D as f64) + 1.0
    }

    pub fn needed(&self) -> usize {
        self.method().fewest_neighbors::<D>().unwrap()
    }
}

/// Jittered particles in the unit cube, some of them targets, and what is made of them.
#[derive(Clone, Debug)]
pub struct Set<const D: usize> {
    pub choice: Choice<D>,
    pub points: Vec<[f64; D]>,
    pub targets: Vec<usize>,
    /// Good for every row.
    pub cutoff: f64,
    /// The nearest neighbors of each are taken in place of those within the cutoff.
    pub nearest: bool,
    pub fields: [Vec<f64>; 2],
}

impl<const D: usize> Set<D> {
    pub fn draw(random: &mut Random) -> Self {
        let choice = Choice::draw(random);
        let points = jittered(OPEN[D - 1], random);
        let cutoff = (choice.radius() + random.uniform()) / OPEN[D - 1] as f64;
        let targets = (0..TARGETS[D - 1]).map(|_| below(random, points.len())).collect();
        let mut field = || points.iter().map(|_| random.normal()).collect();
        let fields = [field(), field()];
        Self { choice, points, targets, cutoff, nearest: random.bits().is_multiple_of(2), fields }
    }

    pub fn particles(&self) -> Particles<D> {
        Particles::new(self.points.clone()).unwrap()
    }

    pub fn brute_force(&self) -> BruteForce<D> {
        BruteForce::build(&self.particles(), &Domain::open(), Cutoff(self.cutoff)).unwrap()
    }

    pub fn rows(&self) -> Rows {
        if !self.nearest {
            return self.assemble(self.brute_force());
        }
        // Its rows stand in the order of its cells, which no relation keeps.
        self.assemble(Nearest::build(&self.particles(), &Domain::open(), self.choice.needed()).unwrap().canonical())
    }

    pub fn assemble(&self, provider: impl Neighbors<D>) -> Rows {
        self.choice.method().assemble(&Selected::new(provider, &self.targets).unwrap()).unwrap()
    }

    pub fn map(&self, map: impl Fn(&[f64; D]) -> [f64; D], scale: f64) -> Self {
        let points = self.points.iter().map(map).collect();
        Self { points, cutoff: self.cutoff * scale, ..self.clone() }
    }

    /// How many times eps cond a weight may move where every position x is rounded anew: by eps |x|, and a moment feels
    /// that as eps |x|/h, however small cond is; |x| <= 1 here.
    pub fn rounded(&self) -> f64 {
        1.0 + OPEN[D - 1] as f64
    }
}

pub fn jittered<const D: usize>(side: usize, random: &mut Random) -> Vec<[f64; D]> {
    let jittered = Particles::<D>::jittered([0.0; D], [1.0; D], [side; D], 0.3, random.bits()).unwrap();
    jittered.points().iter().map(|x| x.map(on_grid)).collect()
}
