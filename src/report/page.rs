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
    pub fn wrapped(&mut self, name: &str, text: &str) {
        let (mut name, mut line) = (name, String::new());
        for word in text.split(' ') {
            if !line.is_empty() && NAME_WIDTH + line.len() + 1 + word.len() > WIDTH {
                self.named(name, std::mem::replace(&mut line, "  ".to_owned()));
                name = "";
            } else if !line.is_empty() {
                line.push(' ');
            }
            line.push_str(word);
        }
        self.named(name, line);
    }

    /// Adds a line with a name in front.
    pub fn named(&mut self, name: &str, text: String) {
        self.line(format!("{name:<NAME_WIDTH$}{text}"));
    }
}
