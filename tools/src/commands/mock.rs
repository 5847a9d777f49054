//! `palpate mock haply`: a service without hardware, to try the device path.

use std::time::{Duration, Instant};

use palpate::{Error, ErrorKind};
use palpate_haply::mock::{MockFault, MockFaultKind, MockOptions, MockService};

use super::shared;

/// The arguments of `palpate mock`.
#[derive(Debug, clap::Args)]
pub struct MockArgs {
    #[command(subcommand)]
    service: Service,
}

#[derive(Debug, clap::Subcommand)]
enum Service {
    /// The Haply Inverse service 3.5 with one Inverse3 in a simulated hand
    Haply(HaplyArgs),
}

#[derive(Debug, clap::Args)]
struct HaplyArgs {
    /// Port of the simulation channel; 0 for any free one
    #[arg(long, default_value_t = 10001)]
    port: u16,
    /// Port of the events channel; 0 for any free one
    #[arg(long, value_name = "PORT", default_value_t = 10020)]
    events_port: u16,
    /// The device's id
    #[arg(long, value_name = "ID", default_value = "049D")]
    device_id: String,
    /// Fail once: silent, slow, garbage, vanish, ebrake, fod, stall, ceiling, unplug, busy, unknown, uncalibrated or
    /// unready
    #[arg(long, value_name = "NAME")]
    fault: Option<String>,
    /// The fault begins after so many commands
    #[arg(long, value_name = "COMMANDS", default_value_t = 3000, requires = "fault")]
    after: u64,
    /// End after this many seconds; without, Ctrl-C ends it
    #[arg(long, value_name = "S")]
    duration: Option<f64>,
}

/// Runs a mock service until it is told to end.
///
/// # Errors
/// If a port is taken, or there is no such fault.
pub fn run(args: &MockArgs) -> Result<(), Error> {
    let Service::Haply(args) = &args.service;
    let kind = |name: &String| {
        let names = MockFaultKind::ALL.map(MockFaultKind::name).join(", ");
        let unknown = || Error::new(ErrorKind::Usage, format!("--fault is {name:?}, must be one of {names}"));
        MockFaultKind::ALL.into_iter().find(|kind| kind.name() == name).ok_or_else(unknown)
    };
    let kind = args.fault.as_ref().map(kind).transpose()?;
    let limit = args.duration.map(Duration::try_from_secs_f64).transpose();
    let limit = limit.map_err(|error| Error::new(ErrorKind::Usage, format!("--duration: {error}")))?;
    let service = MockService::start(MockOptions {
        port: args.port,
        events_port: args.events_port,
        device_id: args.device_id.clone(),
        fault: kind.map(|kind| MockFault { kind, after: args.after }),
        ..MockOptions::default()
    })?;
    let interrupt = shared::waits()?;
    shared::print(&format!(
        "haply mock: device {}, simulation ws://{}, events ws://{}; Ctrl-C ends it\n",
        args.device_id,
        service.address(),
        service.events_address()
    ))?;
    let begun = Instant::now();
    while !interrupt.came() && limit.is_none_or(|limit| begun.elapsed() < limit) {
        std::thread::sleep(Duration::from_millis(20));
    }
    let seen = service.counts();
    shared::print(&format!(
        "connections {}, messages {}, replies {}, commands {}, probes {}, conflicts {}, malformed {}, events {}\n",
        seen.connections,
        seen.messages,
        seen.replies,
        seen.commands,
        seen.probes,
        seen.conflicts,
        seen.malformed,
        seen.events
    ))
}
