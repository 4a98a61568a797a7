//! How v . grad u is discretized: the seam of every advection scheme, and the central ones.

use num_traits::AsPrimitive;

use super::fields::Fields;
use super::free::Free;
use super::limits::Rate;
use super::term::Site;
use crate::apply::{Report, Rows};
use crate::error::Result;
use crate::neighbors::Neighbors;
use crate::operator::Method;
use crate::scalar::Scalar;

/// A scheme for v . grad u: what it makes of a particle set, and the derivative it gives along any velocity.
///
/// Every [`Method`] for the [`Gradient`](crate::Gradient) is one, a central scheme: PSE, DC-PSE and SPH. Upwind schemes
/// implement it themselves.
#[diagnostic::on_unimplemented(
    message = "`{Self}` is no advection scheme in {D} dimensions",
    label = "expected a method for the gradient or an upwind scheme",
    note = "a central scheme is any method with one output an axis, such as `DcPse::<Gradient<{D}>, 2>`"
)]
pub trait Transport<const D: usize>: Sync {
    /// What is made once for a particle set.
    type Rows<E: Fields>: Sync;

    /// Sweeps over stored rows a stage.
    const APPLIES: usize;

    /// Makes the rows. `flow` gives the velocity of every particle at the start of the run, for schemes that look
    /// upstream; `steady` says whether it stays.
    ///
    /// # Errors
    /// As [`Rows::assemble`](crate::Rows::assemble).
    fn build<E: Fields, P: Neighbors<D>>(
        &self,
        site: &Site<D>,
        flow: impl Fn(usize) -> [f64; D] + Sync,
        steady: bool,
        neighbors: &P,
    ) -> Result<Self::Rows<E>>;

    /// Computes what depends on the whole field before the particles are gone through.
    fn refresh<E: Fields>(&self, rows: &mut Self::Rows<E>, u: &[E]) {
        let _ = (rows, u);
    }

    /// (v . grad u)_p.
    fn along<E: Fields>(&self, rows: &Self::Rows<E>, p: usize, v: &[f64; D], u: &[E]) -> E;

    /// The entries (q, A_pq) of v . grad at particle p.
    fn entries<E: Fields>(&self, rows: &Self::Rows<E>, p: usize, v: &[f64; D], entry: &mut dyn FnMut(usize, f64));

    /// How fast modes move where the velocity is v.
    fn rate<E: Fields>(&self, rows: &Self::Rows<E>, v: &[f64; D]) -> Rate;

    /// The numerical viscosity along a velocity v, in the units of a diffusivity; 0 for a central scheme.
    fn viscosity(&self, v: &[f64; D]) -> f64 {
        let _ = v;
        0.0
    }

    /// The divergence of the velocity field at particle p, by central rows; `None` where the scheme has none.
    fn divergence<E: Fields>(&self, rows: &Self::Rows<E>, p: usize, v: &[[f64; D]]) -> Option<f64> {
        let _ = (rows, p, v);
        None
    }

    /// What the build of the rows found.
    fn report<'a, E: Fields>(&self, rows: &'a Self::Rows<E>) -> &'a Report;
}

/// The rows of a central scheme.
#[derive(Clone, Debug)]
pub struct CentralRows<const D: usize, E: Fields> {
    rows: Rows<[f64; D], E::Scalar>,
    /// max_p sum_q |A_pq| of each component, which bounds the modulus of its eigenvalues.
    bounds: [f64; D],
}

impl<M: Method<D, Out = [f64; D]>, const D: usize> Transport<D> for M {
    type Rows<E: Fields> = CentralRows<D, E>;
    const APPLIES: usize = 1;

    fn build<E: Fields, P: Neighbors<D>>(
        &self,
        site: &Site<D>,
        _: impl Fn(usize) -> [f64; D] + Sync,
        _: bool,
        neighbors: &P,
    ) -> Result<CentralRows<D, E>> {
        let rows: Rows<[f64; D], E::Scalar> = Rows::assemble(&Free { method: self, site }, neighbors)?;
        let mut bounds = [0.0_f64; D];
        for p in 0..rows.targets() {
            let (diagonal, pairs) = rows.pairs(p);
            let mut own: [f64; D] = diagonal.map_or([0.0; D], |d| d.map(|d| d.as_()));
            let mut sums = [0.0_f64; D];
            for (_, w) in pairs {
                for (axis, w) in w.into_iter().enumerate() {
                    let w: f64 = w.as_();
                    own[axis] -= w;
                    sums[axis] += w.abs();
                }
            }
            for (axis, bound) in bounds.iter_mut().enumerate() {
                *bound = bound.max(sums[axis] + own[axis].abs());
            }
        }
        Ok(CentralRows { rows, bounds })
    }

    #[inline(always)]
    fn along<E: Fields>(&self, rows: &CentralRows<D, E>, p: usize, v: &[f64; D], u: &[E]) -> E {
        let v = v.map(E::Scalar::lift);
        let contract = |w: [E::Scalar; D]| w.iter().zip(&v).fold(E::Scalar::lift(0.0), |sum, (&w, &v)| sum + v * w);
        let (own, mut sum) = (u[p], E::ZERO);
        let (diagonal, pairs) = rows.rows.pairs(p);
        if let Some(d) = diagonal {
            sum = sum.plus_product(contract(d), own);
        }
        for (q, w) in pairs {
            sum = sum.plus_difference(contract(w), u[q], own);
        }
        sum
    }

    fn entries<E: Fields>(&self, rows: &CentralRows<D, E>, p: usize, v: &[f64; D], entry: &mut dyn FnMut(usize, f64)) {
        rows.rows.entries_of(p, |w| w.iter().zip(v).fold(0.0, |sum, (w, v)| sum + w * v), entry);
    }

    fn rate<E: Fields>(&self, rows: &CentralRows<D, E>, v: &[f64; D]) -> Rate {
        Rate::oscillation(v.iter().zip(&rows.bounds).fold(0.0, |sum, (v, bound)| sum + v.abs() * bound))
    }

    fn divergence<E: Fields>(&self, rows: &CentralRows<D, E>, p: usize, v: &[[f64; D]]) -> Option<f64> {
        let own = v.get(p)?;
        let (_, pairs) = rows.rows.pairs(p);
        let mut sum = 0.0;
        for (q, w) in pairs {
            for (axis, w) in w.into_iter().enumerate() {
                let w: f64 = w.as_();
                sum += w * (v.get(q)?[axis] - own[axis]);
            }
        }
        Some(sum)
    }

    fn report<'a, E: Fields>(&self, rows: &'a CentralRows<D, E>) -> &'a Report {
        rows.rows.report()
    }
}
