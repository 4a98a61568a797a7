//! The seam between kernels and meshes: the weights of one particle along one axis.

use crate::scalar::Scalar;

/// A one-dimensional kernel that spreads a particle over S neighboring nodes of a mesh; a product of them, one an axis,
/// spreads it over S^D.
///
/// With the spacing as unit of length the nodes stand at the integers, and -1/2 <= u <= 1/2 is the place of the particle
/// measured from the middle of its S nodes: node k = 0..S is s_k = u + (S - 1)/2 - k away, and its weight is
/// w_k(u) = K(s_k). For even S, u = t - 1/2 with t = s - floor(s); for odd S, u is the distance to the nearest node.
///
/// The scalar and the number of nodes stand on the trait, so that `dyn MeshKernel<f64, 4>` exists and dual numbers pass
/// through. Implement it for a kernel of your own and [`Mesh`](crate::Mesh) takes it wherever it takes ours;
/// `parops::testing::check_mesh_kernel` (feature `testing`) tells whether it keeps its promises.
///
/// ```
/// use parops::{Cic, Lambda, MeshKernel};
/// assert_eq!(Cic.weights(0.25), [0.25, 0.75]);
/// let kernel = Lambda::<2, 1>::new()?;
/// assert_eq!(kernel.weights(0.0), [-0.0625, 0.5625, 0.5625, -0.0625]);
/// # parops::Result::Ok(())
/// ```
///
/// Source: notes 001, eq. 7.20; exercise sheet 003, eq. 1 to 3.
#[diagnostic::on_unimplemented(
    message = "`{Self}` is no mesh kernel with {S} nodes",
    label = "expected a mesh kernel",
    note = "`Lambda<P, R>` has P + 2 nodes, with P even and from 2 to 2R + 1"
)]
pub trait MeshKernel<T: Scalar, const S: usize>: Send + Sync {
    /// The weights w_0(u) to w_(S-1)(u), in the order of the nodes. No allocation.
    fn weights(&self, u: T) -> [T; S];

    /// The highest P for which sum_k k^a K(x - k) = x^a for all a <= P and all x: what gathering reproduces, and which
    /// moments depositing conserves.
    fn exactness(&self) -> u32;
}
