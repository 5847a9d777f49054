//! Foreign text in words for people: file names, keys, what a service said.

use std::borrow::Cow;

/// Longest piece of foreign text that a line repeats, in characters.
const LONGEST: usize = 200;

/// `text` fit for one line on a terminal: what a terminal would obey instead of showing it (control characters, changes of
/// the writing direction, characters without a width) is escaped, and more than 200 characters are shortened in the middle.
///
/// ```
/// use palpate::printable;
///
/// assert_eq!(printable("scenes/Herz ü.toml"), "scenes/Herz ü.toml");
/// assert_eq!(printable("a\n\u{1b}[2Jb\u{202e}c"), r"a\n\u{1b}[2Jb\u{202e}c");
/// assert_eq!(printable(&"x".repeat(5_000_000)).chars().count(), 200);
/// ```
///
/// # Real-time
/// Not for a tick: may allocate.
pub fn printable(text: &str) -> Cow<'_, str> {
    within(text, LONGEST)
}

/// [`printable`] with at most `longest` characters.
pub(crate) fn within(text: &str, longest: usize) -> Cow<'_, str> {
    let is_long = text.len() > longest && text.chars().nth(longest).is_some();
    if !is_long && !text.contains(is_obeyed) {
        return Cow::Borrowed(text);
    }
    if !is_long {
        let escaped = escaped(text.chars());
        // Escapes are longer than what they stand for.
        let is_within = escaped.len() <= longest || escaped.chars().nth(longest).is_none();
        return Cow::Owned(if is_within { escaped } else { shortened(&escaped, longest) });
    }
    // Whatever is farther from both ends cannot be seen.
    let end = text.chars().rev().take(longest).collect::<Vec<_>>().into_iter().rev();
    let ends: String = text.chars().take(longest).chain(end).collect();
    Cow::Owned(shortened(&escaped(ends.chars()), longest))
}

/// The first and last characters of `text`, `longest` in all with what stands for the rest.
fn shortened(text: &str, longest: usize) -> String {
    let kept = longest.saturating_sub(1);
    let byte_of = |index: Option<(usize, char)>| index.map_or(0, |(byte, _)| byte);
    let head = byte_of(text.char_indices().nth(kept - kept / 2));
    let tail = byte_of(text.char_indices().rev().nth((kept / 2).saturating_sub(1)));
    format!("{}…{}", &text[..head], &text[tail..])
}

fn escaped(text: impl Iterator<Item = char>) -> String {
    let mut shown = String::new();
    for c in text {
        if is_obeyed(c) { shown.extend(c.escape_debug()) } else { shown.push(c) }
    }
    shown
}

/// True for a character that does something in place of being seen.
fn is_obeyed(c: char) -> bool {
    let is_format = matches!(c, '\u{ad}' | '\u{61c}' | '\u{180e}' | '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}'
        | '\u{2060}'..='\u{206f}' | '\u{feff}' | '\u{fff9}'..='\u{fffb}' | '\u{e0000}'..='\u{e007f}');
    c.is_control() || is_format
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_terminal_obeys_is_escaped_and_the_rest_stays() {
        for plain in ["", "scene.toml", "C:\\Ä\\\"x\" 'y'.toml", "e\u{301} 漢字"] {
            assert!(matches!(printable(plain), Cow::Borrowed(same) if same == plain), "{plain:?}");
        }
        let hostile = "\0\t\r\n\u{1b}]0;x\u{7}\u{7f}\u{9b}31m\u{2028}\u{200f}\u{2066}\u{feff}\u{e0041}";
        let shown = printable(hostile);
        assert!(!shown.contains(is_obeyed) && shown.is_ascii(), "{shown}");
        assert_eq!(printable("a\nb"), "a\\nb");
    }

    #[test]
    fn long_text_keeps_both_ends() {
        let exactly = "ä".repeat(LONGEST);
        assert_eq!(printable(&exactly), exactly);
        for long in [format!("first{}last", "ü".repeat(1_000_000)), format!("first{}last", "\n".repeat(150))] {
            let shown = printable(&long);
            assert_eq!(shown.chars().count(), LONGEST);
            assert!(shown.starts_with("first") && shown.ends_with("last") && shown.contains('…'), "{shown}");
        }
    }
}
