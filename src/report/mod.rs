//! What a run has to say when it is over, as text for a terminal.

pub mod text;
pub mod units;
mod verdict;

pub use text::to_text;
pub use verdict::{Verdict, verdict};
