//! Half lists: every pair of particles stored and visited once, for both of its partners.

use std::ops::Range;
use std::sync::Arc;

use super::block::{Block, ROWS};
use super::colored::Colored;
use super::links::Links;
use super::placed::{check_cutoff, difference, distance_squared, within};
use super::rows::Rows;
use super::{Neighbors, Pair, Symmetry};
use crate::domain::Image;
use crate::error::{ApplyError, Error, NeighborError, Result};
use crate::particles::reserved;
use crate::scalar::Scalar;
use crate::scale::Cutoff;
use crate::stencil::Neighbor;

/// The pairs within a cutoff, each of them once: p and q < p exchange their contributions in one visit.
///
/// A pair is *mutual* where q stands in the row of p with x_p - x_q and p in the row of q with x_q - x_p: two
/// particles, or a particle and a periodic image of another. Its contribution to q follows from that to p by a sign
/// per component ([`Symmetry`]). What lies behind a mirror is no partner: the image of q seen from p, and that of p
/// seen from q, are not opposite to each other, so both are visited, and each serves its own target alone. So do a
/// particle's own images, and rows of a caller's own list that are not symmetric. Sums over a half list are therefore
/// the full sums over the rows of its provider, on any domain.
///
/// Rows are cut into at most 32 blocks of consecutive particles. Blocks that write to disjoint ranges are done at
/// the same time (feature `rayon`), so that the bits of a sum depend on the provider and the numbering alone. That
/// needs neighbors with near numbers ([`sorted_by_cell`](crate::Particles::sorted_by_cell)); in random order all
/// blocks are done one after another.
///
/// ```
/// use parops::{CellList, Cutoff, Domain, HalfList, Particles, Symmetry};
/// let ring = Particles::lattice([0.0], [1.0], [8])?;
/// let cells = CellList::build(&ring, &Domain::periodic([0.0], [1.0])?, Cutoff(0.125))?;
/// let half = HalfList::from_provider(&cells, Cutoff(0.125))?;
/// assert_eq!((half.mutual(), half.single()), (8, 0));
/// // A spring between neighbors, and how many there are.
/// let mut sums = vec![[0.0; 2]; 8];
/// half.accumulate([Symmetry::Conserved, Symmetry::Replicating], &mut sums, |pair| [-pair.separation[0], 1.0])?;
/// assert_eq!(sums, vec![[0.0, 2.0]; 8]);
/// # parops::Result::Ok(())
/// ```
///
/// Source: notes 001, sec. 2.3 and 2.4 (conserved and replicating quantities, half lists), with errata 50: a particle is
/// no partner of itself. See also: [`VerletList`](crate::VerletList), a provider to make half lists from while particles
/// move little.
#[derive(Clone, Debug)]
pub struct HalfList<const D: usize> {
    particles: usize,
    cutoff: f64,
    generation: u64,
    /// Row p holds its mutual partners q > p.
    mutual: Rows<D>,
    single: Rows<D>,
    any_single: bool,
    blocks: Colored,
}

