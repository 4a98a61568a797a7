//! Moment systems: ill-conditioned, degenerate, unscaled, one-sided, and stencils of a tuned size.

use std::error::Error;

use parops::{
    Along, Apply, Cutoff, DcPse, Domain, ErrorKind, Expression, HalfList, Nearest, NeighborList, Neighbors,
    OperatorError, Particles, Rows, Selected, Sign, SpectrumEstimator,
};

use super::naive_dcpse::{Naive, cut, interpolating, least_squares, plain, refused, row, wrapped};
use super::sets::{dcpse, derivative, laplacian, listed, nearest, relative_error, square, torus, values, wave};
use crate::case::Case;

type Done = Result<(), Box<dyn Error>>;

/// Particles of a box of m x m that are at least `margin` spacings from its faces.
fn inside(m: usize, particles: &Particles<2>, margin: f64) -> Vec<usize> {
    let legal = margin / m as f64..=1.0 - margin / m as f64;
    let within = |p: &usize| particles.points()[*p].iter().all(|x| legal.contains(x));
    (0..particles.len()).filter(within).collect()
}

/// 1. As many neighbors as conditions.
pub fn ill_conditioned(case: &mut Case, quick: bool) -> Done {
    const CONDITIONS: usize = 20;
    let m = if quick { 24 } else { 48 };
    let h = 1.0 / m as f64;
    case.setup(format!("d2/dx2 of order 4 on {m}x{m} particles, jitter 0.3 h, n = l = {CONDITIONS} neighbors"));
    let particles = square(m, 0.3, 1)?;
    let rows_of = inside(m, &particles, 5.0);
    let naive = |k: usize| -> Vec<Naive> {
        let separations =
            |p: usize| cut(particles.points(), p, k, plain).into_iter().map(|(_, s)| s).collect::<Vec<_>>();
        rows_of.iter().map(|&p| row(&separations(p), [2, 0], 4, 2.0 * h)).collect()
    };
    let worst = |rows: &[Naive]| {
        let most = |of: &dyn Fn(&Naive) -> f64| rows.iter().map(of).fold(0.0, f64::max);
        (most(&|row| row.condition), most(&|row| row.gain(h, 2)), most(&|row| row.miss))
    };
    let (condition, gain, miss) = worst(&naive(CONDITIONS));
    let (usual, usual_gain, _) = worst(&naive(2 * CONDITIONS));
    case.naive(
        condition > 1e4 && gain > 1e2 * usual_gain,
        format!("condition to {condition:.1e}, noise gain sum |w| h^2 to {gain:.1e}, moments missed by {miss:.1e}; with n = 2 l {usual:.0} and {usual_gain:.1}"),
    );

    let strict = dcpse(derivative([2, 0])?, 4)?;
    let few = Nearest::build(&particles, &Domain::open(), CONDITIONS)?;
    // A list that answers no farther than its rows: there is no room to widen them.
    let bounded = NeighborList::from_provider(&Exactly(&few))?;
    let refused = strict.assemble(&bounded);
    let refusal =
        refused.as_ref().err().map(|error| (error.kind().clone(), error.particle().is_some(), error.wanted_cutoff()));
    let met = matches!(&refusal, Some((ErrorKind::Operator(OperatorError::TooFew { neighbors, conditions: CONDITIONS, needed: 40 }), true, Some(_))) if *neighbors < 40);
    case.reports(met, refused.err().map_or(String::from("accepted"), |error| error.to_string()));

    let asked = strict.clone().neighbors_per_condition(1.0)?;
    let selected = Selected::new(&few, &rows_of)?;
    let (text, met) = match asked.assemble(&selected) {
        Ok(rows) => {
            let report = rows.report();
            let text = format!(
                "n = l asked for: every row certified to {:.0e}, the worst condition {:.1e} and sum |w| h^2 {:.1e} in the report",
                report.residual,
                report.condition,
                report.sum_abs * h * h
            );
            (text, report.condition > 1e3 && report.condition.is_finite() && report.worst().is_some())
        }
        Err(error) => {
            let found = matches!(error.kind(), ErrorKind::Operator(OperatorError::Uncertified { condition, rank, .. }) if *condition > 1e3 && *rank <= CONDITIONS);
            (format!("n = l asked for: {error}"), found && error.particle().is_some())
        }
    };
    case.detects(met, text);

    // Three times 1.15 in radius are 2.3 times in area; beside a face it is less.
    let rows = strict.assemble(&Nearest::build(&particles, &Domain::open(), CONDITIONS + 10)?)?;
    let report = rows.report();
    case.adapts(
        report.grown == report.rows && report.condition < 0.1 * condition,
        format!(
            "the support of all {} rows grows by 1.15 until n = {} to {}; condition at most {:.0}, faces included",
            report.grown, report.fewest, report.most, report.condition
        ),
    );
    Ok(())
}

