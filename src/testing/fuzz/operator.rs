//! Operators from bytes.

use super::Checked;
use super::bytes::Bytes;
use super::fault::{FuzzFault, FuzzOutcome};
use super::own_rows::OwnRows;
use super::pairwise::Exchanged;
use super::row::build;
use super::rules::same;
use super::scene::{Scene, Wild};
use super::solved::Corrected;
use super::upwind::OneWay;
use crate::apply::Field;
use crate::error::{Error, ErrorKind, OperatorError, ParticleError, Result};
use crate::kernel::{Exchange, Kernel};
use crate::moment::{Ladder, Lu, MomentSolver, PivotedQr};
use crate::multi_index::{MultiIndex, Term};
use crate::neighbors::{CellList, Nearest, NeighborList, Neighbors};
use crate::operator::{Allowance, DcPse, Expression, Fallback, Pse, Sign, Upwind};
use crate::scale::{Cutoff, Epsilon, Volumes};

/// Builds an operator from any bytes: PSE, DC-PSE by each kind of solver, or upwind.
///
/// The bytes stand for a method, a derivative of degree 1 to 3, an order of 1 to 4, the scalar of the rows, particles and
/// box as for [`fuzz_neighbor_build`](super::fuzz_neighbor_build) (or rows of a caller's own), volumes, smoothing lengths,
/// velocities, settings and a field; illegal ones among them. Weights of PSE must be those of the formula, with overlap and
/// moments summed anew; those of DC-PSE must meet their moment conditions to the residual reported and the rounding of the
/// sum; upwind weights have one sign, lie on the side of the velocity, and give linear functions their slope. Application
/// must be the sum it stands for. A refusal must name a rule that the input breaks, with its numbers, and a moment system
/// of a moderate condition number must not be refused. A case takes at most some milliseconds.
///
/// ```
/// use parops::testing::{FuzzOutcome, fuzz_operator_build};
/// assert_eq!(fuzz_operator_build(b""), Ok(FuzzOutcome::Built));
/// ```
///
/// # Errors
/// The first [`FuzzFault`] found.
pub fn fuzz_operator_build(bytes: &[u8]) -> Checked<FuzzOutcome> {
    let mut bytes = Bytes(bytes);
    match bytes.up_to(9) {
        0 => exchange::<1>(&mut bytes, 60),
        1 | 2 => exchange::<2>(&mut bytes, 60),
        3 | 4 => corrected::<2, f64, _>(&mut bytes, Ladder, 60, 1e4),
        5 => corrected::<2, f64, _>(&mut bytes, PivotedQr, 60, 1e4),
        6 => corrected::<2, f64, _>(&mut bytes, Lu, 60, 1.0),
        7 => corrected::<3, f64, _>(&mut bytes, Ladder, 64, 1e4),
        8 => corrected::<2, f32, _>(&mut bytes, Ladder, 60, 1e4),
        _ => upwind::<2>(&mut bytes, 60),
    }
}

/// One value, or one a particle.
#[derive(Clone, Debug)]
pub(super) struct PerParticle {
    values: Vec<f64>,
    each: bool,
}

impl PerParticle {
    /// Values around `scale` for so many particles.
    fn from(bytes: &mut Bytes, wild: bool, scale: f64, count: usize) -> Self {
        let each = bytes.once_in(2);
        let count = if wild && bytes.once_in(32) { bytes.up_to(count) } else { count };
        let value = |_| {
            let spread = if each { 0.75 + f64::from(bytes.byte()) / 512.0 } else { 1.0 };
            bytes.or_any(wild, if each { 64 } else { 4 }, spread * scale)
        };
        Self { values: (0..if each { count } else { 1 }).map(value).collect(), each }
    }

    pub(super) fn get(&self, p: usize) -> f64 {
        self.values.get(if self.each { p } else { 0 }).copied().unwrap_or(f64::NAN)
    }