impl<const D: usize> HalfList<D> {
    /// The pairs that stand in the rows of a provider up to `cutoff`.
    ///
    /// From a [`CellList`](crate::CellList), a list stored from one, or a [`VerletList`](crate::VerletList) it takes 2
    /// bytes a neighbor beside the points; other rows are compared pair by pair, and their separations kept.
    ///
    /// # Errors
    /// [`NeighborError::Cutoff`] and [`NeighborError::CutoffRange`] for an illegal cutoff, [`NeighborError::Reach`] for
    /// one beyond the provider; [`NeighborError::NotParticle`] naming a target that is not the particle of its own
    /// number; [`NeighborError::Source`] for a neighbor that does not exist;
    /// [`ParticleError::Memory`](crate::ParticleError::Memory) where the list does not fit.
    pub fn from_provider(provider: &impl Neighbors<D>, cutoff: Cutoff) -> Result<Self> {
        check_cutoff(cutoff)?;
        let (targets, sources, reach) = (provider.targets(), provider.sources(), provider.reach());
        if !(cutoff.0 <= reach) {
            return Err(NeighborError::Reach { cutoff: cutoff.0, reach }.into());
        }
        for p in 0..targets.max(sources) {
            let center = provider.center(p).filter(|_| p < targets).unwrap_or(sources);
            if center != p || p >= sources {
                return Err(Error::from(NeighborError::NotParticle { center, sources }).at(p));
            }
        }
        let (mutual, single) = match provider.stored()?.into_rows() {
            Rows::Linked(placed, links) => {
                let limit = (cutoff.0 < placed.cutoff).then(|| within(cutoff.0));
                let part = |mutual: bool| {
                    Links::rows(targets, |p, half| {
                        let (sources, images) = links[p / ROWS].row(p % ROWS);
                        for (i, &q) in sources.iter().enumerate() {
                            let image = images.get(i).copied().unwrap_or(Image::OWN);
                            let shifted = image == Image::OWN || image.is_shift(&placed.domain);
                            let exchanges = shifted && q as usize != p;
                            let wanted = if mutual { exchanges && q as usize > p } else { !exchanges };
                            let near = |limit: f64| {
                                let target = &placed.sources[p];
                                distance_squared(&placed.neighbor(image, target, q).separation) <= limit
                            };
                            if wanted && limit.is_none_or(near) {
                                half.push(q, image);
                            }
                        }
                    })
                };
                let linked = |links| Rows::Linked(Arc::clone(&placed), Arc::new(links));
                (linked(part(true)?), linked(part(false)?))
            }
            rows => compared(&rows, targets, cutoff.0)?,
        };
        let last = |p: usize| {
            let mut last = p;
            mutual.visit(p, f64::INFINITY, true, |neighbor| last = last.max(neighbor.q));
            last
        };
        let (blocks, any_single) = (Colored::new(targets, last)?, single.total() > 0);
        let generation = provider.generation();
        Ok(Self { particles: targets, cutoff: cutoff.0, generation, mutual, single, any_single, blocks })
    }

    /// Number of particles N.
    pub fn particles(&self) -> usize {
        self.particles
    }

    /// The cutoff r_c of all pairs.
    pub fn cutoff(&self) -> Cutoff {
        Cutoff(self.cutoff)
    }

    /// Number of mutual pairs: half the neighbors they stand for.
    pub fn mutual(&self) -> usize {
        self.mutual.total()
    }

    /// Number of neighbors that serve their target alone.
    pub fn single(&self) -> usize {
        self.single.total()
    }

    /// The generation of the particles the list was made for.
    pub fn generation(&self) -> u64 {
        self.generation
    }

    /// Refuses a list that was made for another generation of the particles.
    ///
    /// # Errors
    /// [`NeighborError::Stale`] where it was.
    pub fn validate(&self, generation: u64) -> Result<()> {
        let list = self.generation;
        if list == generation { Ok(()) } else { Err(NeighborError::Stale { list, set: generation }.into()) }
    }

    /// Visits every pair once, in the order of p: for what [`accumulate`](Self::accumulate) does not cover.
    pub fn for_each_pair(&self, mut visit: impl FnMut(&Pair<D>)) {
        for p in 0..self.particles {
            self.visit_row(p, &mut visit);
        }
    }

    /// Adds what every pair exchanges to `out`: `interaction(pair)` is the contribution c of q to p, component by
    /// component; where the pair is mutual q receives +/- c by the [`Symmetry`] of the component.
    ///
    /// out_p,k += sum_q c_k(p, q) over the whole row of p, images among them. The components with
    /// [`Conserved`](Symmetry::Conserved) sum to zero over all particles but for rounding (mirrors excepted, through
    /// which a caller's quantity may flow). Costs one evaluation a pair; allocates nothing; the same bits for any
    /// number of threads.
    ///
    /// # Errors
    /// [`ApplyError::Output`] where `out` is not as long as there are particles; it is then as it was.
    pub fn accumulate<T: Scalar, const K: usize>(
        &self,
        symmetry: [Symmetry; K],
        out: &mut [[T; K]],
        interaction: impl Fn(&Pair<D>) -> [T; K] + Sync,
    ) -> Result<()> {
        if out.len() != self.particles {
            return Err(ApplyError::Output { found: out.len(), needed: self.particles }.into());
        }
        let conserved = symmetry.map(|symmetry| symmetry == Symmetry::Conserved);
        self.each_block(out, |rows, out| {
            let first = rows.start;
            for p in rows {
                let mut sum = [T::zero(); K];
                self.visit_row(p, &mut |pair: &Pair<D>| {
                    let given = interaction(pair);
                    for k in 0..K {
                        sum[k] += given[k];
                    }
                    if pair.mutual {
                        let partner = &mut out[pair.q - first];
                        for k in 0..K {
                            if conserved[k] {
                                partner[k] -= given[k];
                            } else {
                                partner[k] += given[k];
                            }
                        }
                    }
                });
                for k in 0..K {
                    out[p - first][k] += sum[k];
                }
            }
            Ok(())
        })
    }

