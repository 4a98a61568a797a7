//! Smoothing kernels of compact support: constants, values, derivatives, regularity, extremes and checkers.

use std::f64::consts::PI;

use crate::cases::cases;
use crate::properties::properties;
use num_dual::Dual64;
use parops::{
    CubicSpline, Differentiated, ErrorKind, Kernel, KernelError, MultiIndex, QuinticSpline, Rational, SmoothingKernel,
    Term, WendlandC2, WendlandC4, WendlandC6, continuous_moments, graded, moment_conditions, required_moment,
    testing::Promise,
};
use proptest::prelude::*;

/// What every kernel of this file is to the generic tests.
trait Compact<const D: usize>:
    SmoothingKernel<f64, D> + SmoothingKernel<f32, D> + SmoothingKernel<Dual64, D> + Clone + std::fmt::Debug
{
}

impl<K, const D: usize> Compact<D> for K where
    K: SmoothingKernel<f64, D> + SmoothingKernel<f32, D> + SmoothingKernel<Dual64, D> + Clone + std::fmt::Debug
{
}

/// Calls a generic function with the name, the kernel, its highest degree and further arguments, for all five.
macro_rules! for_all {
    ($test:ident, $d:literal $(, $argument:expr)*) => {
        $test("CubicSpline", &CubicSpline::<$d>::new(), CubicSpline::<$d>::DERIVATIVE_LIMIT $(, $argument)*);
        $test("QuinticSpline", &QuinticSpline::<$d>::new(), QuinticSpline::<$d>::DERIVATIVE_LIMIT $(, $argument)*);
        $test("WendlandC2", &WendlandC2::<$d>::new(), WendlandC2::<$d>::DERIVATIVE_LIMIT $(, $argument)*);
        $test("WendlandC4", &WendlandC4::<$d>::new(), WendlandC4::<$d>::DERIVATIVE_LIMIT $(, $argument)*);
        $test("WendlandC6", &WendlandC6::<$d>::new(), WendlandC6::<$d>::DERIVATIVE_LIMIT $(, $argument)*);
    };
}

fn value<const D: usize>(kernel: &impl Compact<D>, z: &[f64; D]) -> f64 {
    Kernel::<f64, D>::value(kernel, z)
}

fn derivative<const D: usize>(kernel: &impl Compact<D>, beta: MultiIndex<D>, z: &[f64; D]) -> f64 {
    SmoothingKernel::<f64, D>::derivative(kernel, beta, z).expect("smooth")
}

fn support<const D: usize>(kernel: &impl Compact<D>) -> f64 {
    Kernel::<f64, D>::support(kernel)
}

fn along<const D: usize>(x: f64) -> [f64; D] {
    std::array::from_fn(|axis| if axis == 0 { x } else { 0.0 })
}

/// The constants of the literature, for the profiles of the docs; those of the Wendland functions are for q = |z|
/// there, so 2^D times as large.
const SPLINES: [[f64; 3]; 2] =
    [[1.0 / 6.0, 5.0 / (14.0 * PI), 1.0 / (4.0 * PI)], [1.0 / 120.0, 7.0 / (478.0 * PI), 1.0 / (120.0 * PI)]];
const WENDLAND: [[f64; 3]; 3] = [
    [5.0 / 4.0, 7.0 / PI, 21.0 / (2.0 * PI)],
    [3.0 / 2.0, 9.0 / PI, 495.0 / (32.0 * PI)],
    [55.0 / 32.0, 78.0 / (7.0 * PI), 1365.0 / (64.0 * PI)],
];

/// The table has three roundings, the kernel one each for the area of the sphere, the Beta functions, their sum, the
/// product, the quotient and the unit.
const CONSTANT: f64 = 8.0 * f64::EPSILON;

