//! Labels of points, marks and levels: where nothing else is.

use super::super::html::escaped;

/// What a letter of a label takes. No fonts are measured here: it is what a digit takes, the widest of what labels are made of.
const LETTER: f64 = 7.0;
pub(super) const LINE: f64 = 13.0;
/// The label of a point is at most so many lines above or below it.
const MOST_LINES: i32 = 10;
/// From a point to its label.
const GAP: f64 = 9.0;

/// What `label` takes along the line.
pub(super) fn length(label: &str) -> f64 {
    LETTER * label.chars().count() as f64
}

/// A label that begins or ends at a place of the picture.
pub(super) struct Placed<'a> {
    pub(super) label: &'a str,
    pub(super) at: (f64, f64),
    pub(super) is_end: bool,
}

impl Placed<'_> {
    pub(super) fn area(&self) -> Area {
        let (x, y) = self.at;
        Area::of_text(self.label, (if self.is_end { x - length(self.label) } else { x }, y))
    }
}

/// A rectangle of the picture.
pub(super) struct Area {
    pub(super) left: f64,
    pub(super) right: f64,
    pub(super) top: f64,
    pub(super) bottom: f64,
}

impl Area {
    /// So far on every side of a place.
    pub(super) fn around((x, y): (f64, f64), far: f64) -> Self {
        Self { left: x - far, right: x + far, top: y - far, bottom: y + far }
    }

    /// Of a text that begins there.
    fn of_text(text: &str, (x, y): (f64, f64)) -> Self {
        Self { left: x, right: x + length(text), top: y - LINE + 3.0, bottom: y + 3.0 }
    }

    pub(super) fn meets(&self, other: &Self) -> bool {
        self.left < other.right && other.left < self.right && self.top < other.bottom && other.top < self.bottom
    }

    fn holds(&self, other: &Self) -> bool {
        self.left <= other.left && other.right <= self.right && self.top <= other.top && other.bottom <= self.bottom
    }
}

/// The labels of a plot, each in a place of its own.
pub(super) struct Labels {
    plot: Area,
    taken: Vec<Area>,
}

impl Labels {
    pub(super) fn new(plot: Area) -> Self {
        Self { plot, taken: Vec::new() }
    }

    /// Keeps labels off `area`.
    pub(super) fn take(&mut self, area: Area) {
        self.taken.push(area);
    }

    /// The label of a point, joined to it by a line where it is not beside it; one that only a pointer sees where there is no
    /// place for it.
    pub(super) fn of_point(&mut self, label: &str, (x, y): (f64, f64)) -> String {
        if label.is_empty() {
            return String::new();
        }
        let lines = (0..=MOST_LINES).flat_map(|lines| [f64::from(lines), f64::from(-lines)]);
        let mut places = lines.flat_map(|lines| {
            let y = y + 4.0 + lines * LINE;
            [(x + GAP, y), (x - GAP - length(label), y)].map(|at| (at, lines))
        });
        let is_free = |at| {
            let area = Area::of_text(label, at);
            self.plot.holds(&area) && !self.taken.iter().any(|taken| taken.meets(&area))
        };
        let text = escaped(label);
        let Some((at, lines)) = places.find(|(at, _)| is_free(*at)) else { return format!("<title>{text}</title>") };
        self.take(Area::of_text(label, at));
        let side = if at.0 > x { 1.0 } else { -1.0 };
        let leader = if lines.abs() < 2.0 {
            String::new()
        } else {
            let (from, to) = (x + 4.0 * side, x + (GAP - 1.0) * side);
            format!("<path class=\"leader\" d=\"M{from:.1} {y:.1}L{to:.1} {:.1}\"/>", at.1 - 4.0)
        };
        format!("{leader}<text class=\"label\" x=\"{:.1}\" y=\"{:.1}\">{text}</text>", at.0, at.1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    // Check a crowd on a phone: seven models twice, all at nearly one place beside a mark.
    #[test]
    fn labels_lie_neither_on_each_other_nor_on_a_mark_and_in_the_plot() {
        let mut labels = Labels::new(Area { left: 54.0, right: 400.0, top: 26.0, bottom: 360.0 });
        let mark = Placed { label: "haptic period", at: (330.0, 39.0), is_end: true };
        labels.take(mark.area());
        let names = ["scaled_boundary", "predictive", "hold"].map(|name| [name.to_owned(), format!("{name} 33.3 ms")]);
        let texts: Vec<String> = (0..14)
            .map(|n| labels.of_point(&names[n % 3][n / 7], (200.0 + n as f64, 100.0 + 0.5 * n as f64)))
            .collect();
        let shown = texts.iter().filter(|text| text.contains("<text")).count();
        assert!(shown >= 12, "{shown} of 14: {texts:?}");
        assert!(texts.iter().any(|text| text.contains("leader")), "those that are far are joined");
        assert_eq!(labels.taken.len(), 1 + shown);
        for (n, area) in labels.taken.iter().enumerate() {
            assert!(
                labels.plot.holds(area) && !labels.taken[..n].iter().any(|other| other.meets(area)),
                "{n}: {texts:?}"
            );
        }
    }

    #[test]
    fn a_label_without_a_place_is_read_out() {
        let mut labels = Labels::new(Area { left: 0.0, right: 20.0, top: 0.0, bottom: 20.0 });
        assert_eq!(labels.of_point("a < b", (10.0, 10.0)), "<title>a &lt; b</title>");
        assert_eq!(labels.of_point("", (10.0, 10.0)), "");
    }
}
