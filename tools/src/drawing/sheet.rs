//! A sheet of charts as an SVG file of its own, for documents: a title, a legend, and rows of panels.

use std::fmt::Write;
use std::ops::Range;

use super::Colour;
use super::html::escaped;
use super::picture::STYLE;
use super::svg::{Axis, Chart, Line, Mark, around};

const WIDTH: f64 = 1000.0;
/// Above the rows: title, subtitle, legend.
const HEAD: f64 = 92.0;
const ROW: f64 = 250.0;
/// What a sheet has and a picture has not.
const MORE: &str = "\
.sheet { font-size: 19px; fill: #1d232d; }
.subtitle, .key { font-size: 13px; }
.key { fill: #1d232d; }
.band { fill: #fff3d6; }
.wide { stroke-width: 2.8; }
";

/// A curve of a [`Panel`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Curve {
    /// x and y, rising in x.
    pub points: Vec<(f64, f64)>,
    /// Its colour; the legend says what has it.
    pub colour: Colour,
    /// Drawn as a wide line, for what lies beneath other curves.
    pub is_wide: bool,
}

impl Curve {
    /// A curve through a value at each time (s).
    pub fn new(times: &[f64], values: impl IntoIterator<Item = f64>, colour: Colour) -> Self {
        Self { points: times.iter().copied().zip(values).collect(), colour, is_wide: false }
    }

    /// This curve as a wide line.
    pub fn wide(self) -> Self {
        Self { is_wide: true, ..self }
    }
}

/// One chart of a [`Sheet`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Panel {
    /// Above it; may be empty.
    pub caption: String,
    /// Below the horizontal axis, with the unit.
    pub x_label: &'static str,
    /// Beside the vertical axis, with the unit.
    pub y_label: &'static str,
    /// The part of the horizontal axis that is shown, in the unit of `x_label`.
    pub shown: Range<f64>,
    /// The vertical axis is logarithmic.
    pub is_log: bool,
    /// From back to front.
    pub curves: Vec<Curve>,
    /// Thin vertical lines, in the unit of `x_label`.
    pub marks: Vec<f64>,
    /// The part that another panel shows larger, in the unit of `x_label`.
    pub zoomed: Option<Range<f64>>,
}

/// A whole picture of several charts.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sheet {
    /// The first line.
    pub title: String,
    /// The second line, in small print.
    pub subtitle: String,
    /// Names of the curves with the colour of each.
    pub legend: Vec<(String, Colour)>,
    /// Panels from top to bottom, those of a row from left to right.
    pub rows: Vec<Vec<Panel>>,
}

impl Sheet {
    /// The SVG document: light, without fonts or styles from elsewhere.
    pub fn to_svg(&self) -> String {
        let height = HEAD + ROW * self.rows.len() as f64;
        let (title, subtitle) = (escaped(&self.title), escaped(&self.subtitle));
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height}\" role=\"img\" aria-label=\"{title}\">\n\
             <style>\n{STYLE}{MORE}</style>\n<rect class=\"paper\" width=\"{WIDTH}\" height=\"{height}\"/>\n\
             <text class=\"sheet\" x=\"20\" y=\"28\">{title}</text>\n\
             <text class=\"subtitle\" x=\"20\" y=\"51\">{subtitle}</text>\n"
        );
        let mut x = 20;
        for (name, colour) in &self.legend {
            // Writing to a string cannot fail.
            let _ = writeln!(
                svg,
                "<path class=\"line wide {colour}\" d=\"M{x} 73h26\"/><text class=\"key\" x=\"{}\" y=\"78\">{}</text>",
                x + 34,
                escaped(name)
            );
            // No fonts are measured here: a little more than an average letter, so that entries keep apart.
            x += 60 + 7 * name.chars().count() as i32;
        }
        for (row, panels) in self.rows.iter().enumerate() {
            let width = WIDTH / panels.len() as f64;
            for (column, panel) in panels.iter().enumerate() {
                let place = [width * column as f64, HEAD + ROW * row as f64];
                svg.push_str(&panel.chart(&self.legend, width).to_part(place));
            }
        }
        svg.push_str("</svg>\n");
        svg
    }
}

