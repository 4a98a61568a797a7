//! Whether a neighbor provider keeps its promises.

use std::collections::BTreeMap;
use std::fmt;

use crate::domain::Domain;
use crate::neighbors::Neighbors;
use crate::stencil::{Neighbor, Stencil};

/// How a provider breaks the contract of [`Neighbors`]; `p` is the target concerned.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum ProviderFault {
    /// The center of a target is no source.
    Center {
        /// Target.
        p: usize,
        /// The center named.
        center: usize,
        /// Number of sources.
        sources: usize,
    },
    /// More owned sources than sources, or a cutoff beyond the reach.
    Bounds {
        /// Target, 0 for the counts.
        p: usize,
        /// The number found.
        found: f64,
        /// Its largest legal value.
        limit: f64,
    },
    /// A neighbor that is no source.
    Source {
        /// Target.
        p: usize,
        /// The neighbor.
        q: usize,
    },
    /// The target itself stands in its row.
    OwnCenter {
        /// Target.
        p: usize,
    },
    /// A separation that is not finite, or beyond the cutoff.
    Separation {
        /// Target.
        p: usize,
        /// The neighbor.
        q: usize,
        /// Distance found.
        distance: f64,
        /// The cutoff asked for.
        cutoff: f64,
    },
    /// A sign other than 1 and -1.
    Sign {
        /// Target.
        p: usize,
        /// The neighbor.
        q: usize,
        /// The sign.
        sign: i8,
    },
    /// `for_each`, `gather` and `count` do not agree.
    Disagree {
        /// Target.
        p: usize,
        /// Neighbors visited.
        visited: usize,
        /// Neighbors gathered.
        gathered: usize,
        /// Neighbors counted.
        counted: usize,
    },
    /// A row asked for twice came in another order or with other neighbors.
    Unsteady {
        /// Target.
        p: usize,
    },
    /// A smaller cutoff does not give the subset.
    NotMonotone {
        /// Target.
        p: usize,
        /// The smaller cutoff.
        cutoff: f64,
        /// Neighbors it gave.
        found: usize,
        /// Neighbors within it in the full row.
        expected: usize,
    },
    /// q is a neighbor of p, but p is not in the same way one of q.
    NotSymmetric {
        /// Target.
        p: usize,
        /// Its neighbor.
        q: usize,
    },
    /// Mirrors of the oracle that the provider does not tell of by its domain, or others.
    Mirrors {
        /// The axis.
        axis: usize,
    },
    /// The row differs from that of the oracle.
    NotTheOracle {
        /// Target (the number of targets where that differs).
        p: usize,
        /// Neighbors found.
        found: usize,
        /// Neighbors the oracle finds.
        expected: usize,
    },
}

impl fmt::Display for ProviderFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "provider broke its contract: {self:?}")
    }
}

impl std::error::Error for ProviderFault {}

type Result = std::result::Result<(), ProviderFault>;

/// A neighbor in a form that can be ordered: source, bits of the separation, sign.
type Key<const D: usize> = (usize, [u64; D], i8);

/// Checks everything a provider promises that can be checked without knowing the points.
///
/// Centers and neighbors exist, the center is not in its own row, separations are finite and within the cutoff,
/// signs are 1 or -1, `for_each`, `gather` and `count` agree, rows are the same when asked again, a smaller cutoff
/// gives the subset, and where targets are sources, q is a neighbor of p just as p is one of q (equal lengths along
/// every axis, equal sign). Cost: 12 queries a target.
///
/// A particle exactly on an even mirror coincides with its own image, which this check takes for the center; use
/// [`check_provider_against`] an oracle there.
///
/// # Errors
/// The first [`ProviderFault`] found.
pub fn check_provider<const D: usize>(provider: &impl Neighbors<D>) -> Result {
    check_rows(provider, true)
}

/// Checks a provider as [`check_provider`] does, and that its rows are those of `oracle` as sets, bit for bit, at
/// the smaller of the two reaches and below. By its domain it tells of the mirrors that the oracle has, and of no others.
///
/// [`BruteForce`](crate::BruteForce) on the same points and domain is the oracle to take.
///
/// # Errors
/// The first [`ProviderFault`] found.
pub fn check_provider_against<const D: usize>(provider: &impl Neighbors<D>, oracle: &impl Neighbors<D>) -> Result {
    if provider.targets() != oracle.targets() || provider.sources() != oracle.sources() {
        let (p, found, expected) = (provider.targets(), provider.sources(), oracle.sources());
        return Err(ProviderFault::NotTheOracle { p, found, expected });
    }
    let mirrors = |domain: Option<&Domain<D>>, axis| domain.map_or(vec![], |domain| domain.mirrors(axis).collect());
    if let Some(axis) = (0..D).find(|&axis| mirrors(provider.domain(), axis) != mirrors(oracle.domain(), axis)) {
        return Err(ProviderFault::Mirrors { axis });
    }
    check_rows(provider, false)?;
    let reach = provider.reach().min(oracle.reach());
    for p in 0..provider.targets() {
        for cutoff in SMALLER.map(|part| part * reach) {
            let (found, expected) = (sorted(provider, p, cutoff), sorted(oracle, p, cutoff));
            if found != expected || provider.center(p) != oracle.center(p) {
                return Err(ProviderFault::NotTheOracle { p, found: found.len(), expected: expected.len() });
            }
        }
    }
    Ok(())
}

