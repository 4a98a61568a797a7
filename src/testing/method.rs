//! Whether a discretization method keeps its promises.

use super::method_fault::MethodFault;
use crate::multi_index::{MultiIndex, graded};
use crate::neighbors::Neighbors;
use crate::operator::{Method, Operator, Outputs, RowReport};
use crate::stencil::{Neighbor, Stencil};

type Checked<const D: usize, T = ()> = std::result::Result<T, MethodFault<D>>;

/// Checks everything a [`Method`] promises that can be checked without knowing its operator, over the rows of a
/// provider it ought to serve.
///
/// 1. Its cutoff is a number within the reach of the provider, or none.
/// 2. Weights and diagonal are written whole, finite, and the same when asked again.
/// 3. Scratch carries nothing from row to row, in whatever order they come.
/// 4. The report names the target, its number of neighbors and its sum of absolute weights (to rounding); none of its
///    figures is NaN or negative; a breach exceeds its limit, and leave is only given where there is one.
/// 5. Mirror images: with all signs turned, w_pq becomes -w_pq and the diagonal takes up the difference, so that the
///    same pairs act on the field behind the mirror.
/// 6. Where every target is its own source, the largest spectral bound is at least |tr A| / N, A the whole operator:
///    no bound on the eigenvalues can be below their mean.
///
/// That constants are annihilated needs no check where the diagonal is zero: the form of a row does it.
///
/// ```
/// use parops::{CellList, Domain, Laplacian, Particles, Pse, testing::check_method};
/// let ring = Particles::lattice([0.0], [1.0], [32])?;
/// let pse = Pse::new(Laplacian::<1>, 2, ring.spacing()?.epsilon(2.0)?, ring.volumes()?)?;
/// let neighbors = CellList::build(&ring, &Domain::periodic([0.0], [1.0])?, pse.cutoff())?;
/// assert_eq!(check_method(&pse, &neighbors), Ok(()));
/// # parops::Result::Ok(())
/// ```
///
/// # Errors
/// The first [`MethodFault`] found; [`MethodFault::Refused`] where the method has no weights for a row.
pub fn check_method<const D: usize, M: Method<D>>(method: &M, neighbors: &impl Neighbors<D>) -> Checked<D> {
    let targets = neighbors.targets();
    let mut rows = Vec::with_capacity(targets);
    for p in 0..targets {
        let row = gather(method, neighbors, p)?;
        let made = make(method, &row, &mut method.scratch()?, f64::NAN)?;
        let again = make(method, &row, &mut method.scratch()?, PREFILL)?;
        written(&row, &made, &again)?;
        reported(&row, &made)?;
        mirrored(method, &row, &made)?;
        rows.push((row, made));
    }
    let mut scratch = method.scratch()?;
    for (row, made) in rows.iter().chain(rows.iter().rev()).chain(rows.iter().step_by(3)) {
        if make(method, row, &mut scratch, PREFILL)? != *made {
            return Err(MethodFault::Scratch { p: row.target() });
        }
    }
    bounded(&rows)
}

/// Checks that the rows are exact for the monomials (x - x_p)^alpha, |alpha| <= `exact_to`, of the operator.
///
/// Applied to the monomial, row p must give sum_i c_i beta_i! [alpha = beta_i], to `tolerance` in units of
/// sum_q |w_pq| |x_q - x_p|^alpha (and |d_p| for alpha = 0), which is free of scale. 16 l eps cond is what a method that
/// solves l moment conditions reaches; PSE and SPH on lattices reach 1e-6 and better, and only |alpha| <= m + r - 1.
///
/// # Errors
/// [`MethodFault::Moment`], and [`MethodFault::Refused`] where the method has no weights for a row.
pub fn check_method_moments<const D: usize, M: Method<D>>(
    method: &M,
    neighbors: &impl Neighbors<D>,
    operator: &impl Operator<D, Out = M::Out>,
    exact_to: u32,
    tolerance: f64,
) -> Checked<D> {
    let mut scratch = method.scratch()?;
    for p in 0..neighbors.targets() {
        let row = gather(method, neighbors, p)?;
        let made = make(method, &row, &mut scratch, PREFILL)?;
        for alpha in graded::<D>(0, exact_to) {
            for k in 0..M::Out::K {
                let mut required = 0.0;
                let factorial = alpha.factorial()? as f64;
                operator.terms(&mut |output, index, factor| {
                    if output == k && index == alpha {
                        required += factor * factorial;
                    }
                });
                let (found, size) = moment(&row, &made, alpha, k);
                let tolerance = tolerance * size;
                let exact = (found - required).abs() <= tolerance;
                if !exact {
                    return Err(MethodFault::Moment { p, output: k, alpha, found, required, tolerance });
                }
            }
        }
    }
    Ok(())
}

