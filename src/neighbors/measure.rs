//! What neighbors tell about a set: mean distance, epsilon, volumes.

use super::Neighbors;
use crate::error::{Error, NeighborError, OperatorError, ParticleError, Result};
use crate::kernel::Kernel;
use crate::particles::reserved;
use crate::scale::{Epsilon, Spacing, Volumes};
use crate::stencil::Stencil;

/// The mean neighbor distance of target p, axis by axis: h_p = (1/n) sum_q sum_i |x_p,i - x_q,i|.
///
/// The sum runs over the n neighbors within the provider's cutoff of p, images among them. It is proportional to the
/// spacing, not equal to it: the factor grows with cutoff / spacing and with D.
///
/// # Errors
/// Naming the target: [`NeighborError::Isolated`] where it has no neighbor, [`ParticleError::Spacing`] where all lie
/// on it, [`NeighborError::Target`] where there is no such target.
///
/// Source: notes 001, after eq. 5.34.
pub fn mean_neighbor_distance<const D: usize>(provider: &impl Neighbors<D>, p: usize) -> Result<Spacing> {
    if p >= provider.targets() {
        return Err(Error::from(NeighborError::Target { p, targets: provider.targets() }).at(p));
    }
    let cutoff = provider.cutoff(p);
    let (mut sum, mut count) = (0.0, 0_usize);
    provider.for_each(p, cutoff, |neighbor| {
        sum += neighbor.separation.iter().map(|s| s.abs()).sum::<f64>();
        count += 1;
    });
    if count == 0 {
        return Err(Error::from(NeighborError::Isolated { cutoff }).at(p));
    }
    let spacing = sum / count as f64;
    if !(spacing > 0.0 && spacing.is_finite()) {
        return Err(Error::from(ParticleError::Spacing { spacing }).at(p));
    }
    Ok(Spacing(spacing))
}

/// One epsilon per target, epsilon_p = `ratio` * h_p with h_p of [`mean_neighbor_distance`].
///
/// ```
/// use parops::{CellList, Cutoff, Domain, Particles, epsilon_from_neighbors};
/// let ring = Particles::lattice([0.0], [1.0], [8])?;
/// let neighbors = CellList::build(&ring, &Domain::periodic([0.0], [1.0])?, Cutoff(0.25))?;
/// assert_eq!(epsilon_from_neighbors(&neighbors, 2.0)?.get(3)?, 2.0 * 0.1875);
/// # parops::Result::Ok(())
/// ```
///
/// # Errors
/// As [`mean_neighbor_distance`], and [`ParticleError::Epsilon`] where the product is not positive and finite.
///
/// Source: notes 001, eq. 5.38: h_p / epsilon_p is a constant.
pub fn epsilon_from_neighbors<const D: usize>(provider: &impl Neighbors<D>, ratio: f64) -> Result<Epsilon> {
    let mut epsilon = reserved(provider.targets())?;
    for p in 0..provider.targets() {
        epsilon.push(ratio * mean_neighbor_distance(provider, p)?.0);
    }
    Epsilon::each(epsilon)
}

/// Volumes by an inverse kernel sum, V_p = 1 / sum_q W_epsilon(x_p - x_q), q = p included.
///
/// W_epsilon(x) = epsilon_p^-D W(x / epsilon_p) is a smoothing kernel. Images count with weight +1 whatever their
/// sign, since a density has no sign. At open faces the volumes grow, because neighbors are missing there.
///
/// # Errors
/// Naming the target: [`OperatorError::NoCenter`] where it is no particle, [`NeighborError::Reach`] where the support
/// of the kernel is beyond the provider, [`ParticleError::Volume`] where the sum is not positive;
/// [`OperatorError::Length`] where epsilon is held for fewer targets.
///
/// Source: the SPH number density, 1 / V_p; notes 000, sec. 2, for W_epsilon.
pub fn volumes_from_neighbors<const D: usize>(
    provider: &impl Neighbors<D>,
    kernel: &(impl Kernel<f64, D> + ?Sized),
    epsilon: &Epsilon,
) -> Result<Volumes> {
    let reach = provider.reach();
    let mut volumes = reserved(provider.targets())?;
    let (mut row, mut z, mut values) = (Stencil::default(), Vec::new(), Vec::new());
    for p in 0..provider.targets() {
        let epsilon = epsilon.get(p)?;
        let cutoff = epsilon * kernel.support();
        if !(cutoff <= reach) {
            return Err(Error::from(NeighborError::Reach { cutoff, reach }).at(p));
        }
        provider.gather(p, cutoff, &mut row);
        if row.center().is_none() {
            return Err(Error::from(OperatorError::NoCenter { neighbors: row.len() }).at(p));
        }
        z.clear();
        z.extend(row.separations().iter().map(|separation| separation.map(|s| s / epsilon)));
        values.resize(z.len(), 0.0);
        kernel.values(&z, &mut values);
        let sum = kernel.value(&[0.0; D]) + values.iter().sum::<f64>();
        volumes.push(epsilon.powi(D as i32) / sum);
    }
    Volumes::each(volumes)
}
