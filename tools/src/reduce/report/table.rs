//! A table as text and as HTML: its columns are as wide as what is in them.

use std::fmt::Write;

use crate::drawing::html::{escaped, sentence};

/// Columns of the terminal.
pub(super) const WIDTH: usize = 100;
/// Between columns, where there is room for it; else one.
const GAP: usize = 2;
/// What stays on the line of its figure.
const UNITS: [&str; 4] = ["%", "mm", "Hz", "N/m"];

/// A table; every row has as many cells as there are columns, and the first column is a name.
#[derive(Clone, Debug, Default)]
pub(super) struct Table {
    pub(super) title: String,
    pub(super) columns: Vec<Column>,
    pub(super) rows: Vec<Vec<String>>,
}

/// A column's head, its lines separated by newlines, and what it means.
#[derive(Clone, Debug, Default)]
pub(super) struct Column {
    pub(super) head: String,
    pub(super) meaning: String,
}

impl Column {
    pub(super) fn new(head: impl Into<String>, meaning: impl Into<String>) -> Self {
        Self { head: head.into(), meaning: meaning.into() }
    }
}

impl Table {
    /// Takes a column out.
    pub(super) fn drop_column(&mut self, column: usize) {
        self.columns.remove(column);
        self.rows.iter_mut().for_each(|row| drop(row.remove(column)));
    }

    /// The table as text, every line ended by a newline.
    pub(super) fn to_text(&self) -> String {
        let heads: Vec<Vec<&str>> = self.columns.iter().map(|column| column.head.split('\n').collect()).collect();
        let high = heads.iter().map(Vec::len).max().unwrap_or(0);
        let width = |at: usize| {
            let cells = self.rows.iter().filter_map(|row| row.get(at)).map(String::as_str);
            cells.chain(heads[at].iter().copied()).map(|cell| cell.chars().count()).max().unwrap_or(0)
        };
        let widths: Vec<usize> = (0..self.columns.len()).map(width).collect();
        let wide = |gap: usize| widths.iter().map(|width| width + gap).sum::<usize>() <= WIDTH + gap;
        let gap = if wide(GAP) { GAP } else { 1 };
        let line = |cells: &mut dyn Iterator<Item = &str>| {
            let mut line = String::new();
            for (at, (cell, width)) in cells.zip(&widths).enumerate() {
                // Writing to a string cannot fail.
                let _ = match at {
                    0 => write!(line, "{cell:<width$}"),
                    _ => write!(line, "{cell:>width$}", width = width + gap),
                };
            }
            format!("{}\n", line.trim_end())
        };
        let mut text = String::new();
        if !self.title.is_empty() {
            text.push_str(&wrapped(&self.title));
        }
        for number in 0..high {
            // Heads of fewer lines stand at the bottom.
            let mut words = heads.iter().map(|head| (number + head.len()).checked_sub(high).map_or("", |at| head[at]));
            text.push_str(&line(&mut words));
        }
        for row in &self.rows {
            text.push_str(&line(&mut row.iter().map(String::as_str)));
        }
        text
    }

    /// The table as HTML, without its title.
    pub(super) fn to_html(&self) -> String {
        let label = escaped(&self.title);
        let mut html =
            format!("<div class=\"wide\" tabindex=\"0\" role=\"region\" aria-label=\"{label}\"><table>\n<thead><tr>");
        for column in &self.columns {
            let head = column.head.split('\n').map(escaped).collect::<Vec<_>>().join("<br>");
            let _ = match column.meaning.is_empty() {
                true => write!(html, "<th scope=\"col\">{head}</th>"),
                false => write!(html, "<th scope=\"col\" title=\"{}\">{head}</th>", escaped(&column.meaning)),
            };
        }
        html.push_str("</tr></thead>\n<tbody>\n");
        for row in &self.rows {
            html.push_str("<tr>");
            for cell in row {
                let _ = write!(html, "<td>{}</td>", escaped(cell));
            }
            html.push_str("</tr>\n");
        }
        html.push_str("</tbody>\n</table></div>\n");
        html
    }
}

/// A sentence of a page with `code` between backquotes, in which no line begins with a unit.
pub(super) fn prose(text: &str) -> String {
    sentence(&glued(text))
}

/// With spaces that do not break before units.
fn glued(text: &str) -> String {
    UNITS.iter().fold(text.to_owned(), |text, unit| text.replace(&format!(" {unit}"), &format!("\u{a0}{unit}")))
}

/// `line` on as many lines as it takes, those after the first indented, every one ended by a newline.
pub(super) fn wrapped(line: &str) -> String {
    const INDENT: &str = "  ";
    let (mut text, mut length) = (String::new(), 0);
    for word in glued(line).split([' ', '\n']).filter(|word| !word.is_empty()) {
        let long = word.chars().count();
        if length > 0 && length + 1 + long > WIDTH {
            text.push('\n');
            text.push_str(INDENT);
            length = INDENT.len();
        } else if length > 0 {
            text.push(' ');
            length += 1;
        }
        // What comes from a file must not command a terminal.
        let plain = |c: char| match c {
            '\u{a0}' => ' ',
            c if c.is_control() => '?',
            c => c,
        };
        text.extend(word.chars().map(plain));
        length += long;
    }
    text.push('\n');
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> Table {
        Table {
            title: "Table <1>".into(),
            columns: vec![Column::new("mesh", ""), Column::new("error\n%", "how \"wrong\"")],
            rows: vec![vec!["12 x 12".into(), "0.5".into()], vec!["5 x 5".into(), "3.89e-6".into()]],
        }
    }

    #[test]
    fn columns_are_as_wide_as_their_cells() {
        assert_eq!(
            table().to_text(),
            "Table <1>\n           error\nmesh           %\n12 x 12      0.5\n5 x 5    3.89e-6\n"
        );
    }

    #[test]
    fn a_table_that_is_just_too_wide_is_drawn_closer() {
        let columns = (0..10).map(|_| Column::new("", "")).collect();
        let table = Table { rows: vec![vec!["123456789".into(); 10]], columns, ..Table::default() };
        assert_eq!(table.to_text().lines().last().unwrap().len(), 99);
    }

    #[test]
    fn the_html_has_the_meanings_and_cannot_be_broken_out_of() {
        let html = table().to_html();
        for words in
            ["aria-label=\"Table &lt;1&gt;\"", "title=\"how &quot;wrong&quot;\">error<br>%", "<td>3.89e-6</td>"]
        {
            assert!(html.contains(words), "{words:?} is not in {html}");
        }
    }

    #[test]
    fn long_lines_are_wrapped() {
        let text = wrapped(&"word ".repeat(50));
        assert!(text.lines().all(|line| line.len() <= WIDTH) && text.lines().count() == 3, "{text}");
        assert_eq!(wrapped("a\u{1b}[2J"), "a?[2J\n");
        // A unit stays with its figure.
        let text = wrapped(&format!("{} 12.5 % off", "x".repeat(WIDTH - 5)));
        assert_eq!(text.lines().nth(1), Some("  12.5 % off"));
    }
}
