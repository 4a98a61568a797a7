//! Providers against brute force, as sets, in bits; boundaries, ties, poor sets; foreign providers.

use crate::cases::cases;
use crate::properties::properties;
use parops::{
    BruteForce, CellList, Cutoff, Domain, Error, Face, LENGTH_HIGH, LENGTH_LOW, Neighbor, NeighborError, NeighborList,
    Neighbors, ParticleError, Particles, Random, Stencil, testing::Promise,
};
use proptest::prelude::*;

/// One row as a sorted set of (source, bits of the separation, sign).
fn row<P: Neighbors<D>, const D: usize>(provider: &P, p: usize, cutoff: f64) -> Vec<(usize, [u64; D], i8)> {
    let mut row = Vec::new();
    // Adding zero makes -0 and +0 one number.
    provider.for_each(p, cutoff, |n| row.push((n.q, n.separation.map(|s| (s + 0.0).to_bits()), n.sign)));
    row.sort_unstable();
    row
}

fn agree(text: &'static str) -> Promise {
    Promise::new("Neighbor lists", text)
}

/// The targets whose rows differ, as sets.
fn differing<const D: usize>(a: &impl Neighbors<D>, b: &impl Neighbors<D>, cutoff: f64) -> Vec<usize> {
    assert_eq!((a.targets(), a.sources()), (b.targets(), b.sources()));
    let differs = |&p: &usize| {
        let (of_a, of_b) = (row(a, p, cutoff), row(b, p, cutoff));
        a.center(p) != b.center(p) || of_a != of_b || a.count(p, cutoff) != of_b.len()
    };
    (0..a.targets()).filter(differs).collect()
}

fn assert_same_rows<const D: usize>(a: &impl Neighbors<D>, b: &impl Neighbors<D>, cutoff: f64) {
    assert_eq!(differing(a, b, cutoff), [0; 0]);
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
    let same = agree("cell list against brute force: any faces, ties, clusters, rows as sets to the bit");
    for query in [cutoff, 0.7 * cutoff] {
        same.equal(&differing(&oracle, &cells, query)[..], &[]);
    }
    let targets = shaped::<D>(shape, 20, cutoff, seed ^ 1);
    let oracle = BruteForce::build_at(&targets, &particles, &domain, Cutoff(cutoff)).unwrap();
    let cells = CellList::build_at(&targets, &particles, &domain, Cutoff(cutoff)).unwrap();
    same.equal(&differing(&oracle, &cells, cutoff)[..], &[]);
}

