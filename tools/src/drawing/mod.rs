//! Charts and pages.

pub(crate) mod html;
mod picture;
pub(crate) mod svg;

pub use picture::{COLOURS, Picture, Series};
