//! Moment systems of several stencils at once: Cholesky across lanes, one stencil a lane.

use super::monomials::{AddPowers, Monomials, polynomial};
use super::nodes::{GROUP, Group, Nodes};
use super::solver::{Rung, Solution, worst};
use super::system::{MomentSystem, Residual, larger};
use super::triangle::{Layout, Pair};
use super::window::Windows;
use crate::lanes::{Lanes, Vectors, Work, widest};
use crate::multi_index::MultiIndex;

/// A [`MomentSystem`] laid out for several stencils side by side: [`Cholesky`](super::Cholesky) with its corrected step,
/// L stencils at a time.
///
/// A_ij = sum_q phi_q z_q^(alpha_i + alpha_j) is one moment M_gamma of the window, so the moments with
/// |gamma| <= 2 (m + r - 1) are summed once, 286 instead of 1540 for l = 55. No operation mixes lanes: the bits of a
/// stencil depend neither on L nor on what the other lanes hold. Made once for an operator.
#[derive(Clone, Debug)]
pub(crate) struct BatchSystem<const D: usize> {
    /// l.
    conditions: usize,
    outputs: usize,
    monomials: Monomials<D>,
    /// m + r - 1.
    high: usize,
    /// Number of monomials below the first condition.
    offset: usize,
    /// Where A_ij stands among the moments, in the order of the triangle.
    entries: Vec<[u32; 2]>,
    /// The conditions whose sum the power iteration starts from, and the entries of A between all and them.
    leaders: Vec<usize>,
    leading: Vec<u32>,
    /// The pure powers of lowest and highest degree: by convexity sum_q |w_q z_q^alpha| is largest at one of them.
    extremes: Vec<usize>,
    required: Vec<f64>,
    largest: f64,
}

/// Working memory of [`BatchSystem::solve`], reused from batch to batch.
#[derive(Clone, Debug, Default)]
pub(crate) struct BatchScratch<const L: usize> {
    nodes: Nodes<L>,
    powers: Vec<Group<L>>,
    moments: Vec<Lanes<L>>,
    matrix: Vec<Pair<L>>,
    /// 1/L_jj.
    inverse: Vec<Lanes<L>>,
    /// Powers of two next above the norms of the columns of B, and their inverses: what scaling the columns comes to.
    norms: Vec<Lanes<L>>,
    scales: Vec<Lanes<L>>,
    x: Vec<Lanes<L>>,
    sums: Vec<Lanes<L>>,
    absolute: Vec<Lanes<L>>,
    /// w, output after output.
    weights: Vec<Group<L>>,
}

/// The most conditions of a system that is solved side by side: A then takes 4 MB a lane.
const MOST_CONDITIONS: usize = 1000;

impl<const D: usize> BatchSystem<D> {
    pub(crate) fn new(system: &MomentSystem<f64, D>) -> Self {
        // Sums of two multi-indices must fit eight bits, and the table of A some memory; beyond that nothing is solved
        // here.
        let fits = |alpha: &MultiIndex<D>| 2 * alpha.degree() <= u32::from(u8::MAX);
        let small = system.conditions() <= MOST_CONDITIONS && system.basis().iter().all(fits);
        let basis = if small { system.basis() } else { &[] };
        let (conditions, outputs) = (basis.len(), system.outputs());
        let degree = |alpha: Option<&MultiIndex<D>>| alpha.map_or(0, MultiIndex::degree);
        let (low, high) = (degree(basis.first()), degree(basis.last()));
        let monomials = Monomials::<D>::up_to(2 * high);
        let entry = |(i, j): (usize, usize)| match (basis.get(i), basis.get(j)) {
            (Some(a), Some(b)) => {
                let mut sum = a.exponents();
                sum.iter_mut().zip(b.exponents()).for_each(|(sum, exponent)| *sum += exponent);
                monomials.position(&MultiIndex::new(sum)) as u32
            }
            _ => 0,
        };
        let entries = Layout { size: conditions, extra: 0 }.entries().map(|pair| pair.map(entry)).collect();
        // Squares couple positively to each other in every stencil, so their sum is far from orthogonal to the largest
        // singular vector; where there are none, any start must do.
        let squares =
            |alpha: &MultiIndex<D>| alpha.degree() > 0 && alpha.exponents().iter().all(|e| e.is_multiple_of(2));
        let lowest_square = basis.iter().find(|alpha| squares(alpha)).map(MultiIndex::degree);
        let leads = |alpha: &MultiIndex<D>| match lowest_square {
            Some(degree) => squares(alpha) && alpha.degree() == degree,
            None => alpha.degree() == low,
        };
        let leaders: Vec<usize> = (0..conditions).filter(|&j| leads(&basis[j])).collect();
        let leading = (0..conditions).flat_map(|i| leaders.iter().map(move |&j| (i, j))).map(entry).collect();
        let mut extremes = Vec::new();
        for degree in [low, high] {
            for axis in 0..D {
                let mut exponents = [0; D];
                exponents[axis] = degree as u8;
                extremes.push(monomials.position(&MultiIndex::new(exponents)));
            }
        }
        extremes.dedup();
        Self {
            conditions,
            outputs,
            high: high as usize,
            offset: basis.first().map_or(0, |alpha| monomials.position(alpha)),
            entries,
            leaders,
            leading,
            extremes,
            required: (0..outputs).flat_map(|k| system.required(k)).copied().collect(),
            largest: system.largest_required(),
            monomials,
        }
    }

