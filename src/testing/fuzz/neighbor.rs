//! Neighbor providers from bytes.

use super::bytes::Bytes;
use super::fault::{FuzzFault, FuzzOutcome, close};
use super::oracle::Oracle;
use super::scene::{Scene, Wild};
use super::{Checked, own_rows};
use crate::domain::Domain;
use crate::error::{DomainError, Error, ErrorKind, NeighborError};
use crate::neighbors::{BruteForce, CellList, HalfList, NeighborList, Neighbors, Symmetry, VerletList};
use crate::particles::Particles;
use crate::scale::Cutoff;
use crate::testing::check_provider_against;

/// The most particles; in three dimensions, where images are many, fewer.
const MOST: [usize; 3] = [60, 60, 36];

/// Builds neighbors from any bytes: brute force, cell list, stored list, Verlet list before and after a move, half list,
/// targets off the particles, and rows of a caller's own, two or three of them a case.
///
/// The bytes stand for a dimension from 1 to 3, a box, at most 60 points (illegal, coincident and extreme ones among
/// them), a cutoff, a skin and a move. Rows must be those of an oracle that looks at all pairs and images, bit for bit;
/// a refusal must name a rule that the input breaks, with its numbers; and what breaks a rule must be refused. A case
/// takes at most some milliseconds.
///
/// ```
/// use parops::testing::{FuzzOutcome, fuzz_neighbor_build};
/// assert_eq!(fuzz_neighbor_build(b""), Ok(FuzzOutcome::Built));
/// ```
///
/// # Errors
/// The first [`FuzzFault`] found.
pub fn fuzz_neighbor_build(bytes: &[u8]) -> Checked<FuzzOutcome> {
    let mut bytes = Bytes(bytes);
    match bytes.up_to(3) {
        0 => providers::<2>(&mut bytes),
        1 => providers::<1>(&mut bytes),
        2 => providers::<3>(&mut bytes),
        _ => own_rows::list::<2>(&mut bytes),
    }
}

fn providers<const D: usize>(bytes: &mut Bytes) -> Checked<FuzzOutcome> {
    let wild = Wild::from(bytes);
    let scene = Scene::<D>::from(bytes, wild, MOST[D - 1]);
    let part = bytes.choose([0.25, 0.5, 0.125, 0.3, 0.05, 1.0 / 3.0]);
    let part = if bytes.once_in(2) { 0.5 * bytes.fraction() + 1e-3 } else { part };
    let cutoff = bytes.or_any(wild.lengths(), 2, part * scene.width());
    let made = scene.domain().and_then(|domain| Ok((domain, scene.particles()?)));
    let (domain, particles) = match made {
        Ok(made) => made,
        Err(error) => return refused("scene", &scene, &scene.points, cutoff, error),
    };
    let brute = match BruteForce::build(&particles, &domain, Cutoff(cutoff)) {
        Ok(brute) => brute,
        Err(error) => return refused("BruteForce", &scene, &scene.points, cutoff, error),
    };
    if let Some((p, value)) = scene.illegal(&scene.points, cutoff) {
        return Err(FuzzFault::Accepted { build: "BruteForce", p, value });
    }
    let oracle = Oracle::new(&scene, &domain, None, &scene.points, cutoff)?;
    against("BruteForce", &brute, &oracle)?;
    let cells = match CellList::build(&particles, &domain, Cutoff(cutoff)) {
        Ok(cells) => cells,
        Err(error) => return celled(&scene, cutoff, error),
    };
    against("CellList", &cells, &oracle)?;
    // One of the others, so that many cases fit a second.
    match bytes.byte() % 4 {
        0 => listed(&cells, &oracle, cutoff),
        1 => {
            #[cfg(feature = "kiddo")]
            if let Ok(tree) = crate::neighbors::KdTree::build(&particles, &domain, Cutoff(cutoff)) {
                against("KdTree", &tree, &oracle)?;
            }
            listed(&brute, &oracle, cutoff)
        }
        2 => apart(bytes, wild, &scene, &domain, &particles, cutoff),
        _ => moved(bytes, wild, &scene, &domain, &particles, cutoff),
    }
}

