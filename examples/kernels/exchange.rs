//! Exchange kernels eta of the first three derivatives, and their slopes.

use num_dual::Dual64;
use parops::{Exchange, Kernel, MultiIndex, Result, Term, WideGaussian};

use crate::claim::{Claims, SMOOTH, curve, integral};
use crate::figure::{Axes, Curve, Mark};

const REACH: f64 = 4.0;

/// eta of the derivative of this degree, and its slope.
pub fn panels(degree: u8, points: usize, claims: &mut Claims) -> Result<Vec<(Axes<'static>, Vec<Curve>)>> {
    let title = match degree {
        1 => "Exchange kernels eta of d/dx",
        2 => "Exchange kernels eta of d2/dx2",
        _ => "Exchange kernels eta of d3/dx3",
    };
    let axes = [title, "eta', same colors"].map(|title| Axes { title, x: "z", y: "", logarithmic: false });
    let mut curves = [Vec::new(), Vec::new()];
    for (color, order) in [2, 4, 6, 8].into_iter().enumerate() {
        let kernel = Exchange::new(&[Term { index: MultiIndex::new([degree]), factor: 1.0 }], order)?;
        moments(&format!("beta = {degree}, r = {order}"), &kernel, u32::from(degree), order, claims);
        draw(&mut curves, &format!("r = {order}"), &kernel, points, color);
    }
    if degree == 2 {
        let wide = WideGaussian::<1>::new();
        moments("wide Gaussian", &wide, 2, 2, claims);
        draw(&mut curves, "wide, r = 2", &wide, points, 4);
    }
    Ok(axes.into_iter().zip(curves).collect())
}

fn draw<K>(curves: &mut [Vec<Curve>; 2], name: &str, kernel: &K, points: usize, color: usize)
where
    K: Kernel<f64, 1> + Kernel<Dual64, 1>,
{
    let [values, slopes] = curves;
    let value = curve(-REACH, REACH, points, |x| kernel.value(&[x]));
    values.push(Curve { name: name.into(), points: value, mark: Mark::Line, color });
    let slope = curve(-REACH, REACH, points, |x| slope(kernel, x));
    slopes.push(Curve { name: String::new(), points: slope, mark: Mark::Line, color });
}

/// The moments with a condition, and the same of the slope by parts: Int z^(n+1) eta' = -(n + 1) Int z^n eta.
fn moments<K>(name: &str, kernel: &K, degree: u32, order: u32, claims: &mut Claims)
where
    K: Kernel<f64, 1> + Kernel<Dual64, 1>,
{
    // Where exp(-z^2/4) is 1e-36.
    const FAR: f64 = 18.0;
    let factorial: f64 = (1..=degree).map(f64::from).product();
    let own = if degree.is_multiple_of(2) { factorial } else { -factorial };
    for n in 1..degree + order {
        let expected = if n == degree { own } else { 0.0 };
        let moment = integral(FAR, |z| z.powi(n as i32) * kernel.value(&[z]));
        // The absolute terms of the highest moment, |beta| + r - 1 = 10, are up to 1e4.
        claims.equal(format!("{name}: M_{n}"), moment, expected, 100.0 * SMOOTH);
    }
    let sum = integral(FAR, |z| z.powi(degree as i32 + 1) * slope(kernel, z));
    let expected = -f64::from(degree + 1) * own;
    claims.equal(format!("{name}: Int z^{} eta'", degree + 1), sum, expected, 100.0 * SMOOTH);
}

/// The derivative by dual numbers.
pub fn slope(kernel: &impl Kernel<Dual64, 1>, x: f64) -> f64 {
    kernel.value(&[Dual64::from_re(x).derivative()]).eps
}
