//! Kernels against a table of 60 digits, in units of eps times the sum of absolute terms. In ulps: `ulps.rs`.
//!
//! The table lies in `data/kernel_values.json` and is made by `data/kernel_values.py` beside it. Its arguments have full
//! mantissas, so the square of none is exact. The absolute terms are those of the polynomial before the exponential:
//!
//! - the monomials of the exchange kernels, of the anisotropic ones and of the Hermite polynomials, sum_alpha |p_alpha z^alpha|;
//! - for derivatives of the identity kernels the terms of the sum over k that [`HighOrderGaussian`] states, each power of
//!   |z|^2 by itself;
//! - the powers along the axis and across of the one-sided kernels;
//! - for splines and Wendland functions the terms of sum_k z^(beta - 2k) g_m(r), g_m = ((1/2r) d/dr)^m W: every truncated
//!   power with its g_m, below r = 1 of a spline, where the poles of these cancel, every monomial in r; for D > 1, where
//!   r is rounded, with r |dg_m/dr| more;
//! - the powers of u = t - 1/2 of the mesh kernels.
//!
//! In single precision the reference is the value in double precision at the argument rounded first.

use parops::{
    AnisotropicGaussian, Cic, CubicSpline, Exchange, Gaussian, HighOrderGaussian, Kernel, Lambda, LatticeHat,
    MeshKernel, MultiIndex, Ngp, OneSidedGaussian, QuinticSpline, RationalLaplacian, Side, SmoothingKernel, Term, Tsc,
    WendlandC2, WendlandC4, WendlandC6, WideGaussian, testing::Promise,
};
use serde_json::Value;

/// Largest errors that are allowed, in units.
const VALUE_BOUND: f64 = 4.0;
const DERIVATIVE_BOUND: f64 = 8.0;

/// A value as the table gives it: `head` + `tail`, with the size of its terms.
struct Entry {
    head: f64,
    tail: f64,
    size: f64,
}

impl Entry {
    fn new(entry: &Value) -> Self {
        let number = |i: usize| entry[i].as_f64().expect("a number");
        Self { head: number(0), tail: number(1), size: number(2) }
    }

    /// The error of `found` in units; infinite for any error where all terms vanish.
    fn units(&self, found: f64, eps: f64) -> f64 {
        let error = ((found - self.head) - self.tail).abs();
        if error == 0.0 { 0.0 } else { error / (eps * self.size) }
    }
}

/// The largest errors of one kernel.
#[derive(Default)]
struct Largest {
    value: f64,
    derivative: f64,
    value_single: f64,
    derivative_single: f64,
    entries: usize,
}

/// One kernel of the table, with its points.
struct Section<'a, const D: usize> {
    name: String,
    entry: &'a Value,
    points: Vec<[f64; D]>,
}

impl<'a, const D: usize> Section<'a, D> {
    fn new(table: &'a Value, entry: &'a Value) -> Self {
        let points = &table["points"][entry["points"].as_str().expect("a list of points")];
        let point = |point: &Value| std::array::from_fn(|axis| point[axis].as_f64().expect("a coordinate"));
        assert!(points.is_array(), "no such points");
        let setting = |key: &str| match &entry[key] {
            Value::Null => String::new(),
            Value::String(text) => format!(" {text}"),
            other => format!(" {key} = {other}"),
        };
        let keys = ["dim", "kernel", "operator", "degree", "order", "side", "exactness", "regularity"];
        Self {
            name: keys.map(setting).concat(),
            entry,
            points: points.as_array().expect("points").iter().map(point).collect(),
        }
    }

    /// The entry must refuse a value that is off by one unit more than allowed, and the value found must pass.
    fn compare(&self, entry: &Entry, found: f64, eps: f64, bound: f64, at: &str) -> f64 {
        let off = entry.head + (bound + 1.0) * eps * entry.size + f64::MIN_POSITIVE;
        assert!(entry.units(off, eps) > bound, "{} {at}: {:e} cannot fail", self.name, entry.head);
        let units = entry.units(found, eps);
        if units <= bound {
            return units;
        }
        println!("{} {at}: {found:e} is {units:.2} units from {:e}", self.name, entry.head);
        if units.is_nan() { f64::INFINITY } else { units }
    }

