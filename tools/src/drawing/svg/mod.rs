//! Charts as inline SVG, coloured by the classes of the page around them.
//!
//! Drawn by hand in place of a library: classes make one picture serve light, dark and print, and long series are thinned
//! out to what a screen can show.

mod axis;
mod chart;
mod heat;
mod heat_map;
mod label;
mod sign;
mod thin;

pub(crate) use axis::{Axis, around, power, round_step};
pub(crate) use chart::{Bars, Chart, Line, Mark, Point, Signs};
pub(crate) use heat::{HeatScale, heat_style};
pub(crate) use heat_map::{HeatCell, HeatMap};
pub use sign::Sign;
