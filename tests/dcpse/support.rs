//! Rows that are refused at first: wider supports, what stands in for them, and what the report and the error say.

use parops::{
    Apply, BruteForce, CellList, Cutoff, DcPse, Domain, Epsilon, ErrorKind, Expression, Fallback, GROWTH, Gradient,
    Histogram, Laplacian, MultiIndex, Nearest, Neighbors, OperatorError, Particles, Random, Rows, Selected, Several,
    Sign, testing::Promise,
};

type Failure = Result<(), parops::Error>;

/// Scattered particles of spacing 0.02 around an empty disk, and a line of particles across it, so that the nearest
/// neighbors of those in the middle all lie on the line.
fn line_in_a_hole() -> Particles<2> {
    let mut points: Vec<[f64; 2]> =
        Particles::jittered([-0.5; 2], [0.5; 2], [50; 2], 0.3, 7).unwrap().points().to_vec();
    points.retain(|x| x[0].hypot(x[1]) > 0.1);
    points.extend((-9..=9).map(|i| [0.01 * f64::from(i), 0.0]));
    Particles::new(points).unwrap()
}

fn cubic(x: &[f64; 2]) -> f64 {
    x[0].powi(3) - 2.0 * x[0] * x[1] * x[1] + x[1] * x[1] + 3.0
}

fn cubic_laplacian(x: &[f64; 2]) -> f64 {
    6.0 * x[0] - 4.0 * x[0] + 2.0
}

/// Rounding of a Laplacian of order 2: residual 1e-13 in scaled units over epsilon^2 = (0.03 / 2.2)^2.
const EXACT: f64 = 1e-9;

#[test]
fn supports_grow_until_the_row_is_certified_and_the_report_counts_them() -> Failure {
    let particles = line_in_a_hole();
    let dcpse = DcPse::<Laplacian<2>, 2>::new();
    let neighbors = Nearest::build(&particles, &Domain::open(), dcpse.fewest_neighbors::<2>()?)?;
    let rows = dcpse.assemble(&neighbors)?;
    let report = rows.report();
    assert!(report.grown >= 3 && report.grown < 40, "{}", report.grown);
    assert_eq!((report.lowered, report.empty, report.order), (0, 0, Some(2)));
    // More pairs than the cutoffs of the provider hold, and all of them where they belong.
    let counted: usize = (0..particles.len()).map(|p| neighbors.count(p, neighbors.cutoff(p))).sum();
    assert!(report.pairs > counted);
    assert_eq!(report.pairs, (0..particles.len()).map(|p| rows.row(p).unwrap().sources.len()).sum::<usize>());
    let f: Vec<f64> = particles.points().iter().map(cubic).collect();
    let (mut stored, mut free) = (vec![0.0; f.len()], vec![0.0; f.len()]);
    rows.apply(&f, &mut stored)?;
    dcpse.matrix_free(&neighbors)?.apply(&f, &mut free)?;
    assert_eq!(stored, free);
    for (x, out) in particles.points().iter().zip(&stored) {
        assert!((out - cubic_laplacian(x)).abs() < EXACT, "{x:?}: {out}");
    }
    // The same in f32, whose stray rows are rounded too.
    let single: Vec<f32> = f.iter().map(|&f| f as f32).collect();
    let mut out = vec![0.0_f32; f.len()];
    Rows::<_, f32>::assemble(&dcpse, &neighbors)?.apply(&single, &mut out)?;
    // eps32 times sum |w| of some 1e5 times values of 3.
    assert!(particles.points().iter().zip(&out).all(|(x, out)| (f64::from(*out) - cubic_laplacian(x)).abs() < 0.3));
    Ok(())
}

#[test]
fn refusals_name_the_cutoff_to_build_with_and_following_it_succeeds() -> Failure {
    let particles = line_in_a_hole();
    let dcpse = DcPse::<Laplacian<2>, 2>::new();
    let mut cutoff = 0.05;
    let mut refused = 0;
    let rows = loop {
        match dcpse.assemble(&CellList::build(&particles, &Domain::open(), Cutoff(cutoff))?) {
            Ok(rows) => break rows,
            Err(error) => {
                assert!(error.particle().is_some());
                assert!(error.to_string().contains("cutoff"), "{error}");
                assert_eq!(error.wanted_cutoff(), Some(GROWTH * cutoff));
                cutoff *= GROWTH;
                refused += 1;
            }
        }
    };
    assert!(refused > 2 && rows.report().grown == 0);
    Ok(())
}

