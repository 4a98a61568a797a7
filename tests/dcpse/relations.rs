//! Metamorphic relations of DC-PSE: what a change of the input must do to its rows, without exact answers.
//!
//! A weight is moved by rounding as its moment system is conditioned: bounds are multiples of cond eps, cond the largest
//! estimate of all rows, in units of the row's own sum of absolute weights.

use crate::cases::cases;
use crate::properties::properties;
use parops::{
    Apply, BruteForce, CellList, Cutoff, DcPse, Domain, Expression, Gradient, Laplacian, MultiIndex, Nearest,
    Neighbors, Particles, Random, Row, Rows, Sign, testing::Promise,
};
use proptest::prelude::*;

/// Particles along an axis.
const SIDE: usize = 7;
const N: usize = SIDE * SIDE;

/// One discretization.
#[derive(Clone, Copy, Debug)]
struct Choice {
    beta: [u8; 2],
    order: u32,
    minus: bool,
}

impl Choice {
    fn degree(&self) -> i32 {
        i32::from(self.beta[0] + self.beta[1])
    }

    fn method(&self) -> DcPse<Expression<2>> {
        let operator = Expression::new([(MultiIndex::new(self.beta), 1.0)]).unwrap();
        let sign = if self.minus { Sign::Minus } else { Sign::Plus };
        DcPse::at_order(operator, self.order).unwrap().sign(sign)
    }

    /// Whether f_p stands in no row but as f_q - f_p.
    fn is_difference(&self) -> bool {
        self.degree() > 0 && (self.minus || self.degree() % 2 == 0)
    }
}

fn choice() -> impl Strategy<Value = Choice> {
    let betas = prop_oneof![Just([0, 0]), Just([1, 0]), Just([0, 1]), Just([2, 0]), Just([1, 1]), Just([2, 1])];
    (betas, 1..=2_u32, any::<bool>()).prop_map(|(beta, order, minus)| Choice { beta, order, minus })
}

/// Jittered particles in the unit square on multiples of 2^-20, where translations are exact, and a cutoff that is good
/// for every row.
#[derive(Clone, Debug)]
struct Set {
    points: Vec<[f64; 2]>,
    cutoff: f64,
    fields: [Vec<f64>; 2],
}

impl Set {
    fn new(seed: u64) -> Self {
        let jittered = Particles::<2>::jittered([0.0; 2], [1.0; 2], [SIDE; 2], 0.3, seed).unwrap();
        let points = jittered.points().iter().map(|x| x.map(|x| (x * 1048576.0).floor() / 1048576.0)).collect();
        let mut random = Random::new(seed);
        // 2 l = 30 neighbors at most, in a quarter of the ball at the corners.
        let cutoff = 1.03 + 0.1 * random.uniform();
        let mut field = || (0..N).map(|_| random.normal()).collect();
        Self { points, cutoff, fields: [field(), field()] }
    }

    fn particles(&self) -> Particles<2> {
        Particles::new(self.points.clone()).unwrap()
    }

    fn provider(&self) -> BruteForce<2> {
        BruteForce::build(&self.particles(), &Domain::open(), Cutoff(self.cutoff)).unwrap()
    }

    fn rows(&self, choice: Choice) -> Rows {
        choice.method().assemble(&self.provider()).unwrap()
    }

    fn map(&self, map: impl Fn(&[f64; 2]) -> [f64; 2], scale: f64) -> Self {
        let points = self.points.iter().map(map).collect();
        Self { points, cutoff: self.cutoff * scale, fields: self.fields.clone() }
    }
}

fn row(rows: &Rows, p: usize) -> Row<'_, [f64; 1]> {
    rows.row(p).unwrap()
}

/// Equal bits of all rows, with weights times `factor`.
fn same_bits(a: &Rows, b: &Rows, factor: f64) -> bool {
    (0..a.targets()).all(|p| {
        let (a, b) = (row(a, p), row(b, p));
        let equal = |a: f64, b: f64| (a * factor).to_bits() == b.to_bits();
        let weights = a.weights.iter().zip(b.weights).all(|(a, b)| equal(a[0], b[0]));
        a.sources == b.sources && weights && equal(a.diagonal[0], b.diagonal[0])
    })
}