    /// Solves L stencils side by side.
    ///
    /// `z[i]` are the scaled separations of lane i, whose number may differ from lane to lane; a lane without any is
    /// absent. The weights of output k are written to `w[i][k n..(k + 1) n]`.
    /// `None`, and weights that mean nothing, where a pivot is rounding: such a stencil needs QR. So may one whose
    /// solution is not [sharp](Solution::is_sharp).
    pub(crate) fn solve<const L: usize>(
        &self,
        z: [&[[f64; D]]; L],
        windows: Windows<D, L>,
        scratch: &mut BatchScratch<L>,
        w: [&mut [f64]; L],
    ) -> [Option<Solution<f64>>; L] {
        widest(Batch { system: self, z, windows, scratch, w })
    }

    #[inline(always)]
    fn solve_with<V: Vectors, const L: usize>(
        &self,
        vectors: V,
        z: [&[[f64; D]]; L],
        windows: Windows<D, L>,
        scratch: &mut BatchScratch<L>,
        w: [&mut [f64]; L],
    ) -> [Option<Solution<f64>>; L] {
        if self.conditions == 0 {
            return [None; L];
        }
        let counts = z.map(<[_]>::len);
        scratch.nodes.load(z, windows);
        self.accumulate(vectors, scratch);
        let layout = Layout { size: self.conditions, extra: self.outputs + 1 };
        self.fill(layout, scratch);
        let largest = self.largest_eigenvalue(layout, scratch);
        let BatchScratch { matrix, inverse, norms, .. } = &mut *scratch;
        inverse.clear();
        inverse.resize(layout.columns(), Lanes::ZERO);
        // As in Cholesky of one stencil, where scaled diagonal entries lie between 1/4 and 1.
        let tolerance = Lanes::all(4.0 * self.conditions as f64 * f64::EPSILON);
        let sound = layout.factorize(matrix, |j| tolerance * norms[j] * norms[j], inverse);
        if sound == Lanes::ZERO {
            return [None; L];
        }
        let condition = (largest * self.smallest_inverse(layout, scratch)).sqrt();
        let residual = Residual { absolute: 0.0, terms: 0.0 };
        let start = |condition| Solution { rung: Rung::Cholesky, rank: self.conditions, condition, residual };
        let mut solutions = condition.0.map(start);
        scratch.weights.clear();
        scratch.weights.resize(scratch.nodes.groups() * self.outputs, [Lanes::ZERO; GROUP]);
        for k in 0..self.outputs {
            take_row(layout, k, scratch);
            layout.backward(&scratch.matrix, &scratch.inverse, &mut scratch.x);
            let mut measured = self.weigh(vectors, k, None, scratch);
            let mut poor = Lanes::ZERO;
            for (i, solution) in solutions.iter_mut().enumerate() {
                let row = Solution { residual: measured[i], ..*solution };
                if sound.0[i] != 0.0 && !row.is_sharp(self.conditions, self.largest) {
                    poor.0[i] = 1.0;
                    solution.rung = Rung::Corrected;
                }
            }
            if poor != Lanes::ZERO {
                let BatchScratch { matrix, inverse, x, sums, .. } = &mut *scratch;
                for ((x, &b), &sum) in x.iter_mut().zip(self.required_of(k)).zip(&sums[self.offset..]) {
                    *x = Lanes::all(b) - sum;
                }
                layout.forward(matrix, inverse, x);
                layout.backward(matrix, inverse, x);
                measured = self.weigh(vectors, k, Some(poor), scratch);
            }
            for (solution, &measured) in solutions.iter_mut().zip(&measured) {
                solution.residual = worst(solution.residual, measured);
            }
        }
        let groups = scratch.nodes.groups();
        for (i, (w, n)) in w.into_iter().zip(counts).enumerate().filter(|(_, (_, n))| *n > 0) {
            for (w, weights) in w.chunks_exact_mut(n).zip(scratch.weights.chunks_exact(groups)) {
                let (full, rest) = w.as_chunks_mut::<GROUP>();
                for (w, group) in full.iter_mut().zip(weights) {
                    *w = group.map(|weight| weight.0[i]);
                }
                for (w, weight) in rest.iter_mut().zip(weights[full.len()..].iter().flatten()) {
                    *w = weight.0[i];
                }
            }
        }
        std::array::from_fn(|i| (sound.0[i] != 0.0).then_some(solutions[i]))
    }

