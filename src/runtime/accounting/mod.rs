//! The books of a rate group: when releases are due, which run, which are skipped, and why.

pub(crate) mod ledger;
pub(crate) mod overrun;
pub(crate) mod timeline;
