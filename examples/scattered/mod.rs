//! Scattered particles on the unit torus, and central DC-PSE advection with hyperviscosity on them.

use parops::{DcPse, Domain, Laplacian, Nearest, Particles, Result, Site, Spacing, Stabilized, Transport};

/// Largest displacement of a particle from a lattice, in units of its spacing.
const JITTER: f64 = 0.2;

pub fn torus() -> Result<Domain<2>> {
    Domain::periodic([0.0; 2], [1.0; 2])
}

/// n particles along an axis.
pub fn scattered(n: usize) -> Result<Particles<2>> {
    Particles::jittered([0.0; 2], [1.0; 2], [n; 2], JITTER, 1)
}

/// The fewest neighbors for DC-PSE of order R.
pub fn nearest<const R: u32>(set: &Particles<2>) -> Result<Nearest<2>> {
    Nearest::build(set, &torus()?, DcPse::<Laplacian<2>, R>::new().fewest_neighbors::<2>()?)
}

/// The scheme of order R for n particles along an axis.
pub fn stabilized<const R: u32>(n: usize) -> Stabilized<2, R> {
    Stabilized::new(Spacing(1.0 / n as f64))
}

/// The gamma of the hyperviscosity that keeps DC-PSE of order 2 and 4 from growing; it has no unit, and a small set tells it
/// for all.
pub struct Gammas {
    pub second: f64,
    pub fourth: f64,
}

impl Gammas {
    /// Those for a flow as it is at t = 0.
    pub fn find(velocity: fn(&[f64; 2], f64) -> [f64; 2]) -> Result<Self> {
        Ok(Self { second: gamma::<2>(velocity)?, fourth: gamma::<4>(velocity)? })
    }
}

fn gamma<const R: u32>(velocity: fn(&[f64; 2], f64) -> [f64; 2]) -> Result<f64> {
    const COARSE: usize = 16;
    let set = scattered(COARSE)?;
    let near = nearest::<R>(&set)?;
    let (site, flow) = (Site::new(&set, &near)?, |p: usize| velocity(&set.points()[p], 0.0));
    Ok(stabilized::<R>(COARSE).build::<f64, _>(&site, flow, true, true, &near)?.gamma())
}
