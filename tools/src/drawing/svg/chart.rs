//! One chart: frame, grid, lines, labelled points.

use std::fmt::Write;

use super::super::html::escaped;
use super::axis::Axis;
use super::label::{Area, LINE, Labels, Placed, length};
use super::sign::Sign;
use super::thin::thinned;

/// Drawn size; the page scales it.
const HEAD: f64 = 26.0;
const LEFT: f64 = 54.0;
const RIGHT: f64 = 12.0;
const FOOT: f64 = 38.0;

/// A curve.
#[derive(Clone, Debug)]
pub(crate) struct Line<'a> {
    /// Classes of the page that colour and hide it.
    pub(crate) class: String,
    /// What it shows, read out where it is pointed at.
    pub(crate) name: &'a str,
    /// x and y, rising in x.
    pub(crate) points: Vec<(f64, f64)>,
}

/// A point with a label.
#[derive(Clone, Debug)]
pub(crate) struct Point {
    pub(crate) class: String,
    pub(crate) label: String,
    pub(crate) at: (f64, f64),
    pub(crate) sign: Sign,
    pub(crate) is_hollow: bool,
}

/// Bars on the lower edge, drawn as one shape.
#[derive(Clone, Debug)]
pub(crate) struct Bars<'a> {
    pub(crate) class: &'a str,
    pub(crate) name: &'a str,
    /// From x to x, and how high.
    pub(crate) bars: Vec<(f64, f64, f64)>,
}

/// Marks of one kind along the upper edge.
#[derive(Clone, Debug)]
pub(crate) struct Signs {
    pub(crate) class: String,
    pub(crate) name: String,
    pub(crate) sign: Sign,
    /// Below the upper edge, in drawn units.
    pub(crate) row: f64,
    pub(crate) at: Vec<f64>,
}

/// A line across the plot.
#[derive(Clone, Debug)]
pub(crate) struct Mark {
    pub(crate) at: f64,
    pub(crate) label: String,
}

/// A chart.
#[derive(Clone, Debug, Default)]
pub(crate) struct Chart<'a> {
    pub(crate) title: String,
    pub(crate) width: f64,
    pub(crate) height: f64,
    pub(crate) x: Axis,
    pub(crate) y: Axis,
    /// From x to x: shaded.
    pub(crate) band: Option<[f64; 2]>,
    /// Vertical.
    pub(crate) marks: Vec<Mark>,
    /// Horizontal.
    pub(crate) levels: Vec<Mark>,
    pub(crate) lines: Vec<Line<'a>>,
    pub(crate) points: Vec<Point>,
    pub(crate) bars: Vec<Bars<'a>>,
    pub(crate) signs: Vec<Signs>,
}

