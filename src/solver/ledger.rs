//! What a run has to show after every step.

use std::io::{self, Write};

use super::fields::Fields;
use crate::error::{Limit, Result};
use crate::io::counted;
use crate::particles::Particles;

/// The sums and extrema of one field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Totals<const D: usize> {
    /// sum_p omega_p.
    pub mass: f64,
    /// sum_p |omega_p|, what a drift is to be compared with.
    pub size: f64,
    /// sum_p omega_p x_p,i.
    pub first: [f64; D],
    /// sum_p omega_p x_p,i x_p,j.
    pub second: [[f64; D]; D],
    /// Smallest value u_p.
    pub min: f64,
    /// Largest value u_p.
    pub max: f64,
    /// Sum of all negative omega_p.
    pub negative_mass: f64,
    /// Mass now less mass at the start of the run.
    pub drift: f64,
    /// Strength below the threshold that became no particle, in all remeshings so far.
    pub dropped: f64,
    /// The same with absolute values.
    pub dropped_size: f64,
}

/// Particles summed one by one before block sums are: the error of a sum is of the order of this plus N over it, in eps of
/// the sum of absolute values.
const BLOCK: usize = 512;

impl<const D: usize> Totals<D> {
    /// The totals of strengths omega_p and values u_p = `of(p)` at these points; the drift is left at zero.
    pub fn measure(points: &[[f64; D]], of: impl Fn(usize) -> (f64, f64)) -> Self {
        let mut all = Self::NOTHING;
        for (block, points) in points.chunks(BLOCK).enumerate() {
            let mut part = Self::NOTHING;
            for (i, x) in points.iter().enumerate() {
                let (strength, value) = of(block * BLOCK + i);
                part.mass += strength;
                part.size += strength.abs();
                part.negative_mass += strength.min(0.0);
                part.min = part.min.min(value);
                part.max = part.max.max(value);
                for (i, (first, second)) in part.first.iter_mut().zip(&mut part.second).enumerate() {
                    let moment = strength * x[i];
                    *first += moment;
                    second.iter_mut().zip(x).skip(i).for_each(|(second, x)| *second += moment * x);
                }
            }
            all.merge(&part);
        }
        for i in 0..D {
            for j in 0..i {
                all.second[i][j] = all.second[j][i];
            }
        }
        all
    }

    const NOTHING: Self = Self {
        mass: 0.0,
        size: 0.0,
        first: [0.0; D],
        second: [[0.0; D]; D],
        min: f64::INFINITY,
        max: f64::NEG_INFINITY,
        negative_mass: 0.0,
        drift: 0.0,
        dropped: 0.0,
        dropped_size: 0.0,
    };

    /// Takes other totals, but what has been dropped, and the drift from the mass at the start.
    pub(super) fn renew(&mut self, now: Self, start: Option<f64>) {
        let drift = now.mass - start.unwrap_or(now.mass);
        *self = Self { drift, dropped: self.dropped, dropped_size: self.dropped_size, ..now };
    }

    fn merge(&mut self, part: &Self) {
        self.mass += part.mass;
        self.size += part.size;
        self.negative_mass += part.negative_mass;
        self.min = self.min.min(part.min);
        self.max = self.max.max(part.max);
        for i in 0..D {
            self.first[i] += part.first[i];
            for j in i..D {
                self.second[i][j] += part.second[i][j];
            }
        }
    }
}

/// One row of the ledger: the state of a run after a step.
///
/// omega_p = V_p u_p, with V_p = 1 where the particles have no volumes.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct LedgerRow<const D: usize> {
    /// Steps done.
    pub step: u64,
    /// Time after the step.
    pub t: f64,
    /// The step.
    pub dt: f64,
    /// The longest legal step at its beginning; infinite without a limit.
    pub limit: f64,
    /// What bound it.
    pub binding: Option<Limit>,
    /// Whether the step kept the limit, substep by substep. Nothing is promised about stability where it did not.
    pub within_limit: bool,
    /// Into how many substeps the step was cut; 1 for a step taken as asked.
    pub substeps: u32,
    /// Substeps beyond the first, summed over the run.
    pub retries: u64,
    /// The largest growth rate of a mode, in 1/time, estimated when the rows were made, on moving particles when their
    /// neighbors were searched last; NaN where nothing was estimated or an estimate settled nothing.
    pub growth: f64,
    /// Worst condition number of a moment system in use.
    pub condition: f64,
    /// Worst miss of a moment condition in use, in scaled units.
    pub residual: f64,
    /// Remeshings so far.
    pub remeshings: u64,
    /// How often the neighbors of moving particles were searched anew so far, remeshings included.
    pub rebuilds: u64,
    /// The largest hole when it was measured last, in spacings of the mesh, see [`OverlapWatch`](super::OverlapWatch); none
    /// where nobody asked (NaN in the text).
    pub hole: Option<f64>,
    /// The least gap then.
    pub gap: Option<f64>,
    /// The largest legal |drift| over size; infinite where none is set.
    pub budget: f64,
    /// The totals, field by field.
    pub fields: Vec<Totals<D>>,
}

