//! Single stencils as targets of a provider, and the moments of the rows built on them, summed without the library.

use nalgebra::DMatrix;
use parops::{MultiIndex, Neighbor, Neighbors, Operator, Row, Term, Window, graded, required_moment};

/// Stencils of their own, each around a target at the origin; no source is shared.
pub struct Stencils<const D: usize> {
    /// Places of the neighbors relative to their target.
    pub offsets: Vec<Vec<[f64; D]>>,
    /// The cutoff of all of them.
    pub cutoff: f64,
}

impl<const D: usize> Stencils<D> {
    /// Targets first, then the neighbors of each.
    fn first(&self, p: usize) -> usize {
        self.offsets.len() + self.offsets[..p].iter().map(Vec::len).sum::<usize>()
    }
}

impl<const D: usize> Neighbors<D> for Stencils<D> {
    fn targets(&self) -> usize {
        self.offsets.len()
    }

    fn sources(&self) -> usize {
        self.first(self.offsets.len())
    }

    fn center(&self, p: usize) -> Option<usize> {
        Some(p)
    }

    fn cutoff(&self, _: usize) -> f64 {
        self.cutoff
    }

    fn reach(&self) -> f64 {
        self.cutoff
    }

    fn generation(&self) -> u64 {
        0
    }

    fn for_each(&self, p: usize, cutoff: f64, mut visit: impl FnMut(Neighbor<D>)) {
        let first = self.first(p);
        for (i, offset) in self.offsets[p].iter().enumerate() {
            // As the row of a real set: the target minus the neighbor.
            let separation = offset.map(|x| -x);
            if separation.iter().map(|x| x * x).sum::<f64>() <= cutoff * cutoff {
                visit(Neighbor { q: first + i, separation, sign: 1 });
            }
        }
    }
}

/// The moments of one output of a row in scaled units, and what they are measured by.
pub struct Moments {
    /// By how much each condition is missed, in graded order.
    pub misses: Vec<f64>,
    /// max_alpha sum_q |w_q z_q^alpha|.
    pub terms: f64,
    /// sum_q |w_q|.
    pub sum_abs: f64,
    /// A lower bound on the condition number of the windowed monomials B: with y = B (B^T B)^-1 b the smallest singular
    /// value is at most |b| / |y|, and the largest at least the norm of a column.
    pub condition: f64,
}

impl Moments {
    pub fn residual(&self) -> f64 {
        self.misses.iter().fold(0.0, |largest: f64, &miss| if miss <= largest { largest } else { miss })
    }
}

/// The terms of each output of an operator.
pub fn terms<const D: usize, const K: usize>(operator: &impl Operator<D, Out = [f64; K]>) -> [Vec<Term<D>>; K] {
    let mut outputs = [const { Vec::new() }; K];
    operator.terms(&mut |k, index, factor| outputs[k].push(Term { index, factor }));
    outputs
}

/// z^alpha for every point, condition after condition.
pub fn monomials<const D: usize>(z: &[[f64; D]], low: u32, high: u32) -> (Vec<MultiIndex<D>>, Vec<Vec<f64>>) {
    let alphas: Vec<MultiIndex<D>> = graded(low, high).collect();
    let columns = alphas.iter().map(|alpha| z.iter().map(|z| alpha.power(z)).collect()).collect();
    (alphas, columns)
}

