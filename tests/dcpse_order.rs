//! The observed order of DC-PSE at default settings: the design order, neither less nor more.
//!
//! How it is measured, and the bands, are those of the example `orders`.

#[path = "../examples/orders/bands.rs"]
mod bands;
#[path = "../examples/orders/measure.rs"]
mod measure;
#[path = "../examples/orders/sets.rs"]
mod sets;

use measure::{OfDegree, Series, observe};
use parops::{Field, Laplacian, Operator};
use sets::Set;

/// Four grids, from coarse to fine.
fn sides<const D: usize>() -> Vec<usize> {
    [&[64, 102, 161, 256], &[24, 38, 60, 96], &[14, 18, 24, 32]][D - 1].to_vec()
}

fn holds<const D: usize, const K: usize, T: Field>(
    operator: impl Operator<D, Out = [f64; K]> + Clone,
    series: &Series,
) {
    let outcome = observe::<D, K, T>(operator, series).unwrap();
    for (k, observed) in outcome.outputs.iter().enumerate() {
        let left = bands::violations(series, D, observed);
        let Series { set, order, even, .. } = series;
        let name = format!("{D}D l {} output {k} r {order} {} even {even}", outcome.conditions, set.name());
        println!("{name}: {observed:.3?}, {} of {} rows grown", outcome.grown, outcome.rows);
        assert!(left.is_empty(), "{name}: {left:?}, {observed:?}");
    }
}

/// Every derivative of degree at most 2 in one and two dimensions; `wave` and `targets` as in [`Series`].
fn every_operator<T: Field>(set: Set, order: u32, even: bool, wave: [f64; 2], targets: usize, sides: [Vec<usize>; 2]) {
    let [line, plane] = sides;
    let on = |wave: f64, sides: &[usize]| Series {
        set,
        even,
        order,
        sides: sides.to_vec(),
        wave,
        targets,
        seeds: 5,
        faces: true,
    };
    for degree in 0..=2 {
        let wave = wave[usize::from(degree == 2)];
        match degree {
            0 => holds::<1, 1, T>(OfDegree::<1>(0), &on(wave, &line)),
            1 => holds::<1, 1, T>(OfDegree::<1>(1), &on(wave, &line)),
            _ => holds::<1, 1, T>(OfDegree::<1>(2), &on(wave, &line)),
        }
        match degree {
            0 => holds::<2, 1, T>(OfDegree::<1>(0), &on(wave, &plane)),
            1 => holds::<2, 2, T>(OfDegree::<2>(1), &on(wave, &plane)),
            _ => holds::<2, 3, T>(OfDegree::<3>(2), &on(wave, &plane)),
        }
    }
}

/// Targets a set in the plane; in one dimension every particle is one.
const TARGETS: usize = 400;

#[test]
fn order_on_jittered_and_boundary_sets_is_the_design_order() {
    for set in [Set::Jittered, Set::Boundary] {
        every_operator::<f64>(set, 2, false, [0.3; 2], TARGETS, [sides::<1>(), sides::<2>()]);
        every_operator::<f64>(set, 4, false, [0.7; 2], TARGETS, [sides::<1>(), sides::<2>()]);
    }
}

#[test]
fn order_with_one_cutoff_for_all_is_the_design_order() {
    every_operator::<f64>(Set::Jittered, 2, true, [0.3; 2], TARGETS, [sides::<1>(), sides::<2>()]);
    every_operator::<f64>(Set::Jittered, 4, true, [0.7; 2], TARGETS, [sides::<1>(), sides::<2>()]);
}

#[test]
fn order_of_single_precision_fields_is_the_design_order() {
    // Above their floor, eps32 sum |w| epsilon^-|beta|, errors span a factor of 2 in h only, and waves are shorter.
    let sides = || [vec![32, 40, 51, 64], vec![24, 30, 38, 48]];
    every_operator::<f32>(Set::Jittered, 2, false, [0.8, 1.2], usize::MAX, sides());
    every_operator::<f32>(Set::Jittered, 4, false, [1.2, 1.5], usize::MAX, sides());
    // With 2 l neighbors each, the few corners of a square lead the norm over its faces, and 5 sets of seeds leave the
    // order in doubt by 0.2 over so short a span; with one cutoff for all, corners weigh no more than edges.
    every_operator::<f32>(Set::Boundary, 2, true, [0.5, 0.7], usize::MAX, sides());
    every_operator::<f32>(Set::Boundary, 4, true, [0.7, 0.9], usize::MAX, sides());
}

#[test]
fn odd_orders_on_lattices_with_whole_shells_are_one_higher() {
    for order in [1, 3] {
        let series = |sides| Series {
            set: Set::Lattice,
            even: false,
            order,
            sides,
            wave: 0.4,
            targets: 200,
            seeds: 1,
            faces: true,
        };
        holds::<1, 1, f64>(OfDegree::<1>(1), &series(sides::<1>()));
        holds::<1, 1, f64>(OfDegree::<1>(2), &series(sides::<1>()));
        holds::<2, 2, f64>(OfDegree::<2>(1), &series(sides::<2>()));
        holds::<2, 3, f64>(OfDegree::<3>(2), &series(sides::<2>()));
    }
}

#[test]
fn order_of_second_derivatives_in_space_is_the_design_order() {
    for (order, wave, targets) in [(2, 0.3, 200), (4, 0.7, 120)] {
        for set in [Set::Jittered, Set::Boundary] {
            let series = Series { set, even: false, order, sides: sides::<3>(), wave, targets, seeds: 5, faces: true };
            holds::<3, 1, f64>(Laplacian::<3>, &series);
            holds::<3, 6, f64>(OfDegree::<6>(2), &series);
        }
    }
}

#[test]
fn order_on_quasi_random_sets_is_the_design_order() {
    // Such a set is locally a lattice that changes with N, and the constant of the error with it: many numbers.
    let sides: Vec<usize> = (0..28).map(|i| (24.0 * 4.0_f64.powf(f64::from(i) / 27.0)).round() as usize).collect();
    for (order, wave) in [(2, 0.3), (4, 0.7)] {
        let series = Series {
            set: Set::QuasiRandom,
            even: false,
            order,
            sides: sides.clone(),
            wave,
            targets: 60,
            seeds: 5,
            faces: true,
        };
        holds::<2, 2, f64>(OfDegree::<2>(1), &series);
        holds::<2, 3, f64>(OfDegree::<3>(2), &series);
    }
}
