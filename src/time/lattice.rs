//! The fastest decay an exchange kernel has on a uniform lattice, by a scan of all wavenumbers.

use super::limit::StepLimit;
use super::symbol::Symbol;
use crate::error::{NeighborError, OperatorError, ParticleError, Result, TimeError};
use crate::kernel::Kernel;
use crate::multi_index::common_degree;

/// Most octant points, and most wavenumbers, of one scan.
const MOST_POINTS: f64 = 33_554_432.0;

/// Most extrema of the grid that are refined; further ones are equal to these by symmetry or lower.
const MOST_STARTS: usize = 24;

/// Points whose squared distance exceeds the squared radius by less than this part lie on the sphere: they are in,
/// whole shells at a time, however h/epsilon was rounded.
const SHELL: f64 = 1e-12;

/// The decay rates of the modes of u' = eps^-2 sum_q h^D eta((x_p - x_q)/eps) (u_q - u_p) on a uniform lattice.
///
/// The mode exp(i kappa.x/eps) decays with lambda(kappa)/eps^2,
/// lambda(kappa) = sum_j delta^D eta(z_j) (1 - prod_i cos(kappa_i z_ji)), z_j = delta j, delta = h/epsilon (the inverse
/// of the overlap), over all lattice points j != 0 with |z_j| <= radius.
///
/// ```
/// use parops::{Euler, Exchange, LatticeSpectrum, MultiIndex, Term};
/// let narrow = Exchange::new(&[Term { index: MultiIndex::new([2]), factor: 1.0 }], 2)?;
/// let spectrum = LatticeSpectrum::scan(&narrow, 1.0, 7.0)?;
/// assert!((spectrum.lambda_max - 3.321974003905699).abs() < 1e-12);
/// let (diffusion, epsilon) = (0.5, 0.1);
/// let dt = spectrum.limit(diffusion, epsilon)?.step(&Euler::<f64>::new());
/// assert!((dt - 0.6020516709789322 * epsilon * epsilon / diffusion).abs() < 1e-12);
/// # parops::Result::Ok(())
/// ```
///
/// Source: notes 001, sec. 6.2.1; errata 26 for the bound of the sum over a lattice in place of that of the integral.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LatticeSpectrum<const D: usize> {
    /// The fastest decay lambda_max, in units of eps^-2.
    pub lambda_max: f64,
    /// A wavenumber kappa (in units of 1/epsilon) at which it is attained.
    pub fastest: [f64; D],
    /// The slowest decay among the wavenumbers scanned but 0, and the minima found from them; positive.
    pub smallest: f64,
    /// (1/2) sum_j delta^D eta(z_j) z_ji^2: the coefficient with which D^2_i acts on the longest waves; 1 for an exact
    /// Laplacian.
    pub coefficient: [f64; D],
}

impl<const D: usize> LatticeSpectrum<D> {
    /// Scans the wavenumbers [0, pi/delta]^D, four to the shortest period, and climbs from the best of them.
    ///
    /// `h_over_epsilon` is delta, `radius` the cutoff in units of epsilon; a lattice point at the cutoff is in.
    /// The kernel approximates a sum of second derivatives c_i D^2_i and is even along every axis.
    /// Relative accuracy of lambda_max: the rounding of the sum. Allocates (radius/delta + 1)^D + (2 radius/delta + 1)^D
    /// numbers.
    ///
    /// # Errors
    /// [`TimeError::Growing`] with the most negative rate, where a mode does not decay: no step is stable.
    /// [`TimeError::NotDiffusion`] where the kernel approximates something else; [`TimeError::Uneven`] where it is not
    /// even along an axis; [`ParticleError::Spacing`] and [`NeighborError::Cutoff`] where delta or the radius is not
    /// positive and finite; [`NeighborError::Cells`] for more than 2^25 points or wavenumbers;
    /// [`OperatorError::Weight`] where the kernel is not finite.
    pub fn scan(kernel: &(impl Kernel<f64, D> + ?Sized), h_over_epsilon: f64, radius: f64) -> Result<Self> {
        check_terms(kernel)?;
        let delta = h_over_epsilon;
        if !(delta > 0.0 && delta.is_finite()) {
            return Err(ParticleError::Spacing { spacing: delta }.into());
        }
        if !(radius > 0.0 && radius.is_finite()) {
            return Err(NeighborError::Cutoff { cutoff: radius }.into());
        }
        let reach = (radius / delta * (1.0 + SHELL)).floor();
        let nodes = 2.0 * reach.max(4.0) + 1.0;
        if nodes.powi(D as i32) > MOST_POINTS {
            return Err(NeighborError::Cells { axis: 0, cells: nodes, limit: MOST_POINTS.powf(1.0 / D as f64) }.into());
        }
        let (symbol, coefficient) = fold(kernel, delta, radius, reach as usize + 1)?;
        let nodes = nodes as usize;
        let grid = symbol.on_grid(nodes);

        let (lambda_max, fastest) = extreme(&symbol, &grid, nodes, 1.0).unwrap_or((0.0, [0.0; D]));
        let slowest = extreme(&symbol, &grid, nodes, -1.0).map_or(f64::INFINITY, |(lambda, _)| lambda);
        let sampled = grid.iter().skip(1).copied().fold(slowest, f64::min);
        // Near kappa = 0 lambda is sum_i coefficient_i kappa_i^2: negative coefficients grow at any resolution.
        let smallest = coefficient.iter().copied().filter(|&c| c <= 0.0).fold(sampled, f64::min);
        let decays = smallest > 0.0 && lambda_max > 0.0 && lambda_max.is_finite();
        if !decays {
            return Err(TimeError::Growing { rate: smallest }.into());
        }
        Ok(Self { lambda_max, fastest: fastest.map(|theta| folded(theta) / delta), smallest, coefficient })
    }

