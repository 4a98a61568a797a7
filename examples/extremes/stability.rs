//! Eigenvalues of advection and diffusion on jittered sets over the stability regions of the steppers.
//!
//! The regions are drawn from amplification factors: one step of u' = lambda u by the stepper itself.

use std::error::Error;
use std::path::Path;

use nalgebra::Complex;
use parops::{
    DcPse, Euler, Hyperviscosity, Laplacian, Limit, Limits, Nearest, Rate, Result, Rk4, Rkl2, Rows, Spacing,
    SpectrumEstimator, SspRk3, StepLimit, Stepper,
};

use crate::case::Duty::{Adapt, Detect, Prevent};
use crate::case::{Case, Entry};
use crate::dense::{eigenvalues, matrix};
use crate::failures::{sets, spectra};
use crate::figure::{Axes, Curve, Mark};
use crate::grid;
use crate::page::Figure;

type C = Complex<f64>;

pub const ENTRIES: [Entry; 2] = [
    Entry {
        number: 1,
        title: "diffusion over the stability regions",
        duties: &[Prevent, Detect],
        not_offered: None,
        scene: diffusion,
    },
    Entry {
        number: 2,
        title: "advection over the stability regions",
        duties: &[Detect, Adapt],
        not_offered: None,
        scene: advection,
    },
];

/// Particles along an axis.
const M: usize = 12;
const H: f64 = 1.0 / M as f64;
const N: usize = M * M;
const JITTER: f64 = 0.3;
/// |Im| over |Re| of the eigenvalues that RKL2 is held to where rows are not symmetric.
const SLOPE: f64 = 0.2;

/// R(z) of u' = z u by one step of size 1.
fn factor(stepper: &mut dyn Stepper<Vec<f64>>, z: C) -> Result<f64> {
    let mut u = vec![1.0, 0.0];
    stepper.reset();
    stepper.step(0.0, 1.0, &mut u, &mut |_, u, du| {
        du.copy_from_slice(&[z.re * u[0] - z.im * u[1], z.re * u[1] + z.im * u[0]]);
        Ok(())
    })?;
    Ok(u[0].hypot(u[1]))
}

/// The largest |R(dt lambda)|.
fn largest(stepper: &mut dyn Stepper<Vec<f64>>, values: &[C], dt: f64) -> Result<f64> {
    let mut most = 0.0_f64;
    for z in values {
        most = most.max(factor(stepper, z * C::new(dt, 0.0))?);
    }
    Ok(most)
}

/// Where |R| = 1 on the rays from a point of the region.
fn rays(stepper: &mut dyn Stepper<Vec<f64>>, from: f64) -> Result<Vec<(f64, f64)>> {
    let mut boundary = Vec::new();
    for i in 0..=240 {
        let angle = f64::from(i) / 240.0 * std::f64::consts::TAU;
        let at = |r: f64| C::new(from + r * angle.cos(), r * angle.sin());
        let (mut inside, mut outside) = (0.0, 0.02);
        while factor(stepper, at(outside))? <= 1.0 {
            (inside, outside) = (outside, outside + 0.02);
        }
        for _ in 0..20 {
            let middle = 0.5 * (inside + outside);
            if factor(stepper, at(middle))? <= 1.0 { inside = middle } else { outside = middle }
        }
        boundary.push((at(inside).re, at(inside).im));
    }
    Ok(boundary)
}

/// The same for a region along the negative axis: the first crossing above every point, and its mirror image.
fn columns(stepper: &mut dyn Stepper<Vec<f64>>, low: f64) -> Result<Vec<(f64, f64)>> {
    let mut above = Vec::new();
    for i in 0..=300 {
        let x = low * f64::from(i) / 300.0;
        let mut y = 0.0;
        while y < 60.0 && factor(stepper, C::new(x, y + 0.02))? <= 1.0 {
            y += 0.02;
        }
        above.push((x, y));
    }
    let below: Vec<(f64, f64)> = above.iter().rev().map(|(x, y)| (*x, -y)).collect();
    above.extend(below);
    Ok(above)
}

