//! The wait of a device-paced group on its thread: the device's blocking read, and a watchdog beside it.
//!
//! The thread asks the group's first actor to wait, in slices, so that a stop is noticed. A frame runs the next
//! release of the nominal grid, or a later one if it comes late; one in a period that has had its release is left out.
//! When the device stays silent the clock takes over, and an actor that does not wait is waited for by the clock: the
//! thread never spins.

use crate::accounting::timeline::Wake;
use crate::group::group_run::GroupRun;
use crate::reports::report::RuntimeFault;
use crate::time::Nanos;

/// A stop is noticed within this.
const SLICE: Nanos = Nanos(50_000_000);

/// What the thread of a device-paced group knows about the device.
#[derive(Debug)]
pub(crate) struct DeviceWait {
    watchdog: Nanos,
    period: Nanos,
    /// The watchdog has taken over.
    driving: bool,
}

impl DeviceWait {
    /// The pace of `group`; `None` if the clock releases it.
    pub(crate) fn new(group: &GroupRun) -> Option<Self> {
        let watchdog = group.spec.watchdog()?;
        Some(Self { watchdog, period: group.spec.rate().period(), driving: false })
    }

    /// Waits for the release of `group` that is due at `due`; `None` if it is time to leave instead.
    ///
    /// `now` reads the clock. `sleep` waits until a time and is false if it is time to leave.
    ///
    /// # Errors
    /// The panic of the actor that was asked.
    pub(crate) fn wait(
        &mut self,
        group: &mut GroupRun,
        due: Nanos,
        now: impl Fn() -> Nanos,
        mut sleep: impl FnMut(Nanos) -> bool,
    ) -> Result<Option<Wake>, RuntimeFault> {
        let earliest = group.ledger.next_frame_from();
        let entered = now();
        // Nothing comes before the start of the run, for which the device does not wait.
        let mut go_on = sleep(Nanos::ZERO);
        while go_on {
            // What is to come to rest does not wait for a device that may be gone.
            let patient = !self.driving && !group.ledger.winding_down;
            let limit = if patient { due + self.watchdog } else { due };
            let asked = now();
            let timeout = limit.saturating_sub(asked).min(SLICE);
            if group.wait_for_device(timeout)? {
                let frame = now();
                if std::mem::take(&mut self.driving) {
                    group.note_watchdog(false);
                }
                if frame >= earliest {
                    return Ok(Some(Wake::by_frame(frame)));
                }
                go_on = sleep(earliest);
                continue;
            }
            // The clock waits in place of an actor that did not, a period at a time, lest it miss the device for long.
            go_on = sleep((asked + timeout).min(now() + self.period));
            let woke = now();
            if go_on && woke >= limit {
                if patient {
                    self.driving = true;
                    group.note_watchdog(true);
                }
                // If it was due before, what kept it was the device that the wait before this one was for.
                return Ok(Some(Wake::by_timer(limit.max(entered), woke)));
            }
        }
        Ok(None)
    }
}
