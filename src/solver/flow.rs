//! The flow that carries particles: dx/dt = v, dV/dt = V div v, and how it distorts a set.

use super::advection::Advection;
use super::coefficient::Velocity;
use super::divergence::FlowDivergence;
use super::limits::{Limits, Rate};
use super::term::Site;
use crate::apply::MatrixFree;
use crate::domain::Domain;
use crate::error::{Error, Limit, Result, SolverError};
use crate::neighbors::Nearest;
use crate::operator::{DcPse, Gradient};

/// What the advection term of a scene is to particles that move. The unit type is rest.
///
/// The scheme of the term is not used. A gradient of v that is needed comes from [`Velocity::gradient`]; where the
/// velocity is only known at the particles, from rows of DC-PSE of order 2 made for that purpose.
pub trait Flow<const D: usize>: Sync {
    /// What is kept of div v between the particles.
    type Values: Default + Send + Sync;

    /// Whether particles move.
    const MOVES: bool;

    /// Whether volumes stay.
    const SOLENOIDAL: bool;

    /// Refuses a velocity that is not there for so many particles.
    ///
    /// # Errors
    /// As [`Velocity::validate`].
    fn validate(&self, particles: usize) -> Result<()>;

    /// The velocity at particle p, which is at x.
    fn at(&self, p: usize, x: &[f64; D], t: f64) -> [f64; D];

    /// Computes the divergence at the places of now, where it is not a function.
    ///
    /// # Errors
    /// As [`FlowDivergence::refresh`].
    fn renew(&self, values: &mut Self::Values, site: &Site<D>, domain: &Domain<D>, t: f64) -> Result<()>;

    /// div v at particle p, which is at x.
    fn divergence(&self, values: &Self::Values, p: usize, x: &[f64; D], t: f64) -> f64;

    /// Adds what bounds the step: dt |grad v|_2 <= `courant`, and div v, which adds to the decay of what diffuses.
    ///
    /// # Errors
    /// Naming a particle where the velocity or its gradient is not finite.
    fn bound(
        &self,
        values: &Self::Values,
        site: &Site<D>,
        domain: &Domain<D>,
        t: f64,
        courant: f64,
        limits: &mut Limits,
    ) -> Result<()>;
}

impl<const D: usize> Flow<D> for () {
    type Values = ();
    const MOVES: bool = false;
    const SOLENOIDAL: bool = true;

    fn validate(&self, _: usize) -> Result<()> {
        Ok(())
    }

    fn at(&self, _: usize, _: &[f64; D], _: f64) -> [f64; D] {
        [0.0; D]
    }

    fn renew(&self, (): &mut (), _: &Site<D>, _: &Domain<D>, _: f64) -> Result<()> {
        Ok(())
    }

    fn divergence(&self, (): &(), _: usize, _: &[f64; D], _: f64) -> f64 {
        0.0
    }

    fn bound(&self, (): &(), _: &Site<D>, _: &Domain<D>, _: f64, _: f64, _: &mut Limits) -> Result<()> {
        Ok(())
    }
}

impl<V: Velocity<D>, X: Sync, W: FlowDivergence<D>, const D: usize> Flow<D> for Advection<V, X, W> {
    type Values = W::Values;
    const MOVES: bool = true;
    const SOLENOIDAL: bool = W::ZERO;

    fn validate(&self, particles: usize) -> Result<()> {
        self.velocity.validate(particles)
    }

    #[inline(always)]
    fn at(&self, p: usize, x: &[f64; D], t: f64) -> [f64; D] {
        self.velocity.at(p, x, t)
    }

    fn renew(&self, values: &mut W::Values, site: &Site<D>, domain: &Domain<D>, t: f64) -> Result<()> {
        if W::APPLIES == 0 {
            return Ok(());
        }
        let gradients = Gradients::new(&self.velocity, site, domain, t)?;
        let trace = |p: usize, _: &[[f64; D]]| {
            let gradient = gradients.at(p)?;
            Some((0..D).map(|k| gradient[k][k]).sum())
        };
        self.divergence.refresh(values, site, t, &self.velocity, true, trace)
    }

