//! Remeshing kernels: the golden table, the identities in exact rationals, and what rounding leaves of them.

use parops::{
    Cic, Error, ErrorKind, KernelError, Lambda, MeshKernel, Ngp, Random, Rational, Result, Tsc,
    testing::Promise,
    testing::{MeshKernelFault, check_mesh_kernel},
};
use serde_json::Value;

/// Calls `$check::<P, R>(..)` for the seven kernels of the table.
macro_rules! each_golden {
    ($check:ident) => {
        each_golden!($check: 2 1, 2 2, 4 2, 4 4, 6 4, 6 6, 8 4)
    };
    ($check:ident: $($p:literal $r:literal),*) => { $( $check::<$p, $r, { $p + 2 }>(); )* };
}

type Polynomial = Vec<Rational>;

fn whole(n: usize) -> Rational {
    Rational::integer(n as i128)
}

fn exact(text: &Value) -> Rational {
    let (n, d) = text.as_str().unwrap().split_once('/').unwrap_or((text.as_str().unwrap(), "1"));
    Rational::new(n.parse().unwrap(), d.parse().unwrap()).unwrap()
}

fn plus(a: Rational, b: Rational) -> Rational {
    a.checked_add(b).unwrap()
}

fn times(a: Rational, b: Rational) -> Rational {
    a.checked_mul(b).unwrap()
}

fn at(c: &[Rational], x: Rational) -> Rational {
    c.iter().rev().fold(Rational::ZERO, |sum, &c| plus(times(sum, x), c))
}

/// c(x + by).
fn shifted(c: &[Rational], by: Rational) -> Polynomial {
    let mut c = c.to_vec();
    for i in 0..c.len() {
        for k in (i..c.len() - 1).rev() {
            c[k] = plus(c[k], times(by, c[k + 1]));
        }
    }
    c
}

/// c(1 - x).
fn reflected(c: &[Rational]) -> Polynomial {
    let sign = |n: usize| Rational::integer(if n.is_multiple_of(2) { 1 } else { -1 });
    shifted(c, Rational::ONE).into_iter().enumerate().map(|(n, c)| times(sign(n), c)).collect()
}

fn derivative(c: &[Rational]) -> Polynomial {
    c.iter().enumerate().skip(1).map(|(n, &c)| times(whole(n), c)).collect()
}

fn nth_derivative(c: &[Rational], m: usize) -> Polynomial {
    (0..m).fold(c.to_vec(), |c, _| derivative(&c))
}

fn pieces<const P: usize, const R: usize>(kernel: &Lambda<P, R>) -> Vec<Polynomial> {
    (0..).map_while(|j| kernel.piece(j)).map(<[Rational]>::to_vec).collect()
}

/// sum_k k^a Lambda(x - k) on 0 <= x < 1, as a polynomial in x.
fn moment(pieces: &[Polynomial], a: u32) -> Polynomial {
    let mut sum = vec![Rational::ZERO; pieces[0].len()];
    for (j, piece) in pieces.iter().enumerate() {
        // Node -j sees t = x, node j + 1 sees t = 1 - x.
        for (node, seen) in [(-(j as i128), piece.clone()), (j as i128 + 1, reflected(piece))] {
            for (sum, c) in sum.iter_mut().zip(seen) {
                *sum = plus(*sum, times(Rational::integer(node.pow(a)), c));
            }
        }
    }
    sum
}

