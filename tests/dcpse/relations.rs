//! Metamorphic relations of DC-PSE: what a change of the input must do to its rows, without exact answers.
//!
//! A weight is moved by rounding as its moment system is conditioned: bounds are multiples of cond eps, cond the largest
//! estimate of all rows, in units of the row's own sum of absolute weights.

use crate::cases::cases;
use crate::drawn::{Choice, OPEN, Set, TARGETS, TORUS, below, between, jittered};
use crate::properties::properties;
use parops::{
    Apply, BruteForce, CellList, Cutoff, DcPse, Domain, Gradient, Laplacian, MultiIndex, Nearest, Neighbors, Particles,
    Random, Row, Rows, Selected, testing::Promise,
};
use proptest::prelude::*;
use proptest::test_runner::TestCaseResult;

fn row(rows: &Rows, i: usize) -> Row<'_, [f64; 1]> {
    rows.row(i).unwrap()
}

/// Sources and weights of a row, by source: rows of canonical providers turn with the points.
fn by_source<const K: usize>(rows: &Rows<[f64; K]>, i: usize) -> Vec<(u32, [f64; K])> {
    let row = rows.row(i).unwrap();
    let mut pairs: Vec<_> = row.sources.iter().copied().zip(row.weights.iter().copied()).collect();
    pairs.sort_by_key(|&(q, _)| q);
    pairs
}

/// Equal bits of all rows, with weights times `factor`.
fn same_bits(a: &Rows, b: &Rows, factor: f64) -> bool {
    (0..a.targets()).all(|i| {
        let (a, b) = (row(a, i), row(b, i));
        let equal = |a: f64, b: f64| (a * factor).to_bits() == b.to_bits();
        let weights = a.weights.iter().zip(b.weights).all(|(a, b)| equal(a[0], b[0]));
        a.sources == b.sources && weights && equal(a.diagonal[0], b.diagonal[0])
    })
}

/// Pairs near the cutoff may enter or leave by rounding: sets in which one does are no cases.
fn same_neighbors<const K: usize>(a: &Rows<[f64; K]>, b: &Rows<[f64; K]>) -> bool {
    let sources = |rows: &Rows<[f64; K]>, i: usize| by_source(rows, i).into_iter().map(|(q, _)| q).collect::<Vec<_>>();
    (0..a.targets()).all(|i| sources(a, i) == sources(b, i))
}

/// The largest difference of weights with those of `a` times `factor`, in units of the row's sum of absolute weights
/// and of eps times the condition number.
fn difference(a: &Rows, b: &Rows, factor: f64) -> f64 {
    let mut largest = 0.0_f64;
    for i in 0..a.targets() {
        let size: f64 = row(b, i).weights.iter().map(|w| w[0].abs()).sum::<f64>() + row(b, i).diagonal[0].abs();
        let pairs = by_source(a, i).into_iter().zip(by_source(b, i));
        largest = pairs.map(|((_, a), (_, b))| (a[0] * factor - b[0]).abs() / size).fold(largest, f64::max);
    }
    largest / (f64::EPSILON * a.report().condition)
}

/// sum_q |w| |f_q - f_p| + |d| |f_p|, p the particle of row i: what the rounding of a result is measured by.
fn absolute(rows: &Rows, i: usize, p: usize, f: &[f64]) -> f64 {
    let row = row(rows, i);
    let pairs = row.sources.iter().zip(row.weights).map(|(&q, w)| w[0].abs() * (f[q as usize] - f[p]).abs());
    pairs.sum::<f64>() + (row.diagonal[0] * f[p]).abs()
}

fn apply(rows: &Rows, f: &[f64]) -> Vec<f64> {
    let mut out = vec![f64::NAN; rows.targets()];
    rows.apply(f, &mut out).unwrap();
    out
}

/// The rounding of a result, in units of eps times the absolute terms (verification figure for M7 and M8).
const TERMS: f64 = 8.0;
/// Changes of weights where sums are added in another order (verification figure for M5).
const WEIGHTS: f64 = 16.0;
/// Changes of weights where positions are rounded anew, in units of 1 + x/h (M2, M4 and M6): three times the worst of 10^5
/// cases. Without x/h no multiple would do: a stencil of two has cond 1, and its weights move by eps x/h all the same.
const ROUNDED: f64 = 8.0;

fn relation(text: &'static str) -> Promise {
    Promise::new("Metamorphic relations", text)
}