/// Four lines of scattered particles: y (y - 1) (y - 2) (y - 3) vanishes on them, so that nothing of degree 4 in y can
/// be told from zero.
fn four_lines() -> Particles<2> {
    let mut random = Random::new(5);
    let points = (0..240).map(|i| [0.25 * f64::from(i / 4) + 0.1 * random.uniform(), f64::from(i % 4)]).collect();
    Particles::new(points).unwrap()
}

#[test]
fn lower_orders_stand_in_where_the_caller_allows_it() -> Failure {
    let particles = four_lines();
    let dcpse = DcPse::<Laplacian<2>, 4>::new();
    let neighbors = Nearest::build(&particles, &Domain::open(), dcpse.fewest_neighbors::<2>()?)?;
    let error = dcpse.assemble(&neighbors).unwrap_err();
    let ErrorKind::Operator(OperatorError::Uncertified { conditions, rank, .. }) = *error.kind() else {
        panic!("{error}")
    };
    assert!(conditions == 20 && rank < 20, "{error}");
    let lower = dcpse.fallback(Fallback::LowerOrder);
    let rows = lower.assemble(&neighbors)?;
    let report = rows.report();
    assert_eq!((report.order, report.lowered, report.rows), (Some(2), 240, 240));
    let worst = report.worst().unwrap();
    assert_eq!((worst.order, worst.lowered, worst.conditions), (Some(2), 2, 9));
    let f: Vec<f64> = particles.points().iter().map(cubic).collect();
    let (mut out, mut free) = (vec![0.0; f.len()], vec![0.0; f.len()]);
    rows.apply(&f, &mut out)?;
    lower.matrix_free(&neighbors)?.apply(&f, &mut free)?;
    assert_eq!(out, free);
    // Values up to 3000 on a box of length 15.
    assert!(particles.points().iter().zip(&out).all(|(x, out)| (out - cubic_laplacian(x)).abs() < 3000.0 * EXACT));
    Ok(())
}

#[test]
fn rows_are_left_empty_and_flagged_where_the_caller_allows_it() -> Failure {
    // Good particles, and a line of 600 far away: more than one block of rows.
    let mut points = Particles::jittered([0.0; 2], [1.0; 2], [20; 2], 0.3, 3)?.points().to_vec();
    points.splice(100..100, (0..600).map(|i| [100.0 + 0.05 * f64::from(i), 7.0]));
    let particles = Particles::new(points)?;
    let dcpse = DcPse::<Laplacian<2>, 2>::new();
    let neighbors = Nearest::build(&particles, &Domain::open(), dcpse.fewest_neighbors::<2>()?)?;
    assert_eq!(dcpse.assemble(&neighbors).unwrap_err().particle(), Some(100));
    let dcpse = dcpse.fallback(Fallback::Empty);
    let rows = dcpse.assemble(&neighbors)?;
    let report = rows.report();
    assert_eq!((report.empty, report.rows, report.fewest), (600, 1000, 0));
    assert!(report.worst_rows().count() == 8 && report.worst_rows().all(|row| row.empty));
    let f: Vec<f64> = particles.points().iter().map(cubic).collect();
    let (mut out, mut free) = (vec![1.0; f.len()], vec![1.0; f.len()]);
    rows.apply(&f, &mut out)?;
    dcpse.matrix_free(&neighbors)?.apply(&f, &mut free)?;
    assert_eq!(out, free);
    for (p, (x, out)) in particles.points().iter().zip(&out).enumerate() {
        let line = (100..700).contains(&p);
        assert_eq!(rows.row(p).unwrap().sources.is_empty(), line);
        assert!((out - if line { 0.0 } else { cubic_laplacian(x) }).abs() < EXACT);
    }
    // A window that is flat is no matter of support: it stays an error.
    let flat = dcpse.epsilon(parops::Epsilon::global(50.0)?);
    let error = flat.assemble(&neighbors).unwrap_err();
    assert!(
        matches!(error.kind(), ErrorKind::Operator(OperatorError::Window { .. })) && error.wanted_cutoff().is_none()
    );
    Ok(())
}

fn derivative<const D: usize>(index: [u8; D]) -> Expression<D> {
    Expression::new([(MultiIndex::new(index), 1.0)]).unwrap()
}

