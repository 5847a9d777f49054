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

/// Lines of at most `width` columns, those after the first indented by two, that end between words.
fn wrap(text: &str, width: usize) -> Vec<String> {
    let mut lines = vec![String::new()];
    for word in text.split(' ') {
        let last = lines.last_mut().expect("there is a line");
        if !last.is_empty() && last.chars().count() + 1 + word.chars().count() > width {
            lines.push(format!("  {word}"));
            continue;
        }
        if !last.is_empty() {
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