#[test]
fn normalizations_are_the_constants_of_the_literature() {
    fn constants<const D: usize>(name: &str, kernel: &impl Compact<D>, _: u32) {
        let expected = match name {
            "CubicSpline" => SPLINES[0][D - 1],
            "QuinticSpline" => SPLINES[1][D - 1],
            "WendlandC2" => WENDLAND[0][D - 1] / f64::from(1 << D),
            "WendlandC4" => WENDLAND[1][D - 1] / f64::from(1 << D),
            _ => WENDLAND[2][D - 1] / f64::from(1 << D),
        };
        let found = SmoothingKernel::<f64, D>::normalization(kernel);
        assert!((found / expected - 1.0).abs() <= CONSTANT, "{name} {D}: {found} {expected}");
        let top = match name {
            "CubicSpline" => 4.0,
            "QuinticSpline" => 66.0,
            _ => 1.0,
        };
        assert!((value(kernel, &[0.0; D]) / (top * expected) - 1.0).abs() <= CONSTANT, "{name} {D}");
    }
    for_all!(constants, 1);
    for_all!(constants, 2);
    for_all!(constants, 3);
}

/// Int_a^b f, by the trapezoidal rule with its error expansion removed 7 times (Romberg): exact to degree 15.
fn integral(f: impl Fn(f64) -> f64, a: f64, b: f64) -> f64 {
    let mut row: Vec<f64> = (0..8)
        .map(|level| {
            let n = 1 << level;
            let h = (b - a) / f64::from(n);
            let inner: f64 = (1..n).map(|i| f(a + f64::from(i) * h)).sum();
            h * (0.5 * (f(a) + f(b)) + inner)
        })
        .collect();
    let mut power = 1.0;
    while row.len() > 1 {
        power *= 4.0;
        row = row.windows(2).map(|pair| (power * pair[1] - pair[0]) / (power - 1.0)).collect();
    }
    row[0]
}

/// The area of the unit sphere.
fn sphere(d: usize) -> f64 {
    [2.0, 2.0 * PI, 4.0 * PI, 2.0 * PI * PI, 8.0 * PI * PI / 3.0][d - 1]
}

/// Int |z|^n W dz along the radius, from knot to knot: pieces are polynomials of degree at most 11 + n + D - 1 <= 15.
fn radial_moment<const D: usize>(kernel: &impl Compact<D>, n: i32) -> f64 {
    let pieces = (0..support(kernel) as u32).map(f64::from);
    sphere(D)
        * pieces.map(|a| integral(|r| r.powi(n + D as i32 - 1) * value(kernel, &along(r)), a, a + 1.0)).sum::<f64>()
}

/// Rounding of an integral of a positive function over some hundred points, 10 eps each at most, times the 2 of
/// Romberg.
const INTEGRAL: f64 = 32.0 * f64::EPSILON;

#[test]
fn integral_over_the_ball_is_one_in_one_to_five_dimensions() {
    fn normalized<const D: usize>(name: &str, kernel: &impl Compact<D>, _: u32) {
        let found = radial_moment(kernel, 0);
        Promise::new("Kernels", "integral of compact kernels less 1, 1D to 5D")
            .case(format!("{name} {D}"))
            .at_most(INTEGRAL, (found - 1.0).abs());
    }
    for_all!(normalized, 1);
    for_all!(normalized, 2);
    for_all!(normalized, 3);
    normalized("CubicSpline", &CubicSpline::<5>::new(), 2);
    normalized("WendlandC2", &WendlandC2::<4>::new(), 2);
    normalized("WendlandC2", &WendlandC2::<5>::new(), 2);
}

#[test]
fn second_moments_of_splines_in_one_dimension_are_a_twelfth_for_each_factor() {
    // The B-spline of degree n is the density of a sum of n + 1 uniform variables of variance 1/12.
    assert!((radial_moment(&CubicSpline::<1>::new(), 2) - 4.0 / 12.0).abs() <= INTEGRAL);
    assert!((radial_moment(&QuinticSpline::<1>::new(), 2) - 6.0 / 12.0).abs() <= INTEGRAL);
}

