//! DC-PSE reproduces every monomial of degree below |beta| + r, on any neighborhood, and no more.
//!
//! All multi-indices of one degree are outputs of one operator. Every (D, degree, r) gets `PAROPS_CASES` neighborhoods
//! where |beta| <= 2 and r is 2 or 4, a tenth beyond 1000 elsewhere, and fewer by (56 / l)^3 above 56 conditions, where
//! one row takes milliseconds.

use std::borrow::Cow;
use std::collections::BTreeMap;

use crate::cases::cases;
use crate::stencils::{Moments, Stencils, candidates, condition, length, moments, monomials, terms};
use parops::{CUTOFF_OVER_EPSILON, DcPse, MultiIndex, Operator, Random, Row, graded, testing::Promise};

/// Cases for an operator of l conditions.
fn share(degree: u32, order: u32, l: usize) -> usize {
    let all = cases().max(1) as usize;
    let cases = if degree <= 2 && (order == 2 || order == 4) { all } else { all.min(1000).max(all / 10) };
    if l <= 56 { cases } else { (cases as f64 * (56.0 / l as f64).powi(3)).ceil() as usize }
}

/// Rows built at once.
const BATCH: usize = 250;
/// Orders beyond this many conditions are left out: a row costs more than 10 ms.
const CONDITIONS: usize = 130;
/// Above this multiple of the unit by the lower bound on cond(B), cond(B) itself is computed: rows that come near the
/// bound of 4 are rare, and singular values are dear.
const NEAR: f64 = 0.5;
/// What reproduction to degree 2 + 4 may miss in scaled units.
const MISS: f64 = 1e-12;

/// All derivatives of one degree.
#[derive(Clone, Copy)]
struct OfDegree<const K: usize>(u32);

impl<const D: usize, const K: usize> Operator<D> for OfDegree<K> {
    type Out = [f64; K];

    fn terms(&self, term: &mut dyn FnMut(usize, MultiIndex<D>, f64)) {
        graded(self.0, self.0).enumerate().for_each(|(k, beta)| term(k, beta, 1.0));
    }
}

