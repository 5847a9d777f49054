//! A self-contained page: style, light and dark, print; nothing is fetched from anywhere.

use std::fmt::{self, Display, Formatter, Write};

const STYLE: &str = include_str!("page.css");

/// A page with `body`, which is HTML; `style` is added to the common one.
pub(crate) fn page(title: &str, style: &str, body: &str) -> String {
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta name=\"color-scheme\" content=\"light dark\">\n<title>{}</title>\n<style>\n{STYLE}{style}</style>\n</head>\n\
         <body>\n<main>\n{body}</main>\n</body>\n</html>\n",
        escaped(title)
    )
}

/// `text` as it must stand in HTML and in attributes.
pub(crate) fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            // Control characters are not allowed in a page.
            c if c.is_control() && c != '\n' => {
                let _ = write!(out, "\\u{{{:x}}}", c as u32);
            }
            c => out.push(c),
        }
    }
    out
}

/// A sentence with `code` between backquotes.
pub(crate) fn sentence(text: &str) -> String {
    let parts = escaped(text);
    let mut out = String::new();
    for (index, part) in parts.split('`').enumerate() {
        match index % 2 {
            1 => out.extend(["<code>", part, "</code>"]),
            _ => out.push_str(part),
        }
    }
    out
}

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
    fn text_cannot_break_out_of_the_page() {
        assert_eq!(escaped("<a b=\"c\">&\u{1}"), "&lt;a b=&quot;c&quot;&gt;&amp;\\u{1}");
        assert_eq!(sentence("`full` < `hold`"), "<code>full</code> &lt; <code>hold</code>");
        assert!(page("a<b", "", "").contains("<title>a&lt;b</title>"));
    }

    #[test]
    fn strings_are_escaped_and_no_text_ends_a_script_around_it() {
        assert_eq!(
            JsonString("a \"b\" \\ \n\u{7f}é\u{1f600}").to_string(),
            "\"a \\\"b\\\" \\\\ \\u000a\\u007fé\u{1f600}\""
        );
        assert_eq!(JsonString("</script>&\u{2028}").to_string(), "\"\\u003c/script\\u003e\\u0026\\u2028\"");
    }
}
