//! One-sided kernels and their operators: the tables, exactness, orders, upwind stability, closures, refusals.

use std::f64::consts::{PI, TAU};

use parops::testing::{KernelLimits, MethodFault, check_kernel, check_method, check_method_moments};
use parops::{
    Allowance, Apply, CellList, D1, D2, D3, Domain, Epsilon, Error, ErrorKind, Expression, Face, Kernel, KernelError,
    MultiIndex, NeighborError, Neighbors, OneSided, OneSidedGaussian, OperatorError, ParticleError, Particles, Random,
    Rows, Selected, Side, Term, Upwind, UpwindGradient, UpwindRows, Volumes, testing::Promise,
};
use serde_json::Value;

type Failure = Result<(), Error>;

const SIDES: [Side; 2] = [Side::Left, Side::Right];

fn table(entry: &str) -> Value {
    let whole: Value = serde_json::from_str(include_str!("../data/pse_kernels.json")).expect("JSON");
    whole[entry].clone()
}

fn number(value: &Value) -> f64 {
    value.as_str().expect("numbers are strings").parse().expect("a number")
}

/// d^beta along an axis.
fn along<const D: usize>(axis: usize, beta: u8) -> Term<D> {
    Term { index: MultiIndex::new(std::array::from_fn(|i| if i == axis { beta } else { 0 })), factor: 1.0 }
}

fn operator<const D: usize>(axis: usize, beta: u8) -> Expression<D> {
    let Term { index, factor } = along(axis, beta);
    Expression::new([(index, factor)]).expect("one term")
}

fn random_set<const D: usize>(count: usize, seed: u64) -> Particles<D> {
    let mut random = Random::new(seed);
    let points = (0..count).map(|_| std::array::from_fn(|_| random.uniform())).collect();
    let volumes = (0..count).map(|_| (0.5 + random.uniform()) / count as f64).collect();
    Particles::new(points).unwrap().with_volumes(Volumes::each(volumes).unwrap()).unwrap()
}

fn torus<const D: usize>() -> Domain<D> {
    Domain::periodic([0.0; D], [1.0; D]).unwrap()
}

#[test]
fn continuous_kernels_equal_every_entry_of_the_table_on_both_sides() -> Failure {
    // The table has 30 digits; a coefficient is rounded once.
    const TOLERANCE: f64 = 1e-14;
    let table = table("one_sided_1d");
    let mut entries = 0;
    for (key, entry) in table.as_object().unwrap() {
        let (beta, order) = key.strip_prefix("beta").unwrap().split_once("_r").unwrap();
        let (beta, order): (u8, u32) = (beta.parse().unwrap(), order.parse().unwrap());
        let kernel = OneSidedGaussian::<1>::new(along(0, beta), Side::Left, order)?;
        let expected: Vec<f64> = entry["a_decimal"].as_array().unwrap().iter().map(number).collect();
        assert_eq!(kernel.coefficients().len(), expected.len(), "{key}");
        for (found, expected) in kernel.coefficients().iter().zip(&expected) {
            assert!((found - expected).abs() <= TOLERANCE * expected.abs(), "{key}: {found} {expected}");
            entries += 1;
        }
        let leading = u32::from(beta) + order;
        for (n, name) in [(0, "M_0_decimal"), (leading, "leading_error_moment_decimal")] {
            let (found, expected) = (kernel.axis_moment(n), number(&entry[name]));
            assert!((found - expected).abs() <= TOLERANCE * expected.abs(), "{key} M_{n}: {found} {expected}");
        }
        // eta_R(z) = (-1)^beta eta_L(-z), and each is zero on the other side.
        let right = OneSidedGaussian::<1>::new(along(0, beta), Side::Right, order)?;
        for z in [0.1, 0.7, 2.3] {
            let polynomial: f64 = expected.iter().rev().fold(0.0, |sum, a| sum * z + a) * z;
            let terms: f64 = expected.iter().rev().fold(0.0, |sum, a| sum * z + a.abs()) * z;
            let gauss = f64::exp(-z * z) / PI.sqrt();
            let left: f64 = kernel.value(&[z]);
            assert!((left - polynomial * gauss).abs() <= TOLERANCE * terms * gauss, "{key} at {z}");
            assert_eq!(right.value(&[-z]), left * if beta == 1 { -1.0 } else { 1.0 }, "{key} at {z}");
            assert_eq!((kernel.value(&[-z]), right.value(&[z])), (0.0, 0.0));
        }
    }
    assert_eq!(entries, 1 + 2 + 3 + 4 + 2 + 3 + 4 + 5);
    Ok(())
}

#[test]
fn kernels_of_any_degree_and_order_up_to_eight_have_their_half_line_moments() -> Failure {
    // Half an ulp of a moment, once it is summed with twice the digits.
    const TOLERANCE: f64 = f64::EPSILON;
    let mut kernels = 0;
    for beta in 1..8_u8 {
        for order in 1..=8 - u32::from(beta) {
            let kernel = OneSidedGaussian::<1>::new(along(0, beta), Side::Left, order)?;
            let factorial: f64 = (1..=u32::from(beta)).map(f64::from).product();
            for n in 1..u32::from(beta) + order {
                let required =
                    if n == u32::from(beta) { factorial * f64::from(along::<1>(0, beta).index.sign()) } else { 0.0 };
                let found = kernel.axis_moment(n);
                assert!((found - required).abs() <= TOLERANCE * factorial, "beta {beta} r {order} M_{n}: {found}");
            }
            assert!(kernel.axis_moment(u32::from(beta) + order).abs() > 0.1);
            kernels += 1;
        }
    }
    assert_eq!(kernels, 28);
    Ok(())
}

