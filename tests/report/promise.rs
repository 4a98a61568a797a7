//! Promises leave the lines they should, and a page that says anything else is found out.

use std::path::PathBuf;
use std::process::Command;
use std::{env, fs, panic, thread};

use parops::testing::{Promise, Verification};

/// Set where a test of this file was started by itself, to record instead of to look.
const CHILD: &str = "PAROPS_PROMISES_CHILD";

/// What a test of this file records when it starts itself, or nothing where it is the one started.
fn recorded(test: &str) -> Option<String> {
    if env::var_os(CHILD).is_some() {
        return None;
    }
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(test);
    let _ = fs::remove_dir_all(&folder);
    let status = Command::new(env::current_exe().unwrap())
        .args(["--exact", &format!("promise::{test}")])
        .env(CHILD, "1")
        .env("PAROPS_PROMISES", &folder)
        .output()
        .unwrap()
        .status;
    assert!(status.success(), "{status}");
    Some(fs::read_to_string(folder.join("report.tsv")).unwrap())
}

/// Whether a promise is broken, which is not to end the test.
fn broken(promise: impl FnOnce() + panic::UnwindSafe) -> bool {
    panic::catch_unwind(promise).is_err()
}

#[test]
fn every_verb_records_bound_value_verdict_and_test() {
    let Some(text) = recorded("every_verb_records_bound_value_verdict_and_test") else {
        Promise::new("A", "at most").at_most(0.5, 0.25);
        Promise::new("A", "at least").at_least(1e-9, 2e-9);
        Promise::new("A", "within").within(1.9, 2.1, 2.0);
        Promise::new("A", "in units").in_units("eps", f64::EPSILON).at_most(16.0, 2.0 * f64::EPSILON);
        Promise::new("A", "nothing of nothing").in_units("size", 0.0).at_most(8.0, 0.0);
        Promise::new("A", "short").short_of(1.0, "too slow").at_most(2.0, 1.5);
        Promise::new("A", "no longer short").short_of(1.0, "too slow").at_most(2.0, 0.5);
        Promise::new("A", "equal").equal(&[1, 2][..], &[1, 2]);
        Promise::new("A", "holds").holds(true);
        Promise::new("A", "case").case("one of many").at_most(1.0, 0.5);
        Promise::new("A", "computed bound").at_most(0.1 + 0.2, 0.25);
        return;
    };
    let expected = [
        "at most\t<= 0.5\t0.25\theld",
        "at least\t>= 1e-9\t2.0e-9\theld",
        "within\t1.9 to 2.1\t2.0\theld",
        "in units\t<= 16 eps\t2.0\theld",
        "nothing of nothing\t<= 8 size\t0\theld",
        "short\t<= 2, aim 1\t1.5\tshort: too slow",
        "no longer short\t<= 2, aim 1\t0.50\theld",
        "equal\tequal\tequal\theld",
        "holds\talways\talways\theld",
        "case\t<= 1\t0.50\theld",
        "computed bound\t<= 0.3\t0.25\theld",
    ];
    let test = "report::promise::every_verb_records_bound_value_verdict_and_test";
    assert_eq!(text.lines().collect::<Vec<_>>(), expected.map(|line| format!("A\t{line}\t{test}")));
}

#[test]
fn broken_promises_are_recorded_before_they_panic() {
    let Some(text) = recorded("broken_promises_are_recorded_before_they_panic") else {
        assert!(broken(|| Promise::new("A", "at most").at_most(0.5, 0.75)));
        assert!(broken(|| Promise::new("A", "no number").at_most(0.5, f64::NAN)));
        assert!(broken(|| Promise::new("A", "at least").at_least(0.5, 0.25)));
        assert!(broken(|| Promise::new("A", "within").within(1.0, 2.0, 2.5)));
        assert!(broken(|| Promise::new("A", "equal").equal(&1, &2)));
        assert!(broken(|| Promise::new("A", "holds").holds(false)));
        assert!(broken(|| Promise::new("A", "no bound").at_most(f64::INFINITY, 1.0)));
        assert!(broken(|| Promise::new("A", "no bound below").at_least(f64::NEG_INFINITY, 1.0)));
        assert!(broken(|| Promise::new("A", "no unit").in_units("cond", f64::INFINITY).at_most(4.0, 1.0)));
        return;
    };
    assert_eq!(text.lines().count(), 9);
    assert!(text.lines().all(|line| line.split('\t').nth(4) == Some("broken")), "{text}");
    let found = Verification::from_lines(text.lines()).unwrap();
    assert_eq!(found.broken().count(), 9);
}

