//! Outputs that share their conditions, and with them one factorization.

use super::Settings;
use crate::error::Result;
use crate::moment::{BatchSystem, MomentSystem};
use crate::multi_index::{Term, common_degree};
use crate::operator::Sign;
use crate::operator::expression::{Operator, collect};

/// How f_p enters at a particle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Pairing {
    /// f_q - f_p.
    Difference,
    /// f_q + f_p, the particle itself included.
    Sum,
    /// f_q alone.
    Plain,
}

impl Pairing {
    /// The factor of f_p beside f_q.
    pub(super) fn sigma(self) -> f64 {
        match self {
            Self::Difference => -1.0,
            Self::Sum => 1.0,
            Self::Plain => 0.0,
        }
    }
}

/// Outputs whose exactness m + r and pairing agree (notes, after eq. 5.47).
#[derive(Clone, Debug)]
pub(super) struct Group<const D: usize> {
    /// Whose weights each right-hand side gives.
    outputs: Vec<Column>,
    pairing: Pairing,
    /// All conditions, the zeroth moment among them.
    plain: Conditions<D>,
    /// Those of '-' at a particle, where the zeroth moment is free.
    own: Option<Conditions<D>>,
}

/// One right-hand side of a group.
#[derive(Clone, Copy, Debug)]
pub(super) struct Column {
    /// Which output of the operator it gives.
    pub(super) output: usize,
    /// Its degree m.
    pub(super) degree: u32,
    /// The power of two it was divided by. The outputs of a group are held to one bound on the residual, which a much
    /// smaller output could miss entirely.
    pub(super) scale: f64,
}

/// Conditions, as the solvers of one stencil and of many want them.
#[derive(Clone, Debug)]
pub(super) struct Conditions<const D: usize> {
    pub(super) system: MomentSystem<f64, D>,
    pub(super) batch: BatchSystem<D>,
}

impl<const D: usize> Conditions<D> {
    fn new(terms: &[Vec<Term<D>>], degree: u32, order: u32, low: u32) -> Result<Self> {
        let system = MomentSystem::new(terms, degree, order, low)?;
        Ok(Self { batch: BatchSystem::new(&system), system })
    }
}

impl<const D: usize> Group<D> {
    /// The conditions at a particle.
    pub(super) fn at_particle(&self) -> &MomentSystem<f64, D> {
        &self.own.as_ref().unwrap_or(&self.plain).system
    }

    /// Outputs, conditions and pairing of a target that is a particle, or is none.
    pub(super) fn at(&mut self, particle: bool) -> (&[Column], &mut Conditions<D>, Pairing) {
        let Self { outputs, pairing, plain, own } = self;
        match own {
            Some(own) if particle => (outputs, own, *pairing),
            _ if particle => (outputs, plain, *pairing),
            _ => (outputs, plain, Pairing::Plain),
        }
    }
}

/// The groups of an operator to order r.
///
/// # Errors
/// As [`collect`] and [`MomentSystem::new`].
pub(super) fn grouped<const D: usize, Op: Operator<D>>(
    operator: &Op,
    settings: &Settings,
    order: u32,
) -> Result<Vec<Group<D>>> {
    let outputs = collect(operator)?;
    let mut kinds = Vec::with_capacity(outputs.len());
    for terms in &outputs {
        let degree = common_degree(terms)?;
        let pairing = match (degree, settings.sign) {
            (0, _) => Pairing::Plain,
            (m, Sign::Plus) if m % 2 == 1 => Pairing::Sum,
            _ => Pairing::Difference,
        };
        kinds.push((degree, pairing));
    }
    // Which outputs go together, by the number that their exactness and pairing make.
    let key = |&(degree, pairing): &(u32, Pairing)| {
        let alike = kinds.iter().filter(|other| other.1 == pairing).map(|other| other.0);
        let top = if settings.share { alike.max().unwrap_or(degree) } else { degree };
        (top, pairing)
    };
    let mut groups: Vec<Group<D>> = Vec::new();
    let mut done: Vec<(u32, Pairing)> = Vec::new();
    for kind in &kinds {
        let (top, pairing) = key(kind);
        if done.contains(&(top, pairing)) {
            continue;
        }
        done.push((top, pairing));
        let members: Vec<usize> = (0..kinds.len()).filter(|&k| key(&kinds[k]) == (top, pairing)).collect();
        let mut terms: Vec<Vec<Term<D>>> = members.iter().map(|&k| outputs[k].clone()).collect();
        let scales = balance(&mut terms);
        let plain = Conditions::new(&terms, top, order, 0)?;
        let own = match pairing {
            Pairing::Difference if !settings.impose_zeroth => Some(Conditions::new(&terms, top, order, 1)?),
            _ => None,
        };
        let column = |(output, scale): (usize, f64)| Column { output, degree: kinds[output].0, scale };
        let outputs = members.into_iter().zip(scales).map(column).collect();
        groups.push(Group { outputs, pairing, plain, own });
    }
    Ok(groups)
}

/// Multiplies the terms of each output by a power of two, so that the largest factors of all have one exponent; returns
/// what undoes it.
fn balance<const D: usize>(outputs: &mut [Vec<Term<D>>]) -> Vec<f64> {
    let exponent = |terms: &[Term<D>]| {
        let largest = terms.iter().fold(0.0_f64, |largest, term| largest.max(term.factor.abs()));
        (largest.is_normal()).then(|| (largest.to_bits() >> 52) as i32)
    };
    let top = outputs.iter().filter_map(|terms| exponent(terms)).max().unwrap_or(0);
    let power = |exponent: i32| f64::from_bits(((1023 + exponent) as u64) << 52);
    let mut scales = Vec::with_capacity(outputs.len());
    for terms in outputs {
        // Half the range of the exponents: neither the power nor its inverse is zero.
        let below = exponent(terms).map_or(0, |own| (top - own).min(1000));
        terms.iter_mut().for_each(|term| term.factor *= power(below));
        scales.push(power(-below));
    }
    scales
}
