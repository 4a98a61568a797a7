//! The catalogue of stencils: every kind that determines its conditions is accepted, and its rows meet their bounds,
//! measured here and not by the library; those that do not are refused with the right typed error; alike at all scales.

use crate::stencils::{Stencils, candidates, condition, length, moments, monomials, terms};
use parops::{
    CUTOFF_OVER_EPSILON, D1, D2, D3, DcPse, Domain, Epsilon, ErrorKind, Gradient, Laplacian, Nearest, Neighbors,
    Operator, OperatorError, ParticleError, Particles, Random, testing::Promise,
};

/// What became of a row.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Verdict {
    Accepted,
    /// Fewer conditions are independent than there are.
    Deficient {
        neighbors: usize,
        conditions: usize,
        rank: usize,
    },
    /// All are, and the row still misses them by more than rounding.
    Inexact {
        neighbors: usize,
        conditions: usize,
    },
}

/// Points around the origin, spacing about 1. Each kind holds twice as many points as there are conditions, in general
/// position: none may be refused.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    Lattice,
    Jittered(f64),
    Random,
    /// Half, quarter and eighth.
    Cut(usize),
    /// The last axis shrunk to 1 : this.
    Sliver(f64),
    /// One pair at 1e-6.
    Pair,
    Clustered,
    /// Spacings from 1 to 8 along the first axis.
    Graded,
}

const KINDS: [Kind; 14] = [
    Kind::Lattice,
    Kind::Jittered(0.1),
    Kind::Jittered(0.3),
    Kind::Jittered(0.45),
    Kind::Random,
    Kind::Cut(1),
    Kind::Cut(2),
    Kind::Cut(3),
    Kind::Sliver(10.0),
    Kind::Sliver(100.0),
    Kind::Sliver(1000.0),
    Kind::Pair,
    Kind::Clustered,
    Kind::Graded,
];

impl Kind {
    /// Whether it is a kind of its own in so many dimensions.
    fn exists(self, dimensions: usize) -> bool {
        match self {
            Self::Cut(axes) => axes <= dimensions,
            Self::Sliver(_) => dimensions > 1,
            _ => true,
        }
    }

    fn points<const D: usize>(self, count: usize, seed: u64) -> Vec<[f64; D]> {
        let mut random = Random::new(seed);
        let mut jittered = |jitter: f64, cut: usize| {
            let mut points: Vec<[f64; D]> = candidates(count, jitter, cut)
                .iter()
                .map(|x| x.map(|x| x + jitter * (2.0 * random.uniform() - 1.0)))
                .collect();
            points.sort_by(|a, b| length(a).total_cmp(&length(b)));
            // Whole shells of a lattice.
            let last = length(&points[count - 1]) * (1.0 + 1e-9);
            points.truncate(points.partition_point(|x| length(x) <= last));
            points
        };
        match self {
            Self::Lattice => jittered(0.0, 0),
            Self::Jittered(jitter) => jittered(jitter, 0),
            Self::Cut(axes) => jittered(0.3, axes),
            Self::Sliver(aspect) => {
                let mut points = jittered(0.3, 0);
                points.iter_mut().for_each(|x| x[D - 1] /= aspect);
                points
            }
            Self::Pair => {
                let mut points = jittered(0.3, 0);
                let beside = points[1].map(|x| x + 1e-6 / (D as f64).sqrt());
                points.pop();
                points.push(beside);
                points
            }
            Self::Graded => {
                let mut points = jittered(0.3, 0);
                let widest = points.iter().fold(0.0, |widest: f64, x| widest.max(x[0].abs()));
                // The spacing 8^((s + 1)/2) along the first axis, s from -1 to 1.
                let place = |s: f64| 2.0 * 8.0_f64.powf(0.5 * (s + 1.0)) / 8.0_f64.ln();
                points.iter_mut().for_each(|x| x[0] = widest * (place(x[0] / widest) - place(0.0)));
                points
            }
            Self::Random => {
                let mut points: Vec<[f64; D]> = Vec::new();
                let radius = (count as f64).powf(1.0 / D as f64);
                while points.len() < count {
                    let point: [f64; D] = std::array::from_fn(|_| radius * (2.0 * random.uniform() - 1.0));
                    if length(&point) <= radius {
                        points.push(point);
                    }
                }
                points
            }
            Self::Clustered => {
                // Half of the points within a tenth of the radius around one of the others.
                let mut points = jittered(0.3, 0);
                let mut spread = Random::new(seed + 1);
                let (radius, heart) = (length(&points[count - 1]), points[count / 2]);
                for point in points.iter_mut().skip(count / 2 + 1) {
                    *point = heart.map(|x| x + 0.1 * radius * (2.0 * spread.uniform() - 1.0));
                }
                points
            }
        }
    }
}

