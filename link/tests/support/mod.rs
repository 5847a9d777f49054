//! Both sides of a link as processes of their own: this test program again, in a role that the environment names.
#![allow(dead_code)]

use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use palpate::devices::ToolPath;
use palpate::log::LogRecord;
use palpate::model::Vec3;
use palpate::model::body::Block;
use palpate::model::local::Kind;
use palpate::model::mesh::Face;
use palpate::session::{Session, SessionBuilder, Summary};
use palpate_link::{Access, Event, GlobalSide, TLS_RUNTIME, serve};

const ROLE: &str = "PALPATE_LINK_ROLE";

/// The test that is a child: every test program has it.
pub const AS_A_CHILD: &str = "as_a_child";

/// A block of 6^3 nodes, 2 cm apart, held at the bottom, that is pressed within half a second and then stroked.
pub fn session(model: Kind, friction: f64) -> SessionBuilder {
    let block = Block::builder([6; 3], [0.1; 3]).node_mass(0.5e-3).stiffness(30.0).damping_ratio(0.3);
    let block = block.fix(Face::ZMin).build().unwrap();
    let position = |t: f64| {
        let pressed = ((t - 0.1) / 0.4).clamp(0.0, 1.0);
        [0.05 + 0.008 * (5.0 * t).sin(), 0.052, 0.102 - 0.011 * pressed - 0.001 * (7.0 * t).sin()]
    };
    let times: Vec<f64> = (0..10_000).map(|n| f64::from(n) * 2e-3).collect();
    let positions = times.iter().map(|&t| position(t)).collect();
    Session::builder(block).path(ToolPath::new(times, positions).unwrap()).model(model).friction(friction)
}

/// What the child of a test does; returns at once in the test program itself.
pub fn child() {
    let Ok(role) = std::env::var(ROLE) else { return };
    let words: Vec<&str> = role.split_whitespace().collect();
    let (address, config, friction) = (words[1], words[2], words[3].parse().unwrap());
    let access = if config == "-" { Access::default() } else { Access::read(Path::new(config)).unwrap() };
    let made = || session(Kind::Predictive, friction).forget_bases();
    if words[0] == "serve" {
        let tell = |event: Event| match event {
            Event::Listening => say("listening"),
            Event::Began(_) => say("came"),
            Event::Refused(error) => say(&format!("refused {error}")),
            Event::Ended(summary) => say(&format!("ended {:?}", summary.runtime.fault)),
            _ => {}
        };
        serve(|| made().build_global(), address, &access, || false, tell).unwrap();
        return;
    }
    let seconds: f64 = words[4].parse().unwrap();
    let run = || {
        let global = GlobalSide::at(address, &access)?;
        let running = made().keep_records().duration_s(seconds).global_over(global).build()?.start()?;
        say("began");
        running.wait();
        Ok::<_, palpate::Error>(running.stop())
    };
    match run() {
        Ok(summary) => {
            let felt = Felt::of(&summary);
            std::fs::write(words[5], felt.to_text()).unwrap();
            say("ran");
        }
        Err(error) => say(&format!("error {error}")),
    }
}

fn say(line: &str) {
    let mut out = std::io::stdout().lock();
    let _ = writeln!(out, "\n@ {line}").and_then(|()| out.flush());
}

/// What the hand felt, tick by tick.
#[derive(Clone, Debug, Default)]
pub struct Felt {
    /// Time (s), commanded force (N), computed force (N), age of the model (s).
    pub ticks: Vec<(f64, f64, [f64; 3], f64)>,
    pub lost: u64,
    pub fault: String,
}

impl Felt {
    pub fn of(summary: &Summary) -> Self {
        let force = |record: &LogRecord| match record {
            LogRecord::Force(force) => Some(*force),
            _ => None,
        };
        let command = |record: &LogRecord| match record {
            LogRecord::Command(command) => Some((command.time, Vec3::from(command.force_n).norm())),
            _ => None,
        };
        let forces = summary.records.iter().filter_map(force);
        let mut commands = summary.records.iter().filter_map(command).peekable();
        let mut ticks = Vec::new();
        for force in forces {
            while commands.next_if(|(time, _)| *time < force.time).is_some() {}
            if let Some((time, norm)) = commands.next_if(|(time, _)| *time == force.time) {
                ticks.push((time.as_secs_f64(), norm, force.force_n, force.model_age_s));
            }
        }
        let fault = summary.runtime.fault.as_ref().map(ToString::to_string).unwrap_or_default();
        Self { ticks, lost: summary.runtime.lost_records, fault }
    }

