//! How the error of DC-PSE rows falls with the spacing.
//!
//! The fields are plane waves exp(i kappa d . x), cosine and sine in several directions d. The error of a row on such a
//! wave has the same modulus wherever the row stands, so that no order depends on which part of a field the interior
//! particles of a coarse set happen to see. Errors are in units of kappa^|beta|.

use parops::{
    CellList, DcPse, Domain, Field, MultiIndex, Nearest, Neighbors, Operator, Particles, Random, Rows, graded,
};

use crate::sets::{Chosen, Set};

/// All derivatives of one degree, the K multi-indices in graded order: one factorization for all of them.
#[derive(Clone, Copy)]
pub struct OfDegree<const K: usize>(pub u32);

impl<const D: usize, const K: usize> Operator<D> for OfDegree<K> {
    type Out = [f64; K];

    fn terms(&self, term: &mut dyn FnMut(usize, MultiIndex<D>, f64)) {
        graded(self.0, self.0).enumerate().for_each(|(k, beta)| term(k, beta, 1.0));
    }
}

/// What is measured.
#[derive(Clone)]
pub struct Series {
    pub set: Set,
    /// One cutoff for all, `DcPse::cutoff`, in place of the 2 l nearest neighbors of each, whole shells; orders are then
    /// in that cutoff.
    pub even: bool,
    pub order: u32,
    /// Particles along an axis, the coarsest set first; the order is fitted over all.
    pub sides: Vec<usize>,
    /// kappa times the radius of a ball of 2 l particles on the coarsest set.
    pub wave: f64,
    /// Targets taken among particles that may touch a face and among the others, on every set.
    pub targets: usize,
    pub seeds: u64,
    /// Independent sets of equal spacing that the norms of one grid and seed are over: a set has few corners, which lead
    /// the norm over its faces.
    pub copies: u64,
    /// Whether particles whose stencil may touch a face are targets too.
    pub faces: bool,
}

/// Norms of the errors on one set, by output.
#[derive(Clone, Copy, Default)]
struct Norms {
    l2: f64,
    linf: f64,
}

/// Root mean squares over particles that stand for `weight` particles each.
#[derive(Clone, Default)]
struct Sum {
    weight: f64,
    squares: f64,
    largest: f64,
}

impl Sum {
    fn add(&mut self, weight: f64, square: f64) {
        self.weight += weight;
        self.squares += weight * square;
        self.largest = self.largest.max(square);
    }

    fn norms(&self) -> Norms {
        Norms { l2: (self.squares / self.weight).sqrt(), linf: self.largest.sqrt() }
    }
}

/// Errors and floors of one output, over interior and over face particles.
#[derive(Clone, Default)]
struct Sums {
    errors: [Sum; 2],
    floors: [Sum; 2],
    whole: Sum,
}

impl Sums {
    fn point(self, h: f64) -> Point {
        let [interior, face] = self.errors.map(|errors| errors.norms());
        Point { h, interior, face, whole: self.whole.norms(), floors: self.floors.map(|floor| floor.norms().l2) }
    }
}

/// One output on one grid.
#[derive(Clone, Copy, Default)]
struct Point {
    h: f64,
    interior: Norms,
    face: Norms,
    whole: Norms,
    /// Root mean square of the floors of interior and of face rows.
    floors: [f64; 2],
}

/// What was observed of one output: medians over the seeds.
#[derive(Clone, Copy, Debug)]
pub struct Observed {
    /// Orders in L2 and L-inf over particles whose stencil touches no face.
    pub interior: f64,
    pub interior_linf: f64,
    /// Order in L2 over the others, and over all.
    pub face: f64,
    pub whole: f64,
    /// Interior L2 error on the coarsest and on the finest set.
    pub errors: [f64; 2],
    /// The smallest L2 error, interior and face, over its round-off floor, eps sum |w| epsilon^-|beta|, of all sets and
    /// seeds.
    pub above_floor: f64,
}

/// What was observed of all outputs of an operator.
pub struct Outcome<const K: usize> {
    pub outputs: [Observed; K],
    /// Moment conditions, and neighbors of a row in the mean.
    pub conditions: usize,
    pub neighbors: f64,
    pub rows: usize,
    /// Rows of a widened support.
    pub grown: usize,
}