fn promise(text: &'static str, unit: &'static str, size: f64) -> Promise {
    Promise::new("Residuals", text).in_units(unit, size)
}

/// The verdict on one stencil among easy ones, after the row has been measured.
fn verdict<const D: usize, const K: usize, Op: Operator<D, Out = [f64; K]> + Clone>(
    operator: &Op,
    order: u32,
    points: &[[f64; D]],
    scale: f64,
) -> Verdict {
    const PLACE: usize = 1;
    let dcpse = DcPse::at_order(operator.clone(), order).unwrap();
    let offsets: Vec<[f64; D]> = points.iter().map(|x| x.map(|x| x * scale)).collect();
    let cutoff = offsets.iter().map(length).fold(0.0, f64::max) * (1.0 + 1e-9);
    let easy = Kind::Jittered(0.1).points::<D>(dcpse.fewest_neighbors::<D>().unwrap(), 77);
    let fit = cutoff * (1.0 - 1e-9) / easy.iter().map(length).fold(0.0, f64::max);
    let easy: Vec<[f64; D]> = easy.iter().map(|x| x.map(|x| x * fit)).collect();
    let stencils = Stencils { offsets: vec![easy.clone(), offsets.clone(), easy], cutoff };
    let rows = match dcpse.assemble(&stencils) {
        Ok(rows) => rows,
        Err(error) => {
            assert_eq!(error.particle(), Some(PLACE), "{error}");
            return match *error.kind() {
                ErrorKind::Operator(OperatorError::Uncertified {
                    neighbors,
                    conditions,
                    rank,
                    condition,
                    residual,
                    ratio,
                    ..
                }) => {
                    assert!((ratio / CUTOFF_OVER_EPSILON - 1.0).abs() < 1e-12 && residual > 0.0 && condition > 0.0);
                    if rank < conditions {
                        Verdict::Deficient { neighbors, conditions, rank }
                    } else {
                        Verdict::Inexact { neighbors, conditions }
                    }
                }
                ErrorKind::Operator(OperatorError::Singular { neighbors, conditions, rank, .. }) => {
                    Verdict::Deficient { neighbors, conditions, rank }
                }
                _ => panic!("{error}"),
            };
        }
    };
    let row = rows.row(PLACE).unwrap();
    assert_eq!(row.sources.len(), points.len());
    let epsilon = cutoff / CUTOFF_OVER_EPSILON;
    let inverse = 1.0 / epsilon;
    let z: Vec<[f64; D]> = offsets.iter().map(|x| x.map(|x| -x * inverse)).collect();
    for (k, terms) in terms(operator).iter().enumerate() {
        let degree = terms[0].index.degree();
        let odd = degree % 2 == 1;
        let low = u32::from(degree > 0 && !odd);
        let (alphas, columns) = monomials(&z, low, degree + order - 1);
        let found = moments(&row, k, terms, (&alphas, &columns), &z, epsilon);
        let unit = alphas.len() as f64 * f64::EPSILON;
        let required = terms.iter().map(|t| t.factor.abs() * t.index.factorial().unwrap() as f64).fold(0.0, f64::max);
        let condition = condition(&z, odd, low, degree + order - 1);
        let residual = found.residual();
        // Weights are divided by epsilon^m in the library and multiplied by it here: m + 1 roundings each.
        let own = f64::from(degree + 1) * f64::EPSILON * found.terms;
        let size = unit * condition * required + 0.25 * own;
        // Dependent conditions that agree have a row and no condition number.
        if condition.is_finite() {
            promise("residual of rows of the catalogue", "l eps cond beta!", size).at_most(4.0, residual);
        }
        promise("residual of rows of the catalogue by their terms", "l eps sum abs", unit * found.terms)
            .at_most(30.0, residual);
    }
    Verdict::Accepted
}

const SCALES: [f64; 3] = [1.0, 1e-40, 1e40];

/// The one verdict at all scales.
fn at_all_scales<const D: usize, const K: usize, Op: Operator<D, Out = [f64; K]> + Clone>(
    operator: &Op,
    order: u32,
    points: &[[f64; D]],
) -> Verdict {
    let verdicts = SCALES.map(|scale| verdict(operator, order, points, scale));
    assert_eq!(verdicts, [verdicts[0]; 3]);
    verdicts[0]
}

fn run<const D: usize, const K: usize, Op: Operator<D, Out = [f64; K]> + Clone>(
    name: &str,
    operator: &Op,
    orders: &[u32],
) {
    for &order in orders {
        let dcpse = DcPse::at_order(operator.clone(), order).unwrap();
        let count = dcpse.fewest_neighbors::<D>().unwrap();
        for kind in KINDS.into_iter().filter(|kind| kind.exists(D)) {
            for seed in 0..SEEDS {
                let found = at_all_scales(operator, order, &kind.points::<D>(count, seed));
                let case = format!("{D}D {name} r {order} {kind:?}, seed {seed}: {found:?}");
                let accepted =
                    "stencils of the catalogue have rows, slivers to 1 : 1000, pairs at 1e-6 and clusters too";
                Promise::new("Residuals", accepted).case(case).holds(found == Verdict::Accepted);
            }
        }
    }
}

