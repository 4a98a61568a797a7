//! The manufactured problem: u, D, and the S that makes u the solution.

/// u = sin(k . x) + cos(m . x).
const K: [f64; 3] = [3.1, -2.3, 1.7];
const M: [f64; 3] = [1.9, 2.7, -2.9];
/// D = 1 + A sin(c . x + 0.7), between 0.6 and 1.4.
const A: f64 = 0.4;
const C: [f64; 3] = [2.3, 1.4, -1.8];

fn dot<const D: usize>(k: &[f64; 3], x: &[f64; D]) -> f64 {
    k.iter().zip(x).map(|(k, x)| k * x).sum()
}

fn squared<const D: usize>(k: &[f64; 3]) -> f64 {
    k[..D].iter().map(|k| k * k).sum()
}

pub fn solution<const D: usize>(x: &[f64; D]) -> f64 {
    dot(&K, x).sin() + dot(&M, x).cos()
}

pub fn gradient<const D: usize>(x: &[f64; D]) -> [f64; D] {
    let (along_k, along_m) = (dot(&K, x).cos(), -dot(&M, x).sin());
    std::array::from_fn(|i| K[i] * along_k + M[i] * along_m)
}

pub fn diffusivity<const D: usize>(x: &[f64; D]) -> f64 {
    1.0 + A * (dot(&C, x) + 0.7).sin()
}

/// S = -div(D grad u) = -D Lap u - grad D . grad u.
pub fn source<const D: usize>(x: &[f64; D]) -> f64 {
    let laplacian = -squared::<D>(&K) * dot(&K, x).sin() - squared::<D>(&M) * dot(&M, x).cos();
    let slope = A * (dot(&C, x) + 0.7).cos();
    -diffusivity(x) * laplacian - slope * dot(&C, &gradient(x))
}
