//! Rows of first derivatives for every axis and side, applied upwind.

use super::advect::Advect;
use super::blocks::each_row;
use super::sweep::Sweep;
use super::{Field, Report, Rows, check, check_results, scalars};
use crate::error::{ApplyError, Error, OperatorError, Result};
use crate::stencil::Side;

/// The derivative along every axis from its left and from its right, `sides[axis]` = [left, right], applied upwind:
/// out_p = sum_i v_i(p) (d_i^side f)_p, from the left where v_i(p) > 0, from the right where v_i(p) < 0.
///
/// The rows do not depend on the velocity; a sweep reads D of the 2 D rows of a target. Memory: 12 bytes a pair (`f64`),
/// n pairs for each of 2 D rows. Made by [`UpwindDcPse`](super::UpwindDcPse), or by [`new`](Self::new) of any rows.
#[derive(Clone, Debug, PartialEq)]
pub struct SidedRows<const D: usize, T: Field = f64> {
    sides: [[Rows<[f64; 1], T>; 2]; D],
    /// Targets with a side without rows, each with its axis and side.
    missing: Vec<(u32, usize, Side)>,
}

impl<const D: usize, T: Field> SidedRows<D, T> {
    /// The rows that `side(axis, side)` makes of d/dx_axis; rows left [`empty`](crate::Fallback::Empty) are refused when
    /// a velocity asks for them.
    ///
    /// # Errors
    /// Those of `side`; [`ApplyError::Input`] and [`ApplyError::Output`] where the rows differ in sources or targets.
    pub fn new(mut side: impl FnMut(usize, Side) -> Result<Rows<[f64; 1], T>>) -> Result<Self> {
        let mut made = Vec::with_capacity(2 * D);
        for axis in 0..D {
            for which in [Side::Left, Side::Right] {
                made.push((axis, which, side(axis, which)?));
            }
        }
        let mut missing = Vec::new();
        let shape = made.first().map_or((0, 0), |(_, _, rows)| (rows.targets(), rows.sources()));
        for (axis, which, rows) in &made {
            if rows.sources() != shape.1 {
                return Err(ApplyError::Input { found: rows.sources(), needed: shape.1 }.into());
            }
            if rows.targets() != shape.0 {
                return Err(ApplyError::Output { found: rows.targets(), needed: shape.0 }.into());
            }
            let empty = rows.offsets.windows(2).enumerate().filter(|(_, ends)| ends[0] == ends[1]);
            missing.extend(empty.map(|(p, _)| (p as u32, *axis, *which)));
        }
        let mut rows = made.into_iter().map(|(_, _, rows)| rows);
        let mut next = || rows.next().ok_or(ApplyError::Fields { found: 0, needed: 2 * D });
        let mut sides = Vec::with_capacity(D);
        for _ in 0..D {
            sides.push([next()?, next()?]);
        }
        missing.sort_by_key(|&(p, axis, _)| (p, axis));
        let sides = sides.try_into().map_err(|_| ApplyError::Fields { found: 0, needed: 2 * D })?;
        Ok(Self { sides, missing })
    }

    /// Number of targets.
    pub fn targets(&self) -> usize {
        self.sides.first().map_or(0, |[left, _]| left.targets())
    }

    /// Number of sources.
    pub fn sources(&self) -> usize {
        self.sides.first().map_or(0, |[left, _]| left.sources())
    }

    /// The rows of an axis and side; `None` beyond the axes.
    pub fn rows(&self, axis: usize, side: Side) -> Option<&Rows<[f64; 1], T>> {
        let [left, right] = self.sides.get(axis)?;
        Some(if side == Side::Left { left } else { right })
    }

    /// What the builds found: of all axes and sides together, `rows` and `pairs` summed.
    pub fn report(&self) -> Report {
        let mut report = Report::default();
        self.sides.iter().flatten().for_each(|rows| report.merge(rows.report()));
        report
    }

