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
    /// ones e. Absolute where all e are zero; NaN, which no [`Table`](super::Table) takes, where there are not as many of
    /// both, or none.
    pub fn errors(&mut self, computed: impl IntoIterator<Item = f64>, exact: impl IntoIterator<Item = f64>) {
        let [computed, exact]: [Vec<f64>; 2] = [computed.into_iter().collect(), exact.into_iter().collect()];
        if computed.len() != exact.len() || exact.is_empty() {
            [self.error_l2, self.error_linf] = [f64::NAN; 2];
            return;
        }
        let errors: Vec<f64> = computed.iter().zip(&exact).map(|(computed, exact)| computed - exact).collect();
        let relative = |norm: fn(&[f64]) -> f64| {
            let (error, size) = (norm(&errors), norm(&exact));
            if size > 0.0 { error / size } else { error }
        };
        self.error_l2 = relative(euclidean);
        self.error_linf = relative(largest);
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

/// max |x|; a maximum of f64 would drop NaN.
fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |largest: f64, x| if largest.is_nan() || x.abs() <= largest { largest } else { x.abs() })
}

/// sqrt(sum x^2), with no square that overflows or vanishes.
fn euclidean(values: &[f64]) -> f64 {
    let scale = largest(values);
    if !(scale > 0.0 && scale.is_finite()) {
        return scale;
    }
    scale * values.iter().map(|x| (x / scale).powi(2)).sum::<f64>().sqrt()
}
