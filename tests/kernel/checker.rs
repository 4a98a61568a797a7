//! The conformance checkers of kernels: ours and a foreign one pass, each broken promise is named.

use parops::testing::{KernelFault, KernelLimits, check_kernel, check_smoothing_kernel};
use parops::{
    ErrorKind, Exchange, Gaussian, HighOrderGaussian, Kernel, KernelError, MultiIndex, Result, SmoothingKernel, Term,
    WideGaussian, continuous_moment, continuous_moments, graded,
};

fn one<const D: usize>(exponents: [u8; D]) -> Vec<Term<D>> {
    vec![Term { index: MultiIndex::new(exponents), factor: 1.0 }]
}

fn laplacian<const D: usize>() -> Vec<Term<D>> {
    (0..D)
        .map(|axis| {
            let mut exponents = [0; D];
            exponents[axis] = 2;
            Term { index: MultiIndex::new(exponents), factor: 1.0 }
        })
        .collect()
}

/// Rounding of a sum of up to 10^6 terms against its absolute value; random walk, with a margin of ten.
const SUM: f64 = 1e4 * f64::EPSILON;

/// A cubic B-spline in each axis, as a user would write it: support 2 in every axis, so 2 sqrt(D) in all.
#[derive(Clone, Debug)]
struct Spline<const D: usize> {
    term: [Term<D>; 1],
}

impl<const D: usize> Spline<D> {
    fn new() -> Self {
        Self { term: [Term { index: MultiIndex::ZERO, factor: 1.0 }] }
    }

    fn axis(degree: u8, x: f64) -> Result<f64> {
        let a = x.abs();
        let outer = 2.0 - a;
        Ok(match degree {
            0 if a < 1.0 => 2.0 / 3.0 - a * a + 0.5 * a * a * a,
            0 if a < 2.0 => outer * outer * outer / 6.0,
            1 if a < 1.0 => x * (1.5 * a - 2.0),
            1 if a < 2.0 => -0.5 * x.signum() * outer * outer,
            2 if a < 1.0 => 3.0 * a - 2.0,
            2 if a < 2.0 => outer,
            0..=2 => 0.0,
            _ => return Err(KernelError::Regularity { kernel: "Spline", degree: degree.into(), limit: 2 }.into()),
        })
    }
}

impl<const D: usize> Kernel<f64, D> for Spline<D> {
    fn value(&self, z: &[f64; D]) -> f64 {
        z.iter().map(|&x| Self::axis(0, x).unwrap_or(0.0)).product()
    }
    fn terms(&self) -> &[Term<D>] {
        &self.term
    }
    fn order(&self) -> u32 {
        2
    }
    fn support(&self) -> f64 {
        2.0 * (D as f64).sqrt()
    }
    fn overlap_limit(&self) -> f64 {
        1.0
    }
    fn positive_definite(&self) -> bool {
        true
    }
}

impl<const D: usize> SmoothingKernel<f64, D> for Spline<D> {
    fn derivative(&self, beta: MultiIndex<D>, z: &[f64; D]) -> Result<f64> {
        let mut product = 1.0;
        for (&x, degree) in z.iter().zip(beta.exponents()) {
            product *= Self::axis(degree, x)?;
        }
        Ok(product)
    }
    fn normalization(&self) -> f64 {
        1.0
    }
}

#[test]
fn quadrature_of_a_compact_kernel_states_its_error() {
    // Int x^2 B(x) dx = 1/3 and Int B = 1, for each axis.
    for (alpha, exact) in [([0, 0], 1.0), ([2, 0], 1.0 / 3.0), ([2, 2], 1.0 / 9.0), ([1, 0], 0.0)] {
        let found = continuous_moment(&Spline::<2>::new(), MultiIndex::new(alpha)).expect("radii");
        assert!((found.value - exact).abs() <= found.error + SUM * found.absolute, "{alpha:?}: {found:?}");
        // Error of order 4 in a spacing of 1/120.
        assert!(found.error < 1e-6, "{alpha:?}: {found:?}");
    }
}