/// What unwritten places hold in a second run: no weight is this.
const PREFILL: f64 = 6.02214076e123;

/// Sums over a row are compared to this many eps a term.
const ROUNDING: f64 = 8.0 * f64::EPSILON;

/// One row as the method made it; equal where every bit is, or the values are.
struct Made<S> {
    weights: Vec<S>,
    diagonal: S,
    report: RowReport,
}

impl<S: Outputs> PartialEq for Made<S> {
    fn eq(&self, other: &Self) -> bool {
        let bits = |s: &S| s.as_slice().iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        self.weights.iter().map(bits).eq(other.weights.iter().map(bits))
            && bits(&self.diagonal) == bits(&other.diagonal)
            && self.report == other.report
    }
}

fn gather<const D: usize>(method: &impl Method<D>, neighbors: &impl Neighbors<D>, p: usize) -> Checked<D, Stencil<D>> {
    let reach = neighbors.reach();
    let cutoff = method.cutoff(p)?.unwrap_or_else(|| neighbors.cutoff(p));
    let legal = (0.0..=reach).contains(&cutoff);
    if !legal {
        return Err(MethodFault::Cutoff { p, cutoff, reach });
    }
    let mut row = Stencil::default();
    neighbors.gather(p, cutoff, &mut row);
    Ok(row)
}

fn make<const D: usize, M: Method<D>>(
    method: &M,
    row: &Stencil<D>,
    scratch: &mut M::Scratch,
    prefill: f64,
) -> Checked<D, Made<M::Out>> {
    let mut unwritten = M::Out::ZERO;
    unwritten.as_mut_slice().fill(prefill);
    let (mut weights, mut diagonal) = (vec![unwritten; row.len()], unwritten);
    let p = row.target();
    method.weights(row, scratch, &mut weights, &mut diagonal).map_err(|error| error.at(p))?;
    let report = method.report(row, scratch, &weights, &diagonal).map_err(|error| error.at(p))?;
    Ok(Made { weights, diagonal, report })
}

/// Two runs over different contents: whole, finite, and the same.
fn written<const D: usize, S: Outputs>(row: &Stencil<D>, first: &Made<S>, second: &Made<S>) -> Checked<D> {
    let p = row.target();
    let values = |made: &Made<S>| -> Vec<f64> {
        made.weights.iter().chain([&made.diagonal]).flat_map(|s| s.as_slice().to_vec()).collect()
    };
    for (i, (one, other)) in values(first).into_iter().zip(values(second)).enumerate() {
        let q = row.sources().get(i / S::K.max(1)).map(|&q| q as usize);
        if one.is_nan() && other == PREFILL {
            return Err(MethodFault::Unwritten { p, q });
        }
        if one.to_bits() != other.to_bits() && !(one.is_nan() && other.is_nan()) {
            return Err(MethodFault::Unsteady { p });
        }
        if !one.is_finite() {
            return Err(MethodFault::NotFinite { p, q, value: one });
        }
    }
    Ok(())
}

