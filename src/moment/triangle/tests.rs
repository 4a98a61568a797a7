//! Integer matrices whose factors are integers with powers of two on the diagonal: every figure is exact.

use super::{Layout, Pair};
use crate::lanes::Lanes;

/// Integers in [-3, 3].
fn integer(i: usize, j: usize, seed: usize) -> f64 {
    ((i * i + 3 * i * j + 5 * j + seed * (i + 2 * j + 1)) % 7) as f64 - 3.0
}

/// The lower factor of each lane, its rows beyond `size` being the solutions of the right-hand sides.
fn factor(i: usize, j: usize, seed: usize) -> f64 {
    match i.cmp(&j) {
        std::cmp::Ordering::Greater => integer(i, j, seed),
        std::cmp::Ordering::Equal => [1.0, 2.0, 4.0][(i + seed) % 3],
        std::cmp::Ordering::Less => 0.0,
    }
}

/// A_ij, or (L y)_j for the rows below.
fn product(i: usize, j: usize, seed: usize) -> f64 {
    (0..=j.min(i)).map(|k| factor(i, k, seed) * factor(j, k, seed)).sum()
}

fn lanes(value: impl Fn(usize) -> f64) -> Lanes<2> {
    Lanes([value(0), value(1)])
}

/// The triangle and the right-hand sides below it, in memory as the layout says.
fn filled(layout: Layout, value: impl Fn(usize, usize, usize) -> f64) -> Vec<Pair<2>> {
    let Layout { size, extra } = layout;
    let mut matrix = vec![[Lanes::ZERO; 2]; layout.len()];
    for (pair, at) in matrix.iter_mut().zip(layout.entries()) {
        *pair = at.map(|(i, j)| lanes(|seed| if i.max(j) < size { value(i.max(j), i.min(j), seed) } else { 0.0 }));
    }
    for k in 0..extra {
        let (start, odd) = layout.row(k);
        for (j, pair) in matrix[start..].iter_mut().take(size).enumerate() {
            pair[odd] = lanes(|seed| value(size + k, j, seed));
        }
    }
    matrix
}

fn each_layout(check: impl Fn(Layout)) {
    (1..=7).for_each(|size| (0..=3).for_each(|extra| check(Layout { size, extra })));
}

fn vector(layout: Layout, value: impl Fn(usize, usize) -> f64) -> Vec<Lanes<2>> {
    (0..layout.columns()).map(|j| lanes(|seed| if j < layout.size { value(j, seed) } else { 0.0 })).collect()
}

#[test]
fn factors_solutions_and_quadratic_forms_of_integer_matrices_are_exact() {
    each_layout(|layout| {
        let Layout { size, extra } = layout;
        let mut matrix = filled(layout, product);
        assert!((0..size).all(|j| matrix[layout.diagonal(j)][j % 2] == lanes(|seed| product(j, j, seed))));

        let x = vector(layout, |j, seed| integer(j, 2, seed));
        let form = |seed| {
            let entry = |i: usize, j: usize| product(i.max(j), i.min(j), seed) * integer(i, 2, seed);
            (0..size).flat_map(|i| (0..size).map(move |j| entry(i, j) * integer(j, 2, seed))).sum()
        };
        assert_eq!(layout.quadratic_form(&matrix, &x), lanes(form), "{layout:?}");

        let mut inverse = vec![Lanes::ONE; layout.columns()];
        assert_eq!(layout.factorize(&mut matrix, |_| Lanes::ZERO, &mut inverse), Lanes::ONE);
        assert_eq!(inverse, vector(layout, |j, seed| 1.0 / factor(j, j, seed)), "{layout:?}");
        for k in 0..extra {
            let (start, odd) = layout.row(k);
            let solved: Vec<_> = matrix[start..][..layout.columns()].iter().map(|pair| pair[odd]).collect();
            assert_eq!(solved, vector(layout, |j, seed| factor(size + k, j, seed)), "{layout:?} {k}");
        }

        let times = |i, seed| (0..size).map(|j| factor(i, j, seed) * integer(j, 1, seed)).sum();
        let mut y = vector(layout, times);
        layout.forward(&matrix, &inverse, &mut y);
        assert_eq!(y, vector(layout, |j, seed| integer(j, 1, seed)), "{layout:?}");
        let transposed = |i, seed| (0..size).map(|j| factor(j, i, seed) * integer(j, 1, seed)).sum();
        let mut y = vector(layout, transposed);
        layout.backward(&matrix, &inverse, &mut y);
        assert_eq!(y, vector(layout, |j, seed| integer(j, 1, seed)), "{layout:?}");
    });
}

#[test]
fn pivots_must_be_above_their_floor_and_clear_their_own_lane_alone() {
    each_layout(|layout| {
        for j in 0..layout.size {
            let pivot = factor(j, j, 1).powi(2);
            for (floor, sound) in [(pivot, 0.0), (0.5 * pivot, 1.0), (f64::NAN, 0.0)] {
                let mut matrix = filled(layout, product);
                let mut inverse = vec![Lanes::ZERO; layout.columns()];
                let floors = |i| lanes(|seed| if (i, seed) == (j, 1) { floor } else { 0.0 });
                let found = layout.factorize(&mut matrix, floors, &mut inverse);
                assert_eq!(found, Lanes([1.0, sound]), "{layout:?} {j} {floor}");
                let left = inverse.iter().take(layout.size).enumerate();
                assert!(left.clone().all(|(i, inverse)| inverse.0[0] == 1.0 / factor(i, i, 0)));
                assert_eq!(inverse[j].0[1], sound / factor(j, j, 1));
            }
        }
    });
}
