//! Rows in files, by the package `serde`; what is read is checked before it becomes rows.

use serde::de::{DeserializeOwned, Error as _};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::rows::{Centers, Rows};
use super::{Field, Report};
use crate::error::{ApplyError, Error, NeighborError, OperatorError, ParticleError, Result};
use crate::particles::{PARTICLES_HIGH, Particles};

/// The generation of no particle set: rows from a file belong to none yet.
const UNBOUND: u64 = 0;

/// What is written of rows; numbers of all outputs stand pair by pair.
#[derive(Serialize)]
struct Written<'a, T> {
    outputs: usize,
    sources: usize,
    offsets: &'a [usize],
    columns: &'a [u32],
    weights: &'a [T],
    diagonal: &'a [T],
    /// Empty where target p is source p.
    centers: &'a [Option<u32>],
    report: &'a Report,
}

/// What is read, before any check.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Read<T> {
    outputs: usize,
    sources: usize,
    offsets: Vec<usize>,
    columns: Vec<u32>,
    weights: Vec<T>,
    diagonal: Vec<T>,
    centers: Vec<Option<u32>>,
    report: Report,
}

impl<const K: usize, T: Field + Serialize> Serialize for Rows<[f64; K], T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> std::result::Result<S::Ok, S::Error> {
        let centers = match &self.centers {
            Centers::Same => &[],
            Centers::Each(centers) => centers.as_slice(),
        };
        let written = Written {
            outputs: K,
            sources: self.sources,
            offsets: &self.offsets,
            columns: &self.columns,
            weights: self.weights.as_flattened(),
            diagonal: self.diagonal.as_flattened(),
            centers,
            report: &self.report,
        };
        written.serialize(serializer)
    }
}

impl<'de, const K: usize, T: Field + DeserializeOwned> Deserialize<'de> for Rows<[f64; K], T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> std::result::Result<Self, D::Error> {
        Self::checked(Read::deserialize(deserializer)?).map_err(D::Error::custom)
    }
}

impl<const K: usize, T: Field> Rows<[f64; K], T> {
    fn checked(read: Read<T>) -> Result<Self> {
        let Read { outputs, sources, offsets, columns, weights, diagonal, centers, report } = read;
        length(outputs, K)?;
        if sources > PARTICLES_HIGH {
            return Err(ParticleError::TooMany { count: sources, limit: PARTICLES_HIGH }.into());
        }
        let targets = offsets.len().checked_sub(1).ok_or(ParticleError::Length { found: 0, needed: 1 })?;
        let mut needed = 0;
        for (row, &found) in offsets.iter().enumerate() {
            if found < needed || (row == 0 && found > 0) || (row == targets && found != columns.len()) {
                let needed = if row == targets { columns.len() } else { needed };
                return Err(Error::from(NeighborError::Offsets { row, found, needed }).at(row));
            }
            needed = found;
        }
        length(report.rows, targets)?;
        length(weights.len(), columns.len().saturating_mul(K))?;
        if !diagonal.is_empty() {
            length(diagonal.len(), targets.saturating_mul(K))?;
        }
        let exists = |q: u32| if (q as usize) < sources { Ok(()) } else { Err(unknown(q, sources)) };
        for (p, ends) in offsets.windows(2).enumerate() {
            let row = ends[0]..ends[1];
            columns[row.clone()].iter().try_for_each(|&q| exists(q)).map_err(|error| error.at(p))?;
            finite(&weights[row.start * K..row.end * K], &columns[row]).map_err(|error| error.at(p))?;
            if !diagonal.is_empty() {
                finite(&diagonal[p * K..(p + 1) * K], &[p as u32]).map_err(|error| error.at(p))?;
            }
        }
        let centers = if centers.is_empty() {
            if targets > sources {
                return Err(unknown(sources as u32, sources).at(sources));
            }
            Centers::Same
        } else {
            length(centers.len(), targets)?;
            let named = centers.iter().enumerate();
            named.filter_map(|(p, q)| Some((p, (*q)?))).try_for_each(|(p, q)| exists(q).map_err(|e| e.at(p)))?;
            Centers::Each(centers)
        };
        let (weights, diagonal) = (weights.as_chunks().0.to_vec(), diagonal.as_chunks().0.to_vec());
        Ok(Self { offsets, columns, weights, diagonal, centers, sources, generation: UNBOUND, report })
    }

    /// Binds rows read from a file to the particles they are for, so that [`validate`](Self::validate) accepts their
    /// generation.
    ///
    /// A generation has a meaning within one process only, so it is not saved, and rows just read are stale to every
    /// set. That these particles stand where those stood that the rows were built from, the caller has to know; that
    /// they are as many is checked.
    ///
    /// # Errors
    /// [`ApplyError::Stale`] where the rows already belong to another generation;
    /// [`ParticleError::Length`] for another number of particles than the rows have sources.
    pub fn bind<const D: usize>(&mut self, particles: &Particles<D>) -> Result<()> {
        let (rows, set) = (self.generation, particles.generation());
        if rows != UNBOUND && rows != set {
            return Err(ApplyError::Stale { rows, set }.into());
        }
        length(particles.len(), self.sources)?;
        self.generation = set;
        Ok(())
    }
}

fn length(found: usize, needed: usize) -> Result<()> {
    if found == needed { Ok(()) } else { Err(ParticleError::Length { found, needed }.into()) }
}

fn unknown(q: u32, sources: usize) -> Error {
    NeighborError::Source { q: q as usize, sources }.into()
}

/// Refuses weights that are not finite; each column has as many.
fn finite<T: Field>(weights: &[T], columns: &[u32]) -> Result<()> {
    let each = weights.len() / columns.len().max(1);
    match weights.iter().position(|w| !w.is_finite()) {
        Some(i) => Err(OperatorError::Weight { q: columns[i / each] as usize, weight: weights[i].as_() }.into()),
        None => Ok(()),
    }
}