/// The report of a row against the row.
fn reported<const D: usize, S: Outputs>(row: &Stencil<D>, made: &Made<S>) -> Checked<D> {
    let (p, report) = (row.target(), made.report);
    let own = RowReport::of(row, &made.weights, &made.diagonal);
    if (report.target, report.neighbors) != (own.target, own.neighbors) {
        let (target, neighbors) = (report.target, report.neighbors);
        return Err(MethodFault::Named { p, target, neighbors, expected: row.len() });
    }
    let same = (report.sum_abs - own.sum_abs).abs() <= ROUNDING * (row.len() + 1) as f64 * own.sum_abs;
    if !same {
        return Err(MethodFault::SumAbs { p, found: report.sum_abs, expected: own.sum_abs });
    }
    for figure in [report.h_over_epsilon, report.moment_defect, report.spectral_bound] {
        // NaN too.
        if !(figure >= 0.0) {
            return Err(MethodFault::Figure { p, figure });
        }
    }
    let severity = report.severity();
    if (report.breach.is_some() && !(severity > 1.0)) || (report.allowed && report.breach.is_none()) {
        return Err(MethodFault::Breach { p, severity });
    }
    Ok(())
}

/// The same row with all images behind another odd mirror.
fn mirrored<const D: usize, M: Method<D>>(method: &M, row: &Stencil<D>, made: &Made<M::Out>) -> Checked<D> {
    let p = row.target();
    let mut turned = Stencil::default();
    turned.reset(p, row.center(), row.cutoff());
    row.iter().for_each(|neighbor| turned.push(Neighbor { sign: -neighbor.sign, ..neighbor }));
    let other = make(method, &turned, &mut method.scratch()?, f64::NAN)?;
    for (neighbor, (w, v)) in row.iter().zip(made.weights.iter().zip(&other.weights)) {
        for (&weight, &turned) in w.as_slice().iter().zip(v.as_slice()) {
            if weight != -turned {
                return Err(MethodFault::Sign { p, q: Some(neighbor.q), weight, turned });
            }
        }
    }
    if row.center().is_none() {
        return Ok(());
    }
    for k in 0..M::Out::K {
        let (weight, turned) = (made.diagonal.as_slice()[k], other.diagonal.as_slice()[k]);
        let sum = |map: fn(f64) -> f64| made.weights.iter().map(|w| map(w.as_slice()[k])).sum::<f64>();
        let bound = ROUNDING * (row.len() + 1) as f64 * (sum(f64::abs) + weight.abs());
        let taken_up = (turned - (weight - 2.0 * sum(|w| w))).abs() <= bound;
        if !taken_up {
            return Err(MethodFault::Sign { p, q: None, weight, turned });
        }
    }
    Ok(())
}

/// |tr A| / N against the largest spectral bound.
fn bounded<const D: usize, S: Outputs>(rows: &[(Stencil<D>, Made<S>)]) -> Checked<D> {
    if rows.is_empty() || rows.iter().enumerate().any(|(p, (row, _))| row.center() != Some(p)) {
        return Ok(());
    }
    let bound = rows.iter().fold(0.0, |bound: f64, (_, made)| bound.max(made.report.spectral_bound));
    for k in 0..S::K {
        let (mut trace, mut size) = (0.0, 0.0);
        for (row, made) in rows {
            let own = made.diagonal.as_slice()[k];
            let pairs = row.sources().iter().zip(&made.weights).filter(|(q, _)| **q as usize != row.target());
            trace += own - pairs.map(|(_, w)| w.as_slice()[k]).sum::<f64>();
            size += made.report.sum_abs;
        }
        let mean = trace.abs() / rows.len() as f64;
        let slack = ROUNDING * size;
        if !(mean <= bound + slack) {
            return Err(MethodFault::SpectralBound { bound, mean });
        }
    }
    Ok(())
}

/// Output k of a row applied to (x - x_p)^alpha, continued behind odd mirrors by the image's own sign; and the same of
/// absolute values.
fn moment<const D: usize, S: Outputs>(row: &Stencil<D>, made: &Made<S>, alpha: MultiIndex<D>, k: usize) -> (f64, f64) {
    let own = if row.center().is_some() && alpha == MultiIndex::ZERO { 1.0 } else { 0.0 };
    let diagonal = made.diagonal.as_slice()[k] * own;
    let (mut sum, mut size) = (diagonal, diagonal.abs());
    for (neighbor, w) in row.iter().zip(&made.weights) {
        let (w, power) = (w.as_slice()[k], alpha.power(&neighbor.separation.map(|s| -s)));
        sum += w * (f64::from(neighbor.sign) * power - own);
        size += w.abs() * power.abs();
    }
    (sum, size)
}
