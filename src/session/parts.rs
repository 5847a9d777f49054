//! What a builder collects, before anything of it is checked.

use std::fmt;
use std::path::PathBuf;

use crate::devices::Device;
use crate::error::Error;
use crate::link::Transport;
use crate::model::body::Body;
use crate::model::contact::ToolShape;
use crate::runtime::{Disturbance, Execution, RateGroup, RuntimeBuilder};
use crate::scene::{HaplySpec, Scene};

/// Opens the Haply device that a scene describes, for ticks of so many seconds.
pub(super) type OpenHaply = fn(&HaplySpec, f64) -> Result<Box<dyn Device>, Error>;

/// What of a session is in this process.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Side {
    #[default]
    Both,
    /// Devices, local models and log: the global model is behind a link.
    Haptic,
    /// The global model and what reduces surroundings: the devices are behind a link.
    Global,
}

/// Everything that a session is made of.
#[derive(Debug)]
pub(super) struct Parts {
    pub(super) side: Side,
    /// The way to the other side, of the haptic one.
    pub(super) transport: Option<Box<dyn Transport>>,
    /// The devices that are at this machine, by name, if others are at another one.
    pub(super) here: Option<Vec<String>>,
    pub(super) scene: Scene,
    /// The scene is no file's: a program says by calls what is in it.
    pub(super) is_of_program: bool,
    /// The program's own body, in place of the scene's.
    pub(super) body: Option<Box<dyn Body>>,
    /// The program's own devices with their names, in place of the scene's first ones.
    pub(super) devices: Vec<(Option<String>, Box<dyn Device>)>,
    /// The nodes that the program glues tools to, by device.
    pub(super) attached: Vec<Option<u32>>,
    /// The shapes that the program gives tools, by device.
    pub(super) shapes: Vec<Option<ToolShape>>,
    pub(super) probes: Vec<u32>,
    pub(super) global: Option<RateGroup>,
    pub(super) local: Option<RateGroup>,
    pub(super) open_haply: Option<OpenHaply>,
    pub(super) endless: bool,
    /// The device gives the samples of the very run that is executed again.
    pub(super) is_replay: bool,
    pub(super) options: Options,
}

impl Parts {
    pub(super) fn new(body: Option<Box<dyn Body>>, scene: Scene) -> Self {
        Self {
            side: Side::default(),
            transport: None,
            here: None,
            is_of_program: body.is_some(),
            endless: body.is_some(),
            scene,
            body,
            devices: Vec::new(),
            attached: Vec::new(),
            shapes: Vec::new(),
            probes: Vec::new(),
            global: None,
            local: None,
            open_haply: None,
            is_replay: false,
            options: Options {
                execution: Execution::Threaded,
                in_real_time: true,
                log: None,
                keep_records: false,
                shares_records: false,
                measures_cost: false,
                disturbed: Disturbed::default(),
            },
        }
    }
}

/// How a session is executed, and what is kept of it.
#[derive(Debug)]
pub(super) struct Options {
    pub(super) execution: Execution,
    /// On threads, or executing a log of such a run: a basis takes its time there, so bases are asked for ahead of the tool.
    pub(super) in_real_time: bool,
    pub(super) log: Option<PathBuf>,
    pub(super) keep_records: bool,
    pub(super) shares_records: bool,
    pub(super) measures_cost: bool,
    pub(super) disturbed: Disturbed,
}

/// Says what goes wrong with the release of this number.
type Source = Box<dyn FnMut(u64) -> Disturbance + Send>;

/// What disturbs which rate group, kept until there is a graph to give it to.
#[derive(Default)]
pub(super) struct Disturbed(Vec<(String, Source)>);

impl Disturbed {
    pub(super) fn add(&mut self, group: String, disturbance: impl FnMut(u64) -> Disturbance + Send + 'static) {
        self.0.push((group, Box::new(disturbance)));
    }

    /// Hands everything over; the graph refuses what cannot be.
    pub(super) fn apply(self, graph: &mut RuntimeBuilder) {
        for (group, source) in self.0 {
            graph.disturb(group, source);
        }
    }
}

impl fmt::Debug for Disturbed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_list().entries(self.0.iter().map(|(group, _)| group)).finish()
    }
}
