//! Regular meshes, and the transfer between them and particles: depositing, gathering, remeshing.

mod axis;
mod deposit;
mod gather;
mod remesh;
#[cfg(feature = "rayon")]
mod slabs;
mod stencil;

pub use remesh::{Dropped, Remeshed};
pub use stencil::MeshStencil;

use axis::Axis;

use crate::apply::Field;
use crate::domain::Domain;
use crate::error::{MeshError, Result};

/// Where on the mesh the values sit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Centering {
    /// At nodes x = lower + i h. A periodic axis has as many nodes as intervals, h = w/n; a bounded one has nodes on both
    /// faces, h = w/(n - 1).
    Nodes,
    /// In the middle of cells, x = lower + (i + 1/2) h with h = w/n.
    Cells,
}

/// A regular mesh in a box of 1 to 3 dimensions: geometry only, its values are slices with the last axis fastest.
///
/// An axis is periodic where its [`Domain`] is; every other face bounds the mesh, a mirror too. Strengths come onto the
/// mesh by [`deposit`](Self::deposit), intensive values leave it by [`gather`](Self::gather), and
/// [`remesh`](Self::remesh) turns it into new particles; kernels are those of [`MeshKernel`](crate::MeshKernel).
///
/// ```
/// use parops::{Domain, Lambda, Mesh, Particles};
/// let torus = Domain::periodic([0.0; 2], [1.0; 2])?;
/// let particles = Particles::jittered([0.0; 2], [1.0; 2], [20; 2], 0.3, 1)?;
/// let strengths = vec![0.0025; particles.len()];
///
/// let mesh = Mesh::nodes(&torus, [16; 2])?;
/// let mut values = vec![0.0; mesh.len()];
/// mesh.deposit(&Lambda::<4, 2>::new()?, particles.points(), &strengths, &mut values)?;
/// let remeshed = mesh.remesh(&values, 0.0)?;
/// assert_eq!(remeshed.particles.len(), 256);
/// assert!((remeshed.strengths.iter().sum::<f64>() - 1.0).abs() < 1e-13);
/// # parops::Result::Ok(())
/// ```
///
/// Source: notes 001, sec. 7.4; exercise sheet 003 for values in cells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mesh<const D: usize> {
    domain: Domain<D>,
    counts: [usize; D],
    centering: Centering,
    axes: [Axis; D],
}

impl<const D: usize> Mesh<D> {
    /// Largest legal number of values along an axis, 2^30.
    pub const COUNT_HIGH: usize = 1 << 30;

    const DIMENSIONS_FIT: () = assert!(1 <= D && D <= 3, "meshes have 1 to 3 dimensions");

    /// A mesh with values at `counts` nodes.
    ///
    /// # Errors
    /// [`MeshError::Infinite`] where a face lies at infinity; [`MeshError::Count`] for less than one value along an axis
    /// (two between bounds) or more than [`COUNT_HIGH`](Self::COUNT_HIGH); [`MeshError::TooLarge`] where a slice could
    /// not hold all values.
    pub fn nodes(domain: &Domain<D>, counts: [usize; D]) -> Result<Self> {
        Self::new(domain, counts, Centering::Nodes)
    }

    /// A mesh with values in the middle of `counts` cells.
    ///
    /// # Errors
    /// As [`nodes`](Self::nodes).
    pub fn cells(domain: &Domain<D>, counts: [usize; D]) -> Result<Self> {
        Self::new(domain, counts, Centering::Cells)
    }

    fn new(domain: &Domain<D>, counts: [usize; D], centering: Centering) -> Result<Self> {
        let () = Self::DIMENSIONS_FIT;
        let mut axes = [Axis::default(); D];
        for (axis, (entry, &count)) in axes.iter_mut().zip(&counts).enumerate() {
            *entry = Axis::new(domain, axis, count, centering)?;
        }
        let limit = isize::MAX as usize / size_of::<[f64; 8]>();
        let values = counts.iter().try_fold(1_usize, |product, &count| product.checked_mul(count));
        if values.is_none_or(|values| values > limit) {
            let values = counts.iter().map(|&count| count as f64).product();
            return Err(MeshError::TooLarge { values, limit: limit as f64 }.into());
        }
        Ok(Self { domain: *domain, counts, centering, axes })
    }

    /// The box.
    pub fn domain(&self) -> &Domain<D> {
        &self.domain
    }

    /// Where the values sit.
    pub fn centering(&self) -> Centering {
        self.centering
    }

    /// Number of values along every axis.
    pub fn counts(&self) -> [usize; D] {
        self.counts
    }

    /// Number of values, the product of the counts.
    pub fn len(&self) -> usize {
        self.counts.iter().product()
    }

    /// Never: a mesh has at least one value.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The spacings h_i.
    pub fn spacings(&self) -> [f64; D] {
        self.axes.map(|axis| axis.spacing())
    }

    /// The volume prod_i h_i that belongs to one value; the same for nodes on a bounding face.
    pub fn cell_volume(&self) -> f64 {
        self.spacings().iter().product()
    }

    /// The place of the value with these indices along the axes.
    pub fn point(&self, index: [usize; D]) -> [f64; D] {
        std::array::from_fn(|axis| self.axes[axis].point(index[axis]))
    }

    /// The places of all values, in the order of the slices.
    pub fn points(&self) -> impl Iterator<Item = [f64; D]> + '_ {
        (0..self.len()).map(|value| self.point(self.indices(value)))
    }

    /// The indices along the axes of a value in the slices.
    pub fn indices(&self, value: usize) -> [usize; D] {
        let mut rest = value;
        let mut indices = [0; D];
        for (index, &count) in indices.iter_mut().zip(&self.counts).rev() {
            *index = rest % count;
            rest /= count;
        }
        indices
    }

    /// From one value to the next along every axis; 1 along the last.
    fn strides(&self) -> [usize; D] {
        let mut strides = [1; D];
        for axis in (1..D).rev() {
            strides[axis - 1] = strides[axis] * self.counts[axis];
        }
        strides
    }

    fn check_length(&self, found: usize) -> Result<()> {
        let needed = self.len();
        if found == needed { Ok(()) } else { Err(MeshError::Length { found, needed }.into()) }
    }
}

/// The first entry, and there the first field, that is not finite.
fn not_finite<T: Field, const F: usize>(entries: &[[T; F]]) -> Option<(usize, usize, f64)> {
    const BLOCK: usize = 64;
    // Many at a time, as long as all are well.
    let well = |block: &[[T; F]]| block.as_flattened().iter().fold(true, |all, x| all & x.is_finite());
    let first = BLOCK * entries.chunks(BLOCK).position(|block| !well(block))?;
    let bad = |(i, entry): (usize, &[T; F])| {
        let field = entry.iter().position(|x| !x.is_finite())?;
        Some((i, field, entry[field].as_()))
    };
    entries.iter().enumerate().skip(first).find_map(bad)
}

/// Refuses the first value on the mesh that is not finite.
fn check_values<T: Field, const F: usize>(values: &[[T; F]]) -> Result<()> {
    not_finite(values).map_or(Ok(()), |(node, field, value)| Err(MeshError::Value { node, field, value }.into()))
}
