//! The moment systems of several targets, solved side by side and held to their gates.

use super::Settings;
use super::group::{Column, Conditions, Group, Pairing};
use crate::error::{Error, ErrorKind, OperatorError, Result};
use crate::moment::{BatchScratch, MomentScratch, MomentSolver, Rung, Solution, Windows};
use crate::operator::finite;
use crate::operator::method::spread;
use crate::scalar::square;
use crate::stencil::Stencil;

/// Room for the scaled separations and the weights of L targets.
#[derive(Clone, Debug)]
pub(super) struct Room<const D: usize, const L: usize> {
    z: [Vec<[f64; D]>; L],
    w: [Vec<f64>; L],
    batch: BatchScratch<L>,
    moments: MomentScratch<f64>,
}

impl<const D: usize, const L: usize> Default for Room<D, L> {
    fn default() -> Self {
        let (z, w) = (std::array::from_fn(|_| Vec::new()), std::array::from_fn(|_| Vec::new()));
        Self { z, w, batch: BatchScratch::default(), moments: MomentScratch::default() }
    }
}

/// One target and where its weights go.
pub(super) struct Job<'a, const D: usize, const K: usize> {
    pub(super) row: &'a Stencil<D>,
    pub(super) w: &'a mut [[f64; K]],
    pub(super) diagonal: &'a mut [f64; K],
}

/// What the solves of one target found: the worst over its groups.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Certificate {
    pub(super) conditions: usize,
    pub(super) rank: usize,
    pub(super) condition: f64,
    pub(super) residual: f64,
    pub(super) rung: Option<Rung>,
    pub(super) negative: usize,
}