    fn to_text(&self) -> String {
        let mut text = format!("{} {}\n", self.lost, self.fault);
        for (time, commanded, [x, y, z], age) in &self.ticks {
            text += &format!("{time} {commanded} {x} {y} {z} {age}\n");
        }
        text
    }

    fn read(path: &Path) -> Self {
        let text = std::fs::read_to_string(path).unwrap();
        let (first, rest) = text.split_once('\n').unwrap();
        let (lost, fault) = first.split_once(' ').unwrap();
        let tick = |line: &str| {
            let n: Vec<f64> = line.split(' ').map(|word| word.parse().unwrap()).collect();
            (n[0], n[1], [n[2], n[3], n[4]], n[5])
        };
        Self { ticks: rest.lines().map(tick).collect(), lost: lost.parse().unwrap(), fault: fault.to_owned() }
    }

    /// The largest commanded force in a time (N).
    pub fn largest(&self, from: f64, until: f64) -> f64 {
        self.within(from, until).map(|tick| tick.1).fold(0.0, f64::max)
    }

    pub fn within(&self, from: f64, until: f64) -> impl Iterator<Item = &(f64, f64, [f64; 3], f64)> {
        self.ticks.iter().filter(move |tick| (from..until).contains(&tick.0))
    }

    /// Check what holds whatever the link does: by the age limit there is no force, no number is none, and no record is lost.
    #[track_caller]
    pub fn assert_safe(&self) {
        assert_eq!((self.lost, &*self.fault), (0, ""));
        for (time, commanded, _, age) in &self.ticks {
            assert!(commanded.is_finite(), "{commanded} N at {time} s");
            assert!(*age < 0.3 || *commanded == 0.0, "{commanded} N at {time} s of a model that is {age} s old");
        }
    }
}

/// A process of one side; killed when dropped.
#[derive(Debug)]
pub struct Process {
    child: Child,
    lines: std::sync::mpsc::Receiver<String>,
    out: PathBuf,
}

impl Process {
    fn start(role: String, out: PathBuf) -> Self {
        let mut command = Command::new(std::env::current_exe().unwrap());
        if role.contains(" tls/") {
            command.env("ZENOH_RUNTIME", TLS_RUNTIME);
        }
        command.args(["--exact", AS_A_CHILD, "--nocapture"]).env(ROLE, role);
        let mut child = command.stdout(Stdio::piped()).stderr(Stdio::inherit()).spawn().unwrap();
        let (sender, lines) = std::sync::mpsc::channel();
        let stdout = BufReader::new(child.stdout.take().unwrap());
        std::thread::spawn(move || {
            for line in stdout.lines().map_while(Result::ok) {
                if let Some(said) = line.strip_prefix("@ ") {
                    let _ = sender.send(said.to_owned());
                }
            }
        });
        Self { child, lines, out }
    }

    pub fn serve(address: &str) -> Self {
        Self::serve_with(address, "-", 0.5)
    }

    /// A global side that listens.
    pub fn serve_with(address: &str, config: &str, friction: f64) -> Self {
        let process = Self::start(format!("serve {address} {config} {friction}"), PathBuf::new());
        process.waits_for("listening");
        process
    }

    pub fn haptic(address: &str, seconds: f64, out: &Path) -> Self {
        Self::haptic_with(address, "-", 0.5, seconds, out)
    }

    pub fn haptic_with(address: &str, config: &str, friction: f64, seconds: f64, out: &Path) -> Self {
        let role = format!("haptic {address} {config} {friction} {seconds} {}", out.display());
        Self::start(role, out.to_owned())
    }

    /// The next line that it says.
    pub fn says(&self) -> String {
        self.lines.recv_timeout(Duration::from_secs(60)).expect("it says something")
    }

    #[track_caller]
    pub fn waits_for(&self, what: &str) {
        let said = self.says();
        assert_eq!(said, what);
    }

    /// Sends a signal, such as STOP.
    pub fn signal(&self, name: &str) {
        let pid = self.child.id().to_string();
        assert!(Command::new("kill").args([&format!("-{name}"), &pid]).status().unwrap().success());
    }

    /// What a haptic side felt, when it has run.
    #[track_caller]
    pub fn felt(&self) -> Felt {
        self.waits_for("ran");
        let felt = Felt::read(&self.out);
        felt.assert_safe();
        felt
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// An address of this machine that nobody listens at.
pub fn free_address() -> String {
    let socket = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    format!("tcp/{}", socket.local_addr().unwrap())
}

/// Sleeps until so many seconds after `began`.
pub fn until(began: Instant, seconds: f64) {
    std::thread::sleep(Duration::from_secs_f64(seconds).saturating_sub(began.elapsed()));
}
