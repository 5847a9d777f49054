//! The local models of all tools of a session, from one resync.

use super::{Kind, LocalModel, Parcel, ResyncView};
use crate::Wrench;
use crate::contact::ToolMotion;

/// The local models that one resync makes: each serves one tool, or several that press the same part of the body.
///
/// They are built, sent and swapped together, so that no tool is served by a model whose neighbour is of another resync.
#[derive(Debug)]
pub struct LocalModels {
    /// The one at a tool's place is built around that tool.
    models: Vec<Box<dyn LocalModel>>,
    /// The place of the model that serves each tool.
    by: Vec<usize>,
}

impl LocalModels {
    /// Those that `empty` makes for so many tools; each serves its own.
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    ///
    /// # Panics
    /// If there are no tools.
    pub fn new(tools: usize, mut empty: impl FnMut() -> Box<dyn LocalModel>) -> Self {
        assert!(tools > 0, "local models for at least one tool");
        Self { models: (0..tools).map(|_| empty()).collect(), by: (0..tools).collect() }
    }

    /// Builds the model of the tool that `resync` is for anew; from now on it serves that tool.
    ///
    /// # Real-time
    /// As [`LocalModel::rebuild`].
    pub fn rebuild(&mut self, resync: ResyncView<'_>) {
        let tool = resync.index;
        self.models[tool].rebuild(resync);
        self.by[tool] = tool;
    }

    /// Lets the model of tool `host` serve tool number `tool` too; false, and nothing changes, if that is not resolved in it.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn share(&mut self, host: usize, tool: usize) -> bool {
        let is_resolved = self.models[host].wrench(tool).is_some();
        if is_resolved {
            self.by[tool] = host;
        }
        is_resolved
    }

    /// Sets tool number `tool` aside, whose force nobody needs here: no model is there for it, and the one of tool `host` gives it what it
    /// has, which is nothing if it does not resolve it.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn set_aside(&mut self, tool: usize, host: usize) {
        self.by[tool] = host;
    }

    /// The model that serves tool number `tool`.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn of(&self, tool: usize) -> &dyn LocalModel {
        &*self.models[self.by[tool]]
    }

    /// The tool around which the model is built that serves each tool.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn hosts(&self) -> &[usize] {
        &self.by
    }

    /// What the models that serve somebody are built from on another computer, if they are for that.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn parcels(&self) -> impl Iterator<Item = &Parcel> {
        self.serving().filter_map(LocalModel::parcel)
    }

    /// The models that serve somebody.
    fn serving(&self) -> impl Iterator<Item = &dyn LocalModel> {
        self.models.iter().enumerate().filter(|(place, _)| self.by[*place] == *place).map(|(_, model)| &**model)
    }

    /// Advances all that serve somebody by one haptic tick while each tool moves along its own of `tools`.
    ///
    /// # Real-time
    /// As [`LocalModel::tick`] of each.
    pub fn tick(&mut self, tools: &[ToolMotion]) {
        for (place, model) in self.models.iter_mut().enumerate() {
            if self.by[place] == place {
                model.tick(tools);
            }
        }
    }

    /// The force and torque on tool number `tool` in the last tick; not finite if its model has diverged.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn wrench(&self, tool: usize) -> Wrench {
        self.of(tool).wrench(tool).unwrap_or_default()
    }

    /// The kind of all of them.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn kind(&self) -> Kind {
        self.models[0].kind()
    }

    /// The haptic tick that their states were built at.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn built_at(&self) -> u64 {
        self.of(0).built_at()
    }

    /// True if their states have to be advanced to the present before they can serve.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn have_to_catch_up(&self) -> bool {
        self.serving().any(LocalModel::catches_up)
    }

    /// Ticks that they are advanced per haptic tick until they have caught up: together as many as one would be by itself, and two at least.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn catch_up_ticks(&self) -> u64 {
        let least = self.serving().map(LocalModel::catch_up_ticks).min().unwrap_or(1);
        (least / self.serving().count().max(1) as u64).max(2)
    }
}