#[test]
fn moments_of_every_derivative_are_those_of_its_operator() {
    fn moments<const D: usize>(name: &str, kernel: &impl Compact<D>, limit: u32) {
        // In three dimensions a quadrature costs half a second; what is new there is the area of the sphere.
        let degrees: &[u32] = if D == 3 { &[0, 1] } else { &[0, 1, limit] };
        for &degree in degrees {
            // Two lattices of 2^20 points over a ball of 1.75 support; the first derivative beyond those counted jumps.
            let h = 3.5 * support(kernel) / 2.0_f64.powf(20.0 / D as f64);
            let error = h.powi((limit - degree) as i32 + 2);
            for beta in graded::<D>(degree, degree) {
                if !beta.exponents().is_sorted_by(|a, b| a >= b) {
                    continue;
                }
                let terms = vec![Term { index: beta, factor: 1.0 }];
                let conditions: Vec<_> = moment_conditions::<D>(degree, 2).collect();
                let differentiated = Differentiated::new(kernel.clone(), terms.clone()).expect("smooth");
                let moments = continuous_moments(&differentiated, &conditions).expect("radii");
                for (&alpha, found) in conditions.iter().zip(moments) {
                    let required = required_moment(&terms, alpha).expect("small");
                    let tolerance = (ROUNDING + error) * found.absolute;
                    assert!((found.value - required).abs() <= tolerance, "{name} {beta} {alpha}: {found:?} {required}");
                }
            }
        }
    }
    for_all!(moments, 1);
    for_all!(moments, 2);
    for_all!(moments, 3);
}

/// Rounding of a sum of up to 10^6 terms against its absolute value; random walk, with a margin of ten.
const ROUNDING: f64 = 1e4 * f64::EPSILON;

#[test]
fn sums_over_lattices_are_one_as_closely_as_stated_up_to_the_overlap_limit() {
    fn sums<const D: usize>(name: &str, kernel: &impl Compact<D>, _: u32) {
        let (limit, edge) = (Kernel::<f64, D>::overlap_limit(kernel), support(kernel));
        // What the docs state: the defect up to the limit, and where it is still below 1e-3.
        let (stated, fine): (f64, f64) = match name {
            "CubicSpline" => (5e-3, 0.56),
            "QuinticSpline" => (3e-4, 1.0),
            "WendlandC2" => (1e-2, 0.47),
            "WendlandC4" => (1e-2, 0.56),
            _ => (1e-2, 0.58),
        };
        let mut worst = 0.0_f64;
        for i in 0..=150 {
            let h = 0.25 + (limit - 0.25) * f64::from(i) / 150.0;
            let steps = (edge / h) as i32;
            let side = 2 * steps + 1;
            let mut sum = 0.0;
            for node in 0..side.pow(D as u32) {
                let index: [i32; D] = std::array::from_fn(|axis| node / side.pow(axis as u32) % side - steps);
                sum += value(kernel, &index.map(|k| h * f64::from(k)));
            }
            let defect = (sum * h.powi(D as i32) - 1.0).abs();
            worst = worst.max(defect);
            Promise::new("Kernels", "lattice sums of compact kernels less 1, of what is stated to their overlap limit")
                .case(format!("{name} {D} at {h}"))
                .at_most(1.0, defect / if h <= fine { stated.min(1e-3) } else { stated });
        }
        assert!(worst > 0.1 * stated, "{name} {D}: the statement is too modest, {worst}");
    }
    for_all!(sums, 1);
    for_all!(sums, 2);
    for_all!(sums, 3);
}

// ---------------------------------------------------------------------------------------------------------------------
// Exact values in one dimension.

/// P and the constant in front, on [low, low + 1): integer polynomials of x by powers, as every textbook has them.
struct Piece {
    low: i128,
    coefficients: Vec<Rational>,
}

fn rational(n: i128, d: i128) -> Rational {
    Rational::new(n, d).expect("small")
}

fn times(p: &[Rational], q: &[Rational]) -> Vec<Rational> {
    let mut product = vec![Rational::ZERO; p.len() + q.len() - 1];
    for (i, a) in p.iter().enumerate() {
        for (j, b) in q.iter().enumerate() {
            product[i + j] = product[i + j].checked_add(a.checked_mul(*b).expect("small")).expect("small");
        }
    }
    product
}

fn integers(coefficients: &[i128]) -> Vec<Rational> {
    coefficients.iter().map(|&n| Rational::integer(n)).collect()
}

