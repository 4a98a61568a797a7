//! Moments of kernels: the ones required, the ones a kernel has, and the ones a set of particles gives it.

use crate::error::{KernelError, OperatorError, ParticleError, Result};
use crate::kernel::Kernel;
use crate::multi_index::{MultiIndex, Term, graded};
use crate::scalar::square;
use crate::scale::Volumes;
use crate::stencil::Stencil;

/// The multi-indices alpha that have a moment condition for degree m and order r, in graded order:
/// 1 <= |alpha| <= m + r - 1, and alpha = 0 too where m = 0.
///
/// ```
/// assert_eq!(parops::moment_conditions::<2>(2, 2).count(), 9);
/// assert_eq!(parops::moment_conditions::<2>(0, 2).count(), 3);
/// ```
///
/// Source: notes 000, eq. 16 and 18. For odd m the zeroth moment is zero by parity, not by a condition.
pub fn moment_conditions<const D: usize>(degree: u32, order: u32) -> impl Iterator<Item = MultiIndex<D>> {
    let high = degree.saturating_add(order);
    graded(u32::from(degree > 0), high.saturating_sub(1)).filter(move |_| high > 0)
}

/// The moment M_alpha = (-1)^|alpha| sum_i c_i beta_i! [alpha = beta_i] that a kernel of sum_i c_i D^beta_i must have.
///
/// It is a condition for the alpha of [`moment_conditions`] only.
///
/// ```
/// use parops::{MultiIndex, Term, required_moment};
/// let terms = [Term { index: MultiIndex::new([3]), factor: 0.5 }];
/// assert_eq!(required_moment(&terms, MultiIndex::new([3]))?, -3.0);
/// assert_eq!(required_moment(&terms, MultiIndex::new([1]))?, 0.0);
/// # parops::Result::Ok(())
/// ```
///
/// # Errors
/// [`MultiIndexError::Degree`](crate::MultiIndexError::Degree) where beta_i! does not fit 128 bits.
///
/// Source: notes 000, eq. 18.
pub fn required_moment<const D: usize>(terms: &[Term<D>], alpha: MultiIndex<D>) -> Result<f64> {
    let mut sum = 0.0;
    for term in terms.iter().filter(|term| term.index == alpha) {
        sum += term.factor * term.index.factorial()? as f64;
    }
    Ok(sum * f64::from(alpha.sign()))
}

/// An integral found numerically.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quadrature {
    /// The integral.
    pub value: f64,
    /// How far the two sums it is the mean of differ, plus rounding: more than its error for smooth integrands.
    pub error: f64,
    /// The same sum over absolute values: what the error is to be measured against.
    pub absolute: f64,
}

/// The moment M_alpha = Int z^alpha eta(z) dz of any kernel, by quadrature.
///
/// As [`continuous_moments`], for one alpha.
///
/// ```
/// use parops::{MultiIndex, WideGaussian, continuous_moment};
/// let second = continuous_moment(&WideGaussian::<2>::new(), MultiIndex::new([2, 0]))?;
/// assert!((second.value - 2.0).abs() < 1e-14);
/// # parops::Result::Ok(())
/// ```
///
/// # Errors
/// As [`continuous_moments`].
pub fn continuous_moment<const D: usize>(
    kernel: &(impl Kernel<f64, D> + ?Sized),
    alpha: MultiIndex<D>,
) -> Result<Quadrature> {
    let moments = continuous_moments(kernel, &[alpha])?;
    // One multi-index in, one moment out.
    Ok(moments.first().copied().unwrap_or(Quadrature { value: 0.0, error: 0.0, absolute: 0.0 }))
}