    /// The targets that lack a side, with axis and side, in ascending order.
    pub fn missing(&self) -> impl Iterator<Item = (usize, usize, Side)> + '_ {
        self.missing.iter().map(|&(p, axis, side)| (p as usize, axis, side))
    }

    /// Bytes held by the rows.
    pub fn bytes(&self) -> usize {
        self.sides.iter().flatten().map(Rows::bytes).sum::<usize>() + size_of_val(self.missing.as_slice())
    }

    /// Writes v . grad f into `out`, one value per target.
    ///
    /// # Errors
    /// As [`Rows::apply_along`]; [`OperatorError::EmptySide`] naming the first target with a velocity component from a
    /// side without rows; nothing is written then.
    pub fn apply(&self, velocities: &[[T; D]], f: &[T], out: &mut [T]) -> Result<()> {
        check(scalars(f), self.sources(), out, self.targets())?;
        self.check_velocities(velocities, out)?;
        each_row(out, |p| self.along(&velocities[p], |rows| rows.stored(p).all(f))[0]);
        check_results(scalars(out))
    }

    /// F fields at once, interleaved, `out[p][i]` = (v . grad f_i)_p: each with the bits that [`apply`](Self::apply)
    /// gives it alone; weights and indices are read once.
    ///
    /// # Errors
    /// As [`apply`](Self::apply).
    pub fn apply_fields<const F: usize>(&self, velocities: &[[T; D]], f: &[[T; F]], out: &mut [[T; F]]) -> Result<()> {
        check(f, self.sources(), out, self.targets())?;
        self.check_velocities(velocities, out)?;
        each_row(out, |p| self.along(&velocities[p], |rows| rows.stored(p).lanes(|q| &f[q])));
        check_results(out)
    }

    /// A bound on |lambda| of the operator with these velocities, by the row sums (Gershgorin): up to 4 times the radius where the
    /// velocity is oblique.
    ///
    /// # Errors
    /// [`ApplyError::Input`] and [`ApplyError::Field`] for velocities of another number, or not finite.
    pub fn rate_bound(&self, velocities: &[[T; D]]) -> Result<f64> {
        check(velocities, self.targets(), velocities, self.targets())?;
        let mut bound = 0.0_f64;
        for (p, v) in velocities.iter().enumerate() {
            let mut sum = 0.0;
            for (&v, sides) in v.iter().zip(&self.sides) {
                let Some(side) = upwind(v) else { continue };
                let Some(row) = sides[side].row(p) else { continue };
                let (own, all) = row.weights.iter().fold((row.diagonal[0].as_(), 0.0), |(own, all), w| {
                    let w: f64 = w[0].as_();
                    (own - w, all + w.abs())
                });
                sum += v.as_().abs() * (own.abs() + all);
            }
            bound = bound.max(sum);
        }
        Ok(bound)
    }

    /// sum_i v_i times what `derivative` makes of the upwind rows of axis i.
    #[inline(always)]
    fn along<const F: usize>(&self, v: &[T; D], derivative: impl Fn(&Rows<[f64; 1], T>) -> [T; F]) -> [T; F] {
        let mut sum = [T::zero(); F];
        for (&v, sides) in v.iter().zip(&self.sides) {
            if let Some(side) = upwind(v) {
                let slope = derivative(&sides[side]);
                sum.iter_mut().zip(slope).for_each(|(sum, slope)| *sum += v * slope);
            }
        }
        sum
    }

    fn check_velocities<Out>(&self, velocities: &[[T; D]], out: &[Out]) -> Result<()> {
        check(velocities, self.targets(), out, self.targets())?;
        let wanted = |(p, axis, side): &(usize, usize, Side)| Side::upwind(velocities[*p][*axis].as_()) == Some(*side);
        let Some((p, axis, side)) = self.missing().find(wanted) else { return Ok(()) };
        let neighbors = self.sides[axis].iter().filter_map(|rows| Some(rows.row(p)?.sources.len())).sum();
        Err(Error::from(OperatorError::EmptySide { axis, side, neighbors }).at(p))
    }
}

/// Which of [left, right] a velocity component comes from.
#[inline(always)]
fn upwind<T: Field>(v: T) -> Option<usize> {
    if v > T::zero() {
        Some(0)
    } else if v < T::zero() {
        Some(1)
    } else {
        None
    }
}

impl<const D: usize, T: Field> Advect<D, T> for SidedRows<D, T> {
    fn targets(&self) -> usize {
        self.targets()
    }

    fn sources(&self) -> usize {
        self.sources()
    }

    fn advect(&self, velocities: &[[T; D]], f: &[T], out: &mut [T]) -> Result<()> {
        self.apply(velocities, f, out)
    }
}