    #[inline(always)]
    fn divergence(&self, values: &W::Values, p: usize, x: &[f64; D], t: f64) -> f64 {
        self.divergence.at(values, p, x, t).unwrap_or(0.0)
    }

    fn bound(
        &self,
        values: &W::Values,
        site: &Site<D>,
        domain: &Domain<D>,
        t: f64,
        courant: f64,
        limits: &mut Limits,
    ) -> Result<()> {
        let (mut distortion, mut compression) = ((0.0, None), (0.0, None));
        let gradients = Gradients::new(&self.velocity, site, domain, t)?;
        for (p, x) in site.points().iter().enumerate() {
            let v = self.velocity.at(p, x, t);
            if let Some(axis) = v.iter().position(|v| !v.is_finite()) {
                return Err(Error::from(SolverError::Velocity { axis, value: v[axis], t }).at(p));
            }
            let value = gradients.at(p).map_or(f64::NAN, largest_singular_value);
            if !value.is_finite() {
                return Err(Error::from(SolverError::VelocityGradient { value, t }).at(p));
            }
            let divergence = Flow::<D>::divergence(self, values, p, x, t);
            if !divergence.is_finite() {
                return Err(Error::from(SolverError::Divergence { value: divergence, t }).at(p));
            }
            if value > distortion.0 {
                distortion = (value, Some(p));
            }
            if divergence > compression.0 {
                compression = (divergence, Some(p));
            }
        }
        limits.add_of(Limit::Distortion, Rate::frequency(distortion.0 / courant), distortion.1);
        limits.add_of(Limit::Compression, Rate::decay(compression.0), compression.1);
        Ok(())
    }
}

/// grad v at the particles of a moment: asked for one by one, or made from the velocities of all.
struct Gradients<'a, V, const D: usize> {
    velocity: &'a V,
    site: &'a Site<D>,
    t: f64,
    made: Vec<[[f64; D]; D]>,
}

impl<'a, V: Velocity<D>, const D: usize> Gradients<'a, V, D> {
    fn new(velocity: &'a V, site: &'a Site<D>, domain: &Domain<D>, t: f64) -> Result<Self> {
        let mut gradients = Self { velocity, site, t, made: Vec::new() };
        if V::EVERYWHERE || site.points().is_empty() {
            return Ok(gradients);
        }
        let method = DcPse::<Gradient<D>, 2>::new();
        // An image has the normal velocity of its particle turned; rows of one side need none.
        let nearest = Nearest::build(site.particles(), &domain.without_mirrors(), method.fewest_neighbors()?)?;
        let rows = MatrixFree::new(&method, &nearest)?;
        let points = site.points();
        let mut made = vec![[[0.0; D]; D]; points.len()];
        let mut out = vec![[0.0; D]; points.len()];
        for j in 0..D {
            let component: Vec<f64> = points.iter().enumerate().map(|(p, x)| velocity.at(p, x, t)[j]).collect();
            rows.apply_all(&component, &mut out)?;
            made.iter_mut().zip(&out).for_each(|(made, out)| made[j] = *out);
        }
        gradients.made = made;
        Ok(gradients)
    }

    fn at(&self, p: usize) -> Option<[[f64; D]; D]> {
        if let Some(made) = self.made.get(p) {
            return Some(*made);
        }
        let x = self.site.points().get(p)?;
        let magnitude = x.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        let volume = self.site.particles().volumes().ok()?.get(p).ok()?;
        // The error of a central difference, step^2 and eps/step, is least here.
        let step = f64::EPSILON.cbrt() * (magnitude + volume.powf(1.0 / D as f64));
        Some(self.velocity.gradient(p, x, self.t, step))
    }
}

