//! One tool at the haptic rate, whatever model computes its force: its way between the device's samples, what it feels, its
//! command and its records.

use super::messages::{ComputedForce, DeviceSample};
use super::touched::{self, single};
use crate::devices::FASTEST_M_S;
use crate::log::{ContactSample, ForceSample, LogRecord, ProbeSample, Resync, ServedBy};
use crate::model::contact::{Contact, ContactMode, ContactPoint, ToolMotion};
use crate::model::local::{Kind, Served};
use crate::model::{Pose, Vec3, Wrench};
use crate::runtime::{Nanos, Rate, Reader, Recorder, TickContext, Writer};
use crate::safety::coupling::CoupledTool;

/// The ports of a [`LocalTool`].
#[derive(Debug)]
pub struct LocalToolPorts {
    /// The device's newest state.
    pub samples: Reader<DeviceSample>,
    /// The newest force for it.
    pub commands: Writer<ComputedForce>,
    /// Records.
    pub recorder: Recorder,
}

/// The model that serves a tool, after the last tick of a release.
#[derive(Debug)]
pub struct Serving<'a> {
    /// The haptic tick.
    pub tick: u64,
    /// What made the force.
    pub kind: Kind,
    /// The version of the model; zero if there is only one.
    pub version: u32,
    /// Ticks since its last resync.
    pub age_ticks: u64,
    /// The tool's contact.
    pub contact: Contact,
    /// The places where a tool with a shape touches.
    pub points: &'a [ContactPoint],
    /// The area in which it does (m^2).
    pub area_m2: f64,
}

/// One tool at the haptic rate.
///
/// # Real-time
/// Wait-free, real-time safe.
#[derive(Debug)]
pub struct LocalTool {
    ports: LocalToolPorts,
    haptic: Rate,
    /// Logged nodes, in the order that models watch them.
    probes: Vec<u32>,
    /// A spring between device and simulated tool, if there is one.
    coupled: Option<CoupledTool>,
    /// Number of its device in the log.
    number: u16,
    /// Where it is at the end of the last tick.
    pose: Pose,
    /// Its device is at another machine.
    is_elsewhere: bool,
    /// Energy that it has given to the simulation (J).
    energy: f64,
    /// Of the ticks of this release.
    served: Served,
    /// Likewise (J).
    dissipated_j: f64,
}

impl LocalTool {
    /// The tool of device `number`, with the logged nodes `probes`. One that hangs on its device by a virtual coupling logs
    /// the force of that.
    pub fn new(
        number: u16,
        haptic: Rate,
        probes: Vec<u32>,
        coupled: Option<CoupledTool>,
        ports: LocalToolPorts,
    ) -> Self {
        let (pose, is_elsewhere, energy, served, dissipated_j) = Default::default();
        Self { ports, haptic, probes, coupled, number, pose, is_elsewhere, energy, served, dissipated_j }
    }

    /// Its device is at another machine, so that it may be put where it never went to.
    #[must_use]
    pub fn elsewhere(mut self) -> Self {
        self.is_elsewhere = true;
        self
    }

    /// Takes the device's newest state: a release begins.
    pub fn refresh(&mut self, ctx: &TickContext) {
        self.ports.samples.refresh(ctx);
        (self.served, self.dissipated_j) = Default::default();
    }

    /// Puts the tool where its device is: release 0.
    pub fn begin(&mut self) -> Pose {
        self.pose = self.target();
        if let Some(coupled) = &mut self.coupled {
            coupled.begin(self.pose.position.into());
        }
        self.pose
    }

    /// Where the device has the tool.
    fn target(&self) -> Pose {
        self.ports.samples.get().state.pose()
    }

    /// Where the tool is.
    pub fn pose(&self) -> Pose {
        self.pose
    }

