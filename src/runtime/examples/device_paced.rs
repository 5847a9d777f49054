//! A device that owns the clock: its blocking read releases the 1 kHz group, a watchdog stands by.
//!
//! The device is a thread that sends a frame 998 times per second, stops for 300 ms as if its cable had a bad contact, and
//! comes back. The run asks for 1 kHz and a watchdog of 20 ms: frames release the group at the device's own pace, about two
//! periods per second have none and are skipped, and in the silence the clock takes over, so that the group goes on with
//! the last frame.
//!
//! Look for: the stalled peer as the cause of about 26 slips, 6 for the slower clock and the 20 ms that the watchdog waits;
//! one take-over of the watchdog; and an elapsed time that nothing has stretched. A busy machine adds to the slips.
//!
//! `cargo run --release --example device_paced`

use palpate_runtime::{Actor, Execution, GraphError, Nanos, Outcome, RateGroup, Runtime, TickContext};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::time::{Duration, Instant};

/// Length of the run, and what the device does in it.
const LENGTH: Nanos = Nanos(3_000_000_000);
const FRAMES_HZ: f64 = 998.0;
const SILENT_FROM: Duration = Duration::from_millis(1200);
const SILENT_FOR: Duration = Duration::from_millis(300);

/// The device's own side: sends readings at its own rate until nobody listens any more.
fn deliver(frames: &SyncSender<f64>) {
    let begun = Instant::now();
    for n in 0_u64.. {
        let time = Duration::from_secs_f64(n as f64 / FRAMES_HZ);
        if time >= SILENT_FROM && time < SILENT_FROM + SILENT_FOR {
            continue;
        }
        std::thread::sleep(time.saturating_sub(begun.elapsed()));
        // A full channel means that the other side is busy: the frame is lost, as with a real device.
        if let Err(TrySendError::Disconnected(_)) = frames.try_send((4.0 * time.as_secs_f64()).cos()) {
            return;
        }
    }
}

/// The program's side: what the driver of a real device would be.
struct Driver {
    frames: Receiver<f64>,
    /// The newest reading.
    reading: f64,
    /// A frame has come since the last tick.
    fresh: bool,
}

impl Actor for Driver {
    fn name(&self) -> &str {
        "driver"
    }

    fn wait(&mut self, timeout: Nanos) -> bool {
        // The first frame ends the wait; those that have piled up behind it count as one with it.
        let first = self.frames.recv_timeout(timeout.to_duration()).ok();
        let newest = first.map(|first| self.frames.try_iter().last().unwrap_or(first));
        self.fresh = newest.is_some();
        self.reading = newest.unwrap_or(self.reading);
        self.fresh
    }

    fn tick(&mut self, _: &TickContext) -> Outcome {
        // Without a frame the release is the watchdog's: the run goes on with the last reading, and says so.
        if std::mem::take(&mut self.fresh) { Outcome::Continue } else { Outcome::Degraded(1) }
    }
}

fn main() -> Result<(), GraphError> {
    let (sender, frames) = sync_channel(64);
    let mut graph = Runtime::builder(Execution::Threaded);
    let paced = RateGroup::hz(1000).name("paced").device_paced(Nanos(20_000_000));
    graph.group(paced, vec![Box::new(Driver { frames, reading: 0.0, fresh: false })]).until(LENGTH);
    let runtime = graph.build()?;
    let clock = std::thread::spawn(move || deliver(&sender));
    let running = runtime.start()?;
    running.wait_for(Duration::MAX);
    let report = running.stop();
    // The driver is gone and with it the receiver: the next frame finds nobody.
    clock.join().expect("the device's thread does not panic");

    let paced = &report.groups[0];
    println!("periods elapsed          {} = {} + {} skipped", paced.elapsed_periods, paced.released, paced.skipped);
    for (cause, periods) in paced.slips.iter().filter(|(_, periods)| *periods > 0) {
        println!("  skipped, {:15} {periods}", cause.name());
    }
    println!("releases without a frame {}", paced.degraded);
    println!("watchdog take-overs      {}", paced.watchdog_takeovers);
    assert!(paced.watchdog_takeovers >= 1, "the device was silent");
    Ok(())
}