/// A provider without room beyond the cutoffs of its rows.
struct Exactly<'a>(&'a Nearest<2>);

impl Neighbors<2> for Exactly<'_> {
    fn targets(&self) -> usize {
        self.0.targets()
    }
    fn sources(&self) -> usize {
        self.0.sources()
    }
    fn center(&self, p: usize) -> Option<usize> {
        self.0.center(p)
    }
    fn cutoff(&self, p: usize) -> f64 {
        self.0.cutoff(p)
    }
    fn reach(&self) -> f64 {
        (0..self.targets()).map(|p| self.cutoff(p)).fold(0.0, f64::max)
    }
    fn generation(&self) -> u64 {
        self.0.generation()
    }
    fn for_each(&self, p: usize, cutoff: f64, visit: impl FnMut(parops::Neighbor<2>)) {
        self.0.for_each(p, cutoff.min(self.cutoff(p)), visit);
    }
}

/// Rows of the k nearest on the unit torus, ties cut as they come.
fn cut_list(particles: &Particles<2>, k: usize) -> parops::Result<NeighborList<2>> {
    let (mut offsets, mut indices, mut cutoff) = (vec![0], Vec::new(), 0.0_f64);
    for p in 0..particles.len() {
        for (q, s) in cut(particles.points(), p, k, wrapped) {
            indices.push(q as u32);
            cutoff = cutoff.max(s[0].hypot(s[1]));
        }
        offsets.push(indices.len());
    }
    NeighborList::from_indices(particles, &torus()?, &offsets, &indices, Cutoff(cutoff * (1.0 + 1e-9)))
}

/// What rows of d3/dx3 and d3/dy3 on 10 places, solved from 10 conditions, make of the constant 1.
#[derive(Default)]
struct OfConstants {
    rows: usize,
    /// Rows that do not give 0 but for a thousandth of 1/h^3, and the largest value times h^3.
    wrong: usize,
    worst: f64,
    /// The largest sum |w| h^3, and the least pivot over the largest.
    gain: f64,
    pivot: f64,
}

/// Inside a lattice of spacing 1/10 that is turned by 0.5, so that its places are rounded.
fn turned_lattice() -> OfConstants {
    const M: usize = 10;
    let h = 1.0 / M as f64;
    let (sine, cosine) = 0.5_f64.sin_cos();
    let place = |i: usize| [(i % M) as f64 * h, (i / M) as f64 * h];
    let points: Vec<[f64; 2]> =
        (0..M * M).map(place).map(|[x, y]| [cosine * x - sine * y, sine * x + cosine * y]).collect();
    let mut of = OfConstants { pivot: f64::INFINITY, ..OfConstants::default() };
    for p in (0..M * M).filter(|p| [p % M, p / M].iter().all(|i| (2..M - 2).contains(i))) {
        let mut places = vec![[0.0; 2]];
        places.extend(cut(&points, p, 9, plain).into_iter().map(|(_, s)| s));
        for beta in [[3, 0], [0, 3]] {
            let row = interpolating(&places, beta, 1, h);
            let found = (row.weights.iter().sum::<f64>() * h.powi(3)).abs();
            of.rows += 1;
            of.wrong += usize::from(!(found <= 1e-3));
            (of.worst, of.gain, of.pivot) = (of.worst.max(found), of.gain.max(row.gain(h, 3)), of.pivot.min(row.pivot));
        }
    }
    of
}

