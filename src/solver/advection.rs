//! -div(v u): a velocity, a scheme for v . grad u, and what is known of div v.

use super::coefficient::Velocity;
use super::divergence::FlowDivergence;
use super::fields::Fields;
use super::limits::{Limits, Rate};
use super::term::{SceneTerm, Site};
use super::transport::{Transport, TransportRows};
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
    /// The rates of the scheme and of its hyperviscosity, where the velocity is steady.
    rates: Option<[Rate; 2]>,
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
        let rows = self.scheme.build(site, flow, self.velocity.steady(), W::ZERO, neighbors)?;
        let divergence = self.divergence.build(&self.scheme, site, neighbors)?;
        let mut built = AdvectionRows { rows, divergence, rates: None };
        if self.velocity.steady() {
            self.refresh_divergence::<D, E>(&mut built, site, 0.0, true)?;
            built.rates = Some(self.fastest::<D, E>(&built.rows, site, 0.0)?);
        }
        Ok(built)
    }

    fn refresh(&self, built: &mut Self::Rows, site: &Site<D>, t: f64, u: &[E]) -> Result<()> {
        built.rows.refresh(u);
        self.refresh_divergence::<D, E>(built, site, t, false)
    }

    #[inline(always)]
    fn rate(&self, built: &Self::Rows, p: usize, x: &[f64; D], t: f64, u: &[E], rate: E) -> E {
        let v = self.velocity.at(p, x, t);
        let rate = rate.plus(-1.0, built.rows.along(p, &v, u));
        match self.divergence.at(&built.divergence, p, x, t) {
            Some(divergence) => rate.plus_product(E::Scalar::lift(-divergence), u[p]),
            None => rate,
        }
    }

    fn limit(&self, built: &mut Self::Rows, site: &Site<D>, t: f64, _: &[E], limits: &mut Limits) -> Result<()> {
        self.refresh_divergence::<D, E>(built, site, t, false)?;
        let [advection, hyperviscosity] = match built.rates {
            Some(rates) => rates,
            None => self.fastest::<D, E>(&built.rows, site, t)?,
        };
        limits.add(Limit::Advection, advection);
        limits.add(Limit::Hyperviscosity, hyperviscosity);
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
        built.rows.entries(p, &v, &mut |q, w| entry(q, -w));
        if let Some(divergence) = self.divergence.at(&built.divergence, p, x, t) {
            entry(p, -divergence);
        }
    }

    fn report<'a>(&self, built: &'a Self::Rows) -> Option<&'a Report> {
        Some(built.rows.report())
    }

    fn monotone(&self, built: &Self::Rows) -> bool {
        W::ZERO && built.rows.monotone()
    }

    fn velocity(&self, p: usize, x: &[f64; D], t: f64) -> Option<[f64; D]> {
        Some(self.velocity.at(p, x, t))
    }

    fn viscosity(&self, p: usize, x: &[f64; D], t: f64) -> f64 {
        self.scheme.viscosity(p, &self.velocity.at(p, x, t))
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
        let of = |p: usize, v: &[[f64; D]]| rows.divergence(p, v);
        self.divergence.refresh(divergence, site, t, &self.velocity, first, of)
    }

    /// The largest rates over all free particles.
    fn fastest<const D: usize, E: Fields>(&self, rows: &X::Rows<E>, site: &Site<D>, t: f64) -> Result<[Rate; 2]>
    where
        V: Velocity<D>,
        X: Transport<D>,
    {
        let [mut advection, mut hyperviscosity] = [Rate::default(); 2];
        for (p, x) in site.free() {
            let v = self.velocity.at(p, x, t);
            if let Some(axis) = v.iter().position(|v| !v.is_finite()) {
                return Err(Error::from(SolverError::Velocity { axis, value: v[axis], t }).at(p));
            }
            match rows.rate(p, &v) {
                Ok(rate) => advection = advection.larger(rate),
                // No row is needed where a value is given at this moment.
                Err(_) if site.comes_in(p, &v) => continue,
                Err(error) => return Err(error.at(p)),
            }
            hyperviscosity = hyperviscosity.larger(rows.hyperviscosity(p, &v));
        }
        Ok([advection, hyperviscosity])
    }
}