#[test]
fn a_coordinate_along_the_axis_that_is_no_number_gives_none() -> Failure {
    for (side, axis) in [(Side::Left, 0), (Side::Right, 1)] {
        let kernel = OneSidedGaussian::<2>::new(along(axis, 1), side, 2)?;
        let mut z = [0.25; 2];
        z[axis] = f64::NAN;
        assert!(kernel.value(&z).is_nan() && kernel.value(&z.map(|x| x as f32)).is_nan());
    }
    Ok(())
}

#[test]
fn kernels_pass_the_checker_in_one_and_two_dimensions() -> Failure {
    for side in SIDES {
        for beta in [1, 2] {
            for order in 1..=4 {
                let kernel = OneSidedGaussian::<1>::new(along(0, beta), side, order)?;
                assert_eq!(check_kernel(&kernel, KernelLimits::default()), Ok(()), "beta {beta}, r {order}");
            }
        }
        for (axis, beta, order) in [(0, 1, 1), (1, 1, 2), (1, 2, 1)] {
            let kernel = OneSidedGaussian::<2>::new(along(axis, beta), side, order)?;
            assert_eq!(check_kernel(&kernel, KernelLimits::default()), Ok(()), "axis {axis} beta {beta}, r {order}");
        }
    }
    Ok(())
}

/// The a_j of P(z) = sum_j a_j z^j from the values P(delta), ..., P(n delta), by divided differences of P(z)/z.
fn interpolated(values: &[f64], delta: f64) -> Vec<f64> {
    let n = values.len();
    let z = |i: usize| (i + 1) as f64 * delta;
    let mut differences: Vec<f64> = values.iter().enumerate().map(|(i, value)| value / z(i)).collect();
    for level in 1..n {
        for i in (level..n).rev() {
            differences[i] = (differences[i] - differences[i - 1]) / (level as f64 * delta);
        }
    }
    let mut a = vec![0.0; n];
    for i in (0..n).rev() {
        for k in (1..n).rev() {
            a[k] = a[k - 1] - z(i) * a[k];
        }
        a[0] = differences[i] - z(i) * a[0];
    }
    a
}

#[test]
fn corrected_rows_on_lattices_equal_every_entry_of_the_table() -> Failure {
    // Weights are known to some eps; P is read off them with a few digits of cancellation at most.
    const TOLERANCE: f64 = 1e-12;
    let table = table("one_sided_1d_lattice_corrected");
    let (mut entries, mut largest) = (0, 0.0_f64);
    for (key, entry) in table.as_object().unwrap().iter().filter(|(key, _)| *key != "note") {
        let (beta, rest) = key.strip_prefix("beta").unwrap().split_once("_r").unwrap();
        let (order, delta) = rest.split_once("_delta").unwrap();
        let (beta, order, delta): (u8, u32, f64) =
            (beta.parse().unwrap(), order.parse().unwrap(), delta.parse().unwrap());
        let expected: Vec<f64> = entry["a"].as_array().unwrap().iter().map(number).collect();
        let set = Particles::lattice([0.0], [64.0 * delta], [64])?;
        let ring = Domain::periodic([0.0], [64.0 * delta])?;
        for side in SIDES {
            let method = OneSided::new(operator::<1>(0, beta), side, order, Epsilon::global(1.0)?, set.volumes()?)?;
            let method = method.support(12.0)?;
            let neighbors = CellList::build(&set, &ring, method.cutoff())?;
            let rows = method.assemble(&neighbors)?;
            let row = rows.row(30).unwrap();
            let weight = |j: usize| {
                let q = if side == Side::Left { 30 - j } else { 30 + j };
                row.sources.iter().zip(row.weights).find(|(source, _)| **source as usize == q).unwrap().1[0]
            };
            let turned = if side == Side::Right && beta == 1 { -1.0 } else { 1.0 };
            let value = |j: usize| {
                let z = j as f64 * delta;
                turned * weight(j) / (delta * (-z * z).exp() / PI.sqrt())
            };
            let values: Vec<f64> = (1..=expected.len()).map(value).collect();
            let found = interpolated(&values, delta);
            for (found, expected) in found.iter().zip(&expected) {
                let miss = (found / expected - 1.0).abs();
                largest = largest.max(miss);
                assert!(miss < TOLERANCE, "{key} {side}: {found} {expected}");
                entries += 1;
            }
            let zeroth: f64 = row.weights.iter().map(|w| w[0]).sum::<f64>() * turned;
            let expected = number(&entry["discrete_M_0"]);
            assert!((zeroth / expected - 1.0).abs() < 1e-11, "{key} {side}: M_0 {zeroth} {expected}");
        }
    }
    println!("largest relative difference of a coefficient: {largest:.1e}");
    assert_eq!(entries, 2 * 4 * (1 + 2 + 3 + 2 + 3 + 4));
    Ok(())
}