/// Interpolation, class C^R and the moments 0 to P and no more, each as an identity of rationals.
fn prove<const P: usize, const R: usize>(kernel: &Lambda<P, R>) {
    let pieces = pieces(kernel);
    assert_eq!(pieces.len(), P / 2 + 1);
    assert!(pieces.iter().all(|piece| piece.len() == 2 * R + 2));
    for (j, piece) in pieces.iter().enumerate() {
        assert_eq!(piece[0], if j == 0 { Rational::ONE } else { Rational::ZERO }, "Lambda({j})");
    }
    let beyond = vec![Rational::ZERO; 2 * R + 2];
    for m in 0..=R {
        for (j, piece) in pieces.iter().enumerate() {
            let next = pieces.get(j + 1).unwrap_or(&beyond);
            let (left, right) =
                (at(&nth_derivative(piece, m), Rational::ONE), at(&nth_derivative(next, m), Rational::ZERO));
            assert_eq!(left, right, "({P}, {R}): derivative {m} at {}", j + 1);
        }
        // Even, so that odd derivatives must vanish in the middle.
        assert!(m % 2 == 0 || nth_derivative(&pieces[0], m)[0].is_zero(), "({P}, {R}): derivative {m} at 0");
    }
    for a in 0..=P {
        let mut power = vec![Rational::ZERO; 2 * R + 2];
        power[a] = Rational::ONE;
        assert_eq!(moment(&pieces, a as u32), power, "({P}, {R}): moment {a}");
    }
    let mut next = moment(&pieces, P as u32 + 1);
    next.resize(next.len().max(P + 2), Rational::ZERO);
    next[P + 1] = plus(next[P + 1], Rational::integer(-1));
    assert!(next.iter().any(|c| !c.is_zero()), "({P}, {R}): moment P + 1 cannot hold as well");
}

fn golden() -> Value {
    serde_json::from_str(include_str!("../data/lambda_kernels.json")).unwrap()
}

#[test]
fn derived_kernels_equal_the_golden_table_exactly() {
    fn check<const P: usize, const R: usize, const S: usize>() {
        let table = &golden()["kernels"][format!("Lambda_{P}_{R}")];
        let pieces = pieces(&Lambda::<P, R>::new().unwrap());
        let exactly = Promise::new("Kernels", "Lambda coefficients against the table, as fractions");
        let read = |key: &str| -> Vec<Polynomial> {
            table[key].as_array().unwrap().iter().map(|c| c.as_array().unwrap().iter().map(exact).collect()).collect()
        };
        exactly.equal(&pieces, &read("coefficients_ascending_in_t"));
        let in_s: Vec<_> =
            pieces.iter().enumerate().map(|(j, c)| shifted(c, Rational::integer(-(j as i128)))).collect();
        assert_eq!(in_s, read("coefficients_ascending_in_s"));
        let derivatives = table["nodal_derivatives_m_j"].as_object().unwrap();
        assert_eq!(derivatives.len(), (R + 1) * (P / 2 + 2));
        for (key, value) in derivatives {
            let (m, j) = key.split_once(',').unwrap();
            let (m, j): (usize, usize) = (m.parse().unwrap(), j.parse().unwrap());
            let found = pieces.get(j).map_or(Rational::ZERO, |piece| nth_derivative(piece, m)[0]);
            assert_eq!(found, exact(value), "({P}, {R}): derivative {m} at {j}");
        }
        let verified = &table["verification"];
        let mut defect = moment(&pieces, P as u32 + 1);
        defect.resize(defect.len().max(P + 2), Rational::ZERO);
        defect[P + 1] = plus(defect[P + 1], Rational::integer(-1));
        let table: Polynomial =
            verified["its_defect_polynomial_in_offset_x_in_0_1"].as_array().unwrap().iter().map(exact).collect();
        let padded: Vec<_> = (0..defect.len().max(table.len()))
            .map(|n| [&defect, &table].map(|c| c.get(n).copied().unwrap_or(Rational::ZERO)))
            .collect();
        assert!(padded.iter().all(|[found, table]| found == table), "({P}, {R}): {padded:?}");
    }
    each_golden!(check);
}

#[test]
fn interpolation_regularity_and_moments_hold_as_rational_identities() {
    fn check<const P: usize, const R: usize, const S: usize>() {
        prove(&Lambda::<P, R>::new().unwrap());
    }
    each_golden!(check);
    each_golden!(check: 2 6, 4 3, 6 3, 8 6, 10 5, 12 6);
}

fn exists(p: usize, r: usize) -> bool {
    p.is_multiple_of(2) && (2..2 * r + 2).contains(&p)
}