#[test]
fn repeated_promises_keep_the_worst_and_one_bound() {
    let Some(text) = recorded("repeated_promises_keep_the_worst_and_one_bound") else {
        for i in 0..1000_u32 {
            let up_and_down = f64::from((i * 7919) % 1000);
            Promise::new("A", "repeated").at_most(1000.0, up_and_down);
            Promise::new("A", "repeated from below").at_least(-1.0, up_and_down);
        }
        assert!(broken(|| Promise::new("A", "repeated").at_most(2000.0, 1.0)));
        return;
    };
    let last = |name: &str| {
        let name = format!("A\t{name}\t");
        text.lines().rfind(|line| line.starts_with(&name)).unwrap().split('\t').nth(3).unwrap().to_string()
    };
    assert_eq!((last("repeated"), last("repeated from below")), ("999".into(), "0".into()));
    assert!(text.lines().count() < 50, "{text}");
}

#[test]
fn broken_promises_name_their_case() {
    // A thread without the name of a test records nothing.
    let message = |promise: fn(&Promise)| {
        let broken = thread::spawn(move || promise(&Promise::new("A", "short").case("third"))).join();
        *broken.unwrap_err().downcast::<String>().unwrap()
    };
    assert_eq!(message(|promise| promise.at_most(0.5, 0.75)), "A: short (third): 7.5e-1 is not <= 0.5");
    assert_eq!(message(|promise| promise.holds(false)), "A: short (third)");
    assert!(message(|promise| promise.equal(&1, &2)).starts_with("A: short (third)\n"));
}

/// Lines of a small table; the digits of the last are not in order of text.
const LINES: [&str; 4] = [
    "B\tM10 ten\t<= 1\t0.5\theld\tt::ten",
    "B\tM2 two\tequal\tequal\theld\tt::two",
    "A\tsmall\t<= 1e-12 eps\t0\theld\tt::small",
    "B\tM2 two\tequal\tequal\theld\tt::again",
];

#[test]
fn pages_that_differ_in_anything_but_measured_values_are_found_out() {
    let shown = Verification::from_lines(LINES).unwrap();
    let page = format!("# Title\n\nText | with | bars |\n\n{shown}");
    assert_eq!(shown.differences(&page), [""; 0]);
    assert_eq!(shown.differences(&page.replace("| 0.5 |", "| 0.75 |")), [""; 0]);
    let order = ["small", "two", "again", "ten"].map(|test| page.find(&format!("t::{test} |")).unwrap());
    assert!(order[0] < order[2] && order[2] < order[1] && order[1] < order[3], "{page}");

    let differ = |from: &str, to: &str| {
        assert!(page.contains(from));
        shown.differences(&page.replacen(from, to, 1))
    };
    assert_eq!(differ("<= 1 |", "<= 2 |"), ["bound was \"<= 2\", is \"<= 1\": B: M10 ten (t::ten)"]);
    assert_eq!(
        differ("held | t::ten", "short: slow | t::ten"),
        ["verdict was \"short: slow\", is \"held\": B: M10 ten (t::ten)"]
    );
    assert_eq!(
        differ("t::ten", "t::other"),
        ["not in the page: B: M10 ten (t::ten)", "shown by no test: B: M10 ten (t::other)"]
    );
    assert_eq!(differ("## A", "## C").len(), 2);
    let without: String =
        page.lines().filter(|line| !line.contains("t::again")).map(|line| format!("{line}\n")).collect();
    assert_eq!(shown.differences(&without), ["not in the page: B: M2 two (t::again)"]);
    let fewer = Verification::from_lines(LINES[..3].iter().copied()).unwrap();
    assert_eq!(fewer.differences(&page), ["shown by no test: B: M2 two (t::again)"]);
    assert_eq!(shown.differences("").len(), 4);
}

