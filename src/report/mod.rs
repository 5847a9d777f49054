//! The report on a run that is over, as text for a terminal.

mod page;
pub mod text;
pub mod units;
mod verdict;

pub use text::to_text;
pub use verdict::{RunVerdict, verdict};
