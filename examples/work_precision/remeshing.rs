//! One remeshing of carried particles by every kernel: what the mesh then misses of the field.
//!
//! The particles of a lattice are carried by a wave of shear that moves them by some spacings, as a flow does in one step:
//! along x and then along y, so that volumes stay. Each has the strength of the field where it is; the mesh values are
//! compared with the field at the nodes. Errors are relative, over all nodes of the unit torus.

use std::error::Error;
use std::f64::consts::TAU;

use parops::report::{Phase, Sample};
use parops::{Cic, Domain, Lambda, Mesh, MeshKernel, Ngp, Particles, Tsc};

use crate::bench::Bench;
use crate::operators::wave;

const SCENE: &str = "remeshing";
/// How far particles are carried, in spacings: the mean, and the wave on top of it.
const MEAN: [f64; 3] = [1.3, -0.8, 0.6];
const WAVE: f64 = 0.1;

/// Exactness of the kernels in the order they are run.
const KERNELS: [f64; 10] = [0.0, 1.0, 1.0, 2.0, 2.0, 4.0, 4.0, 6.0, 6.0, 8.0];
/// Relative errors below this are not asked for their order.
const ROUNDING: f64 = 1e-12;
/// How far an observed order may be from the expected one.
const BAND: f64 = 0.3;
const PHASES: &str =
    "Build makes the kernel, apply puts particles onto the mesh and makes new ones of its nodes. Nothing is searched.";

pub fn run(bench: &mut Bench) -> Result<(), Box<dyn Error>> {
    bench.note(SCENE, PHASES);
    let sides: [&[usize]; 2] =
        if bench.quick { [&[32, 64, 96], &[24, 32]] } else { [&[32, 64, 96, 128], &[24, 32, 48]] };
    each::<2>(bench, sides[0])?;
    each::<3>(bench, sides[1])?;
    claims(bench);
    Ok(())
}

fn each<const D: usize>(bench: &mut Bench, sides: &[usize]) -> parops::Result<()> {
    kernel::<D, _, 1>(bench, sides, "NGP", || Ok(Ngp))?;
    kernel::<D, _, 2>(bench, sides, "CIC", || Ok(Cic))?;
    kernel::<D, _, 3>(bench, sides, "TSC", || Ok(Tsc))?;
    kernel::<D, _, 4>(bench, sides, "Lambda 2 1", Lambda::<2, 1>::new)?;
    kernel::<D, _, 4>(bench, sides, "Lambda 2 2", Lambda::<2, 2>::new)?;
    kernel::<D, _, 6>(bench, sides, "Lambda 4 2", Lambda::<4, 2>::new)?;
    kernel::<D, _, 6>(bench, sides, "Lambda 4 4", Lambda::<4, 4>::new)?;
    kernel::<D, _, 8>(bench, sides, "Lambda 6 4", Lambda::<6, 4>::new)?;
    kernel::<D, _, 8>(bench, sides, "Lambda 6 6", Lambda::<6, 6>::new)?;
    kernel::<D, _, 10>(bench, sides, "Lambda 8 4", Lambda::<8, 4>::new)
}

fn kernel<const D: usize, K: MeshKernel<f64, S>, const S: usize>(
    bench: &mut Bench,
    sides: &[usize],
    name: &str,
    make: fn() -> parops::Result<K>,
) -> parops::Result<()> {
    for &side in sides {
        let h = 1.0 / side as f64;
        let torus = Domain::periodic([0.0; D], [1.0; D])?;
        let mesh = Mesh::cells(&torus, [side; D])?;
        let lattice = Particles::lattice([0.0; D], [1.0; D], [side; D])?;
        let carried = lattice.points().iter().map(|x| torus.wrap(&carry(x, h))).collect::<parops::Result<Vec<_>>>()?;
        let strengths: Vec<f64> = carried.iter().map(|x| wave(x) * mesh.cell_volume()).collect();
        let exact: Vec<f64> = mesh.points().map(|x| wave(&x)).collect();
        let neighbors = (S as f64).powi(D as i32);
        let what = Sample { n: exact.len(), h, neighbors, ..Sample::new(SCENE, D, "carried lattice", name, 0) };
        bench.sample(what, |watch, sample| {
            let kernel = watch.time(Phase::Build, make)?;
            let mut values = vec![0.0; mesh.len()];
            watch.time(Phase::Apply, || {
                mesh.deposit(&kernel, &carried, &strengths, &mut values)?;
                mesh.remesh(&values, 0.0)
            })?;
            // NGP leaves nodes empty, which are no particles: the error is over all nodes.
            let volume = mesh.cell_volume();
            sample.errors(values.iter().map(|strength| strength / volume), exact.iter().copied());
            Ok(())
        })?;
    }
    Ok(())
}

/// Where a particle is carried: each axis is sheared along the next, one after the other.
fn carry<const D: usize>(x: &[f64; D], h: f64) -> [f64; D] {
    let mut x = *x;
    for axis in 0..D {
        let along = x[(axis + 1) % D];
        x[axis] += h * (MEAN[axis] + WAVE * (TAU * along + axis as f64).sin());
    }
    x
}

/// The order in L2 is P + 1 for a kernel of exactness P, whose moments leave h^(P+1).
///
/// A strain of h also moves particles across the breaks of the kernel, of class C^R, at h of all nodes, each of which misses
/// h^(R+1): h^(R+3/2) in the end, which is far below at these strains. With waves of 1.5 spacings what kernels of high exactness
/// leave of the strain hides the order: they fall by 2^11 and more to where rounding is left.
fn claims(bench: &mut Bench) {
    let mut found = Vec::new();
    for task in bench.table.tasks().iter().filter(|task| task.samples()[0].scene == SCENE) {
        for (series, exactness) in task.series().iter().zip(KERNELS) {
            let last = series[series.len() - 1];
            let above = series.iter().rev().find(|sample| sample.error_l2 > ROUNDING);
            let observed = above.and_then(|sample| sample.observed_order).unwrap_or(f64::NAN);
            let order = exactness + 1.0;
            let holds = (observed - order).abs() < BAND;
            let (dim, method) = (last.dim, &last.method);
            found.push((holds, format!("{dim}D, {method}: observed order {observed:.2}, within {BAND} of {order}")));
        }
    }
    found.into_iter().for_each(|(holds, text)| bench.claim(SCENE, holds, text));
}