/// Measures an operator of K outputs of one degree with fields and weights of type T.
///
/// # Errors
/// What the library refuses.
pub fn observe<const D: usize, const K: usize, T: Field>(
    operator: impl Operator<D, Out = [f64; K]> + Clone,
    series: &Series,
) -> parops::Result<Outcome<K>> {
    let (mut terms, mut degree) = (Vec::new(), 0);
    operator.terms(&mut |k, beta, factor| {
        terms.push((k, beta, factor));
        degree = beta.degree();
    });
    let dcpse = DcPse::at_order(operator, series.order)?;
    let needed = dcpse.fewest_neighbors::<D>()?;
    let mut outcome =
        Outcome { outputs: [Observed::NONE; K], conditions: needed.div_ceil(2), neighbors: 0.0, rows: 0, grown: 0 };
    // A ball of radius 1 in units of its particles, spacing 1.
    let radius = (needed as f64 / [2.0, std::f64::consts::PI, 4.188_790_204_786_391][D - 1]).powf(1.0 / D as f64);
    let kappa = series.wave / radius * series.sides[0] as f64;
    let mut slopes: Vec<[[f64; 4]; K]> = Vec::new();
    for seed in 0..series.seeds {
        let mut points: Vec<[Point; K]> = Vec::new();
        for &side in &series.sides {
            let mut sums: [Sums; K] = std::array::from_fn(|_| Sums::default());
            let mut h = 0.0;
            for copy in 0..series.copies {
                let seed = seed * series.copies + copy;
                let particles = series.set.particles::<D>(side, seed)?;
                let (targets, weights) = stratified(&particles, radius, series, seed);
                let places: Vec<[f64; D]> = targets.iter().map(|&p| particles.points()[p]).collect();
                let target = Target { particles: &particles, targets: &targets, weights, terms: &terms, degree, kappa };
                if series.even {
                    let cutoff = dcpse.cutoff(&particles)?;
                    let cells = CellList::build_at(&places, &particles, &Domain::open(), cutoff)?;
                    target.measure::<K, T>(&dcpse, &Chosen::new(cells, targets.clone()), &mut sums, &mut outcome)?;
                    // The cutoff that serves every particle of a set is not quite in proportion to its spacing.
                    h += cutoff.0 / series.copies as f64;
                } else {
                    // A place finds its own particle too.
                    let nearest = Nearest::build_at(&places, &particles, &Domain::open(), needed + 1)?;
                    target.measure::<K, T>(&dcpse, &Chosen::new(nearest, targets.clone()), &mut sums, &mut outcome)?;
                    h = series.set.spacing::<D>(side, particles.len());
                }
            }
            points.push(sums.map(|sums| sums.point(h)));
        }
        let slope = |error: fn(&Point) -> f64, k: usize| slope(points.iter().map(|p| (p[k].h, error(&p[k]))));
        slopes.push(std::array::from_fn(|k| {
            [
                slope(|p| p.interior.l2, k),
                slope(|p| p.interior.linf, k),
                slope(|p| p.face.l2, k),
                slope(|p| p.whole.l2, k),
            ]
        }));
        for (k, observed) in outcome.outputs.iter_mut().enumerate() {
            for p in &points {
                let ratios = [p[k].interior.l2 / p[k].floors[0], p[k].face.l2 / p[k].floors[1]];
                observed.above_floor = ratios.into_iter().fold(observed.above_floor, f64::min);
            }
            observed.errors = [points[0][k].interior.l2, points[points.len() - 1][k].interior.l2];
        }
    }
    for (k, observed) in outcome.outputs.iter_mut().enumerate() {
        let median = |which: usize| {
            let mut values: Vec<f64> = slopes.iter().map(|slopes| slopes[k][which]).collect();
            values.sort_by(f64::total_cmp);
            values[values.len() / 2]
        };
        (observed.interior, observed.interior_linf) = (median(0), median(1));
        (observed.face, observed.whole) = (median(2), median(3));
    }
    outcome.neighbors /= outcome.rows as f64;
    Ok(outcome)
}

impl Observed {
    const NONE: Self = Self {
        interior: f64::NAN,
        interior_linf: f64::NAN,
        face: f64::NAN,
        whole: f64::NAN,
        errors: [f64::NAN; 2],
        above_floor: f64::INFINITY,
    };
}

/// Some of the particles farther from every face than the radius of a stencil, and some of the others; and how many
/// particles each stands for. All where there are no more.
fn stratified<const D: usize>(
    particles: &Particles<D>,
    radius: f64,
    series: &Series,
    seed: u64,
) -> (Vec<usize>, Vec<f64>) {
    let margin = radius * (particles.len() as f64).powf(-1.0 / D as f64);
    let central = |&p: &usize| particles.points()[p].iter().all(|x| x.min(1.0 - x) > margin);
    let (inner, outer): (Vec<usize>, Vec<usize>) = (0..particles.len()).partition(central);
    let mut random = Random::new(seed ^ 0x5eed);
    let (mut targets, mut weights) = (Vec::new(), Vec::new());
    for (mut stratum, limit) in [(inner, series.targets), (outer, if series.faces { series.targets } else { 0 })] {
        let count = stratum.len().min(limit);
        weights.resize(weights.len() + count, stratum.len() as f64 / count as f64);
        for i in 0..count {
            let rest = (stratum.len() - i) as f64;
            stratum.swap(i, i + (random.uniform() * rest) as usize);
        }
        targets.extend_from_slice(&stratum[..count]);
    }
    (targets, weights)
}