    /// Does every block of rows, as [`Colored::each`].
    pub(crate) fn each_block<T: Send>(
        &self,
        out: &mut [T],
        work: impl Fn(Range<usize>, &mut [T]) -> Result<()> + Sync,
    ) -> Result<()> {
        self.blocks.each(out, &work)
    }

    /// Mutual pairs of p first, then what serves p alone.
    #[inline(always)]
    fn visit_row(&self, p: usize, visit: &mut impl FnMut(&Pair<D>)) {
        let pair = |Neighbor { q, separation, sign }, mutual| Pair { p, q, separation, sign, mutual };
        self.mutual.visit(p, f64::INFINITY, true, |neighbor| visit(&pair(neighbor, true)));
        if self.any_single {
            self.single.visit(p, f64::INFINITY, true, |neighbor| visit(&pair(neighbor, false)));
        }
    }

    /// Adds partners and separations times `factor` of the mutual pairs of p.
    #[inline(always)]
    pub(crate) fn gather_mutual(&self, p: usize, factor: f64, sources: &mut Vec<u32>, z: &mut Vec<[f64; D]>) {
        if let Rows::Linked(placed, links) = &self.mutual {
            let (row, images) = links[p / ROWS].row(p % ROWS);
            if images.is_empty() {
                let target = &placed.sources[p];
                sources.extend_from_slice(row);
                z.extend(row.iter().map(|&q| difference(target, &placed.sources[q as usize]).map(|s| s * factor)));
                return;
            }
        }
        self.mutual.visit(p, f64::INFINITY, true, |neighbor| {
            sources.push(neighbor.q as u32);
            z.push(neighbor.separation.map(|s| s * factor));
        });
    }

    /// Visits the neighbors that serve p alone.
    #[inline(always)]
    pub(crate) fn visit_single(&self, p: usize, visit: impl FnMut(Neighbor<D>)) {
        if self.any_single {
            self.single.visit(p, f64::INFINITY, true, visit);
        }
    }
}

/// Rows sorted into mutual pairs and the rest, by looking for the opposite of every neighbor in the other row.
fn compared<const D: usize>(rows: &Rows<D>, targets: usize, cutoff: f64) -> Result<(Rows<D>, Rows<D>)> {
    let mut halves = [reserved(targets.div_ceil(ROWS))?, reserved(targets.div_ceil(ROWS))?];
    let mut blocks = [Block::empty(), Block::empty()];
    let row_of = |p: usize, row: &mut Vec<Neighbor<D>>| {
        row.clear();
        rows.visit(p, cutoff, false, |neighbor| row.push(neighbor));
    };
    let (mut row, mut other) = (Vec::new(), Vec::new());
    for p in 0..targets {
        row_of(p, &mut row);
        for (i, &neighbor) in row.iter().enumerate() {
            let Neighbor { q, separation, sign } = neighbor;
            if q >= targets {
                return Err(Error::from(NeighborError::Source { q, sources: targets }).at(p));
            }
            row_of(q, &mut other);
            // Of several at one place the first meets the first.
            let before = row[..i].iter().filter(|&&n| n == neighbor).count();
            let opposite = Neighbor { q: p, separation: separation.map(|s| -s), sign };
            let mutual = q != p && sign == 1 && other.iter().filter(|&&n| n == opposite).count() > before;
            match mutual {
                true if q < p => {}
                true => blocks[0].push(neighbor),
                false => blocks[1].push(neighbor),
            }
        }
        for (block, half) in blocks.iter_mut().zip(&mut halves) {
            block.end_row();
            if p + 1 == targets || (p + 1).is_multiple_of(ROWS) {
                half.push(block.pack()?);
            }
        }
    }
    let [mutual, single] = halves;
    Ok((Rows::Measured(Arc::new(mutual)), Rows::Measured(Arc::new(single))))
}