struct Spectra {
    /// Of the Laplacian.
    diffusion: Vec<C>,
    /// Rows of the Laplacian.
    laplacian: Rows,
    /// Of -v . grad, without and with hyperviscosity.
    bare: Vec<C>,
    damped: Vec<C>,
    gamma: f64,
    /// What the library names for the damped operator.
    limits: Limits,
}

impl Spectra {
    fn measure() -> Result<Self> {
        let particles = sets::square(M, JITTER, 2)?;
        let torus = sets::torus()?;
        let wide = Nearest::build(&particles, &torus, 18)?;
        let laplacian = DcPse::<Laplacian<2>, 2>::new().assemble(&wide)?;
        let gradient = spectra::gradient()?.assemble(&Nearest::build(&particles, &torus, 14)?)?;
        let velocities = vec![spectra::VELOCITY; N];
        let mut damping = Hyperviscosity::new(&laplacian, 2, Spacing(H), 0.0)?;
        let estimator = SpectrumEstimator::new();
        let tuning = damping.tune(&estimator, &velocities, |u, du| spectra::advect(&gradient, u, du), 1e-3)?;
        damping.set_gamma(tuning.gamma)?;
        let bare = eigenvalues(&matrix(N, |u, du| spectra::advect(&gradient, u, du)));
        let damped = eigenvalues(&matrix(N, |u, du| {
            spectra::advect(&gradient, u, du)?;
            damping.add(&velocities, u, du)
        }));
        let diffusion = eigenvalues(&matrix(N, |u, du| parops::Apply::apply(&laplacian, u, du)));
        let radius = estimator.estimate(N, |u, du| {
            spectra::advect(&gradient, u, du)?;
            damping.add(&velocities, u, du)
        })?;
        // Modes anywhere to the left within the radius, and a thousandth for its accuracy.
        let mut limits = Limits::default();
        limits.add(Limit::Hyperviscosity, Rate::modulus(1.001 * radius.radius));
        Ok(Self { diffusion, laplacian, bare, damped, gamma: tuning.gamma, limits })
    }
}

