//! One tool on the side of the global actor.

use std::collections::VecDeque;

use super::global_ports::ToolPorts;
use super::messages::ToolTick;
use crate::model::Pose;
use crate::model::local::{Beside, ToolHistory, Windows};
use crate::model::simulation::Simulation;
use crate::model::surroundings::Bases;
use crate::runtime::TickContext;

/// What the global model knows of one tool.
#[derive(Debug)]
pub(super) struct ToolSide {
    pub(super) ports: ToolPorts,
    /// Samples that have come and are not taken yet.
    pub(super) waiting: VecDeque<ToolTick>,
    /// The tool at the last tick taken: the state's own time.
    pub(super) tool: ToolTick,
    /// Where it comes from.
    pub(super) from: Pose,
    /// Its sample of the last tick was missing.
    pub(super) is_between: bool,
    pub(super) history: ToolHistory,
    /// Where local models may be made, if there are bases.
    pub(super) windows: Windows,
    /// Triangles that the window of its next model has to hold.
    pub(super) triangles: Vec<u32>,
    /// What the others press.
    pub(super) beside: Beside,
    /// The tools whose whole way lies where its next model is made: that may serve them too.
    pub(super) held: Vec<usize>,
    /// The patch of its next model.
    pub(super) patch: Vec<u32>,
}

impl ToolSide {
    /// Of a tool that has rested where it is at `tool`.
    pub(super) fn new(tool: ToolTick, windows: Windows, history: ToolHistory, ports: ToolPorts) -> Self {
        let (waiting, is_between) = Default::default();
        let (triangles, beside, held, patch) = Default::default();
        let from = tool.pose;
        Self { ports, waiting, tool, from, is_between, history, windows, triangles, beside, held, patch }
    }

    /// The tool rests where it is now, wherever it came from.
    pub(super) fn put(&mut self) {
        self.from = self.tool.pose;
        self.history.restart(self.tool.pose);
    }

    /// Takes the patch's geometry in place of the global model's own, if it belongs to the same tick.
    pub(super) fn take_feedback(&mut self, ctx: &TickContext, simulation: &mut Simulation, index: usize) {
        if let Some(reader) = &mut self.ports.geometry {
            reader.refresh(ctx);
            let geometry = reader.get();
            if geometry.tick == self.tool.tick && geometry.is_usable() {
                geometry.write_to(simulation, index);
            }
        }
    }

    /// The patch that the next model is made for, if there are bases: the best window that has one, or the best of all; the widest
    /// while nobody knows where the tool is going.
    pub(super) fn choose_patch(&mut self, at: (&Simulation, usize), bases: &Bases) {
        let has_basis = |patch: &[u32]| bases.get(patch).is_some();
        if !self.windows.choose(at, &self.triangles, &self.beside, has_basis, &mut self.patch) {
            self.windows.choose(at, &self.triangles, &Beside::default(), |_| true, &mut self.patch);
        }
        if self.history.is_new()
            && let Some(widest) = self.windows.widest(self.triangles[0], &self.patch).filter(|patch| has_basis(patch))
        {
            widest.clone_into(&mut self.patch);
        }
    }
}
