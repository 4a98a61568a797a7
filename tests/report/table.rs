//! What a table refuses, which orders it sees, and its way to CSV and back.

use parops::report::{HEADER, Sample, Seconds, Table, observed_order};
use parops::{ErrorKind, IoError, ReportError};

fn sample(method: &str, h: f64, error_l2: f64) -> Sample {
    Sample { h, error_l2, ..Sample::new("laplacian", 2, "jittered", method, 4) }
}

fn refusal(result: parops::Result<impl std::fmt::Debug>) -> ReportError {
    match result.unwrap_err().kind() {
        ErrorKind::Report(kind) => *kind,
        other => panic!("{other}"),
    }
}

#[test]
fn observed_order_of_a_power_is_its_exponent() {
    for order in [-1.0, 0.5, 4.0, 8.0_f64] {
        let error = |h: f64| 3.0 * h.powf(order);
        let observed = observed_order([0.1, 0.07], [error(0.1), error(0.07)]).unwrap();
        // Four roundings of errors and sizes and the logarithms, over ln(0.1 / 0.07) = 0.36.
        assert!((observed - order).abs() <= 32.0 * f64::EPSILON * (1.0 + order.abs()), "{observed}");
    }
}

#[test]
fn observed_order_without_a_ratio_is_none() {
    for (sizes, errors) in [([0.1, 0.1], [1.0, 0.5]), ([0.1, 0.05], [1.0, 0.0]), ([0.1, 0.05], [f64::NAN, 1.0])] {
        assert_eq!(observed_order(sizes, errors), None);
    }
}

#[test]
fn order_is_observed_within_a_series_by_h_and_else_by_dt() {
    let mut table = Table::default();
    assert_eq!(table.push(sample("a", 0.2, 16.0)).unwrap().observed_order, None);
    assert_eq!(table.push(sample("b", 0.1, 5.0)).unwrap().observed_order, None);
    let fine = table.push(sample("a", 0.1, 1.0)).unwrap().observed_order.unwrap();
    assert!((fine - 4.0).abs() <= 8.0 * f64::EPSILON, "{fine}");
    let stepped = |dt: f64, error: f64| Sample { dt: Some(dt), stepper: "euler".into(), ..sample("c", 0.1, error) };
    table.push(stepped(0.2, 2.0)).unwrap();
    let fine = table.push(stepped(0.1, 1.0)).unwrap().observed_order.unwrap();
    assert!((fine - 1.0).abs() <= 4.0 * f64::EPSILON, "{fine}");
    let given = Sample { observed_order: Some(-3.0), ..sample("a", 0.05, 1.0) };
    assert_eq!(table.push(given).unwrap().observed_order, Some(-3.0));
}

#[test]
fn relative_errors_are_by_hand() {
    let mut sample = sample("a", 0.1, 0.0);
    sample.errors([1.0, 2.0, 3.0], [1.0, 2.5, 1.0]);
    assert!((sample.error_l2 - (4.25_f64 / 8.25).sqrt()).abs() < 4.0 * f64::EPSILON);
    assert_eq!(sample.error_linf, 2.0 / 2.5);
    sample.errors([3.0, -4.0], [0.0, 0.0]);
    assert_eq!((sample.error_l2, sample.error_linf), (5.0, 4.0));
    sample.errors([f64::NAN, 1.0], [1.0, 1.0]);
    assert!(sample.error_l2.is_nan() && sample.error_linf.is_nan());
    sample.errors([1.0, 2e200], [1e200, 1e200]);
    assert_eq!((sample.error_l2, sample.error_linf), (1.0, 1.0));
    sample.errors([3e-200, 4e-200], [0.0, 0.0]);
    assert!((sample.error_l2 - 5e-200).abs() < 1e-215);
}

#[test]
fn values_without_their_exact_ones_have_no_error_and_are_refused() {
    let mut table = Table::default();
    for (computed, exact) in [(&[][..], &[1.0][..]), (&[1.0], &[1.0, 2.0]), (&[1.0, 2.0], &[1.0]), (&[], &[])] {
        let mut new = sample("a", 0.1, 0.0);
        new.errors(computed.iter().copied(), exact.iter().copied());
        let refused = refusal(table.push(new));
        assert!(
            matches!(refused, ReportError::Value { column: "error_l2", value, .. } if value.is_nan()),
            "{refused:?}"
        );
    }
    assert!(table.samples().is_empty());
}

