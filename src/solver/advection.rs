//! -div(v u): a velocity, a scheme for v . grad u, and what is known of div v.

use super::coefficient::Velocity;
use super::divergence::FlowDivergence;
use super::fields::Fields;
use super::limits::{Limits, Rate};
use super::term::{SceneTerm, Site};
use super::transport::Transport;
use crate::apply::Report;
use crate::error::{Error, Limit, Result, SolverError};
use crate::neighbors::Neighbors;
use crate::scalar::Scalar;

/// The term -div(v u) = -v . grad u - u div v of a scene.
///
/// `X` is the scheme for v . grad u, `W` what is known of div v: nothing said means zero.
#[derive(Clone, Debug)]
pub struct Advection<V, X, W = ()> {
    pub(super) velocity: V,
    pub(super) scheme: X,
    pub(super) divergence: W,
}

/// The rows of an advection term.
#[derive(Clone, Debug)]
pub struct AdvectionRows<R, W> {
    rows: R,
    divergence: W,
    /// The rates, where the velocity is steady.
    rate: Option<Rate>,
}

impl<V, X, W> Advection<V, X, W> {
    /// The velocity.
    pub fn velocity(&self) -> &V {
        &self.velocity
    }

    /// The scheme for v . grad u.
    pub fn scheme(&self) -> &X {
        &self.scheme
    }

    /// What is known of div v.
    pub fn divergence(&self) -> &W {
        &self.divergence
    }
}

impl<V: Velocity<D>, X: Transport<D>, W: FlowDivergence<D>, const D: usize, E: Fields> SceneTerm<D, E>
    for Advection<V, X, W>
{
    type Rows = AdvectionRows<X::Rows<E>, W::Values>;
    const APPLIES: usize = X::APPLIES + W::APPLIES;

    fn build<P: Neighbors<D>>(&self, site: &Site<D>, neighbors: &P) -> Result<Self::Rows> {
        self.velocity.validate(site.points().len())?;
        let points = site.points();
        let flow = |p: usize| self.velocity.at(p, &points[p], 0.0);
        let rows = self.scheme.build(site, flow, self.velocity.steady(), neighbors)?;
        let mut built = AdvectionRows { rows, divergence: W::Values::default(), rate: None };
        if self.velocity.steady() {
            self.refresh_divergence::<D, E>(&mut built, site, 0.0, true)?;
            built.rate = Some(self.fastest::<D, E>(&built.rows, site, 0.0)?);
        }
        Ok(built)
    }

    fn refresh(&self, built: &mut Self::Rows, site: &Site<D>, t: f64, u: &[E]) -> Result<()> {
        self.scheme.refresh(&mut built.rows, u);
        self.refresh_divergence::<D, E>(built, site, t, false)
    }

    #[inline(always)]
    fn rate(&self, built: &Self::Rows, p: usize, x: &[f64; D], t: f64, u: &[E], rate: E) -> E {
        let v = self.velocity.at(p, x, t);
        let rate = rate.plus(-1.0, self.scheme.along(&built.rows, p, &v, u));
        match self.divergence.at(&built.divergence, p, x, t) {
            Some(divergence) => rate.plus_product(E::Scalar::lift(-divergence), u[p]),
            None => rate,
        }
    }

    fn limit(&self, built: &mut Self::Rows, site: &Site<D>, t: f64, _: &[E], limits: &mut Limits) -> Result<()> {
        self.refresh_divergence::<D, E>(built, site, t, false)?;
        limits.add(
            Limit::Advection,
            match built.rate {
                Some(rate) => rate,
                None => self.fastest::<D, E>(&built.rows, site, t)?,
            },
        );
        let mut compression = 0.0_f64;
        if !W::ZERO {
            for (p, x) in site.free() {
                let value = self.divergence.at(&built.divergence, p, x, t).unwrap_or(0.0);
                if !value.is_finite() {
                    return Err(Error::from(SolverError::Divergence { value, t }).at(p));
                }
                compression = compression.max(value);
            }
        }
        limits.add(Limit::Compression, Rate::decay(compression));
        Ok(())
    }

    fn entries(&self, built: &Self::Rows, p: usize, x: &[f64; D], t: f64, entry: &mut dyn FnMut(usize, f64)) {
        let v = self.velocity.at(p, x, t);
        self.scheme.entries(&built.rows, p, &v, &mut |q, w| entry(q, -w));
        if let Some(divergence) = self.divergence.at(&built.divergence, p, x, t) {
            entry(p, -divergence);
        }
    }

    fn report<'a>(&self, built: &'a Self::Rows) -> Option<&'a Report> {
        Some(self.scheme.report(&built.rows))
    }

    fn velocity(&self, p: usize, x: &[f64; D], t: f64) -> Option<[f64; D]> {
        Some(self.velocity.at(p, x, t))
    }

    fn steady(&self) -> bool {
        self.velocity.steady()
    }
}

impl<V, X, W> Advection<V, X, W> {
    fn refresh_divergence<const D: usize, E: Fields>(
        &self,
        built: &mut AdvectionRows<X::Rows<E>, W::Values>,
        site: &Site<D>,
        t: f64,
        first: bool,
    ) -> Result<()>
    where
        V: Velocity<D>,
        X: Transport<D>,
        W: FlowDivergence<D>,
    {
        let AdvectionRows { rows, divergence, .. } = built;
        let of = |p: usize, v: &[[f64; D]]| self.scheme.divergence::<E>(rows, p, v);
        self.divergence.refresh(divergence, site, t, &self.velocity, first, of)
    }

    /// The largest rates over all free particles.
    fn fastest<const D: usize, E: Fields>(&self, rows: &X::Rows<E>, site: &Site<D>, t: f64) -> Result<Rate>
    where
        V: Velocity<D>,
        X: Transport<D>,
    {
        let mut fastest = Rate::default();
        for (p, x) in site.free() {
            let v = self.velocity.at(p, x, t);
            if let Some(axis) = v.iter().position(|v| !v.is_finite()) {
                return Err(Error::from(SolverError::Velocity { axis, value: v[axis], t }).at(p));
            }
            fastest = fastest.larger(self.scheme.rate(rows, &v));
        }
        Ok(fastest)
    }
}