#[test]
fn order_one_divides_the_kernel_by_its_discrete_first_moment() -> Failure {
    let set = random_set::<1>(60, 3);
    let epsilon = 0.06;
    for side in SIDES {
        let kernel = OneSidedGaussian::<1>::new(along(0, 1), side, 1)?;
        let method = OneSided::new(D1::<1>::default(), side, 1, Epsilon::global(epsilon)?, set.volumes()?)?;
        let neighbors = CellList::build(&set, &torus(), method.cutoff())?;
        let rows = method.assemble(&neighbors)?;
        for p in 0..set.len() {
            let mut stencil = parops::Stencil::default();
            neighbors.gather(p, method.cutoff().0, &mut stencil);
            let eta = |z: f64| -> f64 { kernel.value(&[z / epsilon]) };
            let volume = |q: usize| set.volumes().unwrap().get(q).unwrap() / epsilon;
            let first: f64 =
                stencil.iter().map(|n| volume(n.q) * n.separation[0] / epsilon * eta(n.separation[0])).sum();
            for (neighbor, w) in stencil.iter().zip(rows.row(p).unwrap().weights) {
                let expected = volume(neighbor.q) * eta(neighbor.separation[0]) / -first / epsilon;
                // Sums of some 30 terms of one sign, and one rounding of z in exp(-z^2).
                let z = neighbor.separation[0] / epsilon;
                assert!((w[0] - expected).abs() <= (64.0 + 4.0 * z * z) * f64::EPSILON * expected.abs());
            }
        }
    }
    Ok(())
}

fn reproduces<const D: usize>(count: usize, beta: u8, order: u32, epsilon: f64) -> Failure {
    // 16 l eps cond is what a solve reaches; order 1 of beta = 1 has none.
    const TOLERANCE: f64 = 1e-11;
    let set = random_set::<D>(count, 7 + D as u64);
    for axis in 0..D {
        for side in SIDES {
            let operator = operator::<D>(axis, beta);
            let method = OneSided::new(operator.clone(), side, order, Epsilon::global(epsilon)?, set.volumes()?)?;
            let some: Vec<usize> = (0..count).step_by(count / 50).collect();
            let neighbors = Selected::new(CellList::build(&set, &torus(), method.cutoff())?, &some)?;
            assert_eq!(check_method(&method, &neighbors), Ok(()));
            let exact_to = u32::from(beta) + order - 1;
            assert_eq!(check_method_moments(&method, &neighbors, &operator, exact_to, TOLERANCE), Ok(()));
            assert!(check_method_moments(&method, &neighbors, &operator, exact_to + 1, TOLERANCE).is_err());
        }
    }
    Ok(())
}

#[test]
fn polynomials_up_to_the_exactness_degree_are_reproduced_on_random_sets() -> Failure {
    for beta in [1, 2] {
        for order in 1..=4 {
            reproduces::<1>(80, beta, order, 0.04)?;
        }
        for order in 1..=3 {
            reproduces::<2>(400, beta, order, 0.08)?;
        }
    }
    reproduces::<3>(600, 1, 1, 0.08)?;
    reproduces::<3>(600, 1, 2, 0.08)?;
    reproduces::<3>(600, 2, 1, 0.08)
}

#[test]
fn first_derivative_of_order_one_has_weights_of_one_sign_and_exact_linear_functions_on_random_sets() -> Failure {
    let set = random_set::<3>(800, 5);
    for side in SIDES {
        let method = OneSided::new(D3::<0, 0, 1>::default(), side, 1, Epsilon::global(0.12)?, set.volumes()?)?;
        let method = method.support(4.0)?;
        assert!(method.is_upwind() && (method.axis(), method.side()) == (2, side));
        let neighbors = CellList::build(&set, &torus(), method.cutoff())?;
        let rows = method.assemble(&neighbors)?;
        let sign = -side.sign();
        assert!((0..800).all(|p| rows.row(p).unwrap().weights.iter().all(|w| w[0] * sign >= 0.0)));
        // Sums of some 200 terms.
        let defect = Promise::new("Residuals", "one-sided rows of order 1, moment defect");
        defect.at_most(1e-13, rows.report().moment_defect);
        assert_eq!(rows.report().order, Some(1));
    }
    Ok(())
}

