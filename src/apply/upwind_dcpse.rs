//! Upwind DC-PSE: half-stencils of order 2, biased stencils of order 3.

use super::sided::SidedRows;
use super::{Field, Rows};
use crate::error::{Error, ErrorKind, OperatorError, Result};
use crate::multi_index::MultiIndex;
use crate::neighbors::{Neighbors, Upstream};
use crate::operator::{DcPse, Expression, Facing, Fallback, Screened, Sign};
use crate::scale::Spacing;
use crate::stencil::Side;

/// v . grad by DC-PSE rows that look where the velocity comes from, in the form u_q - u_p.
///
/// Order 2: half-stencils, the n = 2 l nearest neighbors on one side of the plane through the particle. Order 3: stencils
/// biased, not halved: the n = 2 l neighbors nearest to the point m one spacing h upstream along the axis, with the window
/// exp(-|x_q - x_m|^2/epsilon^2) centered there and the monomials at the particle; at least half of them must lie
/// upstream. epsilon is the cutoff over [`CUTOFF_OVER_EPSILON`](crate::CUTOFF_OVER_EPSILON). Rows are exact for
/// polynomials of degree 2 and 3; certificate, report and growth are those of [`DcPse`]. They do not depend on the
/// velocity: one row for every axis and side, 2 D n weights a particle; n = 4, 10, 18 for order 2 and 6, 18, 38 for
/// order 3 in 1, 2, 3 dimensions.
///
/// Spectra of -v . grad on periodic sets in 2D of jitter to 0.1 h lie left of the imaginary axis for both orders, 400 cases
/// each; at 0.3 h modes grow in 2 to 4 % of the cases by half-stencils, mostly of flows along an axis, and in 0.2 to 2 % by
/// biased ones, at up to 0.15 of the radius: ask [`SpectrumEstimator`](crate::SpectrumEstimator), as runs do by
/// default. Elsewhere RK4 is stable. Euler is not, at any step that is of use: a wave of number kappa is damped at a
/// rate of order kappa^4 h^3 only, and Euler lets it grow by (kappa |v| dt)^2/2 a step.
///
/// ```
/// use parops::{Domain, Nearest, Particles, UpwindDcPse};
/// let set = Particles::jittered([0.0; 2], [1.0; 2], [16; 2], 0.3, 1)?;
/// let upwind = UpwindDcPse::biased(set.spacing()?);
/// let around = Nearest::build(&set, &Domain::periodic([0.0; 2], [1.0; 2])?, upwind.neighbors::<2>()?)?;
/// let rows = upwind.assemble(&around)?;
/// assert_eq!((rows.report().order, rows.report().fewest), (Some(3), 18));
/// # parops::Result::Ok(())
/// ```
///
/// Source: notes 001, sec. 6.3.1 with errata 28 and 32, and eq. 5.33 to 5.47; half-stencils and bias are ours.
/// See also: [`UpwindGradient`](crate::UpwindGradient), order 1, which keeps the maximum principle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UpwindDcPse {
    /// h of order 3; `None` for order 2.
    shift: Option<Spacing>,
    open: bool,
}

impl UpwindDcPse {
    /// Order 2 on half-stencils.
    pub fn half_stencils() -> Self {
        Self { shift: None, open: false }
    }

    /// Order 3 on stencils centered one spacing h upstream.
    pub fn biased(h: Spacing) -> Self {
        Self { shift: Some(h), open: false }
    }

    /// Leaves sides without enough neighbors empty, as at the edges of a set; a velocity that comes from there is refused
    /// when it is applied. By default they are refused when the rows are built.
    #[must_use]
    pub fn open_sides(self) -> Self {
        Self { open: true, ..self }
    }

    /// r.
    pub fn order(&self) -> u32 {
        if self.shift.is_none() { 2 } else { 3 }
    }

    /// How many neighbors around a particle [`Nearest`](crate::Nearest) should gather; stencils that need a wider support
    /// find it in the room `Nearest` keeps.
    ///
    /// # Errors
    /// As [`DcPse::fewest_neighbors`].
    pub fn neighbors<const D: usize>(&self) -> Result<usize> {
        let needed = self.derivative::<D>(0)?.fewest_neighbors::<D>()?;
        Ok(2 * needed + needed / 2)
    }

    /// Builds the rows of all axes and sides.
    ///
    /// # Errors
    /// [`OperatorError::ThinSide`] naming particle, axis and side of the first row that the neighbors on that side do not
    /// determine, with [`Error::wanted_cutoff`]; otherwise as [`Rows::assemble`].
    pub fn assemble<const D: usize, P: Neighbors<D>>(&self, neighbors: &P) -> Result<SidedRows<D>> {
        self.assemble_as(neighbors)
    }

    /// As [`assemble`](Self::assemble), with weights rounded to `T`.
    ///
    /// # Errors
    /// As [`assemble`](Self::assemble).
    pub fn assemble_as<const D: usize, T: Field, P: Neighbors<D>>(&self, neighbors: &P) -> Result<SidedRows<D, T>> {
        SidedRows::new(|axis, side| {
            let derivative = self.derivative::<D>(axis)?;
            let k = derivative.fewest_neighbors::<D>()?;
            let upstream = match self.shift {
                None => Upstream::half(neighbors, axis, side, k)?,
                Some(h) => Upstream::biased(neighbors, axis, side, h, k)?,
            };
            Rows::assemble(&Screened { method: &derivative, screen: Facing { axis, side } }, &upstream)
                .map_err(|error| named(error, axis, side))
        })
    }

    /// d/dx_axis to this order, in the form u_q - u_p.
    fn derivative<const D: usize>(&self, axis: usize) -> Result<DcPse<Expression<D>>> {
        let index = MultiIndex::new(std::array::from_fn(|i| u8::from(i == axis)));
        let dcpse = DcPse::at_order(Expression::new([(index, 1.0)])?, self.order())?.sign(Sign::Minus);
        Ok(if self.open { dcpse.fallback(Fallback::Empty) } else { dcpse })
    }
}

/// Says which side lacks neighbors.
fn named(error: Error, axis: usize, side: Side) -> Error {
    use OperatorError::{Singular, TooFew, Uncertified};
    let ErrorKind::Operator(
        TooFew { neighbors, conditions, .. }
        | Singular { neighbors, conditions, .. }
        | Uncertified { neighbors, conditions, .. },
    ) = *error.kind()
    else {
        return error;
    };
    error.renamed(OperatorError::ThinSide { axis, side, neighbors, conditions })
}
