//! Time and accuracy of kernels: ns per value, one by one and many at once, and the largest error.
//!
//! The error is in units of eps times the absolute terms of P(z) exp(-|z|^2), against P evaluated in exact rational
//! arithmetic at multiples of 1/64, where |z|^2 is exact in double precision too.

use std::hint::black_box;
use std::time::Duration;

use criterion::{Criterion, Throughput};
use parops::{
    ExactPolynomial, Exchange, Gaussian, HighOrderGaussian, Kernel, MultiIndex, Rational, Term, WideGaussian,
};

/// Points per call: a neighborhood in three dimensions, times some.
const POINTS: usize = 256;

/// Multiples of 1/64 in [-4, 4]^D, by a linear congruential generator.
fn points<const D: usize>() -> Vec<[f64; D]> {
    let mut state = 1_u64;
    let mut next = || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        ((state >> 33) % 513) as f64 / 64.0 - 4.0
    };
    (0..POINTS).map(|_| std::array::from_fn(|_| next())).collect()
}

/// P(z), and the sum of its absolute monomials.
fn exactly<const D: usize>(polynomial: &ExactPolynomial<D>, z: &[f64; D]) -> Option<(f64, f64)> {
    let (mut sum, mut size) = (Rational::ZERO, 0.0);
    for (alpha, p) in polynomial.iter() {
        let mut term = p;
        for (&x, n) in z.iter().zip(alpha.exponents()) {
            for _ in 0..n {
                term = term.checked_mul(Rational::from_f64(x)?)?;
            }
        }
        sum = sum.checked_add(term)?;
        size += term.to_f64().abs();
    }
    Some((sum.to_f64(), size))
}

/// The largest error in units of eps; `width` is the a of exp(-|z|^2/a) and of the constant (pi a)^(-D/2).
fn error<const D: usize>(kernel: &dyn Kernel<f64, D>, polynomial: &ExactPolynomial<D>, width: f64) -> f64 {
    let constant = (std::f64::consts::PI * width).sqrt().powi(D as i32).recip();
    points::<D>().iter().fold(0.0, |largest, z| {
        let Some((p, size)) = exactly(polynomial, z) else { return f64::NAN };
        let front = constant * (-z.iter().map(|x| x * x).sum::<f64>() / width).exp();
        f64::max(largest, (kernel.value(z) - p * front).abs() / (f64::EPSILON * size * front))
    })
}

fn measure<const D: usize>(
    criterion: &mut Criterion,
    name: &str,
    kernel: &dyn Kernel<f64, D>,
    polynomial: &ExactPolynomial<D>,
    width: f64,
) {
    println!("{name}: largest error {:.1} eps of the absolute terms", error(kernel, polynomial, width));
    let points = points::<D>();
    let mut out = vec![0.0; POINTS];
    let mut group = criterion.benchmark_group(name);
    group.throughput(Throughput::Elements(POINTS as u64));
    group.bench_function("value", |bencher| {
        bencher.iter(|| {
            for (z, out) in points.iter().zip(&mut out) {
                *out = kernel.value(black_box(z));
            }
            black_box(out[0])
        })
    });
    group.bench_function("values", |bencher| {
        bencher.iter(|| {
            kernel.values(black_box(&points), &mut out);
            black_box(out[0])
        })
    });
    group.finish();
}

fn exchange<const D: usize>(criterion: &mut Criterion, name: &str, betas: &[[u8; D]], order: u32) {
    let terms: Vec<_> = betas.iter().map(|&beta| Term { index: MultiIndex::new(beta), factor: 1.0 }).collect();
    let kernel = Exchange::new(&terms, order).expect("a kernel of small degree");
    let polynomial = kernel.exact().expect("a polynomial of small degree");
    measure(criterion, &format!("{name}, D = {D}, r = {order}"), &kernel, &polynomial, 1.0);
}

fn main() {
    let mut criterion = Criterion::default()
        .sample_size(20)
        .warm_up_time(Duration::from_millis(100))
        .measurement_time(Duration::from_millis(300))
        .without_plots()
        .configure_from_args();
    let one = ExactPolynomial::monomial(MultiIndex::ZERO, Rational::ONE);
    measure(&mut criterion, "Gaussian, D = 3", &Gaussian::<3>::new(), &one, 2.0);
    let one = ExactPolynomial::monomial(MultiIndex::ZERO, Rational::ONE);
    measure(&mut criterion, "wide Gaussian, D = 2", &WideGaussian::<2>::new(), &one, 4.0);
    for order in [4, 8] {
        let kernel = HighOrderGaussian::<3>::new(order).expect("an order that exists");
        let polynomial = kernel.as_exchange().exact().expect("small");
        measure(&mut criterion, &format!("identity, D = 3, r = {order}"), &kernel, &polynomial, 1.0);
    }
    for order in [2, 4, 8] {
        exchange(&mut criterion, "Laplacian", &[[2, 0], [0, 2]], order);
        exchange(&mut criterion, "Laplacian", &[[2, 0, 0], [0, 2, 0], [0, 0, 2]], order);
        exchange(&mut criterion, "first derivative", &[[1, 0]], order);
        exchange(&mut criterion, "d2/dx2", &[[2, 0]], order);
        exchange(&mut criterion, "d2/dx2", &[[2, 0, 0]], order);
        exchange(&mut criterion, "D^(2,2)", &[[2, 2]], order);
    }
    criterion.final_summary();
}
