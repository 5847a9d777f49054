//! A sheet of plots: title, legend and rows of panels, drawn with plotters.

use std::error::Error;
use std::fs;
use std::ops::Range;
use std::path::Path;

use plotters::prelude::*;
pub use plotters::style::RGBColor;

/// The SVG backend rounds to whole pixels; drawing larger than shown keeps slow curves smooth.
const SCALE: i32 = 8;
/// Shown size (px): the width of a sheet, the head above its rows, a row.
const WIDTH: i32 = 1000;
const HEAD: i32 = 96;
const ROW: i32 = 250;
const FONT: &str = "Helvetica, Arial, sans-serif";

pub const INK: RGBColor = RGBColor(38, 44, 54);
const FAINT: RGBColor = RGBColor(110, 118, 130);
const GRID: RGBColor = RGBColor(228, 231, 236);
const MARK: RGBColor = RGBColor(196, 202, 212);
const ZOOMED: RGBColor = RGBColor(255, 243, 214);
/// Told apart by people who see colours differently, too.
pub const BLUE: RGBColor = RGBColor(0, 114, 178);
pub const ORANGE: RGBColor = RGBColor(222, 143, 5);

/// The usual `x_label`.
pub const TIME: &str = "time (s)";

/// One curve of a panel.
pub struct Curve {
    pub points: Vec<(f64, f64)>,
    pub color: RGBColor,
    /// Shown width (px).
    pub width: f64,
}

impl Curve {
    pub fn new(times: &[f64], values: impl IntoIterator<Item = f64>, color: RGBColor, width: f64) -> Self {
        Self { points: times.iter().copied().zip(values).collect(), color, width }
    }
}

/// One plot, usually over time.
pub struct Panel {
    pub caption: String,
    pub x_label: &'static str,
    pub y_label: &'static str,
    /// Shown times (s), or whatever `x_label` says.
    pub times: Range<f64>,
    pub curves: Vec<Curve>,
    /// Times (s) of thin vertical lines.
    pub marks: Vec<f64>,
    /// The times (s) that another panel shows larger.
    pub zoomed: Option<Range<f64>>,
}

/// A whole picture.
pub struct Sheet {
    pub title: String,
    pub subtitle: String,
    pub legend: Vec<(String, RGBColor)>,
    /// Panels from top to bottom, those of a row from left to right.
    pub rows: Vec<Vec<Panel>>,
}

impl Sheet {
    /// Writes the picture to `path`.
    pub fn write(&self, path: &Path) -> Result<(), Box<dyn Error>> {
        let height = HEAD + ROW * self.rows.len() as i32;
        let mut svg = String::new();
        {
            let size = ((WIDTH * SCALE) as u32, (height * SCALE) as u32);
            let root = SVGBackend::with_string(&mut svg, size).into_drawing_area();
            root.fill(&WHITE)?;
            self.draw_head(&root)?;
            let below = root.margin(HEAD * SCALE, 0, 0, 0);
            for (row, area) in self.rows.iter().zip(below.split_evenly((self.rows.len(), 1))) {
                for (panel, area) in row.iter().zip(area.split_evenly((1, row.len()))) {
                    panel.draw(&area)?;
                }
            }
            root.present()?;
        }
        // The picture is drawn SCALE times as large as it is shown.
        let drawn = format!("width=\"{}\" height=\"{}\"", WIDTH * SCALE, height * SCALE);
        let svg = svg.replacen(&drawn, &format!("width=\"{WIDTH}\" height=\"{height}\""), 1);
        fs::write(path, svg).map_err(|error| format!("{}: {error}", path.display()).into())
    }

