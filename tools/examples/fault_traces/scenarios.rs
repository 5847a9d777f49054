//! One run per fault: what is injected, and the force that reached the device all the while.

#[path = "../../../examples/common/altered_block.rs"]
mod altered_block;

use std::sync::{Arc, Mutex};
use std::time::Duration;

use palpate::devices::{Capabilities, Device, DeviceFault, DeviceState, ForceCommand};
use palpate::model::Vec3;
use palpate::model::body::{Block, Body, State};
use palpate::model::local::Kind as LocalModelKind;
use palpate::model::mesh::Face;
use palpate::prelude::*;
use palpate::runtime::Nanos;
use palpate::scene::SafetyStage;
use palpate::session::{SessionBuilder, Summary};

use altered_block::AlteredBlock;

/// The declared ramp time: the scene's default `safety.ramp_ms`.
pub const RAMP_S: f64 = 0.1;
/// When the fault is injected (s).
pub const FAULT_S: f64 = 0.5;

/// What goes wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    LocalPanics,
    LocalNotFinite,
    DeviceReadPanics,
    DeviceWritePanics,
    DeviceNotFinite,
    GlobalPanics,
    GlobalNotFinite,
    GlobalStalls,
    GlobalNeverReturns,
    DiskFull,
    LoggerStuck,
    ProcessStopped,
    StopRequested,
    Dropped,
}

impl Fault {
    pub const ALL: [Self; 14] = [
        Self::LocalPanics,
        Self::LocalNotFinite,
        Self::DeviceReadPanics,
        Self::DeviceWritePanics,
        Self::DeviceNotFinite,
        Self::GlobalPanics,
        Self::GlobalNotFinite,
        Self::GlobalStalls,
        Self::GlobalNeverReturns,
        Self::DiskFull,
        Self::LoggerStuck,
        Self::ProcessStopped,
        Self::StopRequested,
        Self::Dropped,
    ];

    /// True where the haptic side runs on as if nothing had happened.
    pub fn leaves_the_force(self) -> bool {
        matches!(
            self,
            Self::DeviceNotFinite
                | Self::GlobalPanics
                | Self::GlobalNotFinite
                | Self::GlobalStalls
                | Self::GlobalNeverReturns
                | Self::DiskFull
                | Self::LoggerStuck
                | Self::ProcessStopped
        )
    }

    fn of_body(self) -> bool {
        matches!(
            self,
            Self::LocalPanics
                | Self::LocalNotFinite
                | Self::GlobalPanics
                | Self::GlobalNotFinite
                | Self::GlobalStalls
                | Self::GlobalNeverReturns
        )
    }

    fn model(self) -> LocalModelKind {
        match self {
            Self::LocalPanics | Self::LocalNotFinite => LocalModelKind::Full,
            _ => LocalModelKind::Patch,
        }
    }

    fn duration_s(self) -> f64 {
        match self {
            Self::GlobalNeverReturns => 4.0,
            Self::GlobalStalls => 2.5,
            Self::ProcessStopped => 2.0,
            _ => 1.0,
        }
    }
}

/// What happened.
#[derive(Debug)]
pub struct Trace {
    /// Time of the release (s) and the force that was written in it (N).
    pub written: Vec<(f64, [f64; 3])>,
    /// `None` where the session was dropped.
    pub summary: Option<Summary>,
}

impl Trace {
    /// Magnitudes (N) over time (s).
    pub fn magnitudes(&self) -> impl Iterator<Item = (f64, f64)> {
        self.written.iter().map(|&(t, force)| (t, Vec3::from(force).norm()))
    }

    /// The largest force before the fault (N), and when the force was zero for good (s), if it was.
    pub fn before_and_rest(&self) -> (f64, Option<f64>) {
        let before = self.magnitudes().filter(|sample| sample.0 < FAULT_S).map(|sample| sample.1).fold(0.0, f64::max);
        let last_force = self.magnitudes().filter(|sample| sample.1 > 0.0).map(|sample| sample.0).last();
        let ends_at_zero = self.written.last().is_some_and(|last| last.1 == [0.0; 3]);
        (before, last_force.filter(|_| ends_at_zero))
    }
}

/// The time of the newest release and everything that was written.
type Written = Arc<Mutex<(f64, Vec<(f64, [f64; 3])>)>>;

/// A tool that presses and moves sideways, on a device with one fault.
#[derive(Debug)]
struct Tool {
    fault: Fault,
    written: Written,
    /// Time of the release (s); counted on when nobody reads any more.
    now: f64,
    read: bool,
    done: bool,
}

impl Device for Tool {
    fn name(&self) -> &str {
        "tool"
    }

    fn capabilities(&self) -> Capabilities {
        Capabilities { max_force_n: 8.0, ..Capabilities::default() }
    }

    fn read(&mut self, time: Nanos) -> Result<DeviceState, DeviceFault> {
        (self.now, self.read) = (time.as_secs_f64(), false);
        self.written.lock().expect("no writer panics").0 = self.now;
        let due = self.now >= FAULT_S;
        assert!(!(due && self.fault == Fault::DeviceReadPanics), "the driver gave way");
        let pressed = (self.now / 0.05).min(1.0);
        let mut position = Vec3::new(0.05 + 0.01 * (9.0 * self.now).sin(), 0.052, 0.101 - 0.009 * pressed);
        if due && self.now < FAULT_S + 0.05 && self.fault == Fault::DeviceNotFinite {
            position.y = f64::NAN;
        }
        self.read = true;
        Ok(DeviceState { position, ..DeviceState::default() })
    }

