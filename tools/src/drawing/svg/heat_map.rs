//! A map: cells coloured by a number, in the proportions of what it shows.

use std::fmt::Write;

use super::super::html::escaped;
use super::axis::{Axis, Tick};
use super::heat::HeatScale;

/// Drawn size.
const WIDTH: f64 = 320.0;
const LEFT: f64 = 48.0;
const RIGHT: f64 = 14.0;
const HEAD: f64 = 26.0;
const FOOT: f64 = 38.0;
const HIGHEST: f64 = 300.0;
const LETTER: f64 = 6.4;
const LINE: f64 = 13.0;

/// A cell.
#[derive(Clone, Debug)]
pub(crate) struct HeatCell {
    /// From and to along the first axis.
    pub(crate) x: [f64; 2],
    /// The same along the second.
    pub(crate) y: [f64; 2],
    /// `None` where there is nothing.
    pub(crate) value: Option<f64>,
    /// Read out where it is pointed at.
    pub(crate) words: String,
}

/// A map of cells; both axes have the same unit and are drawn to the same scale.
#[derive(Clone, Debug)]
pub(crate) struct HeatMap<'a> {
    pub(crate) title: String,
    pub(crate) x: Axis,
    pub(crate) y: Axis,
    pub(crate) scale: &'a HeatScale,
    pub(crate) cells: Vec<HeatCell>,
    /// An outline, from and to along each axis.
    pub(crate) outline: Option<[[f64; 2]; 2]>,
    /// A place that is marked.
    pub(crate) mark: Option<[f64; 2]>,
}

impl HeatMap<'_> {
    /// The map as an SVG element of a page.
    pub(crate) fn to_svg(&self) -> String {
        let length = |axis: &Axis| axis.range[1] - axis.range[0];
        let scale = ((WIDTH - LEFT - RIGHT) / length(&self.x)).min(HIGHEST / length(&self.y));
        let (across, down) = (scale * length(&self.x), scale * length(&self.y));
        let px = |x: f64| LEFT + across * self.x.place(x);
        let py = |y: f64| HEAD + down * (1.0 - self.y.place(y));
        let (height, bottom) = (HEAD + down + FOOT, HEAD + down);
        let title = escaped(&self.title);
        let mut svg = format!(
            "<svg viewBox=\"0 0 {WIDTH} {height:.1}\" role=\"img\" aria-label=\"{title}\">\n\
             <text class=\"title\" x=\"{LEFT}\" y=\"16\">{title}</text>\n<text x=\"2\" y=\"16\">{}</text>\n",
            escaped(&self.y.label)
        );
        // Writing to a string cannot fail.
        let area = |x: [f64; 2], y: [f64; 2]| {
            let (left, right, top, bottom) = (px(x[0]), px(x[1]), py(y[1]), py(y[0]));
            format!("x=\"{left:.1}\" y=\"{top:.1}\" width=\"{:.1}\" height=\"{:.1}\"", right - left, bottom - top)
        };
        for cell in &self.cells {
            let class = cell.value.map_or("none".to_owned(), |value| self.scale.class(value));
            let (area, words) = (area(cell.x, cell.y), escaped(&cell.words));
            let _ = writeln!(svg, "<rect class=\"cell {class}\" {area}><title>{words}</title></rect>");
        }
        let _ = writeln!(svg, "<rect class=\"frame\" {}/>", area(self.x.range, self.y.range));
        for (value, label) in fitting(self.x.ticks(), across, |label| LETTER * (label.chars().count() + 1) as f64) {
            let (x, y) = (px(value), bottom + 16.0);
            let _ = writeln!(svg, "<path class=\"tick\" d=\"M{x:.1} {bottom:.1}v4\"/>");
            let _ = writeln!(svg, "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"middle\">{label}</text>");
        }
        for (value, label) in fitting(self.y.ticks(), down, |_| LINE) {
            let (x, y) = (LEFT - 7.0, py(value));
            let _ = writeln!(svg, "<path class=\"tick\" d=\"M{LEFT} {y:.1}h-4\"/>");
            let _ = writeln!(svg, "<text x=\"{x}\" y=\"{:.1}\" text-anchor=\"end\">{label}</text>", y + 4.0);
        }
        let (x, y) = (LEFT + 0.5 * across, height - 6.0);
        let label = escaped(&self.x.label);
        let _ = writeln!(svg, "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"middle\">{label}</text>");
        if let Some([x, y]) = self.outline {
            // Dark on light: seen on every colour.
            let area = area(x, y);
            let _ = writeln!(svg, "<rect class=\"outline under\" {area}/><rect class=\"outline\" {area}/>");
        }
        if let Some([x, y]) = self.mark {
            let (x, y) = (px(x), py(y));
            let _ = writeln!(svg, "<circle class=\"here\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"4\"/>");
        }
        svg.push_str("</svg>\n");
        svg
    }
}

/// Of evenly spaced ticks over `length`, so many that `room` is free for each label.
fn fitting(ticks: Vec<Tick>, length: f64, room: impl Fn(&str) -> f64) -> Vec<(f64, String)> {
    let labelled: Vec<(f64, String)> = ticks.into_iter().filter_map(|(value, label)| Some((value, label?))).collect();
    let widest = labelled.iter().map(|(_, label)| room(label)).fold(1.0, f64::max);
    let most = (length / widest).floor().max(1.0) as usize;
    let every = labelled.len().div_ceil(most).max(1);
    labelled.into_iter().step_by(every).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_map_is_in_proportion_and_has_its_values_to_read() {
        let scale = HeatScale::new(Axis::log("error (%)", [0.1, 10.0]));
        let cell = |x: f64, value| HeatCell { x: [x, x + 1.0], y: [0.0, 1.0], value, words: format!("at {x} < 9") };
        let map = HeatMap {
            title: "z_max".into(),
            x: Axis::linear("x (mm)", [0.0, 2.0]),
            y: Axis::linear("y (mm)", [0.0, 1.0]),
            scale: &scale,
            cells: vec![cell(0.0, Some(1.0)), cell(1.0, None)],
            outline: Some([[0.0, 1.0], [0.0, 1.0]]),
            mark: Some([0.5, 0.5]),
        };
        let svg = map.to_svg();
        // 258 across for two cells: each is a square of 129.
        assert!(svg.contains("class=\"cell q9\" x=\"48.0\" y=\"26.0\" width=\"129.0\" height=\"129.0\""), "{svg}");
        for words in ["at 0 &lt; 9", "cell none", "x (mm)", "y (mm)", "class=\"here\" cx=\"112.5\" cy=\"90.5\""] {
            assert!(svg.contains(words), "{words:?} is not in {svg}");
        }
    }

    #[test]
    fn a_low_map_has_as_many_labels_as_fit() {
        let ticks = || Axis::linear("", [0.0, 10.0]).ticks();
        assert_eq!(fitting(ticks(), 300.0, |_| LINE).len(), 6);
        assert_eq!(fitting(ticks(), 26.0, |_| LINE).len(), 2);
        assert_eq!(fitting(ticks(), 5.0, |_| LINE).len(), 1);
    }
}
