//! Particle sets: bad inputs, constructors, volumes, spacing, the generator.

use parops::{
    BruteForce, COORDINATE_HIGH, CellList, Cutoff, Domain, DomainError, Epsilon, Error, Face, Gaussian, NeighborError,
    Neighbors, OperatorError, ParticleError, Particles, Random, Volumes, epsilon_from_neighbors,
    mean_neighbor_distance, testing::Promise, volumes_from_neighbors,
};

fn at(p: usize, kind: ParticleError) -> Error {
    Error::from(kind).at(p)
}

fn volumes<const D: usize>(particles: &Particles<D>) -> Vec<f64> {
    (0..particles.len()).map(|p| particles.volumes().unwrap().get(p).unwrap()).collect()
}

#[test]
fn coordinates_that_are_no_finite_numbers_are_refused_and_named() {
    for bad in [f64::INFINITY, f64::NEG_INFINITY] {
        let error = Particles::new(vec![[0.0, 0.0], [1.0, bad]]).unwrap_err();
        assert_eq!(error, at(1, ParticleError::Coordinate { axis: 1, coordinate: bad }));
    }
    let error = Particles::new(vec![[f64::NAN]]).unwrap_err();
    assert!(error.particle() == Some(0) && format!("{error}").contains("NaN"), "{error}");
}

#[test]
fn coordinates_whose_squares_overflow_are_refused() {
    let error = Particles::new(vec![[0.0], [-1e200]]).unwrap_err();
    assert_eq!(error, at(1, ParticleError::Range { axis: 0, value: -1e200, high: COORDINATE_HIGH }));
    assert!(Particles::new(vec![[COORDINATE_HIGH], [-COORDINATE_HIGH]]).is_ok());
}

#[test]
fn refused_moves_change_nothing() {
    let mut particles = Particles::lattice([0.0], [1.0], [4]).unwrap();
    let (points, generation) = (particles.points().to_vec(), particles.generation());
    for bad in [vec![[0.0]; 3], vec![[0.0], [0.1], [f64::NAN], [0.2]], vec![[0.0], [0.1], [1e200], [0.2]]] {
        assert!(particles.set_points(&bad).is_err());
        assert_eq!((particles.points(), particles.generation()), (&points[..], generation));
    }
    assert_eq!(
        particles.set_volumes(Volumes::each(vec![1.0; 3]).unwrap()).unwrap_err(),
        Error::from(ParticleError::Length { found: 3, needed: 4 })
    );
    assert_eq!(volumes(&particles), [0.25; 4]);
}

#[test]
fn generations_are_unique_and_follow_moves() {
    let mut a = Particles::new(vec![[0.0]]).unwrap();
    let b = Particles::new(vec![[0.0]]).unwrap();
    let copy = a.clone();
    assert_ne!(a.generation(), b.generation());
    assert_eq!(a.generation(), copy.generation());
    a.set_points(&[[0.0]]).unwrap();
    assert!(a.generation() != copy.generation() && a.generation() != b.generation());
}

#[test]
fn volumes_that_are_not_positive_numbers_are_refused_and_named() {
    for bad in [0.0, -1.0, f64::INFINITY] {
        let error = Volumes::each(vec![1.0, bad]).unwrap_err();
        assert_eq!(error, at(1, ParticleError::Volume { volume: bad }));
        let particles = Particles::new(vec![[0.0], [1.0]]).unwrap();
        assert_eq!(particles.with_equal_volumes(bad).unwrap_err(), ParticleError::Volume { volume: bad }.into());
    }
    assert!(Volumes::each(vec![f64::NAN]).is_err());
    let bare = Particles::new(vec![[0.0]; 3]).unwrap();
    assert_eq!(bare.volumes().unwrap_err(), Error::from(ParticleError::NoVolumes { count: 3 }));
}

