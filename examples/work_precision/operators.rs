//! The operators, known at run time only so that few types are compiled, and the waves they act on.

use std::f64::consts::{FRAC_PI_2, TAU};

use parops::{MultiIndex, Operator};

/// K outputs, each a list of terms.
#[derive(Clone)]
pub struct Terms<const D: usize, const K: usize>(Vec<(usize, MultiIndex<D>, f64)>);

impl<const D: usize, const K: usize> Operator<D> for Terms<D, K> {
    type Out = [f64; K];

    fn terms(&self, term: &mut dyn FnMut(usize, MultiIndex<D>, f64)) {
        self.0.iter().for_each(|&(output, index, factor)| term(output, index, factor));
    }
}

impl<const D: usize> Terms<D, 1> {
    /// sum_a d_a^2.
    pub fn laplacian() -> Self {
        Self((0..D).map(|axis| (0, axis_index(axis, 2), 1.0)).collect())
    }

    /// d_1^3, d_1^2 d_2 or d_1 d_2 d_3.
    pub fn mixed_third() -> Self {
        let index = std::array::from_fn(|axis| [[3, 0, 0], [2, 1, 0], [1, 1, 1]][D - 1][axis]);
        Self(vec![(0, MultiIndex::new(index), 1.0)])
    }
}

impl<const D: usize> Terms<D, D> {
    /// d_a for each axis.
    pub fn gradient() -> Self {
        Self((0..D).map(|axis| (axis, axis_index(axis, 1), 1.0)).collect())
    }
}

impl<const D: usize, const K: usize> Terms<D, K> {
    pub fn list(&self) -> &[(usize, MultiIndex<D>, f64)] {
        &self.0
    }

    /// The exact values on [`wave`].
    pub fn exact(&self, x: &[f64; D]) -> [f64; K] {
        let mut values = [0.0; K];
        self.0.iter().for_each(|&(output, index, factor)| values[output] += factor * derivative(index, x));
        values
    }
}

fn axis_index<const D: usize>(axis: usize, degree: u32) -> MultiIndex<D> {
    MultiIndex::new(std::array::from_fn(|a| if a == axis { degree as u8 } else { 0 }))
}

/// Numbers of waves along the axes, and phases.
const WAVES: [([f64; 3], f64); 2] = [([1.0, 2.0, -1.0], 0.3), ([-2.0, 1.0, 1.0], 1.1)];

/// f = sum_j sin(2 pi k_j . x + phi_j), periodic.
pub fn wave<const D: usize>(x: &[f64; D]) -> f64 {
    derivative(MultiIndex::ZERO, x)
}

/// D^beta f = sum_j (2 pi k_j)^beta sin(2 pi k_j . x + phi_j + |beta| pi/2).
fn derivative<const D: usize>(beta: MultiIndex<D>, x: &[f64; D]) -> f64 {
    let one = |(numbers, phase): &([f64; 3], f64)| {
        let k: [f64; D] = std::array::from_fn(|axis| TAU * numbers[axis]);
        let along: f64 = k.iter().zip(x).map(|(k, x)| k * x).sum();
        beta.power(&k) * (along + phase + f64::from(beta.degree()) * FRAC_PI_2).sin()
    };
    WAVES.iter().map(one).sum()
}
