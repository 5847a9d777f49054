//! `palpate view [SCENE|LOG]`: a page in the browser.

use std::fs::File;
use std::io::{IsTerminal, Read};
use std::net::IpAddr;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

use palpate::scene::{ModelChoice, Scene};
use palpate::{Error, ErrorKind};
use palpate_view::{Options, Pushed, Server};

use super::link::GlobalArgs;
use super::{files, progress, shared};

/// How often it is looked whether the user interrupted.
const LOOK: Duration = Duration::from_millis(100);

/// The arguments of `palpate view`.
#[derive(Debug, clap::Args)]
pub struct ViewArgs {
    /// A scene file (TOML) or the name of a built-in scene (`palpate list`), or a log with pictures (MCAP); the demo scene if left out
    #[arg(value_name = "SCENE|LOG")]
    pub scene: Option<PathBuf>,
    /// Listen on this port; a free one if left out
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub port: u16,
    /// Use this local model instead of the scene's own
    #[arg(long, value_name = "NAME", value_parser = shared::choice)]
    pub model: Option<ModelChoice>,
    /// Also write a log of all of it, with pictures; overwritten if it exists
    #[arg(long, value_name = "LOG.mcap")]
    pub out: Option<PathBuf>,
    /// Leave the scene its own device: watch what it does in place of pushing
    #[arg(long)]
    pub watch: bool,
    #[command(flatten)]
    pub global: GlobalArgs,
    /// Let other machines in by this address of this one, such as 0.0.0.0; unencrypted
    #[arg(long, value_name = "ADDRESS")]
    pub listen: Option<IpAddr>,
    /// Only print the address, open no browser
    #[arg(long)]
    pub no_browser: bool,
}

/// Shows a scene or a log until it is interrupted.
///
/// # Errors
/// Input errors of the scene, a port that is taken, or a failed run.
pub fn run(args: &ViewArgs) -> Result<(), Error> {
    if let Some(log) = args.scene.as_deref().filter(|path| is_log(path)) {
        return show_log(log, args);
    }
    args.global.check()?;
    let (mut scene, name) = match &args.scene {
        Some(path) => (progress::load(path)?, shared::name_of(path)),
        None => (Scene::demo(), "demo scene".to_owned()),
    };
    if let (Some(path), Some(out)) = (&args.scene, &args.out) {
        files::keep_inputs(&files::inputs_of(path, &scene), out)?;
    }
    // The demo names `predictive`; whoever pushes it is to feel the body itself, where that fits.
    let of_demo = (args.scene.is_none() && args.global.address.is_none()).then_some(ModelChoice::Auto);
    if let Some(model) = args.model.or(of_demo) {
        scene = scene.with_model(model);
    }
    let pushed = match args.global.device.first() {
        _ if args.watch => Pushed::as_it_is(scene),
        // The first that is at this machine.
        Some(device) => Pushed::by_device(scene, device),
        None => Pushed::new(scene),
    };
    let pushed = pushed.open_haply_with(palpate_haply::open);
    let pushed = args.out.iter().fold(pushed, |pushed, out| pushed.log(out));
    let pushed = match args.global.address {
        Some(_) => {
            let global = args.global.clone();
            pushed.connect(move |builder| global.of(builder))
        }
        None => pushed,
    };
    let preparing = progress::preparing(&name);
    let server = palpate_view::serve_scene(pushed, &options(args, &name)).map_err(|error| error.at(&name));
    preparing.finish_and_clear();
    show(server?, args, &name)
}

/// True if `path` is a log by its first bytes; what cannot be read is an error of the scene.
fn is_log(path: &Path) -> bool {
    let mut magic = [0; 5];
    let file = File::open(path).ok().filter(|_| path.is_file());
    file.is_some_and(|mut file| file.read_exact(&mut magic).is_ok()) && &magic == b"\x89MCAP"
}

fn show_log(log: &Path, args: &ViewArgs) -> Result<(), Error> {
    for (is_given, option) in [
        (args.model.is_some(), "--model"),
        (args.out.is_some(), "--out"),
        (args.watch, "--watch"),
        (args.global.address.is_some(), "--global"),
        (args.global.access.config.is_some(), "--config"),
        (args.global.access.insecure, "--insecure"),
    ] {
        if is_given {
            let message = format!("{option} is for scenes, and {} is a log: leave it out", shared::name_of(log));
            return Err(Error::new(ErrorKind::Usage, message));
        }
    }
    let name = shared::name_of(log);
    let preparing = progress::preparing(&name);
    let server = palpate_view::serve_log(log, &options(args, &name));
    preparing.finish_and_clear();
    show(server?, args, &name)
}

fn options(args: &ViewArgs, title: &str) -> Options {
    let usual = Options::default();
    Options { listen: args.listen.unwrap_or(usual.listen), port: args.port, title: title.to_owned() }
}

/// Tells where the page is, and waits until the user has seen enough.
fn show(server: Server, args: &ViewArgs, name: &str) -> Result<(), Error> {
    if args.listen.is_some_and(|address| !address.is_loopback()) {
        shared::complain(
            "warning: --listen lets other machines in, unencrypted: whoever has the whole address can push, and whoever reads \
             the network can have the address",
        );
    }
    let url = server.url();
    // Before anybody is told that Ctrl-C ends it.
    let interrupt = shared::waits()?;
    shared::print(&format!("{name}: {url}\nCtrl-C ends it\n"))?;
    if !args.no_browser {
        open(&url);
    }
    while !interrupt.came() && !server.wait_for(LOOK) {}
    let Some(summary) = server.stop() else { return Ok(()) };
    shared::print(&summary.to_string())?;
    if let Some(fault) = summary.runtime.fault {
        return Err(Error::new(ErrorKind::Fault, fault.to_string()).at(name));
    }
    match summary.log_error {
        Some(error) => Err(Error::new(ErrorKind::Fault, format!("the log is incomplete: {error}"))),
        None => Ok(()),
    }
}

/// Opens a browser where somebody sits in front of one. None is no error: the address is printed.
fn open(url: &str) {
    let has_display = ["DISPLAY", "WAYLAND_DISPLAY"].iter().any(|name| std::env::var_os(name).is_some());
    let program = match std::env::consts::OS {
        "macos" => "open",
        "windows" => "explorer",
        _ if has_display => "xdg-open",
        _ => return,
    };
    if !std::io::stdout().is_terminal() {
        return;
    }
    // The address, with its token, can be read in the list of processes by this user's own programs, as the terminal can.
    let quiet = Command::new(program).arg(url).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).spawn();
    drop(quiet);
}
