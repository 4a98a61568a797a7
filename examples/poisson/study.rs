//! All sets and orders: the table, the files, and what must hold.

use std::error::Error;
use std::fmt::Write;

use crate::figures;
use crate::options::Options;
use crate::sets::{Scattered, ball, square_with_hole};
use crate::solve::{Solved, solve};

/// How far the observed order may be below r.
const BAND: f64 = 0.3;

/// Particles along the square and across the ball, refinement after refinement.
fn sides(quick: bool, dim: usize) -> &'static [usize] {
    match (quick, dim) {
        (true, 2) => &[24, 36, 54],
        (true, _) => &[12, 16, 20],
        (false, 2) => &[24, 36, 54, 80, 120],
        (false, _) => &[12, 16, 20, 25],
    }
}

/// Runs the study; whether every observed order is high enough.
pub fn run(options: &Options) -> Result<bool, Box<dyn Error>> {
    println!("dim  r       N boundary entries    L2 error  Linf error  order       cond  residual  build s  solve s");
    let mut csv = String::from(
        "dim,order,h,n,boundary,entries,error_l2,error_linf,observed_order,condition,residual,build_s,solve_s\n",
    );
    let square = refine(sides(options.quick, 2), square_with_hole, &mut csv)?;
    let ball = refine(sides(options.quick, 3), ball, &mut csv)?;
    std::fs::write(options.out.join("poisson.csv"), csv)?;
    figures::orders(&options.out.join("poisson_order.svg"), &square, &ball)?;
    figures::square(&options.out.join("poisson_square.svg"), &square)?;
    figures::ball(&options.out.join("poisson_ball.svg"), &ball)?;
    println!("written to {}\n", options.out.display());
    Ok(orders_hold("square with a hole", &square) & orders_hold("ball", &ball))
}

/// Both orders on all refinements of one domain, order by order.
fn refine<const D: usize>(
    sides: &[usize],
    set: fn(usize) -> parops::Result<Scattered<D>>,
    csv: &mut String,
) -> Result<Vec<Solved<D>>, Box<dyn Error>> {
    let mut all: Vec<Solved<D>> = Vec::new();
    for order in [2, 4] {
        for &n in sides {
            let solved = solve(&set(n)?, order)?;
            let last = all.last().filter(|last| last.order == order);
            let observed = last.map(|last| (last.l2 / solved.l2).ln() / (last.h / solved.h).ln());
            let Solved { h, particles, boundary, entries, l2, linf, condition, residual, build, solve, .. } = &solved;
            let shown = observed.map_or("-".into(), |order| format!("{order:.2}"));
            println!(
                "{D:>3} {order:>2} {particles:>7} {boundary:>8} {entries:>7.1} {l2:>11.3e} {linf:>11.3e} {shown:>6} \
                 {condition:>10.1e} {residual:>9.1e} {build:>8.2} {solve:>8.2}"
            );
            let observed = observed.map_or(String::new(), |order| format!("{order:.4}"));
            writeln!(
                csv,
                "{D},{order},{h},{particles},{boundary},{entries:.2},{l2:e},{linf:e},{observed},{condition:e},{residual:e},\
                 {build:.4},{solve:.4}"
            )?;
            all.push(solved);
        }
    }
    Ok(all)
}

/// Whether the order fitted over all refinements is at least r - [`BAND`], for each r.
fn orders_hold<const D: usize>(name: &str, all: &[Solved<D>]) -> bool {
    let mut holds = true;
    for series in all.chunk_by(|a, b| a.order == b.order) {
        let Some(order) = series.first().map(|first| first.order) else { continue };
        let observed = slope(series);
        let high_enough = observed >= f64::from(order) - BAND;
        let mark = if high_enough { "holds " } else { "FAILS " };
        println!("{mark} {name}, r = {order}: observed order {observed:.2}, at least {:.1}", f64::from(order) - BAND);
        holds &= high_enough;
    }
    holds
}

/// Slope of ln(error) over ln h by least squares.
fn slope<const D: usize>(series: &[Solved<D>]) -> f64 {
    let points: Vec<(f64, f64)> = series.iter().map(|solved| (solved.h.ln(), solved.l2.ln())).collect();
    let count = points.len() as f64;
    let (mx, my) = points.iter().fold((0.0, 0.0), |(mx, my), (x, y)| (mx + x / count, my + y / count));
    let (xy, xx) =
        points.iter().fold((0.0, 0.0), |(xy, xx), (x, y)| (xy + (x - mx) * (y - my), xx + (x - mx) * (x - mx)));
    xy / xx
}