/// Pairs near the cutoff may enter or leave by rounding: sets in which one does are no cases.
fn same_neighbors(a: &Rows, b: &Rows) -> bool {
    (0..a.targets()).all(|p| row(a, p).sources == row(b, p).sources)
}

/// The largest difference of weights with those of `a` times `factor`, in units of the row's sum of absolute weights
/// and of eps times the condition number.
fn difference(a: &Rows, b: &Rows, factor: f64) -> f64 {
    let mut largest = 0.0_f64;
    for p in 0..a.targets() {
        let (a, b) = (row(a, p), row(b, p));
        let size: f64 = b.weights.iter().map(|w| w[0].abs()).sum::<f64>() + b.diagonal[0].abs();
        let pairs = a.weights.iter().zip(b.weights).map(|(a, b)| (a[0] * factor - b[0]).abs());
        largest = pairs.fold(largest, |largest, d| largest.max(d / size));
    }
    largest / (f64::EPSILON * a.report().condition)
}

/// sum_q |w| |f_q - f_p| + |d| |f_p|: what the rounding of a result is measured by.
fn absolute(rows: &Rows, p: usize, f: &[f64]) -> f64 {
    let row = row(rows, p);
    let pairs = row.sources.iter().zip(row.weights).map(|(&q, w)| w[0].abs() * (f[q as usize] - f[p]).abs());
    pairs.sum::<f64>() + (row.diagonal[0] * f[p]).abs()
}

fn apply(rows: &Rows, f: &[f64]) -> Vec<f64> {
    let mut out = vec![f64::NAN; f.len()];
    rows.apply(f, &mut out).unwrap();
    out
}

/// The rounding of a result, in units of eps times the absolute terms (verification figure for M7 and M8).
const TERMS: f64 = 8.0;
/// Changes of weights where positions are rounded (verification figures for M2, M4 and M5; M6 has twice that).
const WEIGHTS: f64 = 16.0;

fn relation(text: &'static str) -> Promise {
    Promise::new("Metamorphic relations", text)
}