    fn values(&self, kernel: &(impl Kernel<f64, D> + Kernel<f32, D>), largest: &mut Largest) {
        let entries: Vec<_> = self.entry["values"].as_array().expect("values").iter().map(Entry::new).collect();
        assert_eq!(entries.len(), self.points.len());
        let mut many = vec![0.0_f64; self.points.len()];
        kernel.values(&self.points, &mut many);
        for ((entry, z), many) in entries.into_iter().zip(&self.points).zip(many) {
            let at = format!("at {z:?}");
            assert_eq!(many, kernel.value(z), "{} {at}: alone and among others", self.name);
            largest.value = largest.value.max(self.compare(&entry, many, f64::EPSILON, VALUE_BOUND, &at));
            let short = z.map(|x| x as f32);
            let reference = Entry { head: kernel.value(&short.map(f64::from)), tail: 0.0, ..entry };
            let single = f64::from(Kernel::<f32, D>::value(kernel, &short));
            let units = self.compare(&reference, single, f32::EPSILON.into(), VALUE_BOUND, &format!("{at} in f32"));
            largest.value_single = largest.value_single.max(units);
            largest.entries += 1;
        }
    }

    fn smoothing<K>(&self, kernel: &K, largest: &mut Largest)
    where
        K: SmoothingKernel<f64, D> + SmoothingKernel<f32, D>,
    {
        self.values(kernel, largest);
        self.derivatives(kernel, largest);
    }

    fn derivatives<K>(&self, kernel: &K, largest: &mut Largest)
    where
        K: SmoothingKernel<f64, D> + SmoothingKernel<f32, D>,
    {
        for (beta, entries) in self.entry["derivatives"].as_object().expect("derivatives") {
            let exponents: Vec<u8> = beta.split(',').map(|n| n.parse().expect("an exponent")).collect();
            let index = MultiIndex::<D>::new(exponents.try_into().expect("an exponent an axis"));
            let entries = entries.as_array().expect("entries");
            // Every other point.
            assert_eq!(entries.len(), self.points.len().div_ceil(2));
            for (entry, z) in entries.iter().map(Entry::new).zip(self.points.iter().step_by(2)) {
                let at = format!("({beta}) at {z:?}");
                let found: f64 = kernel.derivative(index, z).expect("smooth");
                let units = self.compare(&entry, found, f64::EPSILON, DERIVATIVE_BOUND, &at);
                largest.derivative = largest.derivative.max(units);
                if index.degree() == 1 {
                    let axis = index.exponents().iter().position(|&n| n == 1).expect("degree 1");
                    let gradient: [f64; D] = kernel.gradient(z).expect("smooth");
                    let units = self.compare(&entry, gradient[axis], f64::EPSILON, DERIVATIVE_BOUND, &at);
                    largest.derivative = largest.derivative.max(units);
                }
                let short = z.map(|x| x as f32);
                let head: f64 = kernel.derivative(index, &short.map(f64::from)).expect("smooth");
                let reference = Entry { head, tail: 0.0, ..entry };
                let single: f32 = kernel.derivative(index, &short).expect("smooth");
                let at = format!("{at} in f32");
                let units = self.compare(&reference, single.into(), f32::EPSILON.into(), DERIVATIVE_BOUND, &at);
                largest.derivative_single = largest.derivative_single.max(units);
                largest.entries += 1;
            }
        }
    }
}

impl Section<'_, 1> {
    /// Lambda at distances, with its derivatives.
    fn interpolation<const P: usize, const R: usize>(&self, kernel: &Lambda<P, R>, largest: &mut Largest) {
        let entries = |entries: &Value| entries.as_array().expect("entries").iter().map(Entry::new).collect::<Vec<_>>();
        for (degree, step) in (0..=R as u32).map(|degree| (degree, if degree == 0 { 1 } else { 2 })) {
            let values =
                if degree == 0 { &self.entry["values"] } else { &self.entry["derivatives"][&degree.to_string()] };
            let bound = if degree == 0 { VALUE_BOUND } else { DERIVATIVE_BOUND };
            let entries = entries(values);
            assert_eq!(entries.len(), self.points.len().div_ceil(step));
            for (entry, &[s]) in entries.into_iter().zip(self.points.iter().step_by(step)) {
                let at = format!("derivative {degree} at {s}");
                let found: f64 = kernel.derivative(degree, s).expect("regular");
                let double = self.compare(&entry, found, f64::EPSILON, bound, &at);
                let short = s as f32;
                let head: f64 = kernel.derivative(degree, f64::from(short)).expect("regular");
                let single: f32 = kernel.derivative(degree, short).expect("regular");
                let reference = Entry { head, tail: 0.0, ..entry };
                let single =
                    self.compare(&reference, single.into(), f32::EPSILON.into(), bound, &format!("{at} in f32"));
                let (most, most_single) = match degree {
                    0 => (&mut largest.value, &mut largest.value_single),
                    _ => (&mut largest.derivative, &mut largest.derivative_single),
                };
                (*most, *most_single) = (most.max(double), most_single.max(single));
                largest.entries += 1;
            }
        }
    }

    /// The weights of a mesh kernel at the offsets of the table.
    fn weights<const S: usize>(&self, table: &Value, kernel: &impl MeshKernel<f64, S>, largest: &mut Largest) {
        let offsets = table["points"]["offsets"].as_array().expect("offsets");
        let rows = self.entry["weights"].as_array().expect("weights");
        assert_eq!(rows.len(), offsets.len());
        for (row, u) in rows.iter().zip(offsets) {
            let u = u[0].as_f64().expect("an offset");
            let row = row.as_array().expect("weights");
            assert_eq!(row.len(), S);
            for (entry, found) in row.iter().map(Entry::new).zip(kernel.weights(u)) {
                let units = self.compare(&entry, found, f64::EPSILON, VALUE_BOUND, &format!("weights at {u}"));
                largest.value = largest.value.max(units);
                largest.entries += 1;
            }
        }
    }
}

