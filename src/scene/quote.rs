//! Pieces of a user's file inside an error message.

/// Longest piece that a message repeats, in characters.
const LONGEST: usize = 40;

/// `text` in quotes, shortened, control characters escaped: it never breaks the line it is put in.
pub(super) fn quoted(text: &str) -> String {
    let mut short: String = text.chars().take(LONGEST).collect();
    if short.len() < text.len() {
        short.push('…');
    }
    format!("{short:?}")
}
