//! Which part of a log is looked at.

use palpate::log::Window;

/// A span of log time and some of the rate groups.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Selection {
    /// The span.
    pub window: Window,
    /// Names of the groups that are looked at; all if empty.
    pub groups: Vec<String>,
}

impl Selection {
    /// True if the group `name` is looked at.
    pub fn has_group(&self, name: &str) -> bool {
        self.groups.is_empty() || self.groups.iter().any(|group| group == name)
    }
}
