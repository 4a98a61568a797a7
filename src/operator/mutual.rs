//! What the two particles of a pair exchange under PSE with one epsilon: one kernel value for both.

use super::pairwise::{Pairing, times};
use super::pse::Pse;
use crate::error::{OperatorError, Result};
use crate::kernel::Kernel;
use crate::scale::Volumes;

/// A [`Pse`] seen from a pair: with e = eps^-m eta(z) and v = V eps^-D, p receives v_q e (f_q + sigma f_p) and q
/// -/+ v_p e (f_q + sigma f_p).
#[derive(Clone, Debug)]
pub(crate) struct Mutual<'a, K, const N: usize> {
    kernels: &'a [K; N],
    pub(crate) volumes: &'a Volumes,
    /// 1/epsilon.
    pub(crate) inverse: f64,
    /// epsilon^-m.
    scale: f64,
    pub(crate) sigma: f64,
    /// -1 where what p receives is lost by q, +1 where q receives it too.
    pub(crate) partner: f64,
    /// Whether the terms are e (v_p F_q + sigma v_q F_p) for p and -/+ the same for q.
    pub(crate) strengths: bool,
    /// The support radius times epsilon.
    pub(crate) cutoff: f64,
}

impl<K, const N: usize> Pse<K, N> {
    /// # Errors
    /// [`OperatorError::VariableEpsilon`] where the two sides of a pair have kernels of their own.
    pub(crate) fn mutual(&self) -> Result<Mutual<'_, K, N>> {
        let pairwise = &self.0;
        let (low, high) = pairwise.epsilon.range();
        if low != high {
            return Err(OperatorError::VariableEpsilon { low, high }.into());
        }
        let inverse = 1.0 / low;
        let odd = pairwise.degree % 2 == 1;
        let sigma = if pairwise.pairing == Pairing::Sum { 1.0 } else { -1.0 };
        Ok(Mutual {
            kernels: &pairwise.kernels,
            volumes: &pairwise.volumes,
            inverse,
            scale: times(1.0, inverse, pairwise.degree as usize),
            sigma,
            // e(-z) (f_p + sigma f_q) = parity sigma e(z) (f_q + sigma f_p).
            partner: if odd { -sigma } else { sigma },
            strengths: pairwise.strengths,
            cutoff: low * pairwise.support,
        })
    }
}

impl<K, const N: usize> Mutual<'_, K, N> {
    /// V eps^-D.
    pub(crate) fn scaled<const D: usize>(&self, volume: f64) -> f64 {
        times(volume, self.inverse, D)
    }

    /// Whether eta(-z) is -eta(z).
    pub(crate) fn is_odd(&self) -> bool {
        self.partner == -self.sigma
    }

    /// e of every output at every point, output after output.
    pub(crate) fn evaluate<const D: usize>(&self, z: &[[f64; D]], e: &mut Vec<f64>)
    where
        K: Kernel<f64, D>,
    {
        e.resize(z.len() * N, 0.0);
        for (n, kernel) in self.kernels.iter().enumerate() {
            let e = &mut e[n * z.len()..][..z.len()];
            kernel.values(z, e);
            e.iter_mut().for_each(|e| *e *= self.scale);
        }
    }
}