/// Builds rows on stencils within the default cutoff and epsilon 1, those refused left out, and looks at every one.
/// Returns how many were refused, none of which has been looked at.
fn build<const D: usize, const K: usize>(
    degree: u32,
    order: u32,
    mut offsets: Vec<Vec<[f64; D]>>,
    mut look: impl FnMut(&[[f64; D]], Row<'_, [f64; K]>),
) -> usize {
    let dcpse = DcPse::at_order(OfDegree::<K>(degree), order).unwrap();
    let mut refused = 0;
    loop {
        // The last neighbor is on the cutoff but for rounding.
        let cutoff = CUTOFF_OVER_EPSILON;
        let stencils = Stencils { offsets, cutoff };
        match dcpse.assemble(&stencils) {
            Ok(rows) => {
                offsets = stencils.offsets;
                offsets.iter().enumerate().for_each(|(p, offsets)| look(offsets, rows.row(p).unwrap()));
                return refused;
            }
            Err(error) => {
                offsets = stencils.offsets;
                offsets.swap_remove(error.particle().unwrap());
                refused += 1;
            }
        }
    }
}

/// The nearest `count` points, scaled to fill the default cutoff.
fn scaled<const D: usize>(mut points: Vec<[f64; D]>, count: usize) -> Vec<[f64; D]> {
    points.select_nth_unstable_by(count - 1, |a, b| length(a).total_cmp(&length(b)));
    points.truncate(count);
    let radius = points.iter().map(length).fold(0.0, f64::max);
    // A few roundings inside the cutoff.
    points.iter().map(|x| x.map(|x| x * (CUTOFF_OVER_EPSILON * (1.0 - 1e-14) / radius))).collect()
}

/// The measured moments of every output of a row, at degrees below |beta| + r.
fn outputs<const D: usize, const K: usize>(
    degree: u32,
    order: u32,
    offsets: &[[f64; D]],
    row: &Row<'_, [f64; K]>,
) -> Vec<Moments> {
    let z: Vec<[f64; D]> = offsets.iter().map(|x| x.map(|x| -x)).collect();
    let low = u32::from(degree > 0 && degree.is_multiple_of(2));
    let (alphas, columns) = monomials(&z, low, degree + order - 1);
    let operator = terms(&OfDegree::<K>(degree));
    let of = |k: usize| moments(row, k, &operator[k], (&alphas, &columns), &z, 1.0);
    let found: Vec<Moments> = (0..K).map(of).collect();
    let (l, eps) = (alphas.len() as f64, f64::EPSILON);
    let mut exact = None;
    for (moments, terms) in found.iter().zip(&operator) {
        let residual = moments.residual();
        let unit = l * eps * terms[0].index.factorial().unwrap() as f64;
        // cond(B) by singular values, not by the estimate the library accepts rows by.
        let cond = if residual <= NEAR * unit * moments.condition {
            moments.condition
        } else {
            *exact.get_or_insert_with(|| condition(&z, degree % 2 == 1, low, degree + order - 1))
        };
        promise("residual of random rows to degree 4, r = 8, by their singular values")
            .in_units("l eps cond beta!", unit * cond)
            .at_most(4.0, residual);
        let by_terms =
            promise("residual of random rows by their terms").in_units("l eps sum abs", l * eps * moments.terms);
        by_terms.at_most(30.0, residual);
    }
    found
}

fn promise(text: impl Into<Cow<'static, str>>) -> Promise {
    Promise::new("Residuals", text)
}

/// What was found for one (D, degree, order).
struct Found {
    rows: usize,
    refused: usize,
    misses: usize,
    /// Least and largest miss of a row and output.
    least: f64,
    largest: f64,
    above: usize,
    sum_abs: f64,
}

impl Found {
    fn new() -> Self {
        Self { rows: 0, refused: 0, misses: 0, least: f64::INFINITY, largest: 0.0, above: 0, sum_abs: 0.0 }
    }

    /// Takes in one row and output.
    fn add(&mut self, moments: &Moments) -> f64 {
        let miss = moments.residual();
        self.misses += 1;
        (self.least, self.largest) = (self.least.min(miss), self.largest.max(miss));
        self.above += usize::from(miss > MISS);
        self.sum_abs = self.sum_abs.max(moments.sum_abs);
        miss
    }

    /// At least this share of the stencils asked for have rows.
    fn promise_rows(&self, name: &str, least: f64, asked: usize) {
        assert_eq!(self.rows + self.refused, asked);
        promise(format!("share of stencils that have a row, {name}")).at_least(least, self.rows as f64 / asked as f64);
    }

    fn show(&self, name: &str) {
        let Self { rows, refused, misses, least, largest, above, sum_abs } = self;
        let share = *above as f64 / (*misses).max(1) as f64;
        println!(
            "{name}: {rows} rows, {refused} refused, misses {least:.1e} to {largest:.1e}, share above 1e-12 {share:.1e}, sum |w| to {sum_abs:.1e}"
        );
    }
}

/// Stencils of 2 l points: jittered, whole, half, quarter and eighth.
fn cut<const D: usize>(count: usize, random: &mut Random, known: &mut BTreeMap<usize, Vec<[f64; D]>>) -> Vec<[f64; D]> {
    const JITTER: f64 = 0.3;
    let cut = (random.uniform() * (D + 1) as f64) as usize;
    let lattice = known.entry(cut).or_insert_with(|| candidates(count, JITTER, cut));
    let moved = lattice.iter().map(|x| x.map(|x| x + JITTER * (2.0 * random.uniform() - 1.0)));
    scaled(moved.collect(), count)
}

/// Points uniform in a ball.
fn cloud<const D: usize>(count: usize, random: &mut Random) -> Vec<[f64; D]> {
    let mut points = Vec::with_capacity(count);
    while points.len() < count {
        let point: [f64; D] = std::array::from_fn(|_| 2.0 * random.uniform() - 1.0);
        if length(&point) <= 1.0 {
            points.push(point);
        }
    }
    scaled(points, count)
}

/// Stencils cut or not, none of which may be refused.
const CUT: (&str, f64) = ("jittered and cut", 1.0);
/// Random points may lie badly by chance: one in a thousand may be refused, where none was of 1000 for every operator.
const CLOUDS: (&str, f64) = ("clouds", 0.999);
/// Half-stencils, none of which may be refused.
const HALVES: (&str, f64) = ("half", 1.0);

/// Conditions of one output, and how many neighbors a row has.
fn size<const D: usize>(degree: u32, order: u32) -> (usize, usize) {
    let l = parops::condition_count(D as u32, degree, order).unwrap() as usize + usize::from(degree == 0);
    (l, 2 * l)
}

/// What is done with a row: its order, what was found so far, the offsets of its neighbors, the row.
type Look<'a, const D: usize, const K: usize> = dyn FnMut(u32, &mut Found, &[[f64; D]], &Row<'_, [f64; K]>) + 'a;

/// Makes stencils and looks at their rows, batch after batch, for every order; K derivatives of one degree. Of stencils
/// of that name at least that share must have rows.
fn every<const D: usize, const K: usize>(
    degree: u32,
    make: &mut dyn FnMut(usize, &mut Random) -> Vec<[f64; D]>,
    look: &mut Look<'_, D, K>,
    (name, least): (&str, f64),
) {
    for order in 1..=8 {
        let (l, count) = size::<D>(degree, order);
        if l > CONDITIONS {
            continue;
        }
        let mut random = Random::new(u64::from(degree * 8 + order) + 1000 * D as u64);
        let mut found = Found::new();
        let asked = share(degree, order, l);
        let mut left = asked;
        while left > 0 {
            let batch = left.min(BATCH);
            left -= batch;
            let offsets = (0..batch).map(|_| make(count, &mut random)).collect();
            found.refused += build::<D, K>(degree, order, offsets, |offsets, row| {
                found.rows += 1;
                look(order, &mut found, offsets, &row);
            });
        }
        found.show(&format!("{name} {D}D |beta| {degree} r {order} l {l}"));
        found.promise_rows(name, least, asked);
    }
}

