//! One-sided kernels of both sides, and their slopes.

use parops::{Kernel, MultiIndex, OneSidedGaussian, Result, Side, Term};

use crate::claim::{Claims, KINKS, curve, integral};
use crate::exchange::slope;
use crate::figure::{Axes, Curve, Mark};

const REACH: f64 = 3.0;

/// eta of the derivative of this degree on both sides, and its slope on the left side.
pub fn panels(degree: u8, points: usize, claims: &mut Claims) -> Result<Vec<(Axes<'static>, Vec<Curve>)>> {
    let title = match degree {
        1 => "One-sided eta of d/dx, left (lines), right (dashed)",
        _ => "One-sided eta of d2/dx2, left (lines), right (dashed)",
    };
    let axes = [title, "eta', left, same colors"].map(|title| Axes { title, x: "z", y: "", logarithmic: false });
    let mut curves = [Vec::new(), Vec::new()];
    for (color, order) in (1..=3).enumerate() {
        for side in [Side::Left, Side::Right] {
            let term = Term { index: MultiIndex::new([degree]), factor: 1.0 };
            let kernel = OneSidedGaussian::<1>::new(term, side, order)?;
            let (name, mark, low) = match side {
                Side::Left => (format!("r = {order}"), Mark::Line, 0.0),
                Side::Right => (String::new(), Mark::Dashed, -REACH),
            };
            check(&kernel, u32::from(degree), claims);
            let value = curve(low, low + REACH, points, |x| kernel.value(&[x]));
            curves[0].push(Curve { name, points: value, mark, color });
            if side == Side::Left {
                // From the right of the kink.
                let value = curve(1e-9, REACH, points, |x| slope(&kernel, x));
                curves[1].push(Curve { name: String::new(), points: value, mark: Mark::Line, color });
            }
        }
    }
    Ok(axes.into_iter().zip(curves).collect())
}

/// The moments with a condition; nothing lies on the other side.
fn check(kernel: &OneSidedGaussian<1>, degree: u32, claims: &mut Claims) {
    let (order, side) = (Kernel::<f64, 1>::order(kernel), kernel.side());
    let factorial: f64 = (1..=degree).map(f64::from).product();
    for n in 1..degree + order {
        let expected = if n == degree { if n.is_multiple_of(2) { factorial } else { -factorial } } else { 0.0 };
        let moment = integral(8.0, |z| z.powi(n as i32) * kernel.value(&[z]));
        claims.equal(format!("one-sided beta = {degree}, r = {order}, {side:?}: M_{n}"), moment, expected, KINKS);
    }
    let other = if side == Side::Left { -1.0 } else { 1.0 };
    let strays = integral(8.0, |z| if z * other > 0.0 { kernel.value(&[z]).abs() } else { 0.0 });
    claims.equal(format!("one-sided beta = {degree}, r = {order}, {side:?}: other side"), strays, 0.0, 0.0);
}