    fn draw_head<B: DrawingBackend>(&self, root: &DrawingArea<B, plotters::coord::Shift>) -> Result<(), Box<dyn Error>>
    where
        B::ErrorType: 'static,
    {
        let at = |x: i32, y: i32| (x * SCALE, y * SCALE);
        root.draw_text(&self.title, &font(19.0, INK), at(20, 14))?;
        root.draw_text(&self.subtitle, &font(13.0, FAINT), at(20, 41))?;
        let mut x = 20;
        for (name, color) in &self.legend {
            let stroke = color.stroke_width((3 * SCALE) as u32);
            root.draw(&PathElement::new([at(x, 75), at(x + 26, 75)], stroke))?;
            root.draw_text(name, &font(13.0, INK), at(x + 34, 68))?;
            // No fonts are measured here: a little more than an average letter, so that entries keep apart.
            x += 34 + 7 * name.chars().count() as i32 + 26;
        }
        Ok(())
    }
}

impl Panel {
    fn draw<B: DrawingBackend>(&self, area: &DrawingArea<B, plotters::coord::Shift>) -> Result<(), Box<dyn Error>>
    where
        B::ErrorType: 'static,
    {
        let inside = |curve: &Curve| {
            let shown = curve.points.iter().copied().filter(|(t, _)| self.times.contains(t));
            shown.collect::<Vec<_>>()
        };
        let curves: Vec<(&Curve, Vec<(f64, f64)>)> = self.curves.iter().map(|curve| (curve, inside(curve))).collect();
        let values = || curves.iter().flat_map(|(_, points)| points.iter().map(|&(_, value)| value));
        let (low, high) = (values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max));
        let room = 0.08 * (high - low).max(1e-12);
        let (low, high) = (low - room, high + room);

        let mut builder = ChartBuilder::on(area);
        if self.caption.is_empty() {
            builder.margin_top(12 * SCALE);
        } else {
            builder.caption(&self.caption, font(14.0, INK)).margin_top(6 * SCALE);
        }
        let mut chart = builder
            .margin_bottom(6 * SCALE)
            .margin_left(10 * SCALE)
            .margin_right(20 * SCALE)
            .x_label_area_size(38 * SCALE)
            .y_label_area_size(64 * SCALE)
            .build_cartesian_2d(self.times.clone(), low..high)?;
        if let Some(zoomed) = &self.zoomed {
            let corners = [(zoomed.start, low), (zoomed.end, high)];
            chart.draw_series([Rectangle::new(corners, ZOOMED.filled())])?;
        }
        chart
            .configure_mesh()
            .x_desc(self.x_label)
            .y_desc(self.y_label)
            .axis_desc_style(font(12.0, FAINT))
            .label_style(font(12.0, INK))
            .axis_style(FAINT.stroke_width(SCALE as u32))
            .bold_line_style(GRID.stroke_width(SCALE as u32))
            .light_line_style(TRANSPARENT)
            .x_labels(8)
            .y_labels(6)
            .set_all_tick_mark_size(4 * SCALE)
            .x_label_formatter(&|t| format!("{t:.2}"))
            .y_label_formatter(&label_of(high - low))
            .draw()?;
        for &time in self.marks.iter().filter(|time| self.times.contains(time)) {
            let stroke = MARK.stroke_width(SCALE as u32);
            chart.draw_series([PathElement::new([(time, low), (time, high)], stroke)])?;
        }
        // A twentieth of a shown pixel, more or less.
        let tolerance = (high - low) / f64::from(ROW) / 10.0;
        for (curve, points) in curves {
            let stroke = curve.color.stroke_width((curve.width * f64::from(SCALE)).round() as u32);
            chart.draw_series(LineSeries::new(thinned(&points, tolerance), stroke))?;
        }
        Ok(())
    }
}

/// Labels with as many decimals as the range needs.
fn label_of(range: f64) -> impl Fn(&f64) -> String {
    let decimals = (1.0 - range.log10()).ceil().clamp(0.0, 9.0) as usize;
    move |value| format!("{:.decimals$}", value + 0.0)
}

fn font(size: f64, color: RGBColor) -> TextStyle<'static> {
    // The SVG backend divides by 1.24.
    TextStyle { color: color.to_backend_color(), ..(FONT, size * f64::from(SCALE) * 1.24).into_font().into() }
}

/// Leaves out points that a straight line between kept ones passes within `tolerance` of.
fn thinned(points: &[(f64, f64)], tolerance: f64) -> Vec<(f64, f64)> {
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