fn terms<const D: usize>(operator: &str) -> Vec<Term<D>> {
    let term = |axes: &[usize]| {
        let mut exponents = [0; D];
        axes.iter().for_each(|&axis| exponents[axis] += 1);
        Term { index: MultiIndex::new(exponents), factor: 1.0 }
    };
    match operator {
        "identity" => vec![term(&[])],
        "d_dz1" => vec![term(&[0])],
        "laplacian" => (0..D).map(|axis| term(&[axis, axis])).collect(),
        "d2_dz1dz1" => vec![term(&[0, 0])],
        "d2_dz1dz2" => vec![term(&[0, 1])],
        other => panic!("unknown operator {other}"),
    }
}

/// Kernels that stand for one dimension alone, if this is one.
fn measure_one_dimensional(table: &Value, entry: &Value) -> Option<(String, Largest)> {
    let mut largest = Largest::default();
    let name = entry["kernel"].as_str().expect("a kernel");
    if !matches!(name, "Lambda" | "Ngp" | "Cic" | "Tsc") {
        return None;
    }
    let section = Section::<1>::new(table, entry);
    macro_rules! lambda {
        ($p:literal, $r:literal) => {{
            let kernel = Lambda::<$p, $r>::new().expect("a small kernel");
            section.interpolation(&kernel, &mut largest);
            section.weights::<{ $p + 2 }>(table, &kernel, &mut largest);
        }};
    }
    match (name, entry["exactness"].as_u64(), entry["regularity"].as_u64()) {
        ("Ngp", ..) => section.weights(table, &Ngp, &mut largest),
        ("Cic", ..) => section.weights(table, &Cic, &mut largest),
        ("Tsc", ..) => section.weights(table, &Tsc, &mut largest),
        (_, Some(2), Some(1)) => lambda!(2, 1),
        (_, Some(2), Some(2)) => lambda!(2, 2),
        (_, Some(4), Some(2)) => lambda!(4, 2),
        (_, Some(4), Some(4)) => lambda!(4, 4),
        (_, Some(6), Some(4)) => lambda!(6, 4),
        (_, Some(6), Some(6)) => lambda!(6, 6),
        (_, Some(8), Some(4)) => lambda!(8, 4),
        other => panic!("unknown kernel {other:?}"),
    }
    Some((section.name, largest))
}

/// The same for the one kernel of three dimensions alone.
fn measure_three_dimensional(table: &Value, entry: &Value) -> Option<(String, Largest)> {
    let mut largest = Largest::default();
    (entry["kernel"] == "RationalLaplacian").then(|| {
        let section = Section::<3>::new(table, entry);
        section.values(&RationalLaplacian::new(), &mut largest);
        (section.name, largest)
    })
}