#[test]
fn the_empty_set_is_legal_everywhere() {
    let empty = Particles::<2>::new(Vec::new()).unwrap().with_equal_volumes(1.0).unwrap();
    assert!(empty.is_empty() && empty.volumes().unwrap().is_empty());
    assert!(Particles::<3>::lattice([0.0; 3], [1.0; 3], [4, 0, 4]).unwrap().is_empty());
    let cells = CellList::build(&empty, &Domain::open(), Cutoff(0.1)).unwrap();
    assert_eq!((cells.targets(), cells.sources(), cells.count(0, 0.1)), (0, 0, 0));
    assert_eq!(empty.spacing().unwrap_err(), Error::from(ParticleError::TooFew { count: 0, needed: 1 }));
    let interval = Domain::periodic([0.0], [1.0]).unwrap();
    assert!(Particles::<1>::new(Vec::new()).unwrap().with_midpoint_volumes(&interval).is_ok());
}

#[test]
fn lattices_stand_in_the_middle_of_their_cells() {
    let lattice = Particles::lattice([-1.0, 0.0], [1.0, 1.0], [4, 2]).unwrap();
    assert_eq!(lattice.points()[..3], [[-0.75, 0.25], [-0.75, 0.75], [-0.25, 0.25]]);
    assert_eq!(volumes(&lattice), [0.25; 8]);
}

#[test]
fn jitter_stays_within_its_amount_and_its_cell() {
    let counts = [16, 12];
    let lattice = Particles::lattice([0.0; 2], [1.0, 3.0], counts).unwrap();
    for amount in [0.0, 0.1, 0.5] {
        let jittered = Particles::jittered([0.0; 2], [1.0, 3.0], counts, amount, 7).unwrap();
        let mut largest = 0.0_f64;
        for (x, y) in lattice.points().iter().zip(jittered.points()) {
            largest = largest.max((x[0] - y[0]).abs() * 16.0).max((x[1] - y[1]).abs() * 4.0);
        }
        // Coordinates up to 3 are rounded once in units of h = 1/16.
        let rounding = 3.0 * 16.0 * f64::EPSILON;
        assert!(largest <= amount + rounding && largest >= 0.95 * amount, "{largest} for {amount}");
        assert_eq!(volumes(&jittered)[0], 3.0 / 192.0);
    }
    for amount in [-0.1, 0.6] {
        let error = Particles::jittered([0.0], [1.0], [4], amount, 7).unwrap_err();
        assert_eq!(error, Error::from(ParticleError::Jitter { amount, high: 0.5 }));
    }
    assert!(Particles::jittered([0.0], [1.0], [4], f64::NAN, 7).is_err());
}

#[test]
fn constructors_refuse_illegal_boxes_and_counts() {
    let inf = f64::INFINITY;
    for result in [
        Particles::lattice([1.0], [0.0], [4]),
        Particles::random([1.0], [0.0], 4, 1),
        Particles::quasi_random([1.0], [0.0], 4, 1),
    ] {
        assert_eq!(result.unwrap_err(), Error::from(DomainError::Faces { axis: 0, lower: 1.0, upper: 0.0 }));
    }
    let error = Particles::random([0.0], [inf], 4, 1).unwrap_err();
    assert_eq!(error, Error::from(DomainError::Unbounded { axis: 0, lower: 0.0, upper: inf }));
    for counts in [[1 << 20; 2], [usize::MAX; 2]] {
        let error = Particles::lattice([0.0; 2], [1.0; 2], counts).unwrap_err();
        let found = counts[0].saturating_mul(counts[1]);
        assert_eq!(error, Error::from(ParticleError::TooMany { count: found, limit: parops::PARTICLES_HIGH }));
    }
}

#[test]
fn seeds_mean_the_same_particles_forever() {
    // Published first outputs of SplitMix64 for the seed 1234567.
    let mut random = Random::new(1234567);
    let published: [u64; 5] =
        [6457827717110365317, 3203168211198807973, 9817491932198370423, 4593380528125082431, 16408922859458223821];
    let same = Promise::new("Reproducibility", "random sets of a seed, bits of the published generator");
    same.equal(&published.map(|_| random.bits()), &published);
    assert_eq!(Random::new(1234567).uniform(), (6457827717110365317_u64 >> 11) as f64 / 2.0_f64.powi(53));
    let random = Particles::random([0.0, 0.0], [1.0, 2.0], 2, 1234567).unwrap();
    let unit = published.map(|bits| (bits >> 11) as f64 / 2.0_f64.powi(53));
    same.equal(random.points(), &[[unit[0], 2.0 * unit[1]], [unit[2], 2.0 * unit[3]]]);
}