/// |A|_2: the columns are rotated until they are orthogonal to each other (one-sided Jacobi); then it is the longest.
fn largest_singular_value<const D: usize>(mut a: [[f64; D]; D]) -> f64 {
    /// Sweeps: convergence is quadratic, and 6 serve for any matrix of this size.
    const SWEEPS: usize = 12;
    let size = a.iter().flatten().map(|x| x.abs()).fold(0.0, f64::max);
    if size == 0.0 || !size.is_finite() {
        return a.iter().flatten().map(|x| x.abs()).sum();
    }
    // Squares of any scale: a power of 2 rounds nothing.
    let unit = size.log2().floor().min(1023.0).exp2();
    a.iter_mut().flatten().for_each(|x| *x /= unit);
    let column = |a: &[[f64; D]; D], i: usize, j: usize| a.iter().map(|row| row[i] * row[j]).sum::<f64>();
    for _ in 0..SWEEPS {
        let mut rotated = false;
        for i in 0..D {
            for j in i + 1..D {
                let (ii, jj, ij) = (column(&a, i, i), column(&a, j, j), column(&a, i, j));
                if !(ij.abs() > f64::EPSILON * (ii * jj).sqrt()) {
                    continue;
                }
                rotated = true;
                let zeta = (jj - ii) / (2.0 * ij);
                let tangent = zeta.signum() / (zeta.abs() + (1.0 + zeta * zeta).sqrt());
                let cosine = 1.0 / (1.0 + tangent * tangent).sqrt();
                for row in &mut a {
                    let (x, y) = (row[i], row[j]);
                    (row[i], row[j]) = (cosine * (x - tangent * y), cosine * (tangent * x + y));
                }
            }
        }
        if !rotated {
            break;
        }
    }
    let square = (0..D).map(|i| column(&a, i, i)).fold(0.0, |most: f64, square| {
        // A plain maximum would pass over what is not a number.
        if square.is_nan() || most.is_nan() { f64::NAN } else { most.max(square) }
    });
    unit * square.sqrt()
}

#[cfg(test)]
mod tests {
    use super::largest_singular_value;

    #[test]
    fn largest_singular_value_is_the_induced_norm() {
        // Rotation, shear and the matrix of errata 37, whose largest entry is half its norm.
        assert!((largest_singular_value([[0.0, -3.0], [3.0, 0.0]]) - 3.0).abs() <= 4.0 * f64::EPSILON);
        let golden = (1.0 + 5.0_f64.sqrt()) / 2.0;
        assert!((largest_singular_value([[1.0, 1.0], [0.0, 1.0]]) - golden).abs() <= 8.0 * f64::EPSILON);
        assert!((largest_singular_value([[-1.0; 2]; 2]) - 2.0).abs() <= 8.0 * f64::EPSILON);
        assert!((largest_singular_value([[1.0; 3]; 3]) - 3.0).abs() <= 16.0 * f64::EPSILON);
        assert_eq!(largest_singular_value([[0.0; 3]; 3]), 0.0);
        for unit in [f64::from_bits(1), f64::MIN_POSITIVE, 1e-200, 1e200, 1e308] {
            let norm = largest_singular_value([[unit, unit], [0.0, unit]]);
            assert!(
                (norm / unit - golden).abs() <= 8.0 * f64::EPSILON.max(f64::from_bits(1) / unit),
                "{unit:e}: {norm:e}"
            );
        }
        assert_eq!(largest_singular_value([[f64::MAX, 0.0], [0.0, 0.0]]), f64::MAX);
        let beyond = [f64::NAN, f64::INFINITY]
            .map(|x| [largest_singular_value([[x, 0.0], [0.0, 1.0]]), largest_singular_value([[x; 2]; 2])]);
        assert!(beyond.as_flattened().iter().all(|norm| !norm.is_finite()), "{beyond:?}");
    }
}