/// Relations as properties, each of as many cases in as many dimensions as drawn.
macro_rules! relations {
    ($($name:ident: $relation:ident in $dimensions:expr;)*) => {
        proptest! {
            #![proptest_config(properties(cases()))]

            $(
                #[test]
                fn $name(seed: u64, dimensions in $dimensions) {
                    let mut random = Random::new(seed);
                    match dimensions {
                        1 => $relation::<1>(&mut random)?,
                        2 => $relation::<2>(&mut random)?,
                        _ => $relation::<3>(&mut random)?,
                    }
                }
            )*
        }
    };
}

relations! {
    m1_exact_translation_leaves_every_bit: exact_translation in 1..=3_usize;
    m2_any_translation_changes_weights_by_the_rounding_of_positions: any_translation in 1..=3_usize;
    m3_scaling_by_a_power_of_two_scales_the_rows_by_one: power_of_two in 1..=3_usize;
    m4_scaling_by_any_factor_scales_the_rows: any_factor in 1..=3_usize;
    m5_reflected_and_permuted_axes_go_with_beta: axes in 1..=3_usize;
    m6_rotation_leaves_the_laplacian_and_turns_the_gradient: rotation in 2..=3_usize;
    m7_numbering_permutes_the_results: numbering in 1..=3_usize;
    m8_rows_are_linear: linearity in 1..=3_usize;
    m9_constants_vanish_exactly_in_differences_and_to_the_certificate_in_sums: constants in 1..=3_usize;
    m10_particles_beyond_the_cutoff_change_no_bit: beyond_the_cutoff in 1..=3_usize;
    m11_periodic_shifts_leave_every_bit_and_tiles_every_value: periods in 1..=3_usize;
    m12_inputs_are_what_they_were_after_every_call: inputs in 1..=3_usize;
}

fn exact_translation<const D: usize>(random: &mut Random) -> TestCaseResult {
    let set = Set::<D>::draw(random);
    let t: [f64; D] = std::array::from_fn(|_| between(random, -1048576.0, 1048576.0).floor() / 1024.0);
    let moved = set.map(|x| std::array::from_fn(|axis| x[axis] + t[axis]), 1.0);
    let (a, b) = (set.rows(), moved.rows());
    relation("M1 DC-PSE rows keep their bits under an exact translation").holds(same_bits(&a, &b, 1.0));
    prop_assert_eq!(a.report(), b.report());
    Ok(())
}

fn any_translation<const D: usize>(random: &mut Random) -> TestCaseResult {
    // Off the grid, where a translation is exact unless it is small: thirds of its points.
    let set = Set::<D>::draw(random).map(|x| x.map(|x| x / 3.0), 1.0 / 3.0);
    let t: [f64; D] = std::array::from_fn(|_| between(random, -1e3, 1e3));
    let moved = set.map(|x| std::array::from_fn(|axis| x[axis] + t[axis]), 1.0);
    let (a, b) = (set.rows(), moved.rows());
    prop_assume!(same_neighbors(&a, &b));
    let shift = t.iter().fold(1.0_f64, |most, t| most.max(t.abs())) * 3.0 * OPEN[D - 1] as f64;
    relation("M2 DC-PSE rows under a translation t")
        .in_units("(1 + t/h) cond eps sum w", 1.0 + shift)
        .at_most(ROUNDED, difference(&a, &b, 1.0));
    Ok(())
}

fn power_of_two<const D: usize>(random: &mut Random) -> TestCaseResult {
    let set = Set::<D>::draw(random);
    let k = below(random, 301) as i32 - 150;
    let scale = 2.0_f64.powi(k);
    let scaled = set.map(|x| x.map(|x| x * scale), scale);
    let (a, b) = (set.rows(), scaled.rows());
    let scaled = same_bits(&a, &b, 2.0_f64.powi(-k * set.choice.degree()));
    relation("M3 DC-PSE rows keep their bits when all is scaled by 2^k").holds(scaled);
    let figures = |rows: &Rows| [rows.report().condition, rows.report().residual].map(f64::to_bits);
    prop_assert_eq!(figures(&a), figures(&b));
    Ok(())
}

fn any_factor<const D: usize>(random: &mut Random) -> TestCaseResult {
    let set = Set::<D>::draw(random);
    let scale = [3.0, 1e-7, between(random, 0.1, 10.0)][below(random, 3)];
    let scaled = set.map(|x| x.map(|x| x * scale), scale);
    let (a, b) = (set.rows(), scaled.rows());
    prop_assume!(same_neighbors(&a, &b));
    let found = difference(&a, &b, scale.powi(-set.choice.degree()));
    relation("M4 DC-PSE rows scaled by any factor, particles at x")
        .in_units("(1 + x/h) cond eps sum w", set.rounded())
        .at_most(ROUNDED, found);
    Ok(())
}