#[test]
fn bad_samples_are_refused_and_change_nothing() {
    let mut table = Table::default();
    table.push(sample("a", 0.1, 1.0)).unwrap();
    let before = table.clone();
    let unnamed = table.push(sample("", 0.1, 1.0));
    assert_eq!(refusal(unnamed), ReportError::Unnamed { sample: 1, column: "method" });
    assert_eq!(
        refusal(table.push(sample("a", 0.1, -1.0))),
        ReportError::Value { sample: 1, column: "error_l2", value: -1.0 }
    );
    let bad = |seconds: Seconds| Sample { seconds, ..sample("a", 0.1, 1.0) };
    let infinite = Seconds { step: f64::INFINITY, ..Seconds::default() };
    assert!(matches!(refusal(table.push(bad(infinite))), ReportError::Value { column: "step_s", .. }));
    let nan = Sample { error_linf: f64::NAN, ..sample("a", 0.1, 1.0) };
    assert!(matches!(refusal(table.push(nan)), ReportError::Value { column: "error_linf", .. }));
    assert_eq!(table, before);
}

/// A table with every kind of cell.
fn full() -> Table {
    let mut table = Table::default();
    table.push(sample("a", 0.1, 0.1 + 0.2)).unwrap();
    let odd = Sample {
        scene: "a, \"b\"\r\nand c".into(),
        set: "\"".into(),
        stepper: " rk4,".into(),
        scalar: "f32".into(),
        n: usize::MAX,
        neighbors: 27.0 / 7.0,
        epsilon: Some(f64::MIN_POSITIVE),
        dt: Some(1e300),
        steps: u64::MAX,
        error_linf: 5e-324,
        observed_order: Some(-0.5),
        seconds: Seconds { neighbors: 1e-9, build: 0.1, apply: 1.0 / 3.0, step: 7.0 },
        peak_bytes: Some(12),
        ..sample("größer", 0.1, 0.0)
    };
    table.push(odd).unwrap();
    table
}

fn text(table: &Table) -> String {
    let mut bytes = Vec::new();
    table.write_csv(&mut bytes).unwrap();
    String::from_utf8(bytes).unwrap()
}

#[test]
fn csv_reads_back_bit_for_bit() {
    let table = full();
    let csv = text(&table);
    let header = "scene,dim,set,method,order,stepper,scalar,n,neighbors,h,epsilon,dt,steps,error_l2,error_linf,\
        observed_order,neighbor_s,build_s,apply_s,step_s,total_s,peak_bytes";
    assert_eq!(csv.lines().next(), Some(header));
    assert_eq!(header.split(',').collect::<Vec<_>>(), HEADER);
    assert_eq!(Table::read_csv(&csv).unwrap(), table);
    // As another program may write it: CR LF, no end of the last line, an empty line.
    let plain = text(&{
        let mut table = Table::default();
        table.push(sample("a", 0.1, 0.5)).unwrap();
        table
    });
    // Of what was not timed there is a sum and nothing else.
    assert!(plain.trim_end().ends_with(",,,,,0e0,"), "{plain}");
    let foreign = plain.trim_end().replace('\n', "\r\n\r\n");
    assert_eq!(text(&Table::read_csv(&foreign).unwrap()), plain);
}

#[test]
fn csv_faults_name_their_line() {
    let csv = text(&full());
    let refused = |text: &str| refusal(Table::read_csv(text));
    assert_eq!(refused(""), ReportError::Header { column: 0 });
    assert_eq!(refused(&csv.replacen("steps", "step", 1)), ReportError::Header { column: 12 });
    assert_eq!(refused(&csv.replacen("peak_bytes", "peak_bytes,more", 1)), ReportError::Header { column: 22 });
    assert_eq!(
        refused(&csv.replacen("laplacian,2", "laplacian,two", 1)),
        ReportError::Number { line: 2, column: "dim" }
    );
    assert_eq!(
        refused(&csv.replacen("laplacian,2", "laplacian", 1)),
        ReportError::Cells { line: 2, found: 21, needed: 22 }
    );
    assert_eq!(refused(&csv.replacen("\"\"b", "\"b", 1)), ReportError::Quote { line: 3 });
    assert_eq!(refused(&format!("{csv}\"open")), ReportError::Quote { line: 5 });
    let parts = Seconds { neighbors: 1e-9, build: 0.1, apply: 1.0 / 3.0, step: 7.0 };
    let wrong = csv.replacen(&format!("{:e}", parts.total()), "8e0", 1);
    assert_eq!(refused(&wrong), ReportError::Total { line: 3, found: 8.0, sum: parts.total() });
}

#[test]
fn failing_writer_is_reported_with_its_bytes() {
    let mut room = [0_u8; 100];
    let error = full().write_csv(&mut room.as_mut_slice()).unwrap_err();
    assert!(matches!(error.kind(), ErrorKind::Io(IoError::Write { bytes: 100, .. })), "{error}");
}