impl Panel {
    fn chart<'a>(&self, legend: &'a [(String, Colour)], width: f64) -> Chart<'a> {
        let within = |curve: &Curve| -> Vec<(f64, f64)> {
            curve.points.iter().copied().filter(|(x, _)| self.shown.contains(x)).collect()
        };
        let curves: Vec<_> = self.curves.iter().map(|curve| (curve, within(curve))).collect();
        let values = || curves.iter().flat_map(|(_, points)| points.iter().map(|point| point.1));
        let (y, tolerance) = if self.is_log {
            (Axis::log(self.y_label, around(values())), 0.0)
        } else {
            let (low, high) = values().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), y| (l.min(y), h.max(y)));
            let room = 0.08 * (high - low).max(1e-12);
            // A tenth of a pixel, more or less.
            (Axis::linear(self.y_label, [low - room, high + room]), (high - low) / ROW / 10.0)
        };
        let lines = curves.iter().map(|(curve, points)| Line {
            class: format!("{}{}", curve.colour, if curve.is_wide { " wide" } else { "" }),
            name: legend.iter().find(|(_, colour)| *colour == curve.colour).map_or("", |(name, _)| name),
            points: if self.is_log { points.clone() } else { straightened(points, tolerance) },
        });
        let marks = self.marks.iter().filter(|at| self.shown.contains(at));
        Chart {
            band: self.zoomed.as_ref().map(|zoomed| [zoomed.start, zoomed.end]),
            marks: marks.map(|&at| Mark { at, label: String::new() }).collect(),
            lines: lines.collect(),
            ..Chart::new(
                &*self.caption,
                [width, ROW],
                Axis::linear(self.x_label, [self.shown.start, self.shown.end]),
                y,
            )
        }
    }
}

/// Leaves out points that a straight line between kept ones passes within `tolerance` of.
fn straightened(points: &[(f64, f64)], tolerance: f64) -> Vec<(f64, f64)> {
    let Some(&first) = points.first() else { return Vec::new() };
    let mut kept = vec![first];
    let (mut from, mut last) = (first, first);
    // The slopes from the last kept point that pass all points since.
    let mut slopes = (f64::NEG_INFINITY, f64::INFINITY);
    for &point in &points[1..] {
        let slope = |value: f64, base: (f64, f64)| (value - base.1) / (point.0 - base.0);
        if !(slopes.0..=slopes.1).contains(&slope(point.1, from)) {
            kept.push(last);
            from = last;
            slopes = (f64::NEG_INFINITY, f64::INFINITY);
        }
        slopes = (slopes.0.max(slope(point.1 - tolerance, from)), slopes.1.min(slope(point.1 + tolerance, from)));
        last = point;
    }
    kept.push(last);
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sheet_has_a_chart_for_each_panel_and_a_legend() {
        let times: Vec<f64> = (0..100).map(|n| f64::from(n) * 0.01).collect();
        let panel = |is_log| Panel {
            caption: "a < b".into(),
            x_label: "time (s)",
            y_label: "N",
            shown: 0.1..0.9,
            is_log,
            curves: vec![Curve::new(&times, times.iter().map(|t| t * t), Colour::BLUE).wide()],
            marks: vec![0.5, 7.0],
            zoomed: Some(0.2..0.3),
        };
        let legend = vec![("patch".to_owned(), Colour::BLUE)];
        let rows = vec![vec![panel(false)], vec![panel(false), panel(true)]];
        let svg = Sheet { title: "t".into(), subtitle: "s".into(), legend, rows }.to_svg();
        for (words, count) in [
            ("role=\"img\" aria-label=\"a &lt; b\"", 3),
            ("class=\"line wide c1\"", 1),
            ("class=\"line c1 wide\"", 3),
            ("<title>patch</title>", 3),
            ("class=\"mark\"", 3),
            ("class=\"band\"", 3),
            ("<svg x=\"500\" y=\"342\" width=\"500\"", 1),
        ] {
            assert_eq!(svg.matches(words).count(), count, "{words:?} in {svg}");
        }
        assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
    }

    #[test]
    fn points_on_a_straight_line_are_left_out() {
        let corner: Vec<(f64, f64)> = (0..=20).map(|n| (f64::from(n), f64::from(n.min(10)))).collect();
        assert_eq!(straightened(&corner, 1e-6), [(0.0, 0.0), (10.0, 10.0), (20.0, 10.0)]);
        assert!(straightened(&[], 1.0).is_empty());
    }
}