#[test]
fn operators_of_several_degrees_share_one_list_with_the_bits_they_have_alone() -> Failure {
    let particles = Particles::jittered([0.0; 2], [1.0; 2], [15; 2], 0.3, 9)?;
    let laplacian = DcPse::<Laplacian<2>, 2>::new();
    let gradient = DcPse::<Gradient<2>, 2>::new();
    let neighbors = CellList::build(&particles, &Domain::open(), laplacian.cutoff(&particles)?)?;
    let several = Several([Expression::of(&Laplacian::<2>)?, derivative([1, 0]), derivative([0, 1])]);
    let all = DcPse::<_, 2>::of(several).assemble(&neighbors)?;
    let (laplacian, gradient) = (laplacian.assemble(&neighbors)?, gradient.assemble(&neighbors)?);
    for p in 0..particles.len() {
        let (all, lap, grad) = (all.row(p).unwrap(), laplacian.row(p).unwrap(), gradient.row(p).unwrap());
        for ((all, lap), grad) in all.weights.iter().zip(lap.weights).zip(grad.weights) {
            assert_eq!(*all, [lap[0], grad[0], grad[1]]);
        }
        assert_eq!(all.diagonal, [lap.diagonal[0], grad.diagonal[0], grad.diagonal[1]]);
    }
    Ok(())
}

#[test]
fn shared_conditions_raise_the_lower_degrees() -> Failure {
    let particles = Particles::jittered([0.0; 2], [1.0; 2], [15; 2], 0.3, 10)?;
    let several = || Several([Expression::of(&Laplacian::<2>).unwrap(), derivative([1, 0]), derivative([0, 1])]);
    let shared = DcPse::<_, 2>::of(several()).sign(Sign::Minus).share();
    let neighbors = CellList::build(&particles, &Domain::open(), shared.cutoff(&particles)?)?;
    let rows = shared.assemble(&neighbors)?;
    // One system of the 9 conditions of the Laplacian.
    assert_eq!(rows.report().worst().map(|row| row.conditions), Some(9));
    let f: Vec<f64> = particles.points().iter().map(cubic).collect();
    let mut out = vec![[0.0; 3]; f.len()];
    rows.apply_all(&f, &mut out)?;
    // The gradient is exact for cubics, as at order 3: at order 2 it is not.
    let exact = |x: &[f64; 2]| [3.0 * x[0] * x[0] - 2.0 * x[1] * x[1], -4.0 * x[0] * x[1] + 2.0 * x[1]];
    let miss = |rows: &Rows<[f64; 3]>, out: &mut Vec<[f64; 3]>| {
        rows.apply_all(&f, out).unwrap();
        let pairs = particles.points().iter().zip(out.iter());
        pairs.fold(0.0_f64, |miss, (x, out)| miss.max((out[1] - exact(x)[0]).abs()).max((out[2] - exact(x)[1]).abs()))
    };
    let alone = DcPse::<_, 2>::of(several()).sign(Sign::Minus).assemble(&neighbors)?;
    assert!(miss(&rows, &mut out) < 1e-11 && miss(&alone, &mut out) > 1e-4);
    // Parity and sign decide: the fourth derivatives join the Laplacian, which comes to order 4.
    let bilaplacian = [([4, 0], 1.0), ([2, 2], 2.0), ([0, 4], 1.0)].map(|(index, c)| (MultiIndex::new(index), c));
    let even = Several([Expression::of(&Laplacian::<2>)?, Expression::new(bilaplacian)?]);
    let even = DcPse::<_, 2>::of(even).share();
    let neighbors = CellList::build(&particles, &Domain::open(), even.cutoff(&particles)?)?;
    let mut out = vec![[0.0; 2]; f.len()];
    let quintic: Vec<f64> = particles.points().iter().map(|x| x[0].powi(5) - x[1].powi(4) * x[0]).collect();
    even.assemble(&neighbors)?.apply_all(&quintic, &mut out)?;
    for (x, out) in particles.points().iter().zip(&out) {
        let (lap, bilap) = (20.0 * x[0].powi(3) - 12.0 * x[1] * x[1] * x[0], 120.0 * x[0] - 24.0 * x[0]);
        // Fourth derivatives lose epsilon^-4, some 1e4, of the digits.
        assert!((out[0] - lap).abs() < 1e-8 && (out[1] - bilap).abs() < 1e-5, "{out:?} {lap} {bilap}");
    }
    Ok(())
}

