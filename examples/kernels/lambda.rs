//! Remeshing kernels Lambda_{P,R} with their first two derivatives.

use parops::{Lambda, Result};

use crate::claim::{Claims, curve};
use crate::figure::{Axes, Curve, Mark};

const REACH: f64 = 5.0;

/// One panel a degree of the derivative, as far as the regularity goes.
pub fn panels(points: usize, claims: &mut Claims) -> Result<Vec<(Axes<'static>, Vec<Curve>)>> {
    let titles = [
        "Remeshing kernels Lambda_{P,R}, even in s",
        "first derivative, same colors",
        "second derivative, same colors",
    ];
    let mut panels: Vec<_> = titles.map(|title| (Axes { title, x: "s", y: "", logarithmic: false }, Vec::new())).into();
    let curves = panels.iter_mut().map(|(_, curves)| curves).collect::<Vec<_>>();
    let mut gallery = Gallery { points, claims, curves, color: 0 };
    gallery.add::<2, 1>()?;
    gallery.add::<2, 2>()?;
    gallery.add::<4, 2>()?;
    gallery.add::<4, 4>()?;
    gallery.add::<6, 4>()?;
    gallery.add::<6, 6>()?;
    gallery.add::<8, 4>()?;
    Ok(panels)
}

struct Gallery<'a> {
    points: usize,
    claims: &'a mut Claims,
    curves: Vec<&'a mut Vec<Curve>>,
    color: usize,
}

impl Gallery<'_> {
    fn add<const P: usize, const R: usize>(&mut self) -> Result<()> {
        let kernel = Lambda::<P, R>::new()?;
        let name = format!("({P},{R})");
        let off = |j: i32| (kernel.value(f64::from(j)) - f64::from(i32::from(j == 0))).abs();
        let interpolation = (-6..=6).map(off).fold(0.0, f64::max);
        // Powers of u = +-1/2 add up to the value at a node: a rounding for each of 2 R + 2.
        let nodes = (2 * R + 2) as f64 * f64::EPSILON;
        self.claims.equal(format!("Lambda {name}: largest miss at the nodes"), interpolation, 0.0, nodes);
        for (degree, curves) in self.curves.iter_mut().enumerate().take(R + 1) {
            let derivative = |s: f64| kernel.derivative(degree as u32, s).unwrap_or(f64::NAN);
            let miss = reproduction(P, degree, derivative);
            // Terms k^P Lambda^(m), |k| <= 5, of size 5^P times derivatives up to 10, with some ten roundings.
            let tolerance = 100.0 * 5.0_f64.powi(P as i32) * f64::EPSILON;
            let text = format!("Lambda {name}: largest miss of D^{degree} x^a, a = 0 to {P}");
            self.claims.equal(text, miss, 0.0, tolerance);
            let legend = if degree == 0 { name.clone() } else { String::new() };
            let points = curve(0.0, REACH, self.points, derivative);
            curves.push(Curve { name: legend, points, mark: Mark::Line, color: self.color });
        }
        self.color += 1;
        Ok(())
    }
}

/// The largest |sum_k k^a Lambda^(m)(x - k) - D^m x^a| for 0 <= a <= p over x in [0, 1].
fn reproduction(p: usize, m: usize, derivative: impl Fn(f64) -> f64) -> f64 {
    let mut largest = 0.0_f64;
    for x in (0..=16).map(|i| f64::from(i) / 16.0) {
        for a in 0..=p {
            let sum: f64 = (-6..=6).map(|k| f64::from(k).powi(a as i32) * derivative(x - f64::from(k))).sum();
            let factor: f64 = (0..m).map(|i| a as f64 - i as f64).product();
            let expected = if factor == 0.0 { 0.0 } else { factor * x.powi(a as i32 - m as i32) };
            largest = largest.max((sum - expected).abs());
        }
    }
    largest
}