/// The one-dimensional kernels by powers of x, piece by piece, expanded by hand.
fn pieces(name: &str) -> (Rational, Vec<Piece>) {
    let spline = |pieces: &[&[i128]]| {
        pieces.iter().zip(0..).map(|(piece, low)| Piece { low, coefficients: integers(piece) }).collect()
    };
    let wendland = |power: usize, polynomial: &[i128]| {
        // (1 - x/2)^power P(x/2)
        let half = |p: &[i128]| p.iter().zip(0..).map(|(&c, i)| rational(c, 1 << i)).collect::<Vec<_>>();
        let mut product = half(polynomial);
        for _ in 0..power {
            product = times(&product, &half(&[1, -1]));
        }
        (0..2).map(|low| Piece { low, coefficients: product.clone() }).collect()
    };
    match name {
        "CubicSpline" => (rational(1, 6), spline(&[&[4, 0, -6, 3], &[8, -12, 6, -1]])),
        "QuinticSpline" => (
            rational(1, 120),
            spline(&[&[66, 0, -60, 0, 30, -10], &[51, 75, -210, 150, -45, 5], &[243, -405, 270, -90, 15, -1]]),
        ),
        "WendlandC2" => (rational(5, 8), wendland(3, &[1, 3])),
        "WendlandC4" => (rational(3, 4), wendland(5, &[1, 5, 8])),
        _ => (rational(55, 64), wendland(7, &[1, 7, 19, 21])),
    }
}

/// D^n at x >= 0, exactly.
fn exact(name: &str, n: u32, x: Rational) -> f64 {
    let (front, pieces) = pieces(name);
    let inside = |piece: &&Piece| Rational::integer(piece.low) <= x && x < Rational::integer(piece.low + 1);
    let Some(piece) = pieces.iter().find(inside) else { return 0.0 };
    let mut p = piece.coefficients.clone();
    for _ in 0..n {
        p = p.iter().zip(0..).skip(1).map(|(c, i)| c.checked_mul(Rational::integer(i)).expect("small")).collect();
    }
    let horner = |sum: Rational, &c: &Rational| sum.checked_mul(x)?.checked_add(c);
    let sum = p.iter().rev().try_fold(Rational::ZERO, horner).expect("small");
    sum.checked_mul(front).expect("small").to_f64()
}

/// Operations on the way to a value in one dimension: up to nine factors (edge - r), five of Horner, sum and front,
/// over the absolute terms, which are at most 6.9 times the value for the quintic spline at 0.
const VALUE: f64 = 16.0 * f64::EPSILON;

#[test]
fn values_in_one_dimension_are_exact_to_rounding_up_to_the_edge() {
    fn relative(name: &str, kernel: &impl Compact<1>, _: u32) {
        let mut worst = 0.0_f64;
        for i in 0..=64 * 3 {
            let x = f64::from(i) / 64.0;
            let (found, exact) = (value(kernel, &[x]), exact(name, 0, rational(i.into(), 64)));
            let off = if exact == 0.0 { found } else { (found / exact - 1.0).abs() };
            worst = worst.max(off);
        }
        // Relative to the value, which falls to 1e-10 of its top beside the edge.
        assert!(worst <= VALUE, "{name}: {} eps", worst / f64::EPSILON);
    }
    for_all!(relative, 1);
}

/// Relative to the largest |D^n W|: up to eight sums of parts that are up to 20 times that.
const DERIVATIVE: f64 = 64.0 * f64::EPSILON;

#[test]
fn derivatives_in_one_dimension_are_exact_to_rounding_at_knots_edge_and_origin() {
    fn absolute(name: &str, kernel: &impl Compact<1>, limit: u32) {
        for n in 1..=limit {
            let beta = MultiIndex::new([n as u8]);
            let points = (0..=64 * 3).map(|i| (f64::from(i) / 64.0, exact(name, n, rational(i.into(), 64))));
            let points: Vec<_> = points.collect();
            let largest = points.iter().fold(0.0, |largest: f64, (_, exact)| largest.max(exact.abs()));
            for (x, exact) in points {
                for (x, exact) in [(x, exact), (-x, if n % 2 == 0 { exact } else { -exact })] {
                    let off = (derivative(kernel, beta, &[x]) - exact).abs();
                    assert!(off <= DERIVATIVE * largest, "{name} {n} at {x}: {} eps", off / largest / f64::EPSILON);
                }
            }
        }
    }
    for_all!(absolute, 1);
}