/// Every degree to 4 in one dimension; K is the number of multi-indices of a degree.
macro_rules! every_degree {
    ($make:expr, $look:ident, $name:expr, $($d:literal: $($degree:literal => $k:literal),*;)*) => {$($({
        every::<$d, $k>($degree, &mut $make, &mut |order, found, offsets, row| {
            $look::<$d, $k>($degree, order, found, offsets, row);
        }, $name);
    })*)*};
}

fn jittered<const D: usize, const K: usize>(
    degree: u32,
    order: u32,
    found: &mut Found,
    offsets: &[[f64; D]],
    row: &Row<'_, [f64; K]>,
) {
    for moments in outputs(degree, order, offsets, row) {
        let residual = found.add(&moments);
        if degree <= 2 && order <= 4 {
            promise("monomials on jittered and cut stencils, degree to 2, r to 4").at_most(MISS, residual);
        }
    }
}

#[test]
fn monomials_are_reproduced_on_jittered_half_quarter_and_eighth_stencils() {
    every_degree! { by_cut(), jittered, CUT,
        1: 0 => 1, 1 => 1, 2 => 1, 3 => 1, 4 => 1;
        2: 0 => 1, 1 => 2, 2 => 3, 3 => 4, 4 => 5;
        3: 0 => 1, 1 => 3, 2 => 6, 3 => 10, 4 => 15;
    }
}

/// Stencils of [`cut`], the lattice points known from case to case.
fn by_cut<const D: usize>() -> impl FnMut(usize, &mut Random) -> Vec<[f64; D]> {
    let mut known = BTreeMap::new();
    move |count, random| cut(count, random, known.entry(count).or_default())
}

fn scattered<const D: usize, const K: usize>(
    degree: u32,
    order: u32,
    found: &mut Found,
    offsets: &[[f64; D]],
    row: &Row<'_, [f64; K]>,
) {
    let l = size::<D>(degree, order).0 as f64;
    for moments in outputs(degree, order, offsets, row) {
        let residual = found.add(&moments);
        // Beyond order 4 the powers of z = 2.2 at the cutoff are no longer of order 1: `outputs` has them in its bound.
        if order <= 4 {
            let size = (MISS / 30.0).max(l * f64::EPSILON * moments.sum_abs);
            let clouds =
                promise("monomials on clouds, degree to 2, r to 4").in_units("max(l eps sum w, 3.3e-14)", size);
            clouds.at_most(30.0, residual);
        }
    }
}

#[test]
fn monomials_are_reproduced_on_clouds_to_their_lebesgue_sum() {
    every_degree! { cloud, scattered, CLOUDS,
        1: 0 => 1, 1 => 1, 2 => 1;
        2: 0 => 1, 1 => 2, 2 => 3;
        3: 0 => 1, 1 => 3, 2 => 6;
    }
}

fn beyond<const D: usize, const K: usize>(
    degree: u32,
    order: u32,
    found: &mut Found,
    offsets: &[[f64; D]],
    row: &Row<'_, [f64; K]>,
) {
    let z: Vec<[f64; D]> = offsets.iter().map(|x| x.map(|x| -x)).collect();
    let (alphas, columns) = monomials(&z, degree + order, degree + order);
    let operator = terms(&OfDegree::<K>(degree));
    for (k, terms) in operator.iter().enumerate() {
        let miss = found.add(&moments(row, k, terms, (&alphas, &columns), &z, 1.0));
        promise("the next degree is missed on half-stencils").at_least(1e-6, miss);
    }
}

/// A half-stencil: asymmetric, so that no condition beyond those imposed holds by itself.
fn half<const D: usize>() -> impl FnMut(usize, &mut Random) -> Vec<[f64; D]> {
    let mut known: BTreeMap<usize, Vec<[f64; D]>> = BTreeMap::new();
    move |count, random| {
        let lattice = known.entry(count).or_insert_with(|| candidates(count, 0.3, 1));
        scaled(lattice.iter().map(|x| x.map(|x| x + 0.3 * (2.0 * random.uniform() - 1.0))).collect(), count)
    }
}

#[test]
fn a_monomial_of_the_next_degree_is_missed_on_every_half_stencil() {
    every_degree! { half(), beyond, HALVES,
        1: 0 => 1, 1 => 1, 2 => 1, 3 => 1, 4 => 1;
        2: 0 => 1, 1 => 2, 2 => 3, 3 => 4, 4 => 5;
        3: 0 => 1, 1 => 3, 2 => 6;
    }
}
