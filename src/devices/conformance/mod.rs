//! What every device must keep to, as checks that a program runs against its own from one test.
//!
//! ```
//! use palpate::devices::conformance::Conformance;
//! use palpate::devices::{Scripted, ToolPath};
//!
//! let report = Conformance::check(|| Scripted::new(ToolPath::constant([0.0, 0.0, 0.1]).expect("finite")));
//! assert!(report.passed(), "{report}");
//! ```
//!
//! Each check takes a device of its own from the maker, drives it with times as a run would, and drops it. A real device
//! moves and is held by hand, never free: one that shortens forces above its limit exerts its whole limit for a quarter of a
//! second of scheduled time.

mod checks;

use std::fmt;
use std::panic::{AssertUnwindSafe, catch_unwind};

use super::Device;

/// The result of one check of a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Verdict {
    /// The device keeps to it.
    Passed,
    /// The device does not keep to it.
    Failed,
    /// Nobody can see from outside whether it does: it tells no force that it exerts, or the suite cannot disconnect it.
    NotObservable,
}

/// One check and what came of it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Check {
    /// The rule that is checked, as a sentence about the device.
    pub name: &'static str,
    /// The result of the check.
    pub verdict: Verdict,
    /// An account of what was seen where the device did not pass; empty otherwise.
    pub message: String,
}

/// The results of all checks of a device, in their order.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Conformance {
    /// The device's name; empty if it never gave one.
    pub device: String,
    /// The checks.
    pub checks: Vec<Check>,
}

impl Conformance {
    /// Runs every check against devices from `make`.
    ///
    /// # Real-time
    /// Not called in a tick.
    pub fn check<D: Device>(make: impl FnMut() -> D) -> Self {
        run(make, None::<fn(&mut D)>)
    }

    /// Runs every check of [`check`](Self::check), and one more: what the device does when it is cut off.
    ///
    /// # Real-time
    /// Not called in a tick.
    pub fn check_disconnecting<D: Device>(make: impl FnMut() -> D, disconnect: impl FnMut(&mut D)) -> Self {
        run(make, Some(disconnect))
    }

    /// True if no check failed.
    ///
    /// # Real-time
    /// Not called in a tick.
    pub fn passed(&self) -> bool {
        self.failures().next().is_none()
    }

    /// The checks that failed.
    ///
    /// # Real-time
    /// Not called in a tick.
    pub fn failures(&self) -> impl Iterator<Item = &Check> {
        self.checks.iter().filter(|check| check.verdict == Verdict::Failed)
    }

    /// The verdict of the check with this name.
    ///
    /// # Real-time
    /// Not called in a tick.
    pub fn verdict(&self, name: &str) -> Option<Verdict> {
        self.checks.iter().find(|check| check.name == name).map(|check| check.verdict)
    }
}

impl fmt::Display for Conformance {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "device `{}`", self.device)?;
        for check in &self.checks {
            let verdict = match check.verdict {
                Verdict::Passed => "ok    ",
                Verdict::Failed => "FAILED",
                Verdict::NotObservable => "unseen",
            };
            let message = if check.message.is_empty() { String::new() } else { format!(": {}", check.message) };
            writeln!(f, "  {verdict}  {}{message}", check.name)?;
        }
        Ok(())
    }
}

fn run<D: Device>(mut make: impl FnMut() -> D, mut disconnect: Option<impl FnMut(&mut D)>) -> Conformance {
    let mut device = String::new();
    let mut checks: Vec<Check> = Vec::new();
    for (name, check) in checks::ALL {
        let verdict = guarded(|| {
            let mut made = make();
            if device.is_empty() {
                made.name().clone_into(&mut device);
            }
            check(&mut made)
        });
        checks.push(told(name, verdict));
    }
    let name = "it tells that it is gone, again and again, and never panics";
    checks.push(told(
        name,
        match &mut disconnect {
            None => Err(checks::Fail::Unseen("the suite has no way to disconnect it".to_owned())),
            Some(disconnect) => guarded(|| {
                let mut made = make();
                checks::before_disconnect(&mut made);
                disconnect(&mut made);
                checks::after_disconnect(&mut made)
            }),
        },
    ));
    Conformance { device, checks }
}

fn guarded(check: impl FnOnce() -> checks::Seen) -> checks::Seen {
    catch_unwind(AssertUnwindSafe(check)).unwrap_or_else(|panic| {
        let words = panic.downcast_ref::<&str>().map(|words| (*words).to_owned());
        let words = words.or_else(|| panic.downcast_ref::<String>().cloned());
        Err(checks::Fail::Wrong(format!("it panicked: {}", words.unwrap_or_default())))
    })
}

fn told(name: &'static str, seen: checks::Seen) -> Check {
    let (verdict, message) = match seen {
        Ok(()) => (Verdict::Passed, String::new()),
        Err(checks::Fail::Wrong(message)) => (Verdict::Failed, message),
        Err(checks::Fail::Unseen(message)) => (Verdict::NotObservable, message),
    };
    Check { name, verdict, message }
}