#[test]
fn derivatives_beside_the_edge_keep_their_relative_accuracy() {
    fn relative(name: &str, kernel: &impl Compact<1>, limit: u32) {
        let edge = support(kernel);
        for n in 0..=limit {
            // 1/1024 before the edge a Wendland C6 is 1e-23 of its top.
            let x = rational(edge as i128 * 1024 - 1, 1024);
            let (found, exact) = (derivative(kernel, MultiIndex::new([n as u8]), &[x.to_f64()]), exact(name, n, x));
            assert!((found / exact - 1.0).abs() <= 4.0 * VALUE, "{name} {n}: {found:e} {exact:e}");
        }
    }
    for_all!(relative, 1);
}

// ---------------------------------------------------------------------------------------------------------------------
// Derivatives in any dimension.

/// Dual numbers differentiate D^beta W along every axis; the next derivative is to agree.
fn agrees_with_dual_numbers<const D: usize>(name: &str, kernel: &impl Compact<D>, limit: u32, z: [f64; D]) {
    for beta in graded::<D>(0, limit - 1) {
        for axis in 0..D {
            let mut dual = z.map(Dual64::from_re);
            dual[axis] = dual[axis].derivative();
            let found = SmoothingKernel::<Dual64, D>::derivative(kernel, beta, &dual).expect("smooth").eps;
            let mut next = beta.exponents();
            next[axis] += 1;
            let expected = derivative(kernel, MultiIndex::new(next), &z);
            let tolerance = DUAL * value(kernel, &[0.0; D]);
            assert!((found - expected).abs() <= tolerance, "{name} {beta} {axis} {z:?}: {found} {expected}");
            if beta == MultiIndex::ZERO {
                let found = Kernel::<Dual64, D>::value(kernel, &dual).eps;
                assert!((found - expected).abs() <= tolerance, "{name} {axis} {z:?}: {found} {expected}");
            }
        }
    }
}

/// Sixth derivatives reach 1e4 W(0) from terms ten times as large, each of some ten roundings.
const DUAL: f64 = 1e6 * f64::EPSILON;

#[test]
fn derivatives_agree_with_dual_numbers_at_origin_axes_knots_and_edge() {
    for x in [0.0, 1e-9, 0.3, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0] {
        for_all!(agrees_with_dual_numbers, 1, [x]);
        for_all!(agrees_with_dual_numbers, 2, [0.0, -x]);
        for_all!(agrees_with_dual_numbers, 3, [0.6 * x, 0.0, -0.8 * x]);
    }
}

