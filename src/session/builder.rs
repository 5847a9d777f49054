//! Collects what a session is made of.

use super::parts::{OpenHaply, Parts, Side};
use crate::devices::{Device, ToolPath};
use crate::link::Transport;
use crate::model::body::Body;
use crate::model::contact::ToolShape;
use crate::model::local::BlendKind;
use crate::model::local::Feedback;
use crate::runtime::{Disturbance, Execution, RateGroup};
use crate::scene::{BlendSpec, FrictionSpec, LinkSpec, ModelChoice, SafetyStage, Scene, StepKind};

/// Collects the parts of a session; fills a [`Scene`] as a scene file does, and passes the same validation.
///
/// ```
/// use palpate::prelude::*;
///
/// # fn main() -> Result<(), Error> {
/// let body = Block::builder([6, 6, 6], [0.05; 3]).fix(Face::ZMin).build()?;
/// let session = Session::builder(body)
///     .path(ToolPath::constant([0.02, 0.02, 0.049])?)
///     .friction(0.5)
///     .local(RateGroup::hz(2000))
///     .virtual_time()
///     .duration_s(0.05);
/// assert_eq!(session.build()?.run()?.report.devices[0].force.ticks, 100);
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct SessionBuilder {
    pub(super) parts: Parts,
}

impl SessionBuilder {
    pub(super) fn new(body: Option<Box<dyn Body>>, scene: Scene) -> Self {
        Self { parts: Parts::new(body, scene) }
    }

    /// Puts a body of the program's own in the place of the scene's, which must not name nodes of its block then.
    #[must_use]
    pub fn body(mut self, body: impl Body + 'static) -> Self {
        self.parts.scene.body = None;
        self.parts.body = Some(Box::new(body));
        self
    }

    /// Adds a device of the program's own; without one the tool follows the scene's path.
    ///
    /// Each of several devices has its own contact, and needs a name: see
    /// [`named_device`](Self::named_device).
    #[must_use]
    pub fn device(mut self, device: impl Device + 'static) -> Self {
        self.parts.devices.push((None, Box::new(device)));
        self
    }

    /// Adds a device among several; its records are in the topics `/NAME/force` and so on.
    #[must_use]
    pub fn named_device(mut self, name: impl Into<String>, device: impl Device + 'static) -> Self {
        self.parts.devices.push((Some(name.into()), Box::new(device)));
        self
    }

    /// Lets the scene's first device, if it is a scripted tool or a simulated hand, follow `path`.
    #[must_use]
    pub fn path(mut self, path: ToolPath) -> Self {
        if let Some(first) = self.parts.scene.devices.first_mut() {
            first.path = Some(path);
        }
        self
    }

    /// Glues the tool of the device given last to a surface node, by id.
    #[must_use]
    pub fn attach_node(mut self, node: u32) -> Self {
        let device = self.parts.devices.len().saturating_sub(1);
        let attached = &mut self.parts.attached;
        attached.resize(attached.len().max(device + 1), None);
        attached[device] = Some(node);
        self
    }

    /// Gives the tool of the device given last a shape, in place of the scene's; without, it is a point. One that is glued to
    /// a node is glued by its centre, and nothing else of it touches.
    #[must_use]
    pub fn tool(mut self, shape: ToolShape) -> Self {
        let device = self.parts.devices.len().saturating_sub(1);
        let shapes = &mut self.parts.shapes;
        shapes.resize(shapes.len().max(device + 1), None);
        shapes[device] = Some(shape);
        self
    }

    /// Puts a simulated link between the haptic side and the global model, as if they were on two computers.
    #[must_use]
    pub fn link(mut self, link: LinkSpec) -> Self {
        self.parts.scene.link = Some(link);
        self
    }

    /// Takes the global models from another process, by `transport`: here are the devices, the local models and the log, there is a
    /// [`GlobalSession`](super::GlobalSession) of the same scene. Conditions of a simulated [`link`](Self::link) are not added.
    #[must_use]
    pub fn global_over(mut self, transport: impl Transport + 'static) -> Self {
        self.parts.side = Side::Haptic;
        self.parts.transport = Some(Box::new(transport));
        self
    }

    /// Says which devices of a scene with several are at this machine, by name; may be called again. The others are at another one, which
    /// [takes its global models](Self::global_over) from the same place: their tools are seen and met here, and felt there.
    #[must_use]
    pub fn device_here(mut self, name: impl Into<String>) -> Self {
        self.parts.here.get_or_insert_default().push(name.into());
        self
    }

