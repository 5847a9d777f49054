//! A real session in a child process, with a device that guards its real-time thread.

pub mod allocator;
mod device;
mod kernel;

use std::io::Write;
use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::{Command, Output};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::time::{Duration, Instant};

use palpate::devices::{Scripted, ToolPath};
use palpate::log::{LogEntry, LogReader, LogRecord};
use palpate::model::body::Block;
use palpate::model::contact::{ContactMode, ToolShape};
use palpate::model::local::Kind as LocalModelKind;
use palpate::model::mesh::Face;
use palpate::runtime::Nanos;
use palpate::runtime::RateGroup;
use palpate::runtime::exchange::exchange;
use palpate::scene::{LinkSpec, StepKind};
use palpate::session::{Session, SessionBuilder};

pub use device::GUARDED;
use device::{GuardedDevice, Progress};

/// What the thread is guarded with, besides the allocator.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Guard {
    /// A filter that lets nothing but the sleep into the kernel.
    SystemCalls,
    /// The kernel's counters of faults and waits.
    Counters,
}

/// What a control does in a guarded tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Offence {
    None,
    Allocate,
    Free,
    /// A system call that does nothing.
    Call,
    /// A lock that another thread holds.
    Lock,
    Fault,
    Wait,
}

/// One run of a child.
#[derive(Clone, Copy, Debug)]
pub struct Case {
    pub model: LocalModelKind,
    pub guard: Guard,
    pub offence: Offence,
    /// Ask for a real-time policy and for locked memory.
    pub privileged: bool,
    /// The tool is a sphere that touches in several places.
    pub has_shape: bool,
    /// Another tool presses beside it.
    pub has_second: bool,
    /// The global model is behind a link.
    pub is_linked: bool,
}

/// Puts the global model of a case into another session, for test programs that know a way there.
pub static ELSEWHERE: OnceLock<fn(SessionBuilder, Case) -> SessionBuilder> = OnceLock::new();

/// Held while a child runs. Its haptic thread may keep a core to itself, as ticks of an unoptimised build take longer than their period:
/// the threads of another child on that core would not run before this one ends.
static ALONE: Mutex<()> = Mutex::new(());

const VARIABLE: &str = "PALPATE_HOT_PATH_CHILD";
const LOG: &str = "PALPATE_HOT_PATH_LOG";
const NOT_POSSIBLE: i32 = 77;

const MODELS: [LocalModelKind; 8] = LocalModelKind::ALL;
const GUARDS: [Guard; 2] = [Guard::SystemCalls, Guard::Counters];
const OFFENCES: [Offence; 7] =
    [Offence::None, Offence::Allocate, Offence::Free, Offence::Call, Offence::Lock, Offence::Fault, Offence::Wait];

/// What a child that ran to its end found, and what its log says of the guarded ticks.
#[derive(Debug)]
pub struct Found {
    pub ticks: u64,
    pub faults: [i64; 2],
    pub waits: i64,
    pub most_waits: i64,
    pub is_realtime: bool,
    /// Logged releases of the haptic group, resyncs, and ticks in contact.
    pub logged: u64,
    pub resyncs: u64,
    pub in_contact: u64,
    /// The most places that touched at once.
    pub places: u16,
}

/// How a child ended.
#[derive(Debug)]
pub enum Ended {
    Well(Found),
    Signal(i32, String),
}

impl Case {
    pub fn new(model: LocalModelKind, guard: Guard) -> Self {
        let (privileged, has_shape, has_second, is_linked) = (true, false, false, false);
        Self { model, guard, offence: Offence::None, privileged, has_shape, has_second, is_linked }
    }

    pub fn with(self, offence: Offence) -> Self {
        Self { offence, ..self }
    }

    pub fn unprivileged(self) -> Self {
        Self { privileged: false, ..self }
    }

    pub fn with_shape(self) -> Self {
        Self { has_shape: true, ..self }
    }

    pub fn with_second(self) -> Self {
        Self { has_second: true, ..self }
    }

    pub fn linked(self) -> Self {
        Self { is_linked: true, ..self }
    }