#[test]
fn histograms_and_worst_rows_tell_the_same_as_the_extremes() -> Failure {
    let particles = Particles::jittered([0.0; 2], [1.0; 2], [25; 2], 0.3, 12)?;
    let dcpse = DcPse::<Laplacian<2>, 4>::new();
    let neighbors = Nearest::build(&particles, &Domain::open(), dcpse.fewest_neighbors::<2>()?)?;
    let rows = dcpse.assemble(&neighbors)?;
    let report = rows.report();
    assert!([&report.conditions, &report.residuals, &report.sums].iter().all(|counts| counts.total() == 625));
    let (highest, count) = report.conditions.decades().last().unwrap();
    assert!(highest <= report.condition && report.condition < 10.0 * highest && count > 0);
    assert!(report.residuals.decades().all(|(low, _)| low <= report.residual));
    let worst: Vec<f64> = report.worst_rows().map(|row| row.condition).collect();
    assert!(worst.len() == 8 && worst[0] == report.condition && worst.is_sorted_by(|a, b| a >= b));
    Ok(())
}

#[test]
fn epsilons_of_the_caller_end_the_growth_where_the_window_ends() -> Failure {
    let particles = four_lines();
    let dcpse = DcPse::<Laplacian<2>, 4>::new();
    let neighbors = Nearest::build(&particles, &Domain::open(), dcpse.fewest_neighbors::<2>()?)?;
    // Twice, once, and not at all until cutoff/epsilon is above 6.
    for (ratio, grown) in [(4.4, 2), (5.0, 1), (5.9, 0)] {
        let epsilon = Epsilon::each((0..240).map(|p| neighbors.cutoff(p) / ratio).collect())?;
        let dcpse = dcpse.clone().epsilon(epsilon);
        let error = dcpse.assemble(&neighbors).unwrap_err();
        assert!(matches!(error.kind(), ErrorKind::Operator(OperatorError::Uncertified { .. })), "{error}");
        assert_eq!(error.wanted_cutoff(), None, "a wider provider cannot help");
        let rows = dcpse.clone().fallback(Fallback::LowerOrder).assemble(&neighbors)?;
        let worst = rows.report().worst().unwrap();
        assert_eq!((rows.report().lowered, worst.grown), (240, grown));
        assert_eq!(worst.order.map(|order| order + worst.lowered), Some(4));
        let wide = GROWTH.powi(grown as i32) * (1.0 + f64::EPSILON).powi(4) * neighbors.cutoff(worst.target);
        assert_eq!(worst.neighbors, neighbors.count(worst.target, wide));
        let empty = dcpse.fallback(Fallback::Empty).assemble(&neighbors)?;
        assert_eq!(empty.report().empty, 240);
    }
    Ok(())
}

#[test]
fn outputs_are_certified_each_on_its_own_scale() -> Failure {
    // d^2/dy^2 does not exist on a line, however small its factor; d^2/dx^2 does.
    let line: Vec<[f64; 2]> = (0..40).map(|i| [0.1 * f64::from(i) + 0.01 * f64::from(i * i % 7), 0.5]).collect();
    let particles = Particles::new(line)?;
    let neighbors = CellList::build(&particles, &Domain::open(), Cutoff(2.5))?;
    let scaled = |index, factor| Expression::new([(MultiIndex::new(index), factor)]);
    for factor in [1.0, 1e-14, 1e-300] {
        let operators = Several([scaled([2, 0], 1.0)?, scaled([0, 2], factor)?]);
        let error = DcPse::<_, 2>::of(operators).assemble(&neighbors).unwrap_err();
        assert!(matches!(error.kind(), ErrorKind::Operator(OperatorError::Uncertified { .. })), "{factor}: {error}");
    }
    // Powers of two change nothing but themselves.
    let particles = Particles::jittered([0.0; 2], [1.0; 2], [15; 2], 0.3, 9)?;
    let neighbors = CellList::build(&particles, &Domain::open(), Cutoff(0.3))?;
    let factors = [1.0, -2.0_f64.powi(-60), 2.0_f64.powi(500)];
    let several = Several([scaled([2, 0], factors[0])?, scaled([1, 1], factors[1])?, scaled([0, 2], factors[2])?]);
    let plain = Several([scaled([2, 0], 1.0)?, scaled([1, 1], 1.0)?, scaled([0, 2], 1.0)?]);
    let several = DcPse::<_, 2>::of(several).assemble(&neighbors)?;
    let plain = DcPse::<_, 2>::of(plain).assemble(&neighbors)?;
    for p in 0..particles.len() {
        for (scaled, plain) in several.row(p).unwrap().weights.iter().zip(plain.row(p).unwrap().weights) {
            assert_eq!(*scaled, std::array::from_fn(|k| plain[k] * factors[k]));
        }
    }
    Ok(())
}