type Named = (&'static str, Box<dyn Stepper<Vec<f64>>>);

fn explicit() -> [Named; 3] {
    [("Euler", Box::new(Euler::new())), ("SSP-RK3", Box::new(SspRk3::new())), ("RK4", Box::new(Rk4::new()))]
}

fn steppers() -> Result<Vec<Named>> {
    let mut all: Vec<Named> = explicit().into();
    all.push(("RKL2 of 8 stages", Box::new(Rkl2::new(8)?)));
    Ok(all)
}

/// Diffusion at and beyond its limits.
fn diffusion(case: &mut Case, _: bool) -> std::result::Result<(), Box<dyn Error>> {
    case.setup(format!("DC-PSE Laplacian of order 2, {M}x{M} particles, jitter {JITTER} h: all {N} eigenvalues, at the step from the rows' bound and at the sharp one"));
    let Spectra { mut diffusion, laplacian, .. } = Spectra::measure()?;
    // Constants stay as they are: their eigenvalue is zero, and rounding all that is found of it.
    diffusion.sort_by(|a, b| a.norm().total_cmp(&b.norm()));
    let constants = diffusion.remove(0).norm();
    let sharp = SpectrumEstimator::new().of(&laplacian)?.radius;
    let (mut at, mut sharply, mut beyond) = (0.0_f64, 0.0_f64, f64::INFINITY);
    let mut text = Vec::new();
    for (name, mut stepper) in steppers()? {
        let bound = StepLimit::from_spectral_bound(laplacian.report().spectral_bound, 1.0)?.step(stepper.as_ref());
        let limit = StepLimit::from_spectral_bound(sharp, 1.0)?.step(stepper.as_ref());
        at = at.max(largest(stepper.as_mut(), &diffusion, bound)?);
        sharply = sharply.max(largest(stepper.as_mut(), &diffusion, 0.999 * limit)?);
        let above = largest(stepper.as_mut(), &diffusion, 1.02 * limit)?;
        beyond = beyond.min(above);
        text.push(format!("{name} {above:.3}"));
    }
    case.naive(
        beyond > 1.0 + 1e-3,
        format!("at 1.02 of the sharp limit the largest factor of a step is: {}", text.join(", ")),
    );
    case.prevents(
        at < 1.0,
        format!(
            "all but constants (of which {:.0e} of the radius is found) inside at the limit of the rows' bound: the largest factor is {at:.6}",
            constants / sharp
        ),
    );
    case.detects(
        sharply < 1.0 && constants < 1e-11 * sharp,
        format!(
            "all but those inside at 0.999 of the sharp limit, of the estimated radius {:.2}/h^2: {sharply:.6}",
            sharp * H * H
        ),
    );
    Ok(())
}

/// Advection without and with hyperviscosity.
fn advection(case: &mut Case, _: bool) -> std::result::Result<(), Box<dyn Error>> {
    case.setup("-v . grad by DC-PSE of order 2 ('-', 14 neighbors), |v| = 1, the same particles, without and with hyperviscosity");
    let Spectra { bare, damped, gamma, limits, .. } = Spectra::measure()?;
    let radius = bare.iter().fold(0.0_f64, |most, z| most.max(z.norm()));
    let right = |values: &[C]| values.iter().fold(f64::NEG_INFINITY, |most, z| most.max(z.re)) * H;
    let mut least = f64::INFINITY;
    let mut text = Vec::new();
    for (name, mut stepper) in explicit() {
        for share in [0.01, 0.1, 1.0] {
            least = least.min(largest(stepper.as_mut(), &bare, share / radius)?);
        }
        text.push(format!("{name} {:.3}", largest(stepper.as_mut(), &bare, 1.0 / radius)?));
    }
    case.naive(
        least > 1.0 + 1e-4,
        format!("outside at every step: largest factors at dt |lambda| = 1: {}", text.join(", ")),
    );
    case.detects(right(&bare) > 0.05, format!("max Re(lambda) h = {:.3}", right(&bare)));
    for (name, mut stepper) in explicit().into_iter().skip(1) {
        let limit = limits.step(stepper.as_ref());
        let (at, beyond) =
            (largest(stepper.as_mut(), &damped, limit)?, largest(stepper.as_mut(), &damped, 3.0 * limit)?);
        // What the search for gamma leaves, max Re(lambda) h = 1e-3, may grow.
        case.adapts(
            at <= 1.0 + 1.1e-3 * limit / H && beyond > 1.01,
            format!("gamma = {gamma:.3}, {name}: max Re(lambda) h = {:.0e}, the largest factor 1 {:+.0e} at the limit dt = {:.2} h, {beyond:.2} at three of them", right(&damped), at - 1.0, limit / H),
        );
    }
    Ok(())
}

fn scaled(values: &[C], dt: f64, name: &str, mark: Mark, color: usize) -> Curve {
    Curve { name: name.into(), points: values.iter().map(|z| (dt * z.re, dt * z.im)).collect(), mark, color }
}

fn region(name: &str, points: Vec<(f64, f64)>, color: usize) -> Curve {
    Curve { name: name.into(), points, mark: Mark::Line, color }
}

fn axes(title: &str) -> Axes<'_> {
    Axes { title, x: "Re(dt lambda)", y: "Im(dt lambda)", logarithmic: false }
}

/// Width over height of the inside of a panel, in pixels.
const PROPORTION: f64 = 1.27;

/// The curves, and two unseen corners of a frame in which both axes have one scale.
fn equally(mut curves: Vec<Curve>) -> Vec<Curve> {
    let points = || curves.iter().flat_map(|curve| &curve.points);
    let range = |of: fn(&(f64, f64)) -> f64| {
        points().map(of).fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)))
    };
    let ((left, right), (low, high)) = (range(|p| p.0), range(|p| p.1));
    let height = (high - low).max((right - left) / PROPORTION);
    let (x, y) = (0.5 * (left + right), 0.5 * (low + high));
    for side in [-0.5, 0.5] {
        curves.push(region("", vec![(x + side * PROPORTION * height, y + side * height)], 0));
    }
    curves
}