/// The moments M_alpha = Int z^alpha eta(z) dz of any kernel, by quadrature over |z| <= 1.75 R, R its support.
///
/// The integral is the mean of the sums over two lattices, one shifted by half its spacing in all axes, which starts at
/// half the overlap limit and is halved until the sums agree to 1e-13 of the absolute moment or hold 2^20 points each.
/// For a smooth kernel (the Gaussian ones) both are spectrally accurate: the error is rounding, about 1e-15 of the absolute
/// moment. For a compact kernel with k continuous derivatives it falls as the power k + 2 of the spacing, and the stated
/// error is an estimate: beyond one dimension waves along the diagonals add alike to both lattices, and the true error was
/// found 4 to 36 times as large. Exact moments: [`Exchange::moment`](crate::Exchange::moment).
///
/// # Errors
/// [`KernelError::Radii`] where the support R or the overlap limit is not positive and finite, or (3.5 R)^max(D, 2) is
/// not, or the finest spacing underflows; [`KernelError::Points`] where the finest lattice has more than 2^24 points,
/// which takes at least 11 dimensions.
pub fn continuous_moments<const D: usize>(
    kernel: &(impl Kernel<f64, D> + ?Sized),
    alphas: &[MultiIndex<D>],
) -> Result<Vec<Quadrature>> {
    let (support, overlap_limit) = (kernel.support(), kernel.overlap_limit());
    let radius = BALL * support;
    let finest = 2.0 * radius / (POINTS.powf(1.0 / D.max(1) as f64) - 1.0);
    // Squares of distances and volumes of cells must not overflow, spacings not vanish: such a lattice has no end.
    let largest = (0..D.max(2)).fold(1.0, |product, _| product * 2.0 * radius);
    let spaced = finest.is_normal() && largest.is_finite();
    if !(support > 0.0 && overlap_limit > 0.0 && overlap_limit.is_finite() && spaced) {
        return Err(KernelError::Radii { support, overlap_limit }.into());
    }
    // In many dimensions even the fewest coordinates an axis may have make too many points.
    let points = (0..D).fold(1.0, |product, _| product * (2.0 * (radius / finest).floor() + 3.0));
    if points > MOST_POINTS {
        return Err(KernelError::Points { points, limit: MOST_POINTS }.into());
    }
    let mut h = (0.5 * overlap_limit).max(finest);
    loop {
        let [(at_nodes, absolute), (between, _)] =
            [0.0, 0.5].map(|shift| lattice_sums(kernel, alphas, radius, h, shift));
        let mut moments = Vec::with_capacity(alphas.len());
        let mut converged = true;
        for ((a, b), absolute) in at_nodes.into_iter().zip(between).zip(absolute) {
            let error = (a - b).abs() + f64::EPSILON * absolute;
            converged &= error <= AGREEMENT * absolute;
            moments.push(Quadrature { value: 0.5 * (a + b), error, absolute });
        }
        if converged || 0.5 * h < finest {
            return Ok(moments);
        }
        h *= 0.5;
    }
}

/// Radius of the ball of integration over the support. exp(-|z|^2/4), the slowest to fall, is 5e-22 at 1.75 * 8.
const BALL: f64 = 1.75;
/// The number of points of the finest lattice, up to its edges.
const POINTS: f64 = 1048576.0;
/// The largest number of points of one lattice, edges included.
const MOST_POINTS: f64 = 16777216.0;
/// Two sums agree to this fraction of the absolute moment: 450 eps, which rounding in 2^20 terms stays below.
const AGREEMENT: f64 = 1e-13;

/// h^D sum z^alpha eta(z) and the same of absolute values, over the points of (Z + shift)^D h in the ball.
fn lattice_sums<const D: usize>(
    kernel: &(impl Kernel<f64, D> + ?Sized),
    alphas: &[MultiIndex<D>],
    radius: f64,
    h: f64,
    shift: f64,
) -> (Vec<f64>, Vec<f64>) {
    let highest = alphas.iter().flat_map(|alpha| alpha.exponents()).max().unwrap_or(0);
    // Powers x^0, x^1, ... of every coordinate that occurs, one row a coordinate.
    let steps = (radius / h).floor() as i64;
    let coordinates: Vec<f64> = (-steps - 1..=steps + 1).map(|i| (i as f64 + shift) * h).collect();
    let width = usize::from(highest) + 1;
    let powers: Vec<f64> = coordinates
        .iter()
        .flat_map(|&x| std::iter::successors(Some(1.0), move |power| Some(power * x)).take(width))
        .collect();
    let volume = (0..D).fold(1.0, |volume, _| volume * h);
    let (mut sums, mut absolute) = (vec![0.0; alphas.len()], vec![0.0; alphas.len()]);
    for_each_node(coordinates.len(), |node: [usize; D]| {
        let z = node.map(|i| coordinates[i]);
        if square(&z) > radius * radius {
            return;
        }
        let eta = kernel.value(&z) * volume;
        for ((alpha, sum), absolute) in alphas.iter().zip(&mut sums).zip(&mut absolute) {
            let mut term = eta;
            for (i, n) in node.into_iter().zip(alpha.exponents()) {
                term *= powers[i * width + usize::from(n)];
            }
            *sum += term;
            *absolute += term.abs();
        }
    });
    (sums, absolute)
}