fn axes<const D: usize>(random: &mut Random) -> TestCaseResult {
    let set = Set::<D>::draw(random);
    let axis = below(random, D);
    let rows = set.rows();
    let mirror = |x: &[f64; D]| std::array::from_fn(|i| if i == axis { -x[i] } else { x[i] });
    let reflected = set.map(mirror, 1.0).rows();
    prop_assert!(same_neighbors(&rows, &reflected));
    let exponents = set.choice.beta.exponents();
    let sign = if exponents[axis].is_multiple_of(2) { 1.0 } else { -1.0 };
    let moved = relation("M5 DC-PSE rows with axes reflected or permuted").in_units("cond eps sum w", 1.0);
    moved.at_most(WEIGHTS, difference(&rows, &reflected, sign));
    // Squares of separations are added in another order.
    let beta = MultiIndex::new(std::array::from_fn(|i| exponents[(i + 1) % D]));
    let turned = set.map(|x| std::array::from_fn(|i| x[(i + 1) % D]), 1.0);
    let permuted = Set { choice: Choice { beta, ..set.choice }, ..turned }.rows();
    prop_assume!(same_neighbors(&rows, &permuted));
    moved.at_most(WEIGHTS, difference(&rows, &permuted, 1.0));
    Ok(())
}

fn rotation<const D: usize>(random: &mut Random) -> TestCaseResult {
    let set = Set::<D>::draw(random);
    let angle = between(random, 0.0, std::f64::consts::TAU);
    let (i, j) = (below(random, D - 1), D - 1);
    let (sin, cos) = angle.sin_cos();
    let turn = |x: &[f64; D]| {
        let mut turned = *x;
        (turned[i], turned[j]) = (cos * x[i] - sin * x[j], sin * x[i] + cos * x[j]);
        turned
    };
    let turned = set.map(turn, 1.0);
    let order = 1 + below(random, 4) as u32;
    let nearest = |set: &Set<D>, needed: usize| {
        let nearest = Nearest::build(&set.particles(), &Domain::open(), needed).unwrap().canonical();
        Selected::new(nearest, &set.targets).unwrap()
    };
    let laplacian = DcPse::at_order(Laplacian::<D>, order).unwrap();
    let needed = laplacian.fewest_neighbors::<D>().unwrap();
    let [a, b] = [&set, &turned].map(|set| laplacian.assemble(&nearest(set, needed)).unwrap());
    prop_assume!(same_neighbors(&a, &b));
    let turns = relation("M6 DC-PSE Laplacian rotated").in_units("(1 + x/h) cond eps sum w", set.rounded());
    turns.at_most(ROUNDED, difference(&a, &b, 1.0));

    let gradient = DcPse::at_order(Gradient::<D>, order).unwrap();
    let needed = gradient.fewest_neighbors::<D>().unwrap();
    let [a, b] = [&set, &turned].map(|set| gradient.assemble(&nearest(set, needed)).unwrap());
    prop_assume!(same_neighbors(&a, &b));
    for p in 0..a.targets() {
        let size: f64 = b.row(p).unwrap().weights.iter().flatten().map(|w| w.abs()).sum();
        let unit = f64::EPSILON * a.report().condition * size * set.rounded();
        let turns = relation("M6 DC-PSE gradient turns with the points").in_units("(1 + x/h) cond eps sum w", unit);
        for ((_, a), (_, b)) in by_source(&a, p).into_iter().zip(by_source(&b, p)) {
            let off = turn(&a).iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            turns.at_most(ROUNDED, off);
        }
    }
    Ok(())
}