#[test]
fn normal_variates_have_the_moments_of_the_normal_distribution() {
    const COUNT: usize = 100_000;
    // Six standard errors of the sample moments 1 to 4: sqrt(1, 2, 15, 96) / sqrt(count).
    let error = |variance: f64| 6.0 * (variance / COUNT as f64).sqrt();
    let mut random = Random::new(3);
    let mut moments = [0.0; 4];
    for _ in 0..COUNT {
        let x = random.normal();
        assert!(x.is_finite());
        (0..4).for_each(|k| moments[k] += x.powi(k as i32 + 1) / COUNT as f64);
    }
    for (k, (exact, variance)) in [(0.0, 1.0), (1.0, 2.0), (0.0, 15.0), (3.0, 96.0)].into_iter().enumerate() {
        assert!((moments[k] - exact).abs() <= error(variance), "moment {}: {}", k + 1, moments[k]);
    }
}

/// The largest |share of points below x - x| over the points, in one dimension.
fn star_discrepancy(mut points: Vec<f64>) -> f64 {
    points.sort_unstable_by(f64::total_cmp);
    let n = points.len() as f64;
    let gaps = points.iter().zip(0..).map(|(x, i)| (x - f64::from(i) / n).max(f64::from(i + 1) / n - x));
    gaps.fold(0.0, f64::max)
}

#[test]
fn quasi_random_points_are_even_but_no_lattice() {
    for n in [64_usize, 256, 1024] {
        let set = Particles::quasi_random([0.0], [1.0], n, 11).unwrap();
        let mut points: Vec<f64> = set.points().iter().map(|x| x[0]).collect();
        let discrepancy = star_discrepancy(points.clone());
        // N D* <= 3/2 log2 N + 3 holds for the golden ratio with room to spare; random sets have about sqrt N.
        assert!(discrepancy * n as f64 <= 1.5 * (n as f64).log2() + 3.0, "{n}: {discrepancy}");
        points.sort_unstable_by(f64::total_cmp);
        let gaps = || points.windows(2).map(|pair| (pair[1] - pair[0]) * n as f64);
        let (low, high) = (gaps().fold(9.0, f64::min), gaps().fold(0.0, f64::max));
        // Three gaps, whose ratios are powers of the golden ratio.
        assert!(low > 0.3 && high < 2.0 && high / low > 1.5, "{n}: gaps {low} to {high}");
    }
    let a = Particles::quasi_random([0.0; 3], [1.0; 3], 100, 1).unwrap();
    let b = Particles::quasi_random([0.0; 3], [1.0; 3], 100, 2).unwrap();
    assert_ne!(a.points()[0], b.points()[0]);
    assert_eq!(volumes(&a), [0.01; 100]);
}

#[test]
fn midpoint_volumes_fill_the_interval() {
    let points = || Particles::new(vec![[0.5], [0.0], [0.75]]).unwrap();
    let closed = Domain::new([0.0], [1.0], [[Face::Open; 2]]).unwrap();
    assert_eq!(volumes(&points().with_midpoint_volumes(&closed).unwrap()), [0.375, 0.25, 0.375]);
    let ring = Domain::periodic([0.0], [1.0]).unwrap();
    assert_eq!(volumes(&points().with_midpoint_volumes(&ring).unwrap()), [0.375, 0.375, 0.25]);
    let single = Particles::new(vec![[0.3]]).unwrap();
    assert_eq!(volumes(&single.clone().with_midpoint_volumes(&closed).unwrap()), [1.0]);
    // Both ends are rounded: 0.3 - 0.5 and 0.3 + 0.5.
    assert!((volumes(&single.with_midpoint_volumes(&ring).unwrap())[0] - 1.0).abs() <= f64::EPSILON);
}

