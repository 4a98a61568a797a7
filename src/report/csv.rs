//! Tables as comma-separated values, there and back.

use std::io::{self, Write};

use super::sample::Sample;
use super::stopwatch::Seconds;
use super::table::Table;
use crate::error::{ReportError, Result};
use crate::io::counted;

/// The columns, in order.
pub const HEADER: [&str; 22] = [
    "scene",
    "dim",
    "set",
    "method",
    "order",
    "stepper",
    "scalar",
    "n",
    "neighbors",
    "h",
    "epsilon",
    "dt",
    "steps",
    "error_l2",
    "error_linf",
    "observed_order",
    "neighbor_s",
    "build_s",
    "apply_s",
    "step_s",
    "total_s",
    "peak_bytes",
];

/// Rounding of a sum that another program may have written with six digits.
const TOTAL_TOLERANCE: f64 = 1e-5;

impl Table {
    /// Writes the header and a line a sample. Cells with a comma, a quote or a line break are quoted, quotes in them
    /// doubled; numbers read back to the same bits; what a sample does not have is empty, and so is a phase that was not
    /// timed.
    ///
    /// # Errors
    /// [`IoError::Write`](crate::IoError::Write) with the number of bytes taken before the writer failed.
    pub fn write_csv(&self, out: &mut (impl Write + ?Sized)) -> Result<()> {
        counted(out, |out| {
            writeln!(out, "{}", HEADER.join(","))?;
            self.samples().iter().try_for_each(|sample| line(sample, out))
        })
    }

    /// Reads what [`write_csv`](Self::write_csv) wrote, or another program with the same columns; lines may end in CR LF,
    /// the last without either.
    ///
    /// # Errors
    /// [`ReportError::Quote`], [`ReportError::Header`], [`ReportError::Cells`], [`ReportError::Number`],
    /// [`ReportError::Total`] with the line; what [`push`](Self::push) refuses.
    pub fn read_csv(text: &str) -> Result<Self> {
        let mut lines = records(text)?.into_iter();
        let header = lines.next().map_or(Vec::new(), |(_, cells)| cells);
        if let Some(column) = (0..header.len().max(HEADER.len())).find(|&i| {
            let found = header.get(i).map(String::as_str);
            found.is_none() || found != HEADER.get(i).copied()
        }) {
            return Err(ReportError::Header { column }.into());
        }
        let mut table = Self::default();
        for (line, cells) in lines {
            table.push(sample(line, &cells)?)?;
        }
        Ok(table)
    }
}

fn line(sample: &Sample, out: &mut impl Write) -> io::Result<()> {
    let number = |value: Option<f64>| value.map_or(String::new(), |value| format!("{value:e}"));
    let Seconds { neighbors, build, apply, step } = sample.seconds;
    let timed = |seconds: f64| number((seconds != 0.0).then_some(seconds));
    let cells = [
        quoted(&sample.scene),
        sample.dim.to_string(),
        quoted(&sample.set),
        quoted(&sample.method),
        sample.order.to_string(),
        quoted(&sample.stepper),
        quoted(&sample.scalar),
        sample.n.to_string(),
        number(Some(sample.neighbors)),
        number(Some(sample.h)),
        number(sample.epsilon),
        number(sample.dt),
        sample.steps.to_string(),
        number(Some(sample.error_l2)),
        number(Some(sample.error_linf)),
        number(sample.observed_order),
        timed(neighbors),
        timed(build),
        timed(apply),
        timed(step),
        number(Some(sample.seconds.total())),
        sample.peak_bytes.map_or(String::new(), |bytes| bytes.to_string()),
    ];
    writeln!(out, "{}", cells.join(","))
}

fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.to_string() }
}

fn sample(line: usize, cells: &[String]) -> Result<Sample> {
    let (found, needed) = (cells.len(), HEADER.len());
    if found != needed {
        return Err(ReportError::Cells { line, found, needed }.into());
    }
    fn read<T: std::str::FromStr>(cells: &[String], line: usize, i: usize) -> Result<T> {
        cells[i].parse().map_err(|_| ReportError::Number { line, column: HEADER[i] }.into())
    }
    let real = |i: usize| read::<f64>(cells, line, i);
    let optional = |i: usize| if cells[i].is_empty() { Ok(None) } else { real(i).map(Some) };
    let phase = |i: usize| optional(i).map(|seconds| seconds.unwrap_or(0.0));
    let seconds = Seconds { neighbors: phase(16)?, build: phase(17)?, apply: phase(18)?, step: phase(19)? };
    let (found, sum) = (real(20)?, seconds.total());
    if !((found - sum).abs() <= TOTAL_TOLERANCE * sum) {
        return Err(ReportError::Total { line, found, sum }.into());
    }
    Ok(Sample {
        scene: cells[0].clone(),
        dim: read(cells, line, 1)?,
        set: cells[2].clone(),
        method: cells[3].clone(),
        order: read(cells, line, 4)?,
        stepper: cells[5].clone(),
        scalar: cells[6].clone(),
        n: read(cells, line, 7)?,
        neighbors: real(8)?,
        h: real(9)?,
        epsilon: optional(10)?,
        dt: optional(11)?,
        steps: read(cells, line, 12)?,
        error_l2: real(13)?,
        error_linf: real(14)?,
        observed_order: optional(15)?,
        seconds,
        peak_bytes: if cells[21].is_empty() { None } else { Some(read(cells, line, 21)?) },
    })
}

/// The cells of each line that is not empty, with the number of the line on which it begins.
fn records(text: &str) -> Result<Vec<(usize, Vec<String>)>> {
    let mut records = Vec::new();
    let mut characters = text.chars().peekable();
    let mut line = 1;
    while characters.peek().is_some() {
        let (first, mut cells) = (line, Vec::new());
        loop {
            let mut cell = String::new();
            let opened = characters.next_if_eq(&'"').is_some();
            if opened {
                let begun = line;
                loop {
                    match characters.next() {
                        Some('"') if characters.next_if_eq(&'"').is_some() => cell.push('"'),
                        Some('"') => break,
                        Some(c) => {
                            line += usize::from(c == '\n');
                            cell.push(c);
                        }
                        None => return Err(ReportError::Quote { line: begun }.into()),
                    }
                }
            } else {
                while let Some(c) = characters.next_if(|c| !matches!(c, ',' | '\n' | '\r')) {
                    cell.push(c);
                }
            }
            cells.push(cell);
            match characters.next() {
                Some(',') => {}
                Some('\r') => {
                    characters.next_if_eq(&'\n');
                    break;
                }
                Some('\n') | None => break,
                Some(_) => return Err(ReportError::Quote { line }.into()),
            }
        }
        line += 1;
        if cells != [""] {
            records.push((first, cells));
        }
    }
    Ok(records)
}