fn numbering<const D: usize>(random: &mut Random) -> TestCaseResult {
    let set = Set::<D>::draw(random);
    let mut order: Vec<usize> = (0..set.points.len()).collect();
    for i in (1..order.len()).rev() {
        order.swap(i, below(random, i + 1));
    }
    let mut place = vec![0; order.len()];
    order.iter().enumerate().for_each(|(i, &p)| place[p] = i);
    let pick = |values: &[f64]| -> Vec<f64> { order.iter().map(|&p| values[p]).collect() };
    let renumbered = Set {
        points: order.iter().map(|&p| set.points[p]).collect(),
        targets: set.targets.iter().map(|&p| place[p]).collect(),
        fields: [pick(&set.fields[0]), pick(&set.fields[1])],
        ..set.clone()
    };
    // The sums of the moment matrix take another order too: bits are equal in canonical rows only, there over
    // providers as well.
    let canonical = |set: &Set<D>| match set.nearest {
        true => set.rows(),
        false => {
            let cells = CellList::build(&set.particles(), &Domain::open(), Cutoff(set.cutoff)).unwrap();
            set.assemble(cells.canonical())
        }
    };
    let (a, b) = (canonical(&set), canonical(&renumbered));
    for i in 0..a.targets() {
        let (a, b) = (row(&a, i), row(&b, i));
        prop_assert!(a.sources.iter().zip(b.sources).all(|(&q, &r)| q as usize == order[r as usize]));
        prop_assert!(a.weights.iter().zip(b.weights).all(|(a, b)| a[0].to_bits() == b[0].to_bits()));
        prop_assert_eq!(a.diagonal[0].to_bits(), b.diagonal[0].to_bits());
    }
    let (f, g) = (apply(&a, &set.fields[0]), apply(&b, &renumbered.fields[0]));
    let same = f.iter().zip(&g).all(|(f, g)| f.to_bits() == g.to_bits());
    relation("M7 DC-PSE results keep their bits under renumbering, canonical").holds(same);
    prop_assert!(set.nearest || same_bits(&a, &set.assemble(set.brute_force().canonical()), 1.0));
    Ok(())
}

fn linearity<const D: usize>(random: &mut Random) -> TestCaseResult {
    let set = Set::<D>::draw(random);
    let [a, b] = [(); 2].map(|()| between(random, -10.0, 10.0));
    let rows = set.rows();
    let [f, g] = &set.fields;
    let mixed: Vec<f64> = f.iter().zip(g).map(|(f, g)| a * f + b * g).collect();
    let (of_f, of_g, of_mixed) = (apply(&rows, f), apply(&rows, g), apply(&rows, &mixed));
    for (i, &p) in set.targets.iter().enumerate() {
        // The mixture is rounded before its differences are taken.
        let row = row(&rows, i);
        let size = |p: usize| (a * f[p]).abs().max((b * g[p]).abs());
        let pairs = row.sources.iter().zip(row.weights);
        let before: f64 = pairs.map(|(&q, w)| w[0].abs() * size(q as usize).max(size(p))).sum();
        let terms = a.abs() * absolute(&rows, i, p, f) + b.abs() * absolute(&rows, i, p, g) + before;
        let linear = relation("M8 DC-PSE rows are linear").in_units("eps sum abs", f64::EPSILON * terms);
        linear.at_most(TERMS, (of_mixed[i] - (a * of_f[i] + b * of_g[i])).abs());
    }
    Ok(())
}

fn constants<const D: usize>(random: &mut Random) -> TestCaseResult {
    // With one cutoff there is one epsilon.
    let set = Set { nearest: false, ..Set::<D>::draw(random) };
    let (choice, c) = (set.choice, between(random, -1e3, 1e3));
    let rows = set.rows();
    let report = rows.report();
    let epsilon = set.cutoff / parops::CUTOFF_OVER_EPSILON;
    let conditions = 0.5 * choice.needed() as f64;
    let factorial = choice.beta.factorial().unwrap() as f64;
    for out in apply(&rows, &vec![c; set.points.len()]) {
        if choice.is_difference() {
            relation("M9 DC-PSE derivative of a constant, difference form").at_most(0.0, out.abs());
        } else {
            // '+' counts a constant twice; the value itself, degree 0, is reproduced.
            let (exact, twice) = if choice.degree() == 0 { (c, 1.0) } else { (0.0, 2.0) };
            let scale = twice * factorial * epsilon.powi(-choice.degree());
            let unit = f64::EPSILON * (conditions * report.condition * scale + 0.25 * TERMS * report.sum_abs);
            relation("M9 DC-PSE derivative of a constant, sum form")
                .in_units("(l cond beta! + 2 sum w) eps", unit * c.abs())
                .at_most(4.0, (out - exact).abs());
        }
    }
    Ok(())
}