#[test]
fn midpoint_volumes_of_coincident_or_outlying_points_are_refused() {
    let closed = Domain::new([0.0], [1.0], [[Face::Open; 2]]).unwrap();
    let twins = Particles::new(vec![[0.5], [0.25], [0.5]]).unwrap();
    assert_eq!(twins.with_midpoint_volumes(&closed).unwrap_err(), at(2, ParticleError::Coincident { other: 0 }));
    let seam = Particles::new(vec![[0.0], [1.0]]).unwrap();
    let ring = Domain::periodic([0.0], [1.0]).unwrap();
    assert_eq!(seam.with_midpoint_volumes(&ring).unwrap_err(), at(1, ParticleError::Coincident { other: 0 }));
    let outside = Particles::new(vec![[0.5], [1.5]]).unwrap();
    let kind = DomainError::Outside { axis: 0, coordinate: 1.5, lower: 0.0, upper: 1.0 };
    assert_eq!(outside.with_midpoint_volumes(&closed).unwrap_err(), Error::from(kind).at(1));
    let kind = DomainError::Unbounded { axis: 0, lower: f64::NEG_INFINITY, upper: f64::INFINITY };
    let single = Particles::new(vec![[0.5]]).unwrap();
    assert_eq!(single.with_midpoint_volumes(&Domain::open()).unwrap_err(), Error::from(kind));
}

#[test]
fn spacing_is_exact_for_lattices_lines_and_planes() {
    // The root is found to one rounding; the product of D factors adds a few more.
    const TOLERANCE: f64 = 16.0 * f64::EPSILON;
    let bare = |set: &Particles<3>| Particles::new(set.points().to_vec()).unwrap();
    for counts in [[8, 4, 2], [8, 1, 1], [1, 6, 3], [2, 1, 1]] {
        let upper = counts.map(|count| 0.5 * count as f64);
        let set = Particles::lattice([0.0; 3], upper, counts).unwrap();
        let h = bare(&set).spacing().unwrap().0;
        assert!((h / 0.5 - 1.0).abs() <= TOLERANCE, "{counts:?}: {h}");
        assert!((set.spacing().unwrap().0 / 0.5 - 1.0).abs() <= TOLERANCE);
    }
    let coincident = Particles::new(vec![[0.5]; 4]).unwrap();
    assert_eq!(coincident.spacing().unwrap_err(), Error::from(ParticleError::Spacing { spacing: 0.0 }));
    let single = Particles::new(vec![[0.5]]).unwrap();
    assert_eq!(single.spacing().unwrap_err(), Error::from(ParticleError::TooFew { count: 1, needed: 2 }));
}

#[test]
fn spacing_of_equal_volumes_does_not_depend_on_their_number() {
    // V and the root are rounded once each, and cbrt to an ulp.
    const TOLERANCE: f64 = 2.0 * f64::EPSILON;
    for n in [3, 7, 24, 49, 60] {
        let line = Particles::lattice([0.0], [1.0], [n]).unwrap();
        let square = Particles::lattice([0.0; 2], [1.0; 2], [n; 2]).unwrap();
        let cube = Particles::lattice([0.0; 3], [1.0; 3], [n; 3]).unwrap();
        let spacings = [line.spacing(), square.spacing(), cube.spacing()].map(|h| h.unwrap().0);
        for h in spacings {
            assert!((h * n as f64 - 1.0).abs() <= TOLERANCE, "{n}: {h:e}");
        }
    }
}

#[test]
fn box_that_fits_two_cutoffs_of_its_own_spacing_is_wide_enough() {
    fn fits<const D: usize>(n: usize) {
        let width = 0.1 * n as f64;
        let set = Particles::lattice([0.0; D], [width; D], [n; D]).unwrap();
        let torus = Domain::periodic([0.0; D], [width; D]).unwrap();
        let epsilon = set.spacing().unwrap().epsilon(n as f64 / 12.0).unwrap();
        assert_eq!(torus.admits(epsilon.cutoff(6.0)), Ok(()), "D = {D}, n = {n}");
        let wider = set.spacing().unwrap().epsilon(n as f64 / 12.0 * (1.0 + 1e-14)).unwrap();
        assert!(torus.admits(wider.cutoff(6.0)).is_err());
    }
    for n in (12..=96).chain([200]) {
        fits::<1>(n);
        fits::<2>(n);
    }
    for n in 12..=48 {
        fits::<3>(n);
    }
}

