//! The hat kernel, which turns PSE on a lattice into second-order finite differences.

use super::{Kernel, laplacian};
use crate::multi_index::Term;
use crate::scalar::Scalar;

/// The hat eta(z) = (2 - sum_i |z_i|)_+, the exchange kernel of the Laplacian to order 2 **on lattices with epsilon = h
/// only**.
///
/// There its discrete moments sum_j j^alpha eta(j) are those of the operator: 2 for alpha = 2 along an axis, 0 for the
/// others of degree 1 to 3. Unit steps have the weight 1 and all others 0, so PSE is the finite difference h^-2 sum_i
/// (f(x + h e_i) - 2 f(x) + f(x - h e_i)). Elsewhere it is wrong: the integral of z_i^2 eta is 8/3, 32/15, 64/45 for D
/// = 1, 2, 3 instead of 2, and rows of scattered sets are refused for their moments.
///
/// The support is 5/4: no lattice point lies between 1 and sqrt(2), so the cutoff keeps the 2 D unit steps alone. The
/// overlap limit is 1. The row bound on eigenvalues, 4 D/h^2, is that of the finite difference and sharp.
///
/// ```
/// use parops::{Apply, CellList, Domain, LatticeHat, Particles, Pse, Spacing};
/// let particles = Particles::lattice([0.0], [1.0], [8])?;
/// let pse = Pse::<_, 1>::with_kernels([LatticeHat::<1>::new()], Spacing(0.125).epsilon(1.0)?, particles.volumes()?)?;
/// let rows = pse.assemble(&CellList::build(&particles, &Domain::periodic([0.0], [1.0])?, pse.cutoff())?)?;
/// let f = [0.0, 1.0, 3.0, 0.0, 0.0, 0.0, 0.0, 0.0];
/// let mut second = [0.0; 8];
/// rows.apply(&f, &mut second)?;
/// assert_eq!(second[1], (0.0 - 2.0 + 3.0) / (0.125 * 0.125));
/// # parops::Result::Ok(())
/// ```
///
/// Source: notes 000, eq. 27 to 31, there for D = 1; the sum of |z_i| in place of |z| is ours and makes it serve any D.
/// See also: [`Exchange`](crate::Exchange) for anything but lattices.
#[derive(Clone, Debug)]
pub struct LatticeHat<const D: usize>([Term<D>; D]);

impl<const D: usize> LatticeHat<D> {
    /// The kernel.
    pub fn new() -> Self {
        Self(laplacian())
    }
}

impl<const D: usize> Default for LatticeHat<D> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Scalar, const D: usize> Kernel<T, D> for LatticeHat<D> {
    #[inline]
    fn value(&self, z: &[T; D]) -> T {
        // What a difference loses is exact while it is positive, and later ones may cancel all the rest.
        let (mut rest, mut lost) = (T::lift(2.0), T::zero());
        for x in z {
            let next = rest - x.abs();
            lost += (rest - next) - x.abs();
            rest = next;
        }
        // Written so that NaN stays.
        if rest < T::zero() || rest + lost <= T::zero() { T::zero() } else { rest + lost }
    }

    fn terms(&self) -> &[Term<D>] {
        &self.0
    }

    fn order(&self) -> u32 {
        2
    }

    fn support(&self) -> f64 {
        1.25
    }

    /// 1, which is also the only legal value.
    fn overlap_limit(&self) -> f64 {
        1.0
    }
}