    /// The step limit of u' = `coefficient` L u on this lattice with smoothing length `epsilon`:
    /// dt <= x epsilon^2/(coefficient lambda_max), x the negative real interval of the stepper.
    ///
    /// # Errors
    /// [`ParticleError::Epsilon`] where epsilon is not positive and finite; and as
    /// [`StepLimit::from_spectral_bound`].
    pub fn limit(&self, coefficient: f64, epsilon: f64) -> Result<StepLimit> {
        if !(epsilon > 0.0 && epsilon.is_finite()) {
            return Err(ParticleError::Epsilon { epsilon }.into());
        }
        StepLimit::from_spectral_bound(self.lambda_max / epsilon / epsilon, coefficient)
    }
}

/// Refuses kernels that do not approximate a sum of second derivatives D^2_i.
fn check_terms<const D: usize>(kernel: &(impl Kernel<f64, D> + ?Sized)) -> Result<()> {
    let degree = common_degree(kernel.terms())?;
    let pure = |exponents: [u8; D]| exponents.iter().all(|&e| e == 0 || e == 2);
    if degree == 2 && kernel.terms().iter().all(|term| pure(term.index.exponents())) {
        Ok(())
    } else {
        Err(TimeError::NotDiffusion { degree }.into())
    }
}

/// The weights of the octant, mirror images summed, and the discrete second moments over 2.
fn fold<const D: usize>(
    kernel: &(impl Kernel<f64, D> + ?Sized),
    delta: f64,
    radius: f64,
    per_axis: usize,
) -> Result<(Symbol<D>, [f64; D])> {
    let cell = delta.powi(D as i32);
    let (mut weights, mut coefficient) = (vec![0.0; per_axis.pow(D as u32)], [0.0; D]);
    let mut values = vec![0.0; 1 << D];
    let (mut defect, mut largest) = ([0.0_f64; D], 0.0_f64);
    for (index, weight) in weights.iter_mut().enumerate().skip(1) {
        let mut rest = index;
        let mut z = [0.0; D];
        for x in z.iter_mut().rev() {
            *x = (rest % per_axis) as f64 * delta;
            rest /= per_axis;
        }
        if z.iter().map(|x| x * x).sum::<f64>() > radius * radius * (1.0 + SHELL) {
            continue;
        }
        for mirror in 0..1_usize << D {
            if (0..D).any(|i| mirror >> i & 1 == 1 && z[i] == 0.0) {
                continue;
            }
            let image = std::array::from_fn(|i| if mirror >> i & 1 == 1 { -z[i] } else { z[i] });
            let value = kernel.value(&image);
            if !(cell * value).is_finite() {
                return Err(OperatorError::Weight { q: index, weight: value }.into());
            }
            *weight += cell * value;
            largest = largest.max(value.abs());
            values[mirror] = value;
            // Each image is compared with its own mirror image along one axis.
            let axis = mirror.trailing_zeros() as usize;
            if let Some(defect) = defect.get_mut(axis) {
                *defect = defect.max((value - values[mirror & (mirror - 1)]).abs());
            }
        }
        for (sum, x) in coefficient.iter_mut().zip(&z) {
            *sum += *weight * x * x / 2.0;
        }
    }
    // A kernel evaluates a point and its mirror image with the same rounding, or nearly so.
    const EVEN: f64 = 64.0 * f64::EPSILON;
    if let Some(axis) = defect.iter().position(|&defect| defect > EVEN * largest) {
        return Err(TimeError::Uneven { axis, defect: defect[axis] / largest }.into());
    }
    let total = weights.iter().sum();
    Ok((Symbol { per_axis, weights, total }, coefficient))
}

/// The highest maximum of sign * lambda away from theta = 0, climbed to from the best local maxima of the grid; the
/// value of lambda there, and where. `None` where every climb ends at 0.
fn extreme<const D: usize>(symbol: &Symbol<D>, grid: &[f64], nodes: usize, sign: f64) -> Option<(f64, [f64; D])> {
    let mut starts: Vec<usize> = (1..grid.len()).filter(|&index| is_peak::<D>(grid, nodes, index, sign)).collect();
    starts.sort_by(|&a, &b| (sign * grid[b]).total_cmp(&(sign * grid[a])));
    let step = std::f64::consts::PI / (nodes - 1) as f64;
    let climbs = starts.iter().take(MOST_STARTS).map(|&index| {
        let mut rest = index;
        let mut theta = [0.0; D];
        for x in theta.iter_mut().rev() {
            *x = (rest % nodes) as f64 * step;
            rest /= nodes;
        }
        symbol.climb(theta, sign)
    });
    climbs
        .filter(|(_, theta)| theta.iter().any(|&x| folded(x) > step / 2.0))
        .max_by(|(a, _), (b, _)| (sign * a).total_cmp(&(sign * b)))
}

/// Whether no neighbor along an axis is better. Beyond the faces of the grid the symbol is its own mirror image.
fn is_peak<const D: usize>(grid: &[f64], nodes: usize, index: usize, sign: f64) -> bool {
    let mut stride = 1;
    for _ in 0..D {
        let k = index / stride % nodes;
        let here = sign * grid[index];
        if (k > 0 && sign * grid[index - stride] > here) || (k + 1 < nodes && sign * grid[index + stride] > here) {
            return false;
        }
        stride *= nodes;
    }
    true
}

/// The phase in [0, pi] at which the symbol, even and 2 pi periodic, has the same value.
fn folded(theta: f64) -> f64 {
    let turn = std::f64::consts::TAU;
    (theta - turn * (theta / turn).round()).abs()
}