#[test]
fn epsilon_follows_the_local_spacing_and_names_lonely_particles() {
    // Rings of spacing 1 and 2, with cutoffs that hold two neighbors on either side.
    let ring_of = |h: f64| Particles::new((0..16).map(|i| [h * f64::from(i)]).collect()).unwrap();
    for h in [1.0, 2.0] {
        let ring = Domain::periodic([0.0], [16.0 * h]).unwrap();
        let cells = CellList::build(&ring_of(h), &ring, Cutoff(2.0 * h)).unwrap();
        assert_eq!(mean_neighbor_distance(&cells, 5).unwrap().0, 1.5 * h);
        assert_eq!(epsilon_from_neighbors(&cells, 2.0).unwrap().range(), (3.0 * h, 3.0 * h));
    }
    // Component-wise: the four nearest of a square lattice are at distance h, the diagonal ones at 2 h.
    let square = Particles::lattice([0.0; 2], [8.0; 2], [8; 2]).unwrap();
    let torus = Domain::periodic([0.0; 2], [8.0; 2]).unwrap();
    let cells = CellList::build(&square, &torus, Cutoff(1.5)).unwrap();
    assert_eq!(mean_neighbor_distance(&cells, 0).unwrap().0, 1.5);

    let lonely = Particles::new(vec![[0.0], [0.1], [9.0]]).unwrap();
    let cells = CellList::build(&lonely, &Domain::open(), Cutoff(0.5)).unwrap();
    let error = epsilon_from_neighbors(&cells, 2.0).unwrap_err();
    assert_eq!(error, Error::from(NeighborError::Isolated { cutoff: 0.5 }).at(2));
    let twins = Particles::new(vec![[0.0], [0.0]]).unwrap();
    let cells = CellList::build(&twins, &Domain::open(), Cutoff(0.5)).unwrap();
    assert_eq!(epsilon_from_neighbors(&cells, 2.0).unwrap_err(), at(0, ParticleError::Spacing { spacing: 0.0 }));
    assert!(mean_neighbor_distance(&cells, 2).is_err());
}

#[test]
fn inverse_kernel_sum_gives_the_cell_volume_on_lattices() {
    let square = Particles::lattice([0.0; 2], [1.0; 2], [20; 2]).unwrap();
    let torus = Domain::periodic([0.0; 2], [1.0; 2]).unwrap();
    let kernel = Gaussian::<2>::new();
    let epsilon = Epsilon::global(0.05).unwrap();
    let cutoff = epsilon.cutoff(parops::Kernel::<f64, 2>::support(&kernel));
    let cells = CellList::build(&square, &torus, cutoff).unwrap();
    let volumes = volumes_from_neighbors(&cells, &kernel, &epsilon).unwrap();
    // exp(-r^2 / 2) at overlap 1: the lattice sum misses the integral by 4 exp(-2 pi^2) = 1.1e-8, the cut tail by less.
    for p in 0..400 {
        let volume = volumes.get(p).unwrap();
        assert!((volume / 0.0025 - 1.0).abs() <= 2e-8, "particle {p}: {volume}");
    }
    let short = CellList::build(&square, &torus, Cutoff(0.5 * cutoff.0)).unwrap();
    let reach = 0.5 * cutoff.0;
    assert_eq!(
        volumes_from_neighbors(&short, &kernel, &epsilon).unwrap_err(),
        Error::from(NeighborError::Reach { cutoff: cutoff.0, reach }).at(0)
    );
    let off = BruteForce::build_at(&[[0.5; 2]], &square, &torus, cutoff).unwrap();
    let neighbors = off.count(0, cutoff.0);
    assert_eq!(
        volumes_from_neighbors(&off, &kernel, &epsilon).unwrap_err(),
        Error::from(OperatorError::NoCenter { neighbors }).at(0)
    );
}
