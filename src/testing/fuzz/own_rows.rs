//! Rows of a caller's own from bytes.

use super::Checked;
use super::bytes::Bytes;
use super::fault::{FuzzFault, FuzzOutcome};
use super::rules::same;
use super::scene::Wild;
use crate::domain::{LENGTH_HIGH, LENGTH_LOW};
use crate::error::{Error, ErrorKind, NeighborError, Result};
use crate::neighbors::{NeighborList, Neighbors};
use crate::scale::Cutoff;
use crate::stencil::Neighbor;

/// The parts of a list.
#[derive(Clone, Debug)]
pub(super) struct OwnRows<const D: usize> {
    sources: usize,
    centers: Vec<Option<usize>>,
    offsets: Vec<usize>,
    neighbors: Vec<Neighbor<D>>,
    cutoff: f64,
}

impl<const D: usize> OwnRows<D> {
    /// So many rows, the neighbors of which lie anywhere within the cutoff.
    pub(super) fn from(bytes: &mut Bytes, wild: Wild, targets: usize, most: usize) -> Self {
        let sources = 1 + bytes.up_to(60);
        let cutoff = bytes.or_any(wild.lengths(), 4, 1.0);
        let mut rows = Self { sources, centers: Vec::new(), offsets: vec![0], neighbors: Vec::new(), cutoff };
        let off = bytes.once_in(4);
        for p in 0..targets {
            rows.centers.push(if off && bytes.once_in(2) { None } else { Some(p % sources) });
            let count = if bytes.once_in(4) { bytes.up_to(most) } else { most };
            for _ in 0..count {
                let q = bytes.up_to(if wild.faces() { sources } else { sources - 1 });
                let part = 2.0 / (D as f64).sqrt();
                let separation = std::array::from_fn(|_| {
                    let tame = part * (bytes.fraction() - 0.5);
                    bytes.or_any(wild.points(), 128, tame)
                });
                let sign = if wild.particles() {
                    bytes.choose([1, 1, 1, -1, 0, 2, i8::MIN])
                } else {
                    bytes.choose([1, 1, 1, -1])
                };
                rows.neighbors.push(Neighbor { q, separation, sign });
            }
            let slip = if wild.settings() && bytes.once_in(64) { bytes.up_to(3) } else { 0 };
            rows.offsets.push(rows.neighbors.len() + slip);
        }
        rows
    }

    pub(super) fn build(&self) -> Result<NeighborList<D>> {
        let Self { sources, centers, offsets, neighbors, cutoff } = self;
        NeighborList::from_rows(*sources, centers, offsets, neighbors, Cutoff(*cutoff), 1)
    }

    /// The first row that breaks a rule, if any: row 0 for the list as a whole.
    fn illegal(&self) -> Option<usize> {
        if !(LENGTH_LOW..=LENGTH_HIGH).contains(&self.cutoff) || self.offsets.last() != Some(&self.neighbors.len()) {
            return Some(0);
        }
        if let Some(p) = self.offsets.windows(2).position(|ends| ends[0] > ends[1]) {
            return Some(p);
        }
        (0..self.centers.len()).find(|&p| {
            let row = &self.neighbors[self.offsets[p]..self.offsets[p + 1]];
            let bad = |n: &Neighbor<D>| {
                let squared = n.separation.iter().fold(0.0, |sum, s| sum + s * s);
                let itself = self.centers[p] == Some(n.q) && n.sign == 1 && squared == 0.0 && n.separation == [0.0; D];
                let within = squared <= self.cutoff * self.cutoff;
                n.q >= self.sources || !within || (n.sign != 1 && n.sign != -1) || itself
            };
            row.iter().any(bad) || (1..row.len()).any(|i| row[..i].contains(&row[i]))
        })
    }
}

impl<const D: usize> OwnRows<D> {
    /// Whether the refusal names the first row that breaks a rule, and a neighbor of it.
    fn deserves(&self, error: &Error, illegal: Option<usize>) -> bool {
        let row = || {
            let p = error.particle().filter(|&p| Some(p) == illegal)?;
            Some(&self.neighbors[self.offsets[p]..self.offsets[p + 1]])
        };
        let any = |bad: &dyn Fn(&Neighbor<D>) -> bool| row().is_some_and(|row| row.iter().any(bad));
        let ErrorKind::Neighbor(kind) = error.kind() else { return false };
        match *kind {
            NeighborError::Cutoff { cutoff } => same(cutoff, self.cutoff) && !(cutoff > 0.0 && cutoff.is_finite()),
            NeighborError::CutoffRange { cutoff, low, high } => {
                cutoff == self.cutoff && (low, high) == (LENGTH_LOW, LENGTH_HIGH) && !(low <= cutoff && cutoff <= high)
            }
            NeighborError::Offsets { row, found, needed } => self.offsets[row] == found && found != needed,
            NeighborError::Source { q, sources } => sources == self.sources && q >= sources && any(&|n| n.q == q),
            NeighborError::Separation { q, axis, separation } => {
                !separation.is_finite() && any(&|n| n.q == q && same(n.separation[axis], separation))
            }
            NeighborError::Sign { q, sign } => sign != 1 && sign != -1 && any(&|n| (n.q, n.sign) == (q, sign)),
            NeighborError::Distance { q, distance, cutoff } => {
                cutoff == self.cutoff && !(distance <= cutoff * (1.0 - f64::EPSILON)) && any(&|n| n.q == q)
            }
            NeighborError::OwnCenter { q } => any(&|n| n.q == q && n.sign == 1 && n.separation == [0.0; D]),
            NeighborError::Repeated { q } => {
                row().is_some_and(|row| row.iter().any(|n| n.q == q && row.iter().filter(|&m| m == n).count() > 1))
            }
            _ => false,
        }
    }
}

/// A list is what it was made of, or breaks a rule in the row it names.
pub(super) fn list<const D: usize>(bytes: &mut Bytes) -> Checked<FuzzOutcome> {
    let wild = Wild::from(bytes);
    let targets = bytes.up_to(40);
    let most = bytes.up_to(12);
    let rows = OwnRows::<D>::from(bytes, wild, targets, most);
    let illegal = rows.illegal();
    let list = match rows.build() {
        Ok(list) => list,
        Err(error) => {
            let deserved = rows.deserves(&error, illegal);
            return if deserved {
                Ok(FuzzOutcome::Refused)
            } else {
                Err(FuzzFault::Refused { build: "from_rows", error })
            };
        }
    };
    if let Some(p) = illegal {
        return Err(FuzzFault::Accepted { build: "from_rows", p, value: rows.cutoff });
    }
    for p in 0..targets {
        let mut found = Vec::new();
        list.for_each(p, rows.cutoff, |neighbor| found.push(neighbor));
        let given = &rows.neighbors[rows.offsets[p]..rows.offsets[p + 1]];
        if found != given || list.center(p) != rows.centers[p] {
            let fault = crate::testing::ProviderFault::NotTheOracle { p, found: found.len(), expected: given.len() };
            return Err(FuzzFault::Provider { build: "from_rows", fault });
        }
    }
    Ok(FuzzOutcome::Built)
}
