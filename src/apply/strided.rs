//! Several fields in one slice, with any strides.

use std::borrow::Borrow;
use std::ops::Deref;

use super::Field;
use super::blocks::BLOCK;
use crate::error::{ApplyError, Result};

/// A view of several fields in one slice: the value of field i at particle p stands at p s_0 + i s_1, with the strides
/// s_0 from particle to particle and s_1 from field to field. No two values share a place.
///
/// ```
/// use parops::Strided;
/// let stacked = Strided::stacked(&[0.0, 1.0, 2.0, 10.0, 11.0, 12.0][..], 2)?;
/// assert_eq!((stacked.particles(), stacked.fields(), stacked.get(2, 1)), (3, 2, Some(12.0)));
/// let padded = Strided::new(&[0.0, 10.0, -1.0, 1.0, 11.0, -1.0, 2.0, 12.0][..], [3, 2], [3, 1])?;
/// assert_eq!(padded.get(2, 1), Some(12.0));
/// assert!(Strided::new(&[0.0; 6][..], [3, 2], [2, 2]).is_err());
/// # parops::Result::Ok(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Strided<S> {
    data: S,
    particles: usize,
    fields: usize,
    strides: [usize; 2],
}

impl<T: Copy, S: Deref<Target = [T]>> Strided<S> {
    /// `shape` and `strides` in the order particles, fields. Either the fields lie apart, s_1 > (N - 1) s_0, or the
    /// particles do, s_0 > (F - 1) s_1.
    ///
    /// # Errors
    /// [`ApplyError::Strides`] where values would share a place or lie beyond the slice.
    pub fn new(data: S, shape: [usize; 2], strides: [usize; 2]) -> Result<Self> {
        let [particles, fields] = shape;
        let last = |count: usize, stride: usize| count.saturating_sub(1).checked_mul(stride);
        // The values of one line lie at most `within` apart; lines are `stride` apart.
        let apart =
            |lines: usize, stride: usize, within: Option<usize>| lines <= 1 || within.is_some_and(|w| stride > w);
        let (along, across) = (last(particles, strides[0]), last(fields, strides[1]));
        let fields_apart = apart(particles, strides[0], Some(0)) && apart(fields, strides[1], along);
        let particles_apart = apart(fields, strides[1], Some(0)) && apart(particles, strides[0], across);
        let end = along.zip(across).and_then(|(a, b)| a.checked_add(b));
        let inside = end.is_some_and(|end| end < data.len());
        if particles == 0 || fields == 0 {
            // No stride is ever gone along.
            Ok(Self { data, particles, fields, strides: [0; 2] })
        } else if inside && (fields_apart || particles_apart) {
            Ok(Self { data, particles, fields, strides })
        } else {
            Err(ApplyError::Strides { particles, fields, strides, places: data.len() }.into())
        }
    }

    /// Fields stored one after the other, without gaps.
    ///
    /// # Errors
    /// [`ApplyError::Strides`] where the slice is not a whole number of fields.
    pub fn stacked(data: S, fields: usize) -> Result<Self> {
        let particles = Self::share(&data, fields)?;
        Self::new(data, [particles, fields], [1, particles])
    }

    /// Particles stored one after the other, without gaps.
    ///
    /// # Errors
    /// [`ApplyError::Strides`] where the slice is not a whole number of particles.
    pub fn interleaved(data: S, fields: usize) -> Result<Self> {
        let particles = Self::share(&data, fields)?;
        Self::new(data, [particles, fields], [fields, 1])
    }

    fn share(data: &S, fields: usize) -> Result<usize> {
        let places = data.len();
        match places.checked_div(fields) {
            Some(particles) if particles * fields == places => Ok(particles),
            None if places == 0 => Ok(0),
            _ => Err(ApplyError::Strides { particles: 0, fields, strides: [0; 2], places }.into()),
        }
    }

    /// Number of particles N.
    pub fn particles(&self) -> usize {
        self.particles
    }

    /// Number of fields F.
    pub fn fields(&self) -> usize {
        self.fields
    }

    /// The value of field i at particle p, where both exist.
    pub fn get(&self, p: usize, i: usize) -> Option<T> {
        (p < self.particles && i < self.fields).then(|| self.data[p * self.strides[0] + i * self.strides[1]])
    }

    /// The first particle, and there the first field, whose value is not finite.
    pub(super) fn not_finite(&self) -> Option<(usize, usize, T)>
    where
        T: Field,
    {
        // Gaps may hold anything, so that only a slice without a bad value is known to be good at once.
        if self.particles == 0 || all_finite(&self.data) {
            return None;
        }
        let bad = |i: usize| {
            let start = self.data.get(i * self.strides[1]..).unwrap_or_default();
            let mut line = start.iter().step_by(self.strides[0].max(1)).take(self.particles);
            line.position(|x| !x.is_finite()).and_then(|p| Some((p, i, self.get(p, i)?)))
        };
        (0..self.fields).filter_map(bad).min_by_key(|&(p, i, _)| (p, i))
    }
}

