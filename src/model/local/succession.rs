//! From one local model to the next: swap in, catch up, blend.

use super::super::Vec3;
use super::super::blend::{Crossfade, Jump};
use super::super::contact::ToolMotion;
use super::LocalModel;

/// Ticks that a late model is advanced per haptic tick until it has caught up; the old model serves meanwhile.
const CATCH_UP_TICKS: u64 = 8;
/// Tool positions that are remembered for catching up; an older model is not used.
const HISTORY: usize = 1024;

/// What one tick gave.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Served {
    /// Mean force on the tool, blended (N); may be other than finite if a model diverged.
    pub force: Vec3,
    /// The resync whose blend ended with this tick.
    pub resync: Option<Resynced>,
}

/// A resync that is over.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Resynced {
    /// Version of the model that serves since.
    pub version: u32,
    /// How many ticks old its state was when it began to serve.
    pub age: u64,
    /// The discontinuity.
    pub jump: Jump,
}

/// The local model that serves, the one that it replaced and the one that is about to replace it.
///
/// Models are moved by swapping boxes: nothing is cloned, allocated or dropped while it runs.
#[derive(Debug)]
pub struct Succession {
    serving: Box<dyn LocalModel>,
    fading: Box<dyn LocalModel>,
    arriving: Box<dyn LocalModel>,
    /// Version and tick that `arriving` has reached; `None` if it is a spare.
    arrival: Option<(u32, u64)>,
    blend: Crossfade,
    version: u32,
    resync: Resynced,
    /// Tool position at the end of tick t at place t % HISTORY (m).
    history: Vec<Vec3>,
    /// The last tick.
    now: u64,
}

impl Succession {
    /// Starts with `models` to rotate through and a blend over `blend_ticks`; the tool is at `tool` (m) at tick 0.
    /// The first serves until another is offered.
    pub fn new(models: [Box<dyn LocalModel>; 3], blend_ticks: u32, tool: Vec3) -> Self {
        let [serving, fading, arriving] = models;
        Self {
            serving,
            fading,
            arriving,
            arrival: None,
            blend: Crossfade::new(blend_ticks),
            version: 0,
            resync: Resynced::default(),
            history: vec![tool; HISTORY],
            now: 0,
        }
    }

    /// Puts the tool at `tool` (m) and lets `model` serve at once: for tick 0. `model` gets a spare in exchange.
    pub fn begin(&mut self, tool: Vec3, first: Option<(&mut Box<dyn LocalModel>, u32)>) {
        self.history.fill(tool);
        if let Some((model, version)) = first {
            std::mem::swap(&mut self.serving, model);
            self.version = version;
        }
    }

    /// Takes a newer model in exchange for a spare. A model that is still catching up is given up for it.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn offer(&mut self, model: &mut Box<dyn LocalModel>, version: u32) {
        let reached = model.built_at();
        // Older than the memory of the tool's path: it could not be brought to the present.
        if self.now.saturating_sub(reached) >= HISTORY as u64 {
            return;
        }
        std::mem::swap(&mut self.arriving, model);
        self.arrival = Some((version, reached));
    }

    /// Advances one tick: the tool moves in a straight line to `tool` (m).
    ///
    /// # Real-time
    /// Bounded, real-time safe.
    pub fn tick(&mut self, tool: Vec3) -> Served {
        self.catch_up();
        let motion = ToolMotion { from: self.position(self.now), to: tool };
        self.now += 1;
        let place = self.now as usize % HISTORY;
        self.history[place] = tool;
        let new = self.serving.tick(motion);
        if !self.blend.needs_old() {
            return Served { force: new, resync: None };
        }
        let old = self.fading.tick(motion);
        // A diverged old model must not spoil a good new one.
        let old = if old.iter().all(|c| c.is_finite()) { old } else { new };
        let (force, jump) = self.blend.mix(new, old);
        Served { force, resync: jump.map(|jump| Resynced { jump, ..self.resync }) }
    }

    /// Brings an arrived model nearer to the present; when it is there and no blend is under way, it serves.
    fn catch_up(&mut self) {
        let Some((version, mut reached)) = self.arrival else { return };
        if self.arriving.catches_up() {
            let until = self.now.min(reached + CATCH_UP_TICKS);
            while reached < until {
                self.arriving.tick(ToolMotion { from: self.position(reached), to: self.position(reached + 1) });
                reached += 1;
            }
            self.arrival = Some((version, reached));
            if reached < self.now {
                return;
            }
        }
        if self.blend.needs_old() {
            return;
        }
        self.arrival = None;
        std::mem::swap(&mut self.fading, &mut self.serving);
        std::mem::swap(&mut self.serving, &mut self.arriving);
        self.version = version;
        self.resync =
            Resynced { version, age: self.now.saturating_sub(self.serving.built_at()), ..Resynced::default() };
        self.blend.begin();
    }

    fn position(&self, tick: u64) -> Vec3 {
        self.history[tick as usize % HISTORY]
    }

    /// The model that serves.
    pub fn serving(&self) -> &dyn LocalModel {
        &*self.serving
    }

    /// Its version.
    pub fn version(&self) -> u32 {
        self.version
    }

    /// The last tick.
    pub fn now(&self) -> u64 {
        self.now
    }

    /// Where the tool is (m).
    pub fn tool(&self) -> Vec3 {
        self.position(self.now)
    }
}
