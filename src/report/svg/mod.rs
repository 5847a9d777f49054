//! Charts as inline SVG, coloured by the classes of the page around them.
//!
//! Drawn by hand in place of a library: classes make one picture serve light, dark and print, and long series are thinned
//! out to what a screen can show.

mod axis;
mod chart;
mod thin;

pub(super) use axis::Axis;
pub(super) use chart::{Chart, Line, Mark, Point};
