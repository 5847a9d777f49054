//! The report on a run that is over, as text for a terminal.

mod page;
mod text;
mod units;
mod verdict;

pub use page::Page;
pub use units::Quantity;
pub use verdict::RunVerdict;