proptest! {
    #![proptest_config(properties(cases()))]

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
    #![proptest_config(properties(cases() / 25))]

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

#[test]
fn cell_list_equals_brute_force_at_a_thousand_particles() {
    for (seed, shape) in (0..9).enumerate() {
        let kinds = [shape, (shape + 4) % 9, (shape + 7) % 9];
        cell_list_equals_oracle::<2>(kinds, shape, 1000, 0.125, seed as u64);
        cell_list_equals_oracle::<3>(kinds, shape, 1000, 0.25, seed as u64);
    }
}

#[test]
fn brute_force_equals_explicit_copies_of_the_box() {
    // M11 as sets: a torus seen as one box among 3^2 copies, whose coordinates are exact (multiples of 1/64).
    let mut random = Random::new(5);
    let points: Vec<[f64; 2]> = (0..40).map(|_| [0; 2].map(|_| (random.uniform() * 64.0).floor() / 64.0)).collect();
    let cutoff = 0.4375;
    let torus = Domain::periodic([0.0; 2], [1.0; 2]).unwrap();
    let own = BruteForce::build(&Particles::new(points.clone()).unwrap(), &torus, Cutoff(cutoff)).unwrap();
    let mut copies = Vec::new();
    for shift in
        [[0.0, 0.0], [0.0, 1.0], [0.0, -1.0], [1.0, 0.0], [-1.0, 0.0], [1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0; 2]]
    {
        copies.extend(points.iter().map(|x| [x[0] + shift[0], x[1] + shift[1]]));
    }
    let tiled = BruteForce::build(&Particles::new(copies).unwrap(), &Domain::open(), Cutoff(cutoff)).unwrap();
    for p in 0..points.len() {
        let mut expected = row(&tiled, p, cutoff);
        expected.iter_mut().for_each(|neighbor| neighbor.0 %= points.len());
        expected.sort_unstable();
        agree("M11 rows of brute force on a torus are those among copies of the box")
            .equal(&row(&own, p, cutoff), &expected);
    }
}

#[test]
fn rows_of_a_torus_tiled_twice_are_the_same_rows() {
    // M11: the box 2^D times, coordinates multiples of 1/64, so that the bits are equal.
    let mut random = Random::new(6);
    let points: Vec<[f64; 2]> = (0..60).map(|_| [0; 2].map(|_| (random.uniform() * 64.0).floor() / 64.0)).collect();
    let tiles = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]];
    let tiled = tiles.iter().flat_map(|t| points.iter().map(move |x| [x[0] + t[0], x[1] + t[1]])).collect();
    let build = |points, width| {
        let torus = Domain::periodic([0.0; 2], [width; 2]).unwrap();
        CellList::build(&Particles::new(points).unwrap(), &torus, Cutoff(0.5)).unwrap()
    };
    let (small, large) = (build(points.clone(), 1.0), build(tiled, 2.0));
    for p in 0..points.len() * tiles.len() {
        let mut found = row(&large, p, 0.5);
        found.iter_mut().for_each(|neighbor| neighbor.0 %= points.len());
        found.sort_unstable();
        agree("M11 rows of a torus tiled twice").equal(&found, &row(&small, p % points.len(), 0.5));
    }
}

#[test]
fn rows_keep_their_bits_when_the_whole_box_is_shifted_around_the_torus() {
    let mut random = Random::new(8);
    let points: Vec<[f64; 2]> = (0..60).map(|_| [0; 2].map(|_| (random.uniform() * 64.0).floor() / 64.0)).collect();
    let torus = Domain::periodic([0.0; 2], [1.0; 2]).unwrap();
    let build = |points| CellList::build(&Particles::new(points).unwrap(), &torus, Cutoff(0.3)).unwrap();
    let shifted = build(points.iter().map(|x| [x[0] + 3.0, x[1] - 2.0]).collect());
    assert_same_rows(&build(points), &shifted, 0.3);
}

#[test]
fn particles_beyond_the_cutoff_do_not_touch_a_row() {
    // M10, with the far ones on all scales, so that grid and table change.
    let mut random = Random::new(9);
    let near: Vec<[f64; 2]> = (0..80).map(|_| [0; 2].map(|_| random.uniform())).collect();
    let build = |points| CellList::build(&Particles::new(points).unwrap(), &Domain::open(), Cutoff(0.25)).unwrap();
    let alone = build(near.clone());
    for scale in [2.0, 1e3, 1e9] {
        let mut all = near.clone();
        all.extend((0..30).map(|_| [1.5 + scale * random.uniform(), -0.5 - scale * random.uniform()]));
        let joined = build(all);
        let untouched = agree("M10 rows with particles beyond the cutoff");
        (0..near.len()).for_each(|p| untouched.equal(&row(&joined, p, 0.25), &row(&alone, p, 0.25)));
    }
}

