//! The provider of nearest neighbors: a provider like any other, whole shells, whatever the spacing.

use crate::cases::cases;
use crate::properties::properties;
use parops::testing::{Promise, check_provider, check_provider_against};
use parops::{
    BruteForce, CellList, Cutoff, DcPse, Domain, Face, Laplacian, Nearest, Neighbors, Particles, Random, Result,
};
use proptest::prelude::*;
use std::time::Instant;

/// Points whose spacing varies by 10^5, a pair at one place, and one point far away.
fn graded(count: usize, seed: u64) -> Particles<2> {
    let mut random = Random::new(seed);
    let mut points: Vec<[f64; 2]> = (0..count - 2)
        .map(|_| {
            let size = 10.0_f64.powf(-5.0 * random.uniform());
            [size * random.normal(), size * random.normal()]
        })
        .collect();
    points.extend([points[0], [1e9, -3e8]]);
    Particles::new(points).unwrap()
}

#[test]
fn rows_are_those_of_the_oracle_on_even_graded_and_closed_sets() {
    let even = Particles::jittered([0.0; 2], [1.0; 2], [12; 2], 0.3, 5).unwrap();
    let faces = [[Face::MirrorOdd, Face::MirrorEven], [Face::Periodic; 2]];
    let closed = Domain::new([0.0; 2], [1.0; 2], faces).unwrap();
    for (particles, domain) in [(even.clone(), Domain::open()), (even, closed), (graded(120, 3), Domain::open())] {
        let nearest = Nearest::build(&particles, &domain, 12).unwrap();
        let oracle = BruteForce::build(&particles, &domain, Cutoff(nearest.reach())).unwrap();
        assert_eq!(check_provider(&nearest), Ok(()));
        let found = check_provider_against(&nearest, &oracle);
        Promise::new("Neighbor lists", "nearest neighbors against brute force: even, graded and closed sets")
            .equal(&found, &Ok(()));
        for p in 0..particles.len() {
            let cutoff = nearest.cutoff(p);
            assert!(nearest.count(p, cutoff) >= 12 && oracle.count(p, cutoff * (1.0 - 2e-9)) < 12);
        }
        // Room for three steps of 1.15, where the box has it.
        let largest = (0..particles.len()).map(|p| nearest.cutoff(p)).fold(0.0, f64::max);
        assert!(nearest.reach() >= 0.5_f64.min(1.15 * 1.15 * 1.15 * largest));
    }
}

#[test]
fn shells_of_a_lattice_are_whole() {
    let lattice = Particles::lattice([0.0; 3], [1.0; 3], [9; 3]).unwrap();
    let nearest = Nearest::build(&lattice, &Domain::open(), 7).unwrap();
    // 6 at one spacing, 12 at sqrt(2).
    let middle = 4 * 81 + 4 * 9 + 4;
    assert_eq!(nearest.count(middle, nearest.cutoff(middle)), 18);
    let ring = Particles::lattice([0.0], [1.0], [16]).unwrap();
    let nearest = Nearest::build(&ring, &Domain::periodic([0.0], [1.0]).unwrap(), 3).unwrap();
    assert!((0..16).all(|p| nearest.count(p, nearest.cutoff(p)) == 4));
}

#[test]
fn targets_that_are_no_particles_have_no_center() {
    let particles = graded(80, 9);
    let targets = [[0.0, 0.0], [1e-4, 2e-4], [5e8, 0.0]];
    let nearest = Nearest::build_at(&targets, &particles, &Domain::open(), 10).unwrap();
    let oracle = BruteForce::build_at(&targets, &particles, &Domain::open(), Cutoff(nearest.reach())).unwrap();
    assert_eq!(check_provider_against(&nearest, &oracle), Ok(()));
    assert!((0..3).all(|p| nearest.center(p).is_none() && nearest.count(p, nearest.cutoff(p)) >= 10));
}

#[test]
fn sets_with_fewer_neighbors_than_asked_for_are_served_with_all_there_are() {
    let few = Particles::new(vec![[0.0, 0.0], [1.0, 0.5], [0.3, 2.0]]).unwrap();
    let nearest = Nearest::build(&few, &Domain::open(), 18).unwrap();
    assert!((0..3).all(|p| nearest.count(p, nearest.cutoff(p)) == 2));
    assert!(DcPse::<Laplacian<2>, 2>::new().assemble(&nearest).is_err());
    for points in [vec![], vec![[0.25, 0.5]], vec![[0.0; 2]; 5], vec![[0.25, 0.5]; 5]] {
        let same = Particles::new(points).unwrap();
        let nearest = Nearest::build(&same, &Domain::open(), 4).unwrap();
        assert_eq!(nearest.targets(), same.len());
        assert!((0..same.len()).all(|p| nearest.count(p, nearest.cutoff(p)) == same.len() - 1));
    }
    let torus = Domain::periodic([0.0; 2], [1.0; 2]).unwrap();
    let nearest = Nearest::build(&Particles::lattice([0.0; 2], [1.0; 2], [4; 2]).unwrap(), &torus, 99).unwrap();
    assert_eq!((nearest.cutoff(7), nearest.reach()), (0.5, 0.5));
}

