//! The local actor: turns the newest tool sample into a force at the haptic rate.

use super::cause::Cause;
use super::messages::{ComputedForce, DeviceSample, SurfaceView, ToolTick};
use super::touched::{self, single};
use crate::log::{ContactSample, ForceSample, LogRecord, ProbeSample, Resync, ServedBy};
use crate::model::contact::{Contact, ContactMode};
use crate::model::local::{Kind, LocalModel, PatchGeometry, Resynced, Served, Succession};
use crate::model::{Pose, Vec3, Wrench};
use crate::runtime::{Actor, GroupMode, Outcome, OutletWriter, QueueWriter, Reader, Recorder, TickContext, Writer};
use crate::runtime::{Nanos, Rate};
use crate::safety::coupling::CoupledTool;

/// Haptic ticks that one release advances at most. After a long stall the rest is made up by the releases that follow:
/// simulated time never stretches, and no release takes longer than this many ticks.
const MAX_TICKS_PER_RELEASE: u64 = 8;

/// The same in degraded mode: still one more than a period asks for, so that what is owed is made up in the end.
const MAX_TICKS_WHEN_DEGRADED: u64 = 2;

/// Where local models come from.
#[derive(Debug)]
#[expect(clippy::large_enum_variant, reason = "there is one per session, and it does not move")]
pub enum ModelSource {
    /// One model that needs no other (`full`); it publishes the surface itself, for a program that draws and for the log.
    Alone(Vec<OutletWriter<SurfaceView>>),
    /// Newer ones from a global model.
    Global {
        /// They arrive here.
        models: Reader<Box<dyn LocalModel>>,
        /// The tool at every haptic tick goes there.
        ticks: QueueWriter<ToolTick>,
        /// The patch's geometry at the tick of each resync, if it is fed back.
        geometry: Option<Writer<PatchGeometry>>,
    },
}

/// The ports of a [`LocalActor`].
#[derive(Debug)]
pub struct LocalPorts {
    /// The device's newest state.
    pub samples: Reader<DeviceSample>,
    /// The newest force for it.
    pub commands: Writer<ComputedForce>,
    /// Where local models come from.
    pub source: ModelSource,
    /// Records.
    pub recorder: Recorder,
}

/// Runs the fast, small simulation.
///
/// # Real-time
/// Bounded, by eight haptic ticks a release, and real-time safe if its models are.
#[derive(Debug)]
pub struct LocalActor {
    models: Succession,
    ports: LocalPorts,
    haptic: Rate,
    /// Rate of the resyncs, and the next one.
    global: Rate,
    resync: u64,
    /// Logged nodes, in the order that models watch them.
    probes: Vec<u32>,
    /// Energy that the tool has given to the simulation (J).
    energy: f64,
    /// A spring between device and simulated tool, if there is one.
    coupled: Option<CoupledTool>,
    /// Number of its device in the log.
    number: u16,
    begun: bool,
}

impl LocalActor {
    /// An actor over `models`; `haptic` and `global` are the rates of the two groups, `probes` the logged nodes.
    pub fn new(models: Succession, haptic: Rate, global: Rate, probes: Vec<u32>, ports: LocalPorts) -> Self {
        let (resync, energy, coupled, number, begun) = (0, 0.0, None, 0, false);
        Self { models, ports, haptic, global, resync, probes, energy, coupled, number, begun }
    }

    /// The same for one of several devices: its records are those of device `number`.
    #[must_use]
    pub fn numbered(mut self, number: u16) -> Self {
        self.number = number;
        self
    }

    /// The simulated tool hangs on the device by a virtual coupling; the logged force is then that of the coupling.
    #[must_use]
    pub fn coupled(mut self, tool: CoupledTool) -> Self {
        self.coupled = Some(tool);
        self
    }

    /// Release 0: the first sample and the first model, no force.
    fn begin(&mut self, ctx: &TickContext) {
        self.begun = true;
        let tool = self.target();
        if let Some(coupled) = &mut self.coupled {
            coupled.begin(tool.position.into());
        }
        match &mut self.ports.source {
            ModelSource::Global { models, .. } => {
                models.refresh(ctx);
                let version = models.version() as u32;
                self.models.begin(tool, Some((models.get_mut(), version)));
            }
            ModelSource::Alone(_) => self.models.begin(tool, None),
        }
        self.publish_state(ctx);
    }

