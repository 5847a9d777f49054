//! The timing of a run in detail, as a page.

mod html;

pub use html::timing_html;
