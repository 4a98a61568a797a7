//! Metamorphic relations: what a change of the input must do to the rows of PSE and SPH, without exact answers.
//!
//! No condition number exists for fixed kernels. In its place stands the steepness of the kernel: a weight is
//! V epsilon^(-D-m) eta(z), and where z is perturbed by delta it changes by at most V epsilon^(-D-m) |grad eta| delta.
//! `Set::bound` takes the suprema of eta, z . grad eta and grad eta over a grid of differences.

use crate::cases::cases;
use crate::properties::properties;
use parops::{
    Allowance, Apply, BruteForce, CellList, Cutoff, Domain, Epsilon, Exchange, Expression, Gradient, HighOrderGaussian,
    Kernel, Laplacian, MultiIndex, Neighbors, Particles, Pse, Random, Row, Rows, Sign, SmoothingKernel, Sph, SphForm,
    Term, Volumes, testing::Promise,
};
use proptest::prelude::*;

const N: usize = 20;

/// One discretization: PSE with either sign where it may choose, or SPH in either form.
#[derive(Clone, Copy, Debug)]
struct Choice {
    sph: bool,
    second: bool,
    beta: [u8; 2],
    order: u32,
}

/// eta, to be evaluated at many points.
type Profile = Box<dyn Fn(&[f64; 2]) -> f64>;

impl Choice {
    fn degree(&self) -> i32 {
        i32::from(self.beta[0] + self.beta[1])
    }

    fn rows<P: Neighbors<2>>(&self, provider: &P, epsilon: f64, volumes: &Volumes) -> Rows {
        let operator = Expression::new([(MultiIndex::new(self.beta), 1.0)]).unwrap();
        let epsilon = Epsilon::global(epsilon).unwrap();
        if self.sph {
            let kernel = HighOrderGaussian::<2>::new(self.order).unwrap();
            let form = if self.second { SphForm::Difference } else { SphForm::Summation };
            let sph = Sph::new(operator, kernel, epsilon, volumes).unwrap().form(form).unwrap();
            sph.support(6.0).unwrap().allow(Allowance::Everywhere).assemble(provider).unwrap()
        } else {
            let pse = Pse::new(operator, self.order, epsilon, volumes).unwrap();
            let sign = if self.second && self.degree() % 2 == 1 { Sign::Plus } else { Sign::Minus };
            let pse = pse.sign(sign).unwrap().support(6.0).unwrap();
            pse.allow(Allowance::Everywhere).assemble(provider).unwrap()
        }
    }

    fn is_difference(&self) -> bool {
        if self.sph { self.second } else { !(self.second && self.degree() % 2 == 1) }
    }

    fn kernel(&self) -> Profile {
        let index = MultiIndex::new(self.beta);
        if self.sph {
            let kernel = HighOrderGaussian::<2>::new(self.order).unwrap();
            Box::new(move |z| kernel.derivative(index, z).unwrap())
        } else {
            let kernel = Exchange::new(&[Term { index, factor: 1.0 }], self.order).unwrap();
            Box::new(move |z| kernel.value(z))
        }
    }
}

fn choice() -> impl Strategy<Value = Choice> {
    let betas = prop_oneof![Just([1, 0]), Just([0, 1]), Just([2, 0]), Just([1, 1]), Just([2, 1])];
    let orders = prop_oneof![Just(2_u32), Just(4)];
    (any::<bool>(), any::<bool>(), betas, orders).prop_map(|(sph, second, beta, order)| Choice {
        sph,
        second,
        beta,
        order,
    })
}

/// Scattered particles in the unit square on multiples of 2^-20, where translations are exact; one epsilon whose
/// kernel of radius 6 reaches all of them, so that no pair enters or leaves.
#[derive(Clone, Debug)]
struct Set {
    points: Vec<[f64; 2]>,
    volumes: Vec<f64>,
    epsilon: f64,
    fields: [Vec<f64>; 2],
}