/// Parts of the reach that rows are asked for.
const SMALLER: [f64; 4] = [1.0, 0.75, 0.5, 0.0];

fn check_rows<const D: usize>(provider: &impl Neighbors<D>, own_center: bool) -> Result {
    let (targets, sources, reach) = (provider.targets(), provider.sources(), provider.reach());
    if provider.owned() > sources {
        return Err(ProviderFault::Bounds { p: 0, found: provider.owned() as f64, limit: sources as f64 });
    }
    for p in 0..targets {
        if let Some(center) = provider.center(p).filter(|&center| center >= sources) {
            return Err(ProviderFault::Center { p, center, sources });
        }
        if !(provider.cutoff(p) <= reach) {
            return Err(ProviderFault::Bounds { p, found: provider.cutoff(p), limit: reach });
        }
        let mut full = Vec::new();
        provider.for_each(p, reach, |neighbor| full.push(neighbor));
        for part in SMALLER {
            check_row(provider, p, part * reach, &full, own_center)?;
        }
    }
    check_symmetry(provider)
}

fn check_row<const D: usize>(
    provider: &impl Neighbors<D>,
    p: usize,
    cutoff: f64,
    full: &[Neighbor<D>],
    own_center: bool,
) -> Result {
    let mut visited = Vec::new();
    provider.for_each(p, cutoff, |neighbor| visited.push(neighbor));
    for &Neighbor { q, separation, sign } in &visited {
        if q >= provider.sources() {
            return Err(ProviderFault::Source { p, q });
        }
        if !(squared(&separation) <= cutoff * cutoff) {
            return Err(ProviderFault::Separation { p, q, distance: squared(&separation).sqrt(), cutoff });
        }
        if sign != 1 && sign != -1 {
            return Err(ProviderFault::Sign { p, q, sign });
        }
        if own_center && provider.center(p) == Some(q) && sign == 1 && separation == [0.0; D] {
            return Err(ProviderFault::OwnCenter { p });
        }
    }
    let mut row = Stencil::default();
    provider.gather(p, cutoff, &mut row);
    let counted = provider.count(p, cutoff);
    let named = (row.target(), row.center(), row.cutoff()) == (p, provider.center(p), cutoff);
    if !named || counted != visited.len() || !row.iter().eq(visited.iter().copied()) {
        return Err(ProviderFault::Disagree { p, visited: visited.len(), gathered: row.len(), counted });
    }
    let mut again = Vec::new();
    provider.for_each(p, cutoff, |neighbor| again.push(neighbor));
    if again != visited {
        return Err(ProviderFault::Unsteady { p });
    }
    let mut expected: Vec<_> = full.iter().filter(|n| squared(&n.separation) <= cutoff * cutoff).map(key).collect();
    expected.sort_unstable();
    if sorted(provider, p, cutoff) != expected {
        return Err(ProviderFault::NotMonotone { p, cutoff, found: visited.len(), expected: expected.len() });
    }
    Ok(())
}

/// Every pair is counted up from one side and down from the other; along a mirrored axis both separations are equal,
/// along the others opposite, so that lengths are compared.
fn check_symmetry<const D: usize>(provider: &impl Neighbors<D>) -> Result {
    let targets = provider.targets();
    let all_centers = targets == provider.sources() && (0..targets).all(|p| provider.center(p) == Some(p));
    if !all_centers {
        return Ok(());
    }
    let mut pairs: BTreeMap<(usize, Key<D>), i64> = BTreeMap::new();
    for p in 0..targets {
        provider.for_each(p, provider.reach(), |n| {
            let lengths = n.separation.map(|s| s.abs().to_bits());
            *pairs.entry((p, (n.q, lengths, n.sign))).or_default() += 1;
            *pairs.entry((n.q, (p, lengths, n.sign))).or_default() -= 1;
        });
    }
    match pairs.into_iter().find(|&(_, balance)| balance != 0) {
        Some(((p, (q, ..)), balance)) if balance > 0 => Err(ProviderFault::NotSymmetric { p, q }),
        Some(((q, (p, ..)), _)) => Err(ProviderFault::NotSymmetric { p, q }),
        None => Ok(()),
    }
}

fn sorted<const D: usize>(provider: &impl Neighbors<D>, p: usize, cutoff: f64) -> Vec<Key<D>> {
    let mut row = Vec::new();
    provider.for_each(p, cutoff, |neighbor| row.push(key(&neighbor)));
    row.sort_unstable();
    row
}

fn key<const D: usize>(neighbor: &Neighbor<D>) -> Key<D> {
    // Adding zero makes -0 and +0 one number.
    (neighbor.q, neighbor.separation.map(|s| (s + 0.0).to_bits()), neighbor.sign)
}

fn squared<const D: usize>(separation: &[f64; D]) -> f64 {
    separation.iter().fold(0.0, |sum, s| sum + s * s)
}
