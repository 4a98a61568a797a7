//! What is asked for at a boundary particle.

use crate::error::{BoundaryError, Error, Result};

/// The condition a u + b du/dn = g at one boundary particle p, with n the outward normal there; g is given when the
/// conditions are imposed.
///
/// Dirichlet is a = 1, b = 0; Neumann a = 0, b = 1; Robin anything else. `a` has the unit of g over that of u, `b` a
/// length more.
///
/// ```
/// use parops::BoundaryCondition;
/// let cooled = BoundaryCondition::robin(7, [0.0, -1.0], 2.5, 1.0);
/// assert_eq!((cooled.particle(), cooled.factors()), (7, (2.5, 1.0)));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoundaryCondition<const D: usize> {
    particle: usize,
    a: f64,
    b: f64,
    normal: [f64; D],
}

/// How far the length of a normal may be from 1. Within it normals are divided by their length.
pub const NORMAL_TOLERANCE: f64 = 1e-8;

impl<const D: usize> BoundaryCondition<D> {
    /// u = g at particle p.
    pub fn dirichlet(p: usize) -> Self {
        Self { particle: p, a: 1.0, b: 0.0, normal: [0.0; D] }
    }

    /// du/dn = g at particle p with outward unit normal n.
    pub fn neumann(p: usize, normal: [f64; D]) -> Self {
        Self::robin(p, normal, 0.0, 1.0)
    }

    /// a u + b du/dn = g at particle p with outward unit normal n. The normal is not looked at where b = 0.
    pub fn robin(p: usize, normal: [f64; D], a: f64, b: f64) -> Self {
        Self { particle: p, a, b, normal }
    }

    /// The particle p.
    pub fn particle(&self) -> usize {
        self.particle
    }

    /// The factors (a, b) of u and of du/dn.
    pub fn factors(&self) -> (f64, f64) {
        (self.a, self.b)
    }

    /// The normal divided by its length.
    pub(super) fn unit_normal(&self) -> [f64; D] {
        let length = self.length();
        self.normal.map(|n| n / length)
    }

    pub(super) fn has_flux(&self) -> bool {
        self.b != 0.0
    }

    fn length(&self) -> f64 {
        self.normal.iter().fold(0.0, |sum, n| sum + n * n).sqrt()
    }

    /// Checks factors and, where it matters, the normal.
    pub(super) fn validate(&self) -> Result<()> {
        let Self { particle, a, b, .. } = *self;
        let refuse = |kind: BoundaryError| Err(Error::from(kind).at(particle));
        if !(a.is_finite() && b.is_finite()) || (a == 0.0 && b == 0.0) {
            return refuse(BoundaryError::Factors { a, b });
        }
        let length = self.length();
        if self.has_flux() && !((length - 1.0).abs() <= NORMAL_TOLERANCE) {
            return refuse(BoundaryError::Normal { length, tolerance: NORMAL_TOLERANCE });
        }
        Ok(())
    }
}