impl Set {
    fn new(seed: u64) -> Self {
        let mut random = Random::new(seed);
        let mut coordinate = || (random.uniform() * 1048576.0).floor() / 1048576.0;
        let points = (0..N).map(|_| [coordinate(), coordinate()]).collect();
        let volumes = (0..N).map(|_| (0.5 + random.uniform()) / N as f64).collect();
        let epsilon = 0.3 + 0.2 * random.uniform();
        let mut field = || (0..N).map(|_| random.normal()).collect();
        Self { points, volumes, epsilon, fields: [field(), field()] }
    }

    fn particles(&self) -> Particles<2> {
        Particles::new(self.points.clone()).unwrap().with_volumes(Volumes::each(self.volumes.clone()).unwrap()).unwrap()
    }

    fn rows(&self, choice: Choice) -> Rows {
        let particles = self.particles();
        let reach = Cutoff(6.0 * self.epsilon);
        let provider = BruteForce::build(&particles, &Domain::open(), reach).unwrap();
        choice.rows(&provider, self.epsilon, particles.volumes().unwrap())
    }

    fn map(&self, map: impl Fn(&[f64; 2]) -> [f64; 2], scale: f64) -> Self {
        let points = self.points.iter().map(map).collect();
        let volumes = self.volumes.iter().map(|v| v * scale * scale).collect();
        Self { points, volumes, epsilon: self.epsilon * scale, fields: self.fields.clone() }
    }

    /// How much a weight may change where coordinates as large as `magnitude` are rounded once or twice (each by
    /// eps/2 of it, both ends of a separation), and z, V, epsilon^-D-m and eta by some 16 eps of themselves.
    fn bound(&self, choice: Choice, magnitude: f64) -> f64 {
        const STEP: f64 = 1e-6;
        let eta = choice.kernel();
        let (mut top, mut slope) = (0.0_f64, 0.0_f64);
        for i in -16..=16 {
            for j in -16..=16 {
                let z = [f64::from(i) * 0.25, f64::from(j) * 0.25];
                let value = eta(&z);
                top = top.max(value.abs());
                for axis in 0..2 {
                    let mut ahead = z;
                    ahead[axis] += STEP;
                    let change = ((eta(&ahead) - value) / STEP).abs();
                    slope = slope.max(change);
                    top = top.max(change * z[axis].abs());
                }
            }
        }
        let volume = self.volumes.iter().fold(0.0_f64, |largest, &v| largest.max(v));
        // The grid misses the suprema by less than a half of them: it is four points to a unit of z.
        let front = 2.0 * volume * self.epsilon.powi(-2 - choice.degree());
        f64::EPSILON * front * (16.0 * top + 4.0 * slope * magnitude / self.epsilon)
    }
}

fn row(rows: &Rows, p: usize) -> Row<'_, [f64; 1]> {
    rows.row(p).unwrap()
}

/// Equal bits of all rows, with weights times `factor`.
fn same_bits(a: &Rows, b: &Rows, factor: f64) -> bool {
    (0..N).all(|p| {
        let (a, b) = (row(a, p), row(b, p));
        let equal = |a: f64, b: f64| (a * factor).to_bits() == b.to_bits();
        let weights = a.weights.iter().zip(b.weights).all(|(a, b)| equal(a[0], b[0]));
        a.sources == b.sources && weights && equal(a.diagonal[0], b.diagonal[0])
    })
}