proptest! {
    #![proptest_config(properties(cases()))]

    #[test]
    fn derivatives_agree_with_dual_numbers_anywhere_in_two_dimensions(z in prop::array::uniform2(-3.0..3.0_f64)) {
        for_all!(agrees_with_dual_numbers, 2, z);
    }

    #[test]
    fn derivatives_follow_permutations_and_reflections_exactly(z in prop::array::uniform3(-2.0..2.0_f64), flip in 0..3_usize) {
        fn relations<const D: usize>(name: &str, kernel: &impl Compact<D>, limit: u32, z: [f64; D], flip: usize) {
            for beta in graded::<D>(0, limit) {
                let found = derivative(kernel, beta, &z);
                let mut mirrored = z;
                mirrored[flip] = -z[flip];
                let sign = if beta.exponents()[flip] % 2 == 0 { 1.0 } else { -1.0 };
                assert_eq!(found, sign * derivative(kernel, beta, &mirrored), "{name} {beta}");
                assert_eq!(value(kernel, &z), value(kernel, &mirrored), "{name}");
            }
        }
        for_all!(relations, 3, z, flip);
    }

    #[test]
    fn laplacian_is_invariant_under_rotation(r in 0.0..3.0_f64, angle in 0.0..6.3_f64) {
        fn invariant(name: &str, kernel: &impl Compact<2>, _: u32, r: f64, angle: f64) {
            let terms = [[2, 0], [0, 2]].map(|beta| Term { index: MultiIndex::new(beta), factor: 1.0 });
            let mut out = [0.0; 2];
            SmoothingKernel::<f64, 2>::combination(kernel, &terms, &[[r, 0.0], [r * angle.cos(), r * angle.sin()]], &mut out)
                .expect("smooth");
            let top = value(kernel, &[0.0; 2]);
            // |W'''| <= 20 W(0) turns the rounding of z, 4 eps, into that of the Laplacian; its own is below 64 eps.
            assert!((out[0] - out[1]).abs() <= 256.0 * f64::EPSILON * top, "{name} {r} {angle}: {out:?}");
        }
        for_all!(invariant, 2, r, angle);
    }

    #[test]
    fn kernels_are_positive_inside_and_zero_from_the_edge_on(direction in prop::array::uniform3(-1.0..1.0_f64), r in 0.0..4.0_f64) {
        fn sign<const D: usize>(name: &str, kernel: &impl Compact<D>, limit: u32, z: [f64; D]) {
            let r = z.iter().map(|x| x * x).sum::<f64>().sqrt();
            let w = value(kernel, &z);
            // Within 1e-12 of the edge it is a matter of rounding which side a point is on.
            let edge = support(kernel);
            if r > edge * (1.0 + 1e-12) {
                assert_eq!(w, 0.0, "{name} {z:?}");
                for beta in graded::<D>(1, limit) {
                    assert_eq!(derivative(kernel, beta, &z), 0.0, "{name} {beta} {z:?}");
                }
            } else if r < edge * (1.0 - 1e-12) {
                assert!(w > 0.0 && w <= value(kernel, &[0.0; D]), "{name} {z:?}: {w}");
            }
        }
        let length = direction.iter().map(|x| x * x).sum::<f64>().sqrt().max(1e-3);
        for_all!(sign, 3, direction.map(|x| x / length * r));
    }

    #[test]
    fn many_points_at_once_have_the_bits_of_one(z in prop::collection::vec(prop::array::uniform2(-3.0..3.0_f64), 1..150)) {
        fn batch(name: &str, kernel: &impl Compact<2>, limit: u32, z: &[[f64; 2]]) {
            let mut many = vec![f64::NAN; z.len()];
            Kernel::<f64, 2>::values(kernel, z, &mut many);
            assert!(z.iter().zip(&many).all(|(z, &many)| value(kernel, z) == many), "{name}");
            for beta in graded::<2>(0, limit) {
                SmoothingKernel::<f64, 2>::derivatives(kernel, beta, z, &mut many).expect("smooth");
                assert!(z.iter().zip(&many).all(|(z, &many)| derivative(kernel, beta, z) == many), "{name} {beta}");
            }
        }
        for_all!(batch, 2, &z);
    }
}

#[test]
fn gradient_and_combination_equal_the_derivatives() {
    fn agree<const D: usize>(name: &str, kernel: &impl Compact<D>, limit: u32) {
        let points: Vec<[f64; D]> = (0..100)
            .map(|i| std::array::from_fn(|axis| (0.618 * f64::from(i + 1) * (axis + 1) as f64).fract() * 5.0 - 2.5))
            .collect();
        let top = value(kernel, &[0.0; D]);
        for z in &points {
            let gradient = SmoothingKernel::<f64, D>::gradient(kernel, z).expect("smooth");
            for (axis, component) in gradient.into_iter().enumerate() {
                let one = derivative(kernel, MultiIndex::unit(axis).expect("axis"), z);
                assert!((component - one).abs() <= DERIVATIVE * top, "{name}: {component} {one}");
            }
        }
        for degree in 0..=limit {
            let terms: Vec<_> = graded::<D>(degree, degree)
                .zip([1.0, -0.5, 3.0, 0.25].into_iter().cycle())
                .map(|(index, factor)| Term { index, factor })
                .collect();
            let mut combined = vec![f64::NAN; points.len()];
            SmoothingKernel::<f64, D>::combination(kernel, &terms, &points, &mut combined).expect("smooth");
            for (z, combined) in points.iter().zip(combined) {
                let parts = terms.iter().map(|term| term.factor * derivative(kernel, term.index, z));
                let (sum, size) = parts.fold((0.0, top), |(sum, size), part| (sum + part, size + part.abs()));
                // A derivative is a sum of terms up to 1e3 times as large, in another order here.
                assert!((combined - sum).abs() <= 1e3 * DERIVATIVE * size, "{name} {degree} {z:?}: {combined} {sum}");
            }
        }
    }
    for_all!(agree, 1);
    for_all!(agree, 2);
    for_all!(agree, 3);
}

