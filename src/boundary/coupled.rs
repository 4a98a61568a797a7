//! The boundary values that stand in each other's conditions: one sparse system.

use super::condition::BoundaryCondition;
use crate::apply::Field;
use crate::error::{ApplyError, BoundaryError, Error, ErrorKind, LinearError, Result};
use crate::linear::{CsrMatrix, SolveReport, SparseSolver};
use crate::particles::reserved;

/// The conditions split by what their columns are.
///
/// Fixed values, those of conditions without a derivative, are known at once. The others are the unknowns x of
/// C x = g - I u - F f, with the columns of the unknowns in C, of interior particles in I, of fixed values f in F.
#[derive(Debug)]
pub(super) struct Coupled {
    fixed: Vec<Fixed>,
    /// The particles of the unknowns.
    unknown: Vec<usize>,
    interior: CsrMatrix,
    from_fixed: CsrMatrix,
    /// C; none without unknowns.
    solver: Option<SparseSolver>,
    condition: f64,
    fixed_values: Vec<f64>,
    right: Vec<f64>,
    x: Vec<f64>,
}

#[derive(Clone, Copy, Debug)]
struct Fixed {
    particle: usize,
    /// The factor of u.
    a: f64,
}

/// What one call of [`BoundaryRows::impose`](super::BoundaryRows::impose) did.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct BoundaryReport {
    /// Boundary values that were found together, those of Neumann and Robin conditions.
    pub unknowns: usize,
    /// Iterations, or steps of refinement, of the solver.
    pub iterations: usize,
    /// Relative residual of the coupled system.
    pub residual: f64,
    /// Estimated condition number of the coupled system, from the build; 0 where there is none.
    pub condition: f64,
}

/// A condition number no digit survives, less two bits.
const SINGULAR: f64 = 0.25 / f64::EPSILON;

/// What a particle is to the conditions.
#[derive(Clone, Copy)]
enum Role {
    Interior,
    Fixed(usize),
    Unknown(usize),
}

impl Coupled {
    /// Splits the equations of the conditions, and prepares the system of the unknowns.
    pub(super) fn new<const D: usize>(conditions: &[BoundaryCondition<D>], equations: &CsrMatrix) -> Result<Self> {
        let particles = equations.columns();
        let mut roles = vec![Role::Interior; particles];
        let (mut fixed, mut unknown, mut rows) = (Vec::new(), Vec::new(), Vec::new());
        for (i, condition) in conditions.iter().enumerate() {
            let particle = condition.particle();
            if condition.has_flux() {
                roles[particle] = Role::Unknown(unknown.len());
                unknown.push(particle);
                rows.push(i);
            } else {
                roles[particle] = Role::Fixed(fixed.len());
                fixed.push(Fixed { particle, a: condition.factors().0 });
            }
        }
        let [mut interior, mut from_fixed, mut coupling] = [const { Vec::new() }; 3];
        for (row, (&i, &p)) in rows.iter().zip(&unknown).enumerate() {
            let Some((columns, values)) = equations.row(i) else { continue };
            let (mut largest, mut coupled) = (0.0_f64, 0.0_f64);
            for (&q, &value) in columns.iter().zip(values) {
                largest = largest.max(value.abs());
                match roles[q as usize] {
                    Role::Interior => interior.push((row, q as usize, value)),
                    Role::Fixed(k) => from_fixed.push((row, k, value)),
                    Role::Unknown(k) => {
                        coupled = coupled.max(value.abs());
                        coupling.push((row, k, value));
                    }
                }
            }
            // Where a cancels the weights of the unknowns, what is left of them is rounding, whatever its scale.
            if !(coupled > columns.len() as f64 * f64::EPSILON * largest) {
                return Err(Error::from(LinearError::Singular { condition: largest / coupled }).at(p));
            }
        }
        let count = unknown.len();
        let (solver, condition) = prepared(CsrMatrix::from_triplets(count, count, coupling)?, &unknown)?;
        Ok(Self {
            interior: CsrMatrix::from_triplets(count, particles, interior)?,
            from_fixed: CsrMatrix::from_triplets(count, fixed.len(), from_fixed)?,
            solver,
            condition,
            fixed_values: zeros(fixed.len())?,
            right: zeros(count)?,
            x: zeros(count)?,
            fixed,
            unknown,
        })
    }

