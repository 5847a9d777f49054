//! Small bodies, paths and records for tests of whole sessions.
#![allow(dead_code)]

#[path = "../../examples/common/altered_block.rs"]
mod altered_block;
pub mod line;

#[allow(unused_imports)]
pub use altered_block::AlteredBlock;
use palpate::devices::ToolPath;
use palpate::log::{CommandSample, ForceSample, GlobalTick, LogRecord, Resync};
use palpate::model::Vec3;
use palpate::model::body::{Block, Body};
use palpate::model::mesh::Face;
use palpate::runtime::TickTiming;
use palpate::session::Summary;

/// A block of 6^3 nodes, 2 cm apart, held at the bottom.
pub fn block() -> Block {
    block_of([6; 3])
}

/// One whose surroundings are too large to be a part of the windows that [`pressing`] needs.
pub fn wide_block() -> Block {
    block_of([10, 10, 6])
}

fn block_of(nodes: [usize; 3]) -> Block {
    Block::builder(nodes, nodes.map(|count| 0.02 * (count - 1) as f64))
        .node_mass(0.5e-3)
        .stiffness(30.0)
        .damping_ratio(0.3)
        .fix(Face::ZMin)
        .build()
        .unwrap()
}

/// A slender one, with room for many windows.
pub fn sheet() -> Block {
    Block::builder([14, 14, 3], [0.13, 0.13, 0.02])
        .node_mass(0.8e-3)
        .stiffness(200.0)
        .damping_ratio(0.4)
        .fix(Face::XMin)
        .fix(Face::XMax)
        .build()
        .unwrap()
}

/// A node in the middle of the top.
pub fn top() -> u32 {
    block().lattice().id([3, 3, 5])
}

/// Presses into the top within 50 ms, then moves along it, for as long as anybody asks.
pub fn pressing() -> ToolPath {
    let position = |t: f64| {
        let pressed = (t / 0.05).min(1.0);
        [0.05 + 0.01 * (9.0 * t).sin(), 0.052, 0.101 - 0.009 * pressed - 0.002 * (23.0 * t).sin()]
    };
    sampled(position)
}

/// Likewise from the other end of the top, towards the first and back.
pub fn meeting() -> ToolPath {
    sampled(|t| {
        let pressed = (t / 0.05).min(1.0);
        [0.075 - 0.012 * (5.0 * t).sin().abs(), 0.05, 0.101 - 0.008 * pressed - 0.002 * (17.0 * t).sin()]
    })
}

/// Moves the node [`top`] about like a hand.
pub fn wiggling() -> ToolPath {
    let rest = block().rest()[top() as usize];
    sampled(|t| {
        (rest + Vec3::new(0.004 * (19.0 * t).sin(), 0.003 * (13.0 * t).sin(), -0.008 * (12.6 * t).sin())).into()
    })
}

pub fn sampled(position: impl Fn(f64) -> [f64; 3]) -> ToolPath {
    let times: Vec<f64> = (0..4000).map(|n| f64::from(n) * 1e-3).collect();
    let positions = times.iter().map(|&t| position(t)).collect();
    ToolPath::new(times, positions).unwrap()
}

fn of<T>(summary: &Summary, pick: impl Fn(&LogRecord) -> Option<T>) -> Vec<T> {
    summary.records.iter().filter_map(pick).collect()
}

macro_rules! pick {
    ($name:ident, $variant:ident, $record:ty) => {
        pub fn $name(summary: &Summary) -> Vec<$record> {
            of(summary, |record| match record {
                LogRecord::$variant(record) => Some(*record),
                _ => None,
            })
        }
    };
}
pick!(forces, Force, ForceSample);
pick!(commands, Command, CommandSample);
pick!(global_ticks, Global, GlobalTick);
pick!(resyncs, Resync, Resync);
pick!(timings, Tick, TickTiming);

/// How far two runs are apart.
pub struct Apart {
    /// Root mean square of the difference of their forces, as a share of the peak.
    pub rms: f64,
    /// The largest force of the second (N).
    pub peak: f64,
}

/// How far a run is apart from another one, which began so many ticks of 1 ms earlier, in the force on one of the devices. Periods that were
/// skipped are left out.
pub fn apart(runs: [&Summary; 2], device: u16, earlier: usize) -> Apart {
    let [there, here] =
        runs.map(|run| forces(run).into_iter().filter(|force| force.device == device).collect::<Vec<_>>());
    let tick = |force: &ForceSample| (1e3 * force.time.as_secs_f64()).round() as usize;
    let mut apart = Vec::new();
    let mut later = here.iter().peekable();
    for force in &there {
        while later.next_if(|other| tick(other) < tick(force) + earlier).is_some() {}
        if let Some(other) = later.next_if(|other| tick(other) == tick(force) + earlier) {
            apart.push((Vec3::from(force.force_n) - Vec3::from(other.force_n)).norm_squared());
        }
    }
    let peak = here.iter().map(|force| norm(force.force_n)).fold(0.0, f64::max);
    assert!(2 * apart.len() > here.len(), "{} of {} ticks", apart.len(), here.len());
    Apart { rms: (apart.iter().sum::<f64>() / apart.len() as f64).sqrt() / peak, peak }
}

/// The largest force that one of the devices was commanded in a span of time (s; N).
pub fn largest_command(commands: &[CommandSample], device: u16, [from, until]: [f64; 2]) -> f64 {
    let within =
        |command: &&CommandSample| command.device == device && (from..until).contains(&command.time.as_secs_f64());
    commands.iter().filter(within).map(|command| norm(command.force_n)).fold(0.0, f64::max)
}

/// The forces on the tool, tick by tick (N).
pub fn force_vectors(summary: &Summary) -> Vec<Vec3> {
    forces(summary).iter().map(|sample| sample.force_n.into()).collect()
}

/// The forces as bits, so that -0.0 differs from 0.0 and NaN equals itself.
pub fn bits(force: [f64; 3]) -> [u64; 3] {
    force.map(f64::to_bits)
}

pub fn norm(force: [f64; 3]) -> f64 {
    Vec3::from(force).norm()
}
