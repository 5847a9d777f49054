//! From one local model to the next: swap in, catch up, blend.

mod blend;
mod ways;

use super::LocalModels;
use super::kind::Kind;
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

/// The local models that serve the tools of a session, those that they replaced and those that are about to replace them.
///
/// Models are moved by swapping: nothing is cloned, allocated or dropped while it runs.
#[derive(Debug)]
pub struct Succession {
    serving: LocalModels,
    fading: LocalModels,
    arriving: LocalModels,
    /// Version and tick that `arriving` has reached; `None` if it is a spare.
    arrival: Option<(u32, u64)>,
    /// Of each tool; all begin and end in the same ticks.
    blends: Vec<Blend>,
    /// Likewise, what the last tick gave.
    served: Vec<Served>,
    version: u32,
    resync: Resynced,
}

impl Succession {
    /// Starts with `models` to rotate through, all for the same tools, and resyncs blended by `blend`. The first serve until others are
    /// offered.
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    pub fn new(models: [LocalModels; 3], blend: Blend) -> Self {
        let [serving, fading, arriving] = models;
        let tools = serving.hosts().len();
        let (blends, served) = (vec![blend; tools], vec![Served::default(); tools]);
        Self { serving, fading, arriving, arrival: None, blends, served, version: 0, resync: Resynced::default() }
    }

