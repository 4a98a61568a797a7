//! An estimate of the spacing of a set.

use super::Particles;
use crate::error::{ParticleError, Result};
use crate::scale::Spacing;

impl<const D: usize> Particles<D> {
    /// An estimate of the spacing h.
    ///
    /// With volumes: h = (1/N) sum_p V_p^(1/D), which is V^(1/D) to two roundings where they are equal. Without: the
    /// solution of prod_i (L_i / h + 1) = N, where L_i are the extents of the bounding box. That is exact for full
    /// lattices, and on lines and planes in higher dimensions it is the spacing along them.
    ///
    /// ```
    /// use parops::Particles;
    /// let line: Vec<_> = (0..5).map(|i| [0.5 * f64::from(i), 7.0]).collect();
    /// assert!((Particles::new(line)?.spacing()?.0 - 0.5).abs() < 1e-15);
    /// # parops::Result::Ok(())
    /// ```
    ///
    /// # Errors
    /// [`ParticleError::TooFew`] for no particle, or one without a volume,
    /// [`ParticleError::Spacing`] where all particles without volumes coincide.
    pub fn spacing(&self) -> Result<Spacing> {
        let needed = if self.volumes.is_some() { 1 } else { 2 };
        if self.len() < needed {
            return Err(ParticleError::TooFew { count: self.len(), needed }.into());
        }
        let spacing = match &self.volumes {
            Some(volumes) => match volumes.common() {
                Some(volume) => edge::<D>(volume),
                None => {
                    let mut sum = 0.0;
                    for p in 0..self.len() {
                        sum += edge::<D>(volumes.get(p)?);
                    }
                    sum / self.len() as f64
                }
            },
            None => spacing_in(self.extents(), self.len() as f64),
        };
        if !(spacing > 0.0 && spacing.is_finite()) {
            return Err(ParticleError::Spacing { spacing }.into());
        }
        Ok(Spacing(spacing))
    }

    fn extents(&self) -> [f64; D] {
        std::array::from_fn(|axis| {
            let along = self.points.iter().map(|point| point[axis]);
            let (low, high) =
                along.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (x.min(low), x.max(high)));
            high - low
        })
    }
}

/// V^(1/D), by the roots that are rounded once where there are such.
fn edge<const D: usize>(volume: f64) -> f64 {
    match D {
        1 => volume,
        2 => volume.sqrt(),
        3 => volume.cbrt(),
        _ => volume.powf(1.0 / D as f64),
    }
}

/// The root h of prod_i (extents_i / h + 1) = count, by bisection between bounds that hold for any extents.
fn spacing_in<const D: usize>(extents: [f64; D], count: f64) -> f64 {
    let longest = extents.iter().fold(0.0, |high: f64, &extent| high.max(extent));
    // The product lies between longest / h + 1 and its D-th power.
    let mut low = longest / (count - 1.0);
    let mut high = longest / (count.powf(1.0 / D as f64) - 1.0);
    loop {
        let middle = low + 0.5 * (high - low);
        if !(low < middle && middle < high) {
            return middle;
        }
        let product: f64 = extents.iter().map(|extent| extent / middle + 1.0).product();
        if product > count { low = middle } else { high = middle }
    }
}
