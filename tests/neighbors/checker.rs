//! The provider checker: ours pass, a provider written by a user passes, and every fault is caught.

use parops::testing::{ProviderFault, check_provider, check_provider_against};
use parops::{
    BruteForce, CellList, Cutoff, Domain, Face, Nearest, Neighbor, NeighborList, Neighbors, Particles, Random,
    Selected, Stencil, VerletList,
};

/// A provider as a user would write it: equal points on a line, found by index arithmetic.
struct Line {
    count: usize,
    spacing: f64,
}

impl Neighbors<1> for Line {
    fn targets(&self) -> usize {
        self.count
    }
    fn sources(&self) -> usize {
        self.count
    }
    fn center(&self, p: usize) -> Option<usize> {
        Some(p)
    }
    fn cutoff(&self, _: usize) -> f64 {
        self.reach()
    }
    fn reach(&self) -> f64 {
        2.5 * self.spacing
    }
    fn generation(&self) -> u64 {
        0
    }
    fn for_each(&self, p: usize, cutoff: f64, mut visit: impl FnMut(Neighbor<1>)) {
        for q in p.saturating_sub(2)..(p + 3).min(self.count) {
            let separation = [(p as f64 - q as f64) * self.spacing];
            if q != p && separation[0].abs() <= cutoff.min(self.reach()) {
                visit(Neighbor { q, separation, sign: 1 });
            }
        }
    }
}

#[test]
fn a_foreign_provider_passes_and_serves_lists() {
    let line = Line { count: 9, spacing: 0.25 };
    assert_eq!(check_provider(&line), Ok(()));
    let points = (0..9).map(|i| [0.25 * f64::from(i)]).collect();
    let oracle = BruteForce::build(&Particles::new(points).unwrap(), &Domain::open(), Cutoff(0.625)).unwrap();
    assert_eq!(check_provider_against(&line, &oracle), Ok(()));
    assert_eq!(check_provider_against(&NeighborList::from_provider(&line).unwrap(), &oracle), Ok(()));
    assert_eq!(check_provider(&(&line).canonical()), Ok(()));
}

#[test]
fn our_providers_pass_on_mixed_faces() {
    let particles = Particles::random([0.0; 2], [1.0; 2], 150, 4).unwrap();
    let faces = [[Face::MirrorOdd, Face::MirrorEven], [Face::Periodic; 2]];
    for domain in [Domain::open(), Domain::new([0.0; 2], [1.0; 2], faces).unwrap()] {
        let oracle = BruteForce::build(&particles, &domain, Cutoff(0.4)).unwrap();
        let cells = CellList::build(&particles, &domain, Cutoff(0.4)).unwrap();
        let list = NeighborList::from_provider(&cells).unwrap();
        assert_eq!((check_provider(&oracle), check_provider(&cells), check_provider(&list)), (Ok(()), Ok(()), Ok(())));
        assert_eq!(check_provider_against(&cells, &oracle), Ok(()));
        assert_eq!(check_provider_against(&list, &oracle), Ok(()));
        assert_eq!(check_provider_against(&cells.canonical(), &oracle), Ok(()));
        assert_eq!(check_provider_against(&Nearest::build(&particles, &domain, 12).unwrap(), &oracle), Ok(()));
        let mut verlet = VerletList::build(&particles, &domain, Cutoff(0.4), 0.05).unwrap();
        assert_eq!(check_provider(&verlet), Ok(()));
        let mut moved = particles.clone();
        moved.set_points(&particles.points().iter().map(|[x, y]| [x * 0.99, *y]).collect::<Vec<_>>()).unwrap();
        assert_eq!(verlet.update(&moved), Ok(false));
        let oracle = BruteForce::build(&moved, &domain, Cutoff(0.4)).unwrap();
        assert_eq!((check_provider(&verlet), check_provider_against(&verlet, &oracle)), (Ok(()), Ok(())));
    }
}

#[test]
fn selected_targets_pass_and_keep_the_rows_of_the_others() {
    let particles = Particles::random([0.0; 2], [1.0; 2], 150, 4).unwrap();
    let torus = Domain::periodic([0.0; 2], [1.0; 2]).unwrap();
    let cells = CellList::build(&particles, &torus, Cutoff(0.3)).unwrap();
    let some = Selected::new(&cells, &[149, 3, 3, 70]).unwrap();
    assert_eq!((some.targets(), some.sources(), some.selection()), (4, 150, &[149, 3, 3, 70][..]));
    assert_eq!(check_provider(&some), Ok(()));
    let (mut one, mut other) = (Stencil::default(), Stencil::default());
    for (i, &p) in some.selection().iter().enumerate() {
        some.gather(i, 0.2, &mut one);
        cells.gather(p, 0.2, &mut other);
        assert_eq!((one.target(), one.center(), one.cutoff()), (i, Some(p), 0.2));
        assert!(one.iter().eq(other.iter()) && some.count(i, 0.2) == one.len() && !one.is_empty());
    }
    let error = Selected::new(&cells, &[0, 150]).unwrap_err();
    assert_eq!(error.to_string(), "target 150 does not exist among 150");
}