    fn shape(self) -> ToolShape {
        if self.has_shape { ToolShape::Sphere { radius: 0.03 } } else { ToolShape::Point }
    }

    /// The session without devices and log.
    pub fn body_and_models(self) -> SessionBuilder {
        let block = Block::builder([6; 3], [0.1; 3]).node_mass(0.5e-3).stiffness(30.0).damping_ratio(0.3);
        let block = block.fix(Face::ZMin).fix(Face::XMax).build().expect("a good block");
        Session::builder(block)
            .friction(0.5)
            .model(self.model)
            // One of the linear patches shows the implicit step.
            .local_step(if self.model == LocalModelKind::ScaledBoundary { StepKind::Implicit } else { StepKind::Auto })
            .crossfade_ms(10.0)
    }

    /// Runs it in a process of its own; `None`, with the reason printed, where the kernel refuses the filter.
    pub fn run(self) -> Option<Ended> {
        let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
        let folder = tempfile::tempdir().expect("a temporary folder");
        let log = folder.path().join("run.mcap");
        let Output { status, stdout, stderr } = Command::new(std::env::current_exe().expect("its own path"))
            .args(["--exact", "the_guarded_session", "--ignored", "--nocapture"])
            .env(VARIABLE, self.encode())
            .env(LOG, &log)
            .output()
            .expect("the test program starts again");
        let (out, err) = (String::from_utf8_lossy(&stdout), String::from_utf8_lossy(&stderr));
        if let Some(signal) = status.signal() {
            return Some(Ended::Signal(signal, err.into_owned()));
        }
        let told = out.lines().find_map(|line| line.strip_prefix("guarded: "));
        if status.code() == Some(NOT_POSSIBLE) {
            let reason = format!("seccomp was refused: {}", told.unwrap_or_default());
            assert!(std::env::var_os("PALPATE_REQUIRE_SECCOMP").is_none(), "{reason}");
            println!("skipped: {reason}");
            return None;
        }
        assert!(status.success(), "{self:?}: {status}\n{out}\n{err}");
        let told = told.unwrap_or_else(|| panic!("{self:?} said nothing\n{out}\n{err}"));
        println!("{self:?}: {told}");
        let numbers: Vec<i64> = told.split(' ').filter_map(|word| word.parse().ok()).collect();
        let [from, to, ticks, minor, major, waits, most_waits, is_realtime] = numbers[..] else {
            panic!("{self:?} said {told:?}")
        };
        let mut found = Found {
            ticks: ticks as u64,
            faults: [minor, major],
            waits,
            most_waits,
            is_realtime: is_realtime == 1,
            logged: 0,
            resyncs: 0,
            in_contact: 0,
            places: 0,
        };
        found.read_log(&log, [from, to].map(|time| Nanos(time as u64)));
        Some(Ended::Well(found))
    }

    fn encode(self) -> String {
        let place = |found: Option<usize>| found.expect("every value is in its list").to_string();
        [
            place(MODELS.iter().position(|model| *model == self.model)),
            place(GUARDS.iter().position(|guard| *guard == self.guard)),
            place(OFFENCES.iter().position(|offence| *offence == self.offence)),
            usize::from(self.privileged).to_string(),
            usize::from(self.has_shape).to_string(),
            usize::from(self.has_second).to_string(),
            usize::from(self.is_linked).to_string(),
        ]
        .join(" ")
    }

    fn of_environment() -> Option<Self> {
        let text = std::env::var(VARIABLE).ok()?;
        let places: Vec<usize> = text.split(' ').map(|word| word.parse().expect("numbers")).collect();
        let [model, guard, offence, privileged, has_shape, has_second, is_linked] = places[..] else {
            panic!("{text:?} is no case")
        };
        Some(Self {
            model: MODELS[model],
            guard: GUARDS[guard],
            offence: OFFENCES[offence],
            privileged: privileged == 1,
            has_shape: has_shape == 1,
            has_second: has_second == 1,
            is_linked: is_linked == 1,
        })
    }
}

