//! Upwind DC-PSE as an advection scheme: half-stencils of order 2, biased stencils of order 3.

use super::fields::Fields;
use super::limits::Rate;
use super::term::Site;
use super::transport::{Transport, TransportRows};
use crate::apply::{Field, Report, Rows, SidedRows, UpwindDcPse};
use crate::error::{Error, Result, SolverError};
use crate::neighbors::Neighbors;
use crate::scalar::Scalar;
use crate::stencil::Side;

/// The rows of upwind DC-PSE, with what bounds their modes.
///
/// Of their eigenvalues the row sums bound the modulus. Rows that the neighbors on a side do not determine are left out;
/// a velocity that comes from there is refused.
#[derive(Clone, Debug)]
pub struct UpwindDcPseRows<const D: usize, E: Fields> {
    rows: SidedRows<D, E::Scalar>,
    report: Report,
    /// The largest row sum of either side, axis by axis.
    sums: [f64; D],
}

impl<const D: usize, E: Fields> UpwindDcPseRows<D, E> {
    /// The rows of the axis for the side that the component v comes from; none for v = 0.
    #[inline(always)]
    fn side(&self, axis: usize, v: f64) -> Option<&Rows<[f64; 1], E::Scalar>> {
        self.rows.rows(axis, Side::upwind(v)?)
    }
}

/// sum_q |A_pq|, the diagonal among them.
fn row_sum<T: Field>(rows: &Rows<[f64; 1], T>, p: usize) -> f64 {
    let mut sum = 0.0;
    rows.entries_of(p, |w| w[0], &mut |_, w| sum += w.abs());
    sum
}

impl<const D: usize> Transport<D> for UpwindDcPse {
    type Rows<E: Fields> = UpwindDcPseRows<D, E>;
    const APPLIES: usize = 1;

    fn build<E: Fields, P: Neighbors<D>>(
        &self,
        site: &Site<D>,
        flow: impl Fn(usize) -> [f64; D] + Sync,
        steady: bool,
        neighbors: &P,
    ) -> Result<UpwindDcPseRows<D, E>> {
        let rows: SidedRows<D, E::Scalar> = self.open_sides().assemble_as(neighbors)?;
        let mut sums = [0.0_f64; D];
        for (axis, sum) in sums.iter_mut().enumerate() {
            for rows in [Side::Left, Side::Right].into_iter().filter_map(|side| rows.rows(axis, side)) {
                *sum = (0..rows.targets()).fold(*sum, |most, p| most.max(row_sum(rows, p)));
            }
        }
        let built = UpwindDcPseRows { report: rows.report(), rows, sums };
        if steady {
            site.free().try_for_each(|(p, _)| built.rate(p, &flow(p)).map(|_: Rate| ()))?;
        }
        Ok(built)
    }
}

impl<const D: usize, E: Fields> TransportRows<D, E> for UpwindDcPseRows<D, E> {
    #[inline(always)]
    fn along(&self, p: usize, v: &[f64; D], u: &[E]) -> E {
        let (own, mut sum) = (u[p], E::ZERO);
        for (axis, &v) in v.iter().enumerate() {
            let Some(rows) = self.side(axis, v) else { continue };
            let (mut slope, mut served) = (E::ZERO, false);
            let (diagonal, pairs) = rows.pairs(p);
            if let Some([d]) = diagonal {
                slope = slope.plus_product(d, own);
            }
            for (q, [w]) in pairs {
                slope = slope.plus_difference(w, u[q], own);
                served = true;
            }
            // A row that was left out has no neighbors.
            sum = sum.plus_product(E::Scalar::lift(if served { v } else { f64::NAN }), slope);
        }
        sum
    }

    fn entries(&self, p: usize, v: &[f64; D], entry: &mut dyn FnMut(usize, f64)) {
        for (axis, &v) in v.iter().enumerate() {
            if let Some(rows) = self.side(axis, v) {
                rows.entries_of(p, |w| v * w[0], entry);
            }
        }
    }

    fn rate(&self, p: usize, v: &[f64; D]) -> Result<Rate> {
        for (axis, &velocity) in v.iter().enumerate() {
            let empty = |rows: &Rows<[f64; 1], E::Scalar>| rows.row(p).is_none_or(|row| row.sources.is_empty());
            if self.side(axis, velocity).is_some_and(empty) {
                return Err(Error::from(SolverError::NoUpstream { axis, velocity }).at(p));
            }
        }
        Ok(Rate::modulus(v.iter().zip(&self.sums).fold(0.0, |sum, (v, own)| sum + v.abs() * own)))
    }

    fn report(&self) -> &Report {
        &self.report
    }
}
