//! Names for what a figure shows, so that a check of the page can count it: `class="mark"` with the number of its sample,
//! `class="curve"` and `class="front"` with those of the samples that they join, and on the drawing how many of each.

/// What is drawn, in the order of drawing, by the numbers of the samples.
pub enum Series {
    /// A line with a mark a sample; of one sample the mark alone.
    Curve(Vec<usize>),
    /// Dashes alone; none where there is one sample.
    Front(Vec<usize>),
}

/// The drawing with names; refused unless it shows these series, each with all of its marks.
pub fn tag(svg: &str, series: &[Series]) -> Result<String, String> {
    let (mut lines, mut out) = (svg.lines().peekable(), String::with_capacity(2 * svg.len()));
    let [mut marks, mut curves, mut fronts] = [0; 3];
    for one in series {
        let (Series::Curve(samples) | Series::Front(samples)) = one;
        let front = matches!(one, Series::Front(_));
        if samples.is_empty() || front && samples.len() < 2 {
            continue;
        }
        let starts: fn(&str) -> bool = if front { dash } else { |line| stroke(line, 2) };
        while let Some(line) = lines.next_if(|line| !starts(line)) {
            push(&mut out, line);
        }
        let numbers = samples.iter().map(usize::to_string).collect::<Vec<_>>().join(" ");
        if front {
            push(&mut out, &format!("<g class=\"front\" data-samples=\"{numbers}\">"));
            let before = out.len();
            while let Some(line) = lines.next_if(|line| dash(line)) {
                push(&mut out, line);
            }
            if out.len() == before {
                return Err(format!("the front of the samples {numbers} is not drawn"));
            }
            push(&mut out, "</g>");
            fronts += 1;
            continue;
        }
        let line = lines.next().ok_or(format!("the curve of the samples {numbers} is not drawn"))?;
        // A line to nowhere is its mark alone.
        if samples.len() > 1 {
            push(&mut out, &line.replacen(' ', &format!(" class=\"curve\" data-samples=\"{numbers}\" "), 1));
            curves += 1;
        } else {
            push(&mut out, line);
        }
        for sample in samples {
            let line = lines.next_if(|line| mark(line)).ok_or(format!("sample {sample} has no mark"))?;
            push(&mut out, &line.replacen(' ', &format!(" class=\"mark\" data-sample=\"{sample}\" "), 1));
            marks += 1;
            // The other stroke of a cross.
            if line.starts_with("<line") {
                lines.next_if(|line| line.starts_with("<line")).into_iter().for_each(|line| push(&mut out, line));
            }
        }
    }
    lines.for_each(|line| push(&mut out, line));
    let counts = format!("<svg data-marks=\"{marks}\" data-curves=\"{curves}\" data-fronts=\"{fronts}\"");
    Ok(out.replacen("<svg", &counts, 1))
}

fn push(out: &mut String, line: &str) {
    out.push_str(line);
    out.push('\n');
}

fn mark(line: &str) -> bool {
    ["<circle", "<polygon", "<rect", "<line"].iter().any(|shape| line.starts_with(shape))
}

/// Axes are of width 1 and black, a front of width 1 and nearly black.
fn stroke(line: &str, width: u32) -> bool {
    line.starts_with("<polyline") && line.contains(&format!("stroke-width=\"{width}\""))
}

fn dash(line: &str) -> bool {
    stroke(line, 1) && !line.contains("stroke=\"#000000\"")
}
