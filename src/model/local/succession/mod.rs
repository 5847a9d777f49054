//! From one local model to the next: swap in, catch up, blend.

mod blend;
mod ways;

use super::LocalModel;
use crate::{Vec3, Wrench};

pub use blend::{Blend, BlendKind, Jump};
pub use ways::Ways;

/// The result of one tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Served {
    /// Mean force and torque on the tool, blended; may be other than finite if a model diverged.
    pub wrench: Wrench,
    /// The resync whose blend ended with this tick.
    pub resync: Option<Resynced>,
    /// How much of the force's change in this tick a swap made (N).
    pub swap_step: Vec3,
}

/// A resync whose blend is over.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Resynced {
    /// Version of the model that serves since.
    pub version: u32,
    /// How many ticks old its state was when it began to serve.
    pub age: u64,
    /// The discontinuity of the force.
    pub jump: Jump,
}

/// The local model that serves a tool, the one that it replaced and the one that is about to replace it.
///
/// Models are moved by swapping boxes: nothing is cloned, allocated or dropped while it runs.
#[derive(Debug)]
pub struct Succession {
    serving: Box<dyn LocalModel>,
    fading: Box<dyn LocalModel>,
    arriving: Box<dyn LocalModel>,
    /// Version and tick that `arriving` has reached; `None` if it is a spare.
    arrival: Option<(u32, u64)>,
    blend: Blend,
    version: u32,
    resync: Resynced,
}

