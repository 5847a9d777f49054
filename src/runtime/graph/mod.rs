//! The graph made visible: groups, actors and ports as data, and that as text, JSON, DOT and SVG.

pub(crate) mod dot;
pub(crate) mod json;
pub(crate) mod layout;
pub(crate) mod svg;
pub(crate) mod text;
pub(crate) mod view;
pub(crate) mod wiring;