    #[inline(always)]
    fn required_of(&self, k: usize) -> &[f64] {
        &self.required[k * self.conditions..][..self.conditions]
    }

    /// M_gamma = sum_q phi_q z_q^gamma.
    #[inline(always)]
    fn accumulate<V: Vectors, const L: usize>(&self, vectors: V, scratch: &mut BatchScratch<L>) {
        let BatchScratch { nodes, powers, moments, .. } = scratch;
        moments.clear();
        moments.resize(self.monomials.len(), Lanes::ZERO);
        powers.resize(self.monomials.len(), [Lanes::ZERO; GROUP]);
        for (places, &window) in nodes.iter::<D>() {
            powers[0] = window;
            vectors.run(AddPowers { runs: self.monomials.runs(2 * self.high), places, powers, sums: moments });
        }
    }

    /// Writes A, and below it the right-hand sides, the last of which starts the inverse iterations.
    #[inline(always)]
    fn fill<const L: usize>(&self, layout: Layout, scratch: &mut BatchScratch<L>) {
        let BatchScratch { moments, matrix, norms, scales, .. } = scratch;
        matrix.clear();
        matrix.resize(layout.len(), [Lanes::ZERO; 2]);
        for (pair, &[even, odd]) in matrix.iter_mut().zip(&self.entries) {
            pair[0] = moments[even as usize];
            pair[1] = moments[odd as usize];
        }
        norms.clear();
        scales.clear();
        for j in 0..self.conditions {
            let square = matrix[layout.diagonal(j)][j % 2];
            norms.push(square.map(power_above_root));
            scales.push(square.map(|square| inverse_power(power_above_root(square))));
        }
        norms.resize(layout.columns(), Lanes::ZERO);
        scales.resize(layout.columns(), Lanes::ZERO);
        for k in 0..self.outputs {
            let (start, odd) = layout.row(k);
            for (pair, &b) in matrix[start..].iter_mut().zip(self.required_of(k)) {
                pair[odd] = Lanes::all(b);
            }
        }
        let (start, odd) = layout.row(self.outputs);
        for (i, (pair, &norm)) in matrix[start..].iter_mut().zip(&norms[..self.conditions]).enumerate() {
            // A start that is orthogonal to no coordinate direction.
            let sign = if i % 2 == 0 { 1.0 } else { -1.0 };
            pair[odd] = Lanes::all(sign * (1.0 + 0.25 * (i % 3) as f64)) * norm;
        }
    }

    /// The largest eigenvalue of A in the scaling of B, from below: one power iteration from the leaders and the Rayleigh
    /// quotient of what it gives.
    #[inline(always)]
    fn largest_eigenvalue<const L: usize>(&self, layout: Layout, scratch: &mut BatchScratch<L>) -> Lanes<L> {
        let BatchScratch { moments, matrix, scales, x, .. } = scratch;
        x.clear();
        let mut squares = Lanes::ZERO;
        for (row, &scale) in self.leading.chunks_exact(self.leaders.len()).zip(scales.iter()) {
            let mut sum = Lanes::ZERO;
            for (&entry, &leader) in row.iter().zip(&self.leaders) {
                sum += moments[entry as usize] * scales[leader];
            }
            let scaled = sum * scale;
            squares += scaled * scaled;
            x.push(scaled * scale);
        }
        x.resize(layout.columns(), Lanes::ZERO);
        layout.quadratic_form(matrix, x).zip(squares, |form, squares| form / squares)
    }

