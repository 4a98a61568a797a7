//! What the table must show, asserted.

use crate::study::{Record, Varied};

/// How far the order observed on the lattice may be from r: the next term is (epsilon tau)^2 / 4 times the leading one.
const BAND: f64 = 0.3;
/// A wider kernel makes this much difference at most on jittered particles.
const SAME: f64 = 0.05;

/// Sentences about the table, and whether they are true.
pub fn check(records: &[Record]) -> Vec<(String, bool)> {
    let mut claims = Vec::new();
    let of = |method: &'static str, varied: Varied, dim: usize, scattered: bool| {
        let matches =
            move |r: &&Record| (r.method, r.varied, r.dim, r.jitter > 0.0) == (method, varied, dim, scattered);
        let mut series: Vec<Vec<&Record>> = Vec::new();
        for record in records.iter().filter(matches) {
            match series.last_mut().filter(|last| last.iter().all(|r| r.order == record.order)) {
                Some(last) => last.push(record),
                None => series.push(vec![record]),
            }
        }
        series
    };

    for series in of("PSE", Varied::Overlap, 2, false) {
        let (Some(near), Some(far)) = (at(&series, |r| r.epsilon_over_h, 2.0), at(&series, |r| r.epsilon_over_h, 3.0))
        else {
            continue;
        };
        let order = (far.l2 / near.l2).ln() / 1.5_f64.ln();
        let text = format!("PSE, r = {}, lattice: the error grows as epsilon^{order:.2} from 2 h to 3 h", near.order);
        claims.push((text, (order - f64::from(near.order)).abs() <= BAND));
    }
    for (dim, scattered, overlap) in [(2, false, 1.0), (3, false, 1.0), (2, true, 2.0), (3, true, 1.3)] {
        let errors: Vec<(u32, f64)> = of("PSE", Varied::Overlap, dim, scattered)
            .iter()
            .filter_map(|series| at(series, |r| r.epsilon_over_h, overlap))
            .filter(|r| scattered || r.order > 2)
            .map(|r| (r.order, r.l2))
            .collect();
        let set = if scattered { "jittered" } else { "lattice, r > 2" };
        let shown: Vec<String> = errors.iter().map(|(order, l2)| format!("{l2:.1e} (r = {order})")).collect();
        let text = format!("PSE, {dim}D {set}, epsilon = {overlap} h: a higher order is worse: {}", shown.join(", "));
        claims.push((text, errors.len() > 1 && errors.is_sorted_by(|a, b| a.1 < b.1)));
    }
    for series in of("PSE", Varied::Cutoff, 2, false) {
        let Some(whole) = series.last() else { continue };
        let enough = series.iter().find(|r| (r.l2 / whole.l2 - 1.0).abs() <= SAME);
        let (order, least) = (whole.order, enough.map_or(f64::NAN, |r| r.cutoff_over_epsilon));
        let text =
            format!("PSE, r = {order}, lattice: the error of the whole kernel from cutoff {least:.1} epsilon on");
        // exp(-z^2) z^(r+2) has to fall below the error itself.
        claims.push((text, least <= if order == 2 { 3.5 } else { 6.0 } && least > 2.5));
    }
    for series in of("PSE", Varied::Cutoff, 2, true) {
        let Some(whole) = series.last() else { continue };
        let same =
            series.iter().filter(|r| r.cutoff_over_epsilon >= 3.0).all(|r| (r.l2 / whole.l2 - 1.0).abs() <= SAME);
        let text = format!("PSE, r = {}, jittered: beyond 3 epsilon a wider cutoff gains nothing", whole.order);
        claims.push((text, same));
    }

    for dim in [2, 3] {
        let best = |method: &'static str, order: Option<u32>| {
            let all = of(method, Varied::Overlap, dim, true);
            let errors = all.iter().flatten().filter(|r| order.is_none_or(|order| r.order == order)).map(|r| r.l2);
            errors.fold(f64::INFINITY, f64::min)
        };
        let (pse, dcpse) = (best("PSE", None), best("DC-PSE", Some(4)));
        let text = format!("{dim}D jittered: DC-PSE of order 4 reaches {dcpse:.1e}, PSE of any order {pse:.1e}");
        claims.push((text, 2.0 * dcpse < pse));

        for series in of("DC-PSE", Varied::Overlap, dim, true) {
            let (Some(few), Some(many)) = (series.first(), series.last()) else { continue };
            let Some(usual) = at(&series, |r| r.neighbors / r.conditions as f64, 2.0) else { continue };
            let text = format!(
                "DC-PSE, {dim}D, r = {}: from 1.25 l over 2 l to 4 l neighbors h^2 sum |w| {:.1}, {:.1}, {:.1}, worst \
                 condition {:.0e}, {:.0e}, {:.0e}, error of 2 l and 4 l {:.1e}, {:.1e}",
                few.order,
                few.sum_abs,
                usual.sum_abs,
                many.sum_abs,
                few.condition,
                usual.condition,
                many.condition,
                usual.l2,
                many.l2
            );
            let calmer = few.sum_abs > usual.sum_abs && usual.sum_abs > many.sum_abs;
            claims.push((text, calmer && few.condition > usual.condition && usual.l2 < many.l2));
        }
        for series in of("DC-PSE", Varied::Cutoff, dim, true) {
            let by = |ratio: f64| at(&series, |r| r.cutoff_over_epsilon, ratio);
            let (Some(wide), Some(narrow)) = (by(2.0), by(4.0)) else { continue };
            let text = format!(
                "DC-PSE, {dim}D, r = {}: cutoff/epsilon 4 in place of 2 changes the error from {:.1e} to {:.1e} and \
                 h^2 sum |w| from {:.1} to {:.1}",
                wide.order, wide.l2, narrow.l2, wide.sum_abs, narrow.sum_abs
            );
            claims.push((text, narrow.l2 < wide.l2 && narrow.sum_abs > wide.sum_abs));
        }
    }
    claims
}

/// The record nearest to a value, within 3 %.
fn at<'a>(series: &[&'a Record], of: fn(&Record) -> f64, value: f64) -> Option<&'a Record> {
    let distance = |r: &&Record| (of(r) / value - 1.0).abs();
    series.iter().copied().min_by(|a, b| distance(a).total_cmp(&distance(b))).filter(|r| distance(r) <= 0.03)
}
