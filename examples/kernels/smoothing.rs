//! Smoothing kernels W with W' and W''.

use parops::{
    CubicSpline, Gaussian, HighOrderGaussian, MultiIndex, QuinticSpline, Result, SmoothingKernel, WendlandC2,
    WendlandC4, WendlandC6,
};

use crate::claim::{Claims, KINKS, curve, integral};
use crate::figure::{Axes, Curve, Mark};

const REACH: f64 = 4.0;

/// One panel a degree of the derivative.
pub fn panels(points: usize, claims: &mut Claims) -> Result<Vec<(Axes<'static>, Vec<Curve>)>> {
    let kernels: [(&str, Box<dyn SmoothingKernel<f64, 1>>); 7] = [
        ("Gaussian", Box::new(Gaussian::new())),
        ("order 4", Box::new(HighOrderGaussian::new(4)?)),
        ("cubic spline", Box::new(CubicSpline::new())),
        ("quintic spline", Box::new(QuinticSpline::new())),
        ("Wendland C2", Box::new(WendlandC2::new())),
        ("Wendland C4", Box::new(WendlandC4::new())),
        ("Wendland C6", Box::new(WendlandC6::new())),
    ];
    let titles = ["Smoothing kernels W", "W', same colors", "W'', same colors"];
    let mut panels: Vec<_> = titles.map(|title| (axes(title), Vec::new())).into();
    for (color, (name, kernel)) in kernels.iter().enumerate() {
        for ((degree, (_, curves)), moment) in panels.iter_mut().enumerate().zip([1.0, -1.0, 2.0]) {
            let beta = MultiIndex::new([degree as u8]);
            // Every degree up to 2 exists.
            kernel.derivative(beta, &[0.0])?;
            let derivative = |x: f64| kernel.derivative(beta, &[x]).unwrap_or(f64::NAN);
            let sum = integral(kernel.support(), |x| x.powi(degree as i32) * derivative(x));
            claims.equal(format!("{name}: Int x^{degree} D^{degree} W"), sum, moment, KINKS);
            let legend = if degree == 0 { *name } else { "" };
            let points = curve(-REACH, REACH, points, derivative);
            curves.push(Curve { name: legend.into(), points, mark: Mark::Line, color });
        }
    }
    Ok(panels)
}

fn axes(title: &'static str) -> Axes<'static> {
    Axes { title, x: "z", y: "", logarithmic: false }
}
