//! Rows made by hand: of one stencil, without particles, and what their weights add up to.

use parops::{Draft, Expression, Method, MultiIndex, Neighbor, Outputs, Random, Result, RowReport, Stencil, Volumes};

/// Sums of 45 products, some of which cancel to a hundredth of their size.
const ROUNDING: f64 = 45.0 * 100.0 * f64::EPSILON;

pub const COUNT: usize = 46;
pub const TARGET: usize = 3;
pub const EPSILON: f64 = 0.3;

pub fn near(found: f64, expected: f64) -> bool {
    found == expected || (found - expected).abs() <= ROUNDING * expected.abs().max(1.0)
}

pub fn volume(q: usize) -> f64 {
    0.01 + 0.001 * q as f64
}

pub fn volumes() -> Volumes {
    Volumes::each((0..COUNT).map(volume).collect()).unwrap()
}

/// Every other particle around particle 3, more of them on one side and every fifth an odd image.
pub fn stencil(center: Option<usize>) -> Stencil<2> {
    let mut random = Random::new(4);
    let mut stencil = Stencil::default();
    stencil.reset(TARGET, center, 6.0 * EPSILON);
    for q in (0..COUNT).filter(|&q| q != TARGET) {
        let separation = std::array::from_fn(|_| 4.0 * EPSILON * (random.uniform() - 0.4));
        stencil.push(Neighbor { q, separation, sign: if q % 5 == 0 { -1 } else { 1 } });
    }
    stencil
}

pub struct Made<S> {
    pub weights: Vec<S>,
    pub diagonal: S,
    pub report: RowReport,
}

/// The row of a stencil, made alone and in a batch: the same bits.
pub fn made<M: Method<D>, const D: usize>(method: &M, stencil: &Stencil<D>) -> Result<Made<M::Out>> {
    let mut scratch = method.scratch()?;
    let (mut weights, mut diagonal) = (vec![M::Out::ZERO; stencil.len()], M::Out::ZERO);
    method.weights(stencil, &mut scratch, &mut weights, &mut diagonal)?;
    let report = method.report(stencil, &scratch, &weights, &diagonal)?;
    let mut draft = Draft { stencil: stencil.clone(), ..Draft::default() };
    draft.clear();
    method.weights_batch(std::slice::from_mut(&mut draft), &mut scratch);
    assert_eq!((&draft.weights, &draft.diagonal, draft.report?), (&weights, &diagonal, report));
    assert_eq!((report.target, report.neighbors), (stencil.target(), stencil.len()));
    Ok(Made { weights, diagonal, report })
}

/// sum |w| and the diagonal, the largest of the outputs.
pub fn gain<S: Outputs>(made: &Made<S>) -> f64 {
    let of = |k: usize| made.weights.iter().map(|w| w.as_slice()[k].abs()).sum::<f64>();
    (0..S::K).map(|k| made.diagonal.as_slice()[k].abs() + of(k)).fold(0.0, f64::max)
}

/// The weights below zero before the signs of the images.
pub fn negative<S: Outputs, const D: usize>(made: &Made<S>, stencil: &Stencil<D>) -> usize {
    let signed = made.weights.iter().zip(stencil.signs());
    signed.map(|(w, &sign)| w.as_slice().iter().filter(|&&w| w * f64::from(sign) < 0.0).count()).sum()
}

pub fn sum_of(terms: &[([u8; 2], f64)]) -> Expression<2> {
    Expression::new(terms.iter().map(|&(index, factor)| (MultiIndex::new(index), factor))).unwrap()
}
