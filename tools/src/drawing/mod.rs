//! Charts and pages.

pub(crate) mod html;
mod picture;
mod sheet;
pub(crate) mod svg;

pub use picture::{COLOURS, Picture, Series};
pub use sheet::{BLUE, Curve, GREEN, GREY, INK, ORANGE, Panel, RED, Sheet};
