//! One evaluation of the Laplacian, the gradient and a mixed third derivative in 1D to 3D on four kinds of sets.
//!
//! SPH and PSE keep h/epsilon and are applied without stored weights, DC-PSE makes rows and applies them once, finite
//! differences know where their neighbors are. Errors are relative, over all particles of the unit torus.

use std::error::Error;
use std::f64::consts::TAU;

use parops::report::{Phase, Sample, Stopwatch, observed_order};
use parops::{
    Allowance, CellList, Cutoff, DcPse, Domain, Epsilon, Gaussian, MatrixFree, Method, Nearest, Neighbors, Particles,
    Pse, Sign, Sph, SphForm,
};

use crate::bench::Bench;
use crate::finite_difference::Differences;
use crate::operators::{Terms, wave};
use crate::sets::Set;

/// epsilon over the spacing: the least that is legal for every operator and order.
const OVERLAP: f64 = 2.0;
/// The same on scattered sets in 3D: less, so that a torus of 12 particles along an axis is two cutoffs wide.
const SCATTERED_3D: f64 = 1.35;
/// Where kernels are cut in 2D and 3D, in units of epsilon: what is lost is below 1e-9 and 1e-5 of the largest weight.
const SUPPORT: [f64; 3] = [f64::INFINITY, 5.0, 4.4];

/// Shares of r between which observed orders must be, where the grids are fine enough (1D) and in 2D and 3D.
const ORDERS: [(f64, f64); 2] = [(0.85, 1.1), (0.75, 1.1)];
/// What PSE of fixed overlap stays below on scattered sets.
const STANDING: f64 = 1.0;
const PHASES: &str = "Build makes rows; of SPH and PSE it makes kernels and checks every row, and apply makes the rows again and \
    applies them. Differences know their neighbors.";
const LIMITS: &str = "On lattices PSE and SPH have epsilon = 2 h and break no limit of the crate. No scattered set keeps the moments \
    that they ask for: there they run with Allowance::Everywhere, and in 3D with epsilon = 1.35 h, h/epsilon = 0.74, which is \
    above the limits of 0.5 to 0.667 too: what their curves show there is what the crate refuses unless it is told not to.";
const REACH: &str = "DC-PSE takes the fewest neighbors that it asks for, but on the lattice all within (m + r)/2 spacings, m the \
    degree of the operator. Where the fewest reach less far, as 250 for the Laplacian of order 6 in 3D do, they have so few \
    values of a coordinate that conditions repeat each other (3 of 119), Cholesky finds no pivot, and each row goes through \
    pivoted QR: right, but 50 times as long as with 256.";

pub fn run(bench: &mut Bench) -> Result<(), Box<dyn Error>> {
    for operator in ["laplacian", "gradient", "mixed_third"] {
        for text in [PHASES, LIMITS, REACH] {
            bench.note(&format!("derivatives_{operator}"), text);
        }
    }
    for set in Set::ALL {
        all::<1>(bench, set)?;
        all::<2>(bench, set)?;
        all::<3>(bench, set)?;
    }
    claims(bench);
    Ok(())
}

/// Differences and DC-PSE must show their orders: the last in one dimension, where the grids are fine enough, above rounding,
/// that over all refinements in others. PSE of fixed overlap must not on scattered sets, as its documentation says: its
/// error is that of the sums from order 4 on. In 3D its two sets are too coarse to tell.
fn claims(bench: &mut Bench) {
    let mut found = Vec::new();
    for task in bench.table.tasks() {
        let Sample { scene, dim, set, .. } = task.samples()[0];
        let (operator, dim) = (scene.trim_start_matches("derivatives_").replace('_', " "), *dim);
        let [mut low, mut high, mut pse] = [f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY];
        let mut seen = 0;
        for series in task.series().iter().filter(|series| series.len() > 1) {
            let (first, last) = (series[0], series[series.len() - 1]);
            let whole = observed_order([first.h, last.h], [first.error_l2, last.error_l2]);
            match (first.method.as_str(), first.order) {
                ("FD" | "DC-PSE", order) => {
                    let above = series.iter().rev().find(|sample| sample.error_l2 > rounding(sample.h));
                    let observed = if dim == 1 { above.and_then(|sample| sample.observed_order) } else { whole };
                    // What terms of higher order take on coarse sets is in proportion to r.
                    if let Some(observed) = observed {
                        let share = observed / f64::from(order);
                        (low, high) = (low.min(share), high.max(share));
                        seen += 1;
                    }
                }
                ("PSE", 4..) if dim < 3 => pse = pse.max(whole.unwrap_or(f64::INFINITY)),
                _ => {}
            }
        }
        if seen > 0 {
            let (least, most) = ORDERS[usize::from(dim > 1)];
            let text = format!(
                "{operator}, {dim}D, {set}: observed orders of DC-PSE and differences are {low:.2} to {high:.2} times r, \
                 above {least} and below {most}"
            );
            let enough = seen >= if dim == 1 { 3 } else { 2 };
            found.push((scene.clone(), enough && low > least && high < most, text));
        }
        if set != Set::Lattice.name() && pse > f64::NEG_INFINITY {
            let text = format!(
                "{operator}, {dim}D, {set}: PSE 4 to 8 of fixed overlap have observed orders up to {pse:.2}, below {STANDING}"
            );
            found.push((scene.clone(), pse < STANDING, text));
        }
    }
    found.into_iter().for_each(|(scene, holds, text)| bench.claim(&scene, holds, text));
}

