//! Slabs of the mesh, each written by one thread.

use rayon::prelude::*;

use super::Mesh;
use crate::error::Result;
use crate::particles::{PARTICLES_HIGH, check_count, reserved};

/// The mesh cut across its first axis. A slab takes its share of every particle that reaches it, in the order of the
/// particles, so that neither the number of slabs nor that of threads shows in the bits.
pub(super) struct Slabs {
    /// Planes per slab, at least as many as a stencil has; the last slab may have fewer.
    thickness: usize,
    planes: usize,
    /// Values per plane.
    plane: usize,
}

impl Slabs {
    /// `None` where one thread does as well.
    pub(super) fn new<const D: usize>(mesh: &Mesh<D>, plane: usize, nodes: usize) -> Option<Self> {
        const PER_THREAD: usize = 4;
        let (threads, planes) = (rayon::current_num_threads(), mesh.counts[0]);
        // Particles at the seam of two slabs are placed twice.
        let thickness = planes.div_ceil(PER_THREAD * threads).max(4 * nodes);
        (threads > 1 && thickness < planes).then_some(Self { thickness, planes, plane })
    }

    /// Calls `add(p, first, values)` for every slab a particle reaches, with the values of the slab and the index of
    /// the first of them; `locate` gives the first plane of the `nodes` that a coordinate along the first axis reaches.
    pub(super) fn each<V: Send, const D: usize>(
        &self,
        out: &mut [V],
        locate: impl Fn(f64) -> i64 + Sync,
        nodes: usize,
        points: &[[f64; D]],
        add: impl Fn(usize, usize, &mut [V]) + Sync,
    ) -> Result<()> {
        check_count(points.len(), PARTICLES_HIGH)?;
        let reached = |x: &[f64; D]| self.reached(locate(x[0]), nodes);
        let mut ends = vec![0_usize; self.planes.div_ceil(self.thickness)];
        for x in points {
            reached(x).for_each(|slab| ends[slab] += 1);
        }
        let mut total = 0;
        for end in &mut ends {
            (*end, total) = (total, total + *end);
        }
        let mut lists: Vec<u32> = reserved(total)?;
        lists.resize(total, 0);
        for (p, x) in points.iter().enumerate() {
            for slab in reached(x) {
                lists[ends[slab]] = p as u32;
                ends[slab] += 1;
            }
        }
        let size = self.thickness * self.plane;
        out.par_chunks_mut(size).enumerate().for_each(|(slab, out)| {
            let start = if slab == 0 { 0 } else { ends[slab - 1] };
            for &p in &lists[start..ends[slab]] {
                add(p as usize, slab * size, out);
            }
        });
        Ok(())
    }

    /// The slabs of `nodes` planes from `first` on, each once.
    fn reached(&self, first: i64, nodes: usize) -> impl Iterator<Item = usize> {
        let slabs = self.planes.div_ceil(self.thickness);
        let planes = self.planes as i64;
        let [start, end] = [first, first + nodes as i64 - 1].map(|plane| plane.rem_euclid(planes) as usize);
        let (first_slab, last_slab) = (start / self.thickness, end / self.thickness);
        // Across the seam of a periodic axis: the slabs from the first to the last, and slab 0, which is thick enough to
        // hold the end.
        let count = if start <= end { last_slab - first_slab + 1 } else { slabs - first_slab + first_slab.min(1) };
        (first_slab..first_slab + count).map(move |slab| slab % slabs)
    }
}