#[test]
fn outliers_at_twelve_magnitudes_keep_the_rows_and_the_memory() {
    let lattice = Particles::lattice([0.0; 3], [1.0; 3], [8; 3]).unwrap();
    let mut points = lattice.points().to_vec();
    points.extend([[1e12, 0.0, 0.0], [0.0, -1e12, 1e12], [1e12, 0.01, 0.0]]);
    let particles = Particles::new(points).unwrap();
    let cutoff = Cutoff(0.25);
    let cells = CellList::build(&particles, &Domain::open(), cutoff).unwrap();
    let oracle = BruteForce::build(&particles, &Domain::open(), cutoff).unwrap();
    assert_same_rows(&oracle, &cells, cutoff.0);
    assert_eq!(cells.count(512, cutoff.0), 1);
    // A target so far away that the slack of its rounding spans very many cells.
    let targets = [[1e40, 0.0, 0.0], [0.5, 0.5, 0.5]];
    let cells = CellList::build_at(&targets, &particles, &Domain::open(), cutoff).unwrap();
    let oracle = BruteForce::build_at(&targets, &particles, &Domain::open(), cutoff).unwrap();
    assert_same_rows(&oracle, &cells, cutoff.0);
}

#[test]
fn cells_beyond_exact_integers_are_refused() {
    let particles = Particles::new(vec![[0.0, 0.0], [0.0, 1e30]]).unwrap();
    let error = CellList::build(&particles, &Domain::open(), Cutoff(1.0)).unwrap_err();
    let limit = 2.0_f64.powi(53);
    assert!(
        matches!(*error.kind(), parops::ErrorKind::Neighbor(NeighborError::Cells { axis: 1, cells, limit: l })
        if cells > limit && l == limit),
        "{error}"
    );
    // The oracle has no cells.
    assert_eq!(BruteForce::build(&particles, &Domain::open(), Cutoff(1.0)).unwrap().count(0, 1.0), 0);
}

#[test]
fn thirty_three_on_one_coordinate_and_many_duplicates_are_ordinary() {
    let line = Particles::new((0..33).map(|i| [0.5, f64::from(i)]).collect()).unwrap();
    let cells = CellList::build(&line, &Domain::open(), Cutoff(1.0)).unwrap();
    assert_eq!((0..33).map(|p| cells.count(p, 1.0)).sum::<usize>(), 64);
    let column = Particles::new((0..4096).map(|i| [0.5, f64::from(i % 64), f64::from(i / 64)]).collect()).unwrap();
    let cells = CellList::build(&column, &Domain::open(), Cutoff(1.0)).unwrap();
    assert_eq!((0..4096).map(|p| cells.count(p, 1.0)).sum::<usize>(), 4 * 64 * 63);
    let twins = Particles::new(vec![[0.25; 3]; 1_000_000]).unwrap();
    let cells = CellList::build(&twins, &Domain::open(), Cutoff(0.1)).unwrap();
    assert_eq!((cells.count(0, 0.1), cells.count(999_999, 0.0)), (999_999, 999_999));
}

#[test]
fn subnormal_and_tiny_gaps_are_legal_sets() {
    for gap in [1e-300, 1e-310] {
        let pair = Particles::new(vec![[0.0], [gap]]).unwrap();
        let cells = CellList::build(&pair, &Domain::open(), Cutoff(1e-3)).unwrap();
        let mut row = Stencil::default();
        cells.gather(0, 1e-3, &mut row);
        assert_eq!(row.separations(), [[-gap]]);
        let kind = NeighborError::CutoffRange { cutoff: 2.0 * gap, low: LENGTH_LOW, high: LENGTH_HIGH };
        assert_eq!(CellList::build(&pair, &Domain::open(), Cutoff(2.0 * gap)).unwrap_err(), Error::from(kind));
    }
}

