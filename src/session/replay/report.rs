//! What a replay found.

use std::fmt;

use crate::runtime::{Nanos, RuntimeFault};

/// A count of the samples of one topic that a replay found identical with the log, and of those that it did not.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Compared {
    /// Name of the topic.
    pub topic: &'static str,
    /// Samples in the log that are to be compared.
    pub logged: u64,
    /// Samples that the replay computed.
    pub computed: u64,
    /// Pairs that are the same in every bit of every field.
    pub identical: u64,
    /// Samples in the log behind a fault, which are not compared.
    pub left_out: u64,
}

impl Compared {
    /// True if all samples are there and identical.
    pub fn is_identical(&self) -> bool {
        self.logged == self.computed && self.logged == self.identical
    }
}

/// A sample that a replay computed differently from the log.
#[derive(Clone, Debug, PartialEq)]
pub struct Difference {
    /// The logged time of the sample, or the computed one if there is none in the log.
    pub time: Nanos,
    /// Name of the topic of the sample.
    pub topic: &'static str,
    /// Name of the field that differs, or `count` if only one side has the sample.
    pub what: &'static str,
    /// The sample in the log, in words.
    pub logged: Option<String>,
    /// The sample that was computed, in words.
    pub computed: Option<String>,
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let side = |sample: &Option<String>| sample.clone().unwrap_or_else(|| "nothing".to_owned());
        let (logged, computed) = (side(&self.logged), side(&self.computed));
        write!(
            f,
            "{} at t = {} s differs in {}: logged {logged}, computed {computed}",
            self.topic,
            self.time.as_secs_f64(),
            self.what
        )
    }
}

/// The first fault of a logged run; what came after it cannot be repeated.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LoggedFault {
    /// The time at which the failed release was due: what was due before is compared, nothing else.
    pub time: Nanos,
    /// A description of the fault.
    pub what: String,
    /// True if a new global model served after it; else the run ended.
    pub restarted: bool,
}

/// A release that was due before a fault and still ran when the failed one began.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnrepeatedRelease {
    /// Name of the rate group of the release.
    pub group: String,
    /// Number of the release.
    pub tick: u64,
    /// The time at which the release was due.
    pub time: Nanos,
}

/// Releases before a fault that need what only came after it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Unrepeated {
    /// All releases that could not be repeated.
    pub releases: Vec<UnrepeatedRelease>,
    /// The reason: the thing that the first of them waits for.
    pub why: String,
}

/// The result of a replay: how much of the log it computed again, and where it differs.
#[derive(Clone, Debug, PartialEq)]
pub struct ReplayReport {
    /// The comparison of `/force`: forces before the safety pipeline.
    pub force: Compared,
    /// The comparison of `/force_commanded`: forces after the safety pipeline.
    pub commanded: Compared,
    /// The comparisons of the other computed topics: `/contact`, `/resync`, `/global` and `/probe`.
    pub others: Vec<Compared>,
    /// The earliest sample that differs.
    pub first_difference: Option<Difference>,
    /// The time at which the last release of the log was due.
    pub end: Nanos,
    /// The first fault of the logged run: everything before it was compared, nothing after.
    pub logged_fault: Option<LoggedFault>,
    /// Releases before that fault that cannot be repeated.
    pub unrepeated: Option<Unrepeated>,
    /// The fault that kept the re-execution from getting to the end, if one did.
    pub fault: Option<RuntimeFault>,
}

impl ReplayReport {
    /// True if every sample before a logged fault, or to the end, was computed and is the same in every bit. Nothing
    /// compared is not identical.
    pub fn is_identical(&self) -> bool {
        self.fault.is_none() && self.first_difference.is_none() && self.force.identical > 0
    }

    /// The comparisons of all topics.
    pub fn topics(&self) -> impl Iterator<Item = &Compared> {
        [&self.force, &self.commanded].into_iter().chain(&self.others)
    }

    /// The time up to which samples were compared.
    pub fn compared_up_to(&self) -> Nanos {
        self.logged_fault.as_ref().map_or(self.end, |fault| fault.time)
    }
}

impl fmt::Display for ReplayReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let of = |compared: &Compared| format!("{} of {}", compared.identical, compared.logged);
        writeln!(f, "{} force samples bit-identical, {} commanded", of(&self.force), of(&self.commanded))?;
        let other = |compared: &Compared| format!("{} {}", of(compared), compared.topic.trim_start_matches('/'));
        let others: Vec<String> = self.others.iter().map(other).collect();
        writeln!(f, "and {}", others.join(", "))?;
        if let Some(fault) = &self.logged_fault {
            let (up_to, end) = (fault.time.as_secs_f64(), self.end.as_secs_f64());
            let after = if fault.restarted { "a new global model served after it" } else { "the run ended with it" };
            let left_out = self.force.left_out;
            writeln!(f, "COMPARED ONLY up to t = {up_to} s of {end} s, to the fault `{}`", fault.what)?;
            writeln!(f, "{after}, {left_out} force samples from there on were not compared")?;
        }
        if let Some(Unrepeated { releases, why }) = &self.unrepeated {
            let name = |left: &UnrepeatedRelease| {
                format!("release {} of `{}` (t = {} s)", left.tick, left.group, left.time.as_secs_f64())
            };
            let names: Vec<String> = releases.iter().map(name).collect();
            writeln!(f, "not repeated, because they saw what came after the fault: {}; {why}", names.join(", "))?;
        }
        if let Some(fault) = &self.fault {
            writeln!(f, "the re-execution ended before the log: {fault}")?;
        }
        if let Some(difference) = &self.first_difference {
            writeln!(f, "first difference: {difference}")?;
        }
        Ok(())
    }
}