/// 2. The exact lattice with as many neighbors as conditions.
pub fn lattice(case: &mut Case, _: bool) -> Done {
    const CONDITIONS: usize = 9;
    let (m, p) = (8, 27);
    let h = 1.0 / m as f64;
    case.setup("square lattices with n = l: the Laplacian of order 2 on 9 neighbors, spacing 1/8; d3/dx3 and d3/dy3 on 10 places with the condition of constants, spacing 1/10, turned by 0.5 and so rounded");
    let particles = Particles::lattice([0.0; 2], [1.0; 2], [m; 2])?;
    let separations: Vec<[f64; 2]> =
        cut(particles.points(), p, CONDITIONS, wrapped).into_iter().map(|(_, s)| s).collect();
    let (xx, yy) = (row(&separations, [2, 0], 2, h), row(&separations, [0, 2], 2, h));
    let paraboloid = |x: &[f64; 2]| x[0] * x[0] + x[1] * x[1];
    let found = xx.apply(&separations, paraboloid) + yy.apply(&separations, paraboloid);
    let [lu, cholesky] = refused(&separations, [2, 0], 2, h);
    let OfConstants { rows, wrong, worst, gain, pivot } = turned_lattice();
    case.naive(
        found.is_nan() && xx.pivot == 0.0 && lu && cholesky && 2 * wrong > rows && worst > 1.0,
        format!("on the exact lattice a pivot of the normal equations is 0: LU and Cholesky refuse them, elimination that does not look makes the Laplacian of x^2 + y^2 {found}. On the turned one pivots down to {pivot:.0e} of the largest are taken, sum |w| h^3 comes to {gain:.0e}, and in {wrong} of {rows} rows the third derivative of 1 is not 0 but up to {worst:.0}/h^3"),
    );

    let method = dcpse(laplacian()?, 2)?.neighbors_per_condition(1.0)?;
    let cut_rows = method.assemble(&cut_list(&particles, CONDITIONS)?)?;
    let deficient = cut_rows.report().worst().map_or(CONDITIONS, |row| row.rank);
    // A lattice three particles wide: x^3 = h^2 x on it, so that the third moment along x cannot vanish.
    let strip = Particles::lattice([0.0; 2], [3.0 * h, 40.0 * h], [3, 40])?;
    let slope = dcpse(derivative([1, 0])?, 4)?;
    let refusal = slope.assemble(&nearest(&strip, &Domain::open(), &slope)?).err();
    let typed = refusal.as_ref().is_some_and(|error| {
        let ErrorKind::Operator(kind) = error.kind() else { return false };
        let deficient = match kind {
            OperatorError::Singular { rank, conditions, .. } | OperatorError::Uncertified { rank, conditions, .. } => {
                rank < conditions
            }
            _ => false,
        };
        deficient && error.particle().is_some()
    });
    case.detects(
        deficient < CONDITIONS && cut_rows.report().residual < 1e-12 && typed,
        format!("the report has rank {deficient} of 9 and a residual of {:.0e}: these conditions have a solution all the same; d/dx of order 4 on a lattice three particles wide has none: {}", cut_rows.report().residual, refusal.map_or(String::from("accepted"), |error| error.to_string())),
    );

    let shells = Nearest::build(&particles, &torus()?, CONDITIONS)?;
    let rows = method.assemble(&shells)?;
    let field: Vec<f64> = particles.points().iter().map(|x| paraboloid(&wrapped(x, &particles.points()[p]))).collect();
    let mut lap = vec![0.0; field.len()];
    rows.apply(&field, &mut lap)?;
    let defaults = dcpse(laplacian()?, 2)?;
    let ours = defaults.assemble(&nearest(&particles, &torus()?, &defaults)?)?;
    let mut same = vec![0.0; field.len()];
    ours.apply(&field, &mut same)?;
    case.adapts(
        rows.report().fewest == 12
            && (lap[p] - 4.0).abs() < 1e-10
            && ours.report().fewest >= 2 * CONDITIONS
            && (same[p] - 4.0).abs() < 1e-10,
        format!(
            "whole shells: 9 asked for give {} neighbors, by default there are {}; both give 4 to {:.0e}",
            rows.report().fewest,
            ours.report().fewest,
            (lap[p] - 4.0).abs().max((same[p] - 4.0).abs())
        ),
    );
    Ok(())
}

/// 3. A shell of the lattice cut through.
pub fn shell_cut(case: &mut Case, quick: bool) -> Done {
    let m = if quick { 10 } else { 16 };
    let h = 1.0 / m as f64;
    case.setup(format!("advection by DC-PSE of order 2 ('-'), {m}x{m} lattice on a torus, the 14 nearest"));
    let particles = Particles::lattice([0.0; 2], [1.0; 2], [m; 2])?;
    let method =
        DcPse::at_order(Expression::of(&Along([-0.8, 0.6]))?, 2)?.sign(Sign::Minus).neighbors_per_condition(1.5)?;
    let spectrum = |rows: &Rows| SpectrumEstimator::new().of(rows);
    let list = cut_list(&particles, 14)?;
    let arbitrary = spectrum(&method.assemble(&list)?)?;
    case.naive(
        arbitrary.abscissa * h > 1e-3,
        format!(
            "ties broken by number: max Re(lambda) h = {:.3}, modes grow on a perfect lattice",
            arbitrary.abscissa * h
        ),
    );
    let whole = Nearest::build(&particles, &torus()?, 14)?;
    let single =
        |provider: &dyn Fn() -> parops::Result<HalfList<2>>| provider().map(|half| (half.mutual(), half.single()));
    let (mutual, one_sided) = single(&|| HalfList::from_provider(&list, Cutoff(list.reach())))?;
    let (pairs, none) = single(&|| {
        HalfList::from_provider(&NeighborList::from_provider(&Exactly(&whole))?, Cutoff(Exactly(&whole).reach()))
    })?;
    case.reports(
        one_sided > 0 && none == 0,
        format!("asymmetry: a half list finds {one_sided} pairs beside {mutual} in which only one knows the other; with whole shells {none} beside {pairs}"),
    );
    let ours = spectrum(&method.assemble(&whole)?)?;
    case.adapts(
        ours.abscissa <= 1e-8 * ours.radius && whole.count(0, whole.cutoff(0)) == 20,
        format!(
            "a cutoff by radius, ties in: {} neighbors, max Re(lambda) h = {:.0e}",
            whole.count(0, whole.cutoff(0)),
            ours.abscissa * h
        ),
    );
    Ok(())
}

