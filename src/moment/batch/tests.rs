//! Stencils solved side by side, against the same stencils solved alone, by QR, and by singular values.

use nalgebra::DMatrix;
use proptest::prelude::*;

use super::{Batch, BatchScratch, BatchSystem};
use crate::lanes::{Common, Vectors};
use crate::moment::{Lu, MomentScratch, MomentSolver, MomentSystem, Qr, Rung, Solution, Window, Windows};
use crate::multi_index::{MultiIndex, Term, graded};

const RADIUS: f64 = 2.2;

fn cases() -> u32 {
    std::env::var("PAROPS_CASES").ok().and_then(|text| text.parse().ok()).unwrap_or(1000)
}

/// Numbers in [-1, 1), from a multiplicative generator with the constants of Knuth.
fn noise(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed;
    move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 * 2.0_f64.powi(-52) - 1.0
    }
}

/// The n nearest neighbors of the origin in a lattice displaced by up to 0.3 h, on one side of the first `half` axes,
/// scaled to the radius.
fn jittered<const D: usize>(n: usize, half: usize, seed: u64) -> Vec<[f64; D]> {
    let (mut noise, reach) = (noise(seed), 7_i32);
    let mut found = Vec::new();
    for node in 0..(2 * reach + 1).pow(D as u32) {
        let mut rest = node;
        let node: [i32; D] = std::array::from_fn(|_| {
            let i = rest % (2 * reach + 1) - reach;
            rest /= 2 * reach + 1;
            i
        });
        let place = node.map(|i| f64::from(i) + 0.3 * noise());
        if node != [0; D] && node[..half].iter().all(|&i| i >= 0) {
            found.push(place);
        }
    }
    let square = |z: &[f64; D]| z.iter().map(|x| x * x).sum::<f64>();
    found.sort_by(|a, b| square(a).total_cmp(&square(b)));
    found.truncate(n);
    let scale = RADIUS / found.last().map_or(1.0, square).sqrt();
    found.iter().map(|z| z.map(|x| x * scale)).collect()
}

fn laplacian<const D: usize>() -> Vec<Term<D>> {
    let second = |axis| {
        let mut exponents = [0; D];
        exponents[axis] = 2;
        Term { index: MultiIndex::new(exponents), factor: 1.0 }
    };
    (0..D).map(second).collect()
}

fn all_of_degree<const D: usize>(degree: u32) -> Vec<Vec<Term<D>>> {
    graded(degree, degree).map(|index| vec![Term { index, factor: 1.0 }]).collect()
}

type Found = (Option<Solution<f64>>, Vec<f64>);

fn solve<const D: usize, const L: usize>(
    system: &BatchSystem<D>,
    outputs: usize,
    stencils: [&[[f64; D]]; L],
    window: Window,
    scratch: &mut BatchScratch<L>,
) -> [Found; L] {
    let mut weights = stencils.map(|z| vec![f64::NAN; outputs * z.len()]);
    let windows = Windows { shape: window, radius: [RADIUS; L], middle: [[0.0; D]; L] };
    let solutions = system.solve(stencils, windows, scratch, weights.each_mut().map(Vec::as_mut_slice));
    let mut solutions = solutions.into_iter();
    weights.map(|weights| (solutions.next().flatten(), weights))
}

/// One stencil with the vectors that every machine has.
fn solve_common<const D: usize>(system: &BatchSystem<D>, outputs: usize, z: &[[f64; D]], window: Window) -> Found {
    let mut weights = vec![f64::NAN; outputs * z.len()];
    let (scratch, w) = (&mut BatchScratch::default(), [weights.as_mut_slice()]);
    let windows = Windows { shape: window, radius: [RADIUS], middle: [[0.0; D]] };
    let [solution] = Common.run(Batch { system, z: [z], windows, scratch, w });
    (solution, weights)
}

