//! The table of observed orders.

use std::error::Error;
use std::time::Instant;

use parops::{MultiIndex, condition_count, graded};

use crate::bands;
use crate::measure::{Observed, OfDegree, Outcome, Series, observe};
use crate::sets::Set;

/// One multi-index.
struct Line {
    dimensions: usize,
    beta: String,
    series: Series,
    conditions: usize,
    neighbors: f64,
    observed: Observed,
    rows: usize,
    grown: usize,
}

/// All lines, in the order they were observed.
#[derive(Default)]
pub struct Table {
    lines: Vec<Line>,
}

impl Table {
    /// Observes the K derivatives of one degree on one kind of set, and shows what was found.
    ///
    /// # Errors
    /// What the library refuses.
    pub fn observe<const D: usize, const K: usize>(
        &mut self,
        set: Set,
        degree: u32,
        order: u32,
    ) -> Result<(), Box<dyn Error>> {
        let start = Instant::now();
        let conditions = condition_count(D as u32, degree, order)? as usize;
        let mut series = Series::plan::<D>(set, degree, order, conditions);
        let outcome = observe::<D, K, f64>(OfDegree::<K>(degree), &series).or_else(|error| {
            // The stencils at the faces of a lattice repeat the same few coordinates: their rank may be lost, whole
            // shells and three widenings or not, and the library says so. The interior is observed all the same.
            if set != Set::Lattice {
                return Err(error);
            }
            println!("  {D}D degree {degree} r {order} {}, at a face: {error}", set.name());
            series.faces = false;
            observe::<D, K, f64>(OfDegree::<K>(degree), &series)
        })?;
        let Outcome { outputs, conditions, neighbors, rows, grown } = outcome;
        let betas = graded::<D>(degree, degree).map(|beta: MultiIndex<D>| beta.to_string());
        for (observed, beta) in outputs.into_iter().zip(betas) {
            let (dimensions, series) = (D, series.clone());
            self.lines.push(Line { dimensions, beta, series, conditions, neighbors, observed, rows, grown });
        }
        for line in &self.lines[self.lines.len() - K..] {
            println!("{}", line.row());
        }
        println!("  {rows} rows in {:.1} s", start.elapsed().as_secs_f64());
        Ok(())
    }

    pub fn len(&self) -> usize {
        self.lines.len()
    }

    /// The lines out of their bands.
    pub fn violations(&self) -> Vec<String> {
        self.lines.iter().filter(|line| !line.violations().is_empty()).map(Line::row).collect()
    }

    pub fn markdown(&self) -> String {
        let mut text = String::from(TITLE);
        let mut lines: Vec<&Line> = self.lines.iter().collect();
        lines.sort_by_key(|line| line.dimensions);
        for chunk in lines.chunk_by(|a, b| a.dimensions == b.dimensions) {
            text += &format!("\n## {}D\n\n{HEADER}", chunk[0].dimensions);
            chunk.iter().for_each(|line| text += &line.markdown());
        }
        let out = self.violations().len();
        text + &format!("\n{} orders, {out} out of their bands.\n", self.len())
    }
}

const TITLE: &str = "# Observed orders of DC-PSE

Written by `cargo run --release --example orders`. Default settings, the 2 l nearest neighbors of every particle, whole
shells. Fields are plane waves in several directions, errors are those of interior particles, whose stencil touches no
face of the unit box, unless a column says otherwise. Orders are fitted over 4 grids, medians of 5 seeds (1 on
lattices). In 2D each seed means 4 sets, so that the few corners, which lead the norm over the faces, are more.

Sets: lattice; jittered by up to 0.3 h; quasi-random (Kronecker sequence in 1D, Halton points in 2D and 3D, where a
Kronecker set is locally a lattice whose symmetry changes with N); boundary (jittered, the outermost particles on
the faces). l conditions, n neighbors in the mean. Error/floor is the least ratio of an interior L2 error to its round-off
floor eps sum |w| epsilon^-|beta|. Bands: interior L2 within 0.1 of r for even r and 0.2 for odd, and of r + 1 for odd r on
lattices; L-inf at least r - 0.35 for even r; on sets that are no lattice at most r + 0.5 for even r and r + 1.2 for odd;
face at least r - 0.25 in 1D and 2D, r - 0.5 in 3D. The order over all particles is reported, never asserted. Grown rows
are those of a widened support, of all rows of the line.
";
const HEADER: &str =
    "| beta | r | set | l | n | L2 | L-inf | face L2 | all L2 | grids | errors | error/floor | grown | verdict |
|---|---|---|---|---|---|---|---|---|---|---|---|---|---|
";

impl Line {
    fn violations(&self) -> Vec<String> {
        bands::violations(&self.series, self.dimensions, &self.observed)
    }

    fn verdict(&self) -> String {
        let violations = self.violations();
        if !violations.is_empty() {
            return format!("out: {}", violations.join(", "));
        }
        let design = bands::design(self.series.set, self.series.order);
        let raised = if design > f64::from(self.series.order) { ", r + 1" } else { "" };
        let refused = if self.series.faces { "" } else { ", refused at faces" };
        format!("holds{raised}{refused}")
    }

    /// The columns both tables have.
    fn columns(&self) -> [String; 13] {
        let Observed { interior, interior_linf, face, whole, errors, above_floor } = self.observed;
        let order = |order: f64| if order.is_finite() { format!("{order:.2}") } else { "-".into() };
        let sides = &self.series.sides;
        [
            self.beta.clone(),
            self.series.order.to_string(),
            self.series.set.name().into(),
            self.conditions.to_string(),
            format!("{:.1}", self.neighbors),
            order(interior),
            order(interior_linf),
            order(face),
            order(whole),
            format!("{} to {}", sides[0], sides[sides.len() - 1]),
            format!("{:.1e} to {:.1e}", errors[0], errors[1]),
            format!("{above_floor:.0e}"),
            format!("{} of {}", self.grown, self.rows),
        ]
    }

    fn row(&self) -> String {
        let widths = [9, 1, 12, 3, 5, 5, 5, 5, 5, 9, 18, 5, 12];
        let columns = self.columns();
        let padded: Vec<String> = columns.iter().zip(widths).map(|(text, width)| format!("{text:>width$}")).collect();
        format!("{}D {}  {}", self.dimensions, padded.join("  "), self.verdict())
    }

    fn markdown(&self) -> String {
        format!("| {} | {} |\n", self.columns().join(" | "), self.verdict())
    }
}
