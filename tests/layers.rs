//! Imports point one way: every module of `src` uses only its own layer and those before it.

use parops::testing::Promise;
use std::path::{Path, PathBuf};
use std::{env, fs};

/// The layers in order; the modules of one entry may use each other.
const LAYERS: &[&[&str]] = &[
    &["scalar", "lanes", "exp", "stencil", "scale", "error"],
    &["multi_index"],
    &["kernel"],
    &["moment"],
    &["operator"],
    &["domain", "particles", "neighbors"],
    &["io"],
    &["apply"],
    &["mesh"],
    &["linear"],
    &["boundary"],
    &["time"],
    &["solver"],
    &["report"],
    &["testing"],
    &["guide"],
];

fn layer(module: &str) -> Option<usize> {
    LAYERS.iter().position(|modules| modules.contains(&module))
}

#[derive(Clone, Debug, PartialEq)]
enum Token {
    Word(String),
    Mark(char),
}

/// The tokens of a source with their lines; comments and literals are dropped, so that nothing in them counts.
fn tokens(source: &str) -> Vec<(usize, Token)> {
    let text: Vec<char> = source.chars().collect();
    let at = |i: usize| text.get(i).copied().unwrap_or('\0');
    let (mut found, mut line, mut i) = (Vec::new(), 1, 0);
    while i < text.len() {
        let start = i;
        if at(i) == '/' && at(i + 1) == '/' {
            while i < text.len() && at(i) != '\n' {
                i += 1;
            }
        } else if at(i) == '/' && at(i + 1) == '*' {
            let mut depth = 0;
            loop {
                match (at(i), at(i + 1)) {
                    ('/', '*') => (depth, i) = (depth + 1, i + 2),
                    ('*', '/') => (depth, i) = (depth - 1, i + 2),
                    _ => i += 1,
                }
                if depth == 0 || i >= text.len() {
                    break;
                }
            }
        } else if at(i) == '"' {
            i = string_end(&text, i);
        } else if at(i) == '\'' && (at(i + 1) == '\\' || at(i + 2) == '\'') {
            i += if at(i + 1) == '\\' { 3 } else { 2 };
            while i < text.len() && at(i) != '\'' {
                i += 1;
            }
            i += 1;
        } else if at(i).is_alphanumeric() || at(i) == '_' {
            while at(i).is_alphanumeric() || at(i) == '_' {
                i += 1;
            }
            let word: String = text[start..i].iter().collect();
            let hashes = text[i..].iter().take_while(|&&c| c == '#').count();
            if matches!(word.as_str(), "r" | "br" | "cr") && at(i + hashes) == '"' {
                i = raw_string_end(&text, i + hashes + 1, hashes);
            } else if word == "r" && hashes == 1 {
                i += 1; // the prefix r# of a raw identifier; its name follows
            } else {
                found.push((line, Token::Word(word)));
            }
        } else {
            if !at(i).is_whitespace() {
                found.push((line, Token::Mark(at(i))));
            }
            i += 1;
        }
        line += text[start..i.min(text.len())].iter().filter(|&&c| c == '\n').count();
    }
    found
}

fn string_end(text: &[char], quote: usize) -> usize {
    let mut i = quote + 1;
    while i < text.len() && text[i] != '"' {
        i += if text[i] == '\\' { 2 } else { 1 };
    }
    i + 1
}

fn raw_string_end(text: &[char], start: usize, hashes: usize) -> usize {
    let ends = |i: usize| text[i] == '"' && text[i + 1..].iter().take_while(|&&c| c == '#').count() >= hashes;
    (start..text.len()).find(|&i| ends(i)).map_or(text.len(), |i| i + 1 + hashes)
}

/// The names that stand directly behind the crate root, with their lines: behind `crate::`, or behind as many
/// `super::` as lead there from a file `depth` modules below the root.
fn root_names(source: &str, depth: usize) -> Vec<(usize, String)> {
    let tokens = tokens(source);
    let word = |i: usize| match tokens.get(i) {
        Some((_, Token::Word(word))) => word.as_str(),
        _ => "",
    };
    let mark = |i: usize, c: char| tokens.get(i).is_some_and(|(_, token)| *token == Token::Mark(c));
    let colons = |i: usize| mark(i, ':') && mark(i + 1, ':');
    let (mut names, mut blocks) = (Vec::new(), Vec::new());
    let mut i = 0;
    while i < tokens.len() {
        let mut head = None;
        if mark(i, '{') {
            // Inside `mod name { .. }` the root is one `super` farther away.
            blocks.push(i >= 2 && word(i - 2) == "mod");
        } else if mark(i, '}') {
            blocks.pop();
        } else if word(i) == "crate" && colons(i + 1) {
            head = Some(i + 3);
        } else if word(i) == "super" {
            let (from, mut supers) = (i, 1);
            while colons(i + 1) && word(i + 3) == "super" {
                (i, supers) = (i + 3, supers + 1);
            }
            let inline = blocks.iter().filter(|&&module| module).count();
            let own_path = from < 3 || !colons(from - 2);
            if own_path && supers == depth + inline && colons(i + 1) {
                head = Some(i + 3);
            }
        }
        if let Some(head) = head {
            heads(&tokens, head, &mut names);
        }
        i += 1;
    }
    names
}