    fn epsilon(&self) -> Result<Epsilon> {
        if self.each { Epsilon::each(self.values.clone()) } else { Epsilon::global(self.values[0]) }
    }

    fn volumes(&self) -> Result<Volumes> {
        if self.each { Volumes::each(self.values.clone()) } else { Volumes::equal(self.values[0]) }
    }

    /// Whether the value a refusal names is illegal.
    fn deserves(&self, error: &Error) -> bool {
        let (ErrorKind::Particle(ParticleError::Epsilon { epsilon: value })
        | ErrorKind::Particle(ParticleError::Volume { volume: value })) = *error.kind()
        else {
            return false;
        };
        let legal = value > 0.0 && value.is_finite();
        !legal && error.particle().is_some() == self.each && same(self.get(error.particle().unwrap_or(0)), value)
    }

    /// The first illegal value.
    fn illegal(&self) -> Option<(usize, f64)> {
        self.values.iter().copied().enumerate().find(|(_, value)| !(*value > 0.0 && value.is_finite()))
    }

    /// The refusal due for another number of particles.
    fn wrong_length(&self, count: usize, error: &Error) -> bool {
        let found = self.values.len();
        let due = ParticleError::Length { found, needed: count };
        self.each && found != count && *error.kind() == ErrorKind::Particle(due)
    }

    /// What was made of the values, `None` where they were refused as they should be.
    fn made<T>(&self, build: &'static str, made: Result<T>) -> Checked<Option<T>> {
        match (made, self.illegal()) {
            (Ok(made), None) => Ok(Some(made)),
            (Ok(_), Some((p, value))) => Err(FuzzFault::Accepted { build, p, value }),
            (Err(error), _) if self.deserves(&error) => Ok(None),
            (Err(error), _) => Err(FuzzFault::Refused { build, error }),
        }
    }
}

/// A setting that must be positive: what was made of it, `None` where it was refused as it should be.
fn set<T>(build: &'static str, value: f64, made: Result<T>) -> Checked<Option<T>> {
    let legal = value > 0.0 && value.is_finite();
    match made {
        Ok(made) if legal => Ok(Some(made)),
        Ok(_) => Err(FuzzFault::Accepted { build, p: 0, value }),
        Err(error) => {
            let named =
                matches!(*error.kind(), ErrorKind::Operator(OperatorError::Setting { value: v }) if same(v, value));
            if named && !legal { Ok(None) } else { Err(FuzzFault::Refused { build, error }) }
        }
    }
}

/// A derivative of degree 1 to 3.
fn terms<const D: usize>(bytes: &mut Bytes) -> Vec<Term<D>> {
    let (kind, axis) = (bytes.byte() % 5, bytes.up_to(D - 1));
    let along = |axis: usize, degree: u8| -> Term<D> {
        Term { index: MultiIndex::new(std::array::from_fn(|i| if i == axis { degree } else { 0 })), factor: 1.0 }
    };
    let mixed = |first: u8| -> Term<D> {
        let exponent = |i: usize| if i == axis { first } else { u8::from(i == (axis + 1) % D) };
        Term { index: MultiIndex::new(std::array::from_fn(exponent)), factor: 1.0 }
    };
    match kind {
        1 => vec![along(axis, 1)],
        2 if D > 1 => vec![mixed(1)],
        3 if D > 1 => vec![mixed(2)],
        4 => vec![along(axis, 3)],
        _ => (0..D).map(|axis| along(axis, 2)).collect(),
    }
}

fn expression<const D: usize>(terms: &[Term<D>]) -> Checked<Expression<D>> {
    let made = Expression::new(terms.iter().map(|term| (term.index, term.factor)));
    made.map_err(|error| FuzzFault::Refused { build: "Expression", error })
}

fn allowance(bytes: &mut Bytes) -> Allowance {
    match bytes.byte() % 4 {
        0 => Allowance::Nowhere,
        1 => Allowance::at([bytes.up_to(60), bytes.up_to(60)]),
        _ => Allowance::Everywhere,
    }
}