    /// The largest eigenvalue of A^-1 in the scaling of B, from below: two inverse iterations.
    #[inline(always)]
    fn smallest_inverse<const L: usize>(&self, layout: Layout, scratch: &mut BatchScratch<L>) -> Lanes<L> {
        take_row(layout, self.outputs, scratch);
        let BatchScratch { matrix, inverse, norms, x, .. } = scratch;
        layout.backward(matrix, inverse, x);
        let (mut before, mut after) = (Lanes::ZERO, Lanes::ZERO);
        for (x, &norm) in x.iter_mut().zip(norms.iter()) {
            let scaled = *x * norm;
            before += scaled * scaled;
            *x = scaled * norm;
        }
        layout.forward(matrix, inverse, x);
        layout.backward(matrix, inverse, x);
        for (&x, &norm) in x.iter().zip(norms.iter()) {
            let scaled = x * norm;
            after += scaled * scaled;
        }
        after.zip(before, |after, before| (after / before).sqrt())
    }

    /// w = phi sum_j x_j z^alpha_j, or that added to w in the lanes `poor`, and by how much output k then misses.
    #[inline(always)]
    fn weigh<V: Vectors, const L: usize>(
        &self,
        vectors: V,
        k: usize,
        poor: Option<Lanes<L>>,
        scratch: &mut BatchScratch<L>,
    ) -> [Residual<f64>; L] {
        let BatchScratch { nodes, powers, moments: a, x, sums, absolute, weights, .. } = scratch;
        let runs = self.monomials.runs(self.high);
        a.clear();
        a.resize(self.offset, Lanes::ZERO);
        a.extend_from_slice(&x[..self.conditions]);
        sums.clear();
        sums.resize(a.len(), Lanes::ZERO);
        absolute.clear();
        absolute.resize(self.extremes.len(), Lanes::ZERO);
        let weights = &mut weights[k * nodes.groups()..];
        for ((places, window), weights) in nodes.iter::<D>().zip(weights) {
            let mut own = polynomial(runs, places, a, powers);
            for q in 0..GROUP {
                let value = own[q] * window[q];
                own[q] = match poor {
                    Some(poor) => (weights[q] + value).where_set(poor, weights[q]),
                    None => value,
                };
            }
            *weights = own;
            powers[0] = own;
            vectors.run(AddPowers { runs, places, powers, sums });
            for (sum, &at) in absolute.iter_mut().zip(&self.extremes) {
                *sum = powers[at].iter().fold(*sum, |sum, &term| sum + term.abs());
            }
        }
        let mut miss = Lanes::ZERO;
        for (&sum, &b) in sums[self.offset..].iter().zip(self.required_of(k)) {
            miss = miss.zip((sum - Lanes::all(b)).abs(), larger);
        }
        let terms = absolute.iter().fold(Lanes::ZERO, |terms, &sum| terms.zip(sum, f64::max));
        std::array::from_fn(|i| Residual { absolute: miss.0[i], terms: terms.0[i] })
    }
}

/// [`BatchSystem::solve`] as work for any vectors.
struct Batch<'a, const D: usize, const L: usize> {
    system: &'a BatchSystem<D>,
    z: [&'a [[f64; D]]; L],
    windows: Windows<D, L>,
    scratch: &'a mut BatchScratch<L>,
    w: [&'a mut [f64]; L],
}

impl<const D: usize, const L: usize> Work for Batch<'_, D, L> {
    type Out = [Option<Solution<f64>>; L];

    #[inline(always)]
    fn run<V: Vectors>(self, vectors: V) -> Self::Out {
        let Self { system, z, windows, scratch, w } = self;
        system.solve_with(vectors, z, windows, scratch, w)
    }
}

/// x <- row k below the triangle.
#[inline(always)]
fn take_row<const L: usize>(layout: Layout, k: usize, scratch: &mut BatchScratch<L>) {
    let (start, odd) = layout.row(k);
    scratch.x.clear();
    scratch.x.extend(scratch.matrix[start..][..layout.columns()].iter().map(|pair| pair[odd]));
}

/// The power of two in (sqrt(x), 2 sqrt(x)], from the exponent of x alone: for x = f 2^e, 1 <= f < 2, it is
/// 2^(floor(e/2) + 1).
#[inline(always)]
fn power_above_root(x: f64) -> f64 {
    let halved = ((x.to_bits() >> 52) + 1) >> 1;
    f64::from_bits((halved + BIAS.div_ceil(2)) << 52)
}

/// 1/p of a power of two, from its exponent.
#[inline(always)]
fn inverse_power(p: f64) -> f64 {
    f64::from_bits(((2 * BIAS) << 52).wrapping_sub(p.to_bits()))
}

/// Of the exponents of `f64`.
const BIAS: u64 = 1023;

#[cfg(test)]
mod tests;
