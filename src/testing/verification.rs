//! The table of promises: read from what tests recorded, compared with a page.

use std::collections::BTreeMap;
use std::path::Path;
use std::{fmt, fs, io};

/// The verdict on a promise that is not kept.
pub(super) const BROKEN: &str = "broken";

/// One promise, as a test showed it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Line {
    pub section: String,
    pub promise: String,
    pub bound: String,
    pub measured: String,
    pub verdict: String,
    pub test: String,
}

/// Where a line stands in the table: numbers in the promise count as numbers, so that M2 comes before M10.
type Place = (String, Vec<(String, u64)>, String, String);

impl Line {
    /// Fields between tabs.
    pub(super) fn to_tsv(&self) -> String {
        let fields = [&self.section, &self.promise, &self.bound, &self.measured, &self.verdict, &self.test];
        for field in fields {
            assert!(!field.contains(['\t', '\n', '|']), "no text for a table: {field:?}");
        }
        fields.map(String::as_str).join("\t")
    }

    fn from_fields(fields: &[&str]) -> Option<Self> {
        let &[section, promise, bound, measured, verdict, test] = fields else { return None };
        let [section, promise, bound, measured, verdict, test] =
            [section, promise, bound, measured, verdict, test].map(Into::into);
        Some(Self { section, promise, bound, measured, verdict, test })
    }

    fn place(&self) -> Place {
        let mut parts = vec![];
        let mut rest = self.promise.as_str();
        while !rest.is_empty() {
            let digits = rest.find(|c: char| c.is_ascii_digit()).unwrap_or(rest.len());
            let (text, tail) = rest.split_at(digits);
            let end = tail.find(|c: char| !c.is_ascii_digit()).unwrap_or(tail.len());
            parts.push((text.into(), tail[..end].parse().unwrap_or(0)));
            rest = &tail[end..];
        }
        (self.section.clone(), parts, self.promise.clone(), self.test.clone())
    }
}

/// Every promise that tests have shown, with bound, verdict and test; displayed as a page of Markdown tables.
///
/// A page that was checked in is compared promise by promise; measured values are not compared.
///
/// ```
/// use parops::testing::Verification;
/// let lines = ["Sums\tten tenths are one\t<= 4 eps\t0.5\theld\tsums::tenths"];
/// let shown = Verification::from_lines(lines)?;
/// let page = shown.to_string();
/// assert_eq!(shown.differences(&page), [""; 0]);
/// assert_eq!(shown.differences(&page.replace("0.5", "0.25")), [""; 0]);
/// assert_eq!(shown.differences(&page.replace("4 eps", "8 eps")).len(), 1);
/// # Ok::<(), String>(())
/// ```
#[derive(Clone, Debug, Default)]
pub struct Verification {
    lines: BTreeMap<Place, Line>,
}

impl Verification {
    /// Reads the files that [`Promise`](super::Promise) wrote into a directory.
    ///
    /// # Errors
    /// What the file system says; `InvalidData` for a line that is none, and where there is no line at all.
    pub fn read(directory: &Path) -> io::Result<Self> {
        let mut text = String::new();
        for entry in fs::read_dir(directory)? {
            text += &fs::read_to_string(entry?.path())?;
        }
        Self::from_lines(text.lines()).map_err(|fault| io::Error::new(io::ErrorKind::InvalidData, fault))
    }

    /// Lines of section, promise, bound, measured value, verdict and test between tabs; of those with the same section,
    /// promise and test the last counts, or one that is broken.
    ///
    /// # Errors
    /// The first line that has not six fields; that there is none.
    pub fn from_lines<'a>(lines: impl IntoIterator<Item = &'a str>) -> Result<Self, String> {
        let mut found = Self::default();
        for line in lines {
            let fields: Vec<&str> = line.split('\t').collect();
            found.push(Line::from_fields(&fields).ok_or_else(|| format!("not six fields: {line:?}"))?);
        }
        if found.lines.is_empty() { Err("no promise was recorded".into()) } else { Ok(found) }
    }

    fn push(&mut self, line: Line) {
        let known = self.lines.entry(line.place()).or_insert_with(|| line.clone());
        if known.verdict != BROKEN {
            *known = line;
        }
    }

    /// Reads the tables of a page.
    fn from_page(page: &str) -> Self {
        let (mut found, mut section) = (Self::default(), "");
        for text in page.lines() {
            if let Some(title) = text.strip_prefix("## ") {
                section = title.trim();
            } else if let Some(row) = text.strip_prefix('|').and_then(|row| row.strip_suffix('|')) {
                let mut fields = vec![section];
                fields.extend(row.split('|').map(str::trim));
                found.lines.extend(Line::from_fields(&fields).map(|line| (line.place(), line)));
            }
        }
        // Titles and rules of the tables.
        found.lines.retain(|_, line| line.test != "Test" && !line.test.starts_with("---"));
        found
    }

    /// Promises that are broken.
    pub fn broken(&self) -> impl Iterator<Item = String> {
        self.lines.values().filter(|line| line.verdict == BROKEN).map(ToString::to_string)
    }

    /// What differs from a page in promises, bounds, verdicts and names of tests.
    #[must_use]
    pub fn differences(&self, page: &str) -> Vec<String> {
        let page = Self::from_page(page);
        let mut found = vec![];
        for (place, shown) in &self.lines {
            match page.lines.get(place) {
                None => found.push(format!("not in the page: {shown}")),
                Some(stated) => {
                    for (what, stated, shown_now) in
                        [("bound", &stated.bound, &shown.bound), ("verdict", &stated.verdict, &shown.verdict)]
                    {
                        if stated != shown_now {
                            found.push(format!("{what} was \"{stated}\", is \"{shown_now}\": {shown}"));
                        }
                    }
                }
            }
        }
        let gone = page.lines.iter().filter(|(place, _)| !self.lines.contains_key(*place));
        found.extend(gone.map(|(_, stated)| format!("shown by no test: {stated}")));
        found
    }
}

impl fmt::Display for Line {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {} ({})", self.section, self.promise, self.test)
    }
}

impl fmt::Display for Verification {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut section = "";
        for Line { section: own, promise, bound, measured, verdict, test } in self.lines.values() {
            if own != section {
                let gap = if section.is_empty() { "" } else { "\n" };
                writeln!(f, "{gap}## {own}\n\n| Promise | Bound | Measured | Verdict | Test |\n|---|---|---|---|---|")?;
                section = own;
            }
            writeln!(f, "| {promise} | {bound} | {measured} | {verdict} | {test} |")?;
        }
        Ok(())
    }
}