#[test]
fn gaps_far_finer_than_the_cells_an_outlier_allows_are_served() {
    // A gap of 1e-9 beside an outlier at 1e12: 10^22 cells, 2^53 may be.
    let points = vec![[0.0, 0.0], [1e-9, 0.0], [0.5, 0.25], [0.75, -0.5], [1e12, 3e11]];
    let particles = Particles::new(points).unwrap();
    for (k, first) in [(1, 1e-9), (2, 0.3125_f64.sqrt())] {
        let nearest = Nearest::build(&particles, &Domain::open(), k).unwrap();
        assert!((0..2).all(|p| nearest.count(p, nearest.cutoff(p)) == k));
        assert!((nearest.cutoff(0) / first - 1.0).abs() < 1e-8, "{}", nearest.cutoff(0));
        let oracle = BruteForce::build(&particles, &Domain::open(), Cutoff(nearest.reach())).unwrap();
        assert_eq!(check_provider_against(&nearest, &oracle), Ok(()));
    }
}

#[test]
fn dense_cluster_in_an_even_set_is_searched_in_cells_of_its_own() {
    // Spacings 10^6 apart: cells that reach as far as thin places need hold the whole cluster.
    for size in [1e-2, 1e-6, 1e-12] {
        let mut random = Random::new(5);
        let mut point = |size: f64| [size * random.uniform(), size * random.uniform()];
        let points = (0..4000).map(|i| if i < 2000 { point(1.0) } else { point(size) }).collect();
        let particles = Particles::new(points).unwrap();
        let nearest = Nearest::build(&particles, &Domain::open(), 18).unwrap();
        let largest = (0..4000).map(|p| nearest.cutoff(p)).fold(0.0, f64::max);
        assert!(nearest.reach() <= 2.5 * largest, "{} for {largest}", nearest.reach());
        let cluster = (2000..4000).filter(|&p| nearest.count(p, nearest.cutoff(p)) == 18);
        assert_eq!(cluster.count(), 2000);
    }
}

#[test]
fn order_of_the_particles_does_not_matter_to_the_time() -> Result<()> {
    // A few far apart where multiples of the golden ratio fall among a dense cluster, or before all others.
    const COUNT: usize = 20_000;
    let golden: Vec<usize> =
        (0..64).map(|i| ((i as f64 * 0.6180339887498949).fract() * COUNT as f64) as usize).collect();
    let seconds = |apart: &[usize]| {
        let mut random = Random::new(5);
        let mut point = |size: f64| [size * random.uniform(), size * random.uniform()];
        let points = (0..COUNT).map(|i| point(if apart.contains(&i) { 1.0 } else { 1e-9 })).collect();
        let particles = Particles::<2>::new(points)?;
        let mut least = f64::INFINITY;
        for _ in 0..3 {
            let start = Instant::now();
            Nearest::build(&particles, &Domain::open(), 12)?;
            least = least.min(start.elapsed().as_secs_f64());
        }
        Ok::<f64, parops::Error>(least)
    };
    // 70 times as long where a sample sees those alone.
    let mut random = Random::new(6);
    let anywhere: Vec<usize> = (0..64).map(|_| (random.uniform() * COUNT as f64) as usize).collect();
    let anywhere = seconds(&anywhere)?;
    for apart in [(0..64).collect(), golden] {
        let found = seconds(&apart)?;
        assert!(found < 8.0 * anywhere, "{found} s for {anywhere} s");
    }
    Ok(())
}

proptest! {
    #![proptest_config(properties(cases()))]

    #[test]
    fn cutoff_is_the_distance_of_neighbor_number_k(seed: u64, count in 3..40_usize, k in 1..12_usize) {
        let particles = graded(count, seed);
        let nearest = Nearest::build(&particles, &Domain::open(), k).unwrap();
        let cells = CellList::build(&particles, &Domain::open(), Cutoff(1e10)).unwrap();
        for p in 0..count {
            let mut distances = Vec::new();
            cells.for_each(p, 1e10, |q| distances.push(q.separation[0].hypot(q.separation[1])));
            distances.sort_by(f64::total_cmp);
            if let Some(&last) = distances.get(k - 1) {
                let cutoff = nearest.cutoff(p);
                // A cutoff is widened by 1e-9 for rounding.
                let promise = Promise::new("Neighbor lists", "cutoff of the nearest over the distance of number k, less 1");
                promise.within(0.0, 2e-9, if cutoff >= last { (cutoff - last) / last.max(f64::MIN_POSITIVE) } else { f64::NAN });
            }
        }
    }
}