#[test]
fn neighbors_across_the_axis_but_for_rounding_are_on_no_side() -> Failure {
    // A lattice turned by 90 degrees: columns are straight to 1e-17.
    let (sine, cosine) = std::f64::consts::FRAC_PI_2.sin_cos();
    let lattice = Particles::lattice([0.0; 2], [1.0; 2], [12; 2])?;
    let turned = lattice.points().iter().map(|x| [cosine * x[0] - sine * x[1], sine * x[0] + cosine * x[1]]).collect();
    let set = Particles::<2>::new(turned)?.with_equal_volumes(1.0)?;
    let epsilon = Epsilon::global(1.0 / 12.0)?;
    let rim = (0..set.len()).filter(|&p| set.points()[p][0] > -0.05).collect::<Vec<_>>();
    assert_eq!(rim.len(), 12);

    let right = OneSided::new(D2::<1, 0>::default(), Side::Right, 1, epsilon.clone(), set.volumes()?)?.support(3.0)?;
    let neighbors = CellList::build(&set, &Domain::open(), right.cutoff())?;
    let refused = right.allow(Allowance::Everywhere).assemble(&neighbors).unwrap_err();
    assert!(rim.contains(&refused.particle().unwrap()), "{refused}");
    assert!(matches!(refused.kind(), ErrorKind::Operator(OperatorError::EmptySide { axis: 0, side: Side::Right, .. })));

    let both = UpwindGradient::new(epsilon, set.volumes()?).support(3.0)?.allow(Allowance::Everywhere);
    let rows: UpwindRows<2> = UpwindRows::assemble(&both, &neighbors)?;
    assert!(rows.report().spectral_bound < 100.0, "{}", rows.report().spectral_bound);
    Ok(())
}

/// The root mean square error of d^beta/dx^beta of a wave on a jittered torus, axis 0.
fn wave_error<const D: usize>(n: usize, beta: u8, order: u32, ratio: f64, seed: u64) -> Result<f64, Error> {
    let set = Particles::jittered([0.0; D], [1.0; D], [n; D], 0.3, seed)?;
    let epsilon = Epsilon::global(ratio / n as f64)?;
    let method = OneSided::new(operator::<D>(0, beta), Side::Left, order, epsilon, set.volumes()?)?;
    let neighbors = CellList::build(&set, &torus(), method.cutoff())?;
    let phase = |x: &[f64; D]| TAU * x.iter().sum::<f64>();
    let f: Vec<f64> = set.points().iter().map(|x| phase(x).sin()).collect();
    let mut out = vec![0.0; f.len()];
    method.assemble(&neighbors)?.apply(&f, &mut out)?;
    let exact = |x: &[f64; D]| if beta == 1 { TAU * phase(x).cos() } else { -TAU * TAU * phase(x).sin() };
    let squares = set.points().iter().zip(&out).map(|(x, out)| (out - exact(x)).powi(2));
    Ok((squares.sum::<f64>() / out.len() as f64).sqrt())
}

fn slope(points: &[(f64, f64)]) -> f64 {
    let n = points.len() as f64;
    let mean = points.iter().fold((0.0, 0.0), |m, p| (m.0 + p.0 / n, m.1 + p.1 / n));
    let sums = points
        .iter()
        .fold((0.0, 0.0), |(over, under), p| (over + (p.0 - mean.0) * (p.1 - mean.1), under + (p.0 - mean.0).powi(2)));
    sums.0 / sums.1
}

fn observed<const D: usize>(sizes: &[usize], beta: u8, order: u32, ratio: f64) -> Failure {
    let points: Vec<_> = sizes
        .iter()
        .map(|&n| Ok((-(n as f64).ln(), wave_error::<D>(n, beta, order, ratio, 1)?.ln())))
        .collect::<Result<_, Error>>()?;
    let found = slope(&points);
    println!("{D}D beta {beta} order {order}: {found:.2}");
    let r = f64::from(order);
    Promise::new("Orders", format!("one-sided PSE on jittered sets, r = {order}")).within(r - 0.25, r + 0.25, found);
    Ok(())
}

#[test]
fn observed_orders_on_jittered_sets_are_the_orders_asked_for() -> Failure {
    for beta in [1, 2] {
        for order in 1..=4 {
            observed::<1>(&[200, 400, 800], beta, order, 1.5)?;
        }
        observed::<2>(&[40, 60, 90], beta, 1, 1.0)?;
        observed::<2>(&[40, 60, 90], beta, 2, 1.0)?;
    }
    Ok(())
}

/// max |1 - c lambda(kappa)| over the waves of a ring, lambda the symbol of a row with v = 1 and epsilon = 1.
fn largest_growth(row: &parops::Row<'_, [f64; 1]>, p: usize, n: usize, c: f64) -> f64 {
    (0..=n / 2).fold(0.0, |largest: f64, k| {
        let theta = TAU * k as f64 / n as f64;
        let symbol = row.sources.iter().zip(row.weights).fold((0.0, 0.0), |(re, im), (&q, w)| {
            let phase = theta * (f64::from(q) - p as f64);
            (re + w[0] * (phase.cos() - 1.0), im + w[0] * phase.sin())
        });
        largest.max((1.0 - c * symbol.0).hypot(c * symbol.1))
    })
}