#[test]
fn illegal_cutoffs_are_refused_and_odd_queries_answered_within_reach() {
    let particles = Particles::lattice([0.0], [1.0], [8]).unwrap();
    for cutoff in [0.0, -1.0, f64::INFINITY] {
        let expected = Error::from(NeighborError::Cutoff { cutoff });
        assert_eq!(CellList::build(&particles, &Domain::open(), Cutoff(cutoff)).unwrap_err(), expected);
        assert_eq!(BruteForce::build(&particles, &Domain::open(), Cutoff(cutoff)).unwrap_err(), expected);
    }
    assert!(CellList::build(&particles, &Domain::open(), Cutoff(f64::NAN)).is_err());
    let cells = CellList::build(&particles, &Domain::open(), Cutoff(0.125)).unwrap();
    let list = NeighborList::from_provider(&cells).unwrap();
    let oracle = BruteForce::build(&particles, &Domain::open(), Cutoff(0.125)).unwrap();
    for (cutoff, count) in [(9.0, 2), (f64::INFINITY, 2), (0.0, 0), (-1.0, 0), (f64::NAN, 0)] {
        assert_eq!((cells.count(3, cutoff), list.count(3, cutoff), oracle.count(3, cutoff)), (count, count, count));
    }
    assert_eq!((cells.count(8, 0.125), list.count(8, 0.125), oracle.count(usize::MAX, 0.125)), (0, 0, 0));
}

#[test]
fn neighbors_at_exactly_the_cutoff_are_in_for_every_provider() {
    let lattice = Particles::lattice([0.0; 3], [1.0; 3], [8; 3]).unwrap();
    let torus = Domain::periodic([0.0; 3], [1.0; 3]).unwrap();
    let cells = CellList::build(&lattice, &torus, Cutoff(0.25)).unwrap();
    let oracle = BruteForce::build(&lattice, &torus, Cutoff(0.25)).unwrap();
    let list = NeighborList::from_provider(&cells).unwrap();
    // Shells of the cubic lattice: 6 at h, 12 at sqrt 2, 8 at sqrt 3, 6 at 2 h.
    for (cutoff, count) in [(0.25, 32), (0.25_f64.next_down(), 26), (0.125, 6), (0.125_f64.next_down(), 0)] {
        for p in [0, 77, 511] {
            let counts = (cells.count(p, cutoff), oracle.count(p, cutoff), list.count(p, cutoff));
            agree("counts at the cutoff and one ulp below, every provider").equal(&counts, &(count, count, count));
        }
    }
}

#[test]
fn cell_list_equals_brute_force_where_two_cutoffs_are_a_box_and_its_round_off() {
    for factor in [1.0, 1.0 + 2.0 * f64::EPSILON, 1.0 + 4.0 * f64::EPSILON] {
        for (kinds, lower) in [([0; 2], 0.0), ([0; 2], -0.3), ([6, 0], 0.7), ([8, 7], 0.1)] {
            let upper = lower + 1.0;
            let domain = Domain::new([lower; 2], [upper; 2], kinds.map(|kind| AXES[kind])).unwrap();
            let cutoff = 0.5 * (upper - lower) * factor;
            // Ties at half the box on the lattice, and particles on the faces and one ulp from them.
            let mut points = Particles::lattice([lower; 2], [upper; 2], [8; 2]).unwrap().points().to_vec();
            let edges = [lower, lower.next_up(), lower + 0.5, (lower + 0.5).next_up(), upper.next_down(), upper];
            points.extend(edges.iter().flat_map(|&x| edges.map(|y| [x, y])));
            let mut random = Random::new(5);
            points.extend((0..60).map(|_| std::array::from_fn(|_| (lower + random.uniform()).min(upper))));
            let particles = Particles::new(points).unwrap();
            let cells = CellList::build(&particles, &domain, Cutoff(cutoff)).unwrap();
            let oracle = BruteForce::build(&particles, &domain, Cutoff(cutoff)).unwrap();
            assert_same_rows(&cells, &oracle, cutoff);
        }
    }
}

#[test]
fn images_carry_the_sign_and_separation_of_their_mirrors() {
    let faces = [[Face::MirrorOdd, Face::Open], [Face::MirrorEven, Face::Open]];
    let corner = Domain::new([0.0; 2], [f64::INFINITY; 2], faces).unwrap();
    let single = Particles::new(vec![[0.125, 0.25]]).unwrap();
    let cells = CellList::build(&single, &corner, Cutoff(1.0)).unwrap();
    let mut images = Vec::new();
    cells.for_each(0, 1.0, |n| images.push((n.q, n.separation, n.sign)));
    images.sort_by(|a, b| a.1.partial_cmp(&b.1).unwrap());
    assert_eq!(images, [(0, [0.0, 0.5], 1), (0, [0.25, 0.0], -1), (0, [0.25, 0.5], -1)]);
}

