//! Log files as files: what is in one, whether all of it is sound, and what of a damaged one can be saved.

mod check;
mod info;
mod recover;
mod salvage;
mod summary;

pub(crate) use check::CheckReport;
pub(crate) use check::check;
pub(crate) use info::LogInfo;
pub(crate) use recover::Lost;
pub(crate) use recover::{Recovered, recover};

/// First and last of the times seen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Span(pub(super) Option<(u64, u64)>);

impl Span {
    pub(super) fn push(&mut self, time: u64) {
        let (first, last) = self.0.unwrap_or((time, time));
        self.0 = Some((first.min(time), last.max(time)));
    }
}
