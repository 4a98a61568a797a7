//! The particle sets in the unit box, and the targets taken from them.

use parops::{Neighbors, Particles, Random};

/// How particles are placed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Set {
    /// Whole shells: the order is one higher where r is odd.
    Lattice,
    /// Displaced from a lattice by up to 0.3 h.
    Jittered,
    /// A Kronecker sequence in one dimension, Halton points beyond, where a Kronecker set is locally a lattice: its
    /// stencils are almost symmetric, by a share that changes with N, and odd orders come out between r and r + 1.
    QuasiRandom,
    /// As jittered, with the outermost particles on the faces themselves.
    Boundary,
}

const JITTER: f64 = 0.3;

impl Set {
    pub fn name(self) -> &'static str {
        match self {
            Self::Lattice => "lattice",
            Self::Jittered => "jittered",
            Self::QuasiRandom => "quasi-random",
            Self::Boundary => "boundary",
        }
    }

    /// The spacing h of a set of so many particles made for `side` along an axis.
    pub fn spacing<const D: usize>(self, side: usize, particles: usize) -> f64 {
        match self {
            Self::Boundary => 1.0 / (side - 1) as f64,
            _ => (particles as f64).powf(-1.0 / D as f64),
        }
    }

    /// About `side`^D particles.
    ///
    /// # Errors
    /// None for a side of at least 2.
    pub fn particles<const D: usize>(self, side: usize, seed: u64) -> parops::Result<Particles<D>> {
        let (lower, upper) = ([0.0; D], [1.0; D]);
        match self {
            Self::Lattice => Particles::lattice(lower, upper, [side; D]),
            Self::Jittered => Particles::jittered(lower, upper, [side; D], JITTER, seed),
            Self::QuasiRandom if D == 1 => Particles::quasi_random(lower, upper, side, seed),
            Self::QuasiRandom => Particles::new(halton(side.pow(D as u32), seed)),
            Self::Boundary => {
                // One cell more than gaps: the middles of the outermost cells are the faces.
                let h = 1.0 / (side - 1) as f64;
                let wide = Particles::jittered([-0.5 * h; D], [1.0 + 0.5 * h; D], [side; D], JITTER, seed)?;
                let fitted = |x: f64| {
                    if x < 0.5 * h {
                        0.0
                    } else if x > 1.0 - 0.5 * h {
                        1.0
                    } else {
                        x
                    }
                };
                Particles::new(wide.points().iter().map(|x| x.map(fitted)).collect())
            }
        }
    }
}

/// Halton points, the radical inverses of 1, 2, ... in bases 2, 3 and 5, shifted at random and wrapped into the box.
fn halton<const D: usize>(count: usize, seed: u64) -> Vec<[f64; D]> {
    let mut random = Random::new(seed);
    let shift: [f64; D] = std::array::from_fn(|_| random.uniform());
    let inverse = |mut i: usize, base: usize| {
        let (mut value, mut digit) = (0.0, 1.0);
        while i > 0 {
            digit /= base as f64;
            value += digit * (i % base) as f64;
            i /= base;
        }
        value
    };
    (1..=count).map(|i| std::array::from_fn(|axis| (inverse(i, [2, 3, 5][axis]) + shift[axis]).fract())).collect()
}

/// Some particles of a set as targets, each its own center.
pub struct Chosen<P> {
    /// Neighbors of the places of the targets, the targets themselves among them.
    neighbors: P,
    targets: Vec<usize>,
}

impl<P> Chosen<P> {
    pub fn new<const D: usize>(neighbors: P, targets: Vec<usize>) -> Self
    where
        P: Neighbors<D>,
    {
        Self { neighbors, targets }
    }
}

impl<P: Neighbors<D>, const D: usize> Neighbors<D> for Chosen<P> {
    fn targets(&self) -> usize {
        self.targets.len()
    }

    fn sources(&self) -> usize {
        self.neighbors.sources()
    }

    fn center(&self, p: usize) -> Option<usize> {
        self.targets.get(p).copied()
    }

    fn cutoff(&self, p: usize) -> f64 {
        self.neighbors.cutoff(p)
    }

    fn reach(&self) -> f64 {
        self.neighbors.reach()
    }

    fn generation(&self) -> u64 {
        self.neighbors.generation()
    }

    fn for_each(&self, p: usize, cutoff: f64, mut visit: impl FnMut(parops::Neighbor<D>)) {
        let center = self.center(p);
        self.neighbors.for_each(p, cutoff, |neighbor| {
            if Some(neighbor.q) != center {
                visit(neighbor);
            }
        });
    }
}