/// Particles in their box, and the lengths that go with them.
struct Setting<const D: usize> {
    scene: Scene<D>,
    wild: Wild,
    /// Mean spacing, and the widest cutoff that the box admits.
    spacing: f64,
    widest: f64,
}

impl<const D: usize> Setting<D> {
    fn from(bytes: &mut Bytes, count: usize) -> Self {
        let wild = Wild::from(bytes);
        let scene = Scene::<D>::from(bytes, wild, count);
        let finite = |axis: usize| {
            let width = scene.upper[axis] - scene.lower[axis];
            if width.is_finite() && width > 0.0 { width } else { 1.0 }
        };
        let volume: f64 = (0..D).map(finite).product();
        let spacing = (volume / scene.points.len().max(1) as f64).powf(1.0 / D as f64);
        let closed = (0..D).filter(|&axis| !scene.faces[axis].contains(&crate::domain::Face::Open));
        let widest = closed.map(|axis| 0.5 * finite(axis)).fold(16.0 * spacing, f64::min);
        Self { scene, wild, spacing, widest }
    }

    fn cells(&self, cutoff: f64) -> Result<NeighborList<D>> {
        let list = CellList::build(&self.scene.particles()?, &self.scene.domain()?, Cutoff(cutoff))?;
        NeighborList::from_provider(&list)
    }

    fn nearest(&self, k: usize) -> Result<NeighborList<D>> {
        let nearest = Nearest::build(&self.scene.particles()?, &self.scene.domain()?, k)?;
        NeighborList::from_provider(&nearest)
    }
}

/// Support and tolerance of a method of fixed kernels: tame ones fit the box.
fn support(bytes: &mut Bytes, wild: bool, own: f64, widest: f64, epsilon: &PerParticle) -> (f64, f64) {
    let largest = epsilon.values.iter().copied().fold(0.0, f64::max);
    let fitting = if largest > 0.0 { own.min(0.999 * widest / largest) } else { own };
    let tolerance = bytes.choose([0.05, 0.05, 0.5, 5.0]);
    (bytes.or_any(wild, 8, fitting), bytes.or_any(wild, 8, tolerance))
}

fn exchange<const D: usize>(bytes: &mut Bytes, count: usize) -> Checked<FuzzOutcome> {
    let setting = Setting::<D>::from(bytes, count);
    let Setting { wild, spacing, widest, .. } = setting;
    let (terms, order) = (terms::<D>(bytes), bytes.choose([2, 4]));
    let particles = setting.scene.points.len();
    let ratio = bytes.choose([1.5, 1.2, 2.0, 1.0, 0.5]);
    let epsilon = PerParticle::from(bytes, wild.lengths(), ratio * spacing, particles);
    let volumes = PerParticle::from(bytes, wild.particles(), spacing.powi(D as i32), particles);
    let refusal = |error| FuzzFault::Refused { build: "Exchange", error };
    let kernel = Exchange::new(&terms, order).map_err(refusal)?;
    let (support, tolerance) = support(bytes, wild.settings(), Kernel::<f64, D>::support(&kernel), widest, &epsilon);
    let allowance = allowance(bytes);
    let plus = bytes.once_in(2);

    let Some(lengths) = epsilon.made("Epsilon", epsilon.epsilon())? else { return Ok(FuzzOutcome::Refused) };
    let Some(held) = volumes.made("Volumes", volumes.volumes())? else { return Ok(FuzzOutcome::Refused) };
    let made = Pse::new(expression(&terms)?, order, lengths, &held);
    let mut pse = made.map_err(|error| FuzzFault::Refused { build: "Pse", error })?.allow(allowance.clone());
    let odd = terms[0].index.degree() % 2 == 1;
    let sign = if plus { Sign::Plus } else { Sign::Minus };
    match pse.clone().sign(sign) {
        Ok(signed) if odd || !plus => pse = signed,
        Err(error) if !odd && plus => {
            let due = OperatorError::PlusEven { degree: terms[0].index.degree() };
            if *error.kind() != ErrorKind::Operator(due) {
                return Err(FuzzFault::Refused { build: "Pse", error });
            }
        }
        Ok(_) => return Err(FuzzFault::Accepted { build: "Pse", p: 0, value: 1.0 }),
        Err(error) => return Err(FuzzFault::Refused { build: "Pse", error }),
    }
    let Some(pse) = set("Pse", support, pse.support(support))? else { return Ok(FuzzOutcome::Refused) };
    let Some(pse) = set("Pse", tolerance, pse.moment_tolerance(tolerance))? else { return Ok(FuzzOutcome::Refused) };
    // What is wrong with the neighbors is for the other target to find.
    let Ok(list) = setting.cells(pse.cutoff().0) else { return Ok(FuzzOutcome::Refused) };
    let sigma = if odd && plus { 1.0 } else { -1.0 };
    let judge = Exchanged { kernel, epsilon, volumes, support, tolerance, allowance, sigma };
    if let Err(error) = crate::operator::Method::<D>::validate(&pse, particles, particles) {
        let due = judge.epsilon.wrong_length(particles, &error) || judge.volumes.wrong_length(particles, &error);
        return if due { Ok(FuzzOutcome::Refused) } else { Err(FuzzFault::Refused { build: "Pse", error }) };
    }
    build::<D, f64, _, _>(bytes, &pse, &mut { judge }, &list, wild.nowhere())
}