/// Largest difference of weights, and of diagonals (N weights added), with those of `a` times `factor`.
fn difference(a: &Rows, b: &Rows, factor: f64) -> f64 {
    let mut largest = 0.0_f64;
    for p in 0..N {
        let (a, b) = (row(a, p), row(b, p));
        assert_eq!(a.sources, b.sources);
        let pairs = a.weights.iter().zip(b.weights).map(|(a, b)| (a[0] * factor - b[0]).abs());
        largest = pairs.fold(largest, f64::max).max((a.diagonal[0] * factor - b.diagonal[0]).abs() / N as f64);
    }
    largest
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

/// The rounding of a result, in units of eps times the absolute terms (verification figure for M7, M8 and M11).
const TERMS: f64 = 8.0;

fn relation(text: &'static str) -> Promise {
    Promise::new("Metamorphic relations", text)
}

/// A relation in units of what roundings of positions may do to a weight.
fn rounding(text: &'static str, size: f64) -> Promise {
    relation(text).in_units("steepness eps", size)
}

proptest! {
    #![proptest_config(properties(cases()))]

    #[test]
    fn m1_exact_translation_leaves_every_bit(seed: u64, choice in choice(), t in [-1048576..1048576_i32, -1048576..1048576]) {
        let set = Set::new(seed);
        let t = t.map(|t| f64::from(t) / 1024.0);
        let moved = set.map(|x| [x[0] + t[0], x[1] + t[1]], 1.0);
        let (a, b) = (set.rows(choice), moved.rows(choice));
        relation("M1 PSE and SPH rows keep their bits under an exact translation").holds(same_bits(&a, &b, 1.0));
        prop_assert_eq!(a.report(), b.report());
    }

    #[test]
    fn m2_any_translation_changes_weights_by_the_rounding_of_positions(seed: u64, choice in choice(), t in [-1e3..1e3_f64, -1e3..1e3]) {
        // Off the grid, where a translation is exact unless it is small: thirds of its points.
        let set = Set::new(seed).map(|x| x.map(|x| x / 3.0), 1.0 / 3.0);
        let moved = set.map(|x| [x[0] + t[0], x[1] + t[1]], 1.0);
        let magnitude = 1.0 + t[0].abs().max(t[1].abs());
        let found = difference(&set.rows(choice), &moved.rows(choice), 1.0);
        rounding("M2 PSE and SPH rows under a translation", set.bound(choice, magnitude)).at_most(1.0, found);
    }

    #[test]
    fn m3_scaling_by_a_power_of_two_scales_the_rows_by_one(seed: u64, choice in choice(), k in -150..=150_i32) {
        let set = Set::new(seed);
        let scale = 2.0_f64.powi(k);
        let scaled = set.map(|x| x.map(|x| x * scale), scale);
        let (a, b) = (set.rows(choice), scaled.rows(choice));
        let scaled = same_bits(&a, &b, 2.0_f64.powi(-k * choice.degree()));
        relation("M3 PSE and SPH rows keep their bits when all is scaled by 2^k").holds(scaled);
        prop_assert_eq!(a.report().moment_defect.to_bits(), b.report().moment_defect.to_bits());
    }

    #[test]
    fn m4_scaling_by_any_factor_scales_the_rows(seed: u64, choice in choice(), scale in prop_oneof![Just(3.0), Just(1e-7), 0.1..10.0_f64]) {
        let set = Set::new(seed);
        let scaled = set.map(|x| x.map(|x| x * scale), scale);
        let factor: f64 = scale.powi(-choice.degree());
        let found = difference(&set.rows(choice), &scaled.rows(choice), factor);
        rounding("M4 PSE and SPH rows scaled by any factor", factor * set.bound(choice, 1.0)).at_most(1.0, found);
    }

    #[test]
    fn m5_reflected_and_permuted_axes_go_with_beta(seed: u64, choice in choice(), axis in 0..2_usize) {
        let set = Set::new(seed);
        let rows = set.rows(choice);
        let reflected = set.map(|x| { let mut x = *x; x[axis] = -x[axis]; x }, 1.0).rows(choice);
        let sign = if choice.beta[axis] % 2 == 0 { 1.0 } else { -1.0 };
        let axes = rounding("M5 PSE and SPH rows with axes reflected or permuted", set.bound(choice, 1.0));
        axes.at_most(1.0, difference(&rows, &reflected, sign));
        let [i, j] = choice.beta;
        let permuted = set.map(|x| [x[1], x[0]], 1.0).rows(Choice { beta: [j, i], ..choice });
        axes.at_most(1.0, difference(&rows, &permuted, 1.0));
    }

    #[test]
    fn m6_rotation_leaves_the_laplacian_and_turns_the_gradient(seed: u64, angle in 0.0..std::f64::consts::TAU, order in prop_oneof![Just(2_u32), Just(4)]) {
        let set = Set::new(seed);
        let (sin, cos) = angle.sin_cos();
        let turned = set.map(|x| [cos * x[0] - sin * x[1], sin * x[0] + cos * x[1]], 1.0);
        let build = |set: &Set| {
            let particles = set.particles();
            let provider = BruteForce::build(&particles, &Domain::open(), Cutoff(6.0 * set.epsilon)).unwrap();
            let (epsilon, volumes) = (Epsilon::global(set.epsilon).unwrap(), particles.volumes().unwrap());
            let everywhere = Allowance::Everywhere;
            let laplacian = Pse::new(Laplacian::<2>, order, epsilon.clone(), volumes).unwrap().allow(everywhere.clone());
            let gradient = Pse::new(Gradient::<2>, order, epsilon, volumes).unwrap().allow(everywhere);
            let gradient = gradient.sign(Sign::Minus).unwrap();
            (laplacian.assemble(&provider).unwrap(), gradient.assemble(&provider).unwrap())
        };
        let ((laplacian, gradient), (turned_laplacian, turned_gradient)) = (build(&set), build(&turned));
        // A rotated coordinate is rounded in two products and a sum, each of magnitude below 2.
        let bound = |beta| 2.0 * set.bound(Choice { sph: false, second: false, beta, order }, 4.0);
        let found = difference(&laplacian, &turned_laplacian, 1.0);
        rounding("M6 PSE Laplacian rotated", bound([2, 0]) + bound([0, 2])).at_most(1.0, found);
        let limit = bound([1, 0]) + bound([0, 1]);
        for p in 0..N {
            let (a, b) = (gradient.row(p).unwrap(), turned_gradient.row(p).unwrap());
            for (a, b) in a.weights.iter().zip(b.weights) {
                let expected = [cos * a[0] - sin * a[1], sin * a[0] + cos * a[1]];
                let found = (expected[0] - b[0]).abs().max((expected[1] - b[1]).abs());
                rounding("M6 PSE gradient turns with the points", limit).at_most(1.0, found);
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
            volumes: pick(&set.volumes),
            epsilon: set.epsilon,
            fields: [pick(&set.fields[0]), pick(&set.fields[1])],
        };
        let rows = set.rows(choice);
        let (a, b) = (apply(&rows, &set.fields[0]), apply(&renumbered.rows(choice), &renumbered.fields[0]));
        for (i, &p) in order.iter().enumerate() {
            // A diagonal is itself a sum, of all absolute weights at most.
            let terms = absolute(&rows, p, &set.fields[0]) + rows.report().sum_abs * set.fields[0][p].abs();
            let renumbered = relation("M7 PSE and SPH results under renumbering").in_units("eps sum abs", f64::EPSILON * terms);
            renumbered.at_most(TERMS, (a[p] - b[i]).abs());
        }
        let canonical = |set: &Set| {
            let particles = set.particles();
            let cells = CellList::build(&particles, &Domain::open(), Cutoff(6.0 * set.epsilon)).unwrap().canonical();
            apply(&choice.rows(&cells, set.epsilon, particles.volumes().unwrap()), &set.fields[0])
        };
        let (a, b) = (canonical(&set), canonical(&renumbered));
        let same = order.iter().zip(&b).all(|(&p, b)| a[p].to_bits() == b.to_bits());
        relation("M7 PSE and SPH results keep their bits under renumbering, canonical").holds(same);
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
                w[0].abs() * (a * f[q as usize]).abs().max((b * g[q as usize]).abs()).max((a * f[p]).abs()).max((b * g[p]).abs())
            }).sum();
            let terms = a.abs() * absolute(&rows, p, f) + b.abs() * absolute(&rows, p, g) + before;
            let linear = relation("M8 PSE and SPH rows are linear").in_units("eps sum abs", f64::EPSILON * terms);
            linear.at_most(TERMS, (of_mixed[p] - (a * of_f[p] + b * of_g[p])).abs());
        }
    }

    #[test]
    fn m9_constants_vanish_exactly_in_differences_and_leave_the_diagonal_in_sums(seed: u64, choice in choice(), c in -1e3..1e3_f64) {
        let rows = Set::new(seed).rows(choice);
        let out = apply(&rows, &[c; N]);
        for (p, out) in out.into_iter().enumerate() {
            if choice.is_difference() {
                relation("M9 PSE and SPH derivative of a constant, difference form").at_most(0.0, out.abs());
            } else {
                let diagonal = row(&rows, p).diagonal[0] * c;
                relation("M9 PSE and SPH sum form of a constant is the diagonal").at_most(0.0, (out - diagonal).abs());
            }
        }
    }

    #[test]
    fn m10_particles_beyond_the_cutoff_change_no_bit(seed: u64, choice in choice(), more in 1..10_usize) {
        let set = Set::new(seed);
        let mut larger = set.clone();
        let mut random = Random::new(seed ^ 2);
        for _ in 0..more {
            // 6 epsilon is at most 3.
            larger.points.push([4.5 + random.uniform(), -5.0 * random.uniform()]);
            larger.volumes.push(0.01);
        }
        let same = same_bits(&set.rows(choice), &larger.rows(choice), 1.0);
        relation("M10 PSE and SPH rows keep their bits with particles beyond the cutoff").holds(same);
    }

    #[test]
    fn m11_periodic_shifts_leave_every_bit_and_tiles_every_value(seed: u64, choice in choice(), shift in [-3..=3_i32, -3..=3]) {
        let set = Set { epsilon: 0.08, ..Set::new(seed) };
        let build = |set: &Set, width: f64, choice: Choice| {
            let particles = set.particles();
            let domain = Domain::periodic([0.0; 2], [width; 2]).unwrap();
            let provider = CellList::build(&particles, &domain, Cutoff(6.0 * set.epsilon)).unwrap();
            choice.rows(&provider.canonical(), set.epsilon, particles.volumes().unwrap())
        };
        let rows = build(&set, 1.0, choice);
        let shifted = set.map(|x| [x[0] + f64::from(shift[0]), x[1] + f64::from(shift[1])], 1.0);
        let same = same_bits(&rows, &build(&shifted, 1.0, choice), 1.0);
        relation("M11 PSE and SPH rows keep their bits in a box shifted by its length").holds(same);

        let copy = |tile: usize| set.points.iter().map(move |x| [x[0] + (tile % 2) as f64, x[1] + (tile / 2) as f64]);
        let tiled = Set {
            points: (0..4).flat_map(copy).collect(),
            volumes: set.volumes.repeat(4),
            epsilon: set.epsilon,
            fields: [set.fields[0].repeat(4), set.fields[1].repeat(4)],
        };
        let (a, b) = (apply(&rows, &set.fields[0]), apply(&build(&tiled, 2.0, choice), &tiled.fields[0]));
        for p in 0..N {
            let terms = absolute(&rows, p, &set.fields[0]) + rows.report().sum_abs * set.fields[0][p].abs();
            let tiles = relation("M11 PSE and SPH results on a box tiled 2^D times").in_units("eps sum abs", f64::EPSILON * terms);
            (0..4).for_each(|tile| tiles.at_most(TERMS, (a[p] - b[tile * N + p]).abs()));
        }
    }

    #[test]
    fn m12_inputs_are_what_they_were_after_every_call(seed: u64, choice in choice()) {
        let set = Set::new(seed);
        let particles = set.particles();
        let provider = CellList::build(&particles, &Domain::open(), Cutoff(6.0 * set.epsilon)).unwrap();
        let rows = choice.rows(&provider, set.epsilon, particles.volumes().unwrap());
        let kept = rows.clone();
        let f = set.fields[0].clone();
        let first = apply(&rows, &f);
        prop_assert_eq!(apply(&rows, &f), first, "an application leaves nothing behind");
        let unchanged = f == set.fields[0] && rows == kept && particles.points() == &set.points[..];
        let volumes: Vec<f64> = (0..N).map(|p| particles.volumes().unwrap().get(p).unwrap()).collect();
        let unchanged = unchanged && volumes == set.volumes;
        relation("M12 PSE and SPH inputs are unchanged by every call").holds(unchanged);
        let again = choice.rows(&provider, set.epsilon, particles.volumes().unwrap());
        prop_assert_eq!(&again, &kept, "the provider gives the same rows again");
    }
}
