//! The Verlet list against brute force after every update; when it searches anew, and when it need not.

use crate::cases::cases;
use crate::properties::properties;
use parops::testing::{Promise, check_provider, check_provider_against};
use parops::{
    BruteForce, CellList, Cutoff, Domain, DomainError, Error, Face, NeighborError, NeighborList, Neighbors,
    ParticleError, Particles, Random, VerletList,
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

fn assert_same_rows<const D: usize>(found: &impl Neighbors<D>, oracle: &impl Neighbors<D>) {
    assert_eq!((found.targets(), found.sources()), (oracle.targets(), oracle.sources()));
    for cutoff in [oracle.reach(), 0.6 * oracle.reach()] {
        for p in 0..found.targets() {
            assert_eq!(found.center(p), oracle.center(p));
            Promise::new("Neighbor lists", "Verlet list against brute force after moves, rows as sets to the bit")
                .equal(&row(found, p, cutoff), &row(oracle, p, cutoff));
        }
    }
}

const AXES: [[Face; 2]; 6] = [
    [Face::Periodic, Face::Periodic],
    [Face::Open, Face::Open],
    [Face::MirrorEven, Face::Open],
    [Face::Open, Face::MirrorOdd],
    [Face::MirrorOdd, Face::MirrorEven],
    [Face::Periodic, Face::Periodic],
];

/// Spread evenly, on a lattice with ties and coincident points, or clustered.
fn scattered<const D: usize>(shape: usize, n: usize, random: &mut Random) -> Vec<[f64; D]> {
    let place = |i: usize, x: f64| match shape {
        1 => (x * 8.0).floor() / 8.0,
        2 if !i.is_multiple_of(6) => 0.97 + 0.02 * x,
        _ => x,
    };
    (0..n).map(|i| std::array::from_fn(|_| place(i, random.uniform()))).collect()
}

/// Moves the points at random by up to `step` an axis: across periodic faces freely, at others back into the box.
fn push<const D: usize>(points: &mut [[f64; D]], faces: [[Face; 2]; D], step: f64, random: &mut Random) {
    for point in points {
        for (x, faces) in point.iter_mut().zip(faces) {
            *x += step * (2.0 * random.uniform() - 1.0);
            if faces[0] != Face::Periodic {
                *x = x.clamp(0.0, 1.0);
            }
        }
    }
}

/// Random walks of many small and some large steps; returns how often the rows were searched anew.
fn equals_brute_force<const D: usize>(kinds: [usize; 3], shape: usize, n: usize, updates: usize, seed: u64) -> usize {
    let mut random = Random::new(seed);
    let faces = std::array::from_fn(|axis| AXES[kinds[axis]]);
    let domain = Domain::new([0.0; D], [1.0; D], faces).unwrap();
    let (cutoff, skin) = (Cutoff(0.2), [0.2, 0.05, 0.0][seed as usize % 3]);
    let mut points = scattered::<D>(shape, n, &mut random);
    let mut particles = Particles::new(points.clone()).unwrap();
    let mut list = VerletList::build(&particles, &domain, cutoff, skin).unwrap();
    let mut searched = 0;
    for _ in 0..updates {
        let step = if random.uniform() < 0.1 { 0.3 } else { (0.1 * skin).max(1e-3) };
        push(&mut points, faces, step, &mut random);
        particles.set_points(&points).unwrap();
        searched += usize::from(list.update(&particles).unwrap());
        let oracle = BruteForce::build(&particles, &domain, cutoff).unwrap();
        assert_same_rows(&list, &oracle);
        assert_eq!(list.generation(), particles.generation());
    }
    // Rows stored from it are those of now.
    let oracle = BruteForce::build(&particles, &domain, cutoff).unwrap();
    assert_same_rows(&NeighborList::from_provider(&list).unwrap(), &oracle);
    assert_eq!(check_provider_against(&list, &oracle), Ok(()));
    assert_eq!(list.rebuilds(), searched);
    searched
}

proptest! {
    #![proptest_config(properties(cases() / 10))]

    #[test]
    fn verlet_list_equals_brute_force_after_every_update(
        kinds in [0_usize..6, 0_usize..6, 0_usize..6],
        shape in 0_usize..3,
        n in prop::sample::select(vec![0_usize, 1, 2, 33]),
        seed: u64,
    ) {
        equals_brute_force::<1>(kinds, shape, n, 20, seed);
        equals_brute_force::<2>(kinds, shape, n, 20, seed);
        equals_brute_force::<3>(kinds, shape, n, 20, seed);
    }
}

#[test]
fn verlet_list_equals_brute_force_after_a_hundred_random_updates() {
    for (seed, kinds) in [[0; 3], [1; 3], [4, 0, 3], [2, 5, 0]].into_iter().enumerate() {
        // Skins of 0.2 and 0.05 are reused many times and searched anew some times.
        for (skin, searched) in [(0, 1..60), (1, 1..60), (2, 100..101)] {
            let seed = 3 * seed as u64 + skin;
            let found = equals_brute_force::<2>(kinds, seed as usize % 3, 120, 100, seed);
            assert!(searched.contains(&found), "seed {seed}: {found} searches");
            equals_brute_force::<3>(kinds, seed as usize % 3, 60, 100, seed);
            equals_brute_force::<1>(kinds, seed as usize % 3, 60, 100, seed);
        }
    }
}

/// Pairs within `cutoff` now that rows up to `stored` at former places do not hold: what reusing them would lose.
fn lost(before: &Particles<2>, now: &Particles<2>, domain: &Domain<2>, cutoff: f64, stored: f64) -> usize {
    let former = BruteForce::build(before, domain, Cutoff(stored)).unwrap();
    let current = BruteForce::build(now, domain, Cutoff(cutoff)).unwrap();
    let missing = |p: usize| {
        let (mut known, mut lost) = (Vec::new(), 0);
        former.for_each(p, stored, |n| known.push(n.q));
        current.for_each(p, cutoff, |n| lost += usize::from(!known.contains(&n.q)));
        lost
    };
    (0..now.len()).map(missing).sum::<usize>() / 2
}

/// Particles that move by `distance` each, in random directions.
fn pushed(from: &Particles<2>, distance: f64, seed: u64) -> Particles<2> {
    let mut random = Random::new(seed);
    let moved = from.points().iter().map(|&[x, y]| {
        let (sin, cos) = (std::f64::consts::TAU * random.uniform()).sin_cos();
        [x + distance * cos, y + distance * sin]
    });
    let mut after = from.clone();
    after.set_points(&moved.collect::<Vec<_>>()).unwrap();
    after
}

#[test]
fn a_displacement_below_the_skin_but_above_half_of_it_is_searched_anew() {
    // Errata 48: r_c = 1, skin 0.2 in a periodic box of width 10. The rule as printed waits for a displacement of the skin.
    let domain = Domain::periodic([0.0; 2], [10.0; 2]).unwrap();
    let before = Particles::random([0.0; 2], [10.0; 2], 800, 3).unwrap();
    let mut reused = VerletList::build(&before, &domain, Cutoff(1.0), 0.2).unwrap();
    for (distance, anew) in [(0.05, false), (0.0999, false), (0.101, true), (0.19, true)] {
        let mut list = reused.clone();
        let after = pushed(&before, distance, 7);
        assert_eq!(list.update(&after), Ok(anew), "displacement {distance}");
        let oracle = BruteForce::build(&after, &domain, Cutoff(1.0)).unwrap();
        assert_same_rows(&list, &oracle);
        let missed = lost(&before, &after, &domain, 1.0, 1.2);
        assert!(anew || missed == 0, "displacement {distance}: {missed} pairs");
    }
    let missed = lost(&before, &pushed(&before, 0.19, 7), &domain, 1.0, 1.2);
    assert!(missed > 20, "the printed rule misses {missed} pairs");
    // A displacement of exactly half the skin is no reason to search.
    let half: Vec<_> = (0..4).map(|i| [f64::from(i) + 0.125, 0.5]).collect();
    let exact = Particles::new(half.clone()).unwrap();
    reused = VerletList::build(&exact, &domain, Cutoff(1.0), 0.25).unwrap();
    let moved = |by: f64| Particles::new(half.iter().map(|[x, y]| [x + by, *y]).collect()).unwrap();
    assert_eq!(reused.update(&moved(0.125)), Ok(false));
    assert_eq!(reused.update(&moved(0.125_f64.next_up() + f64::EPSILON)), Ok(true));
}

#[test]
fn slow_motion_is_summed_up_over_the_steps() {
    // Errata 48: a step of 2 v dt = 0.02 never exceeds a skin of 0.2, ten of them do.
    let domain = Domain::periodic([0.0; 2], [10.0; 2]).unwrap();
    let start = Particles::random([0.0; 2], [10.0; 2], 800, 3).unwrap();
    let mut random = Random::new(9);
    let directions: Vec<f64> = (0..800).map(|_| std::f64::consts::TAU * random.uniform()).collect();
    let mut list = VerletList::build(&start, &domain, Cutoff(1.0), 0.2).unwrap();
    let (mut particles, mut searches, mut steps_between) = (start.clone(), Vec::new(), 0);
    for step in 1..=100 {
        let points = particles.points().iter().zip(&directions);
        let points: Vec<_> = points.map(|(&[x, y], a)| [x + 0.01 * a.cos(), y + 0.01 * a.sin()]).collect();
        particles.set_points(&points).unwrap();
        steps_between += 1;
        if list.update(&particles).unwrap() {
            searches.push(steps_between);
            steps_between = 0;
        }
        if step % 10 == 9 || step == 100 {
            assert_same_rows(&list, &BruteForce::build(&particles, &domain, Cutoff(1.0)).unwrap());
        }
    }
    // Ten steps make exactly half the skin, so that rounding decides between ten and eleven.
    assert!([9, 10].contains(&searches.len()) && searches.iter().all(|steps| [10, 11].contains(steps)), "{searches:?}");
    let missed = lost(&start, &particles, &domain, 1.0, 1.2);
    assert!(missed > 1000, "a list that is never searched anew misses {missed} pairs");
}

#[test]
fn who_crosses_a_periodic_face_has_not_moved_far() {
    let domain = Domain::new([-1.0; 2], [1.0; 2], [[Face::Periodic; 2], [Face::MirrorOdd, Face::MirrorEven]]).unwrap();
    let points = Particles::random([-1.0; 2], [1.0; 2], 200, 5).unwrap().points().to_vec();
    let mut particles = Particles::new(points.clone()).unwrap();
    let mut list = VerletList::build(&particles, &domain, Cutoff(0.3), 0.1).unwrap();
    // There and back across the seam, several widths away at times.
    for by in [0.04, -0.04, 2.03, -5.97, 0.0] {
        particles.set_points(&points.iter().map(|[x, y]| [x + by, *y]).collect::<Vec<_>>()).unwrap();
        assert_eq!(list.update(&particles), Ok(false), "moved by {by}");
        let oracle = BruteForce::build(&particles, &domain, Cutoff(0.3)).unwrap();
        assert_same_rows(&list, &oracle);
        assert_eq!(check_provider(&list), Ok(()));
    }
    assert_eq!(list.rebuilds(), 0);
}

#[test]
fn boxes_as_narrow_as_can_be_serve_whoever_crosses_their_faces() {
    let (cutoff, skin) = (0.3, 0.2);
    let width = 2.0 * (cutoff + skin) * (1.0 + 1e-9);
    for faces in [[[Face::Periodic; 2]; 2], [[Face::Periodic; 2], [Face::MirrorOdd, Face::MirrorEven]]] {
        let domain = Domain::new([-0.25; 2], [width - 0.25; 2], faces).unwrap();
        let mut random = Random::new(4);
        // Ties at the cutoff too: some stand on a grid of an eighth of the width.
        let place = |x: f64, i: u32| width * if i.is_multiple_of(3) { (8.0 * x).floor() / 8.0 } else { x } - 0.25;
        let points = (0..60).map(|i| [0; 2].map(|_| place(random.uniform(), i))).collect();
        let mut particles = Particles::new(points).unwrap();
        let mut list = VerletList::build(&particles, &domain, Cutoff(cutoff), skin).unwrap();
        for _ in 0..60 {
            let step = |&[x, y]: &[f64; 2]| {
                let [dx, dy] = [0; 2].map(|_| 0.05 * (random.uniform() - 0.5));
                let turns = (7.0 * random.uniform()).floor() - 3.0;
                [x + dx + turns * width, (y + dy).clamp(-0.25, width - 0.25)]
            };
            particles.set_points(&particles.points().iter().map(step).collect::<Vec<_>>()).unwrap();
            list.update(&particles).unwrap();
            assert_same_rows(&list, &BruteForce::build(&particles, &domain, Cutoff(cutoff)).unwrap());
        }
        assert!((1..30).contains(&list.rebuilds()), "{}", list.rebuilds());
    }
}

#[test]
fn refused_lists_and_updates_name_the_numbers_and_change_nothing() {
    let ring = Domain::periodic([0.0], [1.0]).unwrap();
    let particles = Particles::lattice([0.0], [1.0], [8]).unwrap();
    for skin in [-1e-3, f64::NAN, f64::INFINITY] {
        let error = VerletList::build(&particles, &ring, Cutoff(0.2), skin).unwrap_err();
        assert!(
            matches!(error.kind(), parops::ErrorKind::Neighbor(NeighborError::Skin { skin: s }) if s.to_bits() == skin.to_bits())
        );
    }
    let narrow = VerletList::build(&particles, &ring, Cutoff(0.4), 0.2).unwrap_err();
    assert!(matches!(narrow.kind(), parops::ErrorKind::Domain(DomainError::Narrow { axis: 0, .. })));
    assert!(VerletList::build(&particles, &ring, Cutoff(f64::NAN), 0.1).is_err());

    let segment = Domain::new([0.0], [1.0], [[Face::MirrorEven, Face::Open]]).unwrap();
    let mut list = VerletList::build(&particles, &segment, Cutoff(0.2), 0.1).unwrap();
    let as_it_was = |list: &VerletList<1>| {
        assert_same_rows(list, &CellList::build(&particles, &segment, Cutoff(0.2)).unwrap());
        assert_eq!((list.validate(particles.generation()), list.rebuilds(), list.skin()), (Ok(()), 0, 0.1));
    };
    let fewer = Particles::lattice([0.0], [1.0], [7]).unwrap();
    assert_eq!(list.update(&fewer), Err(Error::from(ParticleError::Length { found: 7, needed: 8 })));
    as_it_was(&list);
    let mut left = particles.clone();
    let points: Vec<_> = (0..8).map(|i| [f64::from(i) / 7.0 + if i == 7 { 1e-3 } else { 0.0 }]).collect();
    left.set_points(&points).unwrap();
    let outside = DomainError::Outside { axis: 0, coordinate: points[7][0], lower: 0.0, upper: 1.0 };
    assert_eq!(list.update(&left), Err(Error::from(outside).at(7)));
    as_it_was(&list);

    let stale = NeighborError::Stale { list: particles.generation(), set: left.generation() };
    assert_eq!(list.validate(left.generation()), Err(Error::from(stale)));
    assert_eq!((list.update(&particles), list.rebuilds()), (Ok(false), 0));
}

#[test]
fn far_coordinates_and_coincident_particles_are_served() {
    // Rounding at 10^9 is 1e-7, a tenth of the skin: what the list adds to its reach covers it.
    let offset = 1e9;
    let mut random = Random::new(2);
    let mut points: Vec<[f64; 2]> = (0..80).map(|_| [0; 2].map(|_| offset + 1e-5 * random.uniform())).collect();
    points.extend([points[0]; 3]);
    let mut particles = Particles::new(points.clone()).unwrap();
    let mut list = VerletList::build(&particles, &Domain::open(), Cutoff(2e-6), 1e-6).unwrap();
    for _ in 0..50 {
        points.iter_mut().flatten().for_each(|x| *x += 2.4e-7 * (random.uniform() - 0.5));
        particles.set_points(&points).unwrap();
        list.update(&particles).unwrap();
        assert_same_rows(&list, &BruteForce::build(&particles, &Domain::open(), Cutoff(2e-6)).unwrap());
    }
    assert!(list.rebuilds() > 0 && list.rebuilds() < 50, "{}", list.rebuilds());
}
