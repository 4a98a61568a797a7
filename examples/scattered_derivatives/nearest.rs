//! A provider of our own: every particle has the cutoff that holds its nearest neighbors, however the spacing varies.

use parops::{CellList, Cutoff, Domain, Neighbor, Neighbors, Particles, Stencil};

/// Cell lists of growing reach; a query is answered by the finest that reaches far enough, so that dense regions are
/// not searched in the cells of thin ones.
pub struct Nearest<const D: usize> {
    levels: Vec<CellList<D>>,
    cutoffs: Vec<f64>,
}

/// From one level to the next.
const GROWTH: f64 = 1.3;
/// Whole shells: a neighbor as far away as the last one but for rounding is in.
const SHELL: f64 = 1.0 + 1e-9;

impl<const D: usize> Nearest<D> {
    /// The cutoff of each particle is the distance of its neighbor number `needed`. `first` is the reach the search
    /// starts from.
    pub fn build(particles: &Particles<D>, needed: usize, first: f64) -> parops::Result<Self> {
        let (mut levels, mut reach) = (Vec::new(), first);
        let mut cutoffs = vec![0.0; particles.len()];
        let mut open: Vec<usize> = (0..particles.len()).collect();
        let mut row = Stencil::default();
        let mut distances = Vec::new();
        // More than all others no particle can ask for: the operator then says that there are too few.
        let needed = needed.clamp(1, particles.len().saturating_sub(1).max(1));
        while !open.is_empty() {
            let cells = CellList::build(particles, &Domain::open(), Cutoff(reach))?;
            open.retain(|&p| {
                cells.gather(p, reach, &mut row);
                if row.len() < needed {
                    return true;
                }
                distances.clear();
                distances.extend(row.separations().iter().map(|z| z.iter().map(|z| z * z).sum::<f64>()));
                let (_, last, _) = distances.select_nth_unstable_by(needed - 1, f64::total_cmp);
                cutoffs[p] = last.sqrt() * SHELL;
                cutoffs[p] > reach
            });
            levels.push(cells);
            reach *= GROWTH;
        }
        Ok(Self { levels, cutoffs })
    }

    fn level(&self, cutoff: f64) -> &CellList<D> {
        let finest = self.levels.partition_point(|level| level.reach() < cutoff);
        &self.levels[finest.min(self.levels.len() - 1)]
    }
}

impl<const D: usize> Neighbors<D> for Nearest<D> {
    fn targets(&self) -> usize {
        self.cutoffs.len()
    }

    fn sources(&self) -> usize {
        self.cutoffs.len()
    }

    fn center(&self, p: usize) -> Option<usize> {
        Some(p)
    }

    fn cutoff(&self, p: usize) -> f64 {
        self.cutoffs[p]
    }

    fn reach(&self) -> f64 {
        self.level(f64::INFINITY).reach()
    }

    fn generation(&self) -> u64 {
        self.levels[0].generation()
    }

    fn for_each(&self, p: usize, cutoff: f64, visit: impl FnMut(Neighbor<D>)) {
        self.level(cutoff).for_each(p, cutoff, visit);
    }

    fn gather(&self, p: usize, cutoff: f64, row: &mut Stencil<D>) {
        self.level(cutoff).gather(p, cutoff, row);
    }

    fn count(&self, p: usize, cutoff: f64) -> usize {
        self.level(cutoff).count(p, cutoff)
    }
}
