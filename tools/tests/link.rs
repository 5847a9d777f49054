//! `palpate serve`, `palpate run --global` and `palpate link keys`, as a user calls them. What `palpate view --global` shows is for a browser.
#![cfg(feature = "link")]

mod support;

use std::io::{BufRead, BufReader, Read};
use std::process::{Child, Command, Stdio};

use support::Folder;

/// `palpate serve` in a folder; killed when dropped.
struct Serving(Child, BufReader<std::process::ChildStdout>);

impl Serving {
    fn start(folder: &Folder, args: &[&str]) -> Self {
        let mut command = Command::new(env!("CARGO_BIN_EXE_palpate"));
        command.arg("serve").args(args).current_dir(folder.path(".")).stdout(Stdio::piped());
        let mut child = command.env("XDG_CACHE_HOME", env!("CARGO_TARGET_TMPDIR")).spawn().unwrap();
        let out = BufReader::new(child.stdout.take().unwrap());
        let mut serving = Self(child, out);
        assert!(serving.line().contains("listens at"));
        serving
    }

    fn line(&mut self) -> String {
        let mut line = String::new();
        self.1.read_line(&mut line).unwrap();
        line
    }
}

impl Drop for Serving {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// `palpate run` in a folder; killed when dropped.
struct Haptic(Child);

impl Haptic {
    fn start(folder: &Folder, args: &[String]) -> Self {
        let mut command = Command::new(env!("CARGO_BIN_EXE_palpate"));
        command.args(args).current_dir(folder.path(".")).stdout(Stdio::null());
        Self(command.env("XDG_CACHE_HOME", env!("CARGO_TARGET_TMPDIR")).spawn().unwrap())
    }

    fn interrupt(&self) {
        assert!(Command::new("kill").args(["-INT", &self.0.id().to_string()]).status().unwrap().success());
    }