fn bits((solution, weights): &Found) -> Option<(Rung, [u64; 3], Vec<u64>)> {
    let Solution { rung, condition, residual, .. } = solution.as_ref()?;
    let numbers = [*condition, residual.absolute, residual.terms].map(f64::to_bits);
    Some((*rung, numbers, weights.iter().map(|w| w.to_bits()).collect()))
}

/// Stencils of all kinds: jittered, one-sided, of unequal length, none, all in one place, too few, on a line, not a number.
fn mixture<const D: usize>(l: usize, seed: u64) -> [Vec<[f64; D]>; 8] {
    [
        jittered(2 * l, 0, seed),
        jittered(2 * l + 3, 1, seed + 1),
        Vec::new(),
        vec![[0.5; D]; 2 * l + 1],
        jittered(l - 1, 0, seed + 2),
        jittered(3 * l, D, seed + 3),
        (0..2 * l).map(|i| [i as f64 / l as f64; D]).collect(),
        (0..2 * l).map(|i| [if i == 5 { f64::NAN } else { i as f64 / l as f64 }; D]).collect(),
    ]
}

fn check_lanes<const D: usize>(order: u32, shift: usize, window: Window, seed: u64) {
    let outputs = all_of_degree::<D>(2);
    let system = MomentSystem::new(&outputs, 2, order, 1).expect("legal");
    let (l, k) = (system.conditions(), outputs.len());
    let batch = BatchSystem::new(&system);
    let stencils = mixture::<D>(l, seed);
    let at = |i: usize| stencils[(i + shift) % 8].as_slice();
    let alone: Vec<_> = (0..8).map(|i| bits(&solve_common(&batch, k, at(i), window))).collect();
    let one = &mut BatchScratch::<1>::default();
    assert!((0..8).all(|i| bits(&solve(&batch, k, [at(i)], window, one)[0]) == alone[i]));
    let eight = solve(&batch, k, std::array::from_fn(at), window, &mut BatchScratch::<8>::default());
    assert_eq!(eight.each_ref().map(bits).as_slice(), alone);
    let (four, two) = (&mut BatchScratch::<4>::default(), &mut BatchScratch::<2>::default());
    for i in 0..2 {
        let found = solve(&batch, k, std::array::from_fn(|j| at(4 * i + j)), window, four);
        assert_eq!(found.each_ref().map(bits).as_slice(), &alone[4 * i..][..4]);
    }
    for i in 0..4 {
        let found = solve(&batch, k, [at(2 * i), at(2 * i + 1)], window, two);
        assert_eq!(found.each_ref().map(bits).as_slice(), &alone[2 * i..][..2]);
    }
    for (i, (solution, _)) in eight.iter().enumerate() {
        let kind = (i + shift) % 8;
        let sharp = solution.is_some_and(|solution| solution.is_sharp(l, system.largest_required()));
        match kind {
            0 | 1 => assert!(sharp, "{D} {order} {kind} {solution:?}"),
            // A corner may need QR; the others have no solution, though rounding may leave them their pivots.
            5 => {}
            _ => assert!(!sharp, "{D} {order} {kind} {solution:?}"),
        }
    }
}

