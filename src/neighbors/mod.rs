//! Neighbor providers: who lies within the cutoff of whom.

mod block;
mod brute_force;
mod canonical;
mod cell_list;
mod colored;
mod grid;
mod half;
mod links;
mod list;
mod measure;
mod nearest;
mod order;
mod overlap;
mod pair;
mod placed;
mod probes;
mod quality;
mod reflected;
mod row_check;
mod rows;
mod selected;
mod table;
#[cfg(feature = "kiddo")]
mod tree;
mod upstream;
mod verlet;

pub use brute_force::BruteForce;
pub use canonical::Canonical;
pub use cell_list::CellList;
pub use half::HalfList;
pub use list::NeighborList;
pub use measure::{epsilon_from_neighbors, mean_neighbor_distance, volumes_from_neighbors};
pub use nearest::Nearest;
pub use overlap::{fill_distance, least_gap};
pub use pair::{Pair, Symmetry};
pub use quality::SetQuality;
pub(crate) use reflected::Reflected;
pub use selected::Selected;
#[cfg(feature = "kiddo")]
pub use tree::KdTree;
pub use upstream::Upstream;
pub use verlet::VerletList;

use crate::domain::Domain;
use crate::error::Result;
use crate::stencil::{Neighbor, Stencil};

/// Answers, for every target p, which source particles (or images of them) lie within a cutoff.
///
/// Targets and sources may be different sets. A neighbor at exactly the cutoff is in. The center (the source that
/// is target p) is not its own neighbor, but images of it behind periodic or mirror faces are.
/// The order of a row is the provider's own, always the same for the same provider and set.
/// A query beyond [`reach`](Self::reach) is answered up to the reach; operators check the reach before they ask.
#[diagnostic::on_unimplemented(
    message = "`{Self}` is no provider of neighbors in {D} dimensions",
    label = "expected a neighbor provider in {D} dimensions",
    note = "the operator, the particles and the provider must agree on the number of dimensions"
)]
pub trait Neighbors<const D: usize>: Sync {
    /// Number of targets.
    fn targets(&self) -> usize;

    /// Number of sources, owned first, then ghosts.
    fn sources(&self) -> usize;

    /// Number of sources this process owns; the rest are ghosts.
    fn owned(&self) -> usize {
        self.sources()
    }

    /// The source that is target p; `None` off the particles.
    fn center(&self, p: usize) -> Option<usize>;

    /// The cutoff r_c the provider was built with for target p.
    fn cutoff(&self, p: usize) -> f64;

    /// The largest cutoff a query may ask for.
    fn reach(&self) -> f64;

    /// The generation of the particle set this provider answers for.
    fn generation(&self) -> u64;

    /// The domain whose images stand in the rows; `None`, as by default, where the provider does not say. The divergence of a
    /// velocity is then computed only where no image is within reach.
    fn domain(&self) -> Option<&Domain<D>> {
        None
    }

    /// Visits every neighbor of p with |x_p - x_q| <= `cutoff`, but the center.
    fn for_each(&self, p: usize, cutoff: f64, visit: impl FnMut(Neighbor<D>))
    where
        Self: Sized;

    /// Writes the neighbors of p within `cutoff` into `row`.
    fn gather(&self, p: usize, cutoff: f64, row: &mut Stencil<D>)
    where
        Self: Sized,
    {
        row.reset(p, self.center(p), cutoff);
        self.for_each(p, cutoff, |neighbor| row.push(neighbor));
    }

    /// How many neighbors p has within `cutoff`.
    fn count(&self, p: usize, cutoff: f64) -> usize
    where
        Self: Sized,
    {
        let mut count = 0;
        self.for_each(p, cutoff, |_| count += 1);
        count
    }

    /// All rows up to the reach, stored: what [`NeighborList::from_provider`] returns. A provider that knows a shorter
    /// form of its rows overrides it.
    ///
    /// # Errors
    /// As [`NeighborList::from_provider`].
    fn stored(&self) -> Result<NeighborList<D>>
    where
        Self: Sized,
    {
        NeighborList::measured(self)
    }

    /// The same neighbors with every row sorted by separation, so that sums over a row do not depend on the provider,
    /// nor on the numbering unless two neighbors of a row lie at one place (those keep the order of their numbers).
    /// Sorting costs 0.6 to 4.6 microseconds a row.
    fn canonical(self) -> Canonical<Self>
    where
        Self: Sized,
    {
        Canonical(self)
    }
}
