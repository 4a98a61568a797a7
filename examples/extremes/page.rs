//! All cases on one page that needs nothing else: style, tables and figures are in it.

use std::fmt::Write;

use super::case::Case;

const STYLE: &str = "body{font:15px/1.45 system-ui,sans-serif;margin:2em auto;max-width:76em;padding:0 1em;color:#1b1b1b}\
h1{font-size:1.5em}h2{font-size:1.2em;margin-top:2em}table{border-collapse:collapse;width:100%}\
th,td{text-align:left;vertical-align:top;padding:.4em .6em;border-top:1px solid #ccc}th{white-space:nowrap}\
tr.fails td{background:#fde8e4}.mark{font-weight:600;white-space:nowrap}.fails .mark{color:#a5240c}\
.holds .mark{color:#1d6b37}.duty{font-weight:600}td ul{margin:0;padding-left:1.1em}.note{color:#555}svg{max-width:100%;height:auto}";

/// A figure of the page: its caption and the text of its SVG.
pub struct Figure {
    pub caption: String,
    pub svg: String,
}

/// The page.
pub fn render(cases: &[Case], figures: &[Figure]) -> String {
    let mut html = String::from("<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">");
    let held = cases.iter().filter(|case| case.holds()).count();
    // Writing to a string does not fail.
    let _ = write!(
        html,
        "<title>Stiff and extreme cases</title><style>{STYLE}</style></head><body>\n<h1>Stiff and extreme cases</h1>\n\
         <p>{held} of {} cases end as documented (parops {}).</p>\n",
        cases.len(),
        env!("CARGO_PKG_VERSION")
    );
    let mut from = 0;
    while let Some(first) = cases.get(from) {
        let count = cases[from..].iter().take_while(|case| case.catalogue == first.catalogue).count();
        let _ = writeln!(
            html,
            "<h2>{}</h2>\n<table>\n<tr><th>#</th><th>set-up</th><th>a naive method</th><th>parops</th><th>verdict</th></tr>",
            escaped(first.catalogue)
        );
        cases[from..from + count].iter().for_each(|case| row(&mut html, case));
        html.push_str("</table>\n");
        from += count;
    }
    for Figure { caption, svg } in figures {
        let _ = writeln!(html, "<h2>{}</h2>\n<figure>{}</figure>", escaped(caption), inline(svg));
    }
    html.push_str("</body></html>\n");
    html
}

fn row(html: &mut String, case: &Case) {
    let class = if case.holds() { "holds" } else { "fails" };
    let _ = write!(
        html,
        "<tr class=\"{class}\"><td>{}</td><td><b>{}</b><br>{}</td><td>{}</td><td><ul>",
        case.number,
        escaped(case.title),
        escaped(&case.setup),
        escaped(&case.naive)
    );
    for outcome in &case.outcomes {
        let mark = if outcome.met { "" } else { "NOT " };
        let _ = write!(
            html,
            "<li><span class=\"duty\">{mark}{}</span>: {}</li>",
            outcome.duty.name(),
            escaped(&outcome.text)
        );
    }
    if let Some(reason) = case.not_offered {
        let _ = write!(html, "<li class=\"note\">not offered: {}</li>", escaped(reason));
    }
    let _ = writeln!(html, "</ul></td><td class=\"mark\">{}</td></tr>", escaped(&case.verdict()));
}

/// An SVG as part of a page: without what may only stand at the head of a file.
fn inline(svg: &str) -> &str {
    svg.find("<svg").map_or("", |from| &svg[from..])
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}
