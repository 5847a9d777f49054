//! Lines of a terminal's width, with a name in front where one helps.

/// Columns of a line.
pub const WIDTH: usize = 80;
/// Columns of a name in front.
const NAME_WIDTH: usize = 11;

/// A report in the making, on lines of at most 80 columns.
#[derive(Clone, Debug, Default)]
pub struct Page {
    /// What has been added, every line ended by a newline.
    pub text: String,
}

impl Page {
    /// Adds a line, cut to the width of the page.
    pub fn line(&mut self, line: String) {
        // What other programs wrote into a log must not command a terminal.
        let line: String = line.chars().map(|c| if c.is_control() { '?' } else { c }).collect();
        let mut kept: String = line.chars().take(WIDTH).collect();
        if kept.len() < line.len() {
            kept.truncate(kept.char_indices().nth(WIDTH - 3).map_or(kept.len(), |(at, _)| at));
            kept.push_str("...");
        }
        self.text.push_str(kept.trim_end());
        self.text.push('\n');
    }

    /// Adds text with a name in front, on as many lines as it needs.
    pub fn named(&mut self, name: &str, text: &str) {
        let mut name = name;
        for line in wrap(text, WIDTH - NAME_WIDTH) {
            self.line(format!("{name:<NAME_WIDTH$}{line}"));
            name = "";
        }
    }

    /// Adds text without a name, on as many lines as it needs.
    pub fn paragraph(&mut self, text: &str) {
        wrap(text, WIDTH).into_iter().for_each(|line| self.line(line));
    }
}

/// Lines of at most `width` columns that end between words: the first begins as `text` does, those after it are indented by two.
fn wrap(text: &str, width: usize) -> Vec<String> {
    let words = text.trim_start_matches(' ');
    let mut lines = vec![" ".repeat(text.len() - words.len())];
    for word in words.split(' ') {
        let last = lines.last_mut().expect("there is a line");
        let is_begun = !last.trim_start().is_empty();
        if is_begun && last.chars().count() + 1 + word.chars().count() > width {
            lines.push(format!("  {word}"));
            continue;
        }
        if is_begun {
            last.push(' ');
        }
        last.push_str(word);
    }
    lines
}

/// How many of `count` entries are shown where there is room for `most`: all, if the line that says how many are hidden would hide
/// one only.
pub fn shown(count: usize, most: usize) -> usize {
    if count == most + 1 { count } else { count.min(most) }
}
