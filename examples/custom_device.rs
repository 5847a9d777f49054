//! A device of the program's own: a simulated hand that feels the force and gives way to it.
//!
//! The device is a mass on a spring and a damper whose other end a target pushes into the block and draws back: how far
//! the tool gets depends on the force that the device is written. Every 500th read fails, as a read from a real device
//! may; the run goes on with the last state and the report counts it.
//!
//! Look for: a gap between target and tool that the contact force makes; the hand's pull (300 N/m times the gap) and the
//! contact force equal where both stand still (0.75 s, 2.25 s), apart where mass and damper take their part; and "the
//! device had no new state" among the events of the report.
//!
//! `cargo run --release --example custom_device`

use std::f64::consts::PI;
use std::time::Duration;

use palpate::prelude::*;

/// Printed lines, and the time between two of them.
const PRINTS: u32 = 12;
const PRINT_EVERY: Duration = Duration::from_millis(250);

/// Where the hand wants to be at `time_s`: 15 mm deep into a block that is 100 mm high and out again, twice.
fn target(time_s: f64) -> Vec3 {
    let depth = 0.020 * (PI * time_s / 1.5).sin().powi(2);
    Vec3::new(0.05, 0.05, 0.105 - depth)
}

/// A hand that holds a handle: a mass pulled towards a moving target by a spring and a damper.
#[derive(Debug)]
struct Hand {
    position: Vec3,
    velocity: Vec3,
    /// The last force that was written (N): it acts until the next.
    force: Vec3,
    now: Nanos,
    reads: u32,
}

impl Hand {
    /// Hand and handle (kg).
    const MASS: f64 = 0.15;
    /// What holds the handle at the target (N/m).
    const STIFFNESS: f64 = 300.0;
    /// A little below critical (N s/m).
    const DAMPING: f64 = 10.0;
    /// One read in so many finds no new state.
    const STALE_EVERY: u32 = 500;

    fn new() -> Self {
        Self { position: target(0.0), velocity: Vec3::zeros(), force: Vec3::zeros(), now: Nanos::ZERO, reads: 0 }
    }

    /// Symplectic Euler; `time` is the schedule's, not a clock's, so that a virtual run repeats bit for bit.
    fn advance(&mut self, time: Nanos) {
        let dt = time.saturating_sub(self.now).as_secs_f64();
        let pull = (target(time.as_secs_f64()) - self.position) * Self::STIFFNESS - self.velocity * Self::DAMPING;
        self.velocity += (pull + self.force) * (dt / Self::MASS);
        self.position += self.velocity * dt;
        self.now = time;
    }
}

impl Device for Hand {
    fn name(&self) -> &str {
        "hand"
    }

    fn capabilities(&self) -> Capabilities {
        Capabilities { max_force_n: 4.0, ..Capabilities::default() }
    }

    fn read(&mut self, time: Nanos) -> Result<DeviceState, DeviceFault> {
        // The hand moves on whether or not its state gets through.
        self.advance(time);
        self.reads += 1;
        if self.reads.is_multiple_of(Self::STALE_EVERY) {
            return Err(DeviceFault::Stale);
        }
        Ok(DeviceState { position: self.position, velocity: self.velocity, ..DeviceState::default() })
    }

    fn write(&mut self, command: ForceCommand) -> Result<(), DeviceFault> {
        self.force = command.force;
        Ok(())
    }
}

fn main() -> Result<(), Error> {
    let body = Block::builder([12; 3], [0.1; 3]).fix(Face::ZMin).build()?;
    let session = Session::builder(body)
        .device(Hand::new())
        .friction(0.5)
        .duration_s((PRINT_EVERY * PRINTS).as_secs_f64())
        .build()?;
    let mut running = session.start()?;
    let mut viewer = running.take_viewer().expect("nobody else has taken it");

    println!("   time    target      tool       gap      hand   contact");
    for _ in 0..PRINTS {
        running.wait_for(PRINT_EVERY);
        let tool = viewer.tool();
        let target = target(tool.time.as_secs_f64());
        let gap = tool.position.z - target.z;
        println!(
            "{:5.2} s  {:5.1} mm  {:5.1} mm  {:5.1} mm  {:6.2} N  {:6.2} N  {:?}",
            tool.time.as_secs_f64(),
            target.z * 1e3,
            tool.position.z * 1e3,
            gap * 1e3,
            Hand::STIFFNESS * gap,
            tool.commanded_force.z,
            tool.mode,
        );
    }
    running.wait();
    println!("\n{}", running.stop());
    Ok(())
}