/// The tightest and the widest kernels there are: what fits is proved, what does not is an error with its numbers.
#[test]
fn any_pair_is_derived_exactly_or_refused_with_its_numbers() {
    fn row<const P: usize>(limits: &mut Vec<(usize, usize)>) {
        let mut fits = None;
        macro_rules! tries {
            ($($r:literal)*) => { $(
                match Lambda::<P, $r>::new() {
                    Ok(kernel) => {
                        assert!(exists(P, $r));
                        fits = Some($r);
                        assert_eq!(pieces(&kernel).len(), P / 2 + 1);
                    }
                    Err(error) => {
                        let numbers = (P as u64, $r as u64);
                        match *error.kind() {
                            ErrorKind::Kernel(KernelError::Lambda { exactness, regularity }) => {
                                assert_eq!((exactness, regularity), numbers);
                                assert!(!exists(P, $r));
                            }
                            ErrorKind::Kernel(KernelError::LambdaOverflow { exactness, regularity }) => {
                                assert_eq!((exactness, regularity), numbers);
                            }
                            ref other => panic!("{other}"),
                        }
                    }
                }
            )* };
        }
        tries!(0 1 2 3 4 5 6 7 8 10 12 14 15 16 18 24 33 64 65 1000);
        limits.extend(fits.map(|r| (P, r)));
    }
    let mut limits = Vec::new();
    macro_rules! rows {
        ($($p:literal)*) => { $( row::<$p>(&mut limits); )* };
    }
    rows!(0 1 2 3 4 5 6 8 12 20 28 30 32 1000);
    let widest: Vec<usize> = limits.iter().map(|limit| limit.0).collect();
    assert_eq!(widest, [2, 4, 6, 8, 12, 20, 28], "{limits:?}");
    assert!(limits.iter().all(|&(_, r)| r >= 16), "{limits:?}");
}

/// |sum w - 1| in eps of T, the worst over u in [-1/2, 1/2].
fn worst_sum<T: parops::Scalar, const S: usize>(kernel: &impl MeshKernel<T, S>, eps: f64, to: fn(T) -> f64) -> f64 {
    let mut random = Random::new(7);
    let ends = [-0.5, 0.5, 0.0, 0.25, -0.25, -0.5 + f64::EPSILON, 0.5 - f64::EPSILON];
    let places = ends.into_iter().chain((0..200_000).map(|_| random.uniform() - 0.5));
    let sum = |u: f64| kernel.weights(T::lift(u)).into_iter().fold(T::zero(), |sum, w| sum + w);
    places.map(|u| to(sum(u) - T::one()).abs() / eps).fold(0.0, f64::max)
}

#[test]
fn weights_add_up_to_one_within_four_eps_in_both_precisions() {
    const LIMIT: f64 = 4.0;
    fn check<const P: usize, const R: usize, const S: usize>()
    where
        Lambda<P, R>: MeshKernel<f64, S> + MeshKernel<f32, S>,
    {
        let kernel = Lambda::<P, R>::new().unwrap();
        let double = worst_sum::<f64, S>(&kernel, f64::EPSILON, |x| x);
        let single = worst_sum::<f32, S>(&kernel, f32::EPSILON.into(), f64::from);
        let sum = Promise::new("Kernels", "sum of Lambda weights less 1, f64 and f32").in_units("eps", 1.0);
        sum.at_most(LIMIT, double.max(single));
    }
    each_golden!(check);
    assert!(worst_sum::<f64, 2>(&Cic, f64::EPSILON, |x| x) <= LIMIT);
    assert!(worst_sum::<f64, 3>(&Tsc, f64::EPSILON, |x| x) <= LIMIT);
    assert!(worst_sum::<f32, 3>(&Tsc, f32::EPSILON.into(), f64::from) <= LIMIT);
}