#[test]
fn lists_keep_rows_order_and_generation_of_their_provider() {
    let particles = Particles::jittered([0.0; 2], [1.0; 2], [12; 2], 0.4, 3).unwrap();
    let faces = [[Face::MirrorOdd, Face::MirrorEven], [Face::Periodic; 2]];
    let domain = Domain::new([0.0; 2], [1.0; 2], faces).unwrap();
    let cells = CellList::build(&particles, &domain, Cutoff(0.3)).unwrap();
    let list = NeighborList::from_provider(&cells).unwrap();
    assert_eq!(list.generation(), particles.generation());
    assert_eq!(list.total(), (0..144).map(|p| cells.count(p, 0.3)).sum::<usize>());
    assert_same_rows(&list, &cells, 0.17);
    let (mut a, mut b) = (Stencil::default(), Stencil::default());
    cells.gather(5, 0.3, &mut a);
    list.gather(5, 0.3, &mut b);
    assert!(a.iter().eq(b.iter()));
    let off = CellList::build_at(&[[0.1, 0.2], [0.3, 0.4]], &particles, &domain, Cutoff(0.3)).unwrap();
    let list = NeighborList::from_provider(&off).unwrap();
    assert_same_rows(&list, &off, 0.3);
    assert_eq!(list.center(1), None);
}

#[test]
fn index_lists_mean_the_nearest_image() {
    let ring = Domain::periodic([0.0], [1.0]).unwrap();
    let particles = Particles::lattice([0.0], [1.0], [8]).unwrap();
    let indices: Vec<u32> = (0..8).flat_map(|p| [(p + 1) % 8, (p + 7) % 8]).collect();
    let offsets: Vec<usize> = (0..=8).map(|p| 2 * p).collect();
    let list = NeighborList::from_indices(&particles, &ring, &offsets, &indices, Cutoff(0.125)).unwrap();
    let oracle = BruteForce::build(&particles, &ring, Cutoff(0.125)).unwrap();
    assert_same_rows(&list, &oracle, 0.125);

    let refuse = |indices: &[u32], kind: NeighborError, p: usize| {
        let error = NeighborList::from_indices(&particles, &ring, &offsets, indices, Cutoff(0.125)).unwrap_err();
        assert_eq!(error, Error::from(kind).at(p));
    };
    let with = |at: usize, q: u32| {
        let mut changed = indices.clone();
        changed[at] = q;
        changed
    };
    refuse(&with(3, 8), NeighborError::Source { q: 8, sources: 8 }, 1);
    refuse(&with(3, 1), NeighborError::OwnCenter { q: 1 }, 1);
    refuse(&with(3, 2), NeighborError::Repeated { q: 2 }, 1);
    refuse(&with(3, 4), NeighborError::Distance { q: 4, distance: 0.375, cutoff: 0.125 }, 1);
}