#[test]
fn euler_upwind_is_stable_up_to_the_sharp_step_of_the_corrected_scheme_and_not_beyond() -> Failure {
    let bounds: Value = serde_json::from_str(include_str!("../data/stability_bounds.json")).expect("JSON");
    let lattices = bounds["advection_upwind"]["consistent_scheme"]["lattice_1d"].as_array().unwrap();
    let mut checked = 0;
    for lattice in lattices {
        let delta = lattice["h_over_eps"].as_f64().unwrap();
        let sharp = lattice["c_sharp_after_dividing_by_discrete_M1"].as_f64().unwrap();
        const N: usize = 4000;
        let set = Particles::lattice([0.0], [N as f64 * delta], [N])?;
        let ring = Domain::periodic([0.0], [N as f64 * delta])?;
        for v in [1.0, -1.0] {
            let upwind = Upwind::new(vec![[v]; N], Epsilon::global(1.0)?, set.volumes()?)?.support(12.0)?;
            let rows = upwind.assemble(&CellList::build(&set, &ring, upwind.cutoff())?)?;
            let row = rows.row(N / 2).unwrap();
            let (below, above) =
                (largest_growth(&row, N / 2, N, 0.999 * sharp), largest_growth(&row, N / 2, N, 1.001 * sharp));
            // The bound is attained for kappa -> 0, where growth is (kappa delta)^2 times what c exceeds it by.
            assert!(below <= 1.0 + 1e-14, "delta {delta}, v {v}: {below}");
            assert!(above > 1.0 + 1e-12, "delta {delta}, v {v}: {above}");
            // The step of the maximum principle is within it.
            assert!(1.0 / rows.report().sum_abs <= sharp * (1.0 + 1e-12));
        }
        checked += 1;
    }
    assert!(checked >= 8);
    Ok(())
}

#[test]
fn closures_of_order_two_grow_under_euler_at_any_step_and_say_so() -> Failure {
    const N: usize = 2000;
    let set = Particles::lattice([0.0], [N as f64 * 0.5], [N])?;
    let ring = Domain::periodic([0.0], [N as f64 * 0.5])?;
    let left = |order| {
        OneSided::new(D1::<1>::default(), Side::Left, order, Epsilon::global(1.0).unwrap(), set.volumes().unwrap())
    };
    for (order, stable) in [(1, true), (2, false), (3, false)] {
        let method = left(order)?;
        assert_eq!(method.is_upwind(), stable);
        let rows = method.assemble(&CellList::build(&set, &ring, method.cutoff())?)?;
        for c in [0.05, 0.3] {
            let growth = largest_growth(&rows.row(N / 2).unwrap(), N / 2, N, c);
            assert_eq!(growth <= 1.0 + 1e-14, stable, "order {order}, c {c}: {growth}");
        }
    }
    let second = OneSided::new(D1::<2>::default(), Side::Left, 1, Epsilon::global(1.0)?, set.volumes()?)?;
    assert!(!second.is_upwind());
    Ok(())
}

#[test]
fn upwind_advection_keeps_the_bounds_of_the_field_on_a_jittered_set() -> Failure {
    let set = Particles::jittered([0.0; 2], [1.0; 2], [24; 2], 0.3, 9)?;
    let swirl: Vec<[f64; 2]> = set.points().iter().map(|&[x, y]| [(TAU * y).sin(), 0.5 - (TAU * x).cos()]).collect();
    let upwind = Upwind::new(swirl, set.spacing()?.epsilon(1.2)?, set.volumes()?)?;
    let rows = upwind.assemble(&CellList::build(&set, &torus(), upwind.cutoff())?)?;
    assert!((0..set.len()).all(|p| rows.row(p).unwrap().weights.iter().all(|w| w[0] <= 0.0)));
    let mut u: Vec<f64> = set.points().iter().map(|x| if x[0] < 0.5 { 1.0 } else { 0.0 }).collect();
    let dt = 1.0 / rows.report().sum_abs;
    let mut change = vec![0.0; u.len()];
    for _ in 0..200 {
        rows.apply(&u, &mut change)?;
        u.iter_mut().zip(&change).for_each(|(u, change)| *u -= dt * change);
    }
    // Each step is a mean with positive weights, rounded.
    let slack = 200.0 * 100.0 * f64::EPSILON;
    assert!(u.iter().all(|u| (-slack..=1.0 + slack).contains(u)));
    Ok(())
}

#[test]
fn upwind_takes_the_side_of_each_component_and_converges_with_order_one() -> Failure {
    let error = |n: usize| -> Result<f64, Error> {
        let set = Particles::jittered([0.0; 2], [1.0; 2], [n; 2], 0.3, 4)?;
        let v: Vec<[f64; 2]> = set.points().iter().map(|&[x, y]| [(TAU * y).sin(), (TAU * x).cos()]).collect();
        let upwind = Upwind::new(v.clone(), set.spacing()?.epsilon(1.0)?, set.volumes()?)?;
        let rows = upwind.assemble(&CellList::build(&set, &torus(), upwind.cutoff())?)?;
        let u: Vec<f64> = set.points().iter().map(|&[x, y]| (TAU * (x + y)).sin()).collect();
        let mut out = vec![0.0; u.len()];
        rows.apply(&u, &mut out)?;
        let exact = |&[x, y]: &[f64; 2], v: &[f64; 2]| (v[0] + v[1]) * TAU * (TAU * (x + y)).cos();
        let squares = set.points().iter().zip(&v).zip(&out).map(|((x, v), out)| (out - exact(x, v)).powi(2));
        Ok((squares.sum::<f64>() / out.len() as f64).sqrt())
    };
    let points: Vec<_> =
        [40, 60, 90].into_iter().map(|n| Ok((-(n as f64).ln(), error(n)?.ln()))).collect::<Result<_, Error>>()?;
    let order = slope(&points);
    println!("upwind order {order:.2}");
    assert!((order - 1.0).abs() < 0.15, "{order}");
    Ok(())
}

