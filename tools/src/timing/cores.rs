//! How much of each processor core the rate groups used.

/// The groups on one core.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CoreUse {
    /// The core; `None` for groups that the system may put anywhere.
    pub cpu: Option<usize>,
    /// Each group with the share of the time (0 to 1) in which it was at work, from the start of a release to its end.
    /// That is elapsed time: what took the core away meanwhile is in it.
    pub groups: Vec<(String, f64)>,
}

impl CoreUse {
    /// The share of all its groups together.
    pub fn share(&self) -> f64 {
        self.groups.iter().map(|(_, share)| share).sum()
    }
}
