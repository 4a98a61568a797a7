//! The symbol of a lattice operator: its decay rate as a function of the wavenumber.

use nalgebra::{SMatrix, SVector};

/// The decay rate lambda(theta) = sum_j w_j (1 - prod_i cos(j_i theta_i)) over the octant j in {0, ..., n}^D, where
/// w_j already sums the mirror images of j, and theta = kappa h/epsilon is the phase from one lattice point to the next.
///
/// It is even and 2 pi periodic in every theta_i: [0, pi]^D holds all its values.
pub(super) struct Symbol<const D: usize> {
    /// n + 1.
    pub per_axis: usize,
    /// w, the last axis fastest; w_0 = 0.
    pub weights: Vec<f64>,
    /// sum_j w_j.
    pub total: f64,
}

/// lambda, its gradient and its Hessian at one theta.
struct Local<const D: usize> {
    value: f64,
    gradient: SVector<f64, D>,
    hessian: SMatrix<f64, D, D>,
}

/// Newton steps after which a point counts as converged; about five are needed.
const MOST_STEPS: usize = 60;

impl<const D: usize> Symbol<D> {
    /// lambda on the grid theta_i = pi k_i/(nodes - 1), the last axis fastest.
    ///
    /// One axis is summed at a time: nodes^D (n + 1) operations for the last, instead of nodes^D (n + 1)^D.
    pub fn on_grid(&self, nodes: usize) -> Vec<f64> {
        let n = self.per_axis;
        let step = std::f64::consts::PI / (nodes - 1) as f64;
        // cos(pi k j/(nodes - 1)) has few values; exact multiples keep the corners exact.
        let cosine: Vec<f64> = (0..nodes * n).map(|i| ((i / n * (i % n)) as f64 * step).cos()).collect();
        let mut sums = self.weights.clone();
        for _ in 0..D {
            // The first axis is summed and its wavenumber appended as the last: after D turns the order is restored.
            let rest = sums.len() / n;
            let mut next = vec![0.0; rest * nodes];
            for (tail, row) in next.chunks_mut(nodes).enumerate() {
                for (k, out) in row.iter_mut().enumerate() {
                    let cosines = &cosine[k * n..(k + 1) * n];
                    *out = cosines.iter().zip(sums[tail..].iter().step_by(rest)).map(|(c, w)| c * w).sum();
                }
            }
            sums = next;
        }
        sums.iter_mut().for_each(|sum| *sum = self.total - *sum);
        sums
    }

    fn local(&self, theta: &SVector<f64, D>) -> Local<D> {
        let n = self.per_axis;
        let waves: [Vec<(f64, f64)>; D] =
            std::array::from_fn(|i| (0..n).map(|j| (j as f64 * theta[i]).sin_cos()).collect());
        let mut local = Local { value: 0.0, gradient: SVector::zeros(), hessian: SMatrix::zeros() };
        let mut j = [0_usize; D];
        for &w in &self.weights {
            if w != 0.0 {
                // (cos, -j sin) of each axis; products that leave out one or two axes come from prefixes.
                let pair: [(f64, f64); D] = std::array::from_fn(|i| {
                    let (sin, cos) = waves[i][j[i]];
                    (cos, -(j[i] as f64) * sin)
                });
                let but = |a: usize, b: usize| {
                    (0..D).fold(1.0, |product, i| if i == a || i == b { product } else { product * pair[i].0 })
                };
                local.value += w * (1.0 - but(D, D));
                for a in 0..D {
                    local.gradient[a] -= w * pair[a].1 * but(a, a);
                    local.hessian[(a, a)] += w * (j[a] * j[a]) as f64 * but(D, D);
                    for b in 0..a {
                        let mixed = w * pair[a].1 * pair[b].1 * but(a, b);
                        local.hessian[(a, b)] -= mixed;
                        local.hessian[(b, a)] -= mixed;
                    }
                }
            }
            for axis in (0..D).rev() {
                j[axis] += 1;
                if j[axis] < n {
                    break;
                }
                j[axis] = 0;
            }
        }
        local
    }

    /// Climbs from theta to a local maximum of `sign` * lambda by damped Newton steps; the value of lambda there, and
    /// where.
    pub fn climb(&self, theta: [f64; D], sign: f64) -> (f64, [f64; D]) {
        let mut theta = SVector::from(theta);
        let mut here = self.local(&theta);
        let scale = here.hessian.amax().max(f64::MIN_POSITIVE);
        let mut damping = 0.0;
        for _ in 0..MOST_STEPS {
            let curvature = here.hessian * -sign + SMatrix::identity() * damping;
            let there = curvature.cholesky().map(|factor| {
                let theta = theta + factor.solve(&(here.gradient * sign));
                (theta, self.local(&theta))
            });
            match there {
                Some((new, local)) if sign * local.value >= sign * here.value => {
                    let gain = sign * (local.value - here.value);
                    (theta, here) = (new, local);
                    damping *= 0.1;
                    if gain <= f64::EPSILON * here.value.abs() {
                        break;
                    }
                }
                _ => damping = f64::max(damping * 10.0, 1e-3 * scale),
            }
        }
        (here.value, theta.into())
    }
}