/// 4. Monomials of raw coordinates.
pub fn unscaled(case: &mut Case, _: bool) -> Done {
    let m = 16;
    let small = 2.0_f64.powi(-20);
    case.setup("Laplacian of order 4, jitter 0.3 h, spacing 2^-20 = 9.5e-7 in place of 1");
    let unit = Particles::jittered([0.0; 2], [m as f64; 2], [m; 2], 0.3, 3)?;
    let shrunk = Particles::new(unit.points().iter().map(|x| x.map(|x| x * small)).collect())?;
    let p = m * m / 2 + m / 2;
    let around = |set: &Particles<2>| cut(set.points(), p, 40, plain).into_iter().map(|(_, s)| s).collect::<Vec<_>>();
    let milder = Particles::new(unit.points().iter().map(|x| x.map(|x| x / 64.0)).collect())?;
    let (scaled, raw) = (row(&around(&unit), [2, 0], 4, 2.0), row(&around(&milder), [2, 0], 4, 1.0));
    let (fitted, lost) =
        (least_squares(&around(&unit), [2, 0], 4, 1.0)?, least_squares(&around(&shrunk), [2, 0], 4, small)?);
    case.naive(
        raw.condition > 1e5 * scaled.condition && lost > 1e6 * fitted && lost > 0.01,
        format!("condition {:.0}, {:.1e} for spacing 1/64 already; least squares on the raw monomials drop small singular values and miss a moment by {lost:.1e} h^(k - 2) in place of {fitted:.0e}", scaled.condition, raw.condition),
    );
    let method = dcpse(laplacian()?, 4)?;
    let rows = |set: &Particles<2>| method.assemble(&nearest(set, &Domain::open(), &method)?.canonical());
    let (large, tiny) = (rows(&unit)?, rows(&shrunk)?);
    let scale = small.powi(-2);
    let equal = (0..unit.len()).all(|p| match (large.row(p), tiny.row(p)) {
        (Some(a), Some(b)) => {
            a.sources == b.sources
                && a.weights.iter().zip(b.weights).all(|([a], [b])| (a * scale).to_bits() == b.to_bits())
        }
        _ => false,
    });
    case.adapts(
        equal && large.report().condition == tiny.report().condition,
        format!("monomials of x/epsilon: all {} rows are those of spacing 1 times 2^40 to the bit, condition at most {:.0} in both", unit.len(), tiny.report().condition),
    );
    Ok(())
}

