//! Moments by quadrature, in closed form and over particles.

use crate::cases::cases;
use crate::properties::properties;
use parops::{
    CenterTerm, Error, ErrorKind, Exchange, Gaussian, Kernel, KernelError, MultiIndex, Neighbor, OperatorError,
    ParticleError, Stencil, Term, Volumes, continuous_moment, discrete_moment, discrete_moments, graded,
    moment_conditions, required_moment,
};
use proptest::prelude::*;

fn one<const D: usize>(exponents: [u8; D]) -> Vec<Term<D>> {
    vec![Term { index: MultiIndex::new(exponents), factor: 1.0 }]
}

/// The neighbors within `cutoff` of a node of the lattice h Z^D, which is a particle itself.
fn lattice<const D: usize>(h: f64, cutoff: f64) -> Stencil<D> {
    let steps = (cutoff / h).floor();
    let mut row = Stencil::default();
    row.reset(0, Some(0), cutoff);
    let mut node = [-steps; D];
    let mut q = 0;
    loop {
        let separation = node.map(|i| i * h);
        if node.iter().any(|&i| i != 0.0) && separation.iter().map(|x| x * x).sum::<f64>() <= cutoff * cutoff {
            q += 1;
            row.push(Neighbor { q, separation, sign: 1 });
        }
        let Some(axis) = node.iter().position(|&i| i < steps) else { return row };
        node[axis] += 1.0;
        node[..axis].fill(-steps);
    }
}

/// Rounding of a sum of up to 10^6 terms against its absolute value; random walk, with a margin of ten.
const SUM: f64 = 1e4 * f64::EPSILON;

proptest! {
    #![proptest_config(properties(cases().div_ceil(5)))]

    #[test]
    fn quadrature_agrees_with_exact_moments(
        (beta, alpha) in (prop::array::uniform2(0_u8..=3), prop::array::uniform2(0_u8..=6)),
        r in 1_u32..=4,
    ) {
        let kernel = Exchange::new(&one(beta), 2 * r).expect("kernel");
        let alpha = MultiIndex::new(alpha);
        let exact = kernel.moment(alpha).expect("small").to_f64();
        let found = continuous_moment(&kernel, alpha).expect("radii");
        prop_assert!((found.value - exact).abs() <= SUM * found.absolute, "{} {exact}", found.value);
        prop_assert!(found.error <= 1e-13 * found.absolute);
    }

    #[test]
    fn lattice_moments_satisfy_the_conditions_at_any_scale(
        beta in prop::array::uniform2(0_u8..=2),
        r in 1_u32..=4,
        (ratio, scale) in (0.3..0.4_f64, -100..100_i32),
    ) {
        let kernel = Exchange::new(&one(beta), 2 * r).expect("kernel");
        let epsilon = 2.0_f64.powi(scale);
        let h = ratio * epsilon;
        let row = lattice::<2>(h, 8.0 * epsilon);
        let volumes = Volumes::equal(h * h).expect("volume");
        let beta = MultiIndex::new(beta);
        for alpha in moment_conditions::<2>(beta.degree(), 2 * r) {
            let found = discrete_moment(&kernel, &row, &volumes, epsilon, alpha, CenterTerm::Included).expect("finite");
            let required = required_moment(&one(beta.exponents()), alpha).expect("small");
            let absolute = continuous_moment(&kernel, alpha).expect("radii").absolute;
            // exp(-pi^2/0.4^2) = 2e-27 times a polynomial, and 1e-18 cut off at 8 epsilon: only rounding is left.
            prop_assert!((found - required).abs() <= SUM * absolute, "{alpha}: {found} {required}");
        }
    }

    #[test]
    fn discrete_moments_are_those_of_the_sum_written_out(
        neighbors in prop::collection::vec((prop::array::uniform2(-2.0..2.0_f64), 0.1..1.0_f64), 1..30),
        epsilon in 0.3..3.0_f64,
    ) {
        let kernel = Exchange::new(&one([1, 0]), 4).expect("kernel");
        let mut row = Stencil::<2>::default();
        row.reset(0, Some(0), 3.0);
        let mut volumes = vec![0.25];
        for (i, &(separation, volume)) in neighbors.iter().enumerate() {
            row.push(Neighbor { q: i + 1, separation, sign: if i % 2 == 0 { 1 } else { -1 } });
            volumes.push(volume);
        }
        let volumes = Volumes::each(volumes).expect("positive");
        for alpha in graded::<2>(0, 3) {
            let [a, b] = alpha.exponents().map(i32::from);
            let (mut sum, mut size) = (0.0, 0.0);
            for &([x, y], volume) in &neighbors {
                let z = [x / epsilon, y / epsilon];
                let term = volume / epsilon.powi(2) * z[0].powi(a) * z[1].powi(b) * kernel.value(&z);
                sum += term;
                size += term.abs();
            }
            let found = discrete_moment(&kernel, &row, &volumes, epsilon, alpha, CenterTerm::Excluded).expect("finite");
            // Thirty terms of some ten roundings each.
            prop_assert!((found - sum).abs() <= 300.0 * f64::EPSILON * size);
        }
    }
}