/// The region of super time stepping with the eigenvalues at its limit, and its wedge if it has one. It is far longer than high:
/// its axes have scales of their own.
fn super_steps<'a>(
    mut stages: Rkl2<Vec<f64>>,
    title: &'a str,
    values: &[C],
    radius: f64,
) -> Result<(Axes<'a>, Vec<Curve>)> {
    let interval = stages.negative_real_interval();
    let whole = Rkl2::<Vec<f64>>::new(stages.stages())?.negative_real_interval();
    let mut curves = vec![
        region("RKL2", columns(&mut stages, -whole)?, 4),
        scaled(values, StepLimit::from_spectral_bound(radius, 1.0)?.step(&stages), "dt of RKL2", Mark::CirclesAlone, 5),
    ];
    let ends = [1.0, -1.0].map(|side| (-interval, side * SLOPE * interval));
    if interval < whole {
        let wedge = vec![ends[0], (0.0, 0.0), ends[1]];
        curves.push(Curve { name: "wedge of slope 0.2".into(), points: wedge, mark: Mark::Dashed, color: 7 });
    }
    Ok((axes(title), curves))
}

/// The figures, written to the folder and returned for the page.
pub fn figures(out: &Path) -> std::result::Result<Vec<Figure>, Box<dyn Error>> {
    let Spectra { diffusion, laplacian, bare, damped, limits, .. } = Spectra::measure()?;
    let radius = SpectrumEstimator::new().of(&laplacian)?.radius;
    let mut of_explicit = Vec::new();
    for (i, ((name, mut stepper), from)) in explicit().into_iter().zip([-1.0, -1.2, -1.4]).enumerate() {
        of_explicit.push(region(name, rays(stepper.as_mut(), from)?, i));
    }
    let sharp = |stepper: &dyn Stepper<Vec<f64>>| -> Result<f64> {
        Ok(StepLimit::from_spectral_bound(radius, 1.0)?.step(stepper))
    };
    let regions = || of_explicit.iter().map(|curve| region(&curve.name, curve.points.clone(), curve.color));
    let mut first: Vec<Curve> = regions().collect();
    let (euler, rk4) = (sharp(&Euler::new())?, sharp(&Rk4::new())?);
    first.push(scaled(&diffusion, euler, "dt of Euler", Mark::CirclesAlone, 3));
    let mut second: Vec<Curve> = regions().collect();
    second.push(scaled(&diffusion, 1.1 * rk4, "1.1 dt of RK4", Mark::CirclesAlone, 1));
    let path = out.join("extremes_diffusion_spectra.svg");
    let panels = vec![
        (axes("Diffusion at the limit of Euler"), equally(first)),
        (axes("and above that of RK4"), equally(second)),
        super_steps(Rkl2::new(8)?, "RKL2 of 8 stages on the axis", &diffusion, radius)?,
        super_steps(Rkl2::new(16)?.with_slope(SLOPE)?, "of 16 in a wedge, as for DC-PSE", &diffusion, radius)?,
    ];
    grid::draw(&path, 2, panels)?;
    let limit = limits.step(&Rk4::<Vec<f64>>::new());
    let panel = |values: &[C], name: &str| {
        let mut curves: Vec<Curve> = regions().collect();
        curves.push(scaled(values, limit, name, Mark::CirclesAlone, 3));
        equally(curves)
    };
    let other = out.join("extremes_advection_spectra.svg");
    let panels = vec![
        (axes("Advection without hyperviscosity"), panel(&bare, "-v . grad at the limit of RK4")),
        (axes("Advection with hyperviscosity"), panel(&damped, "-v . grad at the limit of RK4")),
    ];
    grid::draw(&other, 2, panels)?;
    let caption = |operator: &str| {
        format!("Eigenvalues of {operator} on {M}x{M} particles, jitter {JITTER} h, over the stability regions")
    };
    Ok(vec![
        Figure { caption: caption("diffusion"), svg: std::fs::read_to_string(path)? },
        Figure { caption: caption("advection"), svg: std::fs::read_to_string(other)? },
    ])
}