fn corrected<const D: usize, T: Field, S: MomentSolver>(
    bytes: &mut Bytes,
    solver: S,
    count: usize,
    safe: f64,
) -> Checked<FuzzOutcome> {
    let setting = Setting::<D>::from(bytes, count);
    let wild = setting.wild;
    let terms = terms::<D>(bytes);
    let order = if D == 2 { bytes.choose([2, 1, 3, 4]) } else { bytes.choose([2, 1]) };
    let ratio = bytes.choose([2.0, 1.0, 1.3, 1.7]);
    let fallback = bytes.choose([Fallback::Refuse, Fallback::LowerOrder, Fallback::Empty]);
    let (plus, impose_zeroth) = (!bytes.once_in(3), bytes.once_in(4));
    let degree = terms[0].index.degree();
    let refusal = |error| FuzzFault::Refused { build: "DcPse", error };
    let mut dcpse = DcPse::at_order(expression(&terms)?, order).map_err(refusal)?.solver(solver);
    dcpse = dcpse.neighbors_per_condition(ratio).map_err(refusal)?.fallback(fallback);
    dcpse = dcpse.sign(if plus { Sign::Plus } else { Sign::Minus });
    if impose_zeroth {
        dcpse = dcpse.impose_zeroth();
    }
    let needed = dcpse.fewest_neighbors::<D>().map_err(refusal)?;
    let kind = bytes.byte() % 8;
    let list = match kind {
        0..3 => setting.nearest(needed + bytes.up_to(4)),
        3..6 => {
            let part = 0.5 + 2.5 * bytes.fraction();
            let part = bytes.or_any(wild.lengths(), 8, part);
            // The ball of so many particles.
            let radius = 0.6 * setting.spacing * (needed as f64).powf(1.0 / D as f64);
            setting.cells((part * radius).min(setting.widest))
        }
        _ => OwnRows::<D>::from(bytes, wild, 6, needed + 4).build(),
    };
    let Ok(list) = list else { return Ok(FuzzOutcome::Refused) };
    let mut epsilon = None;
    if bytes.once_in(4) {
        let scale = list.reach() / bytes.choose([2.2, 1.5, 3.0, 5.9, 1.0]);
        let values = PerParticle::from(bytes, wild.particles(), scale, list.targets());
        let Some(lengths) = values.made("Epsilon", values.epsilon())? else { return Ok(FuzzOutcome::Refused) };
        dcpse = dcpse.epsilon(lengths);
        epsilon = Some(values);
    }
    let sigma = if plus && degree % 2 == 1 { 1.0 } else { -1.0 };
    let judge = Corrected { terms, degree, order, sigma, impose_zeroth, ratio, epsilon, safe };
    if let Err(error) = crate::operator::Method::<D>::validate(&dcpse, list.targets(), list.sources()) {
        let due = judge.epsilon.as_ref().is_some_and(|epsilon| epsilon.wrong_length(list.targets(), &error));
        return if due { Ok(FuzzOutcome::Refused) } else { Err(refusal(error)) };
    }
    build::<D, T, _, _>(bytes, &dcpse, &mut { judge }, &list, wild.nowhere() && kind < 6)
}