/// 5. Half a stencil at an edge.
pub fn one_sided(case: &mut Case, quick: bool) -> Done {
    let m = if quick { 24 } else { 40 };
    let h = 1.0 / m as f64;
    case.setup(format!("d2/dx2 of order 4 at the face x = 0 of {m}x{m} particles, jitter 0.3 h, n = 2 l = 40"));
    let particles = square(m, 0.3, 2)?;
    let middle = |p: &usize| (0.25..0.75).contains(&particles.points()[*p][1]);
    let edge: Vec<usize> = (0..particles.len()).filter(|&p| particles.points()[p][0] < h).filter(middle).collect();
    let interior = inside(m, &particles, 6.0);
    let naive = |of: &[usize]| {
        let gain = |&p: &usize| {
            let separations: Vec<[f64; 2]> =
                cut(particles.points(), p, 40, plain).into_iter().map(|(_, s)| s).collect();
            row(&separations, [2, 0], 4, 2.0 * h).gain(h, 2)
        };
        of.iter().map(gain).fold(0.0, f64::max)
    };
    let (at_edge, within) = (naive(&edge), naive(&interior));
    case.naive(
        at_edge > 5.0 * within,
        format!("noise gain sum |w| h^2 = {at_edge:.0} at the face, {within:.1} inside: data with noise 1e-6 give a derivative that is wrong by {:.1e}/h^2, unseen", 1e-6 * at_edge),
    );
    let gain = |points: &Particles<2>, targets: &[usize], order: u32, ratio: f64| -> parops::Result<f64> {
        let method = dcpse(derivative([2, 0])?, order)?.neighbors_per_condition(ratio)?;
        let rows = method.assemble(&Selected::new(nearest(points, &Domain::open(), &method)?, targets)?)?;
        Ok(rows.report().sum_abs * h * h)
    };
    let (ours, inner) = (gain(&particles, &edge, 4, 2.0)?, gain(&particles, &interior, 4, 2.0)?);
    case.reports(
        ours > 5.0 * inner && ours < 2.0 * at_edge,
        format!("the report's sum |w| h^2 is {ours:.0} at the face and {inner:.1} inside"),
    );
    let (wider, lower) = (gain(&particles, &edge, 4, 3.0)?, gain(&particles, &edge, 2, 2.0)?);
    // The same particles, continued beyond the face.
    let mut ghosts = particles.points().to_vec();
    ghosts.extend(particles.points().iter().filter(|x| x[0] < 8.0 * h).map(|x| [-x[0], x[1]]));
    let layer = gain(&Particles::new(ghosts)?, &edge, 4, 2.0)?;
    case.adapts(
        wider < ours && lower < ours && layer < ours,
        format!("the caller's choice: 3 l neighbors {wider:.0}, order 2 {lower:.1}, a layer of ghosts beyond the face {layer:.1}"),
    );
    Ok(())
}

/// 32. The size of a stencil tuned on one scene.
pub fn stencil_size(case: &mut Case, _: bool) -> Done {
    const CONDITIONS: usize = 9;
    const M: usize = 20;
    case.setup(format!(
        "Laplacian of order 2 on {M}x{M} particles, jitter 0.3 h, n = 9 to 36 neighbors, read at one particle"
    ));
    let method = dcpse(laplacian()?, 2)?.neighbors_per_condition(1.0)?;
    let factor = -8.0 * std::f64::consts::PI.powi(2);
    let p = M * M / 2 + 7;
    // The error at one particle, and over all, for every n.
    let curves = |seed: u64| -> parops::Result<(Vec<f64>, Vec<f64>)> {
        let particles = square(M, 0.3, seed)?;
        let (u, exact) = (values(&particles, wave), values(&particles, |x| factor * wave(x)));
        let mut lap = vec![0.0; u.len()];
        let (mut here, mut all) = (Vec::new(), Vec::new());
        for n in CONDITIONS..=4 * CONDITIONS {
            method.assemble(&Exactly(&Nearest::build(&particles, &torus()?, n)?))?.apply(&u, &mut lap)?;
            here.push(((lap[p] - exact[p]) / factor).abs());
            all.push(relative_error(&lap, &exact));
        }
        Ok((here, all))
    };
    let ((tuned, all), (other, _)) = (curves(1)?, curves(2)?);
    let turns = |errors: &[f64]| errors.windows(3).filter(|e| (e[1] - e[0]) * (e[2] - e[1]) < 0.0).count();
    let best =
        |errors: &[f64]| (0..errors.len()).min_by(|&a, &b| errors[a].total_cmp(&errors[b])).unwrap_or(0) + CONDITIONS;
    case.naive(
        turns(&tuned) >= 4 && turns(&other) >= 4 && best(&tuned).abs_diff(best(&other)) >= 4,
        format!(
            "the error turns {} and {} times; n = {} is best on one set and n = {} on another of the same kind",
            turns(&tuned),
            turns(&other),
            best(&tuned),
            best(&other)
        ),
    );
    let default = 2 * CONDITIONS;
    let (least, ours) = (all.iter().copied().fold(f64::INFINITY, f64::min), all[default - CONDITIONS]);
    case.prevents(
        ours < 2.0 * least && turns(&all[3..]) <= 2,
        format!("over all particles the error hardly turns ({} times from n = 12 on): {} at n = 9, 12, 18, 36; the default, 18, is at {:.1} times the least", turns(&all[3..]), listed([all[0], all[3], ours, all[27]]), ours / least),
    );
    case.documents(
        include_str!("../../../src/operator/dcpse/mod.rs"),
        "The error at a particle goes up and down with n, and what is best on one set is not on the next: do not tune the ratio on one scene.",
    );
    Ok(())
}