    /// Lets `models` serve at once: for tick 0. They get spares in exchange.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn begin(&mut self, models: &mut LocalModels, version: u32) {
        std::mem::swap(&mut self.serving, models);
        self.version = version;
    }

    /// Takes newer models in exchange for spares. Models of their kind that are still catching up are given up for them, unless they are nearer
    /// to the present by now: where catching up takes longer than a period, none would ever serve. Those that are older than what `ways` remember
    /// are refused: they could not be brought to the present.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn offer(&mut self, models: &mut LocalModels, version: u32, ways: &Ways) {
        let reached = models.built_at();
        // One of another kind was asked for, and the whole body, which goes on by itself, is sent only where something has changed.
        let is_other = models.kind() == Kind::Full || models.kind() != self.arriving.kind();
        let is_nearest = self.arrival.is_none_or(|(_, arriving)| is_other || arriving <= reached);
        if is_nearest && ways.reaches_back_to(reached) {
            std::mem::swap(&mut self.arriving, models);
            self.arrival = Some((version, reached));
        }
    }

    /// Advances one tick: the last of `ways`. Models that have arrived late come nearer to the present if they `may_catch_up`: not in a
    /// release that is itself behind, which would fall behind further.
    ///
    /// # Real-time
    /// Bounded, real-time safe.
    pub fn tick(&mut self, ways: &Ways, may_catch_up: bool) {
        if may_catch_up {
            self.catch_up(ways);
        }
        let motions = ways.of(ways.now());
        self.serving.tick(motions);
        let needs_old = self.blends[0].needs_old();
        if needs_old {
            self.fading.tick(motions);
        }
        for (tool, (blend, served)) in self.blends.iter_mut().zip(&mut self.served).enumerate() {
            let new = self.serving.wrench(tool);
            // A diverged old model must not spoil a good new one.
            let old = needs_old.then(|| self.fading.wrench(tool)).filter(Wrench::is_finite).unwrap_or(new);
            let (wrench, jump) = blend.mix(new, old);
            let resync = jump.map(|jump| Resynced { jump, ..self.resync });
            *served = Served { wrench, resync, swap_step: blend.step_now() };
        }
    }

    /// What the last tick gave to tool number `tool`.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn served(&self, tool: usize) -> Served {
        self.served[tool]
    }

    /// Brings arrived models nearer to the start of the last tick; when they are there and no blend is under way, they serve.
    fn catch_up(&mut self, ways: &Ways) {
        let Some((version, mut reached)) = self.arrival else { return };
        let begun = ways.now() - 1;
        if self.arriving.have_to_catch_up() {
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
        if self.blends[0].is_under_way() {
            return;
        }
        self.arrival = None;
        std::mem::swap(&mut self.fading, &mut self.serving);
        std::mem::swap(&mut self.serving, &mut self.arriving);
        self.version = version;
        self.resync = Resynced { version, age: begun.saturating_sub(self.serving.built_at()), ..Resynced::default() };
        self.blends.iter_mut().for_each(Blend::begin);
    }

    /// The models that serve now.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn serving(&self) -> &LocalModels {
        &self.serving
    }

    /// The version of the models that serve.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn version(&self) -> u32 {
        self.version
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Kind, LocalModel, ResyncView};
    use super::*;
    use crate::contact::{Contact, ToolMotion};

    /// Adds up the motion that it was given; its force is its base plus that. It resolves the tools from `first` to `last`.
    #[derive(Debug)]
    struct Counting {
        base: f64,
        built_at: u64,
        catches_up: bool,
        travelled: Vec3,
        ticks: u64,
        tools: std::ops::RangeInclusive<usize>,
    }

    impl LocalModel for Counting {
        fn rebuild(&mut self, _: ResyncView<'_>) {}
        fn tick(&mut self, tools: &[ToolMotion]) -> Wrench {
            self.travelled += tools[0].way();
            self.ticks += 1;
            Wrench::default()
        }
        fn wrench(&self, tool: usize) -> Option<Wrench> {
            let force = Vec3::new(self.base, self.travelled.y, self.ticks as f64);
            self.tools.contains(&tool).then_some(force.into())
        }
        fn built_at(&self) -> u64 {
            self.built_at
        }
        fn kind(&self) -> Kind {
            if self.base < 100.0 { Kind::Patch } else { Kind::Full }
        }
        fn serves_as(&self, _: usize) -> Kind {
            Kind::Patch
        }
        fn catches_up(&self) -> bool {
            self.catches_up
        }
        fn contact(&self, _: usize) -> Contact {
            Contact::default()
        }
    }

    fn model(base: f64, built_at: u64, catches_up: bool) -> LocalModels {
        models(&[base], built_at, catches_up)
    }

    /// One for each tool, which resolves that and the next ones.
    fn models(bases: &[f64], built_at: u64, catches_up: bool) -> LocalModels {
        let mut number = 0..;
        LocalModels::new(bases.len(), || {
            let first = number.next().unwrap();
            let (travelled, ticks, tools) = (Vec3::zeros(), 0, first..=bases.len());
            Box::new(Counting { base: bases[first], built_at, catches_up, travelled, ticks, tools })
        })
    }

    /// A succession with the ways of its tools.
    struct Followed {
        models: Succession,
        ways: Ways,
    }

    impl Followed {
        fn new(blend_ticks: u32) -> Self {
            Self::of(&[1.0], blend_ticks)
        }

        fn of(bases: &[f64], blend_ticks: u32) -> Self {
            let blend = Blend::new(BlendKind::Crossfade, blend_ticks);
            let spare = || models(&vec![-1.0; bases.len()], 0, true);
            let mut succession = Succession::new([spare(), spare(), spare()], blend);
            succession.begin(&mut models(bases, 0, true), 0);
            Self { models: succession, ways: Ways::new(bases.len()) }
        }

        fn tick(&mut self, t: u64) -> Served {
            let motion = ToolMotion::straight(tool(t - 1), tool(t));
            self.ways.go(std::iter::repeat(motion));
            assert_eq!(self.ways.now(), t);
            self.models.tick(&self.ways, true);
            self.models.served(0)
        }

        fn offer(&mut self, mut models: LocalModels, version: u32) {
            self.models.offer(&mut models, version, &self.ways);
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
    fn models_that_catch_up_slowly_serve_though_newer_ones_come_meanwhile() {
        let mut followed = Followed::new(0);
        (1..=60).for_each(|t| {
            followed.tick(t);
        });
        followed.offer(model(2.0, 33, true), 1);
        // It has come to 57 when the next one arrives.
        (61..=63).for_each(|t| assert_eq!(followed.tick(t).wrench.force.x, 1.0));
        followed.offer(model(3.0, 54, true), 2);
        assert_eq!(followed.tick(64).wrench.force.x, 2.0);
        // One that is nearer takes the place of one that is not.
        followed.offer(model(4.0, 20, true), 3);
        followed.offer(model(5.0, 64, true), 4);
        assert_eq!((followed.tick(65).wrench.force.x, followed.models.version()), (5.0, 4));
    }

    /// Check that the whole body, which is sent once, is taken although what is there is nearer to the present.
    #[test]
    fn a_whole_body_is_not_given_up_for_models_that_are_nearer() {
        let mut followed = Followed::new(0);
        (1..=60).for_each(|t| {
            followed.tick(t);
        });
        followed.offer(model(2.0, 33, true), 1);
        (61..=63).for_each(|t| assert_eq!(followed.tick(t).wrench.force.x, 1.0));
        followed.offer(model(100.0, 54, true), 2);
        let served: Vec<f64> = (64..=70).map(|t| followed.tick(t).wrench.force.x).collect();
        assert_eq!((served[6], followed.models.version()), (100.0, 2), "{served:?}");
        // And other models are taken in its place.
        followed.offer(model(101.0, 60, true), 3);
        followed.offer(model(3.0, 50, true), 4);
        let served: Vec<f64> = (71..=80).map(|t| followed.tick(t).wrench.force.x).collect();
        assert_eq!((served[9], followed.models.version()), (3.0, 4), "{served:?}");
    }

    /// Check that a tick takes no longer for several tools than for one while models catch up.
    #[test]
    fn late_models_of_several_tools_come_to_the_present_together_and_a_shared_one_counts_once() {
        for (shared, ticks) in [(false, 8), (true, 3)] {
            let mut followed = Followed::of(&[1.0, 1.5], 0);
            (1..=60).for_each(|t| {
                followed.tick(t);
            });
            let mut late = models(&[2.0, 2.5], 33, true);
            assert!(!shared || late.share(0, 1));
            followed.offer(late, 1);
            let forces = |t| {
                followed.tick(t);
                [0, 1].map(|tool| followed.models.served(tool).wrench.force)
            };
            let served: Vec<[Vec3; 2]> = (61..=80).map(forces).collect();
            // 27 ticks late, 4 caught up per tick while one more falls due, or 8.
            let swap = served.iter().position(|[force, _]| force.x == 2.0).unwrap();
            assert_eq!(swap, ticks);
            assert!(served[..swap].iter().all(|[a, b]| (a.x, b.x) == (1.0, 1.5)));
            let [own, other] = served[swap];
            assert_eq!((other.x, other.yz()), (if shared { 2.0 } else { 2.5 }, own.yz()));
            assert_eq!(own.y, tool(61 + swap as u64).y - tool(33).y, "nothing of the path is missing");
        }
        assert!(!models(&[1.0, 2.0], 0, true).share(1, 0), "a model serves nobody whom it does not resolve");
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
