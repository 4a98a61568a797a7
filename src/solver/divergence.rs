//! What is known of div v.

use super::coefficient::Velocity;
use super::term::Site;
use super::transport::Transport;
use crate::apply::Rows;
use crate::error::{Error, Result, SolverError};
use crate::neighbors::{Neighbors, Reflected};

/// What a scene knows of div v. The unit type says that it is zero.
pub trait FlowDivergence<const D: usize>: Sync {
    /// What is kept a particle; nothing where the divergence is zero or a function.
    type Values: Default + Send + Sync;

    /// Whether it is zero everywhere.
    const ZERO: bool;

    /// Sweeps over stored rows a stage.
    const APPLIES: usize;

    /// Makes what is kept.
    ///
    /// # Errors
    /// As [`Transport::gradient`]; [`SolverError::UnknownImage`] where a provider has images and does not say of which domain.
    fn build<X: Transport<D>, P: Neighbors<D>>(
        &self,
        scheme: &X,
        site: &Site<D>,
        neighbors: &P,
    ) -> Result<Self::Values> {
        let _ = (scheme, site, neighbors);
        Ok(Self::Values::default())
    }

    /// Computes it anew at time t, where that takes the velocity of all particles; `first` before the first step of a
    /// steady flow. `of(p, v)` is the divergence of the velocities v at particle p by the rows of the scheme.
    ///
    /// # Errors
    /// [`SolverError::Divergence`] naming the particle where it is not finite; [`SolverError::NoDivergence`] where the scheme
    /// has no rows for it; [`SolverError::CrossesMirror`] naming a particle beside a mirror that the flow crosses.
    fn refresh(
        &self,
        values: &mut Self::Values,
        site: &Site<D>,
        t: f64,
        velocity: &impl Velocity<D>,
        first: bool,
        of: impl Fn(usize, &[[f64; D]]) -> Option<f64>,
    ) -> Result<()> {
        let _ = (values, site, t, velocity, first, of);
        Ok(())
    }

    /// div v at particle p, which is at x; `None` where it is zero everywhere.
    fn at(&self, values: &Self::Values, p: usize, x: &[f64; D], t: f64) -> Option<f64>;
}

impl<const D: usize> FlowDivergence<D> for () {
    type Values = ();
    const ZERO: bool = true;
    const APPLIES: usize = 0;

    #[inline(always)]
    fn at(&self, (): &(), _: usize, _: &[f64; D], _: f64) -> Option<f64> {
        None
    }
}

/// div v as a function of x and t.
#[derive(Clone, Copy, Debug)]
pub struct GivenDivergence<F>(pub(super) F);

impl<F: Fn(&[f64; D], f64) -> f64 + Sync, const D: usize> FlowDivergence<D> for GivenDivergence<F> {
    type Values = ();
    const ZERO: bool = false;
    const APPLIES: usize = 0;

    #[inline(always)]
    fn at(&self, (): &(), _: usize, x: &[f64; D], t: f64) -> Option<f64> {
        Some(self.0(x, t))
    }
}

/// div v by the central rows of the scheme, sum_k sum_q w_k,pq (v_k,q - v_k,p): once for a steady velocity, otherwise
/// every stage.
///
/// Behind a mirror the normal component of the velocity is turned and the others are not, whatever the sign of u there: the
/// flow must not cross a mirror. Of a velocity that is known between the particles this is checked. Rows of the particles
/// beside mirrors are kept for it, D + 1 for each, until the divergence of a steady velocity is known.
#[derive(Clone, Copy, Debug, Default)]
pub struct ComputedDivergence;

/// Velocities and their divergence, particle by particle.
#[derive(Clone, Debug, Default)]
pub struct DivergenceValues<const D: usize> {
    velocity: Vec<[f64; D]>,
    divergence: Vec<f64>,
    walls: Option<Walls<D>>,
}

/// What the divergence beside mirrors is computed with.
#[derive(Clone, Debug)]
struct Walls<const D: usize> {
    /// Particle, axis and place of every mirror within reach of a free particle, in the order of the particles.
    beside: Vec<(usize, usize, f64)>,
    /// The gradient of a field that mirrors of axis k turn, at those particles; none where the scheme has no such rows.
    turned: Vec<Rows<[f64; D]>>,
    /// The gradient of a field that no mirror turns.
    plain: Option<Rows<[f64; D]>>,
}

/// How much of the largest speed may stand normal to a mirror: rounding of velocities that are evaluated in `f32`.
const CROSSING: f64 = 8.0 * f32::EPSILON as f64;

impl<const D: usize> Walls<D> {
    fn build<X: Transport<D>, P: Neighbors<D>>(scheme: &X, site: &Site<D>, neighbors: &P) -> Result<Option<Self>> {
        let (points, reach) = (site.points(), neighbors.reach());
        let Some(domain) = neighbors.domain() else {
            return check_images(site, neighbors).map(|()| None);
        };
        let mirrors = || (0..D).flat_map(|axis| domain.mirrors(axis).map(move |place| (axis, place)));
        let seen = Reflected::new(neighbors, points, None, &[]);
        let (mut beside, mut far) = (Vec::new(), vec![true; points.len()]);
        for (p, x) in site.free() {
            if !mirrors().any(|(axis, place)| (x[axis] - place).abs() <= reach) {
                continue;
            }
            let before = beside.len();
            neighbors.for_each(p, reach, |neighbor| {
                for axis in 0..D {
                    if let Some(place) = seen.mirror(p, axis, &neighbor)
                        && !beside[before..].contains(&(p, axis, place))
                    {
                        beside.push((p, axis, place));
                    }
                }
            });
            far[p] = beside.len() == before;
        }
        if beside.is_empty() {
            return Ok(None);
        }
        let mut near = site.clone();
        near.prescribe((0..points.len()).filter(|&p| far[p]));
        let rows = |axis| scheme.gradient(&near, &Reflected::new(neighbors, points, axis, &far));
        let plain = rows(None)?;
        let mut turned = Vec::new();
        for axis in 0..D {
            turned.extend(rows(Some(axis))?);
        }
        Ok(Some(Self { beside, turned, plain }))
    }