    /// Where the device has the tool.
    fn target(&self) -> Pose {
        self.ports.samples.get().state.pose()
    }

    /// Advances the model to this release, or as far towards it as one release may.
    fn advance(&mut self, ctx: &TickContext, target: Pose) -> (Served, f64) {
        let (mut served, mut dissipated_j) = (Served::default(), 0.0);
        let owed = ctx.tick.saturating_sub(self.models.now());
        let most = match ctx.mode {
            GroupMode::Normal | GroupMode::Stopping => MAX_TICKS_PER_RELEASE,
            GroupMode::Degraded => MAX_TICKS_WHEN_DEGRADED,
        };
        for i in 0..owed.min(most) {
            // The tool is interpolated over all periods that are owed.
            let from = self.models.tool();
            let tool = match &mut self.coupled {
                None => from.towards_in(&target, owed - i),
                // The coupling is one of places: the tool turns with the device.
                Some(coupled) => Pose {
                    position: coupled.follow(target.position.into(), owed - i, ctx.dt_nominal).into(),
                    ..from.towards_in(&target, owed - i)
                },
            };
            let before = served;
            served = self.models.tick(tool);
            served.resync = served.resync.or(before.resync);
            served.swap_step += before.swap_step;
            let Wrench { force, torque } = finite_or_none(served.wrench);
            let moved = tool.position - from.position;
            self.energy -= force.dot(&moved) + torque.dot(&tool.turned_since(&from));
            dissipated_j += friction_work(&self.models.serving().contact(), force, moved);
            if let Some(coupled) = &mut self.coupled
                && force == served.wrench.force
            {
                served.wrench.force = coupled.feel(force.into()).into();
            }
            self.publish_state(ctx);
        }
        (served, dissipated_j)
    }

    /// Tells the global model where the tool and the patch are.
    fn publish_state(&mut self, ctx: &TickContext) {
        let (tick, pose) = (self.models.now(), self.models.tool());
        let is_resync = tick == self.haptic.last_release(self.global.release(self.resync));
        if is_resync {
            self.resync += 1;
        }
        match &mut self.ports.source {
            ModelSource::Alone(surfaces) if is_resync => {
                for surface in surfaces {
                    let view = surface.buffer();
                    view.time = self.haptic.release(tick);
                    for (node, position) in view.positions.iter_mut().enumerate() {
                        *position = self.models.serving().position(node as u32).unwrap_or(*position);
                    }
                    surface.publish(ctx);
                }
            }
            ModelSource::Alone(_) => {}
            ModelSource::Global { ticks, geometry, .. } => {
                if let Some(geometry) = geometry.as_mut().filter(|_| is_resync) {
                    let buffer = geometry.buffer();
                    buffer.tick = tick;
                    if self.models.serving().geometry(buffer) {
                        geometry.publish(ctx);
                    }
                }
                // A full queue is counted; the global model sees the gap and interpolates over it.
                ticks.push(ctx, ToolTick { tick, pose });
            }
        }
    }

    /// Ticks since the last resync of the model that serves.
    fn age_ticks(&self) -> u64 {
        match self.ports.source {
            ModelSource::Alone(_) => 0,
            ModelSource::Global { .. } => self.models.now().saturating_sub(self.models.serving().built_at()),
        }
    }

