//! The table of promises: read from what tests recorded, compared with a page.

use std::collections::BTreeMap;
use std::path::Path;
use std::{fmt, fs, io};

use super::promise_line::{BROKEN, Line, Place};

/// The first lines of every table.
const TITLES: [&str; 2] = ["| Promise | Bound | Measured | Verdict | Test |", "|---|---|---|---|---|"];

/// Every promise that tests have shown, with bound, verdict and test; displayed as a page of Markdown tables.
///
/// A page that was checked in is compared promise by promise; a measured value may differ within its bound.
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

    /// Reads the tables of a page, and adds what is neither title nor promise from the first section on.
    fn from_page(page: &str, faults: &mut Vec<String>) -> Self {
        let (mut found, mut section) = (Self::default(), None);
        for text in page.lines() {
            if let Some(title) = text.strip_prefix("## ") {
                section = Some(title);
                continue;
            }
            let Some(section) = section else { continue };
            if text.is_empty() || TITLES.contains(&text) {
                continue;
            }
            match Line::from_row(section, text) {
                Some(line) => {
                    if found.lines.insert(line.place(), line.clone()).is_some() {
                        faults.push(format!("stated twice: {line}"));
                    }
                }
                None => faults.push(format!("no promise: \"{text}\"")),
            }
        }
        found
    }

    /// Promises that are broken.
    pub fn broken(&self) -> impl Iterator<Item = String> {
        self.lines.values().filter(|line| line.verdict == BROKEN).map(ToString::to_string)
    }

    /// What differs from a page in promises, bounds, verdicts and names of tests; measured values of the page that its own
    /// bounds exclude; and what is no promise behind the title of its first section.
    #[must_use]
    pub fn differences(&self, page: &str) -> Vec<String> {
        let mut found = vec![];
        let page = Self::from_page(page, &mut found);
        for (place, shown) in &self.lines {
            let Some(stated) = page.lines.get(place) else {
                found.push(format!("not in the page: {shown}"));
                continue;
            };
            for (what, stated, shown_now) in
                [("bound", &stated.bound, &shown.bound), ("verdict", &stated.verdict, &shown.verdict)]
            {
                if stated != shown_now {
                    found.push(format!("{what} was \"{stated}\", is \"{shown_now}\": {shown}"));
                }
            }
            if stated.verdict != BROKEN && !stated.may_hold() {
                found.push(format!("\"{}\" is stated for \"{}\": {shown}", stated.measured, stated.bound));
            }
        }
        let gone = page.lines.iter().filter(|(place, _)| !self.lines.contains_key(*place));
        found.extend(gone.map(|(_, stated)| format!("shown by no test: {stated}")));
        found
    }

    /// What a page states as measured and is now worse by a factor of two or more, within its bound.
    pub fn worsened(&self, page: &str) -> Vec<String> {
        let page = Self::from_page(page, &mut vec![]);
        let both = self.lines.iter().filter_map(|(place, shown)| Some((page.lines.get(place)?, shown)));
        let worse = both.filter(|(stated, shown)| shown.is_worse_by(2.0, stated));
        worse.map(|(stated, shown)| format!("was {}, is {}: {shown}", stated.measured, shown.measured)).collect()
    }
}

impl fmt::Display for Verification {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut section = "";
        let [title, rule] = TITLES;
        for line in self.lines.values() {
            if line.section != section {
                let gap = if section.is_empty() { "" } else { "\n" };
                writeln!(f, "{gap}## {}\n\n{title}\n{rule}", line.section)?;
                section = &line.section;
            }
            writeln!(f, "{}", line.to_row())?;
        }
        Ok(())
    }
}
