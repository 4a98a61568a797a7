//! The moment systems of several targets, solved side by side and held to their gates.

use super::Settings;
use super::group::{Group, Pairing};
use crate::error::{Error, OperatorError, Result};
use crate::moment::{MomentScratch, MomentSolver, Rung, Solution};
use crate::operator::method::spread;
use crate::stencil::Stencil;

/// Room for the scaled separations and the weights of L targets.
#[derive(Clone, Debug)]
pub(super) struct Room<const D: usize, const L: usize> {
    z: [Vec<[f64; D]>; L],
    w: [Vec<f64>; L],
    moments: MomentScratch<f64>,
}

impl<const D: usize, const L: usize> Default for Room<D, L> {
    fn default() -> Self {
        let (z, w) = (std::array::from_fn(|_| Vec::new()), std::array::from_fn(|_| Vec::new()));
        Self { z, w, moments: MomentScratch::default() }
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
    let particle = jobs.iter().all(|job| job.row.center().is_some());
    for group in groups {
        let (outputs, conditions) = (group.outputs.len(), group.at(particle).0.conditions());
        for i in 0..L {
            room.z[i].clear();
            if let Ok(certificate) = &mut found[i] {
                match nodes(settings, group.at(particle), jobs[i].row, scales[i].0, &mut room.z[i]) {
                    Ok(()) => certificate.conditions = certificate.conditions.max(conditions),
                    Err(error) => found[i] = Err(error),
                }
            }
            room.w[i].clear();
            room.w[i].resize(room.z[i].len() * outputs, 0.0);
        }
        for i in 0..L {
            let Ok(certificate) = &mut found[i] else { continue };
            let (inverse, ratio) = scales[i];
            let (system, pairing) = group.at(particle);
            system.fill(&room.z[i], settings.window, ratio);
            let solution = match solver.solve(system, &mut room.moments, &mut room.w[i]) {
                Ok(solution) if solution.holds(system) => solution,
                Ok(Solution { rank, condition, residual, .. }) => {
                    let (neighbors, residual) = (jobs[i].row.len(), residual.absolute);
                    let kind = OperatorError::Uncertified { neighbors, conditions, rank, condition, residual, ratio };
                    found[i] = Err(Error::from(kind));
                    continue;
                }
                Err(error) => {
                    found[i] = Err(error);
                    continue;
                }
            };
            certificate.rank = certificate.rank.max(solution.rank);
            certificate.condition = certificate.condition.max(solution.condition);
            certificate.residual = certificate.residual.max(solution.residual.absolute);
            certificate.rung = certificate.rung.max(Some(solution.rung));
            certificate.negative += room.w[i].iter().filter(|&&w| w < 0.0).count();
            let nodes = room.z[i].len();
            for (&(k, degree), column) in group.outputs.iter().zip(room.w[i].chunks_exact(nodes)) {
                if let Err(error) = hand_out(k, column, degree, inverse, pairing, &mut jobs[i]) {
                    found[i] = Err(error);
                    break;
                }
            }
        }
    }
    found
}

/// The scaled separations of the nodes of one target: its neighbors and, where it stands in the conditions, the
/// particle itself (errata 21).
fn nodes<const D: usize>(
    settings: &Settings,
    (system, pairing): (&mut crate::moment::MomentSystem<f64, D>, Pairing),
    row: &Stencil<D>,
    inverse: f64,
    z: &mut Vec<[f64; D]>,
) -> Result<()> {
    let neighbors = row.len() + usize::from(pairing == Pairing::Sum);
    let (conditions, needed) = (system.conditions(), settings.fewest(system.conditions()));
    if neighbors < needed {
        return Err(OperatorError::TooFew { neighbors, conditions, needed }.into());
    }
    z.extend(row.separations().iter().map(|s| s.map(|x| x * inverse)));
    if pairing == Pairing::Sum {
        z.push([0.0; D]);
    }
    Ok(())
}

/// Turns the solved column of output k into its weights and its share of the diagonal.
fn hand_out<const D: usize, const K: usize>(
    k: usize,
    column: &[f64],
    degree: u32,
    inverse: f64,
    pairing: Pairing,
    job: &mut Job<'_, D, K>,
) -> Result<()> {
    // epsilon^-m comes last: it alone can overflow.
    let scale = (0..degree).fold(1.0, |product, _| product * inverse);
    let sigma = pairing.sigma();
    let mut diagonal = 0.0;
    for (i, ((w, &sign), &solved)) in job.w.iter_mut().zip(job.row.signs()).zip(column).enumerate() {
        let weight = solved * scale;
        let (on_difference, share) = spread(weight, sigma * weight, sign);
        if !on_difference.is_finite() {
            return Err(OperatorError::Weight { q: job.row.sources()[i] as usize, weight }.into());
        }
        w[k] = on_difference;
        diagonal += share;
    }
    if let (Pairing::Sum, Some(own)) = (pairing, column.get(job.row.len())) {
        diagonal += 2.0 * own * scale;
    }
    job.diagonal[k] = if job.row.center().is_some() { diagonal } else { 0.0 };
    Ok(())
}