#[test]
fn rows_for_any_velocity_give_the_bits_of_rows_for_one_and_serve_the_next_without_a_build() -> Failure {
    let set = Particles::jittered([0.0; 2], [1.0; 2], [16; 2], 0.3, 2)?;
    let (epsilon, volumes) = (set.spacing()?.epsilon(1.0)?, set.volumes()?);
    let mut upwind = Upwind::new(vec![[0.0; 2]; 256], epsilon.clone(), volumes)?;
    let gradient = UpwindGradient::new(epsilon, volumes);
    let neighbors = CellList::build(&set, &torus(), upwind.cutoff())?;
    // The checker turns the signs of all images, and behind odd mirrors these rows do not exist.
    assert!(matches!(check_method(&gradient, &neighbors), Err(MethodFault::Refused { error })
        if matches!(error.kind(), ErrorKind::Operator(OperatorError::OddImage { .. }))));
    let any = gradient.assemble(&neighbors)?;
    let short = UpwindRows::<2, f32>::assemble(&gradient, &neighbors)?;
    let u: Vec<f64> = set.points().iter().map(|&[x, y]| (TAU * x).sin() + y).collect();
    let (mut one, mut other) = (vec![0.0; 256], vec![0.0; 256]);
    let mut random = Random::new(3);
    for round in 0..3 {
        let mut v: Vec<[f64; 2]> = (0..256).map(|_| [random.uniform() - 0.5, random.uniform() - 0.5]).collect();
        v[round] = [0.0, 1.0];
        upwind.set_velocities(v.clone())?;
        assert_eq!(upwind.velocities(), v);
        assert_eq!(check_method(&upwind, &neighbors), Ok(()));
        let rows = upwind.assemble(&neighbors)?;
        rows.apply(&u, &mut one)?;
        any.apply(&v, &u, &mut other)?;
        assert_eq!(one, other);
        upwind.matrix_free(&neighbors)?.apply(&u, &mut other)?;
        assert_eq!(one, other);

        let u: Vec<f32> = u.iter().map(|&u| u as f32).collect();
        let v: Vec<[f32; 2]> = v.iter().map(|v| v.map(|v| v as f32)).collect();
        let mut found = vec![0.0_f32; 256];
        short.apply(&v, &u, &mut found)?;
        // 30 terms a row, each of a few roundings of values up to 2.
        let tolerance = 30.0 * 2.0 * f64::from(f32::EPSILON) * rows.report().sum_abs;
        assert!(found.iter().zip(&one).all(|(found, one)| (f64::from(*found) - one).abs() < tolerance));
        let mut stored = vec![0.0_f32; 256];
        Rows::<_, f32>::assemble(&upwind, &neighbors)?.apply(&u, &mut stored)?;
        assert!(stored.iter().zip(&one).all(|(found, one)| (f64::from(*found) - one).abs() < tolerance));
    }
    Ok(())
}

#[test]
fn the_smallest_velocities_have_a_side_though_their_products_with_weights_vanish() -> Failure {
    // Weights of 0.1 and less.
    let set = Particles::lattice([0.0], [400.0], [40])?;
    let ring = Domain::periodic([0.0], [400.0])?;
    let gradient = UpwindGradient::new(set.spacing()?.epsilon(1.0)?, set.volumes()?);
    let neighbors = CellList::build(&set, &ring, gradient.cutoff())?;
    let (any, short) = (gradient.assemble(&neighbors)?, UpwindRows::<1, f32>::assemble(&gradient, &neighbors)?);
    let (f, mut out) = (vec![1.0; 40], vec![1.0; 40]);
    let (f32s, mut short_out) = (vec![1.0; 40], vec![1.0; 40]);
    for (v, single) in [(5e-324, 1e-45), (-5e-324, -1e-45), (1e-310, 1e-39)] {
        any.apply(&[[v]; 40], &f, &mut out)?;
        short.apply(&[[single]; 40], &f32s, &mut short_out)?;
        assert!(out.iter().all(|&out| out == 0.0) && short_out.iter().all(|&out| out == 0.0));
    }
    Ok(())
}

#[test]
fn zero_velocity_gives_zero_rows_and_needs_no_neighbors() -> Failure {
    let set = Particles::new(vec![[0.0, 0.0], [10.0, 0.0]])?.with_volumes(Volumes::equal(1.0)?)?;
    let upwind = Upwind::new(vec![[0.0; 2]; 2], Epsilon::global(0.5)?, set.volumes()?)?;
    let neighbors = CellList::build(&set, &Domain::open(), upwind.cutoff())?;
    let mut out = vec![1.0; 2];
    upwind.assemble(&neighbors)?.apply(&[3.0, 4.0], &mut out)?;
    assert_eq!(out, [0.0, 0.0]);
    let any = UpwindGradient::new(Epsilon::global(0.5)?, set.volumes()?).assemble(&neighbors)?;
    any.apply(&[[0.0; 2]; 2], &[3.0, 4.0], &mut out)?;
    assert_eq!(out, [0.0, 0.0]);
    Ok(())
}