#[test]
fn values_weights_and_derivatives_equal_the_exact_polynomials() {
    fn check<const P: usize, const R: usize, const S: usize>()
    where
        Lambda<P, R>: MeshKernel<f64, S>,
    {
        let kernel = Lambda::<P, R>::new().unwrap();
        let pieces = pieces(&kernel);
        // Short fractions, so that u is exact and the rationals stay in range.
        for i in 0..=64 {
            let t = Rational::new(i, 64).unwrap();
            let u = t.to_f64() - 0.5;
            let weights = kernel.weights(u);
            for (j, piece) in pieces.iter().enumerate() {
                for m in 0..=R {
                    let exact = at(&nth_derivative(piece, m), t).to_f64();
                    let centered = nth_derivative(&shifted(piece, Rational::new(1, 2).unwrap()), m);
                    let size = at(
                        &centered
                            .iter()
                            .map(|c| if *c < Rational::ZERO { times(*c, Rational::integer(-1)) } else { *c })
                            .collect::<Vec<_>>(),
                        Rational::new((2 * i - 64).abs(), 128).unwrap(),
                    );
                    // Horner rounds every term 2n + 1 times at most; a coefficient and its factor are rounded once each.
                    let bound = (4 * R + 6) as f64 * f64::EPSILON * size.to_f64();
                    let s = j as f64 + t.to_f64();
                    let ahead = kernel.derivative(m as u32, s).unwrap();
                    let behind = kernel.derivative(m as u32, -s).unwrap();
                    assert!(
                        (ahead - exact).abs() <= bound,
                        "({P}, {R}): derivative {m} at {s}: {ahead}, exactly {exact}"
                    );
                    assert!(s == 0.0 || behind == if m % 2 == 0 { ahead } else { -ahead });
                    if m == 0 {
                        assert_eq!(ahead, kernel.value(s));
                        let (right, left) = (weights[P / 2 - j], kernel.weights(-u)[P / 2 + 1 + j]);
                        assert!((right - exact).abs() <= bound, "({P}, {R}): weight at {s}");
                        assert_eq!(right, left, "even to the bit");
                    }
                }
            }
        }
        let support = P as f64 / 2.0 + 1.0;
        for s in [support, 1.5 * support, 1e300] {
            assert_eq!((kernel.value(s), kernel.derivative(1, -s).unwrap()), (0.0, 0.0));
        }
        assert!(kernel.value(f64::NAN).is_nan() && kernel.derivative(1, f64::NAN).unwrap().is_nan());
        let beyond = kernel.derivative(R as u32 + 1, 0.3).unwrap_err();
        let degree = R as u32 + 1;
        assert_eq!(beyond, Error::from(KernelError::Regularity { kernel: "Lambda", degree, limit: R as u32 }));
    }
    each_golden!(check);
}

#[test]
fn least_value_and_sum_of_magnitudes_are_those_of_the_table() {
    fn check<const P: usize, const R: usize, const S: usize>()
    where
        Lambda<P, R>: MeshKernel<f64, S>,
    {
        // The table samples 20001 and 401 places: a miss is of second order in their distances.
        const SAMPLING: f64 = 2e-5;
        let table = &golden()["kernels"][format!("Lambda_{P}_{R}")]["verification"];
        let kernel = Lambda::<P, R>::new().unwrap();
        let number = |key: &str| table[key].as_f64().unwrap();
        let places = (0..=20_000).map(|i| f64::from(i) / 20_000.0 - 0.5);
        let all: Vec<[f64; S]> = places.map(|u| kernel.weights(u)).collect();
        let least = all.as_flattened().iter().copied().fold(f64::INFINITY, f64::min);
        let sum = all.iter().map(|w| w.iter().map(|w| w.abs()).sum::<f64>()).fold(0.0, f64::max);
        assert!((least - number("min_value")).abs() < SAMPLING, "({P}, {R}): {least}");
        assert!((sum - number("max_over_offset_of_sum_abs_weights")).abs() < SAMPLING, "({P}, {R}): {sum}");
    }
    each_golden!(check);
}

