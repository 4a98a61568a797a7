//! The sets of the scenes, and what is measured on more than one of them.

use std::f64::consts::TAU;

use parops::{CellList, Cutoff, DcPse, Domain, Expression, Laplacian, MultiIndex, Nearest, Particles, Result};

pub fn torus<const D: usize>() -> Result<Domain<D>> {
    Domain::periodic([0.0; D], [1.0; D])
}

/// m x m particles of the unit square, each up to `amount` spacings off its place.
pub fn square(m: usize, amount: f64, seed: u64) -> Result<Particles<2>> {
    Particles::jittered([0.0; 2], [1.0; 2], [m; 2], amount, seed)
}

/// D^beta.
pub fn derivative(beta: [u8; 2]) -> Result<Expression<2>> {
    Expression::new([(MultiIndex::new(beta), 1.0)])
}

/// The Laplacian as an expression: one method for all scalar operators of the scenes.
pub fn laplacian() -> Result<Expression<2>> {
    Expression::of(&Laplacian::<2>)
}

/// DC-PSE of an order known at run time.
pub fn dcpse(operator: Expression<2>, order: u32) -> Result<DcPse<Expression<2>>> {
    DcPse::at_order(operator, order)
}

/// All pairs of a set within a cutoff, for sums written out by hand.
pub fn cells(particles: &Particles<2>, domain: &Domain<2>, cutoff: f64) -> Result<CellList<2>> {
    CellList::build(particles, domain, Cutoff(cutoff))
}

/// The 2 l nearest of every particle.
pub fn nearest(particles: &Particles<2>, domain: &Domain<2>, method: &DcPse<Expression<2>>) -> Result<Nearest<2>> {
    Nearest::build(particles, domain, method.fewest_neighbors()?)
}

/// A wave of the unit torus.
pub fn wave(x: &[f64; 2]) -> f64 {
    (TAU * x[0]).sin() * (TAU * x[1]).cos()
}

/// Its values at the particles.
pub fn values(particles: &Particles<2>, f: impl FnMut(&[f64; 2]) -> f64) -> Vec<f64> {
    particles.points().iter().map(f).collect()
}

/// sqrt(mean((found - exact)^2) / mean(exact^2)).
pub fn relative_error(found: &[f64], exact: &[f64]) -> f64 {
    let square: f64 = found.iter().zip(exact).map(|(found, exact)| (found - exact).powi(2)).sum();
    (square / exact.iter().map(|exact| exact * exact).sum::<f64>()).sqrt()
}

/// The order between two errors of grids whose spacings are as `ratio`.
pub fn order(coarse: f64, fine: f64, ratio: f64) -> f64 {
    (coarse / fine).ln() / ratio.ln()
}

/// Numbers as text, for a line of a case.
pub fn listed(numbers: impl IntoIterator<Item = f64>) -> String {
    numbers
        .into_iter()
        .map(|x| if x.abs() < 1e-2 || x.abs() >= 1e4 { format!("{x:.2e}") } else { format!("{x:.3}") })
        .collect::<Vec<_>>()
        .join(", ")
}
