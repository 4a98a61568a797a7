//! One page that needs nothing else.

use std::io::{self, Write};

use super::sample::Sample;
use super::table::Table;
use super::task::{TARGETS, Task};
use crate::error::{ReportError, Result};
use crate::io::{Escaped, counted};

/// A table as one HTML page with figures inside, which loads nothing: per scene its figures, its notes, the cheapest method
/// for each error of [`TARGETS`], and all samples, those of the Pareto front marked.
///
/// ```
/// use parops::report::{Page, Sample, Table};
/// let mut table = Table::default();
/// table.push(Sample { error_l2: 1e-3, ..Sample::new("a < b", 2, "lattice", "PSE", 2) })?;
/// let mut page = Page::new("Error against run time", &table);
/// page.fact("processor", "8086");
/// page.figure("a < b", "<svg xmlns='http://www.w3.org/2000/svg'><circle r='1'/></svg>")?;
/// let mut html = Vec::new();
/// page.write(&mut html)?;
/// assert!(String::from_utf8_lossy(&html).contains("<h2>a &lt; b</h2>"));
/// # parops::Result::Ok(())
/// ```
#[derive(Clone, Debug)]
pub struct Page<'a> {
    title: String,
    table: &'a Table,
    facts: Vec<(String, String)>,
    notes: Vec<(String, String)>,
    figures: Vec<(String, String)>,
}

impl<'a> Page<'a> {
    /// A page of this table, without figures.
    pub fn new(title: &str, table: &'a Table) -> Self {
        Self { title: title.to_string(), table, facts: Vec::new(), notes: Vec::new(), figures: Vec::new() }
    }

    /// Adds a fact about machine or versions, as text.
    pub fn fact(&mut self, name: &str, value: &str) -> &mut Self {
        self.facts.push((name.to_string(), value.to_string()));
        self
    }

    /// Adds a sentence to a scene, as text.
    ///
    /// # Errors
    /// [`ReportError::NoSamples`] for a scene the table has no samples of. The page is then as it was.
    pub fn note(&mut self, scene: &str, text: &str) -> Result<&mut Self> {
        self.check(scene, "note", self.notes.len())?;
        self.notes.push((scene.to_string(), text.to_string()));
        Ok(self)
    }

    /// Adds a figure to a scene, put into the page as it is: one `<svg>` element of the caller's, whom the page trusts.
    ///
    /// # Errors
    /// [`ReportError::NoSamples`] for a scene the table has no samples of; [`ReportError::NotSvg`] unless the text begins
    /// with `<svg` and ends with `</svg>`, white space aside. The page is then as it was.
    pub fn figure(&mut self, scene: &str, svg: &str) -> Result<&mut Self> {
        let (figure, svg) = (self.figures.len(), svg.trim());
        self.check(scene, "figure", figure)?;
        if !(svg.starts_with("<svg") && svg.ends_with("</svg>")) {
            return Err(ReportError::NotSvg { figure }.into());
        }
        self.figures.push((scene.to_string(), svg.to_string()));
        Ok(self)
    }

    /// Refuses what would stand nowhere in the page.
    fn check(&self, scene: &str, item: &'static str, place: usize) -> Result<()> {
        match self.table.samples().iter().any(|sample| sample.scene == scene) {
            true => Ok(()),
            false => Err(ReportError::NoSamples { item, place }.into()),
        }
    }

    /// Writes the page and flushes `out`.
    ///
    /// # Errors
    /// [`IoError::Write`](crate::IoError::Write) with the number of bytes taken before the writer failed.
    pub fn write(&self, out: &mut (impl Write + ?Sized)) -> Result<()> {
        counted(out, |out| self.write_to(out))
    }

    fn write_to(&self, out: &mut impl Write) -> io::Result<()> {
        let title = Escaped(&self.title);
        write!(out, "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<title>{title}</title>\n")?;
        write!(out, "<style>{STYLE}</style>\n</head>\n<body>\n<h1>{title}</h1>\n<table class=\"facts\">\n")?;
        for (name, value) in &self.facts {
            writeln!(out, "<tr><th>{}</th><td>{}</td></tr>", Escaped(name), Escaped(value))?;
        }
        writeln!(out, "</table>\n<p>{ABOUT}</p>")?;
        let tasks = self.table.tasks();
        for scene in self.table.scenes() {
            let tasks: Vec<&Task> = tasks.iter().filter(|task| task.samples()[0].scene == scene).collect();
            let count: usize = tasks.iter().map(|task| task.samples().len()).sum();
            writeln!(out, "<section>\n<h2>{}</h2>", Escaped(scene))?;
            let of_scene = |(name, _): &&(String, String)| name == scene;
            for (_, text) in self.notes.iter().filter(of_scene) {
                writeln!(out, "<p>{}</p>", Escaped(text))?;
            }
            for (_, svg) in self.figures.iter().filter(of_scene) {
                let name = Escaped(scene);
                writeln!(out, "<figure data-scene=\"{name}\" data-samples=\"{count}\">\n{svg}\n</figure>")?;
            }
            cheapest(&tasks, out)?;
            writeln!(out, "<details>\n<summary>all {count} samples</summary>")?;
            samples(&tasks, out)?;
            writeln!(out, "</details>\n</section>")?;
        }
        writeln!(out, "</body>\n</html>")
    }
}

