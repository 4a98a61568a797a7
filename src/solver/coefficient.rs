//! Coefficients of a scene: plain values and functions.

use crate::error::{Error, ParticleError, Result};

/// A diffusivity: a constant (`f64`), one number a particle (`Vec<f64>`), or a function of x
/// (`|x: &[f64; D]| ..`, with its argument written out). All fields of a run share it.
///
/// ```
/// use parops::Diffusivity;
/// let layered = |x: &[f64; 2]| if x[1] < 0.5 { 1.0 } else { 10.0 };
/// assert_eq!((layered.constant(), layered.at(0, &[0.0, 0.7])), (None, 10.0));
/// assert_eq!(Diffusivity::<2>::constant(&1e-3), Some(1e-3));
/// ```
pub trait Diffusivity<const D: usize>: Sync {
    /// The number, where it is one for all particles.
    fn constant(&self) -> Option<f64> {
        None
    }

    /// Checks that there is a value for each of so many particles.
    ///
    /// # Errors
    /// [`ParticleError::Length`] where there is not.
    fn validate(&self, particles: usize) -> Result<()> {
        let _ = particles;
        Ok(())
    }

    /// The value at particle p, which is at x.
    fn at(&self, p: usize, x: &[f64; D]) -> f64;
}

impl<const D: usize> Diffusivity<D> for f64 {
    fn constant(&self) -> Option<f64> {
        Some(*self)
    }

    fn at(&self, _: usize, _: &[f64; D]) -> f64 {
        *self
    }
}

impl<const D: usize> Diffusivity<D> for Vec<f64> {
    fn validate(&self, particles: usize) -> Result<()> {
        one_each(self.len(), particles)
    }

    fn at(&self, p: usize, _: &[f64; D]) -> f64 {
        self.get(p).copied().unwrap_or(f64::NAN)
    }
}

impl<F: Fn(&[f64; D]) -> f64 + Sync, const D: usize> Diffusivity<D> for F {
    fn at(&self, _: usize, x: &[f64; D]) -> f64 {
        self(x)
    }
}

/// A velocity: a constant (`[f64; D]`), one vector a particle (`Vec<[f64; D]>`), a function of x and t
/// (`|x: &[f64; D], t: f64| ..`, with its arguments written out), or one of x alone inside [`Steady`].
///
/// Functions are evaluated where they are needed, once a particle and stage, and never stored.
///
/// ```
/// use parops::{Steady, Velocity};
/// let swirl = Steady(|x: &[f64; 2]| [-x[1], x[0]]);
/// assert_eq!((swirl.steady(), swirl.at(0, &[1.0, 2.0], 0.5)), (true, [-2.0, 1.0]));
/// let gust = |_: &[f64; 1], t: f64| [t];
/// assert_eq!((gust.steady(), gust.at(0, &[0.0], 0.5)), (false, [0.5]));
/// ```
pub trait Velocity<const D: usize>: Sync {
    /// Whether it is known between the particles too; otherwise its gradient is that of the values at the particles.
    const EVERYWHERE: bool = true;

    /// Whether it is the same at all times: what hangs on it is then computed once. Not by default.
    fn steady(&self) -> bool {
        false
    }

    /// Checks that there is a vector for each of so many particles.
    ///
    /// # Errors
    /// [`ParticleError::Length`] where there is not.
    fn validate(&self, particles: usize) -> Result<()> {
        let _ = particles;
        Ok(())
    }

    /// The velocity at particle p, which is at x, at time t.
    fn at(&self, p: usize, x: &[f64; D], t: f64) -> [f64; D];

    /// The gradient dv_j/dx_k at \[j]\[k], by default from central differences over 2 `step`; asked for only where the
    /// velocity is known [`EVERYWHERE`](Self::EVERYWHERE).
    fn gradient(&self, p: usize, x: &[f64; D], t: f64, step: f64) -> [[f64; D]; D] {
        let mut gradient = [[0.0; D]; D];
        for k in 0..D {
            let (mut above, mut below) = (*x, *x);
            above[k] += step;
            below[k] -= step;
            let (v, w, width) = (self.at(p, &above, t), self.at(p, &below, t), above[k] - below[k]);
            for (row, (v, w)) in gradient.iter_mut().zip(v.iter().zip(&w)) {
                row[k] = (v - w) / width;
            }
        }
        gradient
    }
}

impl<const D: usize> Velocity<D> for [f64; D] {
    fn steady(&self) -> bool {
        true
    }

    #[inline(always)]
    fn at(&self, _: usize, _: &[f64; D], _: f64) -> [f64; D] {
        *self
    }

    fn gradient(&self, _: usize, _: &[f64; D], _: f64, _: f64) -> [[f64; D]; D] {
        [[0.0; D]; D]
    }
}

impl<const D: usize> Velocity<D> for Vec<[f64; D]> {
    const EVERYWHERE: bool = false;

    fn steady(&self) -> bool {
        true
    }

    fn validate(&self, particles: usize) -> Result<()> {
        one_each(self.len(), particles)
    }

    #[inline(always)]
    fn at(&self, p: usize, _: &[f64; D], _: f64) -> [f64; D] {
        self.get(p).copied().unwrap_or([f64::NAN; D])
    }

    fn gradient(&self, _: usize, _: &[f64; D], _: f64, _: f64) -> [[f64; D]; D] {
        [[f64::NAN; D]; D]
    }
}

impl<F: Fn(&[f64; D], f64) -> [f64; D] + Sync, const D: usize> Velocity<D> for F {
    #[inline(always)]
    fn at(&self, _: usize, x: &[f64; D], t: f64) -> [f64; D] {
        self(x, t)
    }
}

/// A velocity that is a function of x alone: limits that hang on it are computed once.
#[derive(Clone, Copy, Debug)]
pub struct Steady<F>(
    /// The function.
    pub F,
);

impl<F: Fn(&[f64; D]) -> [f64; D] + Sync, const D: usize> Velocity<D> for Steady<F> {
    fn steady(&self) -> bool {
        true
    }

    #[inline(always)]
    fn at(&self, _: usize, x: &[f64; D], _: f64) -> [f64; D] {
        self.0(x)
    }
}

/// The diffusivities of all particles.
///
/// # Errors
/// [`ParticleError::Diffusivity`] naming the first particle where it is negative or not finite.
pub(super) fn diffusivities<const D: usize>(of: &impl Diffusivity<D>, points: &[[f64; D]]) -> Result<Vec<f64>> {
    let mut values = vec![0.0; points.len()];
    renew_diffusivities(of, points, &mut values)?;
    Ok(values)
}

/// The same in the place of others.
pub(super) fn renew_diffusivities<const D: usize>(
    of: &impl Diffusivity<D>,
    points: &[[f64; D]],
    values: &mut [f64],
) -> Result<()> {
    of.validate(points.len())?;
    for ((p, x), value) in points.iter().enumerate().zip(values) {
        let diffusivity = of.at(p, x);
        if !(diffusivity >= 0.0 && diffusivity.is_finite()) {
            return Err(Error::from(ParticleError::Diffusivity { diffusivity }).at(p));
        }
        *value = diffusivity;
    }
    Ok(())
}

fn one_each(found: usize, needed: usize) -> Result<()> {
    if found == needed { Ok(()) } else { Err(ParticleError::Length { found, needed }.into()) }
}