#[test]
fn sets_too_small_for_an_operator_are_told_its_conditions() {
    let particles = Particles::jittered([0.0; 2], [1.0; 2], [4; 2], 0.3, 1).unwrap();
    let error = DcPse::<Laplacian<2>, 2>::new().cutoff(&particles).unwrap_err();
    let few = OperatorError::TooFew { neighbors: 15, conditions: 9, needed: 18 };
    assert_eq!(*error.kind(), ErrorKind::Operator(few));
}

#[test]
fn histograms_count_powers_of_ten_from_below_and_what_is_not_positive_as_small() {
    let edge = |x: f64| {
        let mut one = Histogram::default();
        one.add(x);
        one.decades().next().unwrap().0
    };
    let power = |exponent: i32| format!("1e{exponent}").parse::<f64>().unwrap();
    for exponent in -32..=31 {
        let x = power(exponent);
        assert_eq!([edge(x), edge(x.next_up())], [x; 2]);
        assert_eq!(edge(x.next_down()), power((exponent - 1).max(-32)));
    }
    for small in [0.0, -0.0, -1.0, f64::NEG_INFINITY, f64::MIN_POSITIVE, 5e-324] {
        assert_eq!(edge(small), 1e-32, "{small:e}");
    }
    for large in [1e32, f64::INFINITY, f64::NAN] {
        assert_eq!(edge(large), 1e31, "{large:e}");
    }
}

#[test]
fn thousands_of_neighbors_are_no_reason_to_refuse_a_row() -> Failure {
    for side in [32, 60] {
        let particles = Particles::<2>::jittered([0.0; 2], [1.0; 2], [side; 2], 0.3, 3)?;
        let all = BruteForce::build(&particles, &Domain::open(), Cutoff(1.5))?;
        for (beta, order) in [([0, 0], 1), ([1, 0], 1), ([0, 1], 2)] {
            for sign in [Sign::Plus, Sign::Minus] {
                let dcpse = DcPse::at_order(Expression::new([(MultiIndex::new(beta), 1.0)])?, order)?.sign(sign);
                let rows: Rows = dcpse.assemble(&all)?;
                let report = rows.report();
                let unit = f64::EPSILON * report.worst().unwrap().conditions as f64 * report.condition;
                Promise::new("Residuals", "largest residual of rows of 1023 and 3599 neighbors")
                    .in_units("l eps cond beta!", unit)
                    .at_most(4.0, report.residual);
            }
        }
    }
    Ok(())
}

#[test]
fn no_cutoff_is_named_that_the_domain_does_not_admit() {
    let torus = Domain::periodic([0.0; 2], [1.0; 2]).unwrap();
    let pair = Particles::new(vec![[0.3, 0.4], [0.6, 0.7]]).unwrap();
    let method = DcPse::<Laplacian<2>, 2>::new();
    // Half of the width is the widest legal one.
    for (cutoff, wanted) in [(0.5, None), (0.45, None), (0.4, Some(GROWTH * 0.4))] {
        let cells = CellList::build(&pair, &torus, Cutoff(cutoff)).unwrap();
        let error = method.assemble(&cells).unwrap_err();
        assert_eq!(error.wanted_cutoff(), wanted, "{cutoff}: {error}");
    }
}

#[test]
fn neighbors_at_the_place_of_the_particle_are_named() -> Failure {
    let mut points = Particles::jittered([0.0; 2], [1.0; 2], [10; 2], 0.3, 1)?.points().to_vec();
    let place = points[50];
    points.extend([place; 20]);
    let particles = Particles::new(points)?;
    let neighbors = Nearest::build(&particles, &Domain::open(), 18)?;
    // The corner 4 of the set determines all conditions, 50 none.
    let neighbors = Selected::new(&neighbors, &[4, 50])?;
    let dcpse = DcPse::<Laplacian<2>, 2>::new();
    for lower in [Fallback::Refuse, Fallback::LowerOrder] {
        let refused = dcpse.clone().fallback(lower).assemble(&neighbors).unwrap_err();
        assert_eq!(*refused.kind(), ErrorKind::Operator(OperatorError::OnePlace { neighbors: 20 }));
        assert_eq!((refused.particle(), refused.wanted_cutoff()), (Some(1), None));
    }
    let rows = dcpse.fallback(Fallback::Empty).assemble(&neighbors)?;
    assert_eq!((rows.report().rows, rows.report().empty), (2, 1));
    Ok(())
}