/// Stencils of every kind.
const SEEDS: u64 = 4;

#[test]
fn rows_of_every_kind_exist_and_meet_their_bounds_alike_at_all_scales() {
    run("first", &D1::<1>::default(), &[1, 2, 4]);
    run("second", &D1::<2>::default(), &[2, 3, 4]);
    run("third", &D1::<3>::default(), &[2, 4]);
    run("fourth", &D1::<4>::default(), &[2]);
    run("gradient", &Gradient::<2>, &[1, 2, 4]);
    run("laplacian", &Laplacian::<2>, &[2, 3, 4]);
    run("mixed", &D2::<1, 1>::default(), &[2, 4]);
    run("third", &D2::<2, 1>::default(), &[2, 4]);
    run("fourth", &D2::<2, 2>::default(), &[2]);
    run("value", &D2::<0, 0>::default(), &[2, 4]);
    run("gradient", &Gradient::<3>, &[1, 2, 4]);
    run("laplacian", &Laplacian::<3>, &[2, 4]);
    run("mixed", &D3::<1, 1, 1>::default(), &[2]);
}

/// Every operator a stencil is tried with: rank that must be found, or none where the row must be accepted.
fn must_be<const D: usize, const K: usize, Op: Operator<D, Out = [f64; K]> + Clone>(
    operator: &Op,
    order: u32,
    points: &[[f64; D]],
    rank: Option<usize>,
) {
    let found = at_all_scales(operator, order, points);
    let as_due = match (found, rank) {
        (Verdict::Accepted, None) => true,
        (Verdict::Deficient { neighbors, rank: found, .. }, Some(rank)) => (neighbors, found) == (points.len(), rank),
        _ => false,
    };
    Promise::new("Input", "stencils that do not determine a derivative are refused with their rank, others are not")
        .case(format!("{found:?} where the rank is {rank:?}"))
        .holds(as_due);
}

/// Points spread at random along one parameter from -2 to 2.
fn along<const D: usize>(count: usize, seed: u64, place: impl Fn(f64, &mut Random) -> [f64; D]) -> Vec<[f64; D]> {
    let mut random = Random::new(seed);
    (0..count)
        .map(|_| {
            let t = 4.0 * random.uniform() - 2.0;
            place(t, &mut random)
        })
        .collect()
}

#[test]
fn collinear_and_coplanar_points_are_refused_with_their_rank() {
    for seed in 0..SEEDS {
        // On a line through the target z, z^2, ... are what is left of all monomials, and of the gradient also 1.
        let line = along(24, seed, |t, _| [0.6 * t, -0.8 * t]);
        must_be(&Laplacian::<2>, 2, &line, Some(3));
        must_be(&Gradient::<2>, 2, &line, Some(3));
        must_be(&D2::<1, 1>::default(), 3, &along(30, seed, |t, _| [0.6 * t, -0.8 * t]), Some(4));
        // Along an axis the monomials of the other vanish.
        let axis = along(24, seed, |t, _| [t, 0.0]);
        must_be(&Laplacian::<2>, 2, &axis, Some(3));
        // In a plane through the target, those of two variables to degree 3 are left: 9, and 5 of degree at most 2, and 1.
        let plane = along(60, seed, |t, random| {
            let s = 4.0 * random.uniform() - 2.0;
            [t, s, 0.5 * t - 0.25 * s]
        });
        must_be(&Laplacian::<3>, 2, &plane, Some(9));
        must_be(&Gradient::<3>, 2, &plane, Some(6));
        let line = along(60, seed, |t, _| [0.6 * t, -0.8 * t, 0.3 * t]);
        must_be(&Laplacian::<3>, 2, &line, Some(3));
    }
}

#[test]
fn points_on_a_conic_are_refused_where_its_equation_is_among_the_conditions() {
    for seed in 0..SEEDS {
        // q = x^2/4 + y^2 - 1 vanishes on an ellipse around the target. Of the products that have no constant, x q and y q
        // say nothing of a second derivative: rank 7 of 9, and weights nevertheless.
        let ellipse = along(40, seed, |t, _| [2.0 * (1.5 * t).cos(), (1.5 * t).sin()]);
        must_be(&Laplacian::<2>, 2, &ellipse, None);
        // x^2 q and y^2 q do, and for the gradient x q and y q.
        must_be(&Laplacian::<2>, 3, &ellipse, Some(9));
        must_be(&Gradient::<2>, 3, &ellipse, Some(8));
        // The target itself, which '+' counts, lies off the ellipse: no product of degree 2 vanishes on all nodes.
        must_be(&Gradient::<2>, 2, &ellipse, None);
        must_be(&Gradient::<2>, 2, &along(24, seed, |t, _| [t, t * t - 0.5 * t]), Some(5));
        // A parabola through the target: y = x^2 - x/2 itself and its products with x and y.
        must_be(&Laplacian::<2>, 2, &along(24, seed, |t, _| [t, t * t - 0.5 * t]), Some(6));
    }
}