const ABOUT: &str = "Errors are L2 errors as each scene defines them. A time is the median of the runs of its sample; the \
    total is the sum of neighbors, build, apply and step, of which an empty one was not timed apart. The cheapest method for an error is the fastest sample that reached \
    it: nothing is interpolated. Rows in bold are on the Pareto front of their dimension and set: no other sample \
    is both faster and more accurate.";

const STYLE: &str = "body{font:15px/1.45 sans-serif;margin:2em auto;max-width:1500px;padding:0 1em;color:#222}\
    table{border-collapse:collapse;margin:.8em 0}th,td{padding:.15em .7em;text-align:right;border-bottom:1px solid #ddd}\
    th{background:#f4f4f4}.facts th,.facts td,td.name,th.name{text-align:left}tr.front{font-weight:bold}\
    figure{margin:1em 0}figure svg{width:100%;height:auto}details{overflow-x:auto}summary{cursor:pointer}";

/// Dimension and set of a task as two cells.
fn heading(sample: &Sample) -> String {
    format!("<td>{}D</td><td class=\"name\">{}</td>", sample.dim, Escaped(&sample.set))
}

fn cheapest(tasks: &[&Task], out: &mut impl Write) -> io::Result<()> {
    write!(out, "<table>\n<tr><th></th><th class=\"name\">set</th>")?;
    for target in TARGETS {
        write!(out, "<th class=\"name\">cheapest for {target:e}</th>")?;
    }
    writeln!(out, "</tr>")?;
    for task in tasks {
        write!(out, "<tr>{}", heading(task.samples()[0]))?;
        for target in TARGETS {
            match task.cheapest(target) {
                Some(best) => {
                    let (label, time) = (best.label(), duration(best.seconds.total()));
                    write!(out, "<td class=\"name\">{}, N = {}: {time}</td>", Escaped(&label), best.n)?;
                }
                None => write!(out, "<td class=\"name\">not reached</td>")?,
            }
        }
        writeln!(out, "</tr>")?;
    }
    writeln!(out, "</table>")
}

fn samples(tasks: &[&Task], out: &mut impl Write) -> io::Result<()> {
    write!(out, "<table>\n<tr><th></th><th class=\"name\">set</th><th class=\"name\">method</th>")?;
    for column in ["N", "neighbors", "h", "epsilon", "dt", "steps", "L2 error", "L-inf error", "order"] {
        write!(out, "<th>{column}</th>")?;
    }
    for column in ["neighbors", "build", "apply", "step", "total", "peak bytes"] {
        write!(out, "<th>{column}</th>")?;
    }
    writeln!(out, "</tr>")?;
    let short = |value: Option<f64>| value.map_or(String::new(), |value| format!("{value:.3e}"));
    for task in tasks {
        let front = task.front();
        for &sample in task.samples() {
            let mark = if front.iter().any(|best| std::ptr::eq(*best, sample)) { " class=\"front\"" } else { "" };
            write!(out, "<tr{mark}>{}<td class=\"name\">{}</td>", heading(sample), Escaped(&sample.label()))?;
            let cells = [
                sample.n.to_string(),
                format!("{:.1}", sample.neighbors),
                short(Some(sample.h)),
                short(sample.epsilon),
                short(sample.dt),
                sample.steps.to_string(),
                short(Some(sample.error_l2)),
                short(Some(sample.error_linf)),
                sample.observed_order.map_or(String::new(), |order| format!("{order:.2}")),
                duration(sample.seconds.neighbors),
                duration(sample.seconds.build),
                duration(sample.seconds.apply),
                duration(sample.seconds.step),
                duration(sample.seconds.total()),
                sample.peak_bytes.map_or(String::new(), |bytes| bytes.to_string()),
            ];
            cells.iter().try_for_each(|cell| write!(out, "<td>{cell}</td>"))?;
            writeln!(out, "</tr>")?;
        }
    }
    writeln!(out, "</table>")
}

/// Seconds with a unit that leaves one to three digits in front.
fn duration(seconds: f64) -> String {
    match seconds {
        0.0 => String::new(),
        s if s < 1e-3 => format!("{:.2} µs", 1e6 * s),
        s if s < 1.0 => format!("{:.2} ms", 1e3 * s),
        s => format!("{s:.2} s"),
    }
}