/// Compares one stencil with direct sums, QR and singular values.
fn check_solution<const D: usize>(degree: u32, order: u32, low: u32, window: Window, z: &[[f64; D]]) {
    let outputs = if degree == 2 { vec![laplacian()] } else { all_of_degree(degree) };
    let k = outputs.len();
    let mut system = MomentSystem::new(&outputs, degree, order, low).expect("legal");
    let batch = BatchSystem::new(&system);
    let [(solution, w)] = solve(&batch, k, [z], window, &mut BatchScratch::default());
    let solution = solution.expect("a sound stencil");
    system.fill(z, window, RADIUS);
    assert!(solution.is_sharp(system.conditions(), system.largest_required()), "{solution:?}");
    assert_eq!(solution.rank, system.conditions());

    let basis: Vec<MultiIndex<D>> = graded(low, degree + order - 1).collect();
    let (mut miss, mut most) = (0.0_f64, 0.0_f64);
    for (k, w) in w.chunks_exact(z.len()).enumerate() {
        for (alpha, &b) in basis.iter().zip(system.required(k)) {
            let terms = z.iter().zip(w).map(|(z, w)| w * alpha.power(z));
            let (sum, absolute) = terms.fold((0.0, 0.0), |(sum, all), term| (sum + term, all + term.abs()));
            miss = miss.max((sum - b).abs());
            most = most.max(absolute);
        }
    }
    // Two sums of n terms, each a product of up to |alpha| factors.
    let rounding = 2.0 * (z.len() as f64 + 16.0) * f64::EPSILON * most;
    assert!((solution.residual.absolute - miss).abs() <= rounding, "{solution:?} {miss:e}");
    assert!((solution.residual.terms - most).abs() <= rounding, "{solution:?} {most:e}");

    let columns = basis.iter().flat_map(|alpha| {
        let root = |z: &[f64; D]| window.root(z.iter().map(|x| x * x).sum(), RADIUS);
        let column: Vec<f64> = z.iter().map(|z| root(z) * alpha.power(z)).collect();
        let norm = column.iter().map(|x| x * x).sum::<f64>().sqrt();
        let scale = (-norm.log2().ceil()).exp2();
        column.into_iter().map(move |x| x * scale)
    });
    let values = DMatrix::from_iterator(z.len(), basis.len(), columns).singular_values();
    let condition = values.max() / values.min();
    assert!((0.1..=1.2).contains(&(solution.condition / condition)), "{solution:?} {condition:e}");

    let mut expected = vec![0.0; w.len()];
    let by_qr = Qr.solve(&system, &mut MomentScratch::default(), &mut expected).expect("full rank");
    let largest = expected.iter().fold(0.0_f64, |largest, w| largest.max(w.abs()));
    // Both are backward stable in B; the constant covers the growth with n and l.
    let tolerance = 100.0 * f64::EPSILON * by_qr.condition * largest;
    assert!(w.iter().zip(&expected).all(|(w, expected)| (w - expected).abs() <= tolerance));
}