proptest! {
    #![proptest_config(properties(cases()))]

    #[test]
    fn m1_exact_translation_leaves_every_bit(seed: u64, choice in choice(), t in [-1048576..1048576_i32, -1048576..1048576]) {
        let set = Set::new(seed);
        let t = t.map(|t| f64::from(t) / 1024.0);
        let moved = set.map(|x| [x[0] + t[0], x[1] + t[1]], 1.0);
        let (a, b) = (set.rows(choice), moved.rows(choice));
        relation("M1 DC-PSE rows keep their bits under an exact translation").holds(same_bits(&a, &b, 1.0));
        prop_assert_eq!(a.report(), b.report());
    }

    #[test]
    fn m2_any_translation_changes_weights_by_the_rounding_of_positions(seed: u64, choice in choice(), t in [-1e3..1e3_f64, -1e3..1e3]) {
        let set = Set::new(seed);
        let moved = set.map(|x| [x[0] + t[0], x[1] + t[1]], 1.0);
        let (a, b) = (set.rows(choice), moved.rows(choice));
        prop_assume!(same_neighbors(&a, &b));
        let shift = t[0].abs().max(t[1].abs()) * SIDE as f64;
        relation("M2 DC-PSE rows under a translation t").in_units("(1 + t/h) cond eps sum w", 1.0 + shift).at_most(WEIGHTS, difference(&a, &b, 1.0));
    }

    #[test]
    fn m3_scaling_by_a_power_of_two_scales_the_rows_by_one(seed: u64, choice in choice(), k in -150..=150_i32) {
        let set = Set::new(seed);
        let scale = 2.0_f64.powi(k);
        let scaled = set.map(|x| x.map(|x| x * scale), scale);
        let (a, b) = (set.rows(choice), scaled.rows(choice));
        let scaled = same_bits(&a, &b, 2.0_f64.powi(-k * choice.degree()));
        relation("M3 DC-PSE rows keep their bits when all is scaled by 2^k").holds(scaled);
        let figures = |rows: &Rows| [rows.report().condition, rows.report().residual].map(f64::to_bits);
        prop_assert_eq!(figures(&a), figures(&b));
    }

    #[test]
    fn m4_scaling_by_any_factor_scales_the_rows(seed: u64, choice in choice(), scale in prop_oneof![Just(3.0), Just(1e-7), 0.1..10.0_f64]) {
        let set = Set::new(seed);
        let scaled = set.map(|x| x.map(|x| x * scale), scale);
        let (a, b) = (set.rows(choice), scaled.rows(choice));
        prop_assume!(same_neighbors(&a, &b));
        let found = difference(&a, &b, scale.powi(-choice.degree()));
        relation("M4 DC-PSE rows scaled by any factor").in_units("cond eps sum w", 1.0).at_most(WEIGHTS, found);
    }

    #[test]
    fn m5_reflected_and_permuted_axes_go_with_beta(seed: u64, choice in choice(), axis in 0..2_usize) {
        let set = Set::new(seed);
        let rows = set.rows(choice);
        let reflected = set.map(|x| { let mut x = *x; x[axis] = -x[axis]; x }, 1.0).rows(choice);
        let sign = if choice.beta[axis] % 2 == 0 { 1.0 } else { -1.0 };
        let axes = relation("M5 DC-PSE rows with axes reflected or permuted").in_units("cond eps sum w", 1.0);
        axes.at_most(WEIGHTS, difference(&rows, &reflected, sign));
        let [i, j] = choice.beta;
        let permuted = set.map(|x| [x[1], x[0]], 1.0).rows(Choice { beta: [j, i], ..choice });
        prop_assert!(same_neighbors(&rows, &permuted));
        axes.at_most(WEIGHTS, difference(&rows, &permuted, 1.0));
    }

    #[test]
    fn m6_rotation_leaves_the_laplacian_and_turns_the_gradient(seed: u64, angle in 0.0..std::f64::consts::TAU) {
        let set = Set::new(seed);
        let (sin, cos) = angle.sin_cos();
        let turned = set.map(|x| [cos * x[0] - sin * x[1], sin * x[0] + cos * x[1]], 1.0);
        let laplacian = DcPse::<Laplacian<2>, 2>::new();
        let (a, b) = (laplacian.assemble(&set.provider()).unwrap(), laplacian.assemble(&turned.provider()).unwrap());
        prop_assume!(same_neighbors(&a, &b));
        let turns = relation("M6 DC-PSE Laplacian rotated").in_units("cond eps sum w", 1.0);
        turns.at_most(2.0 * WEIGHTS, difference(&a, &b, 1.0));
        let condition = a.report().condition;
        let gradient = DcPse::<Gradient<2>, 2>::new();
        let (a, b) = (gradient.assemble(&set.provider()).unwrap(), gradient.assemble(&turned.provider()).unwrap());
        for p in 0..N {
            let (a, b) = (a.row(p).unwrap(), b.row(p).unwrap());
            let size: f64 = b.weights.iter().map(|w| w[0].abs() + w[1].abs()).sum();
            for (a, b) in a.weights.iter().zip(b.weights) {
                let expected = [cos * a[0] - sin * a[1], sin * a[0] + cos * a[1]];
                let turns = relation("M6 DC-PSE gradient turns with the points");
                let turns = turns.in_units("cond eps sum w", f64::EPSILON * condition * size);
                turns.at_most(2.0 * WEIGHTS, (expected[0] - b[0]).abs().max((expected[1] - b[1]).abs()));
            }
        }
    }

    #[test]
    fn m7_numbering_permutes_the_results(seed: u64, choice in choice()) {
        let set = Set::new(seed);
        let mut order: Vec<usize> = (0..N).collect();
        let mut random = Random::new(seed ^ 1);
        for i in (1..N).rev() {
            order.swap(i, (random.uniform() * (i + 1) as f64) as usize);
        }
        let pick = |values: &[f64]| -> Vec<f64> { order.iter().map(|&p| values[p]).collect() };
        let renumbered = Set {
            points: order.iter().map(|&p| set.points[p]).collect(),
            cutoff: set.cutoff,
            fields: [pick(&set.fields[0]), pick(&set.fields[1])],
        };
        // The sums of the moment matrix take another order too: bits are equal in canonical rows only, there over
        // providers as well.
        let canonical = |set: &Set| {
            let cells = CellList::build(&set.particles(), &Domain::open(), Cutoff(set.cutoff)).unwrap().canonical();
            choice.method().assemble(&cells).unwrap()
        };
        let (a, b) = (canonical(&set), canonical(&renumbered));
        for (i, &p) in order.iter().enumerate() {
            let (a, b) = (row(&a, p), row(&b, i));
            prop_assert!(a.sources.iter().zip(b.sources).all(|(&q, &r)| q as usize == order[r as usize]));
            prop_assert!(a.weights.iter().zip(b.weights).all(|(a, b)| a[0].to_bits() == b[0].to_bits()));
            prop_assert_eq!(a.diagonal[0].to_bits(), b.diagonal[0].to_bits());
        }
        let (f, g) = (apply(&a, &set.fields[0]), apply(&b, &renumbered.fields[0]));
        let same = order.iter().zip(&g).all(|(&p, g)| f[p].to_bits() == g.to_bits());
        relation("M7 DC-PSE results keep their bits under renumbering, canonical").holds(same);
        let oracle = choice.method().assemble(&set.provider().canonical()).unwrap();
        prop_assert!(same_bits(&a, &oracle, 1.0));
    }

    #[test]
    fn m8_rows_are_linear(seed: u64, choice in choice(), a in -10.0..10.0_f64, b in -10.0..10.0_f64) {
        let set = Set::new(seed);
        let rows = set.rows(choice);
        let [f, g] = &set.fields;
        let mixed: Vec<f64> = f.iter().zip(g).map(|(f, g)| a * f + b * g).collect();
        let (of_f, of_g, of_mixed) = (apply(&rows, f), apply(&rows, g), apply(&rows, &mixed));
        for p in 0..N {
            // The mixture is rounded before its differences are taken.
            let row = row(&rows, p);
            let before: f64 = row.sources.iter().zip(row.weights).map(|(&q, w)| {
                let size = |p: usize| (a * f[p]).abs().max((b * g[p]).abs());
                w[0].abs() * size(q as usize).max(size(p))
            }).sum();
            let terms = a.abs() * absolute(&rows, p, f) + b.abs() * absolute(&rows, p, g) + before;
            let linear = relation("M8 DC-PSE rows are linear").in_units("eps sum abs", f64::EPSILON * terms);
            linear.at_most(TERMS, (of_mixed[p] - (a * of_f[p] + b * of_g[p])).abs());
        }
    }

    #[test]
    fn m9_constants_vanish_exactly_in_differences_and_to_the_certificate_in_sums(seed: u64, choice in choice(), c in -1e3..1e3_f64) {
        let set = Set::new(seed);
        let rows = set.rows(choice);
        let report = rows.report();
        let epsilon = set.cutoff / parops::CUTOFF_OVER_EPSILON;
        for out in apply(&rows, &[c; N]) {
            if choice.is_difference() {
                relation("M9 DC-PSE derivative of a constant, difference form").at_most(0.0, out.abs());
            } else {
                // '+' counts a constant twice; the value itself, degree 0, is reproduced.
                let (exact, twice) = if choice.degree() == 0 { (c, 1.0) } else { (0.0, 2.0) };
                let scale = twice * epsilon.powi(-choice.degree());
                let unit = f64::EPSILON * (10.0 * report.condition * scale + 0.25 * TERMS * report.sum_abs);
                let sums = relation("M9 DC-PSE derivative of a constant, sum form").in_units("(l cond + 2 sum w) eps", unit * c.abs());
                sums.at_most(4.0, (out - exact).abs());
            }
        }
    }

    #[test]
    fn m10_particles_beyond_the_cutoff_change_no_bit(seed: u64, choice in choice(), extra in 1..20_usize) {
        let set = Set::new(seed);
        let mut wider = set.clone();
        let mut random = Random::new(seed ^ 2);
        wider.points.extend((0..extra).map(|_| [3.5 + random.uniform(), 4.0 * random.uniform()]));
        // Only the rows of the first N are asked for: the others are too few to have any.
        let rows = set.rows(choice);
        let places = Part { provider: wider.provider(), first: 0, targets: N };
        let with: Rows = choice.method().assemble(&places).unwrap();
        relation("M10 DC-PSE rows keep their bits with particles beyond the cutoff").holds(same_bits(&rows, &with, 1.0));
    }

    #[test]
    fn m11_periodic_shifts_leave_every_bit_and_tiles_every_value(seed: u64, choice in choice(), shift in [-3..=3_i32, -3..=3]) {
        const SIDE: usize = 10;
        let jittered = Particles::<2>::jittered([0.0; 2], [1.0; 2], [SIDE; 2], 0.3, seed).unwrap();
        let points: Vec<[f64; 2]> =
            jittered.points().iter().map(|x| x.map(|x| (x * 1048576.0).floor() / 1048576.0)).collect();
        let moved = |by: [f64; 2]| points.iter().map(move |x| [x[0] + by[0], x[1] + by[1]]);
        let build = |points: Vec<[f64; 2]>, width: f64| {
            let torus = Domain::periodic([0.0; 2], [width; 2]).unwrap();
            let cells = CellList::build(&Particles::new(points).unwrap(), &torus, Cutoff(0.42)).unwrap().canonical();
            choice.method().assemble(&cells).unwrap()
        };
        let rows = build(points.clone(), 1.0);
        let shifted = build(moved(shift.map(f64::from)).collect(), 1.0);
        relation("M11 DC-PSE rows keep their bits in a box shifted by its length").holds(same_bits(&rows, &shifted, 1.0));

        let tiles = [[0.0, 0.0], [0.0, 1.0], [1.0, 0.0], [1.0, 1.0]];
        let tiled = build(tiles.into_iter().flat_map(moved).collect(), 2.0);
        let mut random = Random::new(seed);
        let f: Vec<f64> = (0..SIDE * SIDE).map(|_| random.normal()).collect();
        let (a, b) = (apply(&rows, &f), apply(&tiled, &f.repeat(4)));
        for p in 0..4 * f.len() {
            let of_tile = relation("M11 DC-PSE results on a box tiled 2^D times");
            let of_tile = of_tile.in_units("eps sum abs", f64::EPSILON * absolute(&rows, p % f.len(), &f));
            of_tile.at_most(TERMS, (a[p % f.len()] - b[p]).abs());
        }
    }

    #[test]
    fn m12_inputs_are_what_they_were_after_every_call(seed: u64, choice in choice()) {
        let set = Set::new(seed);
        let particles = set.particles();
        let provider = CellList::build(&particles, &Domain::open(), Cutoff(set.cutoff)).unwrap();
        let rows = choice.method().assemble(&provider).unwrap();
        let kept = rows.clone();
        let f = set.fields[0].clone();
        let first = apply(&rows, &f);
        let again = apply(&rows, &f) == first;
        let unchanged = again && f == set.fields[0] && rows == kept && particles.points() == &set.points[..];
        relation("M12 DC-PSE inputs are unchanged by every call").holds(unchanged);
        prop_assert_eq!(&choice.method().assemble(&provider).unwrap(), &kept);
    }
}

