//! What all operator builds have in common: rows over a list, their certificates, and a field they are applied to.

use super::Checked;
use super::bytes::Bytes;
use super::fault::{FuzzFault, FuzzOutcome, close};
use super::rules::same;
use crate::apply::{Apply, Field, Report, Rows};
use crate::error::{ApplyError, Error, ErrorKind, NeighborError, OperatorError};
use crate::neighbors::{NeighborList, Neighbors};
use crate::operator::{GROWTH, Method};
use crate::stencil::Stencil;

/// One row that was built.
pub(super) struct Made<'a, const D: usize> {
    pub(super) p: usize,
    pub(super) stencil: &'a Stencil<D>,
    pub(super) weights: &'a [f64],
    pub(super) diagonal: f64,
    pub(super) report: &'a Report,
    /// eps of the stored weights, and the least of them beside zero.
    pub(super) eps: f64,
    pub(super) least: f64,
}

/// What is known of a method beside the method itself.
pub(super) trait Judge<const D: usize> {
    /// What is built.
    const BUILD: &'static str;

    /// Whether rows may be left empty in place of a refusal.
    const MAY_LEAVE_EMPTY: bool = false;

    /// Whether the row named, or the input as a whole, breaks the rule that the refusal names.
    fn deserves(&mut self, error: &Error, list: &NeighborList<D>) -> bool;

    /// Whether the row is what it ought to be.
    fn certify(&mut self, made: &Made<D>) -> Checked;
}

/// Widths of the support that a row may have had: its own, and those it is widened to.
pub(super) fn supports<const D: usize>(list: &NeighborList<D>, p: usize, own: f64) -> Vec<Stencil<D>> {
    let (mut stencils, mut cutoff) = (Vec::new(), own);
    loop {
        let mut stencil = Stencil::default();
        list.gather(p, cutoff, &mut stencil);
        stencils.push(stencil);
        let wider = (GROWTH * cutoff).min(list.reach());
        if stencils.len() > 3 || !(wider > cutoff) {
            return stencils;
        }
        cutoff = wider;
    }
}

/// Builds the rows of a method and applies them. `tame`: all numbers of the input are moderate.
pub(super) fn build<const D: usize, T: Field, M: Method<D, Out = [f64; 1]>, J: Judge<D>>(
    bytes: &mut Bytes,
    method: &M,
    judge: &mut J,
    list: &NeighborList<D>,
    tame: bool,
) -> Checked<FuzzOutcome> {
    let own = |p: usize| method.cutoff(p).ok().map(|cutoff| cutoff.unwrap_or_else(|| list.cutoff(p)));
    let rows = match Rows::<[f64; 1], T>::assemble(method, list) {
        Ok(rows) => rows,
        Err(error) => {
            let p = error.particle();
            let deserved = match *error.kind() {
                ErrorKind::Neighbor(NeighborError::Reach { cutoff, reach }) => {
                    reach == list.reach() && cutoff > reach && p.and_then(own) == Some(cutoff)
                }
                ErrorKind::Operator(OperatorError::Weight { weight, .. }) => {
                    !tame && !weight.is_finite() && p.is_some()
                }
                ErrorKind::Operator(OperatorError::NoCenter { neighbors }) => p.is_some_and(|p| {
                    list.center(p).is_none() && own(p).is_some_and(|cutoff| list.count(p, cutoff) == neighbors)
                }),
                _ => judge.deserves(&error, list),
            };
            return if deserved {
                Ok(FuzzOutcome::Refused)
            } else {
                Err(FuzzFault::Refused { build: J::BUILD, error })
            };
        }
    };
    let (eps, least) = (T::default_epsilon().as_(), if size_of::<T>() == 4 { 1.4e-45 } else { 5e-324 });
    close("the number of rows", 0, rows.targets() as f64, list.targets() as f64, 0.0)?;
    let mut empty = 0;
    for p in 0..rows.targets() {
        let Some(row) = rows.row(p) else {
            return Err(FuzzFault::Accepted { build: J::BUILD, p, value: f64::NAN });
        };
        let weights: Vec<f64> = row.weights.iter().map(|w| w[0].as_()).collect();
        let diagonal: f64 = row.diagonal[0].as_();
        if let Some(value) = weights.iter().chain([&diagonal]).find(|w| !w.is_finite()) {
            return Err(FuzzFault::Accepted { build: J::BUILD, p, value: *value });
        }
        let Some(cutoff) = own(p) else {
            return Err(FuzzFault::Accepted { build: J::BUILD, p, value: f64::NAN });
        };
        let stencils = supports(list, p, cutoff);
        if row.sources.is_empty() && J::MAY_LEAVE_EMPTY {
            empty += 1;
            continue;
        }
        // A wider support may have no more neighbors: the row is right if it is for one of these.
        let report = rows.report();
        let like = stencils.iter().filter(|stencil| stencil.sources() == row.sources);
        let mut judged: Vec<Checked> = like
            .map(|stencil| judge.certify(&Made { p, stencil, weights: &weights, diagonal, report, eps, least }))
            .collect();
        if !judged.iter().any(Result::is_ok) {
            let none = FuzzFault::Accepted { build: J::BUILD, p, value: row.sources.len() as f64 };
            return judged.pop().unwrap_or(Err(none)).map(|()| FuzzOutcome::Built);
        }
    }
    close("the number of empty rows", 0, rows.report().empty as f64, f64::from(empty), 0.0)?;
    apply(bytes, &rows, list, eps, least)?;
    Ok(FuzzOutcome::Built)
}

