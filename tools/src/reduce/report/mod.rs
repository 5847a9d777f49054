//! What `palpate reduce` found out: for a terminal, for programs, and as a page with plots.

mod figures;
mod html;
mod json;
mod map;
mod table;
mod tables;
mod text;
mod words;

#[cfg(test)]
mod sample;

pub use html::to_html;
pub use json::to_json;
pub use text::to_text;
pub use words::locality_verdict;