    /// Goes the way of one tick of `dt` (s), the first of those that are `left` until the tool is where its device has it.
    pub fn go(&mut self, left: u64, dt: f64) -> ToolMotion {
        let target = self.target();
        let way = (target.position - self.pose.position).norm();
        if self.is_elsewhere && way > FASTEST_M_S * left as f64 * dt {
            self.begin();
        }
        let from = self.pose;
        // The tool is interpolated over all periods that are owed.
        self.pose = match &mut self.coupled {
            None => from.towards_in(&target, left),
            // The coupling is one of places: the tool turns with the device.
            Some(coupled) => Pose {
                position: coupled.follow(target.position.into(), left, dt).into(),
                ..from.towards_in(&target, left)
            },
        };
        ToolMotion { from, to: self.pose }
    }

    /// Takes what a model `served` for the `way` of a tick at whose end the tool is in `contact`.
    pub fn feel(&mut self, served: Served, way: &ToolMotion, contact: &Contact) {
        let before = std::mem::replace(&mut self.served, served);
        self.served.resync = served.resync.or(before.resync);
        self.served.swap_step += before.swap_step;
        let Wrench { force, torque } = finite_or_none(served.wrench);
        let moved = way.to.position - way.from.position;
        self.energy -= force.dot(&moved) + torque.dot(&way.to.turned_since(&way.from));
        self.dissipated_j += friction_work(contact, force, moved);
        if let Some(coupled) = &mut self.coupled
            && force == served.wrench.force
        {
            self.served.wrench.force = coupled.feel(force.into()).into();
            // The coupling feels no step.
            self.served.swap_step = Vec3::zeros();
        }
    }

    /// Commands and records the force of this release; `probe` gives where a watched node, by its place and its number, is in
    /// the local and in the global model (m). False if the force was none: zero is commanded.
    pub fn finish(
        &mut self,
        ctx: &TickContext,
        serving: &Serving<'_>,
        probe: impl Fn(usize, u32) -> [Vec3; 2],
    ) -> bool {
        let Served { wrench: computed, swap_step, .. } = self.served;
        let Wrench { force, torque } = finite_or_none(computed);
        *self.ports.commands.buffer() = ComputedForce {
            time: self.haptic.release(serving.tick),
            force,
            torque,
            age_ticks: u32::try_from(serving.age_ticks).unwrap_or(u32::MAX),
            swap_step,
            dissipated_j: self.dissipated_j,
            position: self.pose.position,
            mode: serving.contact.mode,
        };
        self.ports.commands.publish(ctx);
        self.record(computed, serving, probe);
        computed.is_finite()
    }

    /// Records the force as it was `computed`, also if it was none; the contact is that of the force commanded.
    fn record(&mut self, computed: Wrench, serving: &Serving<'_>, probe: impl Fn(usize, u32) -> [Vec3; 2]) {
        let &Serving { tick, kind, version, age_ticks, contact, points, area_m2 } = serving;
        let (time, device, energy_j) = (self.haptic.release(tick), self.number, self.energy);
        let recorder = &mut self.ports.recorder;
        let sample = ForceSample {
            time,
            force_n: computed.force.into(),
            model_version: version,
            served_by: served_by(kind),
            model_age_s: self.haptic.release(age_ticks).as_secs_f64(),
            energy_j,
            torque_n_m: computed.torque.into(),
            device,
        };
        LogRecord::Force(sample).push_to(recorder);
        touched::records(points, time, device, |point| recorder.push(point));
        let (count, area_m2) = (touched::count(points, &contact), area_m2 as f32);
        let force = finite_or_none(computed).force;
        recorder.push(ContactSample { count, area_m2, device, ..contact_sample(time, &contact, force) });
        for (place, &node) in self.probes.iter().enumerate() {
            let [local_m, global_m] = probe(place, node).map(Into::into);
            recorder.push(ProbeSample { time, node, local_m, global_m, device });
        }
        if let Some(resync) = self.served.resync {
            recorder.push(Resync {
                time,
                version: resync.version,
                age: self.haptic.release(resync.age),
                jump_before_n: resync.jump.before,
                jump_after_n: resync.jump.after,
                energy_j,
                device,
            });
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