/// The moments low <= |alpha| <= high of output k, given the monomials of its scaled separations. `odd` names the form
/// f_q + f_p, whose own weight stands in the diagonal only.
pub fn moments<const D: usize, const K: usize>(
    row: &Row<'_, [f64; K]>,
    k: usize,
    terms: &[Term<D>],
    (alphas, columns): (&[MultiIndex<D>], &[Vec<f64>]),
    z: &[[f64; D]],
    epsilon: f64,
) -> Moments {
    let degree = terms[0].index.degree();
    let back = (0..degree).fold(1.0, |product, _| product * epsilon);
    let odd = degree % 2 == 1;
    let w: Vec<f64> = row.weights.iter().map(|w| w[k] * back).collect();
    let roots: Vec<f64> =
        z.iter().map(|z| Window::Exponential.root(z.iter().map(|x| x * x).sum::<f64>(), f64::NAN)).collect();
    // The self weight is what the diagonal 2 (sum_q w_q + w_self) leaves.
    let own = if odd { 0.5 * row.diagonal[k] * back - w.iter().sum::<f64>() } else { 0.0 };
    let length = w.iter().zip(&roots).fold(own * own, |sum, (w, root)| sum + (w / root).powi(2)).sqrt();
    let mut found = Moments { misses: vec![], terms: 0.0, sum_abs: 0.0, condition: 1.0 };
    let (mut required_length, mut longest) = (0.0, 0.0_f64);
    for (&alpha, column) in alphas.iter().zip(columns) {
        let required = required_moment(terms, alpha).unwrap();
        let (mut sum, mut size) = (0.0, 0.0);
        for (w, z) in w.iter().zip(column) {
            sum += w * z;
            size += (w * z).abs();
        }
        let norm = column.iter().zip(&roots).fold(0.0, |sum, (z, root)| sum + (z * root).powi(2)).sqrt();
        longest = longest.max(norm);
        required_length += required * required;
        if odd && alpha == MultiIndex::ZERO {
            (sum, size) = (0.5 * row.diagonal[k] * back, size + own.abs());
        }
        let mut miss = (sum - required).abs();
        // The rounding of this sum and of its powers is what rows of large weights are left with: it is not theirs.
        if miss > ROUNDED && !(odd && alpha == MultiIndex::ZERO) {
            miss = (exact_sum(&w, z, alpha, -required)).abs();
        }
        found.misses.push(miss);
        found.terms = found.terms.max(size);
    }
    found.sum_abs = w.iter().map(|w| w.abs()).sum::<f64>() + own.abs();
    found.condition = (length * longest / required_length.sqrt()).max(1.0);
    found
}

/// Misses above this are summed again in twice the precision.
const ROUNDED: f64 = 1e-13;

/// start + sum_q w_q z_q^alpha with products and sums of two doubles, in about 30 digits.
fn exact_sum<const D: usize>(w: &[f64], z: &[[f64; D]], alpha: MultiIndex<D>, start: f64) -> f64 {
    let (mut high, mut low) = (start, 0.0);
    for (&w, z) in w.iter().zip(z) {
        let (mut product, mut rest) = (w, 0.0);
        for (&x, exponent) in z.iter().zip(alpha.exponents()) {
            for _ in 0..exponent {
                let rounded = product * x;
                rest = product.mul_add(x, -rounded) + rest * x;
                product = rounded;
            }
        }
        let sum = high + product;
        let other = sum - high;
        low += (high - (sum - other)) + (product - other) + rest;
        high = sum;
    }
    high + low
}

/// Points of a lattice of spacing 1 around the origin that may be among the `count` nearest once each is moved by up to
/// `jitter`, the first `cut` coordinates not negative.
pub fn candidates<const D: usize>(count: usize, jitter: f64, cut: usize) -> Vec<[f64; D]> {
    let mut reach = 2_i32;
    loop {
        let side = 2 * reach + 1;
        let mut points: Vec<[f64; D]> = (0..side.pow(D as u32))
            .map(|number| std::array::from_fn(|axis| f64::from(number / side.pow(axis as u32) % side - reach)))
            .filter(|x: &[f64; D]| x[..cut.min(D)].iter().all(|&x| x >= 0.0) && x.iter().any(|&x| x != 0.0))
            .collect();
        points.sort_by(|a, b| length(a).total_cmp(&length(b)));
        // Each moves by no more than this, those beyond the last as much inwards as that outwards.
        let widest = points.get(count - 1).map_or(f64::INFINITY, length) + 2.0 * jitter * (D as f64).sqrt();
        if widest <= f64::from(reach) {
            points.truncate(points.partition_point(|x| length(x) <= widest));
            return points;
        }
        reach += 1;
    }
}

pub fn length<const D: usize>(x: &[f64; D]) -> f64 {
    x.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// cond(B) of the windowed, scaled monomials by singular values.
pub fn condition<const D: usize>(z: &[[f64; D]], odd: bool, low: u32, high: u32) -> f64 {
    let mut z = z.to_vec();
    if odd {
        z.push([0.0; D]);
    }
    let (alphas, columns) = monomials(&z, low, high);
    let root = |z: &[f64; D]| Window::Exponential.root(length(z).powi(2), f64::NAN);
    let b = DMatrix::from_fn(z.len(), alphas.len(), |i, j| columns[j][i] * root(&z[i]));
    let values = b.singular_values();
    values.max() / values.min()
}
