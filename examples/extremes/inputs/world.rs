//! What stands behind every call: a set, its lists, rows and a solver, held to what they were before.

use std::collections::hash_map::DefaultHasher;
use std::fmt::{self, Debug, Write};
use std::hash::Hasher;

use parops::{
    AdvectionDiffusion, CellList, Cutoff, DcPse, Diffusion, Domain, ErrorKind, Eulerian, Laplacian, Nearest,
    NeighborList, Particles, Result, Rk4, Rows, VerletList,
};

use crate::case::Case;

type Diffusing = AdvectionDiffusion<2, f64, (Diffusion<f64, DcPse<Laplacian<2>, 2>>, (), (), ())>;

/// Particles along an axis of the world, and their spacing.
pub const SIDE: usize = 12;
pub const H: f64 = 1.0 / SIDE as f64;

/// A jittered set of the unit torus with everything that is made of it.
pub struct World {
    pub particles: Particles<2>,
    pub torus: Domain<2>,
    pub cells: CellList<2>,
    pub list: NeighborList<2>,
    pub verlet: VerletList<2>,
    pub rows: Rows,
    pub run: Eulerian<2, Diffusing, Rk4<Vec<f64>>>,
    pub u: Vec<f64>,
}

impl World {
    pub fn new() -> Result<Self> {
        let particles = Particles::jittered([0.0; 2], [1.0; 2], [SIDE; 2], 0.2, 2)?;
        let torus = Domain::periodic([0.0; 2], [1.0; 2])?;
        let near = Nearest::build(&particles, &torus, 20)?;
        let cells = CellList::build(&particles, &torus, Cutoff(2.5 * H))?;
        let scene = AdvectionDiffusion::new().diffusion(0.01, DcPse::<Laplacian<2>, 2>::new());
        let mut run = Eulerian::new(scene, &particles, &near, Rk4::new())?;
        let mut u: Vec<f64> = particles.points().iter().map(|x| (6.3 * x[0]).sin() + x[1]).collect();
        run.step(&mut u, 1e-3)?;
        Ok(Self {
            list: NeighborList::from_provider(&cells)?,
            verlet: VerletList::build(&particles, &torus, Cutoff(2.5 * H), 0.2 * H)?,
            rows: DcPse::<Laplacian<2>, 2>::new().assemble(&near)?,
            particles,
            torus,
            cells,
            run,
            u,
        })
    }

    /// What the next step makes of the field: every row of the solver and all that its stepper remembers take part in it.
    fn next(mut self) -> Result<Vec<u64>> {
        self.run.step(&mut self.u, 1e-3)?;
        Ok(self.u.iter().map(|u| u.to_bits()).collect())
    }
}

impl Debug for World {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { particles, torus, cells, list, verlet, rows, run, u } = self;
        write!(f, "{particles:?}{torus:?}{cells:?}{list:?}{verlet:?}{rows:?}{u:?}{}{:?}", run.time(), run.ledger())
    }
}

/// Takes text and keeps its hash.
#[derive(Default)]
struct Fingerprint(DefaultHasher);

impl Write for Fingerprint {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        self.0.write(text.as_bytes());
        Ok(())
    }
}

/// The hash of all that a state shows of itself; f64 are written so that they can be read back.
fn hash(state: &impl Debug) -> u64 {
    let mut fingerprint = Fingerprint::default();
    // Hashing does not fail.
    let _ = write!(fingerprint, "{state:?}");
    fingerprint.0.finish()
}

/// Calls a door with a bad input. Met where it answers with the error that is due, naming that particle, and leaves the
/// world and `own`, what the case adds to it, with the hash they had, and the solver with the step it would have taken.
pub fn refused<S: Debug, T>(
    case: &mut Case,
    own: &mut S,
    particle: Option<usize>,
    due: impl Fn(&ErrorKind) -> bool,
    door: impl FnOnce(&mut World, &mut S) -> Result<T>,
) -> Result<()> {
    let mut world = World::new()?;
    let before = (hash(&world), hash(own));
    let error = door(&mut world, own).err();
    let same = before == (hash(&world), hash(own)) && world.next()? == World::new()?.next()?;
    let typed = error.as_ref().is_some_and(|error| due(error.kind()) && error.particle() == particle);
    let text = error.map_or(String::from("accepted"), |error| format!("{} ({error})", name(error.kind())));
    case.reports(typed && same, format!("{text}{}", if same { "" } else { ", and something CHANGED" }));
    Ok(())
}

/// The kind by layer and variant, without its numbers.
fn name(kind: &ErrorKind) -> String {
    let text = format!("{kind:?}");
    let inner = text.split_once('(').map_or(text.as_str(), |(_, inner)| inner);
    let variant: String = inner.chars().take_while(|c| c.is_alphanumeric()).collect();
    match text.split_once('(') {
        Some((layer, _)) => format!("{layer}Error::{variant}"),
        None => variant,
    }
}

/// Whether a kind is of this shape.
#[macro_export]
macro_rules! is {
    ($layer:ident, $pattern:pat $(if $guard:expr)?) => {
        |kind: &parops::ErrorKind| matches!(kind, parops::ErrorKind::$layer($pattern) $(if $guard)?)
    };
}
