//! Mesh to new particles.

use super::{Mesh, check_values};
use crate::apply::Field;
use crate::error::{MeshError, Result};
use crate::particles::{PARTICLES_HIGH, Particles, check_count, reserved};
use crate::scale::Volumes;

/// Particles made from a mesh; S is the strength of one particle, a number or an array of them.
#[derive(Clone, Debug)]
pub struct Remeshed<S, const D: usize> {
    /// The particles, in the order of the mesh, with the cell volume as their volumes.
    pub particles: Particles<D>,
    /// Their strengths omega_p, those of the mesh unchanged.
    pub strengths: Vec<S>,
    /// What was left on the mesh.
    pub dropped: Dropped<S>,
}

/// The strength of the mesh values that became no particle, so that kept and dropped add up to all of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dropped<S> {
    /// How many values.
    pub count: usize,
    /// Their sum.
    pub sum: S,
    /// The sum of their magnitudes.
    pub absolute: S,
}

impl<const D: usize> Mesh<D> {
    /// Makes a particle of every mesh value with |omega_ijk| > `threshold`, at its node or cell center.
    ///
    /// A threshold of 0 drops what is exactly 0. The strengths are those of the mesh, so that together with what was
    /// dropped they have its moments; a field value is u_p = omega_p / V_p.
    ///
    /// ```
    /// use parops::{Domain, Mesh};
    /// let mesh = Mesh::cells(&Domain::periodic([0.0], [2.0])?, [4])?;
    /// let remeshed = mesh.remesh(&[0.0, 3.0, -0.25, -1.0], 0.5)?;
    /// assert_eq!((remeshed.particles.points(), remeshed.strengths), (&[[0.75], [1.75]][..], vec![3.0, -1.0]));
    /// assert_eq!((remeshed.dropped.count, remeshed.dropped.sum), (2, -0.25));
    /// # parops::Result::Ok(())
    /// ```
    ///
    /// # Errors
    /// [`MeshError::Length`] where the values do not fit the mesh, [`MeshError::Value`] naming the first that is not
    /// finite, [`MeshError::Threshold`] for a threshold that is negative or not a number;
    /// [`ParticleError::TooMany`](crate::ParticleError::TooMany),
    /// [`ParticleError::Range`](crate::ParticleError::Range), [`ParticleError::Volume`](crate::ParticleError::Volume)
    /// and [`ParticleError::Memory`](crate::ParticleError::Memory) as for any set of particles.
    ///
    /// Source: notes 001, sec. 7.4.
    pub fn remesh<T: Field>(&self, values: &[T], threshold: T) -> Result<Remeshed<T, D>> {
        let Remeshed { particles, strengths, dropped } =
            self.remesh_fields(crate::apply::scalars(values), [threshold])?;
        let Dropped { count, sum: [sum], absolute: [absolute] } = dropped;
        let strengths = strengths.into_flattened();
        Ok(Remeshed { particles, strengths, dropped: Dropped { count, sum, absolute } })
    }

    /// As [`remesh`](Self::remesh) for F strengths per node, interleaved, with a threshold for each: a node is dropped
    /// where none of its strengths exceeds its threshold.
    ///
    /// # Errors
    /// As [`remesh`](Self::remesh).
    pub fn remesh_fields<T: Field, const F: usize>(
        &self,
        values: &[[T; F]],
        thresholds: [T; F],
    ) -> Result<Remeshed<[T; F], D>> {
        self.check_length(values.len())?;
        for (field, threshold) in thresholds.iter().enumerate() {
            if !(*threshold >= T::zero()) {
                return Err(MeshError::Threshold { field, threshold: threshold.as_() }.into());
            }
        }
        check_values(values)?;
        let keeps = |values: &[T; F]| values.iter().zip(&thresholds).any(|(value, &limit)| value.abs() > limit);
        let count = values.iter().filter(|values| keeps(values)).count();
        check_count(count, PARTICLES_HIGH)?;
        let (mut points, mut strengths) = (reserved(count)?, reserved(count)?);
        // In f64 also for f32, where a million small strengths would no longer add up.
        let (mut sum, mut absolute) = ([0.0; F], [0.0; F]);
        for (node, values) in values.iter().enumerate() {
            if keeps(values) {
                points.push(self.point(self.indices(node)));
                strengths.push(*values);
                continue;
            }
            for (field, value) in values.iter().enumerate() {
                let value: f64 = value.as_();
                sum[field] += value;
                absolute[field] += value.abs();
            }
        }
        let particles = Particles::new(points)?.with_volumes(Volumes::equal(self.cell_volume())?)?;
        let dropped = Dropped { count: values.len() - count, sum: sum.map(T::lift), absolute: absolute.map(T::lift) };
        Ok(Remeshed { particles, strengths, dropped })
    }
}