#[test]
fn quadrature_refuses_radii_that_are_not_positive() {
    let broken = Broken { support: Some(f64::NAN), ..Broken::honest() };
    let error = continuous_moments(&broken, &[MultiIndex::ZERO]).unwrap_err();
    assert!(matches!(error.kind(), ErrorKind::Kernel(KernelError::Radii { .. })));
    let broken = Broken { overlap: Some(0.0), ..Broken::honest() };
    let found = ErrorKind::Kernel(KernelError::Radii { support: 6.0, overlap_limit: 0.0 });
    assert_eq!(*continuous_moment(&broken, MultiIndex::ZERO).unwrap_err().kind(), found);
}

fn every_exchange_kernel_passes<const D: usize>(degrees: u32, orders: &[u32]) {
    for degree in 0..=degrees {
        for beta in graded::<D>(degree, degree) {
            if !beta.exponents().is_sorted_by(|a, b| a >= b) {
                continue;
            }
            for &order in orders {
                let kernel = Exchange::new(&one(beta.exponents()), order).expect("kernel");
                check_kernel(&kernel, KernelLimits::default())
                    .unwrap_or_else(|fault| panic!("{beta} r = {order}: {fault}"));
            }
        }
    }
}

#[test]
fn checker_passes_exchange_kernels_in_one_and_two_dimensions() {
    every_exchange_kernel_passes::<1>(8, &[2, 4, 6, 8]);
    every_exchange_kernel_passes::<2>(3, &[2, 4, 6, 8]);
    every_exchange_kernel_passes::<2>(6, &[4]);
}

#[test]
fn checker_passes_exchange_kernels_in_three_dimensions() {
    every_exchange_kernel_passes::<3>(2, &[2]);
    every_exchange_kernel_passes::<3>(3, &[4]);
    for order in [2, 8] {
        let kernel = Exchange::new(&laplacian::<3>(), order).expect("kernel");
        check_kernel(&kernel, KernelLimits::default()).unwrap_or_else(|fault| panic!("r = {order}: {fault}"));
    }
}

fn smoothing_kernels_pass<const D: usize>() {
    let limits = KernelLimits::default();
    check_kernel(&WideGaussian::<D>::new(), limits).unwrap_or_else(|fault| panic!("wide: {fault}"));
    check_smoothing_kernel(&Gaussian::<D>::new(), limits).unwrap_or_else(|fault| panic!("gaussian: {fault}"));
    for order in [2, 4, 6, 8] {
        let kernel = HighOrderGaussian::<D>::new(order).expect("order");
        check_smoothing_kernel(&kernel, limits).unwrap_or_else(|fault| panic!("r = {order}: {fault}"));
    }
}

#[test]
fn checker_passes_smoothing_kernels() {
    smoothing_kernels_pass::<1>();
    smoothing_kernels_pass::<2>();
    smoothing_kernels_pass::<3>();
}

#[test]
fn checker_passes_a_foreign_compact_kernel() {
    check_smoothing_kernel(&Spline::<1>::new(), KernelLimits::default()).unwrap_or_else(|fault| panic!("{fault}"));
    check_smoothing_kernel(&Spline::<2>::new(), KernelLimits::default()).unwrap_or_else(|fault| panic!("{fault}"));
}

/// The Laplacian kernel of order 4, or the identity, with one promise broken.
#[derive(Clone, Debug)]
struct Broken {
    inner: Exchange<2>,
    terms: Option<Vec<Term<2>>>,
    order: Option<u32>,
    support: Option<f64>,
    overlap: Option<f64>,
    definite: Option<bool>,
    factor: f64,
    shift: f64,
    nan: bool,
    batch: f64,
}

impl Broken {
    fn honest() -> Self {
        let inner = Exchange::new(&laplacian(), 4).expect("kernel");
        Self {
            inner,
            terms: None,
            order: None,
            support: None,
            overlap: None,
            definite: None,
            factor: 1.0,
            shift: 0.0,
            nan: false,
            batch: 1.0,
        }
    }
}

