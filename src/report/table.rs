//! Samples gathered.

use super::sample::Sample;
use super::task::Task;
use crate::error::{ReportError, Result};

/// Samples in the order they were added.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    samples: Vec<Sample>,
}

impl Table {
    /// Adds a sample, and returns it with the order observed against the last one of its series: by h where h differs, by
    /// dt where it is the same. An order that is already there stays.
    ///
    /// # Errors
    /// [`ReportError::Unnamed`] without scene, set, method or scalar; [`ReportError::Value`] for a number that is below
    /// zero or not finite (an observed order may be below zero). The table is then as it was.
    pub fn push(&mut self, mut sample: Sample) -> Result<&Sample> {
        self.check(&sample)?;
        if sample.observed_order.is_none() {
            let last = self.samples.iter().rev().find(|last| last.same_series(&sample));
            sample.observed_order = last.and_then(|last| {
                let errors = [last.error_l2, sample.error_l2];
                if last.h != sample.h {
                    return observed_order([last.h, sample.h], errors);
                }
                observed_order([last.dt?, sample.dt?], errors)
            });
        }
        let place = self.samples.len();
        self.samples.push(sample);
        Ok(&self.samples[place])
    }

    fn check(&self, new: &Sample) -> Result<()> {
        let sample = self.samples.len();
        let names = [("scene", &new.scene), ("set", &new.set), ("method", &new.method), ("scalar", &new.scalar)];
        if let Some((column, _)) = names.into_iter().find(|(_, name)| name.is_empty()) {
            return Err(ReportError::Unnamed { sample, column }.into());
        }
        let numbers = [
            ("neighbors", new.neighbors),
            ("h", new.h),
            ("epsilon", new.epsilon.unwrap_or(0.0)),
            ("dt", new.dt.unwrap_or(0.0)),
            ("error_l2", new.error_l2),
            ("error_linf", new.error_linf),
            ("observed_order", new.observed_order.map_or(0.0, f64::abs)),
            ("neighbor_s", new.seconds.neighbors),
            ("build_s", new.seconds.build),
            ("apply_s", new.seconds.apply),
            ("step_s", new.seconds.step),
        ];
        match numbers.into_iter().find(|(_, value)| !(*value >= 0.0 && value.is_finite())) {
            Some((column, value)) => Err(ReportError::Value { sample, column, value }.into()),
            None => Ok(()),
        }
    }

    /// All samples.
    pub fn samples(&self) -> &[Sample] {
        &self.samples
    }

    /// The scenes, each once, in the order of their first samples.
    pub fn scenes(&self) -> Vec<&str> {
        let mut scenes: Vec<&str> = Vec::new();
        for sample in &self.samples {
            if !scenes.contains(&sample.scene.as_str()) {
                scenes.push(&sample.scene);
            }
        }
        scenes
    }

    /// The samples by scene, dimension and set, in the order of their first samples.
    pub fn tasks(&self) -> Vec<Task<'_>> {
        let mut tasks: Vec<Task> = Vec::new();
        for sample in &self.samples {
            match tasks.iter_mut().find(|task| task.samples()[0].same_task(sample)) {
                Some(task) => task.add(sample),
                None => tasks.push(Task::new(sample)),
            }
        }
        tasks
    }
}

/// ln(e_0 / e_1) / ln(s_0 / s_1): the order in the size s (spacing, step) that two errors e show.
///
/// `None` where it is not a finite number, as for equal sizes or an error of zero.
pub fn observed_order(sizes: [f64; 2], errors: [f64; 2]) -> Option<f64> {
    let order = (errors[0] / errors[1]).ln() / (sizes[0] / sizes[1]).ln();
    order.is_finite().then_some(order)
}
