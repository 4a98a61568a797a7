//! The three lengths this field confuses, kept apart, and the volumes of the particles.

use std::sync::Arc;

use crate::error::{OperatorError, ParticleError, Result};

/// A cutoff radius r_c, a length.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct Cutoff(pub f64);

/// A particle spacing h, a length.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct Spacing(pub f64);

impl Spacing {
    /// The global smoothing length epsilon = `ratio` * h.
    ///
    /// # Errors
    /// [`ParticleError::Epsilon`] where the product is not positive and finite.
    pub fn epsilon(self, ratio: f64) -> Result<Epsilon> {
        Epsilon::global(self.0 * ratio)
    }
}

/// The smoothing length epsilon: one value, or one per particle. Clones share the values.
///
/// ```
/// use parops::Epsilon;
/// let epsilon = Epsilon::global(0.1)?;
/// assert_eq!(epsilon.cutoff(8.0).0, 0.8);
/// # parops::Result::Ok(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Epsilon(PerParticle);

impl Epsilon {
    /// One epsilon for all particles.
    ///
    /// # Errors
    /// [`ParticleError::Epsilon`] where it is not positive and finite.
    pub fn global(epsilon: f64) -> Result<Self> {
        legal_epsilon(epsilon)?;
        Ok(Self(PerParticle::Equal(epsilon)))
    }

    /// One epsilon per target.
    ///
    /// # Errors
    /// [`ParticleError::Epsilon`] naming the first particle whose epsilon is not positive and finite.
    pub fn each(epsilon: Vec<f64>) -> Result<Self> {
        for (p, &e) in epsilon.iter().enumerate() {
            legal_epsilon(e).map_err(|error| error.at(p))?;
        }
        Ok(Self(PerParticle::Each(epsilon.into())))
    }

    /// Epsilon of particle p.
    ///
    /// # Errors
    /// [`OperatorError::Length`] where one epsilon per particle is held and p is beyond them.
    #[inline]
    pub fn get(&self, p: usize) -> Result<f64> {
        self.0.get(p)
    }

    /// How many epsilons are held, or `None` where one value serves any number.
    pub fn len(&self) -> Option<usize> {
        self.0.len()
    }

    /// Whether epsilons are held one per particle, for no particle.
    pub fn is_empty(&self) -> bool {
        self.len() == Some(0)
    }

    /// The largest epsilon times `radius`: the cutoff a provider must be built with so that a kernel of this
    /// support radius (in units of epsilon) is not truncated. Zero for no particles.
    pub fn cutoff(&self, radius: f64) -> Cutoff {
        Cutoff(self.0.range().1 * radius)
    }

    /// Smallest and largest epsilon; (0, 0) for no particles.
    pub fn range(&self) -> (f64, f64) {
        self.0.range()
    }
}

fn legal_epsilon(epsilon: f64) -> Result<()> {
    if epsilon > 0.0 && epsilon.is_finite() { Ok(()) } else { Err(ParticleError::Epsilon { epsilon }.into()) }
}

/// The volumes V_p of the particles, in units of length^D: one value, or one per particle. Clones share the values.
#[derive(Clone, Debug, PartialEq)]
pub struct Volumes(PerParticle);

impl Volumes {
    /// All volumes equal; a lattice has V = h^D.
    ///
    /// # Errors
    /// [`ParticleError::Volume`] where it is not positive and finite.
    pub fn equal(volume: f64) -> Result<Self> {
        legal_volume(volume)?;
        Ok(Self(PerParticle::Equal(volume)))
    }

    /// One volume per particle.
    ///
    /// # Errors
    /// [`ParticleError::Volume`] naming the first particle whose volume is not positive and finite.
    pub fn each(volumes: Vec<f64>) -> Result<Self> {
        let mut held = Self(PerParticle::Equal(1.0));
        held.renew(&volumes)?;
        Ok(held)
    }

    /// The same in the place of these, which stay as they are on an error; allocates only where clones share the values.
    pub(crate) fn renew(&mut self, volumes: &[f64]) -> Result<()> {
        volumes.iter().enumerate().try_for_each(|(p, &v)| legal_volume(v).map_err(|error| error.at(p)))?;
        let own = match &mut self.0 {
            PerParticle::Each(held) => Arc::get_mut(held).filter(|held| held.len() == volumes.len()),
            PerParticle::Equal(_) => None,
        };
        match own {
            Some(held) => held.copy_from_slice(volumes),
            None => self.0 = PerParticle::Each(volumes.into()),
        }
        Ok(())
    }

    /// Volume of particle p.
    ///
    /// # Errors
    /// [`OperatorError::Length`] where one volume per particle is held and p is beyond them.
    #[inline]
    pub fn get(&self, p: usize) -> Result<f64> {
        self.0.get(p)
    }

    /// The single value where all are equal.
    pub fn common(&self) -> Option<f64> {
        match &self.0 {
            PerParticle::Equal(value) => Some(*value),
            PerParticle::Each(_) => None,
        }
    }

    /// How many volumes are held, or `None` where one value serves any number.
    pub fn len(&self) -> Option<usize> {
        self.0.len()
    }

    /// Whether volumes are held one per particle, for no particle.
    pub fn is_empty(&self) -> bool {
        self.len() == Some(0)
    }
}

fn legal_volume(volume: f64) -> Result<()> {
    if volume > 0.0 && volume.is_finite() { Ok(()) } else { Err(ParticleError::Volume { volume }.into()) }
}

#[derive(Clone, Debug, PartialEq)]
enum PerParticle {
    Equal(f64),
    Each(Arc<[f64]>),
}

impl PerParticle {
    #[inline]
    fn get(&self, p: usize) -> Result<f64> {
        match self {
            Self::Equal(value) => Ok(*value),
            Self::Each(values) => {
                values.get(p).copied().ok_or_else(|| OperatorError::Length { found: values.len(), index: p }.into())
            }
        }
    }

    fn len(&self) -> Option<usize> {
        match self {
            Self::Equal(_) => None,
            Self::Each(values) => Some(values.len()),
        }
    }

    fn range(&self) -> (f64, f64) {
        match self {
            Self::Equal(value) => (*value, *value),
            Self::Each(values) if values.is_empty() => (0.0, 0.0),
            Self::Each(values) => values.iter().fold((f64::INFINITY, 0.0), |(low, high), &v| (v.min(low), v.max(high))),
        }
    }
}