    /// Logs a node's position every tick, by id; may be called again.
    #[must_use]
    pub fn probe(mut self, node: u32) -> Self {
        self.parts.probes.push(node);
        self
    }

    /// Says how the device of a scene with `kind = "haply"` is opened, for ticks of so many seconds: by
    /// `palpate_haply::open`, of the crate that drives it.
    #[must_use]
    pub fn open_haply_with(mut self, open: OpenHaply) -> Self {
        self.parts.open_haply = Some(open);
        self
    }

    /// Sets the global model's rate group: rate, pinning, priority, compute latency (unless the scene gives one).
    #[must_use]
    pub fn global(mut self, group: RateGroup) -> Self {
        self.parts.scene.global.rate_hz = group.rate().as_hz();
        self.parts.global = Some(group);
        self
    }

    /// Sets the haptic rate group, in which devices and local models tick. It asks for SCHED_FIFO 80 unless it says
    /// otherwise, by [`realtime`](RateGroup::realtime) or [`best_effort`](RateGroup::best_effort).
    #[must_use]
    pub fn local(mut self, group: RateGroup) -> Self {
        self.parts.scene.local.rate_hz = group.rate().as_hz();
        self.parts.local = Some(group);
        self
    }

    /// Names the local model; without, the session chooses one that fits body and machine.
    #[must_use]
    pub fn model(mut self, model: impl Into<ModelChoice>) -> Self {
        if self.parts.is_of_program {
            // Whatever does not go with it was asked for, before or after.
            self.parts.scene.local.model = model.into();
        } else {
            self.parts.scene = self.parts.scene.with_model(model);
        }
        self
    }

    /// Sets the error (rms, % of the peak force) that 19 of 20 random scenes are to be within: of a model that may be chosen, 1 without;
    /// and of `predictive`, which becomes smaller if that does, unless [`patch`](Self::patch) or [`basis`](Self::basis) says how large it is.
    #[must_use]
    pub fn error_pct(mut self, error_pct: f64) -> Self {
        self.parts.scene.local.error_pct = Some(error_pct);
        self
    }

    /// Sets the number of states of the reduced surroundings of `predictive`; without, 250, or fewer if they do for the
    /// [`error_pct`](Self::error_pct).
    #[must_use]
    pub fn basis(mut self, states: usize) -> Self {
        self.parts.scene.local.basis = Some(states);
        self
    }

    /// Sets the nodes of a patch: along the surface, along it, into depth; without, what
    /// [`Scene::patch_size`](crate::scene::Scene::patch_size) says.
    #[must_use]
    pub fn patch(mut self, size: [usize; 3]) -> Self {
        self.parts.scene.local.patch = Some(size);
        self
    }

    /// Keeps no reduced surroundings from run to run: by default those of a scene that was read from a file, and runs in real time, are
    /// kept in the user's cache, and those of a scene that names a folder there.
    #[must_use]
    pub fn forget_bases(mut self) -> Self {
        self.parts.scene.local.keep_bases = false;
        self
    }

    /// Chooses the data that the global model takes over from the local one.
    #[must_use]
    pub fn feedback(mut self, feedback: Feedback) -> Self {
        self.parts.scene.local.feedback = Some(feedback);
        self
    }

    /// Blends resyncs over `ms` milliseconds, at most a period of the global model, old and new model both running.
    #[must_use]
    pub fn crossfade_ms(mut self, ms: f64) -> Self {
        self.parts.scene.local.blend = BlendSpec { kind: BlendKind::Crossfade, ms };
        self
    }

    /// Lets the step of a resync decay over `ms` milliseconds, at most a period of the global model, while the new model alone runs.
    #[must_use]
    pub fn offset_ms(mut self, ms: f64) -> Self {
        self.parts.scene.local.blend = BlendSpec { kind: BlendKind::Offset, ms };
        self
    }

    /// Steps a linear patch explicitly or implicitly; without, the stability limit decides.
    #[must_use]
    pub fn local_step(mut self, step: StepKind) -> Self {
        self.parts.scene.local.step = step;
        self
    }

    /// Sets the Coulomb coefficient; infinite for a tool that sticks until it is pulled off.
    #[must_use]
    pub fn friction(mut self, mu: f64) -> Self {
        self.parts.scene.contact.friction =
            if mu == f64::INFINITY { FrictionSpec::Stick } else { FrictionSpec::Coefficient(mu) };
        self
    }