impl Chart<'_> {
    /// An empty chart of this size.
    pub(crate) fn new(title: impl Into<String>, [width, height]: [f64; 2], x: Axis, y: Axis) -> Self {
        Self { title: title.into(), width, height, x, y, ..Self::default() }
    }

    /// The chart as an SVG element of a page.
    pub(crate) fn to_svg(&self) -> String {
        self.element("", "")
    }

    /// The chart as an element of a larger picture, its left upper corner at `x`, `y`.
    pub(crate) fn to_part(&self, [x, y]: [f64; 2]) -> String {
        let (width, height) = (self.width, self.height);
        self.element(&format!(" x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\""), "")
    }

    /// The chart as a document of its own, drawn on white with `style`.
    pub(crate) fn to_file(&self, style: &str) -> String {
        let (width, height) = (self.width, self.height);
        let paper =
            format!("<style>\n{style}</style>\n<rect class=\"paper\" width=\"{width}\" height=\"{height}\"/>\n");
        self.element(" xmlns=\"http://www.w3.org/2000/svg\"", &paper)
    }

    fn element(&self, attributes: &str, below: &str) -> String {
        let (width, height) = (self.width, self.height);
        let mut svg = format!(
            "<svg{attributes} viewBox=\"0 0 {width} {height}\" role=\"img\" aria-label=\"{0}\">\n{below}\
             <text class=\"title\" x=\"{LEFT}\" y=\"16\">{0}</text>\n",
            escaped(&self.title)
        );
        self.draw(&mut svg);
        svg.push_str("</svg>\n");
        svg
    }

    fn across(&self) -> f64 {
        self.width - LEFT - RIGHT
    }

    fn down(&self) -> f64 {
        self.height - HEAD - FOOT
    }

    /// From the left edge of the plot.
    fn px(&self, x: f64) -> f64 {
        self.x.place(x) * self.across()
    }

    /// From the top edge of the plot.
    fn py(&self, y: f64) -> f64 {
        (1.0 - self.y.place(y)) * self.down()
    }

    // Writing to a string cannot fail.
    fn draw(&self, svg: &mut String) {
        let (across, down) = (self.across(), self.down());
        let (bottom, middle) = (HEAD + down, HEAD + 0.5 * down);
        if let Some([from, to]) = self.band {
            let (from, to) = (self.px(from), self.px(to));
            let (x, wide) = (LEFT + from, to - from);
            let _ =
                writeln!(svg, "<rect class=\"band\" x=\"{x:.1}\" y=\"{HEAD}\" width=\"{wide:.1}\" height=\"{down}\"/>");
        }
        for (value, label) in self.x.ticks() {
            let x = LEFT + self.px(value);
            let _ = writeln!(svg, "<path class=\"grid\" d=\"M{x:.1} {HEAD}v{down}\"/>");
            if let Some(label) = label {
                let y = bottom + 14.0;
                // A label at the very edge would leave the picture.
                let half = 0.6 * length(&label);
                let (x, anchor) = if x + half > self.width { (self.width - 1.0, "end") } else { (x, "middle") };
                let _ = writeln!(svg, "<text x=\"{x:.1}\" y=\"{y}\" text-anchor=\"{anchor}\">{label}</text>");
            }
        }
        for (value, label) in self.y.ticks() {
            let y = HEAD + self.py(value);
            let _ = writeln!(svg, "<path class=\"grid\" d=\"M{LEFT} {y:.1}h{across}\"/>");
            if let Some(label) = label {
                let (x, y) = (LEFT - 6.0, y + 4.0);
                let _ = writeln!(svg, "<text x=\"{x}\" y=\"{y:.1}\" text-anchor=\"end\">{label}</text>");
            }
        }
        for mark in &self.marks {
            let _ = writeln!(svg, "<path class=\"mark\" d=\"M{:.1} {HEAD}v{down}\"/>", LEFT + self.px(mark.at));
        }
        for level in &self.levels {
            let _ = writeln!(svg, "<path class=\"mark\" d=\"M{LEFT} {:.1}h{across}\"/>", HEAD + self.py(level.at));
        }
        // An inner svg cuts off what leaves the plot.
        let _ = writeln!(svg, "<svg x=\"{LEFT}\" y=\"{HEAD}\" width=\"{across}\" height=\"{down}\">");
        self.bars.iter().for_each(|bars| self.draw_bars(svg, bars));
        self.lines.iter().for_each(|line| self.draw_line(svg, line));
        self.signs.iter().for_each(|signs| self.draw_signs(svg, signs));
        svg.push_str("</svg>\n");
        let _ = writeln!(svg, "<rect class=\"frame\" x=\"{LEFT}\" y=\"{HEAD}\" width=\"{across}\" height=\"{down}\"/>");
        self.draw_points(svg);
        self.name_marks(svg);
        let (x, y) = (LEFT + 0.5 * across, self.height - 6.0);
        let _ = writeln!(svg, "<text x=\"{x}\" y=\"{y}\" text-anchor=\"middle\">{}</text>", escaped(&self.x.label));
        let y_label = escaped(&self.y.label);
        let _ = writeln!(
            svg,
            "<text transform=\"translate(12 {middle}) rotate(-90)\" text-anchor=\"middle\">{y_label}</text>"
        );
    }

    /// The labels of marks and levels, above all that is drawn.
    fn name_marks(&self, svg: &mut String) {
        for Placed { label, at: (x, y), is_end } in self.mark_labels() {
            let (anchor, label) = (if is_end { "end" } else { "start" }, escaped(label));
            let _ =
                writeln!(svg, "<text class=\"halo\" x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\">{label}</text>");
        }
    }

    /// The labels of marks and levels.
    fn mark_labels(&self) -> Vec<Placed<'_>> {
        let mut labels: Vec<Placed<'_>> = Vec::new();
        for mark in self.marks.iter().filter(|mark| !mark.label.is_empty()) {
            let x = LEFT + self.px(mark.at);
            // On the side where there is room.
            let is_end = x - LEFT > length(&mark.label) + 8.0;
            let x = if is_end { x - 4.0 } else { x + 4.0 };
            let mut label = Placed { label: &mark.label, at: (x, HEAD + LINE), is_end };
            // Marks that are close together have their labels one below the other.
            while labels.iter().any(|other| other.area().meets(&label.area())) {
                label.at.1 += LINE;
            }
            labels.push(label);
        }
        let levels = self.levels.iter().map(|level| {
            let y = HEAD + self.py(level.at);
            let y = if y < HEAD + LINE + 4.0 { y + LINE } else { y - 4.0 };
            Placed { label: &level.label, at: (LEFT + 6.0, y), is_end: false }
        });
        labels.extend(levels.filter(|level| !level.label.is_empty()));
        labels
    }

    fn draw_bars(&self, svg: &mut String, bars: &Bars<'_>) {
        let bottom = self.down();
        let _ = write!(svg, "<path class=\"bars {}\" d=\"", bars.class);
        for &(from, to, top) in &bars.bars {
            let (from, to, top) = (self.px(from), self.px(to), self.py(top).clamp(-9.0, bottom));
            let _ = write!(svg, "M{from:.1} {bottom}V{top:.1}H{to:.1}V{bottom}z");
        }
        let _ = writeln!(svg, "\"><title>{}</title></path>", escaped(bars.name));
    }

    fn draw_signs(&self, svg: &mut String, signs: &Signs) {
        let _ = write!(svg, "<path class=\"sign {}\" d=\"", signs.class);
        for &x in &signs.at {
            svg.push_str(&signs.sign.path(self.px(x), signs.row));
        }
        let _ = writeln!(svg, "\"><title>{}</title></path>", escaped(&signs.name));
    }

    fn draw_line(&self, svg: &mut String, line: &Line<'_>) {
        // Where they are and not what they mean: columns are equally wide on a logarithmic axis too.
        let placed = line.points.iter().map(|&(x, y)| (self.x.place(x), y));
        let points = thinned(placed, [0.0, 1.0], self.across() as usize);
        if points.is_empty() {
            return;
        }
        let _ = write!(svg, "<path class=\"line {}\" d=\"", line.class);
        for (index, (x, y)) in points.into_iter().enumerate() {
            let step = if index == 0 { 'M' } else { 'L' };
            // Far outside is outside: a huge number would only take room.
            let y = self.py(y).clamp(-9.0, self.down() + 9.0);
            let _ = write!(svg, "{step}{:.1} {y:.1}", x * self.across());
        }
        let _ = writeln!(svg, "\"><title>{}</title></path>", escaped(line.name));
    }

    /// Points, each with its label where nothing else is. A label without such a place is only read out where its point is
    /// pointed at.
    fn draw_points(&self, svg: &mut String) {
        let place = |point: &Point| (LEFT + self.px(point.at.0), HEAD + self.py(point.at.1));
        let mut labels = Labels::new(Area { left: LEFT, right: self.width, top: HEAD, bottom: HEAD + self.down() });
        self.points.iter().for_each(|point| labels.take(Area::around(place(point), 6.0)));
        self.mark_labels().iter().for_each(|placed| labels.take(placed.area()));
        for point in &self.points {
            let (x, y) = place(point);
            let label = labels.of_point(&point.label, (x, y));
            let (class, hollow) = (&point.class, if point.is_hollow { " hollow" } else { "" });
            let sign = match point.sign {
                Sign::Disc => format!("<circle class=\"point{hollow}\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"4\"/>"),
                sign => format!("<path class=\"point{hollow}\" d=\"{}\"/>", sign.path(x, y)),
            };
            let _ = writeln!(svg, "<g class=\"{class}\">{sign}{label}</g>");
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chart() -> Chart<'static> {
        Chart {
            title: "a < b".to_owned(),
            width: 600.0,
            height: 200.0,
            x: Axis::linear("t (s)", [0.0, 1.0]),
            y: Axis::log("error (%)", [0.1, 10.0]),
            band: Some([0.2, 0.4]),
            marks: vec![Mark { at: 0.5, label: "the period".to_owned() }],
            levels: vec![Mark { at: 1.0, label: "the level".to_owned() }],
            lines: vec![Line { class: "c1".to_owned(), name: "patch", points: vec![(0.0, 0.0), (1.0, 1e300)] }],
            ..Chart::default()
        }
    }

    #[test]
    fn a_chart_is_drawn_with_its_labels_and_without_numbers_that_no_browser_reads() {
        let svg = chart().to_svg();
        for words in [
            "a &lt; b",
            "t (s)",
            "error (%)",
            "the period",
            "the level",
            "class=\"band\"",
            "<title>patch</title>",
            ">10</text>",
        ] {
            assert!(svg.contains(words), "{words:?} is not in {svg}");
        }
        // The plot is 534 by 136: zero is at the bottom, what is too large is cut off above.
        assert!(svg.contains("d=\"M0.0 136.0L534.0 -9.0\""), "{svg}");
        assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
    }

    #[test]
    fn marks_that_are_close_together_have_labels_that_do_not_lie_on_each_other() {
        let mark = |at, label: &str| Mark { at, label: label.to_owned() };
        for at in [0.0, 0.02, 0.1, 0.5, 0.98] {
            let marks = vec![mark(at, "budget"), mark(at + 0.01, "deadline"), mark(at + 0.02, "")];
            let chart = Chart { marks, levels: Vec::new(), ..chart() };
            let labels = chart.mark_labels();
            assert_eq!(labels.len(), 2);
            assert!(!labels[0].area().meets(&labels[1].area()), "{at}");
        }
    }
}