    fn record(&mut self, time: Nanos, Wrench { force, torque }: Wrench, resync: Option<Resynced>) {
        let age = |ticks: u64| self.haptic.release(ticks);
        let model_age_s = age(self.age_ticks()).as_secs_f64();
        let (model, device) = (self.models.serving(), self.number);
        let recorder = &mut self.ports.recorder;
        let sample = ForceSample {
            time,
            force_n: force.into(),
            model_version: self.models.version(),
            served_by: served_by(model.serves_as()),
            model_age_s,
            energy_j: self.energy,
            torque_n_m: torque.into(),
            device,
        };
        LogRecord::Force(sample).push_to(recorder);
        let (points, contact) = (model.contact_points(), contact_sample(time, &model.contact(), force));
        touched::records(points, time, device, |point| recorder.push(point));
        let (count, area_m2) = (touched::count(points, &model.contact()), model.contact_area() as f32);
        recorder.push(ContactSample { count, area_m2, device, ..contact });
        for (place, &node) in self.probes.iter().enumerate() {
            let global = model.global_position(place).unwrap_or_default();
            let local = model.position(node).unwrap_or(global);
            let (local_m, global_m) = (local.into(), global.into());
            recorder.push(ProbeSample { time, node, local_m, global_m, device });
        }
        if let Some(resync) = resync {
            recorder.push(Resync {
                time,
                version: resync.version,
                age: age(resync.age),
                jump_before_n: resync.jump.before,
                jump_after_n: resync.jump.after,
                energy_j: self.energy,
                device,
            });
        }
    }
}

impl Actor for LocalActor {
    fn name(&self) -> &str {
        "local"
    }

    fn tick(&mut self, ctx: &TickContext) -> Outcome {
        if ctx.mode == GroupMode::Stopping {
            // The device brings itself to rest.
            return Outcome::Continue;
        }
        self.ports.samples.refresh(ctx);
        if !self.begun {
            self.begin(ctx);
            return Outcome::Continue;
        }
        if let ModelSource::Global { models, .. } = &mut self.ports.source
            && models.refresh(ctx)
        {
            let version = models.version() as u32;
            self.models.offer(models.get_mut(), version);
        }
        let target = self.target();
        let (Served { wrench: computed, resync, swap_step }, dissipated_j) = self.advance(ctx, target);
        let Wrench { force, torque } = finite_or_none(computed);
        let time = self.haptic.release(self.models.now());
        let age_ticks = u32::try_from(self.age_ticks()).unwrap_or(u32::MAX);
        let (position, mode) = (self.models.tool().position, self.models.serving().contact().mode);
        *self.ports.commands.buffer() =
            ComputedForce { time, force, torque, age_ticks, swap_step, dissipated_j, position, mode };
        self.ports.commands.publish(ctx);
        self.record(time, Wrench { force, torque }, resync);
        match (computed.is_finite(), &self.ports.source) {
            (true, _) => Outcome::Continue,
            // The next resync brings a good model; without a global model nothing would.
            (false, ModelSource::Global { .. }) => Outcome::Degraded(Cause::LocalNotFinite.code()),
            (false, ModelSource::Alone(_)) => Outcome::Fault(Cause::LocalNotFinite.code()),
        }
    }
}

fn served_by(kind: Kind) -> ServedBy {
    match kind {
        Kind::Full => ServedBy::Full,
        Kind::Hold => ServedBy::Hold,
        Kind::Patch => ServedBy::Patch,
        Kind::LinearBoundary => ServedBy::LinearBoundary,
        Kind::ScaledBoundary => ServedBy::ScaledBoundary,
        Kind::Condensed => ServedBy::Condensed,
        Kind::Predicted => ServedBy::Predicted,
        Kind::Predictive => ServedBy::Predictive,
    }
}

fn finite_or_none(wrench: Wrench) -> Wrench {
    if wrench.is_finite() { wrench } else { Wrench::default() }
}

/// What sliding took of the tool's motion `moved` (m) under `force` (N).
fn friction_work(contact: &Contact, force: Vec3, moved: Vec3) -> f64 {
    if contact.mode != ContactMode::Slip {
        return 0.0;
    }
    let tangential = force - contact.normal * force.dot(&contact.normal);
    (-tangential.dot(&moved)).max(0.0)
}

fn contact_sample(time: Nanos, contact: &Contact, force: Vec3) -> ContactSample {
    let along = force.dot(&contact.normal);
    ContactSample {
        time,
        mode: contact.mode,
        triangle: contact.triangle.unwrap_or(u32::MAX),
        weights: [contact.weights[1], contact.weights[2]],
        normal: single(contact.normal),
        normal_force_n: along as f32,
        tangential_force_n: (force - contact.normal * along).norm() as f32,
        ..ContactSample::default()
    }
}

#[cfg(test)]
#[path = "tests/local.rs"]
mod tests;
