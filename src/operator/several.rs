//! Several scalar operators, of any degrees, over one list.

use super::expression::{Expression, Operator};
use crate::multi_index::MultiIndex;

/// K scalar operators whose rows share one list of neighbors: one sweep gives all K results, whatever their degrees.
///
/// DC-PSE solves those of one degree and parity, or with [`share`](crate::DcPse::share) all of one sign, with one
/// factorization.
///
/// ```
/// use parops::{CellList, DcPse, Domain, Expression, Gradient, Laplacian, MultiIndex, Particles, Several};
/// let set = Particles::jittered([0.0; 2], [1.0; 2], [14; 2], 0.3, 1)?;
/// let first = |axis| Expression::new([(MultiIndex::new(axis), 1.0)]);
/// let operators = Several([Expression::of(&Laplacian::<2>)?, first([1, 0])?, first([0, 1])?]);
/// let dcpse = DcPse::<_, 2>::of(operators);
/// let rows = dcpse.assemble(&CellList::build(&set, &Domain::open(), dcpse.cutoff(&set)?)?)?;
/// let f: Vec<f64> = set.points().iter().map(|x| x[0] * x[0] - x[0] * x[1]).collect();
/// let mut out = vec![[0.0; 3]; f.len()];
/// rows.apply_all(&f, &mut out)?;
/// let [x, y] = set.points()[30];
/// let exact = [2.0, 2.0 * x - y, -x];
/// assert!(out[30].iter().zip(exact).all(|(out, exact)| (out - exact).abs() < 1e-10));
/// # parops::Result::Ok(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Several<const D: usize, const K: usize>(
    /// Output k.
    pub [Expression<D>; K],
);

impl<const D: usize, const K: usize> Operator<D> for Several<D, K> {
    type Out = [f64; K];

    fn terms(&self, term: &mut dyn FnMut(usize, MultiIndex<D>, f64)) {
        for (k, expression) in self.0.iter().enumerate() {
            expression.terms(&mut |_, index, factor| term(k, index, factor));
        }
    }
}
