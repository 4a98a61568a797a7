//! Gaps, holes, counts, disorder and volumes of a set.

use parops::{
    BruteForce, Cutoff, Domain, DomainError, ErrorKind, Face, Neighbors, Particles, SetQuality, Volumes, least_gap,
    testing::Promise,
};

const EPS: f64 = f64::EPSILON;

fn torus() -> Domain<2> {
    Domain::periodic([0.0; 2], [1.0; 2]).unwrap()
}

#[test]
fn set_quality_agrees_with_what_brute_force_counts() {
    for seed in 1..=4 {
        let set = Particles::jittered([0.0; 2], [1.0; 2], [12; 2], 0.4, seed).unwrap();
        let cutoff = Cutoff(0.2);
        let quality = SetQuality::measure(&set, &torus(), cutoff).unwrap();
        let all = BruteForce::build(&set, &torus(), cutoff).unwrap();
        let mut counts: Vec<usize> = (0..set.len()).map(|p| all.count(p, 0.2)).collect();
        let loneliest = quality.loneliest.unwrap();
        assert_eq!(counts[loneliest], quality.fewest);
        counts.sort_unstable();
        Promise::new("Neighbor lists", "counts and least gap of the quality of a set against brute force").equal(
            &(quality.fewest, quality.median, quality.most, quality.separation),
            &(counts[0], counts[72], counts[143], least_gap(&all)),
        );
        let mut least = f64::INFINITY;
        all.for_each(quality.closest.unwrap(), 0.2, |q| least = least.min(q.separation[0].hypot(q.separation[1])));
        // A root of the sum of squares, and hypot: two roundings apart.
        assert!((least / quality.separation - 1.0).abs() <= 4.0 * EPS);
    }
}

#[test]
fn disorder_is_proportional_to_small_displacements_and_zero_on_lattices() {
    let of = |amount: f64| {
        let set = Particles::jittered([0.0; 2], [1.0; 2], [16; 2], amount, 3).unwrap();
        SetQuality::measure(&set, &torus(), Cutoff(2.5 / 16.0)).unwrap()
    };
    assert!(of(0.0).disorder <= 64.0 * EPS);
    let (small, twice) = (of(1e-4), of(2e-4));
    assert!((twice.disorder / small.disorder - 2.0).abs() < 1e-3, "{} {}", small.disorder, twice.disorder);
    // The figures of the documentation.
    assert!((0.02..0.035).contains(&of(0.1).disorder) && (0.06..0.1).contains(&of(0.3).disorder));
    let most = of(0.3);
    assert!(most.largest_disorder > most.disorder && most.most_disordered.is_some());
}

#[test]
fn disorder_names_the_particle_that_was_moved() {
    let mut points = Particles::lattice([0.0; 2], [1.0; 2], [10; 2]).unwrap().points().to_vec();
    points[55] = [points[55][0] + 0.03, points[55][1]];
    let quality = SetQuality::measure(&Particles::new(points).unwrap(), &torus(), Cutoff(0.25)).unwrap();
    assert_eq!(quality.most_disordered, Some(55));
    assert!((quality.separation - 0.07).abs() < 1e-12 && [Some(55), Some(65)].contains(&quality.closest));
}

#[test]
fn fill_sees_a_hole_that_counts_do_not() {
    let mut points = Particles::lattice([0.0; 2], [1.0; 2], [20; 2]).unwrap().points().to_vec();
    // A hole of radius 2.5 h around a corner of four cells.
    points.retain(|x| (x[0] - 0.5).hypot(x[1] - 0.5) >= 2.5 / 20.0);
    for faces in [[Face::Periodic; 2], [Face::Open; 2]] {
        let domain = Domain::new([0.0; 2], [1.0; 2], [faces; 2]).unwrap();
        let set = Particles::new(points.clone()).unwrap();
        let quality = SetQuality::measure(&set, &domain, Cutoff(0.3)).unwrap();
        // The nearest of those left around (0.5, 0.5) is at (0.5, 2.5) h; probes are 0.7 h apart at most.
        let hole = 0.5_f64.hypot(2.5) / 20.0;
        Promise::new("Neighbor lists", "radius of a hole as the quality of a set sees it, less the hole")
            .in_units("h", 1.0 / 20.0)
            .within(-0.7, 20.0 * EPS, quality.fill - hole);
    }
    let sparse = Particles::new(vec![[0.1, 0.1]]).unwrap();
    assert_eq!(SetQuality::measure(&sparse, &torus(), Cutoff(0.1)).unwrap().fill, f64::INFINITY);
}

#[test]
fn fill_of_an_open_set_is_that_of_its_holes_whatever_lies_far_away() {
    let (m, radius) = (40, 4.0);
    let h = 1.0 / f64::from(m);
    let mut points = Particles::lattice([0.0; 2], [1.0; 2], [m as usize; 2]).unwrap().points().to_vec();
    points.retain(|x| (x[0] - 0.5).hypot(x[1] - 0.5) >= radius * h);
    let to_middle = |x: &[f64; 2]| (x[0] - 0.5).hypot(x[1] - 0.5);
    let hole = points.iter().map(to_middle).fold(f64::INFINITY, f64::min);
    let measure = |points: Vec<[f64; 2]>, cutoff: f64| {
        SetQuality::measure(&Particles::new(points).unwrap(), &Domain::open(), Cutoff(cutoff * h)).unwrap()
    };
    let alone = measure(points.clone(), 6.0);
    // Probes are h apart, and a middle between four corners: half of it to the next.
    assert!(alone.fill <= hole + EPS && alone.fill >= hole - 0.5 * h, "{} of {}", alone.fill / h, hole / h);
    assert!((to_middle(&points[alone.rim.unwrap()]) - hole).abs() <= h, "the rim is not beside the hole");
    for far in [2.0, 5.0, 100.0, 1e6, -1e9] {
        let mut more = points.clone();
        more.push([far; 2]);
        let quality = measure(more, 6.0);
        assert_eq!((quality.fill, quality.rim), (alone.fill, alone.rim), "with a particle at {far}");
    }
    // Two sets apart from each other: the gap between them is no hole, and the larger hole is found in either.
    let mut pair = points.clone();
    pair.extend(Particles::lattice([9.0; 2], [10.0; 2], [m as usize; 2]).unwrap().points());
    assert_eq!(measure(pair, 6.0).fill, alone.fill);
    // A cutoff far beyond the set sees it still.
    let wide = measure(points.clone(), 1e3).fill;
    assert!(wide <= hole + EPS && wide >= hole - 0.75 * h, "{} of {}", wide / h, hole / h);
}