#[test]
fn faulty_rows_are_refused_with_target_and_numbers() {
    let near = Neighbor { q: 1, separation: [0.5], sign: 1 };
    let build = |offsets: &[usize], rows: &[Neighbor<1>]| {
        NeighborList::from_rows(2, &[Some(0), None], offsets, rows, Cutoff(1.0), 7)
    };
    let legal = build(&[0, 1, 2], &[near, near]).unwrap();
    assert_eq!((legal.generation(), legal.count(1, 1.0), legal.center(0)), (7, 1, Some(0)));

    let refuse = |row: &[Neighbor<1>], kind: NeighborError| {
        assert_eq!(build(&[0, row.len(), row.len()], row).unwrap_err(), Error::from(kind).at(0));
    };
    refuse(&[Neighbor { q: 2, ..near }], NeighborError::Source { q: 2, sources: 2 });
    refuse(&[Neighbor { sign: 0, ..near }], NeighborError::Sign { q: 1, sign: 0 });
    refuse(&[near, near], NeighborError::Repeated { q: 1 });
    refuse(&[Neighbor { q: 0, separation: [-0.0], sign: 1 }], NeighborError::OwnCenter { q: 0 });
    let far = NeighborError::Distance { q: 1, distance: 1.5, cutoff: 1.0 };
    refuse(&[Neighbor { separation: [1.5], ..near }], far);
    let infinite = NeighborError::Separation { q: 1, axis: 0, separation: f64::INFINITY };
    refuse(&[Neighbor { separation: [f64::INFINITY], ..near }], infinite);
    let nan = build(&[0, 1, 1], &[Neighbor { separation: [f64::NAN], ..near }]).unwrap_err();
    assert!(matches!(nan.kind(), parops::ErrorKind::Neighbor(NeighborError::Separation { q: 1, axis: 0, .. })));

    // Own images, and duplicates at the place of the target, are neighbors.
    assert!(build(&[0, 1, 1], &[Neighbor { q: 0, ..near }]).is_ok());
    assert!(build(&[0, 1, 1], &[Neighbor { separation: [0.0], ..near }]).is_ok());

    for (offsets, row, needed) in [([1, 1, 1], 0, 0), ([0, 2, 1], 2, 2), ([0, 0, 2], 2, 1), ([0, 0, 0], 2, 1)] {
        let kind = NeighborError::Offsets { row, found: offsets[row], needed };
        assert_eq!(build(&offsets, &[near]).unwrap_err().kind(), Error::from(kind).kind(), "{offsets:?}");
    }
    let error = build(&[0, 1], &[near]).unwrap_err();
    assert_eq!(error, Error::from(ParticleError::Length { found: 2, needed: 3 }));
    let error = NeighborList::from_rows(2, &[Some(2)], &[0, 1], &[near], Cutoff(1.0), 7).unwrap_err();
    assert_eq!(error, Error::from(NeighborError::Source { q: 2, sources: 2 }).at(0));
    let error = NeighborList::from_rows(2, &[], &[0], &[] as &[Neighbor<1>], Cutoff(-1.0), 7).unwrap_err();
    assert_eq!(error, Error::from(NeighborError::Cutoff { cutoff: -1.0 }));
}

#[test]
fn sorting_by_cell_permutes_points_and_volumes_together() {
    let mut random = Random::new(2);
    let points: Vec<[f64; 2]> = (0..200).map(|_| [0; 2].map(|_| random.uniform())).collect();
    let volumes = parops::Volumes::each((1..=200).map(f64::from).collect()).unwrap();
    let particles = Particles::new(points.clone()).unwrap().with_volumes(volumes).unwrap();
    let domain = Domain::periodic([0.0; 2], [1.0; 2]).unwrap();
    let (sorted, permutation) = particles.sorted_by_cell(&domain, Cutoff(0.2)).unwrap();
    let mut seen = permutation.clone();
    seen.sort_unstable();
    assert!(seen.into_iter().eq(0..200));
    for (i, &p) in permutation.iter().enumerate() {
        assert_eq!(sorted.points()[i], points[p]);
        assert_eq!(sorted.volumes().unwrap().get(i).unwrap(), (p + 1) as f64);
    }
    let a = CellList::build(&particles, &domain, Cutoff(0.2)).unwrap();
    let b = CellList::build(&sorted, &domain, Cutoff(0.2)).unwrap();
    for (i, &p) in permutation.iter().enumerate() {
        let mut renumbered = row(&b, i, 0.2);
        renumbered.iter_mut().for_each(|neighbor| neighbor.0 = permutation[neighbor.0]);
        renumbered.sort_unstable();
        assert_eq!(renumbered, row(&a, p, 0.2), "particle {p}");
    }
    assert_ne!(sorted.generation(), particles.generation());
}
