//! Providers against brute force, as sets, in bits; boundaries, ties, poor sets; foreign providers.

use parops::{BruteForce, CellList, Cutoff, Domain, Face, Neighbors, Particles, Random};
use proptest::prelude::*;

fn cases() -> u32 {
    std::env::var("PAROPS_CASES").ok().and_then(|cases| cases.parse().ok()).unwrap_or(1000)
}

fn config(cases: u32) -> ProptestConfig {
    ProptestConfig { cases, failure_persistence: None, ..ProptestConfig::default() }
}

/// One row as a sorted set of (source, bits of the separation, sign).
fn row<P: Neighbors<D>, const D: usize>(provider: &P, p: usize, cutoff: f64) -> Vec<(usize, [u64; D], i8)> {
    let mut row = Vec::new();
    // Adding zero makes -0 and +0 one number.
    provider.for_each(p, cutoff, |n| row.push((n.q, n.separation.map(|s| (s + 0.0).to_bits()), n.sign)));
    row.sort_unstable();
    row
}

fn assert_same_rows<const D: usize>(a: &impl Neighbors<D>, b: &impl Neighbors<D>, cutoff: f64) {
    assert_eq!((a.targets(), a.sources()), (b.targets(), b.sources()));
    for p in 0..a.targets() {
        assert_eq!(a.center(p), b.center(p));
        assert_eq!(row(a, p, cutoff), row(b, p, cutoff), "target {p}");
        assert_eq!(a.count(p, cutoff), row(b, p, cutoff).len(), "target {p}");
    }
}

const AXES: [[Face; 2]; 9] = [
    [Face::Periodic, Face::Periodic],
    [Face::Open, Face::Open],
    [Face::MirrorEven, Face::Open],
    [Face::Open, Face::MirrorEven],
    [Face::MirrorOdd, Face::Open],
    [Face::Open, Face::MirrorOdd],
    [Face::MirrorEven, Face::MirrorOdd],
    [Face::MirrorOdd, Face::MirrorEven],
    [Face::MirrorOdd, Face::MirrorOdd],
];

/// A set of one of nine shapes in the unit box, on a coarse grid of coordinates where ties are wanted.
fn shaped<const D: usize>(shape: usize, n: usize, cutoff: f64, seed: u64) -> Vec<[f64; D]> {
    let mut random = Random::new(seed);
    let mut points: Vec<[f64; D]> = (0..n).map(|_| std::array::from_fn(|_| random.uniform())).collect();
    for (i, point) in points.iter_mut().enumerate() {
        match shape {
            // Ties: multiples of the cutoff / 2, and of 1/8.
            1 => point.iter_mut().for_each(|x| *x = ((*x / cutoff * 2.0).floor() * cutoff / 2.0).min(1.0)),
            2 => point.iter_mut().for_each(|x| *x = (*x * 8.0).floor() / 8.0),
            // A line, a plane, duplicates.
            3 => point.iter_mut().skip(1).for_each(|x| *x = 0.5),
            4 => point[0] = 0.25,
            5 => point.iter_mut().for_each(|x| *x = (*x * 3.0).floor() / 3.0),
            // A cluster, with few others.
            6 if i % 8 != 0 => point.iter_mut().for_each(|x| *x = 0.9 + 1e-3 * *x),
            // On faces, and one ulp inside of them.
            7 => point.iter_mut().for_each(|x| {
                *x = [0.0, 0.0_f64.next_up(), cutoff, cutoff.next_up(), 1.0_f64.next_down(), 1.0, 1.0 - cutoff, *x]
                    [(*x * 64.0) as usize % 8];
            }),
            _ => {}
        }
    }
    points
}

fn domain<const D: usize>(kinds: [usize; 3]) -> Domain<D> {
    Domain::new([0.0; D], [1.0; D], std::array::from_fn(|axis| AXES[kinds[axis]])).unwrap()
}

fn cell_list_equals_oracle<const D: usize>(kinds: [usize; 3], shape: usize, n: usize, cutoff: f64, seed: u64) {
    let particles = Particles::new(shaped::<D>(shape, n, cutoff, seed)).unwrap();
    let domain = domain::<D>(kinds);
    let oracle = BruteForce::build(&particles, &domain, Cutoff(cutoff)).unwrap();
    let cells = CellList::build(&particles, &domain, Cutoff(cutoff)).unwrap();
    for query in [cutoff, 0.7 * cutoff] {
        assert_same_rows(&oracle, &cells, query);
    }
    let targets = shaped::<D>(shape, 20, cutoff, seed ^ 1);
    let oracle = BruteForce::build_at(&targets, &particles, &domain, Cutoff(cutoff)).unwrap();
    let cells = CellList::build_at(&targets, &particles, &domain, Cutoff(cutoff)).unwrap();
    assert_same_rows(&oracle, &cells, cutoff);
}

proptest! {
    #![proptest_config(config(cases()))]

    #[test]
    fn cell_list_equals_brute_force_on_small_sets(
        kinds in [0_usize..9, 0_usize..9, 0_usize..9],
        shape in 0_usize..9,
        n in prop::sample::select(vec![0_usize, 1, 2, 33]),
        cutoff in prop_oneof![Just(0.5), Just(0.25), Just(0.125), 0.02..0.5],
        seed: u64,
    ) {
        cell_list_equals_oracle::<1>(kinds, shape, n, cutoff, seed);
        cell_list_equals_oracle::<2>(kinds, shape, n, cutoff, seed);
        cell_list_equals_oracle::<3>(kinds, shape, n, cutoff, seed);
    }
}

proptest! {
    #![proptest_config(config(cases() / 25))]

    #[test]
    fn cell_list_equals_brute_force_on_larger_sets(
        kinds in [0_usize..9, 0_usize..9, 0_usize..9],
        shape in 0_usize..9,
        n in 200_usize..400,
        cutoff in prop_oneof![Just(0.5), Just(0.25), Just(0.125), 0.02..0.5],
        seed: u64,
    ) {
        cell_list_equals_oracle::<1>(kinds, shape, n, cutoff, seed);
        cell_list_equals_oracle::<2>(kinds, shape, n, cutoff, seed);
        cell_list_equals_oracle::<3>(kinds, shape, n, cutoff, seed);
    }
}