#[test]
fn particles_on_an_even_mirror_pass_against_the_oracle_only() {
    let half = Domain::new([0.0], [f64::INFINITY], [[Face::MirrorEven, Face::Open]]).unwrap();
    let particles = Particles::new(vec![[0.0], [0.5]]).unwrap();
    let cells = CellList::build(&particles, &half, Cutoff(1.0)).unwrap();
    assert_eq!(check_provider(&cells), Err(ProviderFault::OwnCenter { p: 0 }));
    assert_eq!(check_provider_against(&cells, &BruteForce::build(&particles, &half, Cutoff(1.0)).unwrap()), Ok(()));
}

/// What the wrong provider below gets wrong.
#[derive(Clone, Copy, PartialEq)]
enum Wrong {
    Owned,
    Cutoff,
    Center,
    Source,
    OwnCenter,
    NotFinite,
    Beyond,
    Sign,
    Count,
    Gather,
    Subset,
    OneSided,
    Lost,
    Targets,
}

struct Faulty(Wrong, Line);

impl Neighbors<1> for Faulty {
    fn targets(&self) -> usize {
        self.1.count - usize::from(self.0 == Wrong::Targets)
    }
    fn sources(&self) -> usize {
        self.1.sources()
    }
    fn owned(&self) -> usize {
        self.sources() + usize::from(self.0 == Wrong::Owned)
    }
    fn center(&self, p: usize) -> Option<usize> {
        Some(if self.0 == Wrong::Center { p + 1 } else { p })
    }
    fn cutoff(&self, p: usize) -> f64 {
        self.1.cutoff(p) * if self.0 == Wrong::Cutoff { f64::NAN } else { 1.0 }
    }
    fn reach(&self) -> f64 {
        self.1.reach()
    }
    fn generation(&self) -> u64 {
        0
    }
    fn for_each(&self, p: usize, cutoff: f64, mut visit: impl FnMut(Neighbor<1>)) {
        let asked = match self.0 {
            Wrong::Beyond => self.reach(),
            Wrong::Subset if cutoff < self.reach() => 0.5 * cutoff,
            _ => cutoff,
        };
        if self.0 == Wrong::OwnCenter {
            visit(Neighbor { q: p, separation: [0.0], sign: 1 });
        }
        self.1.for_each(p, asked, |mut neighbor| {
            match self.0 {
                Wrong::Source => neighbor.q += self.1.count,
                Wrong::NotFinite => neighbor.separation = [f64::NAN],
                Wrong::Sign => neighbor.sign = 2,
                Wrong::OneSided if p == 4 && neighbor.q == 3 => return,
                Wrong::Lost if p + neighbor.q == 7 => return,
                _ => {}
            }
            visit(neighbor);
        });
    }
    fn gather(&self, p: usize, cutoff: f64, row: &mut Stencil<1>) {
        let center = if self.0 == Wrong::Gather { None } else { self.center(p) };
        row.reset(p, center, cutoff);
        self.for_each(p, cutoff, |neighbor| row.push(neighbor));
    }
    fn count(&self, p: usize, cutoff: f64) -> usize {
        let mut count = usize::from(self.0 == Wrong::Count);
        self.for_each(p, cutoff, |_| count += 1);
        count
    }
}