/// Some targets of a provider, one after the other.
struct Part<P> {
    provider: P,
    first: usize,
    targets: usize,
}

impl<P: Neighbors<2>> Neighbors<2> for Part<P> {
    fn targets(&self) -> usize {
        self.targets
    }

    fn sources(&self) -> usize {
        self.provider.sources()
    }

    fn center(&self, p: usize) -> Option<usize> {
        self.provider.center(self.first + p)
    }

    fn cutoff(&self, p: usize) -> f64 {
        self.provider.cutoff(self.first + p)
    }

    fn reach(&self) -> f64 {
        self.provider.reach()
    }

    fn generation(&self) -> u64 {
        self.provider.generation()
    }

    fn for_each(&self, p: usize, cutoff: f64, visit: impl FnMut(parops::Neighbor<2>)) {
        self.provider.for_each(self.first + p, cutoff, visit);
    }
}

#[test]
fn nearest_neighbors_and_one_cutoff_give_the_same_bits_where_they_hold_the_same_neighbors() {
    let set = Set::new(5);
    let nearest = Nearest::build(&set.particles(), &Domain::open(), 20).unwrap();
    let method = DcPse::<Laplacian<2>, 2>::new();
    let rows = method.assemble(&(&nearest).canonical()).unwrap();
    for p in 0..N {
        let all = BruteForce::build(&set.particles(), &Domain::open(), Cutoff(nearest.cutoff(p))).unwrap();
        let oracle = method.assemble(&Part { provider: all.canonical(), first: p, targets: 1 }).unwrap();
        let (a, b) = (rows.row(p).unwrap(), oracle.row(0).unwrap());
        assert!(a.sources == b.sources && a.weights == b.weights);
    }
}