    fn ends(mut self, code: i32) {
        assert_eq!(self.0.wait().unwrap().code(), Some(code));
    }
}

impl Drop for Haptic {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// The address of a port that nobody listens at.
fn free(protocol: &str) -> String {
    let socket = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    format!("{protocol}/{}", socket.local_addr().unwrap())
}

fn folder() -> Folder {
    let folder = Folder::new();
    folder.spoil(
        "model = \"patch\"\npatch = [3, 3, 2]\nblend = { kind = \"crossfade\", ms = 10 }",
        "model = \"predictive\"",
    );
    folder
}

#[test]
fn two_commands_run_a_scene() {
    let (folder, address) = (folder(), free("tcp"));
    let mut serving = Serving::start(&folder, &["scene.toml", "--listen", &address, "--out", "served.mcap"]);
    let report = folder.succeed(&["run", "scene.toml", "--global", &address, "--duration", "1", "--out", "felt.mcap"]);
    assert!(report.contains("log: felt.mcap"), "{report}");
    assert!(serving.line().contains("a haptic machine has come, round trip"));
    assert!(folder.succeed(&["log", "info", "felt.mcap"]).contains("/link"));
    let ended = Command::new("kill").args(["-INT", &serving.0.id().to_string()]).status().unwrap();
    let mut report = String::new();
    serving.1.read_to_string(&mut report).unwrap();
    assert!(ended.success() && report.ends_with("scene.toml: the session is over\n"), "{report}");
    assert!(
        report.contains("\nglobal") && !report.contains("\nforce"),
        "what this side did, and nothing of a device: {report}"
    );
    assert_eq!(serving.0.wait().unwrap().code(), Some(0));
    assert!(folder.succeed(&["log", "info", "served.mcap"]).contains("/global"));
}

/// The largest force on `device` by a log, as it was commanded from a time on (N).
fn felt(folder: &Folder, log: &str, device: &str, from: f64) -> f64 {
    let table = folder.succeed(&["export", log, "--topic", &format!("/{device}/force_commanded")]);
    let mut lines = table.lines();
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let column =
        |name: &str| names.iter().position(|other| *other == name).unwrap_or_else(|| panic!("{name}: {names:?}"));
    let (time, axes) = (column("t_s"), ["fx_n", "fy_n", "fz_n"].map(column));
    let rows = lines.map(|line| line.split(',').map(|number| number.parse().unwrap()).collect::<Vec<f64>>());
    let norm = |row: Vec<f64>| axes.map(|axis| row[axis].powi(2)).iter().sum::<f64>().sqrt();
    rows.filter(|row| row[time] >= from).map(norm).fold(0.0, f64::max)
}

/// Check that two haptic machines touch one body, that a third is refused by name, and that one that is killed leaves the other its force
/// and takes its place again.
#[test]
fn two_haptic_machines_touch_one_body() {
    let (folder, address) = (folder(), free("tcp"));
    // Both press and hold.
    for (hand, x) in [("left", 0.035), ("right", 0.065)] {
        let path = format!("t_s,x_m,y_m,z_m\n0,{x},0.051,0.101\n0.5,{x},0.051,0.093\n");
        folder.write(&format!("{hand}.csv"), path);
    }
    let scene = include_str!("../../scenes/two_hands.toml").replace("paths/drag", "left");
    folder.write("hands.toml", scene.replace("paths/hold_right", "right"));
    let mut serving = Serving::start(&folder, &["hands.toml", "--listen", &address]);
    let args = |device, seconds, log| {
        ["run", "hands.toml", "--global", &address, "--device", device, "--duration", seconds, "--out", log]
            .map(str::to_owned)
    };
    let start = |args: [String; 10]| Haptic::start(&folder, &args);
    let left = start(args("left", "60", "left.mcap"));
    let began = std::time::Instant::now();
    let right = start(args("right", "60", "killed.mcap"));
    let came = [serving.line(), serving.line()].concat();
    assert!(came.contains("\"left\"") && came.contains("\"right\""), "{came}");
    let third = folder.call(&args("left", "1", "third.mcap").each_ref().map(String::as_str));
    assert_eq!(third.code, Some(1), "{third:?}");
    assert!(third.err.contains("works for another haptic machine with device \"left\""), "{third:?}");
    drop(right);
    let killed = began.elapsed().as_secs_f64();
    let right = start(args("right", "2", "right.mcap"));
    assert!(serving.line().contains("has come with \"right\""));
    right.ends(0);
    left.interrupt();
    left.ends(130);
    let felt = [felt(&folder, "left.mcap", "left", killed), felt(&folder, "right.mcap", "right", 0.5)];
    assert!(felt.iter().all(|&force| force > 0.02), "{felt:?} N");
}

#[test]
fn three_commands_do_it_over_tls() {
    let (folder, address) = (folder(), free("tls"));
    let made = folder.succeed(&["link", "keys", "keys", "--host", "big-machine"]);
    assert!(made.contains("keys/global is for the machine of `palpate serve`"), "{made}");
    let _serving = Serving::start(&folder, &["scene.toml", "--listen", &address, "--config", "keys/global/link.toml"]);
    let args = ["run", "scene.toml", "--global", &address, "--config", "keys/haptic/link.toml", "--out", "felt.mcap"];
    assert!(folder.succeed(&args).contains("log: felt.mcap"));
}

#[test]
fn what_cannot_be_is_refused_in_one_line() {
    let (folder, address) = (folder(), free("tcp"));
    let keys = ["link", "keys", "keys"];
    folder.succeed(&keys);
    for (args, code, words) in [
        (&["serve", "scene.toml", "--listen", "tcp/0.0.0.0:7447"][..], 2, "--insecure"),
        (&["serve", "scene.toml", "--listen", &address, "--out", "scene.toml"], 2, "scene.toml"),
        (&["run", "scene.toml", "--global", "tcp/big-machine:7447"], 2, "--insecure"),
        (&["run", "scene.toml", "--global", "tls/big-machine:7447"], 2, "palpate link keys"),
        (&["run", "scene.toml", "--global", "big-machine"], 2, "PROTOCOL/HOST:PORT"),
        (&["view", "scene.toml", "--global", "tcp/big-machine:7447"], 2, "--insecure"),
        (&["view", "scene.toml", "--global", &address, "--model", "full"], 2, "no global model"),
        (&["run", "scene.toml", "--global", &address, "--virtual"], 1, "simulate one"),
        (&["run", "two_hands", "--global", &address, "--device", "middle"], 2, "the scene's devices are left, right"),
        (&["run", "two_hands", "--device", "left"], 2, "--global"),
        (&["run", "scene.toml", "--global", &address, "--model", "full"], 2, "no global model"),
        (&["run", "scene.toml", "--global", &address, "--config", "none.toml"], 2, "none.toml"),
        (&["run", "scene.toml", "--global", &address, "--config", "scene.toml"], 2, "unknown field"),
        (&keys, 2, "exists"),
    ] {
        let called = folder.call(args);
        assert_eq!((called.code, called.err.lines().count()), (Some(code), 1), "{args:?}: {called:?}");
        assert!(called.err.contains(words), "{args:?}: {called:?}");
    }
}
