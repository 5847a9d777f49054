//! The map of apparent stiffness: as text, as a picture, and what it says about the nodule.

use std::fmt::{self, Write as _};

/// Pixels per metre, and around the body.
const SCALE: f64 = 4000.0;
const MARGIN: f64 = 44.0;

/// How stiff each point felt.
pub struct Map {
    points: Vec<[f64; 2]>,
    /// Sum and number of what was felt (N/m).
    felt: Vec<(f64, u32)>,
}

impl Map {
    /// Of `points` (m).
    pub fn new(points: Vec<[f64; 2]>) -> Self {
        Self { felt: vec![(0.0, 0); points.len()], points }
    }

    /// Adds what `point` felt like in one tick (N/m).
    pub fn add(&mut self, point: usize, stiffness: f64) {
        let (sum, count) = &mut self.felt[point];
        *sum += stiffness;
        *count += 1;
    }

    fn stiffness(&self, point: usize) -> f64 {
        let (sum, count) = self.felt[point];
        sum / f64::from(count.max(1))
    }

    /// Where the nodule seems to be (m): the centre of what is stiffer than halfway between the median and the stiffest
    /// point, by how much it is.
    pub fn nodule(&self) -> [f64; 2] {
        let mut sorted: Vec<f64> = (0..self.points.len()).map(|point| self.stiffness(point)).collect();
        sorted.sort_by(f64::total_cmp);
        let limit = 0.5 * (sorted[sorted.len() / 2] + sorted[sorted.len() - 1]);
        let (mut sum, mut at) = (0.0, [0.0; 2]);
        for (point, [x, y]) in self.points.iter().enumerate() {
            let weight = (self.stiffness(point) - limit).max(0.0);
            sum += weight;
            at = [at[0] + weight * x, at[1] + weight * y];
        }
        at.map(|c| c / sum)
    }

    /// The coordinates that occur along an axis (m), in increasing order.
    fn lines(&self, axis: usize) -> Vec<f64> {
        let mut lines: Vec<f64> = self.points.iter().map(|point| point[axis]).collect();
        lines.sort_by(f64::total_cmp);
        lines.dedup();
        lines
    }

    /// A heat map over the top of a block of `edge` (m), with a cross where the nodule was `found` and its outline where it is.
    pub fn svg(&self, edge: f64, found: [f64; 2], (truth, radius): ([f64; 2], f64)) -> String {
        let all = || (0..self.points.len()).map(|point| self.stiffness(point));
        let (low, high) = all().fold((f64::INFINITY, 0.0_f64), |(low, high), k| (low.min(k), high.max(k)));
        let x = |x: f64| MARGIN + SCALE * x;
        let y = |y: f64| MARGIN + SCALE * (edge - y);
        let (size, lines) = (SCALE * edge, self.lines(0));
        let cell = SCALE * (lines[1] - lines[0]);
        let whole = size + 2.0 * MARGIN;
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {whole:.0} {whole:.0}\" font-family=\"sans-serif\" \
             font-size=\"11\" text-anchor=\"middle\">\n<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n\
             <rect x=\"{MARGIN}\" y=\"{MARGIN}\" width=\"{size:.1}\" height=\"{size:.1}\" fill=\"none\" stroke=\"#888\"/>\n"
        );
        let mut line = |text: String| {
            svg.push_str(&text);
            svg.push('\n');
        };
        for (point, &[px, py]) in self.points.iter().enumerate() {
            let share = (self.stiffness(point) - low) / (high - low).max(f64::MIN_POSITIVE);
            // From pale to dark red.
            let [r, g, b] = [255.0 - 90.0 * share, 245.0 - 225.0 * share, 235.0 - 200.0 * share].map(|c| c as u8);
            let (left, top) = (x(px) - cell / 2.0, y(py) - cell / 2.0);
            let ink = if share > 0.55 { "#fff" } else { "#333" };
            line(format!(
                "<rect x=\"{left:.1}\" y=\"{top:.1}\" width=\"{cell:.1}\" height=\"{cell:.1}\" fill=\"rgb({r},{g},{b})\"/>"
            ));
            let stiffness = self.stiffness(point);
            line(format!("<text x=\"{:.1}\" y=\"{:.1}\" fill=\"{ink}\">{stiffness:.0}</text>", x(px), y(py) + 4.0));
        }
        let (cx, cy, r) = (x(truth[0]), y(truth[1]), SCALE * radius);
        line(format!(
            "<circle cx=\"{cx:.1}\" cy=\"{cy:.1}\" r=\"{r:.1}\" fill=\"none\" stroke=\"#06c\" stroke-dasharray=\"5 3\"/>"
        ));
        let (fx, fy) = (x(found[0]), y(found[1]));
        line(format!(
            "<path d=\"M{:.1} {fy:.1}h16M{fx:.1} {:.1}v16\" stroke=\"#06c\" stroke-width=\"2\"/>",
            fx - 8.0,
            fy - 8.0
        ));
        let (middle, bottom, left) = (whole / 2.0, MARGIN + size, MARGIN - 6.0);
        for tick in [0.0, 0.25, 0.5, 0.75, 1.0].map(|share| share * edge) {
            let mm = format!("{:.0}", 1e3 * tick);
            line(format!("<path d=\"M{:.1} {bottom:.1}v4M{MARGIN} {:.1}h-4\" stroke=\"#888\"/>", x(tick), y(tick)));
            line(format!("<text x=\"{:.1}\" y=\"{:.1}\">{mm}</text>", x(tick), bottom + 15.0));
            line(format!("<text x=\"{left:.1}\" y=\"{:.1}\" text-anchor=\"end\">{mm}</text>", y(tick) + 4.0));
        }
        line(format!("<text x=\"{middle:.1}\" y=\"{:.1}\">x (mm)</text>", bottom + 30.0));
        line(format!("<text transform=\"translate(13 {middle:.1}) rotate(-90)\">y (mm)</text>"));
        line(format!(
            "<text x=\"{middle:.1}\" y=\"{:.1}\">apparent stiffness (N/m); dashed: the nodule, cross: where it was found</text>",
            MARGIN - 16.0
        ));
        line("</svg>".to_owned());
        svg
    }
}

impl fmt::Display for Map {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut head = "   y \\ x mm".to_owned();
        for x in self.lines(0) {
            write!(head, "{:7.1}", x * 1e3)?;
        }
        writeln!(f, "{head}")?;
        for y in self.lines(1).into_iter().rev() {
            write!(f, "{:11.1}", y * 1e3)?;
            for x in self.lines(0) {
                let point = self.points.iter().position(|point| *point == [x, y]);
                write!(f, "{:7.0}", point.map_or(f64::NAN, |point| self.stiffness(point)))?;
            }
            writeln!(f)?;
        }
        Ok(())
    }
}
