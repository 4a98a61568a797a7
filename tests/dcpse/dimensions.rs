//! DC-PSE in more dimensions than most need.

use parops::{Apply, DcPse, Domain, Gradient, Laplacian, Nearest, Particles, Random, testing::Promise};

/// Residuals of 1e-13 in scaled units over epsilon^2 of about 0.1, times values of some 10.
const EXACT: f64 = 1e-9;

fn quadratics_are_exact<const D: usize>() -> Result<(), parops::Error> {
    let mut random = Random::new(D as u64);
    let points = (0..400).map(|_| std::array::from_fn(|_| random.uniform())).collect();
    let particles = Particles::<D>::new(points)?;
    let f: Vec<f64> = particles.points().iter().map(|x| 1.0 + x[0] * x[D - 1] + 3.0 * x[1] * x[1]).collect();

    let laplacian = DcPse::<Laplacian<D>, 1>::new();
    let neighbors = Nearest::build(&particles, &Domain::open(), laplacian.fewest_neighbors::<D>()?)?;
    let mut out = vec![0.0; f.len()];
    laplacian.assemble(&neighbors)?.apply(&f, &mut out)?;
    let exact = Promise::new("Residuals", "Laplacian and gradient of quadratics in four to six dimensions");
    exact.at_most(EXACT, out.iter().map(|out| (out - 6.0).abs()).fold(0.0, f64::max));

    let gradient = DcPse::<Gradient<D>, 2>::new();
    let mut out = vec![[0.0; D]; f.len()];
    gradient.assemble(&neighbors)?.apply_all(&f, &mut out)?;
    for (x, out) in particles.points().iter().zip(&out) {
        let mut slope = [0.0; D];
        slope[0] += x[D - 1];
        slope[D - 1] += x[0];
        slope[1] += 6.0 * x[1];
        exact.at_most(EXACT, out.iter().zip(slope).map(|(out, slope)| (out - slope).abs()).fold(0.0, f64::max));
    }
    Ok(())
}

#[test]
fn quadratics_are_exact_in_four_to_six_dimensions() -> Result<(), parops::Error> {
    quadratics_are_exact::<4>()?;
    quadratics_are_exact::<5>()?;
    quadratics_are_exact::<6>()
}
