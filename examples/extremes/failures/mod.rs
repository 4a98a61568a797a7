//! The known failure modes of particle methods.

mod consistency;
mod moments;
pub mod naive_dcpse;
mod neighbors;
mod overlap;
mod remesh;
pub mod ring;
pub mod sets;
pub mod spectra;
mod steps;

use crate::case::Duty::{Adapt, Detect, Document, Prevent, Report};
use crate::case::{Duty, Entry, Scene};

const fn entry(number: u32, title: &'static str, duties: &'static [Duty], scene: Scene) -> Entry {
    Entry { number, title, duties, not_offered: None, scene }
}

const fn without(entry: Entry, reason: &'static str) -> Entry {
    Entry { not_offered: Some(reason), ..entry }
}

pub const ENTRIES: [Entry; 32] = [
    entry(1, "ill-conditioned moments, too few neighbors", &[Detect, Report, Adapt], moments::ill_conditioned),
    entry(2, "lattice degeneracy", &[Detect, Adapt], moments::lattice),
    entry(3, "shell cutting", &[Report, Adapt], moments::shell_cut),
    entry(4, "unscaled monomials", &[Adapt], moments::unscaled),
    entry(5, "one-sided stencil, growth at edges", &[Report, Adapt], moments::one_sided),
    entry(6, "inconsistency on disordered sets", &[Detect, Report, Adapt], consistency::disorder),
    entry(7, "resolution path with fixed overlap", &[Report, Document], consistency::fixed_overlap),
    entry(8, "advection eigenvalues right of the axis", &[Detect, Report, Adapt], spectra::advection),
    entry(9, "hyperviscosity too small or too large", &[Adapt], spectra::hyperviscosity),
    entry(10, "overlap loss, holes", &[Detect, Report, Adapt], overlap::overlap_lost),
    without(
        entry(11, "clustering, stagnation lines", &[Report], overlap::clustering),
        "merging, splitting and shifting of particles: remeshing puts an even set in their place, and keeps the moments",
    ),
    entry(12, "pairing", &[Report, Document], overlap::pairing),
    entry(13, "tensile instability", &[Detect, Document], overlap::tensile),
    without(
        entry(14, "negative remeshing weights, overshoot", &[Report], remesh::negative_weights),
        "a limiter in flagged cells: it would give up the moments that remeshing is to keep",
    ),
    entry(15, "LCFL breach", &[Detect, Report, Adapt], remesh::lcfl),
    entry(16, "large LCFL taken for convergence", &[Prevent, Document], remesh::fixed_lcfl),
    entry(17, "diffusion limit", &[Detect, Adapt], steps::diffusion_limit),
    without(
        entry(18, "stiff source", &[Detect, Report], steps::stiff_source),
        "a source taken implicitly: its Jacobian is not known; substeps serve, and implicit schemes keep it explicit",
    ),
    without(
        entry(19, "discontinuity, Gibbs", &[Report], steps::discontinuity),
        "a limiter for higher orders: upwind of order 1 keeps the extrema",
    ),
    without(
        entry(20, "positivity loss of diffusion", &[Report], spectra::positivity),
        "positive stencils by linear programming: a later option",
    ),
    without(
        entry(21, "mass drift of operators that are not symmetric", &[Report], steps::mass_drift),
        "redistribution of the drift: it would hide what the ledger shows; the symmetric operator is PSE",
    ),
    entry(22, "periodic image errors", &[Detect, Prevent], neighbors::images),
    entry(23, "wrap rounding", &[Adapt], neighbors::wrap),
    entry(24, "seams and thread order", &[Prevent], neighbors::seams),
    entry(25, "duplicate and aligned points", &[Prevent], neighbors::duplicates),
    entry(26, "silent NaN", &[Detect, Report], steps::silent_nan),
    without(
        entry(27, "neighbor iteration that does not converge", &[Report], neighbors::isolated),
        "an epsilon iterated to a number of neighbors: the search for the k nearest ends in one pass",
    ),
    entry(28, "wrong length in a formula", &[Prevent], consistency::wrong_length),
    entry(29, "index overflow", &[Detect, Prevent], neighbors::index_overflow),
    entry(30, "volumes not updated", &[Prevent, Report, Document], overlap::frozen_volumes),
    entry(31, "error read at particles only", &[Prevent], consistency::between_particles),
    entry(32, "stencil-size oscillation", &[Document], moments::stencil_size),
];