/// Errors below this are not asked for their order: a third derivative multiplies rounding by (2 pi h)^-3, and the weights
/// of high orders on scattered sets add up to hundreds in units of h^-3.
fn rounding(h: f64) -> f64 {
    1000.0 * f64::EPSILON / (TAU * h).powi(3)
}

fn all<const D: usize>(bench: &mut Bench, set: Set) -> parops::Result<()> {
    operator::<D, 1>(bench, set, "derivatives_laplacian", &Terms::laplacian())?;
    operator::<D, D>(bench, set, "derivatives_gradient", &Terms::gradient())?;
    operator::<D, 1>(bench, set, "derivatives_mixed_third", &Terms::mixed_third())
}

/// Particles along an axis.
///
/// Kernels and the stencils of high orders must not reach across half the torus: in 3D it has 12 particles along an axis at
/// least, with kernels on the lattice 18, and on clustered sets, whose spacings go up to 1.6 times the mean, 20, in 2D 32.
fn sides(quick: bool, set: Set, dim: usize, method: &str, order: u32) -> &'static [usize] {
    let thin = set == Set::Clustered && (method != "DC-PSE" || order > 4);
    match (quick, dim, method) {
        (true, 1, _) => &[64, 128, 256],
        (false, 1, _) => &[64, 128, 256, 512, 1024],
        (true, 2, "PSE" | "SPH") => &[32],
        (true, 2, _) => &[24, 40],
        (false, 2, _) if thin => &[32, 40, 56, 80],
        (false, 2, _) => &[28, 40, 56, 80],
        (true, _, "PSE" | "SPH") if set == Set::Lattice && order < 4 => &[18],
        (true, _, "PSE") if set == Set::Lattice => &[],
        (false, _, "PSE" | "SPH") if set == Set::Lattice => &[18, 24],
        (true, _, "DC-PSE") if set == Set::Lattice && order < 8 => &[12],
        (true, ..) if thin || order > 4 => &[],
        (true, ..) => &[12],
        (false, ..) if thin => &[20],
        (false, _, "DC-PSE") if order < 4 => &[12, 16, 20, 26],
        (false, _, "DC-PSE") if order < 6 || set == Set::Lattice => &[12, 16, 20],
        (false, _, "DC-PSE") => &[12, 16],
        (false, ..) if set == Set::Lattice => &[12, 16, 20],
        (false, ..) => &[12, 16],
    }
}

/// Every method and order for one operator on one kind of set.
fn operator<const D: usize, const K: usize>(
    bench: &mut Bench,
    set: Set,
    scene: &str,
    operator: &Terms<D, K>,
) -> parops::Result<()> {
    let quick = bench.quick;
    let methods = [("SPH", 2)].into_iter().chain([2, 4, 6, 8].into_iter().flat_map(|r| [("PSE", r), ("DC-PSE", r)]));
    let classical = [2, 4, 6, 8].map(|r| ("FD", r));
    let methods = methods.chain(classical.into_iter().filter(|_| set == Set::Lattice));
    for (method, order) in methods {
        for &side in sides(quick, set, D, method, order) {
            let (particles, spacings) = set.particles::<D>(side)?;
            let points = particles.points();
            let f: Vec<f64> = points.iter().map(wave).collect();
            let exact: Vec<[f64; K]> = points.iter().map(|x| operator.exact(x)).collect();
            let case = Case { operator, order, set, side, particles: &particles, spacings: &spacings, f: &f };
            let what = Sample {
                n: points.len(),
                h: 1.0 / side as f64,
                epsilon: matches!(method, "PSE" | "SPH").then(|| overlap(set, D) / side as f64),
                ..Sample::new(scene, D, set.name(), method, order)
            };
            bench.sample(what, |watch, sample| {
                let mut out = vec![[0.0; K]; f.len()];
                sample.neighbors = match method {
                    "SPH" => case.sph(watch, &mut out)?,
                    "PSE" => case.pse(watch, &mut out)?,
                    "DC-PSE" => case.dcpse(watch, &mut out)?,
                    _ => case.classical(watch, &mut out)?,
                };
                sample.errors(out.iter().flatten().copied(), exact.iter().flatten().copied());
                Ok(())
            })?;
        }
    }
    Ok(())
}

