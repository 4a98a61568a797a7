//! The gates where they are said to lie, and the estimate of condition numbers that are known.

use super::{Residual, Rung, Solution, condition, worst};

const EPS: f64 = f64::EPSILON;

fn solution(condition: f64, absolute: f64, terms: f64) -> Solution<f64> {
    Solution { rung: Rung::Cholesky, rank: 9, condition, residual: Residual { absolute, terms } }
}

/// Whether the largest residual that passes is `bound`, to a few roundings.
fn ends_at(bound: f64, passes: impl Fn(f64) -> bool) -> bool {
    let below = [0.0, 0.5 * bound, bound * (1.0 - 8.0 * EPS)];
    below.into_iter().all(&passes)
        && ![bound * (1.0 + 8.0 * EPS), 2.0 * bound, f64::NAN, f64::INFINITY].into_iter().any(passes)
}

#[test]
fn gates_are_the_least_of_condition_terms_and_half_the_digits() {
    let within =
        |condition, terms, l, largest| move |absolute| solution(condition, absolute, terms).is_within(l, largest);
    for (l, largest) in [(9, 2.0), (55, 24.0), (4, 0.125)] {
        let unit = EPS * l as f64;
        let by_condition = |condition: f64| 4.0 * unit * condition * largest;
        assert!(ends_at(by_condition(100.0), within(100.0, 90.0 * largest, l, largest)), "{l}");
        // Terms show a condition beyond the estimate.
        let terms = 1e3 * largest;
        assert!(ends_at(4.0 * unit * terms / (l as f64).sqrt(), within(1.0, terms, l, largest)), "{l}");
        assert!(ends_at(30.0 * unit * terms, within(1e6, terms, l, largest)), "{l}");
        assert!(ends_at(EPS.sqrt() * largest, within(1e15, 1e15, l, largest)), "{l}");
    }
}

#[test]
fn rows_of_the_cheaper_methods_are_sharp_to_sixteen_roundings_of_their_terms_or_four_of_large_ones() {
    let sharp = |terms: f64, largest| move |absolute| solution(1e9, absolute, terms).is_sharp(9, largest);
    for largest in [2.0, 24.0] {
        assert!(ends_at(16.0 * EPS * 64.0 * largest, sharp(64.0 * largest, largest)));
        assert!(ends_at(2048.0 * EPS * largest, sharp(256.0 * largest, largest)));
        assert!(ends_at(4.0 * EPS * 1024.0 * largest, sharp(1024.0 * largest, largest)));
        // Within the gates it must be too.
        assert!(ends_at(EPS.sqrt() * largest, sharp(1e9 * largest, largest)));
    }
}

#[test]
fn residuals_that_are_no_numbers_are_the_worst_wherever_they_stand() {
    let residual = |absolute, terms| Residual { absolute, terms };
    let of = |a, b| worst(residual(a, 1.0), residual(b, 2.0)).absolute;
    assert_eq!([of(1.0, 2.0), of(2.0, 1.0), of(2.0, 2.0)], [2.0; 3]);
    assert!(of(f64::NAN, 1.0).is_nan() && of(1.0, f64::NAN).is_nan());
    assert_eq!([of(f64::INFINITY, 1.0), of(1.0, f64::INFINITY)], [f64::INFINITY; 2]);
    assert_eq!(worst(residual(1.0, 1.0), residual(1.0, 2.0)).terms, 2.0);
    assert_eq!(worst(residual(1.0, 2.0), residual(1.0, 1.0)).terms, 2.0);
}

#[test]
fn condition_of_one_weak_or_strong_coordinate_is_found_whichever_it_is() {
    for l in 1..=60 {
        for j in 0..l {
            for extreme in [1e-12, 1e12] {
                let diagonal = |i| if i == j { extreme } else { 1.0 };
                let multiply = |x: &mut [f64]| x.iter_mut().enumerate().for_each(|(i, x)| *x *= diagonal(i));
                let solve = |x: &mut [f64]| x.iter_mut().enumerate().for_each(|(i, x)| *x /= diagonal(i));
                let found = condition(l, &mut Vec::new(), multiply, solve);
                let expected = if l == 1 { 1.0 } else { 1e6 };
                // Both iterations end on the extreme eigenvalue but for shares of 1e-12 l.
                assert!((found / expected - 1.0).abs() < 1e-9, "{l} {j} {extreme:e}: {found:e}");
            }
        }
    }
}
