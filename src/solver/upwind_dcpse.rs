//! Upwind DC-PSE as an advection scheme: half-stencils of order 2, biased stencils of order 3.

use super::fields::Fields;
use super::limits::Rate;
use super::sides::{Sides, still};
use super::term::Site;
use super::transport::{Transport, TransportRows};
use crate::apply::{Field, Report, Rows, SidedRows, UpwindDcPse};
use crate::error::Result;
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
    sides: Sides<D>,
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
        _: bool,
        neighbors: &P,
    ) -> Result<UpwindDcPseRows<D, E>> {
        let rows: SidedRows<D, E::Scalar> = self.open_sides().assemble_as(neighbors)?;
        let sum = |p, axis, side| rows.rows(axis, side).map_or(0.0, |rows| row_sum(rows, p));
        let sums = |p| std::array::from_fn(|axis| [Side::Left, Side::Right].map(|side| sum(p, axis, side)));
        let sides = Sides::new(rows.targets(), still((0..site.points().len()).map(&flow)), sums);
        let built = UpwindDcPseRows { report: rows.report(), rows, sides };
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
            let mut slope = E::ZERO;
            let (diagonal, pairs) = rows.pairs(p);
            if let Some([d]) = diagonal {
                slope = slope.plus_product(d, own);
            }
            for (q, [w]) in pairs {
                slope = slope.plus_difference(w, u[q], own);
            }
            let v = if self.sides.serve(p, axis, v) { v } else { f64::NAN };
            sum = sum.plus_product(E::Scalar::lift(v), slope);
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
        Ok(Rate::modulus(self.sides.rate(p, v)?))
    }

    fn report(&self) -> &Report {
        &self.report
    }
}
