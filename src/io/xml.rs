//! Names as XML attributes.

use std::fmt;

use crate::error::{IoError, Result};

/// Refuses a name that is empty, that another of `earlier` has, or that an attribute cannot hold as it is: control
/// characters are illegal or read back as spaces, U+FFFE and U+FFFF are no characters of XML.
pub(super) fn check_name<'a>(name: &str, mut earlier: impl ExactSizeIterator<Item = &'a str>) -> Result<()> {
    let entry = earlier.len();
    if name.is_empty() {
        return Err(IoError::Unnamed { entry }.into());
    }
    let illegal = |c: char| c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}');
    if let Some((place, character)) = name.chars().enumerate().find(|&(_, c)| illegal(c)) {
        return Err(IoError::Name { entry, place, character }.into());
    }
    match earlier.position(|other| other == name) {
        Some(first) => Err(IoError::Repeated { entry, first }.into()),
        None => Ok(()),
    }
}

/// Text as it stands in an element or an attribute; of a name, a legal one.
pub(crate) struct Escaped<'a>(pub(crate) &'a str);

impl fmt::Display for Escaped<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.chars().try_for_each(|c| match c {
            '&' => f.write_str("&amp;"),
            '<' => f.write_str("&lt;"),
            '>' => f.write_str("&gt;"),
            '"' => f.write_str("&quot;"),
            _ => write!(f, "{c}"),
        })
    }
}
