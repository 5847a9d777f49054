//! A device that guards the thread that calls it: it arms itself after a warm-up and counts.

use std::sync::{Arc, Mutex};

use palpate::devices::{Capabilities, Device, DeviceFault, DeviceState, ForceCommand};
use palpate::model::Vec3;
use palpate::runtime::Nanos;
use palpate::runtime::exchange::ExchangeWriter;

use super::{Guard, Offence, allocator, kernel};

/// Reads before the thread is armed: the first is made before the start, the others see a dozen resyncs.
pub const WARM_UP: u64 = 600;
/// Ticks under guard.
pub const GUARDED: u64 = 1000;
/// When a control commits its offence.
const OFFENDS_AT: u64 = WARM_UP + 100;

/// What the guarded thread tells the main thread.
#[derive(Clone, Copy, Debug, Default)]
pub struct Progress {
    /// Scheduled times of the first and last guarded tick.
    pub span: [Nanos; 2],
    pub is_realtime: bool,
    /// The error number if the filter was refused.
    pub refused: Option<i32>,
    pub is_done: bool,
    /// Guarded ticks.
    pub ticks: u64,
    /// Faults in them, minor and major.
    pub faults: [i64; 2],
    /// Waits of all, and of the worst of them.
    pub waits: i64,
    pub most_waits: i64,
}

/// A tool that presses, drags and lifts for as long as anybody asks.
#[derive(Debug)]
pub struct GuardedDevice {
    pub guard: Guard,
    pub offence: Offence,
    /// Held by the main thread.
    pub lock: Arc<Mutex<()>>,
    pub told: ExchangeWriter<Progress>,
    /// How far above its way the centre of the tool is (m).
    above: f64,
    progress: Progress,
    reads: u64,
    before: kernel::Usage,
    treasure: Option<Box<u64>>,
}

impl GuardedDevice {
    pub fn new(
        guard: Guard,
        offence: Offence,
        lock: Arc<Mutex<()>>,
        told: ExchangeWriter<Progress>,
        above: f64,
    ) -> Self {
        let (progress, before, treasure) = (Progress::default(), kernel::Usage::default(), Some(Box::new(7)));
        Self { guard, offence, lock, told, above, progress, reads: 0, before, treasure }
    }

    fn arm(&mut self, time: Nanos) {
        self.progress.span[0] = time;
        self.progress.is_realtime = kernel::is_realtime();
        match self.guard {
            Guard::SystemCalls => {
                let refused = kernel::forbid_everything_but_sleep().err();
                self.progress.refused = refused.map(|error| error.raw_os_error().unwrap_or(-1));
            }
            Guard::Counters => self.before = kernel::Usage::now(),
        }
        allocator::arm();
    }

    fn count(&mut self, time: Nanos) {
        self.progress.ticks += 1;
        self.progress.span[1] = time;
        if self.guard == Guard::Counters {
            let now = kernel::Usage::now();
            let waits = now.waits - self.before.waits;
            self.progress.waits += waits;
            self.progress.most_waits = self.progress.most_waits.max(waits);
            for (sum, (now, before)) in self.progress.faults.iter_mut().zip(now.faults.iter().zip(self.before.faults)) {
                *sum += now - before;
            }
            self.before = now;
        }
    }

    fn offend(&mut self) {
        match self.offence {
            Offence::None => {}
            Offence::Allocate => self.treasure = std::hint::black_box(Some(Box::new(self.reads))),
            Offence::Free => drop(std::hint::black_box(self.treasure.take())),
            Offence::Call => kernel::ask_for_the_parent(),
            Offence::Lock => drop(self.lock.lock()),
            Offence::Fault => kernel::fault_a_page(),
            Offence::Wait => kernel::wait_a_little(),
        }
    }
}

impl Device for GuardedDevice {
    fn name(&self) -> &str {
        "guarded"
    }

    fn capabilities(&self) -> Capabilities {
        Capabilities { max_force_n: 4.0, ..Capabilities::default() }
    }

    fn read(&mut self, time: Nanos) -> Result<DeviceState, DeviceFault> {
        self.reads += 1;
        match self.reads {
            WARM_UP => self.arm(time),
            WARM_UP.. if !self.progress.is_done => self.count(time),
            _ => {}
        }
        if self.reads == OFFENDS_AT {
            self.offend();
        }
        if self.reads == WARM_UP + GUARDED {
            allocator::disarm();
            self.progress.is_done = true;
        }
        *self.told.buffer() = self.progress;
        self.told.publish(time);
        Ok(DeviceState { position: tool(time.as_secs_f64()) + Vec3::z() * self.above, ..DeviceState::default() })
    }

    fn write(&mut self, _: ForceCommand) -> Result<(), DeviceFault> {
        Ok(())
    }
}

/// The tool at time `t` (s): pressed and dragged, lifted off twice a second. It comes from a side that is held, so that
/// patches grow after the warm-up.
fn tool(t: f64) -> Vec3 {
    let pressed = (0.004 + 0.009 * (12.5 * t).sin()).min(0.009);
    Vec3::new(0.05 + 0.04 * (1.5 * t).cos(), 0.05 + 0.02 * (2.3 * t).sin(), 0.1 - pressed)
}