#[test]
fn every_mesh_kernel_passes_the_checker_and_broken_ones_do_not() {
    const ULPS: f64 = 4.0;
    fn check<const P: usize, const R: usize, const S: usize>()
    where
        Lambda<P, R>: MeshKernel<f64, S>,
    {
        let kernel = Lambda::<P, R>::new().unwrap();
        assert_eq!(MeshKernel::<f64, S>::exactness(&kernel), P as u32);
        assert_eq!(check_mesh_kernel(&kernel, ULPS), Ok(()), "({P}, {R})");
    }
    each_golden!(check);
    assert_eq!(check_mesh_kernel(&Ngp, ULPS), Ok(()));
    assert_eq!(check_mesh_kernel(&Cic, ULPS), Ok(()));
    assert_eq!(check_mesh_kernel(&Tsc, ULPS), Ok(()));
    // As an object too.
    assert_eq!(check_mesh_kernel(&Tsc as &dyn MeshKernel<f64, 3>, ULPS), Ok(()));

    /// A kernel broken by a small change of one of its answers.
    struct Broken(fn(f64) -> [f64; 3], u32);
    impl MeshKernel<f64, 3> for Broken {
        fn weights(&self, u: f64) -> [f64; 3] {
            (self.0)(u)
        }
        fn exactness(&self) -> u32 {
            self.1
        }
    }
    let fault = |weights, exactness| check_mesh_kernel(&Broken(weights, exactness), ULPS).unwrap_err();
    let tsc = |u: f64| Tsc.weights(u);
    assert!(matches!(fault(tsc, 2), MeshKernelFault::Moment { degree: 2, .. }));
    assert!(matches!(
        fault(|u| Tsc.weights(u).map(|w| w * (1.0 + 1e-14)), 1),
        MeshKernelFault::Moment { degree: 0, .. }
    ));
    assert!(matches!(fault(|u| Tsc.weights(-u), 1), MeshKernelFault::Moment { degree: 1, .. }));
    assert!(matches!(fault(|u| [0.5 - u, 0.5 + u, 0.0], 0), MeshKernelFault::NotEven { .. }));
    assert!(matches!(fault(|u| [0.0 / u, 1.0, 0.0], 0), MeshKernelFault::NotFinite { u: 0.0, node: 0, .. }));
}

#[test]
fn assignment_weights_are_those_of_the_exercise_sheet() {
    // Four roundings of numbers up to 1.
    const TOLERANCE: f64 = 4.0 * f64::EPSILON;
    for i in 0..1000 {
        let e = f64::from(i) / 1000.0;
        let second = [0.5 - e + 0.5 * e * e, 0.5 + e - e * e, 0.5 * e * e];
        let first = [(0.5 - e).max(0.0), 1.0 - (e - 0.5).abs(), (e - 0.5).max(0.0)];
        let tsc = Tsc.weights(e - 0.5);
        // Two nodes serve: they are the left or the right pair of three, depending on the half of the cell.
        let (right, t) = (e >= 0.5, if e >= 0.5 { e - 0.5 } else { e + 0.5 });
        let [a, b] = Cic.weights(t - 0.5);
        let cic = if right { [0.0, a, b] } else { [a, b, 0.0] };
        for k in 0..3 {
            assert!((tsc[k] - second[k]).abs() <= TOLERANCE, "{e}: {tsc:?}");
            assert!((cic[k] - first[k]).abs() <= TOLERANCE, "{e}: {cic:?}");
        }
        let second_moment = (0..3).map(|k| tsc[k] * (e + 0.5 - k as f64).powi(2)).sum::<f64>();
        assert!((second_moment - 0.25).abs() <= TOLERANCE, "{e}: {second_moment}");
    }
    assert_eq!(MeshKernel::<f64, 1>::weights(&Ngp, 0.3), [1.0]);
}

#[test]
fn dual_numbers_pass_through_a_lambda_kernel() -> Result<()> {
    use num_dual::Dual64;
    let kernel = Lambda::<4, 4>::new()?;
    for i in -70..70 {
        let s = f64::from(i) * 0.043 + 0.011;
        let value = kernel.value(Dual64::from_re(s).derivative());
        let expected = kernel.derivative(1, s)?;
        // Both differentiate the same Horner scheme; terms are up to 50.
        assert!((value.eps - expected).abs() <= 1000.0 * f64::EPSILON, "{s}: {} and {expected}", value.eps);
    }
    Ok(())
}
