//! Classical central differences on a lattice of the torus, found by place instead of by search.

use crate::operators::Terms;

/// Shifts along the axes and the weights of each output there, in units of h^-m.
pub struct Differences<const D: usize, const K: usize> {
    entries: Vec<([isize; D], [f64; K])>,
    side: usize,
}

impl<const D: usize, const K: usize> Differences<D, K> {
    /// The differences of even order r of each term: products of the central differences of its axes.
    pub fn new(operator: &Terms<D, K>, order: usize, side: usize) -> Self {
        let mut entries: Vec<([isize; D], [f64; K])> = Vec::new();
        for &(output, index, factor) in operator.list() {
            let scale = factor * (side as f64).powi(index.degree() as i32);
            let axes: [Vec<(isize, f64)>; D] = index.exponents().map(|m| central(m as usize, order));
            let count: usize = axes.iter().map(Vec::len).product();
            for mut place in 0..count {
                let (mut shift, mut weight) = ([0; D], scale);
                for (axis, choices) in axes.iter().enumerate() {
                    let (offset, w) = choices[place % choices.len()];
                    place /= choices.len();
                    shift[axis] = offset;
                    weight *= w;
                }
                match entries.iter_mut().find(|entry| entry.0 == shift) {
                    Some(entry) => entry.1[output] += weight,
                    None => {
                        let mut weights = [0.0; K];
                        weights[output] = weight;
                        entries.push((shift, weights));
                    }
                }
            }
        }
        entries.retain(|(_, weights)| weights.iter().any(|w| *w != 0.0));
        Self { entries, side }
    }

    /// Nodes of a stencil.
    pub fn nodes(&self) -> usize {
        self.entries.len()
    }

    /// Sums over all nodes; particles are numbered as by `Particles::lattice`, the last axis fastest.
    pub fn apply(&self, f: &[f64], out: &mut [[f64; K]]) {
        // Where each node of each axis comes to lie, for every shift in use.
        let reach = self.entries.iter().flat_map(|entry| entry.0).map(isize::unsigned_abs).max().unwrap_or(0);
        let side = self.side;
        let wrapped: Vec<usize> = (0..side + 2 * reach).map(|i| (i + reach * (side - 1)) % side).collect();
        for (p, out) in out.iter_mut().enumerate() {
            let (mut node, mut rest) = ([0; D], p);
            for axis in (0..D).rev() {
                (node[axis], rest) = (rest % side, rest / side);
            }
            *out = [0.0; K];
            for (shift, weights) in &self.entries {
                let q = (0..D).fold(0, |q, a| q * side + wrapped[(node[a] + reach).wrapping_add_signed(shift[a])]);
                out.iter_mut().zip(weights).for_each(|(out, w)| *out += w * f[q]);
            }
        }
    }
}

/// Offsets and weights of the central difference of order r for d^m/dx^m at spacing 1, by Fornberg's recurrence.
///
/// Source: B. Fornberg, Math. Comp. 51 (1988), eq. 2.1 to 2.4.
fn central(m: usize, order: usize) -> Vec<(isize, f64)> {
    let reach = if m == 0 { 0 } else { (m.div_ceil(2) + order / 2 - 1) as isize };
    // Inside out, so that every intermediate set is as central as can be.
    let mut nodes: Vec<isize> = (-reach..=reach).collect();
    nodes.sort_by_key(|node| node.abs());
    let count = nodes.len();
    // weights[j][k]: weight of node j in the k-th derivative over the nodes so far.
    let mut weights = vec![vec![0.0; m + 1]; count];
    weights[0][0] = 1.0;
    let mut product = 1.0;
    for i in 1..count {
        let last = weights[i - 1].clone();
        let x = nodes[i] as f64;
        let mut differences = 1.0;
        for j in 0..i {
            let gap = (nodes[i] - nodes[j]) as f64;
            differences *= gap;
            for k in (0..=m).rev() {
                let lower = if k > 0 { k as f64 * weights[j][k - 1] } else { 0.0 };
                weights[j][k] = (x * weights[j][k] - lower) / gap;
            }
        }
        let before = nodes[i - 1] as f64;
        for k in 0..=m {
            let lower = if k > 0 { k as f64 * last[k - 1] } else { 0.0 };
            weights[i][k] = product / differences * (lower - before * last[k]);
        }
        product = differences;
    }
    nodes.into_iter().zip(weights).map(|(node, weights)| (node, weights[m])).collect()
}