fn upwind<const D: usize>(bytes: &mut Bytes, count: usize) -> Checked<FuzzOutcome> {
    let setting = Setting::<D>::from(bytes, count);
    let Setting { wild, spacing, widest, .. } = setting;
    let particles = setting.scene.points.len();
    let ratio = bytes.choose([1.0, 1.5, 0.7]);
    let epsilon = PerParticle::from(bytes, wild.lengths(), ratio * spacing, particles);
    let volumes = PerParticle::from(bytes, wild.particles(), spacing.powi(D as i32), particles);
    let (support, tolerance) = support(bytes, wild.settings(), 6.0, widest, &epsilon);
    let allowance = allowance(bytes);
    let still = bytes.once_in(4);
    let component = |bytes: &mut Bytes| {
        let v = f64::from(bytes.byte()) / 64.0 - 2.0;
        bytes.or_any(wild.settings(), 64, if still { v.max(0.0) } else { v })
    };
    let velocities: Vec<[f64; D]> = (0..particles).map(|_| std::array::from_fn(|_| component(bytes))).collect();

    let Some(lengths) = epsilon.made("Epsilon", epsilon.epsilon())? else { return Ok(FuzzOutcome::Refused) };
    let Some(held) = volumes.made("Volumes", volumes.volumes())? else { return Ok(FuzzOutcome::Refused) };
    let bad = velocities.iter().position(|v| v.iter().any(|v| !v.is_finite()));
    let upwind = match (Upwind::new(velocities.clone(), lengths, &held), bad) {
        (Ok(upwind), None) => upwind.allow(allowance.clone()),
        (Ok(_), Some(p)) => return Err(FuzzFault::Accepted { build: "Upwind", p, value: f64::NAN }),
        (Err(error), bad) => {
            let named = match *error.kind() {
                ErrorKind::Particle(ParticleError::Velocity { axis, velocity }) => {
                    bad.is_some_and(|p| error.particle() == bad && same(velocities[p][axis], velocity))
                }
                _ => false,
            };
            return if named { Ok(FuzzOutcome::Refused) } else { Err(FuzzFault::Refused { build: "Upwind", error }) };
        }
    };
    let Some(upwind) = set("Upwind", support, upwind.support(support))? else { return Ok(FuzzOutcome::Refused) };
    let Some(upwind) = set("Upwind", tolerance, upwind.moment_tolerance(tolerance))? else {
        return Ok(FuzzOutcome::Refused);
    };
    let Ok(list) = setting.cells(upwind.cutoff().0) else { return Ok(FuzzOutcome::Refused) };
    let judge = OneWay { velocities, epsilon, support, tolerance, allowance };
    if let Err(error) = crate::operator::Method::<D>::validate(&upwind, particles, particles) {
        let due = judge.epsilon.wrong_length(particles, &error) || volumes.wrong_length(particles, &error);
        return if due { Ok(FuzzOutcome::Refused) } else { Err(FuzzFault::Refused { build: "Upwind", error }) };
    }
    build::<D, f64, _, _>(bytes, &upwind, &mut { judge }, &list, wild.nowhere())
}