impl Succession {
    /// Starts with `models` to rotate through and resyncs blended by `blend`. The first serves until another is offered.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn new(models: [Box<dyn LocalModel>; 3], blend: Blend) -> Self {
        let [serving, fading, arriving] = models;
        Self { serving, fading, arriving, arrival: None, blend, version: 0, resync: Resynced::default() }
    }

    /// Lets `model` serve at once: for tick 0. `model` gets a spare in exchange.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn begin(&mut self, model: &mut Box<dyn LocalModel>, version: u32) {
        std::mem::swap(&mut self.serving, model);
        self.version = version;
    }

    /// Takes a newer model in exchange for a spare. A model that is still catching up is given up for it, and one that is older than
    /// what `ways` remember is refused: it could not be brought to the present.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn offer(&mut self, model: &mut Box<dyn LocalModel>, version: u32, ways: &Ways) {
        let reached = model.built_at();
        if ways.reaches_back_to(reached) {
            std::mem::swap(&mut self.arriving, model);
            self.arrival = Some((version, reached));
        }
    }

    /// True if a model has arrived that has more than one tick to make up before it can serve in the last tick of `ways`.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn is_behind(&self, ways: &Ways) -> bool {
        self.arriving.catches_up() && self.arrival.is_some_and(|(_, reached)| reached + 2 < ways.now())
    }

    /// Advances one tick: the last of `ways`. A model that [is behind](Self::is_behind) comes nearer if it `may_catch_up`: of several tools the
    /// models catch up one after the other, so that a tick takes no longer than for one.
    ///
    /// # Real-time
    /// Bounded, real-time safe.
    pub fn tick(&mut self, ways: &Ways, may_catch_up: bool) -> Served {
        if may_catch_up || !self.is_behind(ways) {
            self.catch_up(ways);
        }
        let motions = ways.of(ways.now());
        let new = self.serving.tick(motions);
        if !self.blend.is_under_way() {
            return Served { wrench: new, ..Served::default() };
        }
        let old = if self.blend.needs_old() { self.fading.tick(motions) } else { new };
        // A diverged old model must not spoil a good new one.
        let old = if old.is_finite() { old } else { new };
        let (wrench, jump) = self.blend.mix(new, old);
        Served { wrench, resync: jump.map(|jump| Resynced { jump, ..self.resync }), swap_step: self.blend.step_now() }
    }

    /// Brings an arrived model nearer to the start of the last tick; when it is there and no blend is under way, it serves.
    fn catch_up(&mut self, ways: &Ways) {
        let Some((version, mut reached)) = self.arrival else { return };
        let begun = ways.now() - 1;
        if self.arriving.catches_up() {
            let until = begun.min(reached + self.arriving.catch_up_ticks());
            while reached < until {
                reached += 1;
                self.arriving.tick(ways.of(reached));
            }
            self.arrival = Some((version, reached));
            if reached < begun {
                return;
            }
        }
        if self.blend.is_under_way() {
            return;
        }
        self.arrival = None;
        std::mem::swap(&mut self.fading, &mut self.serving);
        std::mem::swap(&mut self.serving, &mut self.arriving);
        self.version = version;
        self.resync = Resynced { version, age: begun.saturating_sub(self.serving.built_at()), ..Resynced::default() };
        self.blend.begin();
    }

    /// The model that serves now.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn serving(&self) -> &dyn LocalModel {
        &*self.serving
    }

    /// The version of the model that serves.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn version(&self) -> u32 {
        self.version
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Kind, ResyncView};
    use super::*;
    use crate::contact::{Contact, ToolMotion};

    /// Adds up the motion that it was given; its force is its base plus that.
    #[derive(Debug)]
    struct Counting {
        base: f64,
        built_at: u64,
        catches_up: bool,
        travelled: Vec3,
        ticks: u64,
    }

    impl LocalModel for Counting {
        fn rebuild(&mut self, _: ResyncView<'_>) {}
        fn tick(&mut self, tools: &[ToolMotion]) -> Wrench {
            self.travelled += tools[0].way();
            self.ticks += 1;
            Vec3::new(self.base, self.travelled.y, self.ticks as f64).into()
        }
        fn built_at(&self) -> u64 {
            self.built_at
        }
        fn kind(&self) -> Kind {
            Kind::Patch
        }
        fn serves_as(&self) -> Kind {
            Kind::Patch
        }
        fn catches_up(&self) -> bool {
            self.catches_up
        }
        fn contact(&self) -> Contact {
            Contact::default()
        }
    }

    fn model(base: f64, built_at: u64, catches_up: bool) -> Box<dyn LocalModel> {
        Box::new(Counting { base, built_at, catches_up, travelled: Vec3::zeros(), ticks: 0 })
    }

    /// A succession with the ways of its one tool.
    struct Followed {
        models: Succession,
        ways: Ways,
    }

    impl Followed {
        fn new(blend_ticks: u32) -> Self {
            let blend = Blend::new(BlendKind::Crossfade, blend_ticks);
            let mut models = Succession::new([-1.0; 3].map(|base| model(base, 0, true)), blend);
            models.begin(&mut model(1.0, 0, true), 0);
            Self { models, ways: Ways::new(1) }
        }

        fn tick(&mut self, t: u64) -> Served {
            self.tick_if(t, true)
        }

        fn tick_if(&mut self, t: u64, may_catch_up: bool) -> Served {
            self.ways.go(std::iter::once(ToolMotion::straight(tool(t - 1), tool(t))));
            assert_eq!(self.ways.now(), t);
            self.models.tick(&self.ways, may_catch_up)
        }

        fn offer(&mut self, mut model: Box<dyn LocalModel>, version: u32) {
            self.models.offer(&mut model, version, &self.ways);
        }
    }

    /// The tool at the end of tick t: it never moves evenly.
    fn tool(t: u64) -> Vec3 {
        Vec3::y() * (t * t) as f64
    }

    #[test]
    fn a_model_that_is_in_time_serves_from_the_next_tick() {
        let mut models = Followed::new(0);
        (1..=33).for_each(|t| assert_eq!(models.tick(t).wrench.force.x, 1.0));
        models.offer(model(2.0, 33, true), 7);
        let served = models.tick(34);
        assert_eq!((served.wrench.force.x, models.models.version()), (2.0, 7));
        assert_eq!(served.wrench.force.y, tool(34).y - tool(33).y, "its motion is that of the tick alone");
        assert_eq!(served.resync.map(|resync| (resync.version, resync.age)), Some((7, 0)));
    }

    #[test]
    fn a_late_model_replays_the_tools_own_path_while_the_old_one_serves() {
        let mut models = Followed::new(0);
        (1..=60).for_each(|t| {
            models.tick(t);
        });
        models.offer(model(2.0, 33, true), 1);
        let served: Vec<Vec3> = (61..=70).map(|t| models.tick(t).wrench.force).collect();
        // 27 ticks late, 8 caught up per tick while one more falls due: the old model serves ticks 61 to 63.
        let swap = served.iter().position(|force| force.x == 2.0).unwrap();
        assert_eq!(swap, 3);
        assert!(served[..swap].iter().all(|force| force.x == 1.0));
        assert_eq!(served[swap].y, tool(64).y - tool(33).y, "nothing of the path is missing");
        assert_eq!(served[swap].z, 31.0, "each tick once");
    }

    #[test]
    fn a_model_that_is_behind_waits_until_it_may_catch_up_and_one_that_is_not_serves() {
        let mut models = Followed::new(0);
        (1..=60).for_each(|t| {
            models.tick(t);
        });
        models.offer(model(2.0, 33, true), 1);
        // Another tool's model catches up meanwhile.
        assert!(
            (61..=70).all(|t| models.tick_if(t, false).wrench.force.x == 1.0 && models.models.is_behind(&models.ways))
        );
        let served: Vec<Vec3> = (71..=80).map(|t| models.tick(t).wrench.force).collect();
        let swap = served.iter().position(|force| force.x == 2.0).unwrap();
        // 37 ticks late.
        assert_eq!((swap, served[swap].y), (5, tool(76).y - tool(33).y));
        assert!(!models.models.is_behind(&models.ways));
        models.offer(model(3.0, 80, true), 2);
        assert_eq!(models.tick_if(81, false).wrench.force.x, 3.0);
    }

    #[test]
    fn a_model_without_a_state_of_its_own_serves_at_once() {
        let mut models = Followed::new(0);
        (1..=60).for_each(|t| {
            models.tick(t);
        });
        models.offer(model(2.0, 33, false), 1);
        assert_eq!(models.tick(61).wrench.force.x, 2.0);
    }

    #[test]
    fn a_newer_model_waits_for_the_end_of_a_blend_and_an_ancient_one_is_refused() {
        let mut models = Followed::new(10);
        (1..=33).for_each(|t| {
            models.tick(t);
        });
        models.offer(model(2.0, 33, true), 1);
        assert_eq!(models.tick(34).wrench.force.x, 1.0, "a crossfade begins with the old force");
        models.offer(model(3.0, 34, true), 2);
        let forces: Vec<f64> = (35..=60).map(|t| models.tick(t).wrench.force.x).collect();
        assert!(forces.windows(2).all(|f| f[1] >= f[0] && f[1] - f[0] < 0.11), "{forces:?}");
        assert_eq!(*forces.last().unwrap(), 3.0);

        let mut models = Followed::new(0);
        (1..=2000).for_each(|t| {
            models.tick(t);
        });
        models.offer(model(2.0, 33, true), 1);
        assert_eq!(models.tick(2001).wrench.force.x, 1.0);
    }

    #[test]
    fn a_diverged_old_model_does_not_spoil_the_blend() {
        let mut models = Followed::new(10);
        models.offer(model(f64::NAN, 0, true), 1);
        (1..=33).for_each(|t| {
            models.tick(t);
        });
        models.offer(model(2.0, 33, true), 2);
        assert!((34..=44).all(|t| models.tick(t).wrench.force.x == 2.0));
    }
}
