//! S(x, t, u).

use super::fields::Fields;
use super::limits::{Limits, Rate};
use super::term::{SceneTerm, Site};
use crate::apply::Report;
use crate::error::{Limit, Result, SolverError, TimeError};
use crate::neighbors::Neighbors;

/// The source term S(x, t, u) of a scene, a function of the place, the time and all fields there.
#[derive(Clone, Copy, Debug)]
pub struct Source<F>(pub(super) F);

impl<F> Source<F> {
    /// The function.
    pub fn function(&self) -> &F {
        &self.0
    }
}

impl<F: Fn(&[f64; D], f64, E) -> E + Sync, const D: usize, E: Fields> SceneTerm<D, E> for Source<F> {
    type Rows = ();
    const APPLIES: usize = 0;

    fn build<P: Neighbors<D>>(&self, _: &Site<D>, _: &P) -> Result<()> {
        Ok(())
    }

    #[inline(always)]
    fn rate(&self, (): &(), p: usize, x: &[f64; D], t: f64, u: &[E], rate: E) -> E {
        rate.plus(1.0, self.0(x, t, u[p]))
    }

    fn limit(&self, (): &mut (), site: &Site<D>, t: f64, u: &[E], limits: &mut Limits) -> Result<()> {
        let (mut fastest, scale) = ((0.0, None), difference(u));
        for (p, x) in site.free() {
            let Some(&u) = u.get(p) else { break };
            let decay = decay(&self.0, x, t, u, scale).map_err(|error| error.at(p))?;
            if decay > fastest.0 {
                fastest = (decay, Some(p));
            }
        }
        let rate = if E::FIELDS == 1 { Rate::decay(fastest.0) } else { Rate::modulus(fastest.0) };
        limits.add_of(Limit::Source, rate, fastest.1);
        Ok(())
    }

    fn entries(&self, (): &(), _: usize, _: &[f64; D], _: f64, _: &mut dyn FnMut(usize, f64)) {}

    fn report<'a>(&self, (): &'a ()) -> Option<&'a Report> {
        None
    }
}

/// How many limits long a legal step may be. Rates of a source come from difference quotients, whose rounding differs from
/// field to field: a step at the limit of one moment shall be legal at the next.
pub(super) fn slack<const D: usize, E: Fields, S: SceneTerm<D, E>>() -> f64 {
    if S::PRESENT { 1.0 + ROUNDINGS * E::EPSILON.sqrt() } else { 1.0 }
}

/// Of a difference quotient, in sqrt(eps) of the rates of all terms together.
const ROUNDINGS: f64 = 16.0;

/// How fast S makes fields decay at one particle, from difference quotients: -dS/du of one field; of several the largest
/// row sum of |dS_i/du_j|, which bounds the modulus of all eigenvalues. Growth of a single field is physical and binds
/// nothing.
fn decay<const D: usize, E: Fields>(
    source: &impl Fn(&[f64; D], f64, E) -> E,
    x: &[f64; D],
    t: f64,
    u: E,
    scale: E,
) -> Result<f64> {
    let base = source(x, t, u);
    if !base.finite() {
        // What the first stage would find.
        return Err(TimeError::NotFinite { stage: 1, t }.into());
    }
    let mut sums = 0.0_f64;
    for i in 0..E::FIELDS {
        let mut sum = 0.0;
        for j in 0..E::FIELDS {
            let quotient = |scale: f64| {
                let mut moved = u;
                moved.set(j, u.get(j) + scale);
                let change = source(x, t, moved).get(i) - base.get(i);
                (change, change / (moved.get(j) - u.get(j)))
            };
            let root = E::EPSILON.sqrt();
            let decay = |slope: f64| if E::FIELDS == 1 { -slope } else { slope.abs() };
            let (change, slope) = quotient(scale.get(j));
            let mut fastest = decay(slope);
            // Beside a large source the change that a small field makes is rounding: its unit is taken for 1 then, too.
            if scale.get(j) < root && change.abs() < root * base.get(i).abs() {
                let wide = Some(decay(quotient(root).1)).filter(|wide| wide.is_finite()).unwrap_or(fastest);
                let known = change.abs() > NOISE * E::EPSILON * base.get(i).abs();
                fastest = if known { fastest.max(wide) } else { wide };
            }
            if !fastest.is_finite() {
                return Err(SolverError::Source { field: i, t }.into());
            }
            sum += fastest;
        }
        sums = sums.max(sum);
    }
    Ok(sums)
}

/// Roundings of S that a change must exceed to tell a slope to 1 %.
const NOISE: f64 = 128.0;

/// The changes of u that difference quotients are taken with, field by field: sqrt(eps) of the largest value, of 1 where all
/// are zero, and no less than a normal number that leaves room for the change of S; upwards, since sources may know no
/// negative fields.
fn difference<E: Fields>(u: &[E]) -> E {
    let double = E::EPSILON < f64::from(f32::EPSILON);
    let least = if double { f64::MIN_POSITIVE } else { f64::from(f32::MIN_POSITIVE) } / E::EPSILON;
    let mut scale = E::ZERO;
    for i in 0..E::FIELDS {
        let largest = u.iter().fold(0.0_f64, |most, u| most.max(u.get(i).abs()));
        scale.set(i, (E::EPSILON.sqrt() * if largest > 0.0 { largest } else { 1.0 }).max(least));
    }
    scale
}