    /// div v at a particle beside a mirror: only what the turned rows have on the diagonal beyond the others stands for
    /// images, so that constants along a wall have none.
    fn divergence(&self, p: usize, v: &[[f64; D]]) -> Option<f64> {
        let (own, of_constants) = (v.get(p)?, self.plain.as_ref()?.pairs(p).0.unwrap_or([0.0; D]));
        let mut sum = 0.0;
        for (axis, rows) in self.turned.iter().enumerate() {
            let (diagonal, pairs) = rows.pairs(p);
            sum += (diagonal.map_or(0.0, |d| d[axis]) - of_constants[axis]) * own[axis];
            for (q, w) in pairs {
                sum += w[axis] * (v.get(q)?[axis] - own[axis]);
            }
        }
        Some(sum)
    }
}

impl<const D: usize> FlowDivergence<D> for ComputedDivergence {
    type Values = DivergenceValues<D>;
    const ZERO: bool = false;
    const APPLIES: usize = 1;

    fn build<X: Transport<D>, P: Neighbors<D>>(
        &self,
        scheme: &X,
        site: &Site<D>,
        neighbors: &P,
    ) -> Result<DivergenceValues<D>> {
        Ok(DivergenceValues { walls: Walls::build(scheme, site, neighbors)?, ..Default::default() })
    }

    fn refresh(
        &self,
        values: &mut DivergenceValues<D>,
        site: &Site<D>,
        t: f64,
        velocity: &impl Velocity<D>,
        first: bool,
        of: impl Fn(usize, &[[f64; D]]) -> Option<f64>,
    ) -> Result<()> {
        if velocity.steady() && !first {
            return Ok(());
        }
        let points = site.points();
        let DivergenceValues { velocity: v, divergence, walls } = values;
        v.clear();
        v.extend(points.iter().enumerate().map(|(p, x)| velocity.at(p, x, t)));
        let beside = walls.as_ref().map_or(&[][..], |walls| &walls.beside);
        check_crossing(beside, points, v, t, velocity)?;
        let mut beside = beside.iter().map(|&(p, ..)| p).peekable();
        divergence.clear();
        for p in 0..points.len() {
            let wall = beside.next_if_eq(&p).and(walls.as_ref());
            while beside.next_if_eq(&p).is_some() {}
            let value = match wall {
                _ if site.prescribed(p) => Some(0.0),
                Some(walls) => walls.divergence(p, v),
                None => of(p, v),
            };
            let value = value.ok_or_else(|| Error::from(SolverError::NoDivergence { t }).at(p))?;
            if !value.is_finite() {
                return Err(Error::from(SolverError::Divergence { value, t }).at(p));
            }
            divergence.push(value);
        }
        if velocity.steady() {
            *walls = None;
        }
        Ok(())
    }

    #[inline(always)]
    fn at(&self, values: &DivergenceValues<D>, p: usize, _: &[f64; D], _: f64) -> Option<f64> {
        values.divergence.get(p).copied()
    }
}

/// Refuses images of which the provider does not say what turns in them.
fn check_images<const D: usize, P: Neighbors<D>>(site: &Site<D>, neighbors: &P) -> Result<()> {
    /// Of the reach: what rounding may leave between a separation and the difference of the places.
    const ROUNDING: f64 = 1e-9;
    let points = site.points();
    for (p, x) in site.free() {
        let mut image = None;
        neighbors.for_each(p, neighbors.reach(), |neighbor| {
            let own = points.get(neighbor.q).is_some_and(|y| {
                (0..D)
                    .all(|axis| (neighbor.separation[axis] - (x[axis] - y[axis])).abs() <= ROUNDING * neighbors.reach())
            });
            if !own || neighbor.sign < 0 {
                image = Some(neighbor.q);
            }
        });
        if let Some(q) = image {
            return Err(Error::from(SolverError::UnknownImage { q }).at(p));
        }
    }
    Ok(())
}

/// Refuses a flow across mirrors; at a velocity that is known only at the particles it cannot be looked at.
fn check_crossing<const D: usize>(
    beside: &[(usize, usize, f64)],
    points: &[[f64; D]],
    v: &[[f64; D]],
    t: f64,
    velocity: &impl Velocity<D>,
) -> Result<()> {
    fn everywhere<const D: usize, V: Velocity<D>>(_: &V) -> bool {
        V::EVERYWHERE
    }
    if beside.is_empty() || !everywhere(velocity) {
        return Ok(());
    }
    let largest = v.iter().flatten().fold(0.0_f64, |largest, v| largest.max(v.abs()));
    for &(p, axis, place) in beside {
        let mut foot = points[p];
        foot[axis] = place;
        let value = velocity.at(p, &foot, t)[axis];
        if !(value.abs() <= CROSSING * largest) {
            return Err(Error::from(SolverError::CrossesMirror { axis, value, t }).at(p));
        }
    }
    Ok(())
}
