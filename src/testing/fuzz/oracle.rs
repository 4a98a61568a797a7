//! All pairs and all images by the expressions of the documentation, written down a second time.

use super::Checked;
use super::fault::close;
use super::scene::Scene;
use crate::domain::{Domain, Face};
use crate::neighbors::Neighbors;
use crate::stencil::Neighbor;

/// Rows up to a cutoff, found by looking at everything.
#[derive(Clone, Debug)]
pub(super) struct Oracle<const D: usize> {
    rows: Vec<Vec<(f64, Neighbor<D>)>>,
    sources: usize,
    domain: Domain<D>,
    particles: bool,
    cutoff: f64,
}

impl<const D: usize> Oracle<D> {
    /// Legal points in a legal box; the targets are points of their own, or the particles.
    pub(super) fn new(
        scene: &Scene<D>,
        domain: &Domain<D>,
        targets: Option<&[[f64; D]]>,
        points: &[[f64; D]],
        cutoff: f64,
    ) -> Checked<Self> {
        let sources = wrapped(scene, domain, points)?;
        let targets = targets.map(|targets| wrapped(scene, domain, targets)).transpose()?;
        let (particles, targets) = (targets.is_none(), targets.as_ref().unwrap_or(&sources));
        let mut rows = Vec::with_capacity(targets.len());
        for (p, target) in targets.iter().enumerate() {
            let mut row = Vec::new();
            for (q, source) in sources.iter().enumerate() {
                scene.images(target, source, |separation, sign, itself| {
                    let squared = separation.iter().fold(0.0, |sum, s| sum + s * s);
                    if squared <= cutoff * cutoff && !(itself && particles && p == q) {
                        row.push((squared, Neighbor { q, separation, sign }));
                    }
                });
            }
            rows.push(row);
        }
        Ok(Self { rows, sources: sources.len(), domain: *domain, particles, cutoff })
    }

    pub(super) fn row(&self, p: usize) -> impl Iterator<Item = &Neighbor<D>> {
        self.rows[p].iter().map(|(_, neighbor)| neighbor)
    }
}

impl<const D: usize> Neighbors<D> for Oracle<D> {
    fn targets(&self) -> usize {
        self.rows.len()
    }

    fn sources(&self) -> usize {
        self.sources
    }

    fn center(&self, p: usize) -> Option<usize> {
        self.particles.then_some(p)
    }

    fn cutoff(&self, _: usize) -> f64 {
        self.cutoff
    }

    fn reach(&self) -> f64 {
        self.cutoff
    }

    fn generation(&self) -> u64 {
        0
    }

    fn domain(&self) -> Option<&Domain<D>> {
        Some(&self.domain)
    }

    fn for_each(&self, p: usize, cutoff: f64, mut visit: impl FnMut(Neighbor<D>)) {
        let within = self.rows[p].iter().filter(|(squared, _)| *squared <= cutoff * cutoff);
        within.for_each(|&(_, neighbor)| visit(neighbor));
    }
}

impl<const D: usize> Scene<D> {
    /// Visits separation and sign of every image of a source, and whether it is the source itself.
    fn images(&self, target: &[f64; D], source: &[f64; D], mut visit: impl FnMut([f64; D], i8, bool)) {
        let along: [[Option<(f64, i8)>; 3]; D] = std::array::from_fn(|axis| {
            let (p, q, lower, upper) = (target[axis], source[axis], self.lower[axis], self.upper[axis]);
            let mirror = |face: Face, at: f64| match face {
                Face::MirrorEven => Some(((p - at) + (q - at), 1)),
                Face::MirrorOdd => Some(((p - at) + (q - at), -1)),
                Face::Periodic | Face::Open => None,
            };
            let [below, above] = match self.faces[axis] {
                [Face::Periodic, _] => [1.0, -1.0].map(|side| Some(((p - q) + side * (upper - lower), 1))),
                [below, above] => [mirror(below, lower), mirror(above, upper)],
            };
            [Some((p - q, 1)), below, above]
        });
        for number in 0..3_usize.pow(D as u32) {
            let mut rest = number;
            let chosen: [Option<(f64, i8)>; D] = std::array::from_fn(|axis| {
                let which = rest % 3;
                rest /= 3;
                along[axis][which]
            });
            if chosen.iter().all(Option::is_some) {
                let separation = chosen.map(|image| image.map_or(0.0, |(separation, _)| separation));
                let sign = chosen.iter().flatten().map(|(_, sign)| sign).product();
                visit(separation, sign, number == 0);
            }
        }
    }
}

/// The points in their box: unchanged where they are inside, else moved by widths of the periodic axes.
fn wrapped<const D: usize>(scene: &Scene<D>, domain: &Domain<D>, points: &[[f64; D]]) -> Checked<Vec<[f64; D]>> {
    let mut wrapped = Vec::with_capacity(points.len());
    for (p, point) in points.iter().enumerate() {
        let refused = |error| super::FuzzFault::Refused { build: "wrap", error };
        let inside = domain.wrap(point).map_err(refused)?;
        for axis in 0..D {
            let (from, to) = (point[axis], inside[axis]);
            let (lower, upper) = (scene.lower[axis], scene.upper[axis]);
            if scene.faces[axis][0] != Face::Periodic || (lower <= from && from < upper) {
                close("a coordinate that needs no wrapping", p, to, from, 0.0)?;
                continue;
            }
            close("a wrapped coordinate", p, to, to.clamp(lower, upper.next_down()), 0.0)?;
            let widths = ((from - to) / (upper - lower)).round();
            let tolerance = 8.0 * f64::EPSILON * (from.abs() + lower.abs() + upper.abs());
            close("a wrapped coordinate", p, to, from - widths * (upper - lower), tolerance)?;
        }
        wrapped.push(inside);
    }
    Ok(wrapped)
}
