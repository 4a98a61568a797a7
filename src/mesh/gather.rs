//! Mesh to particles.

use super::{Mesh, MeshStencil, check_values, not_finite};
use crate::apply::Field;
use crate::apply::blocks::each_row;
use crate::error::{ApplyError, Error, ParticleError, Result};
use crate::kernel::MeshKernel;
use crate::scale::Volumes;

impl<const D: usize> Mesh<D> {
    /// Interpolates intensive values, u or a force, from the mesh to points: out_p = sum_ijk W_p(i, j, k) u_ijk.
    ///
    /// Polynomials come back exactly up to the exactness of the kernel, because sum_ijk W_p is 1. It is the adjoint of
    /// [`deposit`](Self::deposit): sum_p omega_p out_p is sum_ijk u_ijk times what omega deposits. Strengths come back
    /// by [`gather_strengths`](Self::gather_strengths). Nothing is allocated.
    ///
    /// ```
    /// use parops::{Domain, Face, Lambda, Mesh};
    /// let mesh = Mesh::nodes(&Domain::new([0.0], [9.0], [[Face::Open; 2]])?, [10])?;
    /// let cubes: Vec<f64> = mesh.points().map(|[x]| x * x * x).collect();
    /// let mut out = [0.0];
    /// mesh.gather(&Lambda::<4, 2>::new()?, &[[4.3]], &cubes, &mut out)?;
    /// assert!((out[0] - 79.507).abs() < 1e-12);
    /// # parops::Result::Ok(())
    /// ```
    ///
    /// # Errors
    /// [`MeshError::Length`](crate::MeshError::Length) where `values` does not fit the mesh, [`ParticleError::Length`]
    /// where there is not one place in `out` per point, [`MeshError::Value`](crate::MeshError::Value) naming the first
    /// value that is not finite, and as [`stencil`](Self::stencil), naming the first point; `out` is then as it was.
    /// [`ApplyError::OverflowOf`] naming the first point whose result is not finite.
    ///
    /// Source: notes 001, sec. 7.4.1, with errata 42.
    pub fn gather<T: Field, const S: usize>(
        &self,
        kernel: &(impl MeshKernel<f64, S> + ?Sized),
        points: &[[f64; D]],
        values: &[T],
        out: &mut [T],
    ) -> Result<()> {
        self.gather_fields(kernel, points, crate::apply::scalars(values), out.as_chunks_mut::<1>().0)
    }

    /// Interpolates F intensive values per node, interleaved: each with the bits that [`gather`](Self::gather) gives it
    /// alone, for weights computed once.
    ///
    /// # Errors
    /// As [`gather`](Self::gather).
    pub fn gather_fields<T: Field, const S: usize, const F: usize>(
        &self,
        kernel: &(impl MeshKernel<f64, S> + ?Sized),
        points: &[[f64; D]],
        values: &[[T; F]],
        out: &mut [[T; F]],
    ) -> Result<()> {
        self.check_gather::<T, S, F>(points, values, out)?;
        each_row(out, |p| sum(&self.place(kernel, &points[p]), values));
        check_results(out)
    }

    /// Interpolates strengths from the mesh to particles: omega_p = V_p u_p, where u_p is gathered from the density
    /// omega_ijk / [`cell_volume`](Self::cell_volume).
    ///
    /// Gathering the strengths themselves would not conserve them: the weights of one *node* do not add up to 1. With
    /// sum_p V_p W_p(i, j, k) near the cell volume, as on a lattice, the total is that of the mesh; in general it is a
    /// quadrature of the field.
    ///
    /// # Errors
    /// As [`gather`](Self::gather), and [`ParticleError::Length`] where there is not one volume per particle.
    ///
    /// Source: errata 42.
    pub fn gather_strengths<T: Field, const S: usize>(
        &self,
        kernel: &(impl MeshKernel<f64, S> + ?Sized),
        points: &[[f64; D]],
        volumes: &Volumes,
        strengths: &[T],
        out: &mut [T],
    ) -> Result<()> {
        let out = out.as_chunks_mut::<1>().0;
        self.gather_strength_fields(kernel, points, volumes, crate::apply::scalars(strengths), out)
    }

    /// Interpolates F strengths per node, interleaved, as [`gather_strengths`](Self::gather_strengths).
    ///
    /// # Errors
    /// As [`gather_strengths`](Self::gather_strengths).
    pub fn gather_strength_fields<T: Field, const S: usize, const F: usize>(
        &self,
        kernel: &(impl MeshKernel<f64, S> + ?Sized),
        points: &[[f64; D]],
        volumes: &Volumes,
        strengths: &[[T; F]],
        out: &mut [[T; F]],
    ) -> Result<()> {
        if let Some(found) = volumes.len().filter(|&found| found != points.len()) {
            return Err(ParticleError::Length { found, needed: points.len() }.into());
        }
        self.check_gather::<T, S, F>(points, strengths, out)?;
        let cell = self.cell_volume();
        each_row(out, |p| {
            let ratio = T::lift(volumes.get(p).unwrap_or_default() / cell);
            sum(&self.place(kernel, &points[p]), strengths).map(|strength| strength * ratio)
        });
        check_results(out)
    }

    fn check_gather<T: Field, const S: usize, const F: usize>(
        &self,
        points: &[[f64; D]],
        values: &[[T; F]],
        out: &[[T; F]],
    ) -> Result<()> {
        if out.len() != points.len() {
            return Err(ParticleError::Length { found: out.len(), needed: points.len() }.into());
        }
        self.check_length(values.len())?;
        check_values(values)?;
        self.check_points::<S>(points)
    }
}

/// Refuses results that overflow, which finite values do only near the largest number there is.
fn check_results<T: Field, const F: usize>(out: &[[T; F]]) -> Result<()> {
    not_finite(out).map_or(Ok(()), |(p, field, value)| Err(Error::from(ApplyError::OverflowOf { field, value }).at(p)))
}

/// sum_k w_k sum_lines weight u: the nodes of a line are summed side by side over the lines first.
#[inline(always)]
fn sum<T: Field, const D: usize, const S: usize, const F: usize>(
    stencil: &MeshStencil<D, S>,
    values: &[[T; F]],
) -> [T; F] {
    let (offsets, weights, side_by_side) = stencil.last::<T>();
    let mut sums = [[T::zero(); F]; S];
    stencil.lines(|line, weight: T| {
        let start = values.get(line + offsets[0]..);
        let whole = if side_by_side { start.and_then(<[_]>::first_chunk::<S>) } else { None };
        if let Some(values) = whole {
            for (sum, values) in sums.iter_mut().zip(values) {
                add(sum, weight, values);
            }
        } else {
            for (sum, offset) in sums.iter_mut().zip(&offsets) {
                if let Some(values) = values.get(line + offset) {
                    add(sum, weight, values);
                }
            }
        }
    });
    let mut total = [T::zero(); F];
    for (sum, weight) in sums.iter().zip(weights) {
        add(&mut total, weight, sum);
    }
    total
}

#[inline(always)]
fn add<T: Field, const F: usize>(sum: &mut [T; F], weight: T, values: &[T; F]) {
    for (sum, &value) in sum.iter_mut().zip(values) {
        *sum += weight * value;
    }
}