#[test]
fn derivative_beyond_the_regularity_names_kernel_degree_and_limit() {
    fn refused<const D: usize>(name: &str, kernel: &impl Compact<D>, limit: u32) {
        assert_eq!(
            limit,
            if name.ends_with("C6") {
                6
            } else if name.ends_with("C4") || name.starts_with('Q') {
                4
            } else {
                2
            }
        );
        let mut out = [7.0];
        for degree in limit + 1..=limit + 3 {
            for beta in graded::<D>(degree, degree) {
                for z in [[0.0; D], along(0.5), along(1.0), along(9.0)] {
                    let terms = [Term { index: MultiIndex::ZERO, factor: 1.0 }, Term { index: beta, factor: 1.0 }];
                    for error in [
                        SmoothingKernel::<f64, D>::derivative(kernel, beta, &z).unwrap_err(),
                        SmoothingKernel::<f64, D>::combination(kernel, &terms, &[z], &mut out).unwrap_err(),
                        Differentiated::new(kernel.clone(), vec![terms[1]]).unwrap_err(),
                    ] {
                        let ErrorKind::Kernel(KernelError::Regularity { kernel, degree: asked, limit: most }) =
                            *error.kind()
                        else {
                            panic!("{name}: {error}")
                        };
                        assert_eq!((kernel, asked, most), (name, degree, limit));
                        assert!(error.to_string().contains(name), "{error}");
                    }
                }
            }
        }
        assert_eq!(out, [7.0], "a refusal writes nothing");
    }
    for_all!(refused, 1);
    for_all!(refused, 2);
    for_all!(refused, 3);
}

#[test]
fn extreme_arguments_give_zero_limits_or_nan_and_never_garbage() {
    fn extreme<const D: usize>(name: &str, kernel: &impl Compact<D>, limit: u32) {
        let betas: Vec<_> = graded::<D>(0, limit).collect();
        for x in [3.0, 1e10, 1e160, 1e300, f64::MAX, f64::INFINITY, f64::NEG_INFINITY] {
            for z in [along(x), [x; D]] {
                assert_eq!(value(kernel, &z), 0.0, "{name} {z:?}");
                for &beta in &betas {
                    assert_eq!(derivative(kernel, beta, &z), 0.0, "{name} {beta} {z:?}");
                }
            }
        }
        for x in [5e-324, 1e-310, 1e-200, 1e-160, 1e-100, 1e-20] {
            for z in [along(x), [x; D], [-x; D]] {
                for &beta in &betas {
                    let (found, at_zero) = (derivative(kernel, beta, &z), derivative(kernel, beta, &[0.0; D]));
                    // Continuous, with a slope below 1e5 W(0).
                    let tolerance = 1e5 * x + DERIVATIVE * at_zero.abs();
                    assert!((found - at_zero).abs() <= tolerance, "{name} {beta} {z:?}: {found:e} {at_zero:e}");
                }
            }
        }
        for axis in 0..D {
            let mut z = along(0.5);
            z[axis] = f64::NAN;
            assert!(value(kernel, &z).is_nan(), "{name} {z:?}");
            for &beta in &betas {
                assert!(derivative(kernel, beta, &z).is_nan(), "{name} {beta} {z:?}");
            }
            assert!(SmoothingKernel::<f64, D>::gradient(kernel, &z).expect("smooth")[axis].is_nan(), "{name}");
        }
    }
    for_all!(extreme, 1);
    for_all!(extreme, 2);
    for_all!(extreme, 3);
}