impl Found {
    /// Counts what the log holds of the guarded ticks.
    fn read_log(&mut self, log: &Path, [from, to]: [Nanos; 2]) {
        // The child ends without closing it: what is guarded was written before.
        for entry in LogReader::open(log).expect("the log of the child").map_while(Result::ok) {
            let LogEntry::Record(record) = entry else { continue };
            if !(from..=to).contains(&record.time()) {
                continue;
            }
            match record {
                LogRecord::Tick(timing) if timing.group == 0 => self.logged += 1,
                LogRecord::Resync(_) => self.resyncs += 1,
                LogRecord::Contact(contact) if matches!(contact.mode, ContactMode::Stick | ContactMode::Slip) => {
                    self.in_contact += 1;
                    self.places = self.places.max(contact.count);
                }
                _ => {}
            }
        }
    }
}

/// The child: runs the case of the environment and ends the process.
pub fn child() {
    let Some(case) = Case::of_environment() else {
        println!("a part of the other tests: it runs in a process that they start");
        return;
    };
    let (told, mut progress) = exchange(Progress::default);
    let lock = Arc::new(Mutex::new(()));
    let _held = lock.lock().expect("nobody else has it yet");
    let device = GuardedDevice::new(case.guard, case.offence, Arc::clone(&lock), told, case.shape().radius());
    let session = case.body_and_models();
    let session = match case.has_second {
        true => session.named_device("guarded", device).named_device("second", Scripted::new(pressing())),
        false => session.device(device).tool(case.shape()),
    };
    let mut session = session.log(std::env::var_os(LOG).expect("set by the parent"));
    if let Some(elsewhere) = ELSEWHERE.get() {
        session = elsewhere(session, case);
    }
    if case.is_linked {
        session = session.link(LinkSpec { delay_ms: 5.0, jitter_ms: 2.0, loss: 0.01, ..LinkSpec::default() });
    }
    if !case.privileged {
        session = session.local(RateGroup::hz(1000).best_effort());
    }
    let running = session.build().expect("a good session").start().expect("it starts");
    while !progress.get().is_done {
        running.wait_for(Duration::from_millis(10));
        progress.refresh();
        if let Some(error) = progress.get().refused {
            tell(&std::io::Error::from_raw_os_error(error).to_string());
            kernel::exit_now(NOT_POSSIBLE);
        }
        assert!(!running.finished(), "{:?}", running.stop());
    }
    // The log is written half a second behind, or later where the machine has other work for its cores.
    let log = std::env::var_os(LOG).expect("set by the parent");
    let patience = Instant::now() + Duration::from_secs(60);
    while !has_tick_since(Path::new(&log), progress.get().span[1]) && Instant::now() < patience {
        running.wait_for(Duration::from_millis(250));
    }
    let Progress { span: [from, to], ticks, faults: [minor, major], waits, most_waits, is_realtime, .. } =
        *progress.get();
    let is_realtime = u8::from(is_realtime);
    tell(&format!(
        "from {} to {} ns: {ticks} ticks, faults {minor} minor {major} major , waits {waits} most {most_waits} , realtime {is_realtime}",
        from.0, to.0
    ));
    kernel::exit_now(0);
}

/// True once the log holds a release of the haptic group that was due at `time` or later.
fn has_tick_since(log: &Path, time: Nanos) -> bool {
    let entries = LogReader::open(log).into_iter().flatten().map_while(Result::ok);
    let mut ticks = entries.filter_map(|entry| match entry {
        LogEntry::Record(LogRecord::Tick(tick)) if tick.group == 0 => Some(tick.scheduled),
        _ => None,
    });
    ticks.any(|scheduled| scheduled >= time)
}

/// Comes down on the top within 0.3 s and stays there.
fn pressing() -> ToolPath {
    ToolPath::new(vec![0.0, 0.3], vec![[0.03, 0.07, 0.102], [0.03, 0.07, 0.094]]).expect("a good path")
}

fn tell(words: &str) {
    let mut out = std::io::stdout().lock();
    writeln!(out, "\nguarded: {words}").and_then(|()| out.flush()).expect("the parent listens");
}
