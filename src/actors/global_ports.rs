//! What the global actor says to the others, to programs and to the log, and what it hears.

use super::basis::Wishes;
use super::messages::{Checkpoint, SurfaceView, ToolTick};
use super::settings::Settings;
use crate::model::local::{LocalModels, PatchGeometry};
use crate::model::surroundings::Bases;
use crate::runtime::{OutletWriter, ParameterReader, QueueReader, Reader, Recorder, Stopwatch, Writer};

/// The ports of a [`GlobalActor`](super::GlobalActor).
#[derive(Debug)]
pub struct GlobalPorts {
    /// Of each tool, in the order of the devices.
    pub tools: Vec<ToolPorts>,
    /// The others.
    pub shared: GlobalSharedPorts,
}

/// The ports of a [`GlobalActor`](super::GlobalActor) that are there once, for however many tools.
#[derive(Debug)]
pub struct GlobalSharedPorts {
    /// The next local models.
    pub models: Writer<LocalModels>,
    /// What is changed while it runs.
    pub settings: ParameterReader<Settings>,
    /// To and from the basis actor, if the models use what it makes.
    pub surroundings: Option<SurroundingsPorts>,
    /// The newest surface: for a program that draws, for the log.
    pub surfaces: Vec<OutletWriter<SurfaceView>>,
    /// The newest good state, for a restart.
    pub checkpoint: OutletWriter<Checkpoint>,
    /// Records.
    pub recorder: Recorder,
    /// What building the next local model costs, if that is measured.
    pub build_cost: Option<Stopwatch>,
}

/// The global half of what a [`LocalActor`](super::LocalActor) and the global one say to each other.
#[derive(Debug)]
pub struct ToolPorts {
    /// The tool at every haptic tick.
    pub ticks: QueueReader<ToolTick>,
    /// The patch's geometry at the tick of the resync, if it is fed back.
    pub geometry: Option<Reader<PatchGeometry>>,
}

/// The global half of the ports of a [`BasisActor`](super::BasisActor).
#[derive(Debug)]
pub struct SurroundingsPorts {
    /// What is wanted.
    pub wishes: Writer<Wishes>,
    /// What is there.
    pub bases: Reader<Bases>,
}