    /// Sets the coefficient that breaks a sticking tool loose, at least that of [`friction`](Self::friction), which remains that of
    /// sliding.
    #[must_use]
    pub fn static_friction(mut self, mu: f64) -> Self {
        self.parts.scene.contact.static_friction = Some(mu);
        self
    }

    /// Sets the speed (m/s) over which the coefficient falls from the static one to that of sliding; without, it falls at once.
    #[must_use]
    pub fn stribeck_m_s(mut self, speed: f64) -> Self {
        self.parts.scene.contact.stribeck_m_s = speed;
        self
    }

    /// Sets the explicit steps per millisecond; without, they are chosen from the stability limit.
    #[must_use]
    pub fn substeps_per_ms(mut self, substeps: u32) -> Self {
        self.parts.scene.global.substeps_per_ms = Some(substeps);
        self
    }

    /// Switches stages of the safety pipeline off; the log and the report say so. [`build`](Self::build) refuses the finite
    /// check and the clamp.
    #[must_use]
    pub fn safety_off(mut self, stages: impl IntoIterator<Item = SafetyStage>) -> Self {
        self.parts.scene.safety.off.extend(stages);
        self
    }

    /// Hangs the tool on the device by a virtual coupling: a spring and a damper whose gains keep what is felt within what
    /// the device renders stably, see `docs/safety.md`.
    #[must_use]
    pub fn coupling(mut self) -> Self {
        self.parts.scene.local.coupling = true;
        self
    }

    /// Ends the run by itself after `seconds`; without, it runs until it is stopped (scenes have a duration).
    #[must_use]
    pub fn duration_s(mut self, seconds: f64) -> Self {
        self.parts.scene.run.duration_s = seconds;
        self.parts.endless = false;
        self
    }

    /// Runs until it is stopped, whatever duration the scene has.
    #[must_use]
    pub fn endless(mut self) -> Self {
        self.parts.endless = true;
        self
    }

    /// Runs in simulated time, on one thread, as fast as the machine allows and bit-identically every time.
    #[must_use]
    pub fn virtual_time(mut self) -> Self {
        self.parts.options.execution = Execution::Virtual;
        self.parts.options.in_real_time = false;
        self
    }

    /// Makes, in virtual time and for tests of robustness, the releases of a rate group late, as `disturbance` says of
    /// each by its number; see [`RuntimeBuilder::disturb`](crate::runtime::RuntimeBuilder::disturb). The groups are
    /// `local`, `global` (not with `full`, which has none), `basis` (with reduced surroundings only) and `logger`.
    ///
    /// [`Session::start`](super::Session::start) refuses it on threads, for a group that is not there, and twice for
    /// the same group.
    #[must_use]
    pub fn disturb(
        mut self,
        group: impl Into<String>,
        disturbance: impl FnMut(u64) -> Disturbance + Send + 'static,
    ) -> Self {
        self.parts.options.disturbed.add(group.into(), disturbance);
        self
    }

    /// Writes a log to `path`, overwriting what is there. A log that another run is still writing is refused at the start, and
    /// one that is gone at the end is the [`log_error`](super::Summary::log_error).
    #[must_use]
    pub fn log(mut self, path: impl Into<std::path::PathBuf>) -> Self {
        self.parts.options.log = Some(path.into());
        self
    }

    /// Adds the topic `/scene` to the log: surface, tools and forces for viewers, 30 times a second.
    #[must_use]
    pub fn log_scene(mut self) -> Self {
        self.parts.scene.log.scene = true;
        self
    }

    /// Lets the local model be changed while the session runs, by [`Controls::set_model`](super::Controls::set_model). `full` then runs
    /// beside a global model, with the same forces; what a session can be switched to takes memory, and a thread for reduced
    /// surroundings.
    #[must_use]
    pub fn switchable(mut self) -> Self {
        self.parts.scene.run.switchable = true;
        self
    }

    /// Hands records to the program while the session runs, by [`Running::take_records`](super::Running::take_records).
    #[must_use]
    pub fn share_records(mut self) -> Self {
        self.parts.options.shares_records = true;
        self
    }

    /// Keeps every record in memory, for [`Summary::records`](super::Summary::records).
    #[must_use]
    pub fn keep_records(mut self) -> Self {
        self.parts.options.keep_records = true;
        self
    }

    /// Measures, in virtual time, the CPU time of every release and of building the local models of every resync, for
    /// [`RuntimeReport::costs`](crate::runtime::RuntimeReport::costs) and [`Summary::builds`](super::Summary::builds).
    #[must_use]
    pub fn measure_cost(mut self) -> Self {
        self.parts.options.measures_cost = true;
        self
    }
}