    /// Finds all boundary values, and writes them once none can fail.
    pub(super) fn impose<T: Field>(&mut self, mut g: impl FnMut(usize) -> f64, u: &mut [T]) -> Result<BoundaryReport> {
        let needed = self.interior.columns();
        if u.len() != needed {
            return Err(ApplyError::Input { found: u.len(), needed }.into());
        }
        for (value, &Fixed { particle, a }) in self.fixed_values.iter_mut().zip(&self.fixed) {
            *value = given(&mut g, particle)? / a;
        }
        for (row, &particle) in self.unknown.iter().enumerate() {
            let right = given(&mut g, particle)?
                - sum(&self.interior, row, |q| u[q].as_())
                - sum(&self.from_fixed, row, |k| self.fixed_values[k]);
            if !right.is_finite() {
                let columns = self.interior.row(row).map_or(&[][..], |(columns, _)| columns).iter();
                let bad = columns.map(|&q| (q as usize, u[q as usize])).find(|(_, value)| !value.is_finite());
                return Err(match bad {
                    Some((q, value)) => Error::from(ApplyError::Field { value: value.as_() }).at(q),
                    None => Error::from(ApplyError::Overflow { value: right }).at(particle),
                });
            }
            self.right[row] = right;
        }
        let solved = match &mut self.solver {
            Some(solver) => solver.solve(&self.right, &mut self.x).map_err(|error| named(error, &self.unknown))?,
            None => SolveReport::default(),
        };
        let fixed = self.fixed.iter().map(|fixed| fixed.particle).zip(&self.fixed_values);
        let all = || fixed.clone().chain(self.unknown.iter().copied().zip(&self.x));
        if let Some((p, &value)) = all().find(|(_, value)| !T::lift(**value).is_finite()) {
            return Err(Error::from(ApplyError::Overflow { value }).at(p));
        }
        all().for_each(|(p, &value)| u[p] = T::lift(value));
        Ok(BoundaryReport {
            unknowns: self.unknown.len(),
            iterations: solved.iterations,
            residual: solved.residual,
            condition: self.condition,
        })
    }
}

/// The solver of the coupled system, where there is one, and its condition number.
fn prepared(coupling: CsrMatrix, particles: &[usize]) -> Result<(Option<SparseSolver>, f64)> {
    if particles.is_empty() {
        return Ok((None, 0.0));
    }
    let name = |error| named(error, particles);
    let mut solver = SparseSolver::new(coupling).map_err(name)?;
    let condition = solver.condition().map_err(name)?;
    if condition < SINGULAR { Ok((Some(solver), condition)) } else { Err(LinearError::Singular { condition }.into()) }
}

/// The solver names rows, these are the particles of them. A right side too large to be scaled like its row belongs to a
/// boundary value that is too large.
fn named(error: Error, particles: &[usize]) -> Error {
    let error = match (error.kind(), error.particle()) {
        (&ErrorKind::Linear(LinearError::Value { value }), Some(row)) => {
            Error::from(ApplyError::Overflow { value }).at(row)
        }
        _ => error,
    };
    match error.particle().and_then(|row| particles.get(row)) {
        Some(&p) => error.at(p),
        None => error,
    }
}

/// g at a particle.
fn given(g: &mut impl FnMut(usize) -> f64, p: usize) -> Result<f64> {
    let value = g(p);
    if value.is_finite() { Ok(value) } else { Err(Error::from(BoundaryError::Value { value }).at(p)) }
}

/// One row times the vector with these entries.
fn sum(matrix: &CsrMatrix, row: usize, entry: impl Fn(usize) -> f64) -> f64 {
    let Some((columns, values)) = matrix.row(row) else { return 0.0 };
    columns.iter().zip(values).fold(0.0, |sum, (&q, value)| sum + value * entry(q as usize))
}

fn zeros(count: usize) -> Result<Vec<f64>> {
    let mut values = reserved(count)?;
    values.resize(count, 0.0);
    Ok(values)
}