#[test]
fn center_term_counts_in_the_zeroth_moment_alone() {
    let row = lattice::<2>(0.5, 6.0);
    let volumes = Volumes::equal(0.25).expect("volume");
    let kernel = Gaussian::<2>::new();
    let alphas = [MultiIndex::ZERO, MultiIndex::new([2, 0])];
    let [with, without] = [CenterTerm::Included, CenterTerm::Excluded]
        .map(|center| discrete_moments(&kernel, &row, &volumes, 1.0, &alphas, center).expect("finite"));
    let own: f64 = 0.25 * kernel.value(&[0.0; 2]);
    // The order of summation differs.
    assert!((with[0] - without[0] - own).abs() <= SUM);
    assert_eq!(with[1], without[1]);
    let mut off_the_particles = row.clone();
    off_the_particles.reset(0, None, 1.0);
    assert_eq!(
        discrete_moments(&kernel, &off_the_particles, &volumes, 1.0, &alphas, CenterTerm::Included),
        Ok(vec![0.0; 2])
    );
}

#[test]
fn discrete_moments_refuse_what_is_not_finite_or_missing() {
    let kernel = Gaussian::<1>::new();
    let mut row = Stencil::<1>::default();
    row.reset(0, None, 1.0);
    row.push(Neighbor { q: 3, separation: [0.5], sign: 1 });
    let moment = |volumes: &Volumes, epsilon, row: &Stencil<1>| {
        discrete_moment(&kernel, row, volumes, epsilon, MultiIndex::new([2]), CenterTerm::Excluded)
            .map_err(|error: Error| error.kind().clone())
    };
    let volumes = Volumes::equal(1.0).expect("volume");
    for epsilon in [0.0, -1.0, f64::INFINITY] {
        assert_eq!(moment(&volumes, epsilon, &row), Err(ErrorKind::Particle(ParticleError::Epsilon { epsilon })));
    }
    assert!(moment(&volumes, f64::NAN, &row).is_err());
    let few = Volumes::each(vec![1.0; 3]).expect("volumes");
    assert_eq!(moment(&few, 1.0, &row), Err(ErrorKind::Operator(OperatorError::Length { found: 3, index: 3 })));
    let huge = Volumes::equal(1e308).expect("volume");
    let infinite = moment(&huge, 1e-3, &{
        let mut near = Stencil::<1>::default();
        near.reset(0, None, 1.0);
        near.push(Neighbor { q: 3, separation: [1e-3], sign: 1 });
        near
    });
    assert_eq!(infinite, Err(ErrorKind::Operator(OperatorError::Weight { q: 3, weight: f64::INFINITY })));
    // Far away the kernel is zero and z^alpha infinite.
    row.push(Neighbor { q: 1, separation: [1e200], sign: 1 });
    assert!(moment(&volumes, 1.0, &row).expect("finite").is_finite());
}

/// exp(-|z|^2) with radii of its own.
struct Radii<const D: usize> {
    terms: Vec<Term<D>>,
    support: f64,
    overlap_limit: f64,
}

impl<const D: usize> Kernel<f64, D> for Radii<D> {
    fn value(&self, z: &[f64; D]) -> f64 {
        (-z.iter().map(|x| x * x).sum::<f64>()).exp()
    }
    fn terms(&self) -> &[Term<D>] {
        &self.terms
    }
    fn order(&self) -> u32 {
        2
    }
    fn support(&self) -> f64 {
        self.support
    }
    fn overlap_limit(&self) -> f64 {
        self.overlap_limit
    }
}

fn zeroth<const D: usize>(support: f64, overlap_limit: f64) -> Result<f64, ErrorKind> {
    let kernel = Radii { terms: one([0; D]), support, overlap_limit };
    let moment = continuous_moment(&kernel, MultiIndex::ZERO);
    moment.map(|moment| moment.value).map_err(|error| error.kind().clone())
}