#[test]
fn closures_at_both_ends_are_exact_for_polynomials_of_their_degree() -> Failure {
    let set = Particles::jittered([0.0], [1.0], [30], 0.3, 8)?;
    let all = |cutoff| CellList::build(&set, &Domain::open(), cutoff);
    let n = set.len();
    let ends =
        |at: f64| (0..n).min_by(|&a, &b| (set.points()[a][0] - at).abs().total_cmp(&(set.points()[b][0] - at).abs()));
    for (side, end) in [(Side::Right, ends(0.0).unwrap()), (Side::Left, ends(1.0).unwrap())] {
        for order in 1..=4 {
            let method = OneSided::new(D1::<1>::default(), side, order, Epsilon::global(0.06)?, set.volumes()?)?;
            let rows = method.assemble(&Selected::new(all(method.cutoff())?, &[end])?)?;
            let power = |k: i32| set.points().iter().map(|x| x[0].powi(k)).collect::<Vec<_>>();
            for k in 0..=order as i32 {
                let mut out = [0.0];
                rows.apply(&power(k), &mut out)?;
                let exact = if k == 0 { 0.0 } else { f64::from(k) * set.points()[end][0].powi(k - 1) };
                // sum |w| is up to some 10 per epsilon.
                let tolerance = 1e3 * f64::EPSILON * rows.report().sum_abs;
                assert!((out[0] - exact).abs() <= tolerance, "{side} order {order} x^{k}: {} {exact}", out[0]);
            }
        }
    }
    Ok(())
}

#[test]
fn empty_side_is_refused_by_name_and_never_replaced_by_the_other() -> Failure {
    let set = Particles::lattice([0.0; 2], [1.0; 2], [10; 2])?;
    let epsilon = set.spacing()?.epsilon(1.0)?;
    let empty = |error: &Error| match *error.kind() {
        ErrorKind::Operator(OperatorError::EmptySide { axis, side, neighbors }) => {
            (error.particle(), axis, side, neighbors > 0)
        }
        _ => panic!("{error}"),
    };
    let up = OneSided::new(D2::<0, 1>::default(), Side::Right, 1, epsilon.clone(), set.volumes()?)?;
    let neighbors = CellList::build(&set, &Domain::open(), up.cutoff())?;
    let error = up.clone().allow(Allowance::Everywhere).assemble(&neighbors).unwrap_err();
    assert_eq!(empty(&error), (Some(9), 1, Side::Right, true));
    assert!(error.to_string().contains("axis 1: none of the"), "{error}");
    let closure = OneSided::new(D2::<0, 1>::default(), Side::Right, 2, epsilon.clone(), set.volumes()?)?;
    let corner = Selected::new(&neighbors, &[9])?;
    assert_eq!(empty(&closure.assemble(&corner).unwrap_err()), (Some(0), 1, Side::Right, true));

    let inflow = Upwind::new(vec![[1.0, 0.0]; 100], epsilon.clone(), set.volumes()?)?.allow(Allowance::Everywhere);
    assert_eq!(empty(&inflow.assemble(&neighbors).unwrap_err()), (Some(0), 0, Side::Left, true));
    let any = UpwindGradient::new(epsilon, set.volumes()?).allow(Allowance::Everywhere).assemble(&neighbors)?;
    let (u, mut out) = (vec![1.0; 100], vec![0.0; 100]);
    let error = any.apply(&[[0.0, -1.0]; 100], &u, &mut out).unwrap_err();
    assert_eq!(empty(&error), (Some(9), 1, Side::Right, true));
    // Where the walls have no flow through them all is well.
    let inside: Vec<[f64; 2]> =
        set.points().iter().map(|x| x.map(|x| (PI * (2.0 * x - 0.1).clamp(0.0, 1.8) / 1.8).sin())).collect();
    let closed: Vec<[f64; 2]> = inside.iter().map(|v| v.map(|v| if v.abs() < 1e-9 { 0.0 } else { v })).collect();
    any.apply(&closed, &u, &mut out)?;
    assert!(out.iter().all(|&out| out == 0.0));
    Ok(())
}

#[test]
fn walls_along_the_axis_are_refused_with_their_moment_unless_allowed_and_keep_the_sign() -> Failure {
    let set = Particles::lattice([0.0; 2], [2.0, 1.0], [20, 10])?;
    let channel = Domain::new([0.0; 2], [2.0, 1.0], [[Face::Periodic; 2], [Face::Open; 2]])?;
    let upwind = Upwind::new(vec![[1.0, 0.0]; 200], set.spacing()?.epsilon(1.0)?, set.volumes()?)?;
    let neighbors = CellList::build(&set, &channel, upwind.cutoff())?;
    let error = upwind.assemble(&neighbors).unwrap_err();
    let ErrorKind::Operator(OperatorError::Moment { defect, limit: 0.05 }) = *error.kind() else { panic!("{error}") };
    assert!((0.2..1.0).contains(&defect) && error.particle().is_some_and(|p| p % 10 == 0 || p % 10 == 9), "{error}");
    let rows = upwind.clone().allow(Allowance::Everywhere).assemble(&neighbors)?;
    assert!(rows.report().allowed >= 40);
    assert!((0..200).all(|p| rows.row(p).unwrap().weights.iter().all(|w| w[0] <= 0.0)));
    let wide = upwind.moment_tolerance(0.9)?.assemble(&neighbors)?;
    assert_eq!(wide.report().allowed, 0);
    Ok(())
}

