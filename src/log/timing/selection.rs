//! Which part of a log is looked at.

use crate::time::Nanos;

/// A span of log time and some of the rate groups.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Selection {
    /// Records from this time on; from the start if left out.
    pub from: Option<Nanos>,
    /// Records before this time; to the end if left out.
    pub to: Option<Nanos>,
    /// Names of the groups that are looked at; all if empty.
    pub groups: Vec<String>,
}

impl Selection {
    /// True if it leaves nothing out.
    pub fn is_everything(&self) -> bool {
        *self == Self::default()
    }

    /// True if `time` is in the span.
    pub fn has_time(&self, time: Nanos) -> bool {
        self.from.is_none_or(|from| time >= from) && self.to.is_none_or(|to| time < to)
    }

    /// True if the group `name` is looked at.
    pub fn has_group(&self, name: &str) -> bool {
        self.groups.is_empty() || self.groups.iter().any(|group| group == name)
    }
}
