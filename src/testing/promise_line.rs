//! One promise as a line of text: between tabs, and as a row of a Markdown table.

use std::fmt;

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
pub(super) type Place = (String, Vec<(String, u64)>, String, String);

impl Line {
    /// Fields between tabs.
    pub(super) fn to_tsv(&self) -> String {
        let fields = [&self.section, &self.promise, &self.bound, &self.measured, &self.verdict, &self.test];
        for field in fields {
            assert!(!field.contains(['\t', '\n', '|']), "no text for a table: {field:?}");
        }
        fields.map(String::as_str).join("\t")
    }

    pub(super) fn from_fields(fields: &[&str]) -> Option<Self> {
        let &[section, promise, bound, measured, verdict, test] = fields else { return None };
        let [section, promise, bound, measured, verdict, test] =
            [section, promise, bound, measured, verdict, test].map(Into::into);
        Some(Self { section, promise, bound, measured, verdict, test })
    }

    pub(super) fn place(&self) -> Place {
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

    /// A row of a Markdown table.
    pub(super) fn to_row(&self) -> String {
        let Self { promise, bound, measured, verdict, test, .. } = self;
        format!("| {promise} | {bound} | {measured} | {verdict} | {test} |")
    }

    /// A row exactly as [`to_row`](Self::to_row) writes it.
    pub(super) fn from_row(section: &str, row: &str) -> Option<Self> {
        let fields: Vec<&str> = row.strip_prefix("| ")?.strip_suffix(" |")?.split(" | ").collect();
        let line = Self::from_fields(&[&[section], &fields[..]].concat())?;
        (line.to_row() == row).then_some(line)
    }

    /// Whether the measured value, rounded to two digits, can be within the bound.
    pub(super) fn may_hold(&self) -> bool {
        let Some(bound) = Bound::read(&self.bound) else { return self.measured == self.bound };
        self.measured.parse().is_ok_and(|measured: f64| {
            let rounding = 0.05 * measured.abs();
            match bound {
                Bound::AtMost(high) => measured <= high + rounding,
                Bound::AtLeast(low) => measured >= low - rounding,
                Bound::Within(low, high) => (low - rounding..=high + rounding).contains(&measured),
            }
        })
    }

    /// Whether the measured value is that many times worse than one measured before, where one side is the worse.
    pub(super) fn is_worse_by(&self, factor: f64, before: &Self) -> bool {
        let (Ok(now), Ok(before)) = (self.measured.parse::<f64>(), before.measured.parse::<f64>()) else {
            return false;
        };
        match Bound::read(&self.bound) {
            Some(Bound::AtMost(_)) => now > 0.0 && now >= factor * before,
            Some(Bound::AtLeast(_)) => before > 0.0 && before >= factor * now,
            _ => false,
        }
    }
}

/// A bound in numbers, in whatever unit.
enum Bound {
    AtMost(f64),
    AtLeast(f64),
    Within(f64, f64),
}

impl Bound {
    /// `None` for what is no number: that both are equal, that something always holds.
    fn read(text: &str) -> Option<Self> {
        let words: Vec<&str> = text.split([' ', ',']).collect();
        match words[..] {
            ["<=", high, ..] => Some(Self::AtMost(high.parse().ok()?)),
            [">=", low, ..] => Some(Self::AtLeast(low.parse().ok()?)),
            [low, "to", high, ..] => Some(Self::Within(low.parse().ok()?, high.parse().ok()?)),
            _ => None,
        }
    }
}

impl fmt::Display for Line {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {} ({})", self.section, self.promise, self.test)
    }
}