#[test]
fn condition_does_not_depend_on_the_unit_of_length_and_is_never_above_the_true_one() {
    fn check<const D: usize>(degree: u32, order: u32, low: u32, half: usize, seed: u64) {
        let outputs = all_of_degree::<D>(degree);
        let mut system = MomentSystem::new(&outputs, degree, order, low).expect("legal");
        let batch = BatchSystem::new(&system);
        let z = jittered::<D>(2 * system.conditions() + 1, half, seed);
        let solve = |scale: f64| {
            let scaled: Vec<[f64; D]> = z.iter().map(|z| z.map(|x| x * scale)).collect();
            let mut w = vec![f64::NAN; outputs.len() * z.len()];
            let windows = Windows { shape: Window::Wendland, radius: [1.1 * RADIUS * scale], middle: [[0.0; D]] };
            let [solution] = batch.solve([&scaled], windows, &mut BatchScratch::default(), [&mut w]);
            (solution.expect("sound"), w)
        };
        let (solution, w) = solve(1.0);
        for exponent in [-40, -3, 1, 40] {
            let scale = 2.0_f64.powi(exponent);
            let (scaled, v) = solve(scale);
            assert_eq!(scaled.condition, solution.condition, "{D} {degree} {order} {exponent}");
            // A correction of some outputs depends on what they miss, which has a unit.
            if [scaled.rung, solution.rung] == [Rung::Cholesky; 2] {
                let unit = scale.powi(degree as i32);
                assert!(v.iter().zip(&w).all(|(v, w)| v * unit == *w), "{D} {degree} {order} {exponent}");
            }
        }
        system.fill(&z, Window::Wendland, 1.1 * RADIUS);
        let mut expected = vec![0.0; w.len()];
        let exact = Lu.solve(&system, &mut MomentScratch::default(), &mut expected).expect("regular").condition;
        // Of A and of the sums of the iterations.
        let rounding = 16.0 * f64::EPSILON * exact * exact * system.conditions() as f64;
        let ratio = solution.condition / exact;
        assert!(ratio > 0.3 && ratio < 1.0 + rounding, "{D} {degree} {order}: {ratio}");
    }
    for seed in 0..20 {
        for half in 0..2 {
            check::<1>(2, 3, 1, half, seed);
            check::<2>(2, 2, 1, half, seed);
            check::<2>(1, 2, 0, half, seed);
            check::<2>(1, 3, 0, half, seed);
            check::<2>(2, 4, 1, half, seed);
            check::<3>(0, 1, 0, half, seed);
            check::<3>(1, 2, 1, half, seed);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: cases().div_ceil(20), failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn bits_of_a_stencil_depend_neither_on_lanes_and_vectors_nor_on_what_stands_beside_it(
        shift in 0_usize..8,
        window in prop_oneof![Just(Window::Exponential), Just(Window::Wendland)],
        seed in any::<u32>(),
    ) {
        for order in [2, 4] {
            check_lanes::<2>(order, shift, window, u64::from(seed));
        }
        check_lanes::<3>(2, shift, window, u64::from(seed));
    }

    #[test]
    fn solution_agrees_with_direct_sums_singular_values_and_qr(
        window in prop_oneof![Just(Window::Exponential), Just(Window::Wendland)],
        (half, extra) in (0_usize..2, 1_usize..6),
        seed in any::<u32>(),
    ) {
        let seed = u64::from(seed);
        check_solution::<1>(2, 3, 1, window, &jittered(8 + extra, half, seed));
        check_solution::<2>(2, 2, 1, window, &jittered(18 + extra, half, seed));
        check_solution::<2>(2, 4, 1, window, &jittered(40 + extra, half, seed));
        check_solution::<2>(1, 3, 0, window, &jittered(20 + extra, half, seed));
        check_solution::<3>(2, 2, 1, window, &jittered(38 + extra, half, seed));
        check_solution::<3>(1, 1, 1, window, &jittered(8 + extra, half, seed));
        check_solution::<3>(0, 2, 0, window, &jittered(8 + extra, half, seed));
    }
}

#[test]
fn one_sided_stencils_are_corrected_and_full_ones_beside_them_are_not() {
    let system = MomentSystem::new(&[laplacian::<3>()], 2, 4, 1).expect("legal");
    let batch = BatchSystem::new(&system);
    let [full, half] = [0, 2].map(|half| jittered::<3>(120, half, 1));
    let found = solve(&batch, 1, [&full, &half], Window::Exponential, &mut BatchScratch::default());
    let rungs = found.each_ref().map(|(solution, _)| solution.map(|solution| solution.rung));
    assert_eq!(rungs, [Some(Rung::Cholesky), Some(Rung::Corrected)]);
    assert!(found.iter().all(|(solution, _)| solution.is_some_and(|solution| solution.is_sharp(55, 2.0))));
}

#[test]
fn every_dimension_is_legal_and_so_are_no_conditions_or_too_high_ones() {
    fn check<const D: usize>(order: u32) {
        let n = 2 * graded::<D>(1, order + 1).count();
        let mut noise = noise(D as u64);
        let z: Vec<[f64; D]> = (0..n + 7).map(|_| std::array::from_fn(|_| noise())).collect();
        check_solution::<D>(2, order, 1, Window::Exponential, &z);
    }
    check::<4>(1);
    check::<5>(1);
    check::<6>(1);
    // No degree from 5 to 2; degrees to 200, whose pairs do not fit eight bits, without outputs because 200! does not fit.
    for (outputs, degree, low) in [(vec![laplacian::<1>()], 2, 5), (Vec::new(), 200, 1)] {
        let system = BatchSystem::new(&MomentSystem::new(&outputs, degree, 1, low).expect("legal"));
        let z = jittered::<1>(9, 0, 1);
        let [(solution, _)] = solve(&system, outputs.len(), [&z], Window::Exponential, &mut BatchScratch::default());
        assert!(solution.is_none());
    }
}