impl Kernel<f64, 2> for Broken {
    fn value(&self, z: &[f64; 2]) -> f64 {
        if self.nan && z[0] > 3.0 {
            return f64::NAN;
        }
        self.factor * self.inner.value(&[z[0] - self.shift, z[1]])
    }
    fn values(&self, z: &[[f64; 2]], out: &mut [f64]) {
        for (z, out) in z.iter().zip(out) {
            *out = self.value(z) * self.batch;
        }
    }
    fn terms(&self) -> &[Term<2>] {
        self.terms.as_deref().unwrap_or(Kernel::<f64, 2>::terms(&self.inner))
    }
    fn order(&self) -> u32 {
        self.order.unwrap_or(Kernel::<f64, 2>::order(&self.inner))
    }
    fn support(&self) -> f64 {
        self.support.unwrap_or(Kernel::<f64, 2>::support(&self.inner))
    }
    fn overlap_limit(&self) -> f64 {
        self.overlap.unwrap_or(Kernel::<f64, 2>::overlap_limit(&self.inner))
    }
    fn positive_definite(&self) -> bool {
        self.definite.unwrap_or(Kernel::<f64, 2>::positive_definite(&self.inner))
    }
}

fn fault(broken: Broken) -> KernelFault<2> {
    check_kernel(&broken, KernelLimits::default()).expect_err("a promise is broken")
}

#[test]
fn checker_names_the_promise_a_kernel_breaks() {
    let honest = Broken::honest;
    check_kernel(&honest(), KernelLimits::default()).expect("nothing is broken");
    let mixed = [laplacian(), one([1, 0])].concat();
    assert!(matches!(fault(Broken { terms: Some(mixed), ..honest() }), KernelFault::Refused { .. }));
    assert!(matches!(fault(Broken { nan: true, ..honest() }), KernelFault::NotFinite { .. }));
    assert!(matches!(fault(Broken { batch: 1.0 + 1e-9, ..honest() }), KernelFault::Values { .. }));
    assert!(matches!(fault(Broken { support: Some(0.0), ..honest() }), KernelFault::Refused { .. }));
    let second = MultiIndex::new([2, 0]);
    // 1e-8 too much of M_(2,0) = 2.
    let KernelFault::Moment { alpha, found, required, .. } = fault(Broken { factor: 1.0 + 1e-8, ..honest() }) else {
        panic!("a moment is wrong")
    };
    assert_eq!((alpha, required), (second, 2.0));
    assert!((found - 2.0 - 2e-8).abs() < 1e-12);
    let KernelFault::Moment { alpha, .. } = fault(Broken { shift: 0.01, ..honest() }) else {
        panic!("M_(1,0) is wrong")
    };
    assert_eq!(alpha, MultiIndex::new([1, 0]));
    assert!(matches!(fault(Broken { order: Some(6), ..honest() }), KernelFault::Moment { .. }));
    for order in [0, 1, 2] {
        let KernelFault::Order { order: stated, .. } = fault(Broken { order: Some(order), ..honest() }) else {
            panic!("the order is understated")
        };
        assert_eq!(stated, order);
    }
    assert!(matches!(
        fault(Broken { overlap: Some(1.0), ..honest() }),
        KernelFault::Overlap { h_over_epsilon: 1.0, .. }
    ));
    assert!(matches!(fault(Broken { support: Some(3.8), ..honest() }), KernelFault::Support { support: 3.8, .. }));
    let mixed = Exchange::new(&one([1, 1]), 2).expect("kernel");
    assert!(matches!(fault(Broken { inner: mixed, definite: Some(true), ..honest() }), KernelFault::Transform { .. }));
}

/// A Gaussian with one promise of a smoothing kernel broken.
#[derive(Clone, Debug)]
struct Uneven {
    inner: Gaussian<1>,
    odd: f64,
    slope: f64,
    gradient: f64,
    constant: f64,
    limit: u32,
}

impl Uneven {
    fn honest() -> Self {
        Self { inner: Gaussian::new(), odd: 0.0, slope: 1.0, gradient: 1.0, constant: 1.0, limit: u32::MAX }
    }
}