#[test]
fn pages_that_state_more_than_promises_or_what_their_bounds_exclude_are_found_out() {
    let shown = Verification::from_lines(LINES).unwrap();
    let page = format!("# Title\n\nText\n\n{shown}");
    let ten = "| M10 ten | <= 1 | 0.5 | held | t::ten |";
    let with = |line: &str| shown.differences(&page.replace(ten, &format!("{line}\n{ten}")));
    assert_eq!(with("all is well"), ["no promise: \"all is well\""]);
    for row in
        ["| M9 nine | <= 1 | 0.5 | held |", "| M9 nine | <= 1 | 0.5 | held | t::nine | ", "|M9|<= 1|0.5|held|t::nine|"]
    {
        assert_eq!(with(row), [format!("no promise: \"{row}\"")]);
    }
    assert_eq!(with(ten), ["stated twice: B: M10 ten (t::ten)"]);
    let measured = |value: &str| shown.differences(&page.replace("| 0.5 |", &format!("| {value} |"))).len();
    // Two digits may lie beyond the bound by half of the second.
    assert_eq!(["0.99", "1.0", "1.1", "99", "NaN", "low"].map(measured), [0, 0, 1, 1, 1, 1]);

    let lines = ["A\tlow\t>= 2, aim 3\t2.5\tshort: slow\tt::low", "A\tband\t1.9 to 2.1\t2.0\theld\tt::band"];
    let shown = Verification::from_lines(lines.into_iter().chain(LINES)).unwrap();
    let page = shown.to_string();
    assert_eq!(shown.differences(&page), [""; 0]);
    for (from, to) in [
        ("| 2.5 |", "| 1.8 |"),
        ("| 2.0 |", "| 2.3 |"),
        ("| 2.0 |", "| 1.7 |"),
        ("| equal | equal |", "| equal | differs |"),
    ] {
        assert_eq!(shown.differences(&page.replacen(from, to, 1)).len(), 1, "{from} {to}");
    }
}

#[test]
fn values_worse_by_a_factor_of_two_are_told() {
    let lines = ["A\tat most\t<= 9\t4.0\theld\tt::one", "A\tat least\t>= 1\t2.0\theld\tt::one"];
    let shown = Verification::from_lines(lines).unwrap();
    let page = shown.to_string();
    let stated = |from: &str, to: &str| shown.worsened(&page.replace(from, to));
    assert_eq!(stated("| 4.0 |", "| 2.1 |"), [""; 0]);
    assert_eq!(stated("| 4.0 |", "| 2.0 |"), ["was 2.0, is 4.0: A: at most (t::one)"]);
    assert_eq!(stated("| 4.0 |", "| 0 |").len(), 1);
    assert_eq!(stated("| 4.0 |", "| 8.0 |"), [""; 0]);
    assert_eq!(stated("| 2.0 |", "| 3.9 |"), [""; 0]);
    assert_eq!(stated("| 2.0 |", "| 4.0 |"), ["was 4.0, is 2.0: A: at least (t::one)"]);
}

#[test]
fn lines_that_are_none_are_refused() {
    assert!(Verification::from_lines([]).unwrap_err().contains("no promise"));
    assert!(Verification::from_lines(["A\tonly\tthree"]).unwrap_err().contains("not six fields"));
    assert!(Verification::read(&PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("no such folder")).is_err());
    // Of lines with the same promise and test the last counts, unless one is broken.
    let later = LINES[0].replace("held", "broken");
    assert_eq!(Verification::from_lines([LINES[0], &later]).unwrap().broken().count(), 1);
    assert_eq!(Verification::from_lines([later.as_str(), LINES[0]]).unwrap().broken().count(), 1);
}

#[test]
fn promises_that_differ_in_a_fraction_are_two() {
    let jitters = ["A\tjitter 0.05\t<= 1\t2\tbroken\tt::one", "A\tjitter 0.5\t<= 1\t0.5\theld\tt::one"];
    let shown = Verification::from_lines(jitters).unwrap();
    assert_eq!((shown.broken().count(), shown.to_string().lines().count()), (1, 6));
}