/// epsilon over the spacing.
fn overlap(set: Set, dim: usize) -> f64 {
    if dim < 3 || set == Set::Lattice { OVERLAP } else { SCATTERED_3D }
}

/// One method on one set.
struct Case<'a, const D: usize, const K: usize> {
    operator: &'a Terms<D, K>,
    order: u32,
    set: Set,
    side: usize,
    particles: &'a Particles<D>,
    spacings: &'a [f64],
    f: &'a [f64],
}

impl<const D: usize, const K: usize> Case<'_, D, K> {
    fn sph(&self, watch: &Stopwatch, out: &mut [[f64; K]]) -> parops::Result<f64> {
        let sph = watch.time(Phase::Build, || {
            let sph =
                Sph::new(self.operator.clone(), Gaussian::<D>::new(), self.epsilon()?, self.particles.volumes()?)?;
            let sph = sph.form(SphForm::Difference)?.allow(self.allowance());
            if D > 1 { sph.support(SUPPORT[D - 1]) } else { Ok(sph) }
        })?;
        self.matrix_free(watch, &sph, sph.cutoff(), out)
    }

    fn pse(&self, watch: &Stopwatch, out: &mut [[f64; K]]) -> parops::Result<f64> {
        let pse = watch.time(Phase::Build, || {
            let pse = Pse::new(self.operator.clone(), self.order, self.epsilon()?, self.particles.volumes()?)?;
            // Differences, since sums with f_p need moments that scattered sets do not have.
            let pse = pse.sign(Sign::Minus)?.allow(self.allowance());
            if D > 1 { pse.support(SUPPORT[D - 1]) } else { Ok(pse) }
        })?;
        self.matrix_free(watch, &pse, pse.cutoff(), out)
    }

    fn dcpse(&self, watch: &Stopwatch, out: &mut [[f64; K]]) -> parops::Result<f64> {
        let dcpse = DcPse::at_order(self.operator.clone(), self.order)?;
        let needed = dcpse.fewest_neighbors::<D>()?.max(self.unisolvent()?);
        let nearest = watch.time(Phase::Neighbors, || Nearest::build(self.particles, &torus()?, needed))?;
        let rows = watch.time(Phase::Build, || dcpse.assemble(&nearest))?;
        watch.time(Phase::Apply, || rows.apply_all(self.f, out))?;
        Ok(rows.report().pairs as f64 / self.f.len() as f64)
    }

    fn classical(&self, watch: &Stopwatch, out: &mut [[f64; K]]) -> parops::Result<f64> {
        let differences = watch.time(Phase::Build, || Differences::new(self.operator, self.order as usize, self.side));
        watch.time(Phase::Apply, || differences.apply(self.f, out));
        Ok(differences.nodes() as f64)
    }

    fn epsilon(&self) -> parops::Result<Epsilon> {
        Epsilon::each(self.spacings.iter().map(|h| overlap(self.set, D) * h).collect())
    }

    /// No scattered set keeps the moments of PSE and SPH; lattices do.
    fn allowance(&self) -> Allowance {
        if self.set == Set::Lattice { Allowance::Nowhere } else { Allowance::Everywhere }
    }

    /// How many neighbors a lattice has within k = (m + r)/2 spacings, 0 for other sets: they have 2 k + 1 values of a
    /// coordinate, and a polynomial of degree m + r - 1 that is zero at them all is zero. With fewer, conditions repeat.
    fn unisolvent(&self) -> parops::Result<usize> {
        if self.set != Set::Lattice {
            return Ok(0);
        }
        let degree = self.operator.list().iter().map(|(_, index, _)| index.degree()).max().unwrap_or(0);
        // The outermost are in, however they round.
        let reach = (f64::from((degree + self.order) / 2) + 1e-6) / self.side as f64;
        Ok(CellList::build(self.particles, &torus()?, Cutoff(reach))?.count(0, reach))
    }

    /// Rows made, checked, made again and applied: cheaper than storing them where they serve once.
    fn matrix_free<M: Method<D, Out = [f64; K]>>(
        &self,
        watch: &Stopwatch,
        method: &M,
        cutoff: Cutoff,
        out: &mut [[f64; K]],
    ) -> parops::Result<f64> {
        let cells = watch.time(Phase::Neighbors, || CellList::build(self.particles, &torus()?, cutoff))?;
        let operator = watch.time(Phase::Build, || MatrixFree::new(method, &cells))?;
        watch.time(Phase::Apply, || operator.apply_all(self.f, out))?;
        Ok(operator.report().pairs as f64 / self.f.len() as f64)
    }
}

fn torus<const D: usize>() -> parops::Result<Domain<D>> {
    Domain::periodic([0.0; D], [1.0; D])
}
