//! Central schemes: v contracted with the rows of a gradient.

use num_traits::AsPrimitive;

use super::fields::Fields;
use super::limits::Rate;
use super::term::Site;
use super::transport::{Transport, TransportRows};
use crate::apply::{Field, Report, Rows};
use crate::error::Result;
use crate::kernel::{Kernel, SmoothingKernel};
use crate::moment::MomentSolver;
use crate::neighbors::Neighbors;
use crate::operator::{DcPse, Gradient, Method, Pse, Sph};
use crate::scalar::Scalar;

/// Any method for the gradient as a central advection scheme. PSE, SPH and DC-PSE are schemes without it.
///
/// Its modes oscillate: explicit Euler is refused (notes 001, eq. 6.25), RK4 and SSP-RK3 are stable while dt times the
/// row sums keeps to their imaginary interval. **On scattered particles some modes grow, whatever the step.**
#[derive(Clone, Copy, Debug)]
pub struct Central<M>(
    /// The method, one output an axis.
    pub M,
);

/// The rows of a central scheme.
#[derive(Clone, Debug)]
pub struct CentralRows<const D: usize, E: Fields> {
    rows: Rows<[f64; D], E::Scalar>,
    /// max_p sum_q |A_pq| of each component, which bounds the modulus of its eigenvalues.
    bounds: [f64; D],
}

impl<const D: usize, E: Fields> CentralRows<D, E> {
    /// The rows of a gradient at free particles.
    ///
    /// # Errors
    /// As [`Rows::assemble`].
    pub fn build<M: Method<D, Out = [f64; D]>, P: Neighbors<D>>(
        method: &M,
        site: &Site<D>,
        neighbors: &P,
    ) -> Result<Self> {
        let rows = Rows::assemble(&site.screened(method), neighbors)?;
        Ok(Self { bounds: row_sums(&rows), rows })
    }
}

/// The largest sum of the absolute entries of a row, the diagonal among them, output by output.
fn row_sums<T: Field, const K: usize>(rows: &Rows<[f64; K], T>) -> [f64; K] {
    let mut largest = [0.0_f64; K];
    for p in 0..rows.targets() {
        let (diagonal, pairs) = rows.pairs(p);
        let mut own: [f64; K] = diagonal.map_or([0.0; K], |d| d.map(|d| d.as_()));
        let mut sums = [0.0_f64; K];
        for (_, w) in pairs {
            for ((sum, own), w) in sums.iter_mut().zip(&mut own).zip(w) {
                let w: f64 = w.as_();
                *own -= w;
                *sum += w.abs();
            }
        }
        for ((largest, sum), own) in largest.iter_mut().zip(sums).zip(own) {
            *largest = largest.max(sum + own.abs());
        }
    }
    largest
}

impl<const D: usize, E: Fields> TransportRows<D, E> for CentralRows<D, E> {
    #[inline(always)]
    fn along(&self, p: usize, v: &[f64; D], u: &[E]) -> E {
        let v = v.map(E::Scalar::lift);
        let contract = |w: [E::Scalar; D]| w.iter().zip(&v).fold(E::Scalar::lift(0.0), |sum, (&w, &v)| sum + v * w);
        let (own, mut sum) = (u[p], E::ZERO);
        let (diagonal, pairs) = self.rows.pairs(p);
        if let Some(d) = diagonal {
            sum = sum.plus_product(contract(d), own);
        }
        for (q, w) in pairs {
            sum = sum.plus_difference(contract(w), u[q], own);
        }
        sum
    }

    fn entries(&self, p: usize, v: &[f64; D], entry: &mut dyn FnMut(usize, f64)) {
        self.rows.entries_of(p, |w| w.iter().zip(v).fold(0.0, |sum, (w, v)| sum + w * v), entry);
    }

    fn rate(&self, _: usize, v: &[f64; D]) -> Result<Rate> {
        Ok(Rate::oscillation(v.iter().zip(&self.bounds).fold(0.0, |sum, (v, bound)| sum + v.abs() * bound)))
    }

    fn divergence(&self, p: usize, v: &[[f64; D]]) -> Option<f64> {
        let own = v.get(p)?;
        let (_, pairs) = self.rows.pairs(p);
        let mut sum = 0.0;
        for (q, w) in pairs {
            for ((w, v), own) in w.into_iter().zip(v.get(q)?).zip(own) {
                let w: f64 = w.as_();
                sum += w * (v - own);
            }
        }
        Some(sum)
    }

    fn report(&self) -> &Report {
        self.rows.report()
    }
}

macro_rules! central {
    ($([$($generics:tt)*] $method:ty, $of:expr;)*) => { $(
        impl<$($generics)*> Transport<D> for $method {
            type Rows<E: Fields> = CentralRows<D, E>;
            const APPLIES: usize = 1;

            fn build<E: Fields, P: Neighbors<D>>(
                &self,
                site: &Site<D>,
                _: impl Fn(usize) -> [f64; D] + Sync,
                _: bool,
                _: bool,
                neighbors: &P,
            ) -> Result<CentralRows<D, E>> {
                let of: fn(&Self) -> &_ = $of;
                CentralRows::build(of(self), site, neighbors)
            }

            fn gradient<P: Neighbors<D>>(&self, site: &Site<D>, neighbors: &P) -> Result<Option<Rows<[f64; D]>>> {
                let of: fn(&Self) -> &_ = $of;
                Rows::assemble(&site.screened(of(self)), neighbors).map(Some)
            }
        }
    )* };
}

central! {
    [M: Method<D, Out = [f64; D]>, const D: usize] Central<M>, |central| &central.0;
    [K: Kernel<f64, D>, const D: usize] Pse<K, D>, |pse| pse;
    [W: SmoothingKernel<f64, D> + Clone, const D: usize] Sph<W, D, D>, |sph| sph;
    [S: MomentSolver, const R: u32, const D: usize] DcPse<Gradient<D>, R, S>, |dcpse| dcpse;
}
