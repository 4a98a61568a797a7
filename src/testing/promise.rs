//! Promises with their bounds, asserted where they are measured and recorded for a table.

use std::borrow::Cow;
use std::cell::RefCell;
use std::fmt::{Debug, Display};
use std::fs::{OpenOptions, create_dir_all};
use std::io::Write;
use std::path::PathBuf;
use std::sync::{Mutex, OnceLock, PoisonError};
use std::{env, thread};

use super::promise_line::{BROKEN, Line};

/// One promise and its bound: an assertion that leaves a line for a [`Verification`](super::Verification).
///
/// A test states section and promise, and what it measured beside the bound. Where the environment variable
/// `PAROPS_PROMISES` names a directory, a line with bound, measured value, verdict and the name of the test is appended
/// to a file there before a broken promise panics. Promises repeated in a test are one line, of the worst that was
/// measured. Nothing is recorded outside a thread that bears the name of a test.
///
/// ```
/// use parops::testing::Promise;
/// let sum = [0.1_f64; 10].iter().sum::<f64>();
/// Promise::new("Sums", "ten tenths are one").in_units("eps", f64::EPSILON).at_most(4.5, (sum - 1.0).abs());
/// ```
///
/// # Panics
/// Every verb panics where its promise is broken, or measured value, bound or unit is not finite, and where promises
/// are recorded and one test states one of them with two bounds.
#[derive(Clone, Debug)]
#[must_use = "a promise is checked by a bound"]
pub struct Promise {
    section: &'static str,
    text: Cow<'static, str>,
    unit: Option<(&'static str, f64)>,
    aim: Option<(f64, &'static str)>,
    case: Option<String>,
}

/// The worst of a promise so far, and its bound.
struct Worst {
    section: &'static str,
    text: Cow<'static, str>,
    bound: String,
    badness: f64,
}

thread_local! {
    static WORST: RefCell<Vec<Worst>> = const { RefCell::new(Vec::new()) };
}

impl Promise {
    /// A promise of a section of the table.
    pub fn new(section: &'static str, text: impl Into<Cow<'static, str>>) -> Self {
        Self { section, text: text.into(), unit: None, aim: None, case: None }
    }

    /// Bounds are multiples of `size`, called `name` in the table.
    pub fn in_units(mut self, name: &'static str, size: f64) -> Self {
        self.unit = Some((name, size));
        self
    }

    /// Which of the many cases of one promise this is: said where it is broken, not in the table.
    pub fn case(mut self, name: impl Display) -> Self {
        self.case = Some(name.to_string());
        self
    }

    /// What was aimed for and is not reached, and why: the verdict is "short" until it is.
    pub fn short_of(mut self, aim: f64, reason: &'static str) -> Self {
        self.aim = Some((aim, reason));
        self
    }

    /// measured <= bound.
    #[track_caller]
    pub fn at_most(&self, bound: f64, measured: f64) {
        let size = self.size();
        let held = is_finite([measured, bound * size]) && measured <= bound * size;
        let missed = self.aim.is_some_and(|(aim, _)| !(measured <= aim * size));
        let bound_text = || format!("<= {}", number(bound));
        self.record(bound_text, measured / size, measured / size, held, missed);
    }

    /// measured >= bound.
    #[track_caller]
    pub fn at_least(&self, bound: f64, measured: f64) {
        let size = self.size();
        let held = is_finite([measured, bound * size]) && measured >= bound * size;
        let missed = self.aim.is_some_and(|(aim, _)| !(measured >= aim * size));
        let bound_text = || format!(">= {}", number(bound));
        self.record(bound_text, -measured / size, measured / size, held, missed);
    }

    /// low <= measured <= high; an aim has no meaning here.
    #[track_caller]
    pub fn within(&self, low: f64, high: f64, measured: f64) {
        let size = self.size();
        let off = (measured / size - 0.5 * (low + high)).abs();
        let bounds = [low * size, high * size];
        let held = is_finite([measured, bounds[0], bounds[1]]) && bounds[0] <= measured && measured <= bounds[1];
        let bound_text = || format!("{} to {}", number(low), number(high));
        self.record(bound_text, off, measured / size, held, false);
    }

    /// Both are the same.
    #[track_caller]
    pub fn equal<T: PartialEq + Debug + ?Sized>(&self, left: &T, right: &T) {
        let held = left == right;
        self.line(|| "equal".into(), 0.0, || if held { "equal" } else { "differs" }.into(), held, false);
        assert!(held, "{}\n left: {left:?}\nright: {right:?}", self.name());
    }

    /// It is so.
    #[track_caller]
    pub fn holds(&self, held: bool) {
        self.line(|| "always".into(), 0.0, || if held { "always" } else { "not always" }.into(), held, false);
        assert!(held, "{}", self.name());
    }

    /// Section, promise and case, for the message of a broken one.
    fn name(&self) -> String {
        let case = self.case.as_ref().map(|case| format!(" ({case})")).unwrap_or_default();
        format!("{}: {}{case}", self.section, self.text)
    }

    fn size(&self) -> f64 {
        self.unit.map_or(1.0, |(_, size)| size)
    }

    #[track_caller]
    fn record(&self, bound: impl Fn() -> String, badness: f64, measured: f64, held: bool, missed: bool) {
        let bound = || {
            let unit = self.unit.map(|(name, _)| format!(" {name}")).unwrap_or_default();
            let aim = self.aim.map(|(aim, _)| format!(", aim {}", number(aim))).unwrap_or_default();
            format!("{}{unit}{aim}", bound())
        };
        // Nothing in units of nothing is nothing.
        let [badness, measured] = [badness, measured].map(|x| if held && x.is_nan() { 0.0 } else { x });
        self.line(bound, badness, || two_digits(measured), held, missed);
        assert!(held, "{}: {measured:e} is not {}", self.name(), bound());
    }

    /// Writes a line if it is the first or the worst of its promise in this test.
    fn line(&self, bound: impl Fn() -> String, badness: f64, measured: impl Fn() -> String, held: bool, missed: bool) {
        let Some(folder) = folder() else { return };
        let bound = bound();
        if !self.is_worst(&bound, if held { badness } else { f64::INFINITY }) {
            return;
        }
        let Some(test) = test() else { return };
        let verdict = match self.aim {
            _ if !held => BROKEN.into(),
            Some((_, reason)) if missed => format!("short: {reason}"),
            _ => "held".into(),
        };
        let line = Line {
            section: self.section.into(),
            promise: self.text.to_string(),
            bound,
            measured: measured(),
            verdict,
            test: format!("{}::{test}", binary()),
        };
        append(folder, &line);
    }

    /// Whether nothing as bad was seen in this test.
    fn is_worst(&self, bound: &str, badness: f64) -> bool {
        WORST.with_borrow_mut(|all| {
            let mine = |worst: &&mut Worst| worst.section == self.section && worst.text == self.text;
            let Some(worst) = all.iter_mut().find(mine) else {
                let (section, text, bound) = (self.section, self.text.clone(), bound.into());
                all.push(Worst { section, text, bound, badness });
                return true;
            };
            assert_eq!(worst.bound, bound, "two bounds of one promise, {}: {}", self.section, self.text);
            let worse = badness > worst.badness || badness == f64::INFINITY;
            worst.badness = worst.badness.max(badness);
            worse
        })
    }
}

/// No promise is kept by a bound that excludes nothing.
fn is_finite<const N: usize>(numbers: [f64; N]) -> bool {
    numbers.iter().all(|x| x.is_finite())
}

/// A number to 15 digits, and short where it can be: the digits beyond are the rounding of a computed bound.
fn number(x: f64) -> String {
    let x = format!("{x:.14e}").parse().unwrap_or(x);
    if x == 0.0 || (1e-3..1e5).contains(&x.abs()) { format!("{x}") } else { format!("{x:e}") }
}

fn two_digits(x: f64) -> String {
    let places = 1.0 - x.abs().log10().floor();
    match places {
        _ if x == 0.0 => "0".into(),
        -1.0..=4.0 => format!("{x:.*}", places.max(0.0) as usize),
        _ => format!("{x:.1e}"),
    }
}

fn folder() -> Option<&'static PathBuf> {
    static FOLDER: OnceLock<Option<PathBuf>> = OnceLock::new();
    FOLDER.get_or_init(|| env::var_os("PAROPS_PROMISES").map(PathBuf::from)).as_ref()
}

/// The path of the test this thread runs, if it runs one.
fn test() -> Option<String> {
    thread::current().name().filter(|&name| name != "main" && is_path(name)).map(Into::into)
}

/// Names of tests are paths; those of doctests are not.
fn is_path(name: &str) -> bool {
    name.chars().all(|c| c.is_alphanumeric() || c == '_' || c == ':')
}

/// The name of the test binary, without the hash behind it.
fn binary() -> String {
    let path = env::current_exe().expect("a running program has a path");
    let name = path.file_stem().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    name.rsplit_once('-').map_or(name.clone(), |(name, _)| name.into())
}

fn append(folder: &PathBuf, line: &Line) {
    static WRITING: Mutex<()> = Mutex::new(());
    let _alone = WRITING.lock().unwrap_or_else(PoisonError::into_inner);
    let written = create_dir_all(folder)
        .and_then(|()| OpenOptions::new().create(true).append(true).open(folder.join(format!("{}.tsv", binary()))))
        .and_then(|mut file| file.write_all(format!("{}\n", line.to_tsv()).as_bytes()));
    written.unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
}