/// The rows of a provider, stored, and each pair of them once.
fn listed<const D: usize>(provider: &impl Neighbors<D>, oracle: &Oracle<D>, cutoff: f64) -> Checked<FuzzOutcome> {
    let list = NeighborList::from_provider(provider).map_err(|error| unasked("NeighborList", error))?;
    against("NeighborList", &list, oracle)?;
    halves(&list, oracle, cutoff)?;
    Ok(FuzzOutcome::Built)
}

fn against<const D: usize>(build: &'static str, provider: &impl Neighbors<D>, oracle: &Oracle<D>) -> Checked {
    check_provider_against(provider, oracle).map_err(|fault| FuzzFault::Provider { build, fault })
}

fn unasked(build: &'static str, error: Error) -> FuzzFault {
    FuzzFault::Refused { build, error }
}

fn refused<const D: usize>(
    build: &'static str,
    scene: &Scene<D>,
    points: &[[f64; D]],
    cutoff: f64,
    error: Error,
) -> Checked<FuzzOutcome> {
    let deserved = scene.deserves(&error, points, cutoff, false);
    if deserved { Ok(FuzzOutcome::Refused) } else { Err(unasked(build, error)) }
}

/// What brute force serves a cell list may refuse only for want of cells.
fn celled<const D: usize>(scene: &Scene<D>, cutoff: f64, error: Error) -> Checked<FuzzOutcome> {
    let cells = matches!(error.kind(), ErrorKind::Neighbor(NeighborError::Cells { .. }));
    let deserved = cells && scene.deserves(&error, &scene.points, cutoff, true);
    if deserved { Ok(FuzzOutcome::Refused) } else { Err(unasked("CellList", error)) }
}

/// A half list counts every neighbor, and adds up every separation.
fn halves<const D: usize>(list: &NeighborList<D>, oracle: &Oracle<D>, cutoff: f64) -> Checked {
    let made = HalfList::from_provider(list, Cutoff(cutoff));
    let half = made.map_err(|error| unasked("HalfList", error))?;
    let total: usize = (0..oracle.targets()).map(|p| oracle.row(p).count()).sum();
    let found = 2 * half.mutual() + half.single();
    close("the neighbors of a half list", 0, found as f64, total as f64, 0.0)?;
    let mut sums = vec![[0.0; 2]; oracle.targets()];
    let kinds = [Symmetry::Replicating, Symmetry::Conserved];
    let added = half.accumulate(kinds, &mut sums, |pair| [1.0, pair.separation[D - 1]]);
    added.map_err(|error| unasked("HalfList", error))?;
    for (p, &[count, sum]) in sums.iter().enumerate() {
        close("the neighbors of a half list", p, count, oracle.row(p).count() as f64, 0.0)?;
        let along = || oracle.row(p).map(|neighbor| neighbor.separation[D - 1]);
        // Two orders of n terms differ by 2 n eps of their absolute values at most.
        let tolerance = 2.0 * (count + 1.0) * f64::EPSILON * along().map(f64::abs).sum::<f64>();
        close("a sum over a half list", p, sum, along().sum(), tolerance)?;
    }
    Ok(())
}

/// Targets that are no particles.
fn apart<const D: usize>(
    bytes: &mut Bytes,
    wild: Wild,
    scene: &Scene<D>,
    domain: &Domain<D>,
    particles: &Particles<D>,
    cutoff: f64,
) -> Checked<FuzzOutcome> {
    let targets = shifted(bytes, wild, scene, 8);
    match CellList::build_at(&targets, particles, domain, Cutoff(cutoff)) {
        Ok(cells) => {
            if let Some((p, value)) = scene.illegal(&targets, cutoff) {
                return Err(FuzzFault::Accepted { build: "CellList", p, value });
            }
            let oracle = Oracle::new(scene, domain, Some(&targets), &scene.points, cutoff)?;
            against("CellList", &cells, &oracle)?;
            Ok(FuzzOutcome::Built)
        }
        Err(error) => refused("CellList", scene, &targets, cutoff, error),
    }
}

