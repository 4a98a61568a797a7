//! probe
#[path = "measure.rs"]
mod measure;
#[path = "sets.rs"]
mod sets;
use measure::*;
use sets::Set;
fn go<const D: usize, const K: usize>(
    degree: u32,
    order: u32,
    set: Set,
    sides: [usize; 4],
    wave: f64,
    targets: usize,
    support: Support,
) {
    let t = std::time::Instant::now();
    match observe::<D, K, f64>(
        degree,
        &Series { set, support, order, sides, wave, targets, seeds: if set == Set::Lattice { 1 } else { 5 } },
    ) {
        Ok(o) => {
            let w = |f: fn(&Observed) -> f64| {
                o.outputs.iter().map(|x| format!("{:.2}", f(x))).collect::<Vec<_>>().join("/")
            };
            println!(
                "{D}D m{degree} r{order} {:12} l {} n {:.1} int {} linf {} face {} whole {} err {:.1e} {:.1e} floor x{:.0e} grown {} rows {} {:.1}s",
                set.name(),
                o.conditions,
                o.neighbors,
                w(|x| x.interior),
                w(|x| x.interior_linf),
                w(|x| x.face),
                w(|x| x.whole),
                o.outputs[0].errors[0],
                o.outputs[0].errors[1],
                o.outputs.iter().map(|x| x.above_floor).fold(f64::INFINITY, f64::min),
                o.grown,
                o.rows,
                t.elapsed().as_secs_f64()
            );
        }
        Err(e) => println!("{D}D m{degree} r{order} {} {e}", set.name()),
    }
}
fn main() {
    let wave = |r: u32| match r {
        1 => 0.4,
        2 => 0.5,
        3 => 0.8,
        4 => 1.0,
        _ => 1.6,
    };
    let which: usize = std::env::args().nth(1).unwrap().parse().unwrap();
    for r in [1, 2, 3, 4, 6] {
        for set in Set::ALL {
            let s = Support::Nearest;
            if which == 1 {
                let sides = [64, 102, 161, 256];
                go::<1, 1>(0, r, set, sides, wave(r), 9999, s);
                go::<1, 1>(1, r, set, sides, wave(r), 9999, s);
                go::<1, 1>(2, r, set, sides, wave(r), 9999, s);
                go::<1, 1>(3, r, set, sides, wave(r), 9999, s);
            } else if which == 2 {
                let sides = [24, 38, 60, 96];
                go::<2, 1>(0, r, set, sides, wave(r), 600, s);
                go::<2, 2>(1, r, set, sides, wave(r), 600, s);
                go::<2, 3>(2, r, set, sides, wave(r), 600, s);
                go::<2, 4>(3, r, set, sides, wave(r), 600, s);
            } else {
                let sides = [16, 24, 36, 54];
                go::<3, 1>(0, r, set, sides, wave(r), 200, s);
                go::<3, 3>(1, r, set, sides, wave(r), 200, s);
                go::<3, 6>(2, r, set, sides, wave(r), 200, s);
                go::<3, 10>(3, r, set, sides, wave(r), 200, s);
            }
        }
    }
}
