//! Several fields at once: each pair is read once for all of them.

use std::borrow::Borrow;

use super::blocks::each_row;
use super::strided::{LaneRows, Strided, sweep_fields};
use super::sweep::Sweep;
use super::{Field, MatrixFree, Rows};
use crate::error::{ApplyError, Error, Result};
use crate::neighbors::Neighbors;
use crate::operator::Method;

impl<T: Field> Rows<[f64; 1], T> {
    /// F fields at once, interleaved, `out[p][i]` = (L f_i)_p: each with the bits that
    /// [`Apply::apply`](super::Apply::apply) gives it alone, for a fraction of the cost, because weights and indices are
    /// read once.
    ///
    /// ```
    /// use parops::{CellList, DcPse, Domain, Laplacian, Particles};
    /// let particles = Particles::jittered([0.0; 2], [1.0; 2], [12; 2], 0.3, 1)?;
    /// let dcpse = DcPse::<Laplacian<2>, 2>::new();
    /// let rows = dcpse.assemble(&CellList::build(&particles, &Domain::open(), dcpse.cutoff(&particles)?)?)?;
    /// let f: Vec<_> = particles.points().iter().map(|x| [x[0] * x[0], x[0] * x[1]]).collect();
    /// let mut out = vec![[0.0; 2]; f.len()];
    /// rows.apply_fields(&f, &mut out)?;
    /// assert!(out.iter().all(|[a, b]| (a - 2.0).abs() < 1e-9 && b.abs() < 1e-9));
    /// # parops::Result::Ok(())
    /// ```
    ///
    /// # Errors
    /// [`ApplyError::Input`] and [`ApplyError::Output`] for wrong lengths; [`ApplyError::FieldOf`] and
    /// [`ApplyError::OverflowOf`] naming the first particle, and there the first field, whose value or result is not
    /// finite. Nothing is written where a value is not finite.
    pub fn apply_fields<const F: usize>(&self, f: &[[T; F]], out: &mut [[T; F]]) -> Result<()> {
        check_fields(&interleaved(f)?, self.sources, out.len(), self.targets())?;
        each_row(out, |p| self.stored(p).lanes(|q| &f[q]));
        check_results(&interleaved(out)?)
    }

    /// Any number of fields at once, each view with strides of its own: as [`apply_fields`](Self::apply_fields), up to
    /// eight fields a sweep.
    ///
    /// ```
    /// use parops::{CellList, DcPse, Domain, Laplacian, Particles, Strided};
    /// let particles = Particles::jittered([0.0; 2], [1.0; 2], [12; 2], 0.3, 1)?;
    /// let dcpse = DcPse::<Laplacian<2>, 2>::new();
    /// let rows = dcpse.assemble(&CellList::build(&particles, &Domain::open(), dcpse.cutoff(&particles)?)?)?;
    /// // x^2 of all particles, then x y of all particles.
    /// let squares = particles.points().iter().map(|x| x[0] * x[0]);
    /// let f: Vec<f64> = squares.chain(particles.points().iter().map(|x| x[0] * x[1])).collect();
    /// let mut out = vec![0.0; f.len()];
    /// rows.apply_strided(Strided::stacked(&f[..], 2)?, Strided::stacked(&mut out[..], 2)?)?;
    /// assert!((out[7] - 2.0).abs() < 1e-9 && out[144 + 7].abs() < 1e-9);
    /// # parops::Result::Ok(())
    /// ```
    ///
    /// # Errors
    /// As [`apply_fields`](Self::apply_fields), and [`ApplyError::Fields`] where the views differ in the number of
    /// fields.
    pub fn apply_strided(&self, f: Strided<&[T]>, mut out: Strided<&mut [T]>) -> Result<()> {
        let (found, needed) = (out.fields(), f.fields());
        if found != needed {
            return Err(ApplyError::Fields { found, needed }.into());
        }
        check_fields(&f, self.sources, out.particles(), self.targets())?;
        sweep_fields(&f, &mut out, self);
        check_results(&out)
    }
}

impl<T: Field> LaneRows<T> for Rows<[f64; 1], T> {
    #[inline(always)]
    fn lanes<V: Borrow<[T; C]>, const C: usize>(&self, p: usize, value: impl Fn(usize) -> V) -> [T; C] {
        self.stored(p).lanes(value)
    }
}

impl<const D: usize, M: Method<D, Out = [f64; 1]>, P: Neighbors<D>> MatrixFree<'_, D, M, P> {
    /// F fields at once, as [`Rows::apply_fields`]: the weights of a row are computed once for all of them.
    ///
    /// # Errors
    /// As [`Rows::apply_fields`].
    pub fn apply_fields<T: Field, const F: usize>(&self, f: &[[T; F]], out: &mut [[T; F]]) -> Result<()> {
        check_fields(&interleaved(f)?, self.neighbors.sources(), out.len(), self.neighbors.targets())?;
        self.each(out, |_, worker| worker.lanes(|q| &f[q]))?;
        check_results(&interleaved(out)?)
    }
}

fn interleaved<T: Copy, const F: usize>(f: &[[T; F]]) -> Result<Strided<&[T]>> {
    Strided::new(f.as_flattened(), [f.len(), F], [F, 1])
}

fn check_fields<T: Field>(f: &Strided<&[T]>, sources: usize, out: usize, targets: usize) -> Result<()> {
    if f.particles() != sources {
        return Err(ApplyError::Input { found: f.particles(), needed: sources }.into());
    }
    if out != targets {
        return Err(ApplyError::Output { found: out, needed: targets }.into());
    }
    match f.not_finite() {
        Some((p, field, value)) => Err(Error::from(ApplyError::FieldOf { field, value: value.as_() }).at(p)),
        None => Ok(()),
    }
}

fn check_results<T: Field, S: std::ops::Deref<Target = [T]>>(out: &Strided<S>) -> Result<()> {
    match out.not_finite() {
        Some((p, field, value)) => Err(Error::from(ApplyError::OverflowOf { field, value: value.as_() }).at(p)),
        None => Ok(()),
    }
}