#[test]
fn single_precision_agrees_with_double() {
    fn agree<const D: usize>(name: &str, kernel: &impl Compact<D>, limit: u32) {
        for i in 0..60 {
            let z: [f32; D] = std::array::from_fn(|axis| (0.618 * (i * (axis + 1)) as f32).fract() * 4.0 - 2.0);
            for beta in graded::<D>(0, limit) {
                let single = SmoothingKernel::<f32, D>::derivative(kernel, beta, &z).expect("smooth");
                let double = derivative(kernel, beta, &z.map(f64::from));
                // As DUAL, with the rounding of f32.
                let tolerance = DUAL / f64::EPSILON * f64::from(f32::EPSILON) * value(kernel, &[0.0; D]);
                let tolerance = tolerance * [1e-5, 1e-4, 1e-3, 1e-2, 1e-1, 1.0, 1.0][beta.degree() as usize];
                assert!((f64::from(single) - double).abs() <= tolerance, "{name} {beta} {z:?}: {single} {double}");
            }
        }
        assert_eq!(Kernel::<f32, D>::value(kernel, &[f32::MAX; D]), 0.0);
        assert!(Kernel::<f32, D>::value(kernel, &[f32::NAN; D]).is_nan());
    }
    for_all!(agree, 1);
    for_all!(agree, 2);
    for_all!(agree, 3);
}

#[test]
fn only_wendland_functions_and_splines_on_a_line_are_positive_definite() {
    fn definite<const D: usize>(name: &str, kernel: &impl Compact<D>, _: u32) {
        let expected = D == 1 || name.starts_with('W');
        assert_eq!(Kernel::<f64, D>::positive_definite(kernel), expected, "{name} {D}");
        // Int W(z) cos(k z_1) dz over the ball, by a lattice fine enough for these waves; the first zero of a spline's
        // transform lies at 2 pi, beyond it the waves are where the sign may change.
        if D > 2 {
            return;
        }
        let h = 0.02;
        let steps = (support(kernel) / h) as i32;
        let lowest = (1..40)
            .map(|i| {
                let k = 0.5 * f64::from(i);
                let row = |y: f64| -> f64 {
                    let at = |i: i32| {
                        let x = f64::from(i) * h;
                        let z: [f64; D] = std::array::from_fn(|axis| if axis == 0 { x } else { y });
                        value(kernel, &z) * (k * x).cos()
                    };
                    (-steps..=steps).map(at).sum()
                };
                let rows: f64 = if D == 1 { row(0.0) } else { (-steps..=steps).map(|j| row(f64::from(j) * h)).sum() };
                rows * h.powi(D as i32)
            })
            .fold(f64::INFINITY, f64::min);
        // The lattice folds waves of 2 pi/h = 314, where a transform is below 1e-8.
        assert_eq!(lowest >= -1e-7, expected, "{name} {D}: {lowest}");
    }
    for_all!(definite, 1);
    for_all!(definite, 2);
    for_all!(definite, 3);
}

#[cfg(feature = "testing")]
mod checkers {
    use super::*;
    use parops::testing::{KernelLimits, check_kernel, check_smoothing_kernel};

    /// A lattice at the overlap limit may miss by 1 %, the docs say; a compact kernel has no tail to lose. What the
    /// quadrature by two lattices of 2^20 points does not see of its own error is below 1e-6 in three dimensions.
    const LIMITS: KernelLimits = KernelLimits { moment: 1e-6, lattice: 1e-2, truncation: 0.0 };

    #[test]
    fn every_kernel_passes_the_checker_of_smoothing_kernels() {
        fn passes<const D: usize>(name: &str, kernel: &impl Compact<D>, _: u32) {
            check_smoothing_kernel(kernel, LIMITS).unwrap_or_else(|fault| panic!("{name} {D}: {fault}"));
        }
        for_all!(passes, 1);
        for_all!(passes, 2);
        for_all!(passes, 3);
    }

    #[test]
    fn every_derivative_passes_the_checker_of_kernels_on_fine_lattices() {
        fn passes(name: &str, kernel: &impl Compact<2>, limit: u32) {
            for beta in [[1, 0], [limit as u8 / 2; 2]].map(MultiIndex::new) {
                let differentiated = Differentiated::new(kernel.clone(), vec![Term { index: beta, factor: 1.0 }]);
                // At the overlap limit of W the lattice moments of its derivatives are off by tens of percent, and the
                // quadrature is of order 2 only where they have kinks.
                let limits = KernelLimits { lattice: f64::INFINITY, moment: 1e-4, ..LIMITS };
                let checked = check_kernel(&differentiated.expect("smooth"), limits);
                checked.unwrap_or_else(|fault| panic!("{name} {beta}: {fault}"));
            }
        }
        for_all!(passes, 2);
    }
}
