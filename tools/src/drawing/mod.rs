//! Charts and pages.

mod colour;
pub(crate) mod html;
mod picture;
mod sheet;
pub(crate) mod svg;

pub use colour::Colour;
pub use picture::{Picture, Series};
pub use sheet::{Curve, Panel, Sheet};
pub use svg::Sign;
