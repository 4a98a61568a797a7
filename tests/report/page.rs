//! The page: escaped, complete, and without a way to the network.

use parops::report::{Page, Sample, Seconds, Table, machine};
use parops::{ErrorKind, ReportError};

const SVG: &str =
    "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 9 9\"><circle cx=\"4\" cy=\"4\" r=\"3\"/></svg>\n";
const NASTY: &str = "<script>alert(\"1 & 2\")</script>";

fn table() -> Table {
    let mut table = Table::default();
    for (scene, method, error_l2, step) in [
        (NASTY, "slow", 1e-3, 2.0),
        (NASTY, "fast", 2e-3, 1.0),
        (NASTY, "poor", 0.5, 3.0),
        ("second", NASTY, 1e-9, 1.0),
    ] {
        let seconds = Seconds { step, ..Seconds::default() };
        table.push(Sample { error_l2, seconds, ..Sample::new(scene, 2, "jittered", method, 4) }).unwrap();
    }
    table
}

fn html(page: &Page) -> String {
    let mut bytes = Vec::new();
    page.write(&mut bytes).unwrap();
    String::from_utf8(bytes).unwrap()
}

#[test]
fn text_is_escaped_wherever_it_stands() {
    let table = table();
    let mut page = Page::new(NASTY, &table);
    page.fact(NASTY, NASTY).note(NASTY, NASTY).unwrap().figure(NASTY, SVG).unwrap();
    let html = html(&page);
    assert!(!html.contains("<script"), "{html}");
    // Title twice, fact twice, heading, note, figure; the method as the cheapest for four errors and as a sample.
    assert_eq!(html.matches("&lt;script&gt;alert(&quot;1 &amp; 2&quot;)").count(), 12);
}

#[test]
fn page_has_every_scene_sample_and_fact_and_loads_nothing() {
    let table = table();
    let mut page = Page::new("title", &table);
    for (name, value) in machine() {
        page.fact(name, &value);
    }
    page.figure("second", SVG).unwrap();
    let html = html(&page);
    assert_eq!((html.matches("<section>").count(), html.matches("<h2>").count()), (2, 2));
    assert!(html.contains("<figure data-scene=\"second\" data-samples=\"1\">") && html.contains("<circle cx=\"4\""));
    assert!(html.contains(env!("CARGO_PKG_VERSION")) && html.contains(std::env::consts::ARCH));
    // The cheapest for 1e-2 is fast, for 1e-4 in the first scene nothing.
    assert!(html.contains("fast 4, N = 0: 1.00 s") && html.contains("not reached"));
    let front = html.matches("<tr class=\"front\">").count();
    assert_eq!((html.matches("<tr><td>2D").count() - 2, front), (1, 3));
    for loading in ["src=", "href=", "@import", "url(", "<link", "<script"] {
        assert!(!html.contains(loading), "{loading}");
    }
    assert_eq!(html.matches("http").count(), 1, "the namespace of the figure alone");
}

#[test]
fn figures_and_notes_without_scene_and_figures_that_are_no_svg_are_refused() {
    let table = table();
    let mut page = Page::new("title", &table);
    page.figure("second", SVG).unwrap();
    let before = html(&page);
    let refused = |result: parops::Result<&mut Page>| result.map(|_| ()).unwrap_err().kind().clone();
    let kind = refused(page.figure("third", SVG));
    assert_eq!(kind, ErrorKind::Report(ReportError::NoSamples { item: "figure", place: 1 }));
    let kind = refused(page.note("third", "FAILS"));
    assert_eq!(kind, ErrorKind::Report(ReportError::NoSamples { item: "note", place: 0 }));
    for text in ["", "<p></p>", "<svg>", "</svg>"] {
        assert_eq!(refused(page.figure("second", text)), ErrorKind::Report(ReportError::NotSvg { figure: 1 }));
    }
    assert_eq!(html(&page), before);
}