    fn write(&mut self, command: ForceCommand) -> Result<(), DeviceFault> {
        if !std::mem::take(&mut self.read) {
            self.now += 1e-3;
        }
        if self.now >= FAULT_S && self.fault == Fault::DeviceWritePanics && !self.done {
            self.done = true;
            panic!("the driver gave way");
        }
        self.written.lock().expect("no writer panics").1.push((self.now, command.force.into()));
        Ok(())
    }
}

/// What fails in the body, shared by its copies.
#[derive(Clone)]
struct BodyFault {
    /// What happens at the next evaluation of the forces, once the run is that far.
    fault: Arc<Mutex<Option<Fault>>>,
    written: Written,
    let_go: Arc<Mutex<bool>>,
}

impl BodyFault {
    fn due(&self) -> Option<Fault> {
        let mut fault = self.fault.lock().expect("nobody panics under it");
        if self.written.lock().expect("no writer panics").0 < FAULT_S {
            return None;
        }
        // Where the whole body is the local model NaN stays, everything else happens once.
        if *fault == Some(Fault::LocalNotFinite) { *fault } else { fault.take() }
    }

    fn strike(&self, forces: &mut [Vec3]) {
        match self.due() {
            Some(Fault::LocalPanics | Fault::GlobalPanics) => panic!("the body gave way"),
            Some(Fault::LocalNotFinite | Fault::GlobalNotFinite) => forces.fill(Vec3::repeat(f64::NAN)),
            Some(Fault::GlobalStalls) => std::thread::sleep(Duration::from_secs(1)),
            Some(Fault::GlobalNeverReturns) => {
                while !*self.let_go.lock().expect("nobody panics under it") {
                    std::thread::sleep(Duration::from_millis(10));
                }
            }
            _ => {}
        }
    }
}

/// Runs a session on real threads, with `fault` after half a second.
pub fn run(fault: Fault) -> Result<Trace, Error> {
    let block = Block::builder([6; 3], [0.1; 3]).node_mass(0.5e-3).stiffness(30.0).fix(Face::ZMin).build()?;
    // Room for the run: the haptic thread must not wait for memory.
    let written: Written = Arc::new(Mutex::new((0.0, Vec::with_capacity(10_000))));
    let let_go = Arc::new(Mutex::new(false));
    let fault_in_body = BodyFault {
        fault: Arc::new(Mutex::new(Some(fault).filter(|fault| fault.of_body()))),
        written: Arc::clone(&written),
        let_go: Arc::clone(&let_go),
    };
    let body = AlteredBlock::new(block, move |block: &mut Block, state: &State, forces: &mut [Vec3]| {
        block.forces(state, forces);
        fault_in_body.strike(forces);
    });
    let body = body.with_copies();
    let device = Tool { fault, written: Arc::clone(&written), now: 0.0, read: false, done: false };
    let builder = Session::builder(body)
        .device(device)
        .model(fault.model())
        .substeps_per_ms(2)
        // It would not be over when the fault comes.
        .safety_off([SafetyStage::StartUp])
        .keep_records()
        .duration_s(fault.duration_s());
    let (builder, _log) = logged(builder, fault)?;
    let session = builder.build()?;
    let running = session.start()?;
    let summary = match fault {
        Fault::StopRequested | Fault::Dropped => {
            running.wait_for(Duration::from_secs_f64(FAULT_S));
            (fault == Fault::StopRequested).then(|| running.stop())
        }
        _ => {
            if fault == Fault::ProcessStopped {
                running.wait_for(Duration::from_secs_f64(FAULT_S));
                stop_this_process(Duration::from_millis(600));
            }
            running.wait();
            Some(running.stop())
        }
    };
    *let_go.lock().expect("nobody panics under it") = true;
    let written = written.lock().expect("no writer panics").1.clone();
    Ok(Trace { written, summary })
}

/// Whoever reads the log, for as long as it is needed.
struct Log(Option<std::process::Child>);

impl Drop for Log {
    fn drop(&mut self) {
        if let Some(reader) = &mut self.0 {
            // It may have ended.
            let _ = reader.kill().and_then(|()| reader.wait());
        }
    }
}

/// The session with a log that fails, if that is the fault.
fn logged(builder: SessionBuilder, fault: Fault) -> Result<(SessionBuilder, Log), Error> {
    match fault {
        Fault::DiskFull => Ok((builder.log("/dev/full"), Log(None))),
        Fault::LoggerStuck => {
            // A pipe whose other end is open and never read.
            let path = std::env::temp_dir().join(format!("palpate-{}.fifo", std::process::id()));
            let shell = "rm -f \"$1\"; mkfifo \"$1\"; exec sleep 60 < \"$1\"";
            let reader = std::process::Command::new("sh").args(["-c", shell, "sh"]).arg(&path).spawn();
            let reader = reader.map_err(|error| Error::io(&path, error))?;
            while !path.exists() {
                std::thread::sleep(Duration::from_millis(1));
            }
            Ok((builder.log(path), Log(Some(reader))))
        }
        _ => Ok((builder, Log(None))),
    }
}

/// SIGSTOP, and SIGCONT after `pause`.
fn stop_this_process(pause: Duration) {
    let process = std::process::id();
    let shell = format!("kill -STOP {process}; sleep {}; kill -CONT {process}", pause.as_secs_f64());
    // Without a shell nothing is stopped, which the trace then shows.
    let _ = std::process::Command::new("sh").args(["-c", &shell]).status();
}