/// Compares one section; its name and the largest errors.
fn measure<const D: usize>(table: &Value, entry: &Value) -> (String, Largest) {
    let section = Section::<D>::new(table, entry);
    let mut largest = Largest::default();
    let order = || entry["order"].as_u64().and_then(|order| u32::try_from(order).ok()).expect("an order");
    match entry["kernel"].as_str().expect("a kernel") {
        "Gaussian" => section.smoothing(&Gaussian::<D>::new(), &mut largest),
        "WideGaussian" => section.values(&WideGaussian::<D>::new(), &mut largest),
        "HighOrderGaussian" => {
            let kernel = HighOrderGaussian::<D>::new(order()).expect("an order that exists");
            section.smoothing(&kernel, &mut largest);
        }
        "Exchange" => {
            let terms = terms(entry["operator"].as_str().expect("an operator"));
            section.values(&Exchange::<D>::new(&terms, order()).expect("a small kernel"), &mut largest);
        }
        "OneSidedGaussian" => {
            let mut exponents = [0; D];
            exponents[0] = entry["degree"].as_u64().and_then(|degree| u8::try_from(degree).ok()).expect("a degree");
            let term = Term { index: MultiIndex::new(exponents), factor: 1.0 };
            let side = if entry["side"] == "left" { Side::Left } else { Side::Right };
            let kernel = OneSidedGaussian::<D>::new(term, side, order()).expect("a small kernel");
            section.values(&kernel, &mut largest);
        }
        "AnisotropicGaussian" => {
            let units =
                (0..D).map(|axis| MultiIndex::<D>::unit(axis).expect("an axis").exponents()).collect::<Vec<_>>();
            let term = |i: usize, j: usize| Term {
                index: MultiIndex::new(std::array::from_fn(|axis| units[i][axis] + units[j][axis])),
                factor: entry["tensor"][i][j].as_f64().expect("a factor"),
            };
            let terms: Vec<_> = (0..D).flat_map(|i| (0..D).map(move |j| (i, j))).map(|(i, j)| term(i, j)).collect();
            section.values(&AnisotropicGaussian::new(&terms).expect("of degree 2"), &mut largest);
        }
        "CubicSpline" => section.smoothing(&CubicSpline::<D>::new(), &mut largest),
        "QuinticSpline" => section.smoothing(&QuinticSpline::<D>::new(), &mut largest),
        "WendlandC2" => section.smoothing(&WendlandC2::<D>::new(), &mut largest),
        "WendlandC4" => section.smoothing(&WendlandC4::<D>::new(), &mut largest),
        "WendlandC6" => section.smoothing(&WendlandC6::<D>::new(), &mut largest),
        "LatticeHat" => section.values(&LatticeHat::<D>::new(), &mut largest),
        other => panic!("unknown kernel {other}"),
    }
    (section.name, largest)
}

#[test]
fn kernels_stay_within_four_eps_of_their_absolute_terms_and_derivatives_within_eight() {
    let table: Value = serde_json::from_str(include_str!("../data/kernel_values.json")).expect("JSON");
    let mut entries = 0;
    println!("largest error in units of eps times absolute terms: value, derivative, the same in f32");
    for entry in table["kernels"].as_array().expect("kernels") {
        let (name, largest) = match entry["dim"].as_u64() {
            Some(1) => measure_one_dimensional(&table, entry).unwrap_or_else(|| measure::<1>(&table, entry)),
            Some(2) => measure::<2>(&table, entry),
            Some(3) => measure_three_dimensional(&table, entry).unwrap_or_else(|| measure::<3>(&table, entry)),
            other => panic!("unknown dimension {other:?}"),
        };
        let Largest { value, derivative, value_single, derivative_single, .. } = largest;
        println!("{name}: {value:.2} {derivative:.2} {value_single:.2} {derivative_single:.2}");
        let kernel = entry["kernel"].as_str().expect("a kernel");
        let units = |what: &str| Promise::new("Kernels", format!("{kernel} {what}, f64 and f32"));
        units("values").in_units("eps sum abs", 1.0).at_most(VALUE_BOUND, value.max(value_single));
        if entry["derivatives"].is_object() {
            let largest = derivative.max(derivative_single);
            units("derivatives").in_units("eps sum abs", 1.0).at_most(DERIVATIVE_BOUND, largest);
        }
        entries += largest.entries;
    }
    assert_eq!(entries, ENTRIES, "entries compared");
}

/// What the table must hold, so that no section is skipped: points times sections.
const ENTRIES: usize = SMOOTH + COMPACT + MESH;
/// Gaussian, wide Gaussian, identities, exchange kernels, the rational one, one-sided and anisotropic kernels; derivatives
/// in 1D, 2D, 3D.
const SMOOTH: usize = 24 * (3 + 3 + 12 + 44 + 1 + 19 + 3) + 12 * (4 + 14 + 34 + 4 * (3 + 9 + 19));
/// Five smoothing kernels and the hat in 1D, 2D, 3D; derivatives of the five.
const COMPACT: usize = 16 * 18 + 8 * ((2 + 4 + 2 + 4 + 6) + (5 + 14 + 5 + 14 + 14) + (9 + 34 + 9 + 34 + 34 + 3));
/// Seven interpolation kernels, their derivatives and their weights, and three assignment kernels.
const MESH: usize = 16 * 7 + 8 * (1 + 2 + 2 + 4 + 4 + 6 + 4) + 6 * (4 + 4 + 6 + 6 + 8 + 8 + 10) + 6 * (1 + 2 + 3);
