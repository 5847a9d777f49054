//! A chart as an SVG file of its own, for documents.

use super::Colour;
use super::html::escaped;
use super::svg::{Axis, Chart, Line, Mark, Point, Sign, around};

const WIDTH: f64 = 960.0;
const HEIGHT: f64 = 420.0;
/// Of the width, to the right of lines that have their labels at their ends.
const LABELS: f64 = 0.18;
/// The colours of a page in the light; the first is the reference's.
pub(super) const STYLE: &str = "\
text { font: 11px Helvetica, Arial, sans-serif; fill: #626b79; }
.title { font-size: 13px; font-weight: 600; fill: #1d232d; }
.paper { fill: #ffffff; }
.frame { fill: none; stroke: #c3c9d3; }
.grid { stroke: #eceff3; }
.mark { stroke: #626b79; stroke-dasharray: 3 3; opacity: .7; }
.line { fill: none; stroke: currentColor; stroke-width: 1.6; stroke-linejoin: round; }
.point { fill: currentColor; stroke: currentColor; stroke-width: 1.8; }
.point.hollow { fill: #ffffff; }
.label { fill: currentColor; font-weight: 600; }
.leader { stroke: currentColor; stroke-width: .8; opacity: .6; }
.c0 { color: #1d232d; } .c1 { color: #0072b2; } .c2 { color: #d55e00; } .c3 { color: #009e73; }
.c4 { color: #aa4a94; } .c5 { color: #b58900; } .c6 { color: #2a9fd6; } .c7 { color: #7a5230; }
.c8 { color: #969ca6; }
";

/// Points of a [`Picture`] that belong together.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Series {
    /// Name of the series, read out where it is pointed at.
    pub name: String,
    /// Its colour.
    pub colour: Colour,
    /// True if the points are joined by a line, in the order given, which rises in x.
    pub is_joined: bool,
    /// The shape of its points.
    pub sign: Sign,
    /// True if the points are drawn as outlines, such as circles in place of discs.
    pub is_hollow: bool,
    /// Points by x, y and label, which may be empty. What is not above zero lies on the edge.
    pub points: Vec<(f64, f64, String)>,
}

/// A chart with two logarithmic axes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Picture {
    /// Line above the chart.
    pub title: String,
    /// Label below the horizontal axis.
    pub x: String,
    /// Label beside the vertical axis.
    pub y: String,
    /// Vertical lines: the place of each on the horizontal axis, and its label.
    pub marks: Vec<(f64, String)>,
    /// Horizontal lines: the place of each on the vertical axis, and its label.
    pub levels: Vec<(f64, String)>,
    /// The points and lines of the chart.
    pub series: Vec<Series>,
}

impl Picture {
    /// The chart as an SVG document: light, without fonts or styles from elsewhere.
    pub fn to_svg(&self) -> String {
        self.chart().to_file(STYLE)
    }

    /// One such document of several charts, from top to bottom.
    pub fn stacked(title: &str, pictures: &[Self]) -> String {
        let height = HEIGHT * pictures.len() as f64;
        let charts: String =
            (0..).zip(pictures).map(|(row, picture)| picture.chart().to_part([0.0, HEIGHT * f64::from(row)])).collect();
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height}\" role=\"img\" aria-label=\"{}\">\n\
             <style>\n{STYLE}</style>\n<rect class=\"paper\" width=\"{WIDTH}\" height=\"{height}\"/>\n{charts}</svg>\n",
            escaped(title)
        )
    }

    fn chart(&self) -> Chart<'_> {
        let points = || self.series.iter().flat_map(|series| &series.points);
        let lines = self.series.iter().filter(|series| series.is_joined);
        let lines = lines.map(|series| Line {
            class: series.colour.to_string(),
            name: &series.name,
            points: series.points.iter().map(|(x, y, _)| (*x, *y)).collect(),
        });
        let discs = self.series.iter().flat_map(|series| {
            series.points.iter().map(|(x, y, label)| Point {
                class: series.colour.to_string(),
                label: label.clone(),
                at: (*x, *y),
                sign: series.sign,
                is_hollow: series.is_hollow,
            })
        });
        let [from, to] = around(points().map(|point| point.0).chain(self.marks.iter().map(|mark| mark.0)));
        let is_joined = self.series.iter().any(|series| series.is_joined);
        let to = if is_joined { to * (to / from).powf(LABELS) } else { to };
        let marks = |marks: &[(f64, String)]| {
            marks.iter().map(|(at, label)| Mark { at: *at, label: label.clone() }).collect::<Vec<_>>()
        };
        let x = Axis::log(&self.x, [from, to]);
        let y =
            Axis::log(&self.y, around(points().map(|point| point.1).chain(self.levels.iter().map(|level| level.0))));
        Chart {
            marks: marks(&self.marks),
            levels: marks(&self.levels),
            lines: lines.collect(),
            points: discs.filter(|point| point.at.0.is_finite() && point.at.1.is_finite()).collect(),
            ..Chart::new(&*self.title, [WIDTH, HEIGHT], x, y)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_is_a_document_with_its_words_and_no_number_that_nothing_reads() {
        let points = vec![(1.0, 0.0, "full".to_owned()), (100.0, 5.0, "a < b".to_owned()), (2.0, f64::NAN, "x".into())];
        let series = Series {
            name: "one".into(),
            colour: Colour::numbered(9),
            is_joined: true,
            sign: Sign::Diamond,
            is_hollow: true,
            points,
        };
        let picture = Picture {
            title: "t".into(),
            x: "us".into(),
            y: "%".into(),
            marks: vec![(1000.0, "period".into())],
            levels: vec![(3.0, "level".into())],
            series: vec![series],
        };
        let svg = picture.to_svg();
        assert!(svg.starts_with("<svg xmlns=\"http://www.w3.org/2000/svg\"") && svg.ends_with("</svg>\n"), "{svg}");
        for words in ["a &lt; b", ">us<", ">%<", ">period<", ">level<", "class=\"c1\"", "point hollow", ">1000<"] {
            assert!(svg.contains(words), "{words:?} is not in {svg}");
        }
        assert!(!svg.contains(">x<") && !svg.contains("inf"), "{svg}");
    }

    #[test]
    fn stacked_pictures_are_one_document_with_a_part_for_each() {
        let one = Picture { title: "a & b".into(), ..Picture::default() };
        let svg = Picture::stacked("all < of it", &[one.clone(), one]);
        assert!(svg.starts_with("<svg xmlns=") && svg.ends_with("</svg>\n"), "{svg}");
        for (words, count) in
            [("a &amp; b</text>", 2), ("class=\"frame\"", 2), ("y=\"420\" width=\"960\"", 1), ("all &lt; of it", 1)]
        {
            assert_eq!(svg.matches(words).count(), count, "{words:?} in {svg}");
        }
    }

    #[test]
    fn without_points_there_are_axes() {
        assert!(Picture::default().to_svg().contains("class=\"frame\""));
    }
}