impl<const D: usize> LedgerRow<D> {
    /// A row before the first step.
    pub(super) fn new(fields: usize) -> Self {
        Self {
            step: 0,
            t: 0.0,
            dt: 0.0,
            limit: f64::INFINITY,
            binding: None,
            within_limit: true,
            substeps: 0,
            retries: 0,
            growth: f64::NAN,
            condition: 0.0,
            residual: 0.0,
            remeshings: 0,
            rebuilds: 0,
            hole: None,
            gap: None,
            budget: f64::INFINITY,
            fields: vec![Totals::NOTHING; fields],
        }
    }

    /// Measures all fields of u at these particles; drifts are taken from `start`, the masses at the start of the run.
    pub(super) fn measure<E: Fields>(&mut self, particles: &Particles<D>, u: &[E], start: &[f64]) {
        let volumes = particles.volumes().ok();
        let volume = |p: usize| volumes.and_then(|volumes| volumes.get(p).ok()).unwrap_or(1.0);
        for (i, totals) in self.fields.iter_mut().enumerate() {
            let of = |p: usize| u.get(p).map_or((0.0, 0.0), |u| (volume(p) * u.get(i), u.get(i)));
            totals.renew(Totals::measure(particles.points(), of), start.get(i).copied());
        }
    }
}

/// The rows of a run, kept by the caller: hand [`push`](Self::push) to the progress callback.
///
/// ```
/// let mut ledger = parops::Ledger::<2>::default();
/// let mut text = Vec::new();
/// ledger.write_csv(&mut text)?;
/// assert!(text.starts_with(b"step,t,dt,limit,binding,within_limit,substeps,retries,growth,condition,residual"));
/// # parops::Result::Ok(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Ledger<const D: usize> {
    rows: Vec<LedgerRow<D>>,
}

impl<const D: usize> Ledger<D> {
    /// Keeps a copy of a row.
    pub fn push(&mut self, row: &LedgerRow<D>) {
        self.rows.push(row.clone());
    }

    /// The rows kept, in order.
    pub fn rows(&self) -> &[LedgerRow<D>] {
        &self.rows
    }

    /// Writes all rows as comma-separated values with a line of names; the columns of field i end in `_i`, moments name
    /// their axes. Numbers read back to the same bits.
    ///
    /// # Errors
    /// [`IoError::Write`](crate::IoError::Write) with the number of bytes taken before the writer failed.
    pub fn write_csv(&self, out: &mut (impl Write + ?Sized)) -> Result<()> {
        counted(out, |out| self.write_to(out))
    }

    fn write_to(&self, out: &mut impl Write) -> io::Result<()> {
        write!(out, "step,t,dt,limit,binding,within_limit,substeps,retries,growth,condition,residual")?;
        write!(out, ",remeshings,rebuilds,hole,gap,budget")?;
        for i in 0..self.rows.first().map_or(0, |row| row.fields.len()) {
            for name in ["mass", "size", "min", "max", "negative_mass", "drift", "dropped", "dropped_size"] {
                write!(out, ",{name}_{i}")?;
            }
            axes::<D>().try_for_each(|(a, b)| match b {
                None => write!(out, ",m{a}_{i}"),
                Some(b) => write!(out, ",m{a}{b}_{i}"),
            })?;
        }
        writeln!(out)?;
        self.rows.iter().try_for_each(|row| row.write_to(out))
    }
}

/// The first and second moments in the order they are written.
fn axes<const D: usize>() -> impl Iterator<Item = (usize, Option<usize>)> {
    (0..D).map(|a| (a, None)).chain((0..D).flat_map(|a| (a..D).map(move |b| (a, Some(b)))))
}

impl<const D: usize> LedgerRow<D> {
    fn write_to(&self, out: &mut impl Write) -> io::Result<()> {
        let binding = self.binding.map_or("", Limit::name);
        write!(out, "{},{:e},{:e},{:e},{binding},{}", self.step, self.t, self.dt, self.limit, self.within_limit)?;
        write!(out, ",{},{},{:e}", self.substeps, self.retries, self.growth)?;
        write!(out, ",{:e},{:e}", self.condition, self.residual)?;
        write!(out, ",{},{}", self.remeshings, self.rebuilds)?;
        let [hole, gap] = [self.hole, self.gap].map(|found| found.unwrap_or(f64::NAN));
        write!(out, ",{hole:e},{gap:e},{:e}", self.budget)?;
        for field in &self.fields {
            let Totals { mass, size, min, max, negative_mass, drift, dropped, dropped_size, .. } = field;
            write!(out, ",{mass:e},{size:e},{min:e},{max:e},{negative_mass:e},{drift:e},{dropped:e},{dropped_size:e}")?;
            axes::<D>()
                .try_for_each(|(a, b)| write!(out, ",{:e}", b.map_or(field.first[a], |b| field.second[a][b])))?;
        }
        writeln!(out)
    }
}
