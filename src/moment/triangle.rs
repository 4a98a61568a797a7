//! Cholesky of L matrices side by side.

use crate::lanes::Lanes;

/// Two rows at one column.
pub(super) type Pair<const L: usize> = [Lanes<L>; 2];

/// How the lower triangle of an l x l matrix, and the right-hand sides below it as further rows, lie in memory: in pairs
/// of rows, column after column, the even row's entry before the odd one's.
///
/// Two by two entries are then worked on with all of memory read in order. Where l is odd the triangle ends with a column
/// of zeros, which has no pivot.
#[derive(Clone, Copy, Debug)]
pub(super) struct Layout {
    /// l.
    pub(super) size: usize,
    /// Right-hand sides.
    pub(super) extra: usize,
}

impl Layout {
    /// Pairs of rows of the triangle.
    #[inline(always)]
    fn pairs(self) -> usize {
        self.size.div_ceil(2)
    }

    /// Columns, the one of zeros included.
    #[inline(always)]
    pub(super) fn columns(self) -> usize {
        2 * self.pairs()
    }

    /// Where the pair of rows 2 `pair`, 2 `pair` + 1 begins.
    #[inline(always)]
    pub(super) fn start(self, pair: usize) -> usize {
        let inside = pair.min(self.pairs());
        inside * (inside + 1) + (pair - inside) * self.columns()
    }

    /// Length of the whole.
    pub(super) fn len(self) -> usize {
        self.start((self.size + self.extra).div_ceil(2))
    }

    /// Where A_jj stands.
    #[inline(always)]
    pub(super) fn diagonal(self, j: usize) -> usize {
        self.start(j / 2) + j
    }

    /// Where right-hand side k begins, and whether it is the odd row of its pair.
    #[inline(always)]
    pub(super) fn row(self, k: usize) -> (usize, usize) {
        let row = self.size + k;
        (self.start(row / 2), row % 2)
    }

    /// Row and column of each entry of the triangle, in the order of memory; a row or column l may be among them.
    pub(super) fn entries(self) -> impl Iterator<Item = [(usize, usize); 2]> {
        (0..self.pairs()).flat_map(|pair| (0..2 * pair + 2).map(move |j| [(2 * pair, j), (2 * pair + 1, j)]))
    }

    /// x^T A x.
    #[inline(always)]
    pub(super) fn quadratic_form<const L: usize>(self, matrix: &[Pair<L>], x: &[Lanes<L>]) -> Lanes<L> {
        let mut form = Lanes::ZERO;
        for pair in 0..self.pairs() {
            let (left, block) = matrix[self.start(pair)..self.start(pair + 1)].split_at(2 * pair);
            let (mut p, mut q) = (Lanes::ZERO, Lanes::ZERO);
            for (&[u, v], &x) in left.iter().zip(x) {
                p += u * x;
                q += v * x;
            }
            let (x, y) = (x[2 * pair], x[2 * pair + 1]);
            q += block[0][1] * x;
            form += x * (p + p + block[0][0] * x) + y * (q + q + block[1][1] * y);
        }
        form
    }

    /// A = L L^T in place, and L^-1 b for the rows b below; `inverse` becomes 1/L_jj.
    ///
    /// A pivot must be above `floor`, otherwise its lane is cleared in the result and goes on with 0 for 1/0.
    #[inline(always)]
    pub(super) fn factorize<const L: usize>(
        self,
        matrix: &mut [Pair<L>],
        floor: impl Fn(usize) -> Lanes<L>,
        inverse: &mut [Lanes<L>],
    ) -> Lanes<L> {
        let mut sound = Lanes::ONE;
        let mut root = |pivot: Lanes<L>, j: usize| {
            if j >= self.size {
                return Lanes::ZERO;
            }
            let good = pivot.zip(floor(j), |pivot, floor| if pivot > floor { 1.0 } else { 0.0 });
            sound = sound * good;
            pivot.map(|pivot| 1.0 / pivot.sqrt()).where_set(good, Lanes::ZERO)
        };
        for c in 0..self.pairs() {
            let (head, mut below) = matrix.split_at_mut(self.start(c + 1));
            let (done, block) = head[self.start(c)..].split_at_mut(2 * c);
            let ([mut p, mut q], [_, mut r]) = (block[0], block[1]);
            for &[x, y] in done.iter() {
                p -= x * x;
                q -= y * x;
                r -= y * y;
            }
            let first = root(p, 2 * c);
            let across = q * first;
            let second = root(r - across * across, 2 * c + 1);
            block[0][1] = across;
            (inverse[2 * c], inverse[2 * c + 1]) = (first, second);
            let mut pair = c + 1;
            while !below.is_empty() {
                let (panel, rest) = below.split_at_mut(self.start(pair + 1) - self.start(pair));
                let (left, block) = panel.split_at_mut(2 * c);
                let ([mut p0, mut p1], [mut q0, mut q1]) = (block[0], block[1]);
                for (&[x, y], &[u, v]) in done.iter().zip(left.iter()) {
                    p0 -= u * x;
                    p1 -= v * x;
                    q0 -= u * y;
                    q1 -= v * y;
                }
                (p0, p1) = (p0 * first, p1 * first);
                block[0] = [p0, p1];
                block[1] = [(q0 - p0 * across) * second, (q1 - p1 * across) * second];
                below = rest;
                pair += 1;
            }
        }
        sound
    }

    /// x <- L^-1 x.
    #[inline(always)]
    pub(super) fn forward<const L: usize>(self, matrix: &[Pair<L>], inverse: &[Lanes<L>], x: &mut [Lanes<L>]) {
        for pair in 0..self.pairs() {
            let (left, block) = matrix[self.start(pair)..self.start(pair + 1)].split_at(2 * pair);
            let (known, rest) = x.split_at_mut(2 * pair);
            let (mut p, mut q) = (rest[0], rest[1]);
            for (&[u, v], &x) in left.iter().zip(known.iter()) {
                p -= u * x;
                q -= v * x;
            }
            rest[0] = p * inverse[2 * pair];
            rest[1] = (q - block[0][1] * rest[0]) * inverse[2 * pair + 1];
        }
    }

    /// x <- L^-T x.
    #[inline(always)]
    pub(super) fn backward<const L: usize>(self, matrix: &[Pair<L>], inverse: &[Lanes<L>], x: &mut [Lanes<L>]) {
        // By columns, as sums: the rows could be subtracted one by one, but the compiler takes such a loop for one to
        // vectorize along memory, across the lanes.
        for pair in (0..self.pairs()).rev() {
            let (own, known) = x[2 * pair..].split_at_mut(2);
            let (mut p, mut q) = (own[0], own[1]);
            let mut at = self.start(pair + 1) + 2 * pair;
            for (below, x) in (pair + 1..).zip(known.chunks_exact(2)) {
                let ([a, b], [c, d]) = (matrix[at], matrix[at + 1]);
                p -= a * x[0];
                q -= c * x[0];
                p -= b * x[1];
                q -= d * x[1];
                at += 2 * (below + 1);
            }
            own[1] = q * inverse[2 * pair + 1];
            own[0] = (p - matrix[self.diagonal(2 * pair)][1] * own[1]) * inverse[2 * pair];
        }
    }
}

#[cfg(test)]
mod tests;