#[test]
fn every_fault_of_a_provider_is_caught() {
    let line = || Line { count: 8, spacing: 1.0 };
    let fault = |wrong| check_provider(&Faulty(wrong, line())).unwrap_err();
    assert_eq!(fault(Wrong::Owned), ProviderFault::Bounds { p: 0, found: 9.0, limit: 8.0 });
    assert!(matches!(fault(Wrong::Cutoff), ProviderFault::Bounds { p: 0, limit: 2.5, .. }));
    assert_eq!(fault(Wrong::Center), ProviderFault::Center { p: 7, center: 8, sources: 8 });
    assert_eq!(fault(Wrong::Source), ProviderFault::Source { p: 0, q: 9 });
    assert_eq!(fault(Wrong::OwnCenter), ProviderFault::OwnCenter { p: 0 });
    assert!(matches!(fault(Wrong::NotFinite), ProviderFault::Separation { p: 0, q: 1, .. }));
    assert_eq!(fault(Wrong::Beyond), ProviderFault::Separation { p: 0, q: 2, distance: 2.0, cutoff: 1.875 });
    assert_eq!(fault(Wrong::Sign), ProviderFault::Sign { p: 0, q: 1, sign: 2 });
    assert_eq!(fault(Wrong::Count), ProviderFault::Disagree { p: 0, visited: 2, gathered: 2, counted: 3 });
    assert_eq!(fault(Wrong::Gather), ProviderFault::Disagree { p: 0, visited: 2, gathered: 2, counted: 2 });
    assert_eq!(fault(Wrong::Subset), ProviderFault::NotMonotone { p: 0, cutoff: 1.875, found: 0, expected: 1 });
    assert_eq!(fault(Wrong::OneSided), ProviderFault::NotSymmetric { p: 3, q: 4 });

    let points = (0..8).map(|i| [f64::from(i)]).collect();
    let eight = Particles::new(points).unwrap();
    let oracle_in = |domain: &Domain<1>| BruteForce::build(&eight, domain, Cutoff(2.5)).unwrap();
    let oracle = oracle_in(&Domain::open());
    assert_eq!(check_provider(&Faulty(Wrong::Lost, line())), Ok(()));
    let against = |wrong| check_provider_against(&Faulty(wrong, line()), &oracle).unwrap_err();
    assert_eq!(against(Wrong::Lost), ProviderFault::NotTheOracle { p: 3, found: 3, expected: 4 });
    let beside = Domain::new([-0.5], [f64::INFINITY], [[Face::MirrorEven, Face::Open]]).unwrap();
    let mirrored = oracle_in(&beside);
    assert_eq!(check_provider_against(&line(), &mirrored), Err(ProviderFault::Mirrors { axis: 0 }));
    assert_eq!(against(Wrong::Targets), ProviderFault::NotTheOracle { p: 7, found: 8, expected: 8 });
}

#[test]
fn rows_that_change_when_asked_again_are_caught() {
    /// Turns the row around on every other visit, but not the first three, which `gather` and `count` compare with.
    struct Unsteady(Line, std::sync::atomic::AtomicUsize);
    impl Neighbors<1> for Unsteady {
        fn targets(&self) -> usize {
            self.0.targets()
        }
        fn sources(&self) -> usize {
            self.0.sources()
        }
        fn center(&self, p: usize) -> Option<usize> {
            Some(p)
        }
        fn cutoff(&self, p: usize) -> f64 {
            self.0.cutoff(p)
        }
        fn reach(&self) -> f64 {
            self.0.reach()
        }
        fn generation(&self) -> u64 {
            0
        }
        fn for_each(&self, p: usize, cutoff: f64, visit: impl FnMut(Neighbor<1>)) {
            let mut row = Stencil::default();
            self.0.gather(p, cutoff, &mut row);
            let mut row: Vec<_> = row.iter().collect();
            if self.1.fetch_add(1, std::sync::atomic::Ordering::Relaxed) >= 4 {
                row.reverse();
            }
            row.into_iter().for_each(visit);
        }
    }
    let unsteady = Unsteady(Line { count: 8, spacing: 1.0 }, 0.into());
    assert_eq!(check_provider(&unsteady), Err(ProviderFault::Unsteady { p: 0 }));
}

/// A hundred random sets of four shapes and five sizes in domains of all kinds of faces, each built anew.
fn after_updates<const D: usize, P: Neighbors<D>>(build: impl Fn(&Particles<D>, &Domain<D>, Cutoff) -> P, seed: u64) {
    const AXES: [[Face; 2]; 4] = [
        [Face::Periodic, Face::Periodic],
        [Face::MirrorOdd, Face::MirrorEven],
        [Face::Open, Face::Open],
        [Face::MirrorEven, Face::Open],
    ];
    let mut random = Random::new(seed);
    for update in 0..100 {
        let domain = Domain::new([0.0; D], [1.0; D], std::array::from_fn(|axis| AXES[(update + axis) % 4])).unwrap();
        let n = [0, 1, 2, 33, 120][update % 5];
        let place = |x: f64| match update % 4 {
            // Spread, clustered, ties on a lattice, and all in a few places.
            0 => x,
            1 => 0.9 + 1e-3 * x,
            2 => (x * 8.0).floor() / 8.0,
            _ => (x * 2.0).floor() / 2.0,
        };
        let points = (0..n).map(|_| std::array::from_fn(|_| place(random.uniform()))).collect();
        let particles = Particles::new(points).unwrap();
        let oracle = BruteForce::build(&particles, &domain, Cutoff(0.25)).unwrap();
        assert_eq!(check_provider_against(&build(&particles, &domain, Cutoff(0.25)), &oracle), Ok(()), "{update}");
    }
}

