//! What must hold of the maps.

use crate::map::Map;

/// The claims, and whether each holds.
pub fn check(maps: &[Map]) -> Vec<(bool, String)> {
    // Rounding of a sum of up to 10 000 masses that add up to 1, each spread over 36 cells.
    const MASS: f64 = 1e-13;
    // The same for centers, of up to 10 in size.
    const CENTER: f64 = 1e-12;
    let of = |kernel: &'static str| maps.iter().filter(move |map| map.kernel == kernel);
    let largest = |figure: &dyn Fn(&Map) -> f64| maps.iter().map(figure).fold(0.0, f64::max);

    let defect = largest(&|map| map.defect().abs());
    let mut claims = vec![(defect <= MASS, format!("all maps have the mass of their particles: {defect:.1e}"))];

    let exact = maps.iter().filter(|map| map.kernel != "NGP").map(|map| map.off_center).fold(0.0, f64::max);
    let nearest = of("NGP").map(|map| map.off_center).fold(0.0, f64::max);
    let text = format!("CIC, TSC and Lambda_4,2 keep the center of mass: {exact:.1e}, NGP does not: {nearest:.2}");
    claims.push((exact <= CENTER && nearest > CENTER, text));

    let positive = maps.iter().filter(|map| map.kernel != "Lambda_4,2").all(|map| map.lowest >= 0.0);
    let lowest = of("Lambda_4,2").map(|map| map.lowest).fold(f64::INFINITY, f64::min);
    let text = format!("NGP, CIC and TSC are nowhere negative, Lambda_4,2 goes down to {lowest:.3}");
    claims.push((positive && lowest < 0.0, text));

    for kernel in ["NGP", "CIC", "TSC", "Lambda_4,2"] {
        let clouds: Vec<(f64, f64)> =
            of(kernel).filter_map(|map| map.error.map(|[l2, _]| (map.drawn as f64, l2))).collect();
        let [(few, coarse), (many, fine)] = clouds[..] else {
            claims.push((false, format!("{kernel}: two clouds were expected, not {}", clouds.len())));
            continue;
        };
        // The noise of independent particles; the smoothing of the wider kernels does not fall with N.
        let slope = (fine / coarse).ln() / (many / few).ln();
        let text = format!("{kernel}: the L2 error falls as N^{slope:.2}, from {coarse:.3} to {fine:.3}");
        claims.push(((-0.65..=-0.3).contains(&slope), text));
    }
    claims
}