impl Kernel<f64, 1> for Uneven {
    fn value(&self, z: &[f64; 1]) -> f64 {
        // He_3 W has no moments below the third: it breaks evenness alone.
        let he3 = z[0] * z[0] * z[0] - 3.0 * z[0];
        let value: f64 = self.inner.value(z);
        value * (1.0 + self.odd * he3)
    }
    fn terms(&self) -> &[Term<1>] {
        Kernel::<f64, 1>::terms(&self.inner)
    }
    fn order(&self) -> u32 {
        2
    }
    fn support(&self) -> f64 {
        Kernel::<f64, 1>::support(&self.inner)
    }
    fn overlap_limit(&self) -> f64 {
        Kernel::<f64, 1>::overlap_limit(&self.inner)
    }
}

impl SmoothingKernel<f64, 1> for Uneven {
    fn derivative(&self, beta: MultiIndex<1>, z: &[f64; 1]) -> Result<f64> {
        if beta.degree() > self.limit {
            return Err(KernelError::Regularity { kernel: "Uneven", degree: beta.degree(), limit: self.limit }.into());
        }
        let factor = if beta.degree() == 2 { self.slope } else { 1.0 };
        Ok(factor * self.inner.derivative(beta, z)?)
    }
    fn gradient(&self, z: &[f64; 1]) -> Result<[f64; 1]> {
        Ok([self.gradient * self.derivative(MultiIndex::new([1]), z)?])
    }
    fn normalization(&self) -> f64 {
        self.constant
    }
}

#[test]
fn checker_names_the_promise_a_smoothing_kernel_breaks() {
    let fault =
        |broken: Uneven| check_smoothing_kernel(&broken, KernelLimits::default()).expect_err("a promise is broken");
    let honest = Uneven::honest;
    check_smoothing_kernel(&honest(), KernelLimits::default()).expect("nothing is broken");
    check_smoothing_kernel(&Uneven { limit: 1, ..honest() }, KernelLimits::default()).expect("C^1 is enough");
    assert!(matches!(fault(Uneven { odd: 1e-6, ..honest() }), KernelFault::NotEven { .. }));
    assert!(matches!(fault(Uneven { constant: -1.0, ..honest() }), KernelFault::Normalization { found: -1.0 }));
    assert!(matches!(fault(Uneven { limit: 0, ..honest() }), KernelFault::Refused { .. }));
    let KernelFault::Derivative { beta, .. } = fault(Uneven { slope: 1.01, ..honest() }) else {
        panic!("D^2 is wrong")
    };
    assert_eq!(beta, MultiIndex::new([2]));
    let KernelFault::Derivative { beta, .. } = fault(Uneven { gradient: 1.01, ..honest() }) else { panic!("gradient") };
    assert_eq!(beta, MultiIndex::new([1]));
    let exchange = NotSmoothing(Exchange::new(&one([2]), 2).expect("kernel"));
    let found = check_smoothing_kernel(&exchange, KernelLimits::default());
    assert_eq!(found, Err(KernelFault::NotSmoothing { terms: 1, degree: 2, factor: 1.0 }));
}

/// An exchange kernel passed off as a smoothing kernel.
struct NotSmoothing(Exchange<1>);

impl Kernel<f64, 1> for NotSmoothing {
    fn value(&self, z: &[f64; 1]) -> f64 {
        self.0.value(z)
    }
    fn terms(&self) -> &[Term<1>] {
        Kernel::<f64, 1>::terms(&self.0)
    }
    fn order(&self) -> u32 {
        2
    }
    fn support(&self) -> f64 {
        6.0
    }
    fn overlap_limit(&self) -> f64 {
        0.5
    }
}

impl SmoothingKernel<f64, 1> for NotSmoothing {
    fn derivative(&self, beta: MultiIndex<1>, _: &[f64; 1]) -> Result<f64> {
        Err(KernelError::Regularity { kernel: "NotSmoothing", degree: beta.degree(), limit: 0 }.into())
    }
    fn normalization(&self) -> f64 {
        1.0
    }
}