/// Directions of the waves: none along an axis, so that every derivative sees them.
fn directions<const D: usize>() -> Vec<[f64; D]> {
    let all: &[[f64; 3]] = match D {
        1 => &[[1.0, 0.0, 0.0]],
        2 => &[[0.92, 0.39, 0.0], [0.12, 0.99, 0.0], [-0.80, 0.60, 0.0]],
        _ => &[[0.77, 0.54, 0.34], [-0.56, 0.41, 0.72], [0.33, -0.78, 0.53], [0.61, 0.25, -0.75]],
    };
    all.iter().map(|d| std::array::from_fn(|axis| d[axis])).collect()
}

/// A set with some of its particles as targets, and the wave number.
struct Target<'a, const D: usize> {
    particles: &'a Particles<D>,
    targets: &'a [usize],
    weights: Vec<f64>,
    terms: &'a [(usize, MultiIndex<D>, f64)],
    degree: u32,
    kappa: f64,
}

impl<const D: usize> Target<'_, D> {
    fn measure<const K: usize, T: Field>(
        &self,
        dcpse: &DcPse<impl Operator<D, Out = [f64; K]>>,
        neighbors: &impl Neighbors<D>,
        sums: &mut [Sums; K],
        outcome: &mut Outcome<K>,
    ) -> parops::Result<()> {
        let rows: Rows<[f64; K], T> = Rows::assemble(dcpse, neighbors)?;
        outcome.grown += rows.report().grown;
        let squares = self.squares(&rows)?;
        for (i, &p) in self.targets.iter().enumerate() {
            let cutoff = neighbors.cutoff(i);
            let inside = self.particles.points()[p].iter().all(|x| x - cutoff >= 0.0 && x + cutoff <= 1.0);
            let Some(row) = rows.row(i) else { continue };
            outcome.rows += 1;
            outcome.neighbors += row.sources.len() as f64;
            for (k, sum) in sums.iter_mut().enumerate() {
                let size = |w: &[T]| -> f64 { w[k].abs().as_() };
                let gain = row.weights.iter().fold(size(row.diagonal.as_ref()), |sum, w| sum + size(w.as_ref()));
                let epsilon: f64 = T::default_epsilon().as_();
                let floor = (epsilon * gain * self.kappa.powi(-(self.degree as i32))).powi(2);
                let region = usize::from(!inside);
                sum.errors[region].add(self.weights[i], squares[i][k]);
                sum.floors[region].add(self.weights[i], floor);
                sum.whole.add(self.weights[i], squares[i][k]);
            }
        }
        Ok(())
    }

    /// The squared modulus of the error of every row and output, the mean over the directions.
    fn squares<const K: usize, T: Field>(&self, rows: &Rows<[f64; K], T>) -> parops::Result<Vec<[f64; K]>> {
        let mut squares = vec![[0.0; K]; self.targets.len()];
        let mut out = vec![[T::zero(); K]; self.targets.len()];
        let directions = directions::<D>();
        for d in &directions {
            let mut symbol = [0.0; K];
            self.terms.iter().for_each(|&(k, beta, factor)| symbol[k] += factor * beta.power(d));
            let phase = |x: &[f64; D]| self.kappa * x.iter().zip(d).map(|(x, d)| x * d).sum::<f64>();
            for quarter in [0.0, 1.0] {
                // Every derivative turns the wave by a quarter.
                let wave = |x: &[f64; D], turns: f64| (phase(x) + std::f64::consts::FRAC_PI_2 * turns).cos();
                let f: Vec<T> = self.particles.points().iter().map(|x| T::lift(wave(x, quarter))).collect();
                rows.apply_all(&f, &mut out)?;
                for ((&p, out), squares) in self.targets.iter().zip(&out).zip(&mut squares) {
                    let exact = wave(&self.particles.points()[p], quarter + f64::from(self.degree));
                    for k in 0..K {
                        let found: f64 = out[k].as_();
                        let error = found * self.kappa.powi(-(self.degree as i32)) - symbol[k] * exact;
                        squares[k] += error * error / directions.len() as f64;
                    }
                }
            }
        }
        Ok(squares)
    }
}

/// Slope of the logarithm of an error over ln h by least squares.
fn slope(points: impl Iterator<Item = (f64, f64)>) -> f64 {
    let points: Vec<(f64, f64)> = points.map(|(h, error)| (h.ln(), error.ln())).collect();
    let count = points.len() as f64;
    let (mx, my) = points.iter().fold((0.0, 0.0), |(mx, my), (x, y)| (mx + x / count, my + y / count));
    let (xy, xx) =
        points.iter().fold((0.0, 0.0), |(xy, xx), (x, y)| (xy + (x - mx) * (y - my), xx + (x - mx) * (x - mx)));
    xy / xx
}
