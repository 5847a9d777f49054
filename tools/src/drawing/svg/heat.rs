//! Colour scales: numbers as colours, and the bar that says which is which.
//!
//! The colours are those of cividis (Nunez, Anderton and Renslow 2018, doi 10.1371/journal.pone.0199239): their lightness rises
//! evenly, they are seen alike with and without a red-green deficiency, and they stand on light and dark paper.

use std::fmt::Write;

use super::super::html::escaped;
use super::axis::Axis;

/// Dark to light.
const COLOURS: [&str; 18] = [
    "#00204c", "#002a66", "#00346e", "#273f6c", "#3c4a6b", "#4c556b", "#5b5f6d", "#686a70", "#757575", "#838178",
    "#928c78", "#a19876", "#b0a572", "#c0b26d", "#d1bf66", "#e1cc5c", "#f3db4f", "#ffe945",
];
/// Drawn size of a bar.
const WIDTH: f64 = 340.0;
const HEIGHT: f64 = 52.0;
const EDGE: f64 = 22.0;
const LETTER: f64 = 6.4;

/// The style of the classes that [`HeatScale::class`] names.
pub(crate) fn heat_style() -> String {
    COLOURS.iter().enumerate().map(|(level, colour)| format!("svg .q{level} {{ fill: {colour}; }}\n")).collect()
}

/// Which number has which colour.
#[derive(Clone, Debug)]
pub(crate) struct HeatScale(Axis);

impl HeatScale {
    /// The colours spread over `axis`, dark for the least.
    pub(crate) fn new(axis: Axis) -> Self {
        Self(axis)
    }

    /// From 0 to one below the number of colours; what is outside has the colour of the end.
    pub(crate) fn level(&self, value: f64) -> usize {
        let level = (self.0.place(value) * COLOURS.len() as f64).floor();
        if level.is_nan() { 0 } else { level.clamp(0.0, (COLOURS.len() - 1) as f64) as usize }
    }

    /// The class that fills with the colour of `value`.
    pub(crate) fn class(&self, value: f64) -> String {
        format!("q{}", self.level(value))
    }

    /// The bar of colours with its numbers.
    pub(crate) fn to_svg(&self) -> String {
        let across = WIDTH - 2.0 * EDGE;
        let wide = across / COLOURS.len() as f64;
        let label = escaped(&self.0.label);
        let mut svg = format!("<svg viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\" aria-label=\"colours: {label}\">\n");
        // Writing to a string cannot fail.
        for level in 0..COLOURS.len() {
            let x = EDGE + level as f64 * wide;
            // A little wider than its place: no seam between two.
            let _ = write!(
                svg,
                "<rect class=\"q{level}\" x=\"{x:.1}\" y=\"2\" width=\"{:.1}\" height=\"12\"/>",
                wide + 0.4
            );
        }
        let mut free = 0.0;
        for (value, words) in self.0.ticks() {
            let x = EDGE + across * self.0.place(value);
            let _ = write!(svg, "<path class=\"tick\" d=\"M{x:.1} 14v4\"/>");
            let half = words.as_ref().map_or(0.0, |words| 0.5 * LETTER * words.chars().count() as f64);
            if let Some(words) = words.filter(|_| x - half >= free) {
                let _ = write!(svg, "<text x=\"{x:.1}\" y=\"29\" text-anchor=\"middle\">{words}</text>");
                free = x + half + LETTER;
            }
        }
        let middle = 0.5 * WIDTH;
        let _ = writeln!(svg, "\n<text x=\"{middle}\" y=\"46\" text-anchor=\"middle\">{label}</text>\n</svg>");
        svg
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_colours_rise_in_lightness() {
        let luminance = |colour: &str| {
            let part = |at: usize| {
                let value = f64::from(u8::from_str_radix(&colour[at..at + 2], 16).unwrap()) / 255.0;
                if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
            };
            0.2126 * part(1) + 0.7152 * part(3) + 0.0722 * part(5)
        };
        assert!(COLOURS.windows(2).all(|pair| luminance(pair[0]) < luminance(pair[1])));
    }

    #[test]
    fn every_number_has_a_colour_and_the_bar_has_its_unit() {
        let scale = HeatScale::new(Axis::log("error (%)", [0.1, 10.0]));
        assert_eq!([0.0, 0.1, 1.0, 10.0, 1e9, f64::NAN].map(|value| scale.level(value)), [0, 0, 9, 17, 17, 0]);
        assert_eq!(heat_style().lines().count(), COLOURS.len());
        let svg = scale.to_svg();
        assert!(svg.contains(">error (%)<") && svg.contains(">10<") && svg.contains("class=\"q17\""), "{svg}");
    }
}
