//! The actor of `full`: the whole body at the haptic rate, with all tools, in place of local models and a global one.

use super::cause::Cause;
use super::messages::{SurfaceView, show};
use super::settings::Settings;
use super::ticks::{self, ResyncTicks};
use super::tool::{LocalTool, Serving};
use crate::model::contact::ToolMotion;
use crate::model::local::{Kind, Served};
use crate::model::simulation::Simulation;
use crate::model::{Vec3, Wrench};
use crate::runtime::{Actor, GroupMode, Outcome, OutletWriter, ParameterReader, Rate, TickContext};

/// Runs the detailed simulation at the haptic rate: one evaluation of its forces for all tools.
///
/// # Real-time
/// Bounded, by eight haptic ticks a release, and real-time safe if the body's forces are.
#[derive(Debug)]
pub struct WholeActor {
    simulation: Simulation,
    tools: Vec<LocalTool>,
    /// What is changed while it runs.
    settings: ParameterReader<Settings>,
    /// The surface at the tick of each resync that there would be: for a program that draws, for the log.
    surfaces: Vec<OutletWriter<SurfaceView>>,
    haptic: Rate,
    resyncs: ResyncTicks,
    /// The last tick.
    now: u64,
    /// Working memory: the way of each tool in a tick.
    ways: Vec<ToolMotion>,
    begun: bool,
}

impl WholeActor {
    /// An actor over `simulation` with its `tools`, which shows the surface at the rate `global`.
    ///
    /// # Panics
    /// If the simulation has another number of tools.
    pub fn new(
        simulation: Simulation,
        tools: Vec<LocalTool>,
        [haptic, global]: [Rate; 2],
        surfaces: Vec<OutletWriter<SurfaceView>>,
        settings: ParameterReader<Settings>,
    ) -> Self {
        assert_eq!(tools.len(), simulation.tools(), "a place for each tool");
        let (resyncs, ways) = (ResyncTicks::new(haptic, global), Vec::with_capacity(tools.len()));
        Self { simulation, tools, settings, surfaces, haptic, resyncs, now: 0, ways, begun: false }
    }

    /// Release 0: the first samples, no force.
    fn begin(&mut self, ctx: &TickContext) {
        self.begun = true;
        for tool in &mut self.tools {
            tool.begin();
        }
        self.show(ctx);
    }

    /// Advances the body by one tick, the first of those that are `left`.
    fn advance(&mut self, ctx: &TickContext, left: u64) {
        self.now += 1;
        self.ways.clear();
        self.ways.extend(self.tools.iter_mut().map(|tool| tool.go(left, ctx.dt_nominal)));
        self.simulation.tick_all(&self.ways);
        let is_finite = self.simulation.state().is_finite();
        for (index, (tool, way)) in self.tools.iter_mut().zip(&self.ways).enumerate() {
            // A state that is not finite touches nothing: its zero force would look like a free tool.
            let none: Wrench = Vec3::repeat(f64::NAN).into();
            let wrench = if is_finite { self.simulation.wrench(index) } else { none };
            tool.feel(Served { wrench, ..Served::default() }, way, self.simulation.contact(index));
        }
        self.show(ctx);
    }

    fn show(&mut self, ctx: &TickContext) {
        if self.resyncs.has(self.now) {
            show(&mut self.surfaces, ctx, self.haptic.release(self.now), &self.simulation);
        }
    }

    /// Commands and records the force on each tool; false if one of them is not finite.
    fn finish(&mut self, ctx: &TickContext) -> bool {
        let simulation = &self.simulation;
        let finish = |is_good: bool, (index, tool): (usize, &mut LocalTool)| {
            let serving = Serving {
                tick: self.now,
                kind: Kind::Full,
                version: 0,
                // What is still owed after a stall: the force is that of a tool which is not yet where its device is.
                age_ticks: ctx.tick.saturating_sub(self.now),
                contact: *simulation.contact(index),
                points: simulation.contact_points(index),
                area_m2: simulation.contact_area(index),
            };
            let is_finite = tool.finish(ctx, &serving, |_, node| [simulation.state().positions[node as usize]; 2]);
            is_good && is_finite
        };
        self.tools.iter_mut().enumerate().fold(true, finish)
    }
}

impl Actor for WholeActor {
    fn name(&self) -> &str {
        "local"
    }

    fn tick(&mut self, ctx: &TickContext) -> Outcome {
        if ctx.mode == GroupMode::Stopping {
            // The devices bring themselves to rest.
            return Outcome::Continue;
        }
        self.tools.iter_mut().for_each(|tool| tool.refresh(ctx));
        if !self.begun {
            self.begin(ctx);
            return Outcome::Continue;
        }
        if self.settings.refresh(ctx) {
            self.settings.get().put_to(&mut self.simulation);
        }
        ticks::due(ctx, self.now).for_each(|left| self.advance(ctx, left));
        match self.finish(ctx) {
            true => Outcome::Continue,
            // Without a global model nothing would bring a good state.
            false => Outcome::Fault(Cause::LocalNotFinite.code()),
        }
    }
}

#[cfg(test)]
#[path = "tests/whole.rs"]
mod tests;