#[test]
fn refusals_name_what_is_wrong_and_the_numbers() -> Failure {
    let set = Particles::lattice([0.0; 2], [1.0; 2], [8; 2])?;
    let (epsilon, volumes) = (Epsilon::global(0.08)?, set.volumes()?);
    let refused = |operator: Expression<2>, order| {
        *OneSided::new(operator, Side::Left, order, epsilon.clone(), volumes).unwrap_err().kind()
            == match order {
                0 => ErrorKind::Kernel(KernelError::OneSided { degree: 1, order: 0, limit: 8 }),
                8 => ErrorKind::Kernel(KernelError::OneSided { degree: 1, order: 8, limit: 8 }),
                _ => ErrorKind::Kernel(KernelError::NotAlongAxis { degree: 2, axes: 2 }),
            }
    };
    let mixed = Expression::new([(MultiIndex::new([1, 1]), 1.0)])?;
    let laplacian = Expression::of(&parops::Laplacian::<2>)?;
    assert!(refused(operator(0, 1), 0) && refused(operator(0, 1), 8) && refused(mixed, 1) && refused(laplacian, 1));
    let identity = Term { index: MultiIndex::<2>::ZERO, factor: 1.0 };
    let error = OneSidedGaussian::new(identity, Side::Left, 1).unwrap_err();
    assert_eq!(*error.kind(), ErrorKind::Kernel(KernelError::NotAlongAxis { degree: 0, axes: 0 }));
    let error = OneSidedGaussian::<2>::new(along(1, 3), Side::Left, 6).unwrap_err();
    assert_eq!(*error.kind(), ErrorKind::Kernel(KernelError::OneSided { degree: 3, order: 6, limit: 8 }));

    let mut v = vec![[0.0; 2]; 64];
    v[5] = [1.0, f64::NAN];
    let error = Upwind::new(v, epsilon.clone(), volumes).unwrap_err();
    assert_eq!(error.particle(), Some(5));
    assert!(
        matches!(error.kind(), ErrorKind::Particle(ParticleError::Velocity { axis: 1, velocity }) if velocity.is_nan())
    );
    let neighbors = CellList::build(&set, &torus(), epsilon.cutoff(6.0))?;
    let error = Upwind::new(vec![[1.0; 2]; 63], epsilon.clone(), volumes)?.assemble(&neighbors).unwrap_err();
    assert_eq!(*error.kind(), ErrorKind::Particle(ParticleError::Length { found: 63, needed: 64 }));
    let mut upwind = Upwind::new(vec![[1.0; 2]; 64], epsilon.clone(), volumes)?;
    assert!(upwind.set_velocities(vec![[f64::INFINITY; 2]; 64]).is_err());
    assert_eq!(upwind.velocities(), [[1.0; 2]; 64]);

    // One neighbor on the left within 1.2 spacings, and 14 conditions.
    let closure = OneSided::new(operator::<2>(0, 2), Side::Left, 3, epsilon.clone(), volumes)?.support(1.8)?;
    let near = CellList::build(&set, &torus(), closure.cutoff())?;
    let error = closure.assemble(&near).unwrap_err();
    assert!(
        matches!(
            *error.kind(),
            ErrorKind::Operator(OperatorError::TooFew { neighbors: 1, conditions: 14, needed: 14 })
        ),
        "{error}"
    );

    let odd = Domain::new([0.0; 2], [1.0; 2], [[Face::MirrorOdd; 2], [Face::Periodic; 2]])?;
    let error = UpwindGradient::new(epsilon.clone(), volumes)
        .assemble(&CellList::build(&set, &odd, epsilon.cutoff(6.0))?)
        .unwrap_err();
    assert!(matches!(error.kind(), ErrorKind::Operator(OperatorError::OddImage { .. })) && error.particle().is_some());
    let error = Selected::new(near, &[3, 64]).unwrap_err();
    assert_eq!(*error.kind(), ErrorKind::Neighbor(NeighborError::Target { p: 64, targets: 64 }));
    Ok(())
}

#[test]
fn methods_keep_their_promises_beside_mirrors_of_both_kinds() -> Failure {
    let set = Particles::jittered([0.0; 2], [1.0; 2], [10; 2], 0.3, 6)?;
    let domain = Domain::new([0.0; 2], [1.0; 2], [[Face::Periodic; 2], [Face::MirrorOdd, Face::MirrorEven]])?;
    let epsilon = Epsilon::each((0..100).map(|p| 0.07 + 1e-4 * f64::from(p)).collect())?;
    let upwind = Upwind::new(vec![[1.0, -0.5]; 100], epsilon.clone(), set.volumes()?)?;
    let neighbors = CellList::build(&set, &domain, upwind.cutoff())?;
    assert_eq!(check_method(&upwind, &neighbors), Ok(()));
    for order in [1, 2] {
        let method = OneSided::new(D2::<0, 1>::default(), Side::Right, order, epsilon.clone(), set.volumes()?)?;
        assert_eq!(check_method(&method, &neighbors), Ok(()));
    }
    Ok(())
}
