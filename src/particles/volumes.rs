//! Volumes of a particle set: given, equal, or midpoint cells in one dimension.

use super::{Particles, reserved};
use crate::domain::{Domain, Face};
use crate::error::{DomainError, Error, ParticleError, Result};
use crate::scale::Volumes;

impl<const D: usize> Particles<D> {
    /// The volumes V_p.
    ///
    /// # Errors
    /// [`ParticleError::NoVolumes`] where the set carries none.
    pub fn volumes(&self) -> Result<&Volumes> {
        self.volumes.as_ref().ok_or_else(|| ParticleError::NoVolumes { count: self.len() }.into())
    }

    /// Gives the particles these volumes; the generation stays, because the points do.
    ///
    /// # Errors
    /// [`ParticleError::Length`] where there is not one volume per particle.
    pub fn set_volumes(&mut self, volumes: Volumes) -> Result<()> {
        match volumes.len() {
            Some(found) if found != self.len() => Err(ParticleError::Length { found, needed: self.len() }.into()),
            _ => {
                self.volumes = Some(volumes);
                Ok(())
            }
        }
    }

    /// The particles with these volumes.
    ///
    /// # Errors
    /// As [`set_volumes`](Self::set_volumes).
    pub fn with_volumes(mut self, volumes: Volumes) -> Result<Self> {
        self.set_volumes(volumes)?;
        Ok(self)
    }

    /// The particles with the volumes V_p = `total` / N.
    ///
    /// # Errors
    /// [`ParticleError::Volume`] where the total or the quotient is not positive and finite.
    pub fn with_equal_volumes(self, total: f64) -> Result<Self> {
        let total = Volumes::equal(total).map(|_| total)?;
        let volumes =
            if self.is_empty() { Volumes::each(Vec::new()) } else { Volumes::equal(total / self.len() as f64) };
        self.with_volumes(volumes?)
    }
}

impl Particles<1> {
    /// The particles with the volumes of their midpoint cells, V_p = (x_{p+1} - x_{p-1}) / 2 in sorted order.
    ///
    /// The first and the last cell end at the faces of the interval, or, where it is periodic, at the midpoint across
    /// the seam. The volumes add up to the width.
    ///
    /// ```
    /// use parops::{Domain, Face, Particles};
    /// let interval = Domain::new([0.0], [1.0], [[Face::Open; 2]])?;
    /// let particles = Particles::new(vec![[0.5], [0.25]])?.with_midpoint_volumes(&interval)?;
    /// assert_eq!((particles.volumes()?.get(0)?, particles.volumes()?.get(1)?), (0.625, 0.375));
    /// # parops::Result::Ok(())
    /// ```
    ///
    /// # Errors
    /// [`DomainError::Unbounded`] where the interval has no end,
    /// [`DomainError::Outside`] naming a particle outside it,
    /// [`ParticleError::Coincident`] where two particles share a place (also across the seam).
    pub fn with_midpoint_volumes(self, interval: &Domain<1>) -> Result<Self> {
        let ([lower], [upper]) = (interval.lower(), interval.upper());
        if lower.is_infinite() || upper.is_infinite() {
            return Err(DomainError::Unbounded { axis: 0, lower, upper }.into());
        }
        let mut sorted: Vec<(f64, usize)> = reserved(self.len())?;
        for (p, point) in self.points().iter().enumerate() {
            sorted.push((interval.wrap(point).map_err(|error| error.at(p))?[0], p));
        }
        sorted.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        for pair in sorted.windows(2) {
            if !(pair[0].0 < pair[1].0) {
                return Err(Error::from(ParticleError::Coincident { other: pair[0].1 }).at(pair[1].1));
            }
        }
        let mut volumes = vec![0.0; self.len()];
        if let (Some(&(first, _)), Some(&(last, _))) = (sorted.first(), sorted.last()) {
            let periodic = interval.faces()[0][0] == Face::Periodic;
            let seam = 0.5 * (((first - lower) + (upper - last)).max(0.0));
            let mut below = if periodic { first - seam } else { lower };
            for (i, &(x, p)) in sorted.iter().enumerate() {
                let above = match sorted.get(i + 1) {
                    Some(&(next, _)) => x + 0.5 * (next - x),
                    None if periodic => last + seam,
                    None => upper,
                };
                volumes[p] = above - below;
                below = above;
            }
        }
        self.with_volumes(Volumes::each(volumes)?)
    }
}
