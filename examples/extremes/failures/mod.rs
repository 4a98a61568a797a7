//! The known failure modes of particle methods.

mod moments;
mod naive_dcpse;
mod sets;

use crate::case::Duty::{Adapt, Detect, Document, Report};
use crate::case::{Duty, Entry, Scene};

const fn entry(number: u32, title: &'static str, duties: &'static [Duty], scene: Scene) -> Entry {
    Entry { number, title, duties, not_offered: None, scene }
}

pub const ENTRIES: [Entry; 6] = [
    entry(1, "ill-conditioned moments, too few neighbors", &[Detect, Report, Adapt], moments::ill_conditioned),
    entry(2, "lattice degeneracy", &[Detect, Adapt], moments::lattice),
    entry(3, "shell cutting", &[Report, Adapt], moments::shell_cut),
    entry(4, "unscaled monomials", &[Adapt], moments::unscaled),
    entry(5, "one-sided stencil, growth at edges", &[Report, Adapt], moments::one_sided),
    entry(32, "stencil-size oscillation", &[Document], moments::stencil_size),
];