#[test]
fn duplicates_count_as_one_place() {
    for seed in 0..SEEDS {
        let twice = |places: usize, count: usize| -> Vec<[f64; 2]> {
            let points = Kind::Jittered(0.3).points::<2>(places, seed);
            points.iter().cycle().take(count).copied().collect()
        };
        must_be(&Laplacian::<2>, 2, &twice(14, 28), None);
        must_be(&Laplacian::<2>, 2, &twice(7, 21), Some(7));
        must_be(&D1::<2>::default(), 2, &[[1.0]; 8], Some(1));
        let mut on_target = twice(18, 18);
        on_target.extend([[0.0; 2]; 6]);
        must_be(&Laplacian::<2>, 2, &on_target, None);
        must_be(&Gradient::<2>, 2, &on_target, None);
    }
}

#[test]
fn sets_far_from_the_origin_are_served_until_their_coordinates_are_illegal() {
    // At 10^9 spacings a coordinate holds seven digits of a separation, which is exact as it stands.
    for scale in SCALES {
        let set = Particles::<2>::jittered([0.0; 2], [12.0; 2], [12; 2], 0.3, 3).unwrap();
        let far = set.points().iter().map(|x| x.map(|x| (x + 1e9) * scale)).collect();
        let far = match Particles::new(far) {
            Ok(far) => far,
            Err(error) => {
                assert!(scale == 1e40 && error.particle() == Some(0));
                assert!(matches!(error.kind(), ErrorKind::Particle(ParticleError::Range { axis: 0, .. })));
                continue;
            }
        };
        assert!(scale < 1e40);
        let dcpse = DcPse::<Laplacian<2>, 2>::new();
        let neighbors = Nearest::build(&far, &Domain::open(), dcpse.fewest_neighbors::<2>().unwrap()).unwrap();
        let rows = dcpse.assemble(&neighbors).unwrap();
        for p in 0..far.len() {
            let row = rows.row(p).unwrap();
            let epsilon = neighbors.cutoff(p) / CUTOFF_OVER_EPSILON;
            let separation = |&q: &u32| std::array::from_fn(|i| far.points()[p][i] - far.points()[q as usize][i]);
            let z: Vec<[f64; 2]> =
                row.sources.iter().map(|q| separation(q).map(|x: f64| x * (1.0 / epsilon))).collect();
            let (alphas, columns) = monomials(&z, 1, 3);
            let found = moments(&row, 0, &terms(&Laplacian::<2>)[0], (&alphas, &columns), &z, epsilon);
            let unit = 9.0 * f64::EPSILON;
            promise("residual 10^9 spacings from the origin by its terms", "l eps sum abs", unit * found.terms)
                .at_most(30.0, found.residual());
            let size = unit * 2.0 * condition(&z, false, 1, 3);
            promise("residual 10^9 spacings from the origin", "l eps cond beta!", size).at_most(4.0, found.residual());
        }
    }
}

#[test]
fn too_few_neighbors_and_windows_of_no_use_are_refused_alike_at_all_scales() {
    let points = Kind::Jittered(0.3).points::<2>(17, 1);
    for scale in SCALES {
        let offsets: Vec<[f64; 2]> = points.iter().map(|x| x.map(|x| x * scale)).collect();
        let cutoff = offsets.iter().map(length).fold(0.0, f64::max);
        let stencils = Stencils { offsets: vec![offsets], cutoff };
        let dcpse = DcPse::<Laplacian<2>, 2>::new();
        let error = dcpse.assemble(&stencils).unwrap_err();
        let ErrorKind::Operator(OperatorError::TooFew { neighbors, conditions, needed, .. }) = *error.kind() else {
            panic!("{error}");
        };
        assert_eq!((error.particle(), neighbors, conditions, needed), (Some(0), 17, 9, 18));
        for legal in [0.9, 7.0] {
            let narrow = dcpse.clone().neighbors_per_condition(1.0).unwrap();
            let error = narrow.epsilon(Epsilon::global(cutoff / legal).unwrap()).assemble(&stencils).unwrap_err();
            let ErrorKind::Operator(OperatorError::Window { ratio, .. }) = *error.kind() else { panic!("{error}") };
            assert!((ratio / legal - 1.0).abs() < 1e-12 && error.particle() == Some(0));
        }
    }
}
