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
    /// Output k of the operator and its degree m, for every right-hand side.
    outputs: Vec<(usize, u32)>,
    pairing: Pairing,
    /// All conditions, the zeroth moment among them.
    plain: Conditions<D>,
    /// Those of '-' at a particle, where the zeroth moment is free.
    own: Option<Conditions<D>>,
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
    pub(super) fn at(&mut self, particle: bool) -> (&[(usize, u32)], &mut Conditions<D>, Pairing) {
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
        let terms: Vec<Vec<Term<D>>> = members.iter().map(|&k| outputs[k].clone()).collect();
        let plain = Conditions::new(&terms, top, order, 0)?;
        let own = match pairing {
            Pairing::Difference if !settings.impose_zeroth => Some(Conditions::new(&terms, top, order, 1)?),
            _ => None,
        };
        let outputs = members.into_iter().map(|k| (k, kinds[k].0)).collect();
        groups.push(Group { outputs, pairing, plain, own });
    }
    Ok(groups)
}
