//! One method at work on one set.

use super::stopwatch::Seconds;

/// One method on one set: a row of a [`Table`](super::Table), a point of a curve.
///
/// A *series* is what differs in nothing but `n`, `h`, `epsilon`, `dt` and `steps`, see [`same_series`](Self::same_series).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sample {
    /// The problem: samples of one scene, dimension and set do the same work.
    pub scene: String,
    /// Number of dimensions.
    pub dim: usize,
    /// How particles are placed.
    pub set: String,
    /// The method.
    pub method: String,
    /// Its order; 0 where it has none.
    pub order: u32,
    /// The stepper; empty where nothing is stepped.
    pub stepper: String,
    /// The number type of fields and weights.
    pub scalar: String,
    /// Number of particles.
    pub n: usize,
    /// Neighbors per particle in the mean.
    pub neighbors: f64,
    /// Spacing.
    pub h: f64,
    /// Smoothing length, where the method has one.
    pub epsilon: Option<f64>,
    /// Time step, where there is one.
    pub dt: Option<f64>,
    /// Number of steps.
    pub steps: u64,
    /// Error in the L2 norm.
    pub error_l2: f64,
    /// Error in the maximum norm.
    pub error_linf: f64,
    /// The order observed against the sample before it in its series; [`Table::push`](super::Table::push) fills it.
    pub observed_order: Option<f64>,
    /// How long each phase took.
    pub seconds: Seconds,
    /// Most bytes in use at once, where they were counted.
    pub peak_bytes: Option<usize>,
}

impl Sample {
    /// A sample in `f64` of which no more is known than this.
    pub fn new(scene: &str, dim: usize, set: &str, method: &str, order: u32) -> Self {
        let [scene, set, method] = [scene, set, method].map(str::to_string);
        Self { scene, dim, set, method, order, scalar: "f64".to_string(), ..Self::default() }
    }

    /// Sets both errors, relative: sqrt(sum (c - e)^2 / sum e^2) and max |c - e| / max |e| of computed values c and exact
    /// ones e. Absolute where all e are zero.
    pub fn errors(&mut self, computed: impl IntoIterator<Item = f64>, exact: impl IntoIterator<Item = f64>) {
        let [mut squares, mut size, mut largest, mut highest] = [0.0_f64; 4];
        for (computed, exact) in computed.into_iter().zip(exact) {
            let error = (computed - exact).abs();
            squares += error * error;
            size += exact * exact;
            // A maximum would drop NaN.
            largest = if largest.is_nan() || error <= largest { largest } else { error };
            highest = highest.max(exact.abs());
        }
        let scaled = |error: f64, size: f64| if size > 0.0 { error / size } else { error };
        self.error_l2 = scaled(squares, size).sqrt();
        self.error_linf = scaled(largest, highest);
    }

    /// Whether both are of one scene, dimension, set, method, order, stepper and number type.
    pub fn same_series(&self, other: &Self) -> bool {
        self.same_task(other)
            && self.order == other.order
            && (&self.method, &self.stepper, &self.scalar) == (&other.method, &other.stepper, &other.scalar)
    }

    /// Whether both do the same work: one scene, dimension and set.
    pub fn same_task(&self, other: &Self) -> bool {
        (&self.scene, self.dim, &self.set) == (&other.scene, other.dim, &other.set)
    }

    /// Method, order, stepper and number type as far as they are worth naming, such as `DC-PSE 4 RK4`.
    pub fn label(&self) -> String {
        let mut label = self.method.clone();
        if self.order > 0 {
            label += &format!(" {}", self.order);
        }
        if !self.stepper.is_empty() {
            label += &format!(" {}", self.stepper);
        }
        if self.scalar != "f64" {
            label += &format!(" {}", self.scalar);
        }
        label
    }
}
