//! Charts as inline SVG, coloured by the classes of the page around them.
//!
//! Drawn by hand in place of a library: classes make one picture serve light, dark and print, and long series are thinned
//! out to what a screen can show.

mod area;
mod axis;
mod chart;
mod decades;
mod heat;
mod heat_map;
mod sign;
mod thin;

pub(super) use axis::{Axis, round_step};
pub(super) use chart::{Bars, Chart, Line, Mark, Point, Signs};
pub(super) use decades::power;
pub(super) use heat::{HeatScale, heat_style};
pub(super) use heat_map::{HeatCell, HeatMap};
pub(super) use sign::Sign;
