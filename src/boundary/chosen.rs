//! The boundary particles as targets of their own, each with the cutoff that holds the nearest particles it needs.

use crate::domain::Domain;
use crate::error::Result;
use crate::neighbors::Neighbors;
use crate::particles::reserved;
use crate::stencil::{Neighbor, Stencil};

/// Some targets of a provider, numbered anew.
pub(super) struct Chosen<'a, P> {
    all: &'a P,
    particles: &'a [usize],
    cutoffs: Vec<f64>,
}

/// Whole shells: a neighbor as far away as the last one but for rounding is in.
const SHELL: f64 = 1.0 + 1e-9;

impl<'a, P> Chosen<'a, P> {
    /// The cutoff of each target is the distance of its neighbor number `needed`, or the reach where there are fewer:
    /// the method then refuses the row with its numbers.
    pub(super) fn new<const D: usize>(all: &'a P, particles: &'a [usize], needed: usize) -> Result<Self>
    where
        P: Neighbors<D>,
    {
        let reach = all.reach();
        let mut cutoffs = reserved(particles.len())?;
        let (mut row, mut squares) = (Stencil::default(), Vec::new());
        for &p in particles {
            all.gather(p, reach, &mut row);
            squares.clear();
            squares.extend(row.separations().iter().map(|s| s.iter().fold(0.0, |sum, x| sum + x * x)));
            let last = needed.saturating_sub(1);
            let cutoff = if last < squares.len() {
                let (_, square, _) = squares.select_nth_unstable_by(last, f64::total_cmp);
                (square.sqrt() * SHELL).min(reach)
            } else {
                reach
            };
            cutoffs.push(cutoff);
        }
        Ok(Self { all, particles, cutoffs })
    }
}

impl<const D: usize, P: Neighbors<D>> Neighbors<D> for Chosen<'_, P> {
    fn targets(&self) -> usize {
        self.particles.len()
    }

    fn sources(&self) -> usize {
        self.all.sources()
    }

    fn owned(&self) -> usize {
        self.all.owned()
    }

    fn center(&self, i: usize) -> Option<usize> {
        self.particles.get(i).and_then(|&p| self.all.center(p))
    }

    fn cutoff(&self, i: usize) -> f64 {
        self.cutoffs.get(i).copied().unwrap_or(self.all.reach())
    }

    fn reach(&self) -> f64 {
        self.all.reach()
    }

    fn generation(&self) -> u64 {
        self.all.generation()
    }

    fn domain(&self) -> Option<&Domain<D>> {
        self.all.domain()
    }

    fn for_each(&self, i: usize, cutoff: f64, visit: impl FnMut(Neighbor<D>)) {
        if let Some(&p) = self.particles.get(i) {
            self.all.for_each(p, cutoff, visit);
        }
    }
}