#[test]
fn fill_sees_a_hole_across_a_face_beside_an_open_one() {
    // Two columns of a lattice are missing, in the middle or at the faces.
    let lattice = Particles::lattice([0.0; 2], [1.0; 2], [20; 2]).unwrap();
    let fill = |columns: [usize; 2], face: Face| {
        let column = |p: usize| (20.0 * lattice.points()[p][0]) as usize;
        let kept = (0..400).filter(|&p| !columns.contains(&column(p))).map(|p| lattice.points()[p]).collect();
        let domain = Domain::new([0.0; 2], [1.0; 2], [[face; 2], [Face::Open; 2]]).unwrap();
        SetQuality::measure(&Particles::new(kept).unwrap(), &domain, Cutoff(0.2)).unwrap().fill
    };
    let hole = 1.5_f64.hypot(0.5) / 20.0;
    for found in [fill([9, 10], Face::Periodic), fill([0, 19], Face::Periodic), fill([0, 19], Face::MirrorEven)] {
        assert!(found <= hole + EPS && found >= hole - 0.5 / 20.0, "{found} of {hole}");
    }
}

#[test]
fn fill_is_never_zero_where_nothing_was_probed() {
    let measure = |points: &[[f64; 2]], cutoff: f64| {
        SetQuality::measure(&Particles::new(points.to_vec()).unwrap(), &Domain::open(), Cutoff(cutoff)).unwrap()
    };
    let corners = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]];
    let none: [&[[f64; 2]]; 4] = [&[], &corners[..1], &[[0.3; 2]; 5], &[[0.0, 0.0], [1.0, 1.0]]];
    for points in none {
        let quality = measure(points, 0.5);
        assert_eq!((quality.fill, quality.rim), (f64::INFINITY, None), "{points:?}");
    }
    // All four are 0.71 away from the middle of the square, two are 0.5 away from that of a side.
    assert_eq!(measure(&corners, 0.4).fill, f64::INFINITY);
    let seen = measure(&corners, 1.5);
    assert!((seen.fill - 0.5_f64.sqrt()).abs() <= EPS && seen.rim.is_some());
    // On a line along an axis a hole is half a gap.
    let line: Vec<[f64; 2]> = (0..30).filter(|i| !(10..13).contains(i)).map(|i| [0.1 * f64::from(i), 7.0]).collect();
    let gap = measure(&line, 0.5);
    assert!((0.15..=0.2 + EPS).contains(&gap.fill), "{}", gap.fill);
}

#[test]
fn volume_defect_is_that_of_the_box_and_absent_without_one() {
    let set = Particles::jittered([0.0; 2], [1.0; 2], [10; 2], 0.3, 1).unwrap();
    let defect =
        |set: &Particles<2>, domain: &Domain<2>| SetQuality::measure(set, domain, Cutoff(0.2)).unwrap().volume_defect;
    assert!(defect(&set, &torus()).unwrap().abs() <= 64.0 * EPS);
    assert_eq!(defect(&set, &Domain::open()), None);
    assert_eq!(defect(&Particles::new(set.points().to_vec()).unwrap(), &torus()), None);
    let wrong =
        set.with_volumes(Volumes::each((0..100).map(|p| 0.0089 + 0.0004 * f64::from(p % 2)).collect()).unwrap());
    assert!((defect(&wrong.unwrap(), &torus()).unwrap() + 0.09).abs() <= 1e-12);
}

#[test]
fn set_quality_answers_on_poor_sets_and_refuses_what_cells_refuse() {
    let measure = |points: Vec<[f64; 3]>| {
        SetQuality::measure(&Particles::new(points).unwrap(), &Domain::open(), Cutoff(0.5)).unwrap()
    };
    let none = measure(Vec::new());
    assert_eq!((none.fewest, none.median, none.most, none.disorder), (0, 0, 0, 0.0));
    assert_eq!((none.separation, none.loneliest, none.fill), (f64::INFINITY, None, f64::INFINITY));
    let one = measure(vec![[1.0; 3]]);
    assert_eq!((one.most, one.separation, one.closest), (0, f64::INFINITY, None));
    let heap = measure(vec![[1.0; 3]; 5]);
    assert_eq!((heap.fewest, heap.most, heap.separation, heap.disorder), (4, 4, 0.0, 0.0));
    // A plane in space, and an outlier far away.
    let mut plane: Vec<[f64; 3]> = (0..100).map(|i| [0.1 * f64::from(i % 10), 0.1 * f64::from(i / 10), 0.0]).collect();
    plane.push([1e9, 0.0, 0.0]);
    let far = measure(plane);
    assert_eq!((far.fewest, far.loneliest), (0, Some(100)));
    let narrow = SetQuality::measure(&Particles::new(vec![[0.5; 2]]).unwrap(), &torus(), Cutoff(0.6)).unwrap_err();
    assert!(matches!(narrow.kind(), ErrorKind::Domain(DomainError::Narrow { .. })));
}
