//! A device that owns the clock: its blocking read releases the 1 kHz group, a watchdog stands by.
//!
//! The device is a thread that sends a frame 998 times per second, stops for 300 ms as if its cable had a bad contact, and
//! comes back. The run asks for 1 kHz and a watchdog of 20 ms: frames release the haptic group at the device's own pace,
//! about two periods per second have none and are skipped, and in the silence the clock takes over, so that the force goes
//! on with the last state.
//!
//! Look for: the stalled peer as the cause of about 26 slips, 6 for the slower clock and the 20 ms that the watchdog waits;
//! one take-over and its end among the events; and an elapsed time that nothing has stretched. A busy machine adds to the
//! slips.
//!
//! `cargo run --release --example device_paced`

use std::sync::Arc;
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::thread::sleep;
use std::time::{Duration, Instant};

use palpate_runtime::*;
use palpate_runtime::SlipCause;

/// Length of the run (s), and what the device does in it.
const SECONDS: f64 = 3.0;
const FRAMES_HZ: f64 = 998.0;
const SILENT_FROM: Duration = Duration::from_millis(1200);
const SILENT_FOR: Duration = Duration::from_millis(300);

/// The device's own side: sends positions at its own rate until nobody listens any more.
fn deliver(frames: &SyncSender<Vec3>) {
    let begun = Instant::now();
    for n in 0_u64.. {
        let time = Duration::from_secs_f64(n as f64 / FRAMES_HZ);
        if time >= SILENT_FROM && time < SILENT_FROM + SILENT_FOR {
            continue;
        }
        sleep(time.saturating_sub(begun.elapsed()));
        let depth = 0.015 * (1.0 - (4.0 * time.as_secs_f64()).cos()) / 2.0;
        // A full channel means that the other side is busy: the frame is lost, as with a real device.
        if let Err(TrySendError::Disconnected(_)) = frames.try_send(Vec3::new(0.05, 0.05, 0.105 - depth)) {
            return;
        }
    }
}

/// The program's side: what the driver of a real device would be.
#[derive(Debug)]
struct Paced {
    frames: Receiver<Vec3>,
    position: Vec3,
    /// A frame has come since the last read.
    fresh: bool,
    received: Arc<std::sync::Mutex<u64>>,
}

impl Paced {
    fn take(&mut self, position: Vec3) {
        self.position = position;
        self.fresh = true;
        *self.received.lock().expect("no holder panics") += 1;
    }
}

impl Device for Paced {
    fn name(&self) -> &str {
        "paced"
    }

    fn capabilities(&self) -> Capabilities {
        Capabilities { max_force_n: 4.0, ..Capabilities::default() }
    }

    fn wait(&mut self, timeout: Duration) -> bool {
        // The first frame ends the wait; those that have piled up behind it count as one with it.
        let mut next = self.frames.recv_timeout(timeout).ok();
        let delivered = next.is_some();
        while let Some(position) = next {
            self.take(position);
            next = self.frames.try_recv().ok();
        }
        delivered
    }

    fn read(&mut self, _: Nanos) -> Result<DeviceState, DeviceFault> {
        // Without a frame the release is the watchdog's: the run goes on with the last state.
        if !std::mem::take(&mut self.fresh) {
            return Err(DeviceFault::Stale);
        }
        Ok(DeviceState { position: self.position, velocity: Vec3::zeros(), buttons: 0 })
    }

    fn write(&mut self, _: ForceCommand) -> Result<(), DeviceFault> {
        Ok(())
    }
}

fn main() -> Result<(), Error> {
    let (sender, frames) = sync_channel(64);
    let received = Arc::default();
    // Fresh, because the session asks for a first state before anybody waits.
    let position = Vec3::new(0.05, 0.05, 0.105);
    let device = Paced { frames, position, fresh: true, received: Arc::clone(&received) };
    let body = Block::builder([8; 3], [0.1; 3]).fix(Face::ZMin).build()?;
    let session = Session::builder(body)
        .device(device)
        .local(RateGroup::hz(1000).device_paced(Nanos(20_000_000)))
        .friction(0.5)
        .crossfade_ms(10.0)
        .duration_s(SECONDS)
        .build()?;
    let clock = std::thread::spawn(move || deliver(&sender));
    let running = session.start()?;
    running.wait();
    let summary = running.stop();
    // The session is gone and with it the receiver: the next frame finds nobody.
    clock.join().expect("the device's thread does not panic");

    let local = &summary.runtime.groups[0];
    println!("frames received      {}", received.lock().expect("no holder panics"));
    println!(
        "periods elapsed      {} = {} released + {} skipped",
        local.elapsed_periods, local.released, local.skipped
    );
    for cause in [SlipCause::StalledPeer, SlipCause::LateWake, SlipCause::LongTick, SlipCause::Policy] {
        println!("  skipped, {:12} {}", cause.name(), local.slips.of(cause));
    }
    println!("watchdog take-overs  {}\n", local.watchdog_takeovers);
    println!("{summary}");
    Ok(())
}