/// A Verlet list before and after its particles have moved.
fn moved<const D: usize>(
    bytes: &mut Bytes,
    wild: Wild,
    scene: &Scene<D>,
    domain: &Domain<D>,
    particles: &Particles<D>,
    cutoff: f64,
) -> Checked<FuzzOutcome> {
    let part = bytes.choose([0.0, 0.1, 0.25, 1e-3]);
    let skin = bytes.or_any(wild.settings(), 4, part * cutoff);
    let mut list = match VerletList::build(particles, domain, Cutoff(cutoff), skin) {
        Ok(list) => list,
        Err(error) => return skinned(scene, cutoff, skin, error),
    };
    if !(skin >= 0.0 && skin.is_finite()) {
        return Err(FuzzFault::Accepted { build: "VerletList", p: 0, value: skin });
    }
    let before = Oracle::new(scene, domain, None, &scene.points, cutoff)?;
    against("VerletList", &list, &before)?;
    let places = shifted(bytes, wild, scene, scene.points.len());
    let mut now = particles.clone();
    if let Err(error) = now.set_points(&places) {
        return refused("set_points", scene, &places, cutoff, error);
    }
    match list.update(&now) {
        Ok(_) => {
            if let Some((p, value)) = scene.illegal(&places, cutoff) {
                return Err(FuzzFault::Accepted { build: "VerletList", p, value });
            }
            list.validate(now.generation()).map_err(|error| unasked("VerletList", error))?;
            let after = Oracle::new(scene, domain, None, &places, cutoff)?;
            against("VerletList", &list, &after)?;
            Ok(FuzzOutcome::Built)
        }
        Err(error) => {
            // A failing update changes nothing.
            against("VerletList", &list, &before)?;
            match skinned(&Scene { points: places.clone(), ..scene.clone() }, cutoff, skin, error.clone()) {
                Err(_) => refused("VerletList", scene, &places, cutoff, error),
                outcome => outcome,
            }
        }
    }
}

/// What a skin may be refused for: itself, or the cutoff it makes.
fn skinned<const D: usize>(scene: &Scene<D>, cutoff: f64, skin: f64, error: Error) -> Checked<FuzzOutcome> {
    let points = scene.points.iter().flatten().chain(&scene.lower).chain(&scene.upper);
    let magnitude = points.filter(|x| x.is_finite()).fold(0.0, |high: f64, x| x.abs().max(high));
    let least = cutoff + skin;
    let most = least + 33.0 * f64::EPSILON * D as f64 * (magnitude + least);
    let within = |found: f64| least <= found && found <= most;
    let deserved = match *error.kind() {
        ErrorKind::Neighbor(NeighborError::Skin { skin: found }) => {
            super::rules::same(found, skin) && !(skin >= 0.0 && skin.is_finite())
        }
        ErrorKind::Neighbor(NeighborError::Cutoff { cutoff: found }) => !found.is_finite() && !most.is_finite(),
        ErrorKind::Neighbor(NeighborError::CutoffRange { cutoff: found, .. })
        | ErrorKind::Domain(DomainError::Narrow { cutoff: found, .. }) => {
            within(found) && scene.deserves(&error, &scene.points, found, false)
        }
        ErrorKind::Neighbor(NeighborError::Cells { .. }) => scene.deserves(&error, &scene.points, cutoff, true),
        _ => false,
    };
    if deserved { Ok(FuzzOutcome::Refused) } else { Err(unasked("VerletList", error)) }
}

/// So many of the points, moved a little, or across a periodic face.
fn shifted<const D: usize>(bytes: &mut Bytes, wild: Wild, scene: &Scene<D>, count: usize) -> Vec<[f64; D]> {
    let scale = bytes.choose([1e-3, 0.02, 0.3, 2.0]) * scene.width();
    let each = bytes.once_in(2);
    let all: [f64; D] = std::array::from_fn(|_| scale * (bytes.fraction() - 0.5));
    let point = |point: &[f64; D]| -> [f64; D] {
        std::array::from_fn(|axis| {
            let step = if each { scale * (f64::from(bytes.byte()) / 256.0 - 0.5) } else { all[axis] };
            let to = point[axis] + step;
            let periodic = scene.faces[axis][0] == crate::domain::Face::Periodic;
            let to = if periodic { to } else { to.max(scene.lower[axis]).min(scene.upper[axis]) };
            bytes.or_any(wild.points(), 64, to)
        })
    };
    scene.points.iter().take(count).map(point).collect()
}