#[test]
fn cell_lists_equal_brute_force_on_a_hundred_random_sets() {
    after_updates::<1, _>(|particles, domain, cutoff| CellList::build(particles, domain, cutoff).unwrap(), 1);
    after_updates::<2, _>(|particles, domain, cutoff| CellList::build(particles, domain, cutoff).unwrap(), 2);
    after_updates::<3, _>(|particles, domain, cutoff| CellList::build(particles, domain, cutoff).unwrap(), 3);
}

#[test]
fn nearest_neighbors_equal_brute_force_on_a_hundred_random_sets() {
    after_updates::<1, _>(|particles, domain, _| Nearest::build(particles, domain, 6).unwrap(), 4);
    after_updates::<2, _>(|particles, domain, _| Nearest::build(particles, domain, 9).unwrap(), 5);
    after_updates::<3, _>(|particles, domain, _| Nearest::build(particles, domain, 12).unwrap(), 6);
}

#[cfg(feature = "kiddo")]
mod tree {
    use super::*;
    use parops::{COORDINATE_HIGH, KdTree, LENGTH_HIGH, PARTICLES_HIGH};

    #[test]
    fn trees_equal_brute_force_on_a_hundred_random_sets() {
        after_updates::<1, _>(|particles, domain, cutoff| KdTree::build(particles, domain, cutoff).unwrap(), 1);
        after_updates::<2, _>(|particles, domain, cutoff| KdTree::build(particles, domain, cutoff).unwrap(), 2);
        after_updates::<3, _>(|particles, domain, cutoff| KdTree::build(particles, domain, cutoff).unwrap(), 3);
    }

    #[test]
    fn trees_serve_targets_of_their_own_and_pass_the_checker() {
        let particles = Particles::random([0.0; 3], [1.0; 3], 400, 4).unwrap();
        let domain = Domain::periodic([0.0; 3], [1.0; 3]).unwrap();
        assert_eq!(check_provider(&KdTree::build(&particles, &domain, Cutoff(0.2)).unwrap()), Ok(()));
        let targets: Vec<_> = (0..50).map(|i| [0.02 * f64::from(i); 3]).collect();
        let tree = KdTree::build_at(&targets, &particles, &domain, Cutoff(0.2)).unwrap();
        let oracle = BruteForce::build_at(&targets, &particles, &domain, Cutoff(0.2)).unwrap();
        assert_eq!(check_provider_against(&tree, &oracle), Ok(()));
        assert!((0..50).all(|p| tree.center(p).is_none()) && PARTICLES_HIGH > particles.len());
    }

    #[test]
    fn coincident_and_aligned_points_and_far_coordinates_are_served() {
        let same = |oracle: &BruteForce<3>, tree: &KdTree<3>| {
            assert_eq!(check_provider_against(tree, oracle), Ok(()));
        };
        let check = |points: Vec<[f64; 3]>, cutoff: f64| {
            let particles = Particles::new(points).unwrap();
            let oracle = BruteForce::build(&particles, &Domain::open(), Cutoff(cutoff)).unwrap();
            same(&oracle, &KdTree::build(&particles, &Domain::open(), Cutoff(cutoff)).unwrap());
        };
        // Far more points at one place than a leaf holds, 33 with one x, a line, and outliers at both ends.
        check(vec![[0.5; 3]; 200], 0.1);
        check((0..33).map(|i| [1.0, f64::from(i), f64::from(i * i % 7)]).collect(), 3.0);
        check((0..100).map(|i| [f64::from(i), 0.0, -0.0]).collect(), 2.0);
        let far = COORDINATE_HIGH;
        check(vec![[far; 3], [far, -far, far], [0.0; 3], [far; 3], [1.0, 0.0, 0.0]], 1.0);
        check(vec![[far; 3], [-far; 3], [0.0; 3], [f64::MIN_POSITIVE; 3], [5e-324; 3]], LENGTH_HIGH);
        // More equal points than the index of a leaf of eight bits could count.
        check((0..700).map(|i| [f64::from(i % 2), 0.0, 0.0]).collect(), 0.5);
    }
}