/// A field from bytes, and what the rows make of it.
fn apply<const D: usize, T: Field>(
    bytes: &mut Bytes,
    rows: &Rows<[f64; 1], T>,
    list: &NeighborList<D>,
    eps: f64,
    least: f64,
) -> Checked {
    let wild = bytes.once_in(4);
    let value = |_| {
        let tame = f64::from(bytes.byte()) / 64.0 - 2.0;
        T::lift(bytes.or_any(wild, 64, tame))
    };
    let f: Vec<T> = (0..rows.sources()).map(value).collect();
    let before = T::lift(0.25);
    let mut out = vec![before; rows.targets()];
    let refused = rows.apply(&f, &mut out).err();
    let bad = f.iter().position(|x| !x.is_finite());
    let largest = T::max_value().map_or(f64::MAX, |most| most.as_());
    let mut overflow = None;
    for (p, &out) in out.iter().enumerate() {
        let Some(row) = rows.row(p) else { continue };
        let own: f64 = list.center(p).map_or(0.0, |q| f[q].as_());
        let diagonal: f64 = row.diagonal[0].as_();
        let (mut sum, mut size) = (diagonal * own, (diagonal * own).abs());
        for (&q, w) in row.sources.iter().zip(row.weights) {
            let (w, other): (f64, f64) = (w[0].as_(), f[q as usize].as_());
            sum += w * (other - own);
            size += w.abs() * (other.abs() + own.abs());
        }
        // A difference, a product and a sum each round once.
        let tolerance = (row.sources.len() as f64 + 3.0) * (2.0 * eps * size + least);
        if bad.is_some() {
            if out != before {
                return Err(FuzzFault::Accepted { build: "apply", p, value: out.as_() });
            }
        } else if !(size < largest / 8.0) {
            overflow = overflow.or(Some(p));
        } else {
            close("an application", p, out.as_(), sum, tolerance)?;
        }
    }
    let deserved = match refused.as_ref().map(|error| (error.particle(), error.kind())) {
        None => bad.is_none(),
        Some((p, &ErrorKind::Apply(ApplyError::Field { value }))) => {
            p == bad && p.is_some_and(|p| same(value, f[p].as_()))
        }
        Some((p, &ErrorKind::Apply(ApplyError::Overflow { value }))) => {
            !value.is_finite() && p >= overflow && overflow.is_some()
        }
        Some(_) => false,
    };
    match refused {
        Some(error) if !deserved => Err(FuzzFault::Refused { build: "apply", error }),
        None if !deserved => Err(FuzzFault::Accepted { build: "apply", p: bad.unwrap_or(0), value: f64::NAN }),
        _ => Ok(()),
    }
}
