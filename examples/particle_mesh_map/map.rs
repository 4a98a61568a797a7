//! Clouds of particles and their density maps.

use parops::{ErrorKind, Mesh, MeshError, MeshKernel, Random, Result};

/// Standard deviation of the clouds.
const SIGMA: f64 = 3.0;

/// Particles as they were drawn, each of mass 1/N.
pub struct Cloud {
    pub points: Vec<[f64; 2]>,
    gaussian: bool,
}

impl Cloud {
    /// One particle anywhere that all kernels reach.
    pub fn single(mesh: &Mesh<2>, seed: u64) -> Self {
        let mut random = Random::new(seed);
        let margin = [0, 1].map(|axis| 2.5 * mesh.spacings()[axis]);
        let (lower, widths) = (mesh.domain().lower(), mesh.domain().widths());
        let place = |axis: usize| lower[axis] + margin[axis] + random.uniform() * (widths[axis] - 2.0 * margin[axis]);
        Self { points: vec![[0, 1].map(place)], gaussian: false }
    }

    /// N particles around the origin.
    pub fn gaussian(count: usize, seed: u64) -> Self {
        let mut random = Random::new(seed);
        Self { points: (0..count).map(|_| [0; 2].map(|_| SIGMA * random.normal())).collect(), gaussian: true }
    }

    /// The density the cloud was drawn from; nowhere finite for one particle.
    pub fn density(&self, x: &[f64; 2]) -> Option<f64> {
        let square = (x[0] * x[0] + x[1] * x[1]) / (SIGMA * SIGMA);
        self.gaussian.then(|| (-0.5 * square).exp() / (std::f64::consts::TAU * SIGMA * SIGMA))
    }

    /// Its density map, of the particles that may be mapped.
    pub fn map<const S: usize>(
        &self,
        kernel_name: &'static str,
        mesh: &Mesh<2>,
        kernel: &impl MeshKernel<f64, S>,
    ) -> Result<Map> {
        let (lower, upper, h) = (mesh.domain().lower(), mesh.domain().upper(), mesh.spacings());
        let mut accepted = Vec::new();
        for x in &self.points {
            if (0..2).any(|axis| x[axis] < lower[axis] + h[axis] || x[axis] > upper[axis] - h[axis]) {
                continue;
            }
            match mesh.stencil(kernel, x) {
                Ok(_) => accepted.push(*x),
                Err(error) if matches!(error.kind(), ErrorKind::Mesh(MeshError::Support { .. })) => {}
                Err(error) => return Err(error),
            }
        }
        let mass = 1.0 / self.points.len() as f64;
        let mut density = vec![0.0; mesh.len()];
        mesh.deposit(kernel, &accepted, &vec![mass; accepted.len()], &mut density)?;
        let cell = mesh.cell_volume();
        density.iter_mut().for_each(|density| *density /= cell);

        let share = accepted.len() as f64;
        let center = |axis: usize| {
            let of_map: f64 = mesh.points().zip(&density).map(|(x, density)| x[axis] * density * cell).sum();
            of_map / (share * mass) - accepted.iter().map(|x| x[axis]).sum::<f64>() / share
        };
        let exact: Option<Vec<f64>> = mesh.points().map(|x| self.density(&x)).collect();
        let error = exact.map(|exact| {
            let differences = || density.iter().zip(&exact).map(|(density, exact)| (density - exact).abs());
            let norm = exact.iter().map(|exact| exact * exact).sum::<f64>();
            let l2 = (differences().map(|difference| difference * difference).sum::<f64>() / norm).sqrt();
            let largest = exact.iter().copied().fold(0.0, f64::max);
            [l2, differences().fold(0.0, f64::max) / largest]
        });
        Ok(Map {
            kernel: kernel_name,
            drawn: self.points.len(),
            rejected: self.points.len() - accepted.len(),
            mass: density.iter().sum::<f64>() * cell,
            off_center: center(0).hypot(center(1)),
            lowest: density.iter().copied().fold(f64::INFINITY, f64::min),
            error,
            density,
        })
    }
}

/// One density map and what is known of it.
pub struct Map {
    pub kernel: &'static str,
    /// Number of particles N, and how many of them are not in the map.
    pub drawn: usize,
    pub rejected: usize,
    /// The integral of the density.
    pub mass: f64,
    /// How far its center of mass is from that of the particles.
    pub off_center: f64,
    /// The smallest density.
    pub lowest: f64,
    /// Relative L2 error against the exact density at cell centers, and the largest error over the largest density.
    pub error: Option<[f64; 2]>,
    pub density: Vec<f64>,
}

impl Map {
    pub const TITLE: &'static str =
        "         N  kernel      rejected         mass  mass - share  off center     lowest   L2 error  largest";
    pub const HEADER: &'static str = "n,kernel,rejected,mass,mass_defect,off_center,lowest_density,l2_error,linf_error";

    /// The mass of the map beyond that of its particles.
    pub fn defect(&self) -> f64 {
        self.mass - (self.drawn - self.rejected) as f64 / self.drawn as f64
    }

    pub fn row(&self) -> String {
        let error = self.error.map_or(String::new(), |[l2, largest]| format!("{l2:>11.4}{largest:>9.4}"));
        format!(
            "{:>10}  {:<10}{:>10}{:>13.6}{:>14.1e}{:>12.1e}{:>11.2e}{error}",
            self.drawn,
            self.kernel,
            self.rejected,
            self.mass,
            self.defect(),
            self.off_center,
            self.lowest
        )
    }

    pub fn csv(&self) -> String {
        let error = self.error.map_or(",".into(), |[l2, largest]| format!("{l2:e},{largest:e}"));
        let kernel = self.kernel.replace(',', "_");
        format!(
            "{},{kernel},{},{:.17e},{:e},{:e},{:e},{error}",
            self.drawn,
            self.rejected,
            self.mass,
            self.defect(),
            self.off_center,
            self.lowest
        )
    }
}