/// All of [0, n)^D, the first axis fastest.
fn for_each_node<const D: usize>(n: usize, mut visit: impl FnMut([usize; D])) {
    let mut node = [0; D];
    loop {
        visit(node);
        let Some(axis) = node.iter().position(|&i| i + 1 < n) else { return };
        node[axis] += 1;
        node[..axis].fill(0);
    }
}

/// Whether the center's own term V_p epsilon^-D eta(0) is part of a discrete zeroth moment.
///
/// It changes no other moment. Operators on differences f_q - f_p do not see it; sums over all particles have it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CenterTerm {
    /// q = p is counted, where the target is a particle.
    Included,
    /// Neighbors alone.
    Excluded,
}

/// The discrete moment M_alpha = sum_q V_q epsilon^-D z_q^alpha eta(z_q), z_q = (x_p - x_q)/epsilon, of any kernel over
/// any stencil.
///
/// As [`discrete_moments`], for one alpha.
///
/// # Errors
/// As [`discrete_moments`].
pub fn discrete_moment<const D: usize>(
    kernel: &(impl Kernel<f64, D> + ?Sized),
    stencil: &Stencil<D>,
    volumes: &Volumes,
    epsilon: f64,
    alpha: MultiIndex<D>,
    center: CenterTerm,
) -> Result<f64> {
    let moments = discrete_moments(kernel, stencil, volumes, epsilon, &[alpha], center)?;
    Ok(moments.first().copied().unwrap_or(0.0))
}

/// The discrete moments M_alpha = sum_q V_q epsilon^-D z_q^alpha eta(z_q), one for each of `alphas`.
///
/// The sum runs over the neighbors in the stencil's order, images counted without their sign (a moment belongs to the
/// geometry, not to a field), and over the center as told.
///
/// ```
/// use parops::{CenterTerm, Gaussian, MultiIndex, Neighbor, Stencil, Volumes, discrete_moment};
/// let mut row = Stencil::<1>::default();
/// row.reset(0, Some(0), 4.5);
/// for q in 1..=8 {
///     let x = 0.5 * q as f64;
///     row.push(Neighbor { q: 2 * q, separation: [x], sign: 1 });
///     row.push(Neighbor { q: 2 * q - 1, separation: [-x], sign: 1 });
/// }
/// let volumes = Volumes::equal(0.5)?;
/// let w = Gaussian::<1>::new();
/// let zeroth = discrete_moment(&w, &row, &volumes, 0.5, MultiIndex::ZERO, CenterTerm::Included)?;
/// assert!((zeroth - 1.0).abs() < 1e-8);
/// # parops::Result::Ok(())
/// ```
///
/// # Errors
/// [`ParticleError::Epsilon`] where epsilon is not positive and finite, [`OperatorError::Length`] where a volume is
/// missing, [`OperatorError::Weight`] naming the neighbor whose term is not finite.
///
/// Source: notes 000, sec. 2.2; notes 001, eq. 5.30 with errata 10.
pub fn discrete_moments<const D: usize>(
    kernel: &(impl Kernel<f64, D> + ?Sized),
    stencil: &Stencil<D>,
    volumes: &Volumes,
    epsilon: f64,
    alphas: &[MultiIndex<D>],
    center: CenterTerm,
) -> Result<Vec<f64>> {
    if !(epsilon > 0.0 && epsilon.is_finite()) {
        return Err(ParticleError::Epsilon { epsilon }.into());
    }
    let own = stencil.center().filter(|_| center == CenterTerm::Included).map(|q| (q, [0.0; D]));
    let neighbors = stencil.sources().iter().zip(stencil.separations()).map(|(&q, &x)| (q as usize, x));
    let mut sums = vec![0.0; alphas.len()];
    for (q, separation) in own.into_iter().chain(neighbors) {
        let z = separation.map(|x| x / epsilon);
        let eta = kernel.value(&z);
        // Beyond the reach of the kernel z^alpha may overflow: zero times infinity must not enter.
        if eta == 0.0 {
            continue;
        }
        let weight = (0..D).fold(volumes.get(q)?, |volume, _| volume / epsilon) * eta;
        for (&alpha, sum) in alphas.iter().zip(&mut sums) {
            let term = weight * alpha.power(&z);
            if !term.is_finite() {
                return Err(OperatorError::Weight { q, weight: term }.into());
            }
            *sum += term;
        }
    }
    Ok(sums)
}
