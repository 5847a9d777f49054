//! Where the next local models are made, and which tools each of them serves.

use super::basis::Wishes;
use super::global_tool::ToolSide;
use crate::error::Error;
use crate::model::local::{Aim, Beside, Kind, LocalModels, ResyncView, ToolForecast};
use crate::model::simulation::Simulation;
use crate::model::surroundings::Bases;

/// Times at which a tool is looked for ahead: by then a basis may be ready (s).
const PREFETCH_S: [f64; 3] = [0.15, 0.3, 0.6];

/// The simulation with its tools.
type Scene<'a> = (&'a Simulation, &'a [ToolSide]);

/// The local models that are built next.
#[derive(Debug)]
pub(super) struct NextModels {
    aim: Aim,
    /// Where each tool is and is expected, and the triangle that it touches or is nearest to.
    forecasts: Vec<ToolForecast>,
    nearest: Vec<u32>,
    /// Working memory: the tools that no model serves yet, and the triangles that one is built around.
    unserved: Vec<usize>,
    around: Vec<u32>,
    /// Working memory: where a tool is going, and nodes there.
    ahead: Vec<u32>,
    nodes: Vec<u32>,
}

impl NextModels {
    /// Of tools on the body of `simulation`.
    ///
    /// # Errors
    /// If the body's surface has no triangles.
    pub(super) fn new(simulation: &Simulation) -> Result<Self, Error> {
        let aim = Aim::new(simulation.body().surface(), &simulation.state().positions)?;
        let (forecasts, nearest, unserved, around, ahead, nodes) = Default::default();
        Ok(Self { aim, forecasts, nearest, unserved, around, ahead, nodes })
    }

    /// Finds where the tools are, and where they are going in the `lead_s` seconds that a model serves.
    pub(super) fn aim(&mut self, (simulation, tools): (&Simulation, &mut [ToolSide]), lead_s: f64) {
        self.forecasts.clear();
        self.forecasts.extend(tools.iter().map(|side| side.history.forecast()));
        self.aim.refit(&simulation.state().positions);
        for (index, (side, tool)) in tools.iter_mut().zip(&self.forecasts).enumerate() {
            self.aim.triangles((simulation, index), tool, [0.0, lead_s], &mut side.triangles);
        }
        self.nearest.clear();
        self.nearest.extend(tools.iter().map(|side| side.triangles[0]));
    }

    /// Finds for each tool what the others press.
    pub(super) fn look_beside(&self, (simulation, tools): (&Simulation, &mut [ToolSide])) {
        for index in 0..tools.len() {
            let mut beside = std::mem::take(&mut tools[index].beside);
            simulation.pressed_beside(index, |other| &tools[other].triangles, &mut beside.soon);
            simulation.pressed_beside(index, |other| &self.nearest[other..=other], &mut beside.now);
            beside.triangles.clear();
            let others = self.nearest.iter().enumerate().filter(|&(other, _)| other != index);
            beside.triangles.extend(others.map(|(_, triangle)| triangle));
            tools[index].beside = beside;
        }
    }

    /// Puts in `wishes` the windows that lack a basis: the best now, those where the tools are going in the times of a `[period, lead]` and
    /// later (s), and those around.
    pub(super) fn wish(&mut self, (simulation, tools): Scene<'_>, soon: [f64; 2], bases: &Bases, wishes: &mut Wishes) {
        wishes.patches.clear();
        let mut wish = |patch: &[u32]| {
            if bases.get(patch).is_none() && !wishes.patches.iter().any(|wished| wished == patch) {
                wishes.patches.push(patch.to_vec());
            }
        };
        for (index, (side, tool)) in tools.iter().zip(&self.forecasts).enumerate() {
            let at = (simulation, index);
            let (ahead, patch) = (&mut self.ahead, &mut self.nodes);
            side.windows.choose(at, &side.triangles, &Beside::default(), |_| true, patch);
            wish(patch);
            if simulation.contact(index).glued {
                // It stays where it is.
                continue;
            }
            if tools.len() > 1 {
                side.windows.choose(at, &side.triangles, &side.beside, |_| true, patch);
                wish(patch);
            }
            for times in [soon].into_iter().chain(PREFETCH_S.map(|after| [after, 0.0])) {
                self.aim.triangles(at, tool, times, ahead);
                side.windows.choose(at, ahead, &side.beside, |_| true, patch);
                wish(patch);
            }
            side.windows.around(side.triangles[0]).for_each(&mut wish);
        }
    }

    /// Finds for each tool which others its model may serve too, and where there are `bases` its patch. A model of a `kind` without a patch
    /// may serve all.
    pub(super) fn choose(
        &mut self,
        (simulation, tools): (&Simulation, &mut [ToolSide]),
        kind: Kind,
        bases: Option<&Bases>,
    ) {
        for index in 0..tools.len() {
            if let Some(bases) = bases {
                tools[index].choose_patch((simulation, index), bases);
            }
            let mut held = std::mem::take(&mut tools[index].held);
            held.clear();
            let patch = &tools[index].patch;
            held.extend((0..tools.len()).filter(|&other| match bases {
                None => !kind.has_patch(),
                Some(_) => {
                    simulation.pressed_at(other, &tools[other].triangles, &mut self.nodes);
                    self.nodes.iter().all(|node| patch.binary_search(node).is_ok())
                }
            }));
            tools[index].held = held;
        }
    }

    /// Builds the next `models`: as few as serve all tools, those first that serve most. They are to reach `horizon` ticks ahead, with
    /// `bases`, and in the patches that have been chosen or in their own.
    pub(super) fn build(
        &mut self,
        (simulation, tools): (&mut Simulation, &[ToolSide]),
        (horizon, bases, is_chosen): (u32, &Bases, bool),
        models: &mut LocalModels,
    ) {
        let Self { forecasts, nearest, unserved, around, .. } = self;
        unserved.clear();
        unserved.extend(0..tools.len());
        unserved.sort_by_key(|&tool| std::cmp::Reverse(tools[tool].held.len()));
        while !unserved.is_empty() {
            let host = unserved.remove(0);
            let side = &tools[host];
            around.clone_from(&side.triangles);
            let others = unserved.iter().filter(|tool| side.held.contains(tool));
            around.extend(others.flat_map(|&tool| &tools[tool].triangles));
            models.rebuild(ResyncView {
                global: simulation,
                tick: side.tool.tick,
                triangles: around,
                nearest,
                patch: is_chosen.then_some(&side.patch),
                tools: forecasts,
                index: host,
                horizon,
                bases,
            });
            unserved.retain(|&tool| !(side.held.contains(&tool) && models.share(host, tool)));
        }
    }
}

#[cfg(test)]
#[path = "tests/next_models.rs"]
mod tests;