/// The first name of a path, or of each path of a group.
fn heads(tokens: &[(usize, Token)], start: usize, names: &mut Vec<(usize, String)>) {
    let (mut nesting, mut i, mut first) = (0, start, true);
    while let Some((line, token)) = tokens.get(i) {
        match token {
            Token::Mark('{') => (nesting, first) = (nesting + 1, nesting == 0),
            Token::Mark('}') => nesting -= 1,
            Token::Mark(',') => first = nesting == 1,
            Token::Word(name) if first => {
                names.push((*line, name.clone()));
                first = false;
            }
            Token::Mark(c) if first => {
                names.push((*line, c.to_string()));
                first = false;
            }
            _ => {}
        }
        if nesting == 0 {
            return;
        }
        i += 1;
    }
}

/// What is wrong with the imports of one file, given by its path below `src`.
fn faults(file: &Path, source: &str) -> Vec<String> {
    let modules: Vec<String> = file.with_extension("").iter().map(|part| part.to_string_lossy().into_owned()).collect();
    let own = modules[0].as_str();
    let Some(own_layer) = layer(own) else {
        return vec![format!("{}: module `{own}` is not in the table of layers", file.display())];
    };
    let depth = modules.iter().filter(|&module| module != "mod").count();
    let mut faults = Vec::new();
    for (line, name) in root_names(source, depth) {
        let place = format!("{}:{line}", file.display());
        match layer(&name) {
            None => faults.push(format!("{place}: `crate::{name}` is no layer: name the layer it comes from")),
            Some(used) if used > own_layer => {
                faults.push(format!("{place}: `{own}` uses `{name}`, which stands after it"));
            }
            Some(_) => {}
        }
    }
    faults
}

fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            sources(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
}

#[test]
fn imports_point_to_earlier_layers() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    sources(&src, &mut files);
    files.sort();
    let (mut all, mut names) = (Vec::new(), 0);
    for path in &files {
        let file = path.strip_prefix(&src).unwrap();
        if file == Path::new("lib.rs") {
            continue;
        }
        let source = fs::read_to_string(path).unwrap();
        names += root_names(&source, file.components().count()).len();
        all.extend(faults(file, &source));
    }
    Promise::new("Structure", "imports point to earlier layers").case(all.join("\n")).holds(all.is_empty());
    // Every file but the lowest imports something; a reader that sees nothing must not pass.
    assert!(names >= files.len() / 2, "only {names} imports seen in {} files", files.len());
}

/// A layer below all others and one in the middle, with every way to write a path.
const PLANTED: &str = r##"
//! use crate::solver::Doc;
use crate::error::{Error, Result};
use crate::{
    multi_index::{MultiIndex, graded},
    apply::Rows, // upward, line 6
    scalar::Scalar,
};
/* use crate::solver::Comment; /* nested crate::io::X */ crate::time::Y */
/// let doc = crate::solver::Doc;
pub(crate) fn lifetime<'a>(x: &'a str) -> char {
    let text = "crate::solver::Text \" crate::time::T";
    let raw = r#"crate::io::Raw " crate::io::Raw"#;
    crate::time::step(text, raw, '"', '\'', b"crate::io::Bytes"); // upward, line 14
    'x'
}
fn bypass() -> crate::Stencil<2> {} // nameless, line 17
mod inner {
    use super::own;
    use super::super::moment::Basis; // upward, line 20
}
use super::{kernel::Kernel, solver::Run}; // upward, line 22
#[cfg(test)]
mod tests {
    use crate::r#testing::check; // upward, line 25
    use crate::*; // nameless, line 26
}
"##;

#[test]
fn upward_and_nameless_imports_are_found_wherever_they_stand() {
    let lines = |file: &str| -> Vec<String> {
        let cut = |fault: String| fault.split_once(':').unwrap().1.split(':').next().unwrap().to_string();
        faults(Path::new(file), PLANTED).into_iter().map(cut).collect()
    };
    assert_eq!(lines("kernel/mod.rs"), ["6", "14", "17", "20", "22", "25", "26"]);
    // One module deeper the single `super` of lines 20 and 22 no longer reaches the root.
    assert_eq!(lines("kernel/gauss.rs"), ["6", "14", "17", "25", "26"]);
    // From the last layer nothing is upward; what has no name stays a fault.
    assert_eq!(lines("testing.rs"), ["17", "26"]);
    assert_eq!(lines("error/mod.rs"), ["5", "6", "14", "17", "20", "22", "22", "25", "26"]);
}

#[test]
fn module_outside_the_table_is_a_fault() {
    let found = faults(Path::new("misc/mod.rs"), "");
    assert_eq!(found, ["misc/mod.rs: module `misc` is not in the table of layers"]);
}

#[test]
fn layers_beside_each_other_may_use_each_other() {
    for (file, import) in [("domain.rs", "neighbors"), ("neighbors/mod.rs", "domain"), ("scalar.rs", "stencil")] {
        assert_eq!(faults(Path::new(file), &format!("use crate::{import}::Name;")), [""; 0]);
    }
}
