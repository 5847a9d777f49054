//! Strings of JSON for documents that are written piece by piece.

use std::fmt::{self, Display, Formatter, Write};

/// A JSON string with its quotes. What could end a script element or begin a comment is escaped too, so that it may stand in a
/// page.
pub(crate) struct JsonString<'a>(pub(crate) &'a str);

impl Display for JsonString<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.write_char('"')?;
        for c in self.0.chars() {
            match c {
                '"' | '\\' => write!(f, "\\{c}")?,
                '<' | '>' | '&' | '\u{2028}' | '\u{2029}' => write!(f, "\\u{:04x}", u32::from(c))?,
                c if c.is_control() => write!(f, "\\u{:04x}", u32::from(c))?,
                c => f.write_char(c)?,
            }
        }
        f.write_char('"')
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strings_are_escaped_and_no_text_ends_a_script_around_it() {
        assert_eq!(
            JsonString("a \"b\" \\ \n\u{7f}é\u{1f600}").to_string(),
            "\"a \\\"b\\\" \\\\ \\u000a\\u007fé\u{1f600}\""
        );
        assert_eq!(JsonString("</script>&\u{2028}").to_string(), "\"\\u003c/script\\u003e\\u0026\\u2028\"");
    }
}
