//! The particle sets, in the unit box.

use parops::Particles;

/// Largest displacement from the lattice in units of its spacing.
const JITTER: f64 = 0.3;
const SEED: u64 = 7;

/// How particles are placed.
#[derive(Clone, Copy, PartialEq)]
pub enum Set {
    Jittered,
    Clustered,
}

impl Set {
    pub fn name(self) -> &'static str {
        match self {
            Self::Jittered => "jittered",
            Self::Clustered => "clustered",
        }
    }

    /// About `side`^D particles.
    pub fn particles<const D: usize>(self, side: usize) -> parops::Result<Particles<D>> {
        match self {
            Self::Jittered => Particles::jittered([0.0; D], [1.0; D], [side; D], JITTER, SEED),
            Self::Clustered => clustered(side),
        }
    }
}

/// A jittered lattice of points s around the center, moved to x = 1/2 + s (1 + b |s|^2), those within the box kept.
///
/// Spacings grow by 1 + b |s|^2 across the radius and 1 + 3 b |s|^2 along it. With g the growth across at the corners,
/// b |s|^2 = g - 1 there, the mean spacing (g^(D-1) (3 g - 2))^(1/D) grows by 4.0 from the center to the corners for
/// g = 8/3 in 2D and g = 3 in 3D.
fn clustered<const D: usize>(side: usize) -> parops::Result<Particles<D>> {
    let growth = if D == 2 { 8.0 / 3.0 } else { 3.0 };
    let corner = (D as f64).sqrt() / (2.0 * growth);
    let b = (growth - 1.0) / (corner * corner);
    // The preimage of a face reaches farthest at its center, where s (1 + b s^2) = 1/2.
    let reach = bisect(0.0, 0.5, |s| s * (1.0 + b * s * s) - 0.5);
    let target = side.pow(D as u32) as f64;
    let mut count = side;
    // The preimage of the box does not fill its own box: a second and third try meet the number of particles.
    for attempt in 0.. {
        let lattice = Particles::jittered([-reach; D], [reach; D], [count; D], JITTER, SEED)?;
        let moved = lattice.points().iter().map(|s| {
            let squared: f64 = s.iter().map(|s| s * s).sum();
            s.map(|s| 0.5 + s * (1.0 + b * squared))
        });
        let kept: Vec<[f64; D]> = moved.filter(|x| x.iter().all(|x| (0.0..=1.0).contains(x))).collect();
        if attempt == 2 {
            return Particles::new(kept);
        }
        let share = target / kept.len().max(1) as f64;
        count = (count as f64 * share.powf(1.0 / D as f64)).round() as usize;
    }
    Particles::new(Vec::new())
}

/// The zero of a rising function.
fn bisect(mut low: f64, mut high: f64, f: impl Fn(f64) -> f64) -> f64 {
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if f(middle) < 0.0 { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}
