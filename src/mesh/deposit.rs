//! Particles to mesh.

use super::{Mesh, MeshStencil, check_values, not_finite};
use crate::apply::Field;
use crate::error::{ApplyError, Error, ParticleError, Result};
use crate::kernel::MeshKernel;

impl<const D: usize> Mesh<D> {
    /// Adds the strengths of particles to a mesh: out_ijk += sum_p W_p(i, j, k) omega_p.
    ///
    /// What is deposited adds up to sum_p omega_p, and has the moments of the particles to the exactness of the kernel.
    /// Every value is summed in the order of the particles, so that its bits do not depend on the number of threads. On
    /// one thread nothing is allocated; with the feature `rayon` and several threads, lists of the particles per slab
    /// are. Particles in the order of their cells are deposited fastest.
    ///
    /// Deposit strengths, not intensive values: sum_p W_p is not 1. A density is the result divided by
    /// [`cell_volume`](Self::cell_volume).
    ///
    /// ```
    /// use parops::{Domain, Mesh, Tsc};
    /// let mesh = Mesh::cells(&Domain::periodic([0.0], [4.0])?, [4])?;
    /// let mut values = [0.0; 4];
    /// mesh.deposit(&Tsc, &[[1.5], [0.25]], &[8.0, 32.0], &mut values)?;
    /// assert_eq!(values, [23.0, 7.0, 1.0, 9.0]);
    /// # parops::Result::Ok(())
    /// ```
    ///
    /// # Errors
    /// [`ParticleError::Length`] where there is not one strength per particle,
    /// [`MeshError::Length`](crate::MeshError::Length) where `out` does not fit the mesh, and as
    /// [`stencil`](Self::stencil) and [`ApplyError::FieldOf`], naming the first particle whose support leaves the mesh
    /// or whose strength is not finite; nothing is deposited then. [`MeshError::Value`](crate::MeshError::Value) naming
    /// the first value that is not finite afterwards, by overflow or because it was not before. On several threads also
    /// [`ParticleError::TooMany`] and [`ParticleError::Memory`] for the lists.
    ///
    /// Source: notes 001, eq. 7.19 and 7.20.
    pub fn deposit<T: Field, const S: usize>(
        &self,
        kernel: &(impl MeshKernel<f64, S> + ?Sized),
        points: &[[f64; D]],
        strengths: &[T],
        out: &mut [T],
    ) -> Result<()> {
        self.deposit_fields(kernel, points, crate::apply::scalars(strengths), out.as_chunks_mut::<1>().0)
    }

    /// Adds F strengths per particle, interleaved, to a mesh of F values per node: each with the bits that
    /// [`deposit`](Self::deposit) gives it alone, for weights computed once.
    ///
    /// # Errors
    /// As [`deposit`](Self::deposit).
    pub fn deposit_fields<T: Field, const S: usize, const F: usize>(
        &self,
        kernel: &(impl MeshKernel<f64, S> + ?Sized),
        points: &[[f64; D]],
        strengths: &[[T; F]],
        out: &mut [[T; F]],
    ) -> Result<()> {
        if strengths.len() != points.len() {
            return Err(ParticleError::Length { found: strengths.len(), needed: points.len() }.into());
        }
        self.check_length(out.len())?;
        let strengths_checked = check_strengths(strengths);
        // Of two bad particles the first is named, whatever is wrong with it.
        let before = strengths_checked.as_ref().err().and_then(Error::particle).unwrap_or(points.len());
        self.check_points::<S>(&points[..before])?;
        strengths_checked?;

        self.add(kernel, points, strengths, out)?;
        check_values(out)
    }

    /// What remains where every particle is legal.
    fn add<T: Field, const S: usize, const F: usize>(
        &self,
        kernel: &(impl MeshKernel<f64, S> + ?Sized),
        points: &[[f64; D]],
        strengths: &[[T; F]],
        out: &mut [[T; F]],
    ) -> Result<()> {
        #[cfg(feature = "rayon")]
        if let Some(slabs) = super::slabs::Slabs::new(self, self.strides()[0], S) {
            return slabs.each(
                out,
                |x| self.axes[0].locate::<S>(x).0,
                S,
                points,
                |p, first, out| {
                    add(&self.place(kernel, &points[p]), &strengths[p], first, out);
                },
            );
        }
        for (x, strength) in points.iter().zip(strengths) {
            add(&self.place(kernel, x), strength, 0, out);
        }
        Ok(())
    }
}

fn check_strengths<T: Field, const F: usize>(strengths: &[[T; F]]) -> Result<()> {
    not_finite(strengths)
        .map_or(Ok(()), |(p, field, value)| Err(Error::from(ApplyError::FieldOf { field, value }).at(p)))
}

/// Adds one particle to the values from `first` on; what lies before or behind them is left to others.
#[inline(always)]
fn add<T: Field, const D: usize, const S: usize, const F: usize>(
    stencil: &MeshStencil<D, S>,
    strength: &[T; F],
    first: usize,
    out: &mut [[T; F]],
) {
    let (offsets, weights, side_by_side) = stencil.last::<T>();
    stencil.lines(|line, weight: T| {
        let share = strength.map(|strength| strength * weight);
        // An index before the first wraps around and is beyond every slice.
        let at = (line + offsets[0]).wrapping_sub(first);
        let whole = if side_by_side { out.get_mut(at..).and_then(<[_]>::first_chunk_mut::<S>) } else { None };
        if let Some(values) = whole {
            for (values, &weight) in values.iter_mut().zip(&weights) {
                spread(values, &share, weight);
            }
        } else {
            for (offset, &weight) in offsets.iter().zip(&weights) {
                if let Some(values) = out.get_mut((line + offset).wrapping_sub(first)) {
                    spread(values, &share, weight);
                }
            }
        }
    });
}

#[inline(always)]
fn spread<T: Field, const F: usize>(values: &mut [T; F], share: &[T; F], weight: T) {
    for (value, &share) in values.iter_mut().zip(share) {
        *value += share * weight;
    }
}
