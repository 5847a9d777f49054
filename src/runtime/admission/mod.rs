//! What is said of a graph before it runs: whether it can work, and what it asks for.

pub(crate) mod check;
pub(crate) mod plan;
