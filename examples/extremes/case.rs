//! One case of a catalogue: what was set up, what a naive method does, what the library does, and whether that is its duty.

use std::error::Error;
use std::fmt::Display;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Instant;

/// What a catalogue asks of the library.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Duty {
    /// It notices.
    Detect,
    /// It says so, in a typed error or a report.
    Report,
    /// It does something about it.
    Adapt,
    /// It is not to happen at all.
    Prevent,
    /// Its documentation says so.
    Document,
}

impl Duty {
    pub fn name(self) -> &'static str {
        match self {
            Self::Detect => "detects",
            Self::Report => "reports",
            Self::Adapt => "adapts",
            Self::Prevent => "prevents",
            Self::Document => "documents",
        }
    }
}

/// An outcome that was measured, and whether it is what the duty asks.
pub struct Outcome {
    pub duty: Duty,
    pub text: String,
    pub met: bool,
}

/// How a case is run; it fills in what it finds.
pub type Scene = fn(&mut Case, quick: bool) -> Result<(), Box<dyn Error>>;

/// A line of a catalogue.
pub struct Entry {
    pub number: u32,
    pub title: &'static str,
    /// The duties that must be shown, each by one outcome at least.
    pub duties: &'static [Duty],
    /// An adaptation the catalogue names and the library does not have, with the reason.
    pub not_offered: Option<&'static str>,
    pub scene: Scene,
}

/// What was found for an entry.
pub struct Case {
    pub catalogue: &'static str,
    pub number: u32,
    pub title: &'static str,
    pub setup: String,
    /// What a naive method does, measured.
    pub naive: String,
    /// Whether it fails as it should: a scene that does not shows nothing.
    pub exposed: bool,
    /// What the library does, duty by duty.
    pub outcomes: Vec<Outcome>,
    pub duties: &'static [Duty],
    pub not_offered: Option<&'static str>,
    /// What stopped the scene, if anything did.
    pub stopped: Option<String>,
    pub seconds: f64,
}

impl Case {
    /// Runs an entry. A scene that fails or panics is a case that does not hold.
    pub fn run(catalogue: &'static str, entry: &Entry, quick: bool) -> Self {
        let mut case = Self {
            catalogue,
            number: entry.number,
            title: entry.title,
            setup: String::new(),
            naive: String::new(),
            exposed: false,
            outcomes: Vec::new(),
            duties: entry.duties,
            not_offered: entry.not_offered,
            stopped: None,
            seconds: 0.0,
        };
        let start = Instant::now();
        case.stopped = match catch_unwind(AssertUnwindSafe(|| (entry.scene)(&mut case, quick))) {
            Ok(Ok(())) => None,
            Ok(Err(error)) => Some(error.to_string()),
            Err(_) => Some(String::from("panicked")),
        };
        case.seconds = start.elapsed().as_secs_f64();
        case
    }

    pub fn setup(&mut self, text: impl Display) {
        self.setup = text.to_string();
    }

    /// What the naive method did, and whether that shows the failure.
    pub fn naive(&mut self, exposed: bool, text: impl Display) {
        self.exposed = exposed;
        self.naive = text.to_string();
    }

    pub fn detects(&mut self, met: bool, text: impl Display) {
        self.outcome(Duty::Detect, met, text);
    }

    pub fn reports(&mut self, met: bool, text: impl Display) {
        self.outcome(Duty::Report, met, text);
    }

    pub fn adapts(&mut self, met: bool, text: impl Display) {
        self.outcome(Duty::Adapt, met, text);
    }

    pub fn prevents(&mut self, met: bool, text: impl Display) {
        self.outcome(Duty::Prevent, met, text);
    }

    /// Whether a source file of the library says this sentence, however its lines are broken.
    pub fn documents(&mut self, source: &str, sentence: &str) {
        let words = |text: &str| {
            text.split_whitespace().filter(|word| !matches!(*word, "///" | "//!")).collect::<Vec<_>>().join(" ")
        };
        self.outcome(Duty::Document, words(source).contains(&words(sentence)), format!("\"{sentence}\""));
    }

    fn outcome(&mut self, duty: Duty, met: bool, text: impl Display) {
        self.outcomes.push(Outcome { duty, text: text.to_string(), met });
    }

    /// Whether all of it is the documented duty.
    pub fn holds(&self) -> bool {
        let shown = |duty: &Duty| self.outcomes.iter().any(|outcome| outcome.duty == *duty);
        self.stopped.is_none()
            && self.exposed
            && self.outcomes.iter().all(|outcome| outcome.met)
            && self.duties.iter().all(shown)
    }

    /// Why it does not hold, in few words.
    pub fn verdict(&self) -> String {
        if self.holds() {
            return String::from("as documented");
        }
        let mut reasons = Vec::new();
        reasons.extend(self.stopped.as_ref().map(|error| format!("stopped: {error}")));
        if !self.exposed {
            reasons.push(String::from("the naive method does not fail"));
        }
        reasons.extend(self.outcomes.iter().filter(|o| !o.met).map(|o| format!("not as it {}", o.duty.name())));
        let missing = self.duties.iter().filter(|duty| !self.outcomes.iter().any(|o| o.duty == **duty));
        reasons.extend(missing.map(|duty| format!("not shown: {}", duty.name())));
        reasons.join("; ")
    }

    /// What the library does, in one line.
    pub fn ours(&self) -> String {
        let parts = self.outcomes.iter().map(|outcome| {
            let mark = if outcome.met { "" } else { "NOT " };
            format!("{mark}{}: {}", outcome.duty.name(), outcome.text)
        });
        parts.chain(self.not_offered.map(|reason| format!("not offered: {reason}"))).collect::<Vec<_>>().join("; ")
    }

    pub const HEADER: &str = "catalogue,number,title,setup,naive,parops,verdict,holds,seconds";

    pub fn csv(&self) -> String {
        let quoted = |text: &str| format!("\"{}\"", text.replace('"', "\"\""));
        format!(
            "{},{},{},{},{},{},{},{},{:.3}",
            self.catalogue,
            self.number,
            quoted(self.title),
            quoted(&self.setup),
            quoted(&self.naive),
            quoted(&self.ours()),
            quoted(&self.verdict()),
            self.holds(),
            self.seconds
        )
    }
}
