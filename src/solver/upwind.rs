//! The upwind scheme of order 1: every axis from the side its component of the velocity comes from.

use num_traits::AsPrimitive;

use super::fields::Fields;
use super::limits::Rate;
use super::sides::{Sides, still};
use super::term::Site;
use super::transport::{Transport, TransportRows};
use crate::apply::{Report, Rows};
use crate::error::Result;
use crate::neighbors::Neighbors;
use crate::operator::UpwindGradient;
use crate::scalar::{Scalar, length};

/// The rows of the upwind scheme of order 1, for any velocity.
///
/// (v . grad u)_p = sum_q sum_i min(v_i w_pq,i, 0) (u_q - u_p): weights of the left are below zero, of the right above.
/// No weight of -v . grad is negative, so all its eigenvalues lie in the disc around -S of radius S, with S the row sum
/// sum_i |v_i| sum_q |w_pq,i| of the sides in use: explicit Euler keeps the maximum principle up to dt = 1/S, and a decay rate
/// of 2 S bounds any stepper whose region holds the disc over its real interval, as those of Euler, RK4 and SSP-RK3 do.
#[derive(Clone, Debug)]
pub struct OneSidedRows<const D: usize, E: Fields> {
    rows: Rows<[f64; D], E::Scalar>,
    sides: Sides<D>,
}

impl<const D: usize> Transport<D> for UpwindGradient<D> {
    type Rows<E: Fields> = OneSidedRows<D, E>;
    const APPLIES: usize = 1;

    fn build<E: Fields, P: Neighbors<D>>(
        &self,
        site: &Site<D>,
        flow: impl Fn(usize) -> [f64; D] + Sync,
        steady: bool,
        _: bool,
        neighbors: &P,
    ) -> Result<OneSidedRows<D, E>> {
        let still = still((0..site.points().len()).map(&flow));
        let settled = |p: usize| flow(p).map(|v| if v.abs() > still { v } else { 0.0 });
        let of_flow = steady.then(|| self.of_flow((0..site.points().len()).map(settled).collect()));
        let method = of_flow.as_ref().unwrap_or(self);
        let rows: Rows<[f64; D], E::Scalar> = Rows::assemble(&site.screened(method), neighbors)?;
        let sums = |p| {
            let mut sums = [[0.0_f64; 2]; D];
            for (_, w) in rows.pairs(p).1 {
                for (sums, w) in sums.iter_mut().zip(w) {
                    let w: f64 = w.as_();
                    // A weight below zero serves a velocity from the left.
                    sums[usize::from(w > 0.0)] += w.abs();
                }
            }
            sums
        };
        let sides = Sides::new(rows.targets(), still, sums);
        let built = OneSidedRows { rows, sides };
        if steady {
            site.free().try_for_each(|(p, _)| built.rate(p, &flow(p)).map(|_: Rate| ()))?;
        }
        Ok(built)
    }

    fn viscosity(&self, p: usize, v: &[f64; D]) -> f64 {
        self.epsilon().get(p).unwrap_or(f64::NAN) * length(v) / std::f64::consts::PI.sqrt()
    }
}

impl<const D: usize, E: Fields> TransportRows<D, E> for OneSidedRows<D, E> {
    #[inline(always)]
    fn along(&self, p: usize, v: &[f64; D], u: &[E]) -> E {
        let (zero, own, mut sum) = (E::Scalar::lift(0.0), u[p], E::ZERO);
        if !v.iter().enumerate().all(|(axis, &v)| self.sides.serve(p, axis, v)) {
            return E::ZERO.plus_product(E::Scalar::lift(f64::NAN), own);
        }
        let v = v.map(E::Scalar::lift);
        for (q, w) in self.rows.pairs(p).1 {
            let upwind = |sum, (&w, &v): (&E::Scalar, &E::Scalar)| sum + if w * v < zero { w * v } else { zero };
            sum = sum.plus_difference(w.iter().zip(&v).fold(zero, upwind), u[q], own);
        }
        sum
    }

    fn entries(&self, p: usize, v: &[f64; D], entry: &mut dyn FnMut(usize, f64)) {
        self.rows.entries_of(p, |w| w.iter().zip(v).fold(0.0, |sum, (w, v)| sum + (w * v).min(0.0)), entry);
    }

    fn rate(&self, p: usize, v: &[f64; D]) -> Result<Rate> {
        Ok(Rate::decay(2.0 * self.sides.rate(p, v)?))
    }

    fn monotone(&self) -> bool {
        true
    }

    fn report(&self) -> &Report {
        self.rows.report()
    }
}