#[test]
fn radii_whose_lattices_never_end_are_refused_and_others_are_not() {
    fn refused<const D: usize>(support: f64, overlap_limit: f64) {
        let expected = ErrorKind::Kernel(KernelError::Radii { support, overlap_limit });
        assert_eq!(zeroth::<D>(support, overlap_limit), Err(expected), "D = {D}");
    }
    // The radius, the diameter, its square and its cube overflow.
    for support in [1.5e308, 8e307, 1e154, 4e153, f64::INFINITY, 0.0, -1.0] {
        refused::<1>(support, 1.0);
        refused::<2>(support, 1.0);
    }
    refused::<3>(1e110, 1.0);
    // The spacing underflows.
    refused::<1>(5e-324, 5e-324);
    refused::<2>(6.0, f64::INFINITY);
    // Legal, though far too coarse for this kernel: no lattice can see it.
    assert!(zeroth::<1>(3.8e153, 1.0).expect("an end").is_finite());
    assert!(zeroth::<1>(1e150, 1.0).expect("an end").is_finite());
    assert!(zeroth::<3>(1e100, 1e-300).expect("an end").is_finite());
}

#[test]
fn quadratures_of_too_many_points_are_refused() {
    // 3^21 points are the fewest that surround a point in 21 dimensions.
    let expected = KernelError::Points { points: 3_f64.powi(21), limit: 16777216.0 };
    assert_eq!(zeroth::<21>(6.0, 2.0 / 3.0), Err(ErrorKind::Kernel(expected)));
    assert!(zeroth::<12>(6.0, 2.0 / 3.0).is_err());
}

#[test]
fn conditions_count_the_zeroth_moment_for_degree_zero_alone() {
    let conditions = |degree, order| moment_conditions::<2>(degree, order).collect::<Vec<_>>();
    for (degree, order) in [(0, 1), (0, 4), (1, 2), (2, 2), (3, 1)] {
        let expected: Vec<_> = graded::<2>(u32::from(degree > 0), degree + order - 1).collect();
        assert_eq!(conditions(degree, order), expected);
    }
    assert_eq!(conditions(0, 0), []);
}

/// 1 within a radius, and not a number beyond it.
struct Ball {
    terms: Vec<Term<1>>,
    support: f64,
    overlap_limit: f64,
}

impl Kernel<f64, 1> for Ball {
    fn value(&self, z: &[f64; 1]) -> f64 {
        if z[0].abs() <= 1.75 * self.support { 1.0 } else { f64::NAN }
    }
    fn terms(&self) -> &[Term<1>] {
        &self.terms
    }
    fn order(&self) -> u32 {
        2
    }
    fn support(&self) -> f64 {
        self.support
    }
    fn overlap_limit(&self) -> f64 {
        self.overlap_limit
    }
}

#[test]
fn quadrature_is_the_mean_over_two_lattices_to_the_edge_of_the_ball_and_not_beyond() {
    // With R/h = n + 1/4 the nodes are 2 n + 1, and 2 n of the shifted lattice: h times their mean is 2 R exactly, and
    // one node more or less would be a miss of h/2. The last lattice has the finest spacing above 2 R / (2^20 - 1).
    let radius = 7.0;
    for (n, halvings) in [(400_000, 5), (300_000, 0), (524_287, 1)] {
        let h = radius / (f64::from(n) + 0.25);
        let overlap_limit = 2.0 * h * 2.0_f64.powi(halvings);
        let ball = Ball { terms: one([0]), support: radius / 1.75, overlap_limit };
        let found = continuous_moment(&ball, MultiIndex::ZERO).expect("radii");
        // Of sums of 2 n equal terms, one after another.
        let rounding = 2.0 * f64::from(n) * f64::EPSILON * 2.0 * radius;
        assert!((found.value - 2.0 * radius).abs() <= rounding, "{n}: {found:?}");
        assert!((found.absolute - f64::from(2 * n + 1) * h).abs() <= rounding, "{n}: {found:?}");
        assert!((found.error - h).abs() <= rounding, "{n}: {found:?}");
    }
    // A spacing below the finest is not tried.
    let ball = Ball { terms: one([0]), support: 4.0, overlap_limit: 1e-9 };
    let found = continuous_moment(&ball, MultiIndex::ZERO).expect("radii");
    assert!((found.value - 14.0).abs() < 14.0 / 1048575.0, "{found:?}");
}

#[test]
fn errors_of_quadratures_are_never_below_rounding() {
    let kernel = Gaussian::<1>::new();
    for n in [0, 2, 8, 20] {
        let found = continuous_moment(&kernel, MultiIndex::new([n])).expect("radii");
        assert!((f64::EPSILON..1e-13).contains(&(found.error / found.absolute)), "{n}: {found:?}");
    }
}