fn beyond_the_cutoff<const D: usize>(random: &mut Random) -> TestCaseResult {
    let set = Set::<D>::draw(random);
    let mut wider = set.clone();
    // Beyond the diagonal too, and beyond three widenings of the support by 1.15.
    let far = |random: &mut Random| std::array::from_fn(|axis| random.uniform() + if axis == 0 { 5.0 } else { 0.0 });
    wider.points.extend((0..1 + below(random, 19)).map(|_| far(random)));
    let same = same_bits(&set.rows(), &wider.rows(), 1.0);
    relation("M10 DC-PSE rows keep their bits with particles beyond the cutoff").holds(same);
    Ok(())
}

fn periods<const D: usize>(random: &mut Random) -> TestCaseResult {
    let choice = Choice::<D>::draw(random);
    let side = TORUS[D - 1];
    let points = jittered::<D>(side, random);
    let targets: Vec<usize> = (0..TARGETS[D - 1]).map(|_| below(random, points.len())).collect();
    // A whole ball holds in half the radius what a part of one does.
    let cutoff = Cutoff(0.5 * (choice.radius() + 1.0) / side as f64);
    let moved = |by: [f64; D]| points.iter().map(move |x| std::array::from_fn(|axis| x[axis] + by[axis]));
    let build = |points: Vec<[f64; D]>, width: f64, targets: &[usize]| {
        let torus = Domain::periodic([0.0; D], [width; D]).unwrap();
        let cells = CellList::build(&Particles::new(points).unwrap(), &torus, cutoff).unwrap().canonical();
        choice.method().assemble(&Selected::new(cells, targets).unwrap()).unwrap()
    };
    let rows = build(points.clone(), 1.0, &targets);
    let shift = std::array::from_fn(|_| below(random, 7) as f64 - 3.0);
    let shifted = build(moved(shift).collect(), 1.0, &targets);
    relation("M11 DC-PSE rows keep their bits in a box shifted by its length").holds(same_bits(&rows, &shifted, 1.0));

    let tiles = (0..1 << D).map(|tile| std::array::from_fn(|axis| f64::from((tile >> axis) & 1_u8)));
    let copies: Vec<usize> = (0..1 << D)
        .flat_map(|tile| targets.iter().map(move |p| (tile, p)))
        .map(|(tile, p)| tile * points.len() + p)
        .collect();
    let tiled = build(tiles.flat_map(moved).collect(), 2.0, &copies);
    let f: Vec<f64> = points.iter().map(|_| random.normal()).collect();
    let (a, b) = (apply(&rows, &f), apply(&tiled, &f.repeat(1 << D)));
    for (copy, b) in b.iter().enumerate() {
        let i = copy % targets.len();
        let of_tile = relation("M11 DC-PSE results on a box tiled 2^D times");
        let of_tile = of_tile.in_units("eps sum abs", f64::EPSILON * absolute(&rows, i, targets[i], &f));
        of_tile.at_most(TERMS, (a[i] - b).abs());
    }
    Ok(())
}

fn inputs<const D: usize>(random: &mut Random) -> TestCaseResult {
    let set = Set::<D>::draw(random);
    let particles = set.particles();
    let cells = CellList::build(&particles, &Domain::open(), Cutoff(set.cutoff)).unwrap();
    let provider = Selected::new(cells, &set.targets).unwrap();
    let method = set.choice.method();
    let rows = method.assemble(&provider).unwrap();
    let kept = rows.clone();
    let f = set.fields[0].clone();
    let first = apply(&rows, &f);
    let again = apply(&rows, &f) == first;
    let unchanged = again && f == set.fields[0] && rows == kept && particles.points() == &set.points[..];
    relation("M12 DC-PSE inputs are unchanged by every call").holds(unchanged);
    prop_assert_eq!(&method.assemble(&provider).unwrap(), &kept);
    Ok(())
}

#[test]
fn nearest_neighbors_and_one_cutoff_give_the_same_bits_where_they_hold_the_same_neighbors() {
    let particles = Particles::new(jittered::<2>(7, &mut Random::new(5))).unwrap();
    let nearest = Nearest::build(&particles, &Domain::open(), 20).unwrap();
    let method = DcPse::<Laplacian<2>, 2>::new();
    let rows = method.assemble(&(&nearest).canonical()).unwrap();
    for p in 0..particles.len() {
        let all = BruteForce::build(&particles, &Domain::open(), Cutoff(nearest.cutoff(p))).unwrap();
        let oracle = method.assemble(&Selected::new(all.canonical(), &[p]).unwrap()).unwrap();
        let (a, b) = (rows.row(p).unwrap(), oracle.row(0).unwrap());
        assert!(a.sources == b.sources && a.weights == b.weights);
    }
}
