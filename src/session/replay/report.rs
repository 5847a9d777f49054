//! What a replay found.

use std::fmt;

use crate::runtime::RuntimeFault;
use crate::time::Nanos;

/// How the samples of one topic compare.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Compared {
    /// Samples in the log.
    pub logged: u64,
    /// Samples that the replay computed.
    pub computed: u64,
    /// Pairs that are the same in every bit: time, force and model version.
    pub identical: u64,
}

impl Compared {
    /// True if all samples are there and identical.
    pub fn is_identical(&self) -> bool {
        self.logged == self.computed && self.logged == self.identical
    }
}

/// A sample that is not the same.
#[derive(Clone, Debug, PartialEq)]
pub struct Difference {
    /// Its time: the logged one, or the computed one if there is none in the log.
    pub time: Nanos,
    /// Its topic.
    pub topic: &'static str,
    /// What differs: `force_n`, `model_version`, `time`, or `count` if only one side has the sample.
    pub what: &'static str,
    /// The sample in the log.
    pub logged: Option<String>,
    /// The sample that was computed.
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

/// What a replay found.
#[derive(Clone, Debug, PartialEq)]
pub struct ReplayReport {
    /// `/force`: before the safety pipeline.
    pub force: Compared,
    /// `/force_commanded`: after it.
    pub commanded: Compared,
    /// The earliest sample that differs.
    pub first_difference: Option<Difference>,
    /// A fault of the logged run and the time of its release: everything before it was compared, nothing after.
    pub logged_fault: Option<(Nanos, String)>,
    /// Why the re-execution did not get to the end, if it did not.
    pub fault: Option<RuntimeFault>,
}

impl ReplayReport {
    /// True if every sample was computed and is the same in every bit.
    pub fn is_identical(&self) -> bool {
        self.fault.is_none() && self.first_difference.is_none()
    }
}

impl fmt::Display for ReplayReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let of = |compared: Compared| format!("{} of {}", compared.identical, compared.logged);
        writeln!(f, "{} force samples bit-identical, {} commanded", of(self.force), of(self.commanded))?;
        if let Some((time, what)) = &self.logged_fault {
            writeln!(f, "compared up to t = {} s, where the logged run ended: {what}", time.as_secs_f64())?;
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
