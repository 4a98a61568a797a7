//! Index and weights of one particle.

use super::Mesh;
use crate::apply::Field;
use crate::error::Result;
use crate::kernel::MeshKernel;

/// The S^D values of a mesh that one particle reaches, as a product: S offsets and S weights along every axis.
///
/// The weight of value (i, j, k) is W_p(i, j, k) = w_0i w_1j w_2k; all add up to 1. On a periodic axis of fewer than S
/// values some offsets repeat, and their weights add.
///
/// Source: notes 001, eq. 7.20.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeshStencil<const D: usize, const S: usize> {
    offsets: [[usize; S]; D],
    weights: [[f64; S]; D],
}

impl<const D: usize> Mesh<D> {
    /// Index and weights of a particle at x. No allocation.
    ///
    /// ```
    /// use parops::{Cic, Domain, Face, Mesh};
    /// let domain = Domain::new([0.0; 2], [4.0; 2], [[Face::Open; 2]; 2])?;
    /// let stencil = Mesh::cells(&domain, [4; 2])?.stencil(&Cic, &[1.75, 2.5])?;
    /// let nodes: Vec<_> = stencil.nodes().filter(|node| node.1 > 0.0).collect();
    /// assert_eq!(nodes, [(6, 0.75), (10, 0.25)]);
    /// # parops::Result::Ok(())
    /// ```
    ///
    /// # Errors
    /// [`ParticleError::Coordinate`](crate::ParticleError::Coordinate) and
    /// [`ParticleError::Range`](crate::ParticleError::Range) for a coordinate that is not finite or too large,
    /// [`MeshError::Support`](crate::MeshError::Support) where the support leaves a bounded axis. To round-off, a
    /// particle on the last place that is still within counts as within.
    pub fn stencil<const S: usize>(
        &self,
        kernel: &(impl MeshKernel<f64, S> + ?Sized),
        x: &[f64; D],
    ) -> Result<MeshStencil<D, S>> {
        self.check_point::<S>(x)?;
        Ok(self.place(kernel, x))
    }

    #[inline]
    pub(super) fn check_point<const S: usize>(&self, x: &[f64; D]) -> Result<()> {
        self.axes.iter().zip(x).enumerate().try_for_each(|(axis, (mesh, &x))| mesh.check::<S>(axis, x))
    }

    /// Refuses the first particle that [`stencil`](Self::stencil) would refuse.
    pub(super) fn check_points<const S: usize>(&self, points: &[[f64; D]]) -> Result<()> {
        let legal = self.axes.map(|axis| axis.surely_legal::<S>());
        let block = |(b, points): (usize, &[[f64; D]])| {
            for (p, x) in points.iter().enumerate() {
                if !x.iter().zip(&legal).all(|(x, [low, high])| low <= x && x <= high) {
                    self.check_point::<S>(x).map_err(|error| error.at(b * BLOCK + p))?;
                }
            }
            Ok(())
        };
        #[cfg(feature = "rayon")]
        {
            use rayon::prelude::*;
            // The reduction keeps the order of the blocks.
            points.par_chunks(BLOCK).enumerate().map(block).reduce(|| Ok(()), Result::and)
        }
        #[cfg(not(feature = "rayon"))]
        points.chunks(BLOCK).enumerate().try_for_each(block)
    }

    /// The stencil of a point already checked.
    #[inline(always)]
    pub(super) fn place<const S: usize>(
        &self,
        kernel: &(impl MeshKernel<f64, S> + ?Sized),
        x: &[f64; D],
    ) -> MeshStencil<D, S> {
        let (mut offsets, mut weights, strides) = ([[0; S]; D], [[0.0; S]; D], self.strides());
        for axis in 0..D {
            let (first, u) = self.axes[axis].locate::<S>(x[axis]);
            offsets[axis] = self.axes[axis].offsets(first, strides[axis]);
            weights[axis] = kernel.weights(u);
        }
        MeshStencil { offsets, weights }
    }
}

const BLOCK: usize = 4096;

impl<const D: usize, const S: usize> MeshStencil<D, S> {
    /// The offsets along every axis; those of one node of the stencil add up to its index in the slices.
    pub fn offsets(&self) -> &[[usize; S]; D] {
        &self.offsets
    }

    /// The weights along every axis.
    pub fn weights(&self) -> &[[f64; S]; D] {
        &self.weights
    }

    /// Index and weight of all S^D nodes, the last axis fastest.
    pub fn nodes(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        (0..S.pow(D as u32)).map(|node| {
            let (mut rest, mut index, mut weight) = (node, 0, 1.0);
            for (offsets, weights) in self.offsets.iter().zip(&self.weights).rev() {
                index += offsets[rest % S];
                weight *= weights[rest % S];
                rest /= S;
            }
            (index, weight)
        })
    }

    /// Visits the lines of S nodes along the last axis: the offset and the weight of all axes but the last.
    #[inline(always)]
    pub(super) fn lines<T: Field>(&self, mut visit: impl FnMut(usize, T)) {
        let weights = self.weights.map(|weights| weights.map(T::lift));
        match (&self.offsets[..], &weights[..]) {
            ([x, y, _], [u, v, _]) => {
                for (x, u) in x.iter().zip(u) {
                    for (y, v) in y.iter().zip(v) {
                        visit(x + y, *u * *v);
                    }
                }
            }
            ([x, _], [u, _]) => x.iter().zip(u).for_each(|(x, u)| visit(*x, *u)),
            _ => visit(0, T::one()),
        }
    }

    /// Offsets and weights along the last axis, and whether the nodes stand side by side there.
    #[inline(always)]
    pub(super) fn last<T: Field>(&self) -> ([usize; S], [T; S], bool) {
        let (offsets, weights) = (self.offsets[D - 1], self.weights[D - 1].map(T::lift));
        (offsets, weights, offsets[S - 1] == offsets[0] + (S - 1))
    }
}