/// Whether all values are finite, many at a time.
fn all_finite<T: Field>(values: &[T]) -> bool {
    values.chunks(64).all(|values| values.iter().fold(true, |all, x| all & x.is_finite()))
}

/// Applies the rows to all fields, as many at a time as fit a sweep.
pub(super) fn sweep_fields<T: Field>(f: &Strided<&[T]>, out: &mut Strided<&mut [T]>, rows: &impl LaneRows<T>) {
    let mut first = 0;
    while out.particles > 0 && first < out.fields {
        first += match out.fields - first {
            // Of stacked fields every lane reads a cache line of its own: four at a time measured fastest.
            8.. if f.strides[1] == 1 => chunk::<T, 8>(f, out, first, rows),
            4.. => chunk::<T, 4>(f, out, first, rows),
            2.. => chunk::<T, 2>(f, out, first, rows),
            _ => chunk::<T, 1>(f, out, first, rows),
        };
    }
}

/// Rows that are applied to C fields, given their values at a source.
pub(super) trait LaneRows<T>: Sync {
    fn lanes<V: Borrow<[T; C]>, const C: usize>(&self, p: usize, value: impl Fn(usize) -> V) -> [T; C];
}

fn chunk<T: Field, const C: usize>(
    f: &Strided<&[T]>,
    out: &mut Strided<&mut [T]>,
    first: usize,
    rows: &impl LaneRows<T>,
) -> usize {
    let [particle, field] = out.strides;
    let data = out.data.get_mut(first * field..).unwrap_or_default();
    let places: Places<'_, T, C> = if field > out.particles.saturating_sub(1) * particle {
        let mut lines = data.chunks_mut(field);
        Places::Stacked { lines: std::array::from_fn(|_| lines.next().unwrap_or_default()), particle }
    } else {
        Places::Mixed { data, particle, field }
    };
    let [particle, field] = f.strides;
    let data = f.data.get(first * field..).unwrap_or_default();
    if field == 1 {
        let value = |q: usize| &data[q * particle..][..C].as_chunks::<C>().0[0];
        fill(places, 0, out.particles, &|p| rows.lanes(p, value));
    } else {
        let lines: [&[T]; C] = std::array::from_fn(|i| data.get(i * field..).unwrap_or_default());
        fill(places, 0, out.particles, &|p| rows.lanes(p, |q| lines.map(|line| line[q * particle])));
    }
    C
}

/// Where C fields of a run of particles are written.
enum Places<'a, T, const C: usize> {
    Stacked { lines: [&'a mut [T]; C], particle: usize },
    Mixed { data: &'a mut [T], particle: usize, field: usize },
}

impl<T: Copy, const C: usize> Places<'_, T, C> {
    #[inline(always)]
    fn set(&mut self, p: usize, values: [T; C]) {
        match self {
            Self::Stacked { lines, particle } => {
                lines.iter_mut().zip(values).for_each(|(line, value)| line[p * *particle] = value);
            }
            Self::Mixed { data, particle, field } => {
                values.into_iter().enumerate().for_each(|(i, value)| data[p * *particle + i * *field] = value);
            }
        }
    }

    /// The first `count` particles, and the rest.
    #[cfg(feature = "rayon")]
    fn split(self, count: usize) -> (Self, Self) {
        match self {
            Self::Stacked { mut lines, particle } => {
                let heads = lines.each_mut().map(|line| line.split_off_mut(..count * particle).unwrap_or_default());
                (Self::Stacked { lines: heads, particle }, Self::Stacked { lines, particle })
            }
            Self::Mixed { data, particle, field } => {
                let (head, tail) = data.split_at_mut(count * particle);
                (Self::Mixed { data: head, particle, field }, Self::Mixed { data: tail, particle, field })
            }
        }
    }
}

/// Writes every row, on the threads of the pool where the feature `rayon` is on.
fn fill<T: Field, const C: usize>(
    mut places: Places<'_, T, C>,
    first: usize,
    count: usize,
    row: &(impl Fn(usize) -> [T; C] + Sync),
) {
    if cfg!(feature = "rayon") && count > BLOCK {
        #[cfg(feature = "rayon")]
        {
            let half = count / 2;
            let (head, tail) = places.split(half);
            rayon::join(|| fill(head, first, half, row), || fill(tail, first + half, count - half, row));
        }
        return;
    }
    for p in 0..count {
        places.set(p, row(first + p));
    }
}