/// Writes the weights of L targets, group by group; either all targets are particles, or none is.
///
/// A target's result does not depend on the others.
pub(super) fn certify<S: MomentSolver, const D: usize, const K: usize, const L: usize>(
    solver: &S,
    settings: &Settings,
    groups: &mut [Group<D>],
    room: &mut Room<D, L>,
    jobs: &mut [Job<'_, D, K>; L],
) -> [Result<Certificate>; L] {
    let mut scales = [(0.0, 0.0); L];
    let mut found: [Result<Certificate>; L] = std::array::from_fn(|i| {
        *jobs[i].diagonal = [0.0; K];
        scales[i] = settings.scale(jobs[i].row)?;
        Ok(Certificate::default())
    });
    let middle: [_; L] = std::array::from_fn(|i| jobs[i].row.middle().map(|x| x * scales[i].0));
    let particle = jobs.iter().all(|job| job.row.center().is_some());
    for group in groups {
        let (outputs, conditions, pairing) = group.at(particle);
        let Conditions { system, batch } = conditions;
        let (conditions, largest) = (system.conditions(), system.largest_required());
        for i in 0..L {
            room.z[i].clear();
            if found[i].is_ok()
                && let Err(error) = nodes(settings, conditions, pairing, jobs[i].row, scales[i].0, &mut room.z[i])
            {
                found[i] = Err(error);
            }
            room.w[i].resize(room.z[i].len() * outputs.len(), 0.0);
        }
        let mut known = [None; L];
        if S::AFTER_CHOLESKY {
            let z = room.z.each_ref().map(Vec::as_slice);
            let w = room.w.each_mut().map(Vec::as_mut_slice);
            let windows = Windows { shape: settings.window, radius: scales.map(|(_, ratio)| ratio), middle };
            known = batch.solve(z, windows, &mut room.batch, w);
        }
        let mut finish = |i: usize, certificate: &mut Certificate| {
            let (inverse, ratio) = scales[i];
            let (z, w) = (&room.z[i], &mut room.w[i]);
            let neighbors = jobs[i].row.len();
            let refuse = |rank, condition, residual| {
                Error::from(OperatorError::Uncertified { neighbors, conditions, rank, condition, residual, ratio })
            };
            let solution = match known[i].filter(|known| known.is_sharp(conditions, largest)) {
                Some(known) => known,
                None => {
                    let root = |q: usize| settings.window.root(square(&from_middle(&z[q], &middle[i])), ratio);
                    system.fill_windowed(z, |q, _| root(q));
                    let solved = solver.climb(known[i], system, &mut room.moments, w);
                    solved.map_err(|error| match *error.kind() {
                        // Without weights all is missed.
                        ErrorKind::Operator(OperatorError::Singular { rank, .. }) => {
                            refuse(rank, f64::INFINITY, largest)
                        }
                        _ => error,
                    })?
                }
            };
            let Solution { rung, rank, condition, residual } = solution;
            if !solution.is_within(conditions, largest) {
                return Err(refuse(rank, condition, residual.absolute));
            }
            certificate.conditions = certificate.conditions.max(conditions);
            certificate.rank = certificate.rank.max(rank);
            certificate.condition = certificate.condition.max(condition);
            certificate.residual = certificate.residual.max(residual.absolute);
            certificate.rung = certificate.rung.max(Some(rung));
            for (&column, solved) in outputs.iter().zip(w.chunks_exact(z.len())) {
                certificate.negative += solved.iter().take(neighbors).filter(|&&w| w < 0.0).count();
                hand_out(column, solved, inverse, pairing, &mut jobs[i]);
            }
            Ok(())
        };
        for (i, found) in found.iter_mut().enumerate() {
            if let Ok(certificate) = found
                && let Err(error) = finish(i, certificate)
            {
                *found = Err(error);
            }
        }
    }
    // epsilon^-m can overflow, and so can a diagonal of weights that do not.
    for (found, job) in found.iter_mut().zip(jobs) {
        if found.is_ok()
            && let Err(error) = finite(job.row, job.w.iter().map(<[f64; K]>::as_slice), job.diagonal)
        {
            *found = Err(error);
        }
    }
    found
}

/// The scaled separations of the nodes of one target: its neighbors and, where it stands in the conditions, the
/// particle itself (errata 21).
fn nodes<const D: usize>(
    settings: &Settings,
    conditions: usize,
    pairing: Pairing,
    row: &Stencil<D>,
    inverse: f64,
    z: &mut Vec<[f64; D]>,
) -> Result<()> {
    let neighbors = row.len() + usize::from(pairing == Pairing::Sum);
    let needed = settings.fewest(conditions);
    if neighbors < needed {
        return Err(OperatorError::TooFew { neighbors, conditions, needed }.into());
    }
    z.extend(row.separations().iter().map(|s| s.map(|x| x * inverse)));
    if pairing == Pairing::Sum {
        z.push([0.0; D]);
    }
    Ok(())
}

/// Where a node lies as its window sees it.
fn from_middle<const D: usize>(z: &[f64; D], middle: &[f64; D]) -> [f64; D] {
    std::array::from_fn(|axis| z[axis] - middle[axis])
}

/// Turns a solved column into the weights of its output and its share of the diagonal.
fn hand_out<const D: usize, const K: usize>(
    Column { output: k, degree, scale }: Column,
    column: &[f64],
    inverse: f64,
    pairing: Pairing,
    job: &mut Job<'_, D, K>,
) {
    let scale = (0..degree).fold(scale, |product, _| product * inverse);
    let (signs, mut diagonal) = (job.row.signs(), 0.0);
    if pairing == Pairing::Difference && signs.iter().all(|&sign| sign == 1) {
        // Nothing is left for the diagonal, and no sum makes one weight wait for another.
        for (w, &solved) in job.w.iter_mut().zip(column) {
            w[k] = solved * scale;
        }
    } else {
        let sigma = pairing.sigma();
        for ((w, &sign), &solved) in job.w.iter_mut().zip(signs).zip(column) {
            let weight = solved * scale;
            let (on_difference, share) = spread(weight, sigma * weight, sign);
            w[k] = on_difference;
            diagonal += share;
        }
    }
    if let (Pairing::Sum, Some(own)) = (pairing, column.get(job.row.len())) {
        diagonal += 2.0 * own * scale;
    }
    job.diagonal[k] = if job.row.center().is_some() { diagonal } else { 0.0 };
}
