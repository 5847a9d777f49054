//! What each local model would cost on this body and this machine.

use super::budget::force_evaluation;
use super::timing::Timing;
use crate::model::body::{Body, State};
use crate::model::local::Kind;
use crate::model::surroundings::RestingBody;
use crate::runtime::{Execution, Nanos};
use crate::scene::Scene;

/// Contact, integration, device and records of a tick of the whole body, as a factor on its force evaluations.
const OVERHEAD: f64 = 1.25;
/// What runs ahead of a large body has a rim beside its own nodes.
const AHEAD_RIM: f64 = 1.4;
/// The part of a haptic period that the typical tick may take: the slowest of a hundred takes twice as long (`palpate compare`
/// on the reference scenes: 74 and 168 us for `full`).
const HAPTIC_SHARE: f64 = 0.5;
/// The part that a tick of `full` may take where everything else misses the error: some ticks are late then.
const TIGHT_SHARE: f64 = 0.8;
/// The part of a global period that its work may take: late results are what the expected errors are of.
const GLOBAL_SHARE: f64 = 1.0;
/// The same for both rates on a single core.
const SINGLE_CORE_SHARE: f64 = 0.8;
/// In virtual time: one for the haptic thread and one for the others.
const NOMINAL_CORES: usize = 2;

/// What a choice depends on.
#[derive(Clone, Debug)]
pub(super) struct Situation {
    /// One evaluation of all forces of the body.
    pub(super) evaluation: Nanos,
    /// Where that comes from: `measured` or `nominal`.
    pub(super) origin: &'static str,
    /// Evaluations per haptic tick.
    pub(super) substeps: u32,
    /// Haptic ticks that one step of the global model spans.
    pub(super) stride: u32,
    pub(super) haptic_period_s: f64,
    pub(super) global_period_s: f64,
    /// Haptic ticks that `predictive` and `predicted` look ahead.
    pub(super) ahead_ticks: u32,
    /// The part of the body that does.
    pub(super) ahead_share: f64,
    pub(super) cores: usize,
    pub(super) error_pct: f64,
    /// States of the reduced surroundings; the most there may be where an error budget decides.
    pub(super) states: usize,
    /// Devices, with a local model each unless that is the whole body.
    pub(super) devices: usize,
    /// The models that scene and body allow.
    pub(super) possible: Vec<Kind>,
}

/// CPU time of a haptic tick per substep with the default patch (`palpate compare`, column "haptic tick p50"): it does not
/// depend on the size of the body. `full` has none of its own.
fn local_substep_s(kind: Kind) -> f64 {
    match kind {
        Kind::Full => 0.0,
        Kind::Hold => 0.3e-6,
        Kind::Patch | Kind::LinearBoundary | Kind::ScaledBoundary | Kind::Condensed => 4.5e-6,
        Kind::Predicted => 5e-6,
        Kind::Predictive => 7.5e-6,
    }
}

/// The states that [`local_substep_s`] was measured with, and what each one more costs (s): two products with a ring of 76
/// nodes (`cargo bench --bench speed_vs_error`).
const NOMINAL_STATES: usize = 50;
const STATE_S: f64 = 0.06e-6;

impl Situation {
    /// Of `scene` with `body` as it is at the start. On threads the forces are evaluated and timed; in virtual time all costs
    /// are nominal, so that a run is the same everywhere.
    pub(super) fn of(scene: &Scene, body: &mut dyn Body, state: &State, timing: Timing, execution: Execution) -> Self {
        let is_restrictable = RestingBody::is_of(body);
        let is_held = body.inverse_masses().contains(&0.0);
        let is_possible = |kind: &Kind| {
            let suits_body = match kind {
                // Nothing of it would be beyond the link.
                Kind::Full => scene.link.is_none(),
                Kind::Hold | Kind::Patch | Kind::LinearBoundary | Kind::ScaledBoundary => true,
                Kind::Condensed => is_restrictable && is_held,
                Kind::Predicted => is_restrictable,
                Kind::Predictive => is_restrictable && scene.local.basis_states() > 0,
            };
            suits_body && scene.clone().with_model(*kind).validate().is_ok()
        };
        let possible = Kind::ALL.into_iter().filter(is_possible).collect();
        let (evaluation, origin, cores) = match execution {
            Execution::Virtual => (Nanos::from_secs_f64(body.nominal_evaluation()), "nominal", NOMINAL_CORES),
            Execution::Threaded => {
                let cores = std::thread::available_parallelism().map_or(1, usize::from);
                (force_evaluation(body, state), "measured", cores)
            }
        };
        let Timing { haptic, global, substeps, stride, horizon } = timing;
        let [haptic_period_s, global_period_s] = [haptic, global].map(|rate| rate.period_s());
        Self {
            evaluation,
            origin,
            substeps,
            stride,
            haptic_period_s,
            global_period_s,
            ahead_ticks: horizon,
            ahead_share: (AHEAD_RIM * scene.global.ahead_nodes as f64 / state.positions.len() as f64).min(1.0),
            cores,
            error_pct: scene.local.chosen_within_pct(),
            states: scene.local.basis_states(),
            devices: scene.devices.len(),
            possible,
        }
    }

    /// What a tick of `full` takes (s).
    fn full_tick_s(&self) -> f64 {
        OVERHEAD * f64::from(self.substeps) * self.evaluation.as_secs_f64()
    }

    /// What a haptic tick takes with one model of `kind` for each device, or with the one whole body for all (s).
    fn haptic_s(&self, kind: Kind) -> f64 {
        let models = if kind == Kind::Full { 1 } else { self.devices };
        models as f64 * self.tick_s(kind)
    }

    /// What a haptic tick of one model of `kind` takes (s).
    fn tick_s(&self, kind: Kind) -> f64 {
        let substeps = if kind.is_linear() { self.substeps.min(Kind::MOST_EXPLICIT_STEPS) } else { self.substeps };
        match kind {
            Kind::Full => self.full_tick_s(),
            Kind::Predictive => {
                let more = self.states.saturating_sub(NOMINAL_STATES) as f64 * STATE_S;
                f64::from(substeps) * (local_substep_s(kind) + more)
            }
            kind => f64::from(substeps) * local_substep_s(kind),
        }
    }

    /// What the global model does in one of its periods (s): it follows the tool, and looks ahead.
    fn global_work_s(&self, kind: Kind) -> f64 {
        let tick = self.full_tick_s() / f64::from(self.stride);
        let follow = self.global_period_s / self.haptic_period_s * tick;
        let run_ahead = self.ahead_share * f64::from(self.ahead_ticks) * tick;
        let ahead = match kind {
            Kind::Full => return 0.0,
            Kind::Predicted | Kind::Predictive => run_ahead,
            _ => 0.0,
        };
        follow + self.devices as f64 * ahead
    }

    /// How full the more burdened of its two periods is, against what it may take: it fits up to 1.
    pub(super) fn load(&self, kind: Kind) -> f64 {
        let haptic = self.haptic_s(kind) / self.haptic_period_s;
        let global = self.global_work_s(kind) / self.global_period_s;
        // The haptic thread takes a single core away from the global one.
        let shared = if self.cores > 1 { global / GLOBAL_SHARE } else { (haptic + global) / SINGLE_CORE_SHARE };
        (haptic / HAPTIC_SHARE).max(if kind == Kind::Full { 0.0 } else { shared })
    }

    /// True if `kind` is possible and fits.
    pub(super) fn fits(&self, kind: Kind) -> bool {
        self.possible.contains(&kind) && self.load(kind) <= 1.0
    }

    /// What part of its period a tick of `full` takes, if it can do that with some of them late.
    pub(super) fn tight_share(&self) -> Option<f64> {
        let share = self.full_tick_s() / self.haptic_period_s;
        (self.possible.contains(&Kind::Full) && share <= TIGHT_SHARE).then_some(share)
    }

    /// What a tick of `full` takes of its period, in words, or why there is none.
    pub(super) fn full_in_words(&self, verb: &str) -> String {
        if !self.possible.contains(&Kind::Full) {
            return "full has no global model beyond the link".to_owned();
        }
        let (tick, period) = (short(self.full_tick_s()), short(self.haptic_period_s));
        format!("a full tick {verb} {tick} of {period} ({})", self.origin)
    }

    /// Why `kind` does not fit.
    pub(super) fn excess(&self, kind: Kind) -> String {
        let (tick, work) = (self.haptic_s(kind), self.global_work_s(kind));
        let name = kind.name();
        if tick > HAPTIC_SHARE * self.haptic_period_s {
            return format!("a tick of {name} would take {} of {}", short(tick), short(self.haptic_period_s));
        }
        let (work, period) = (short(work), short(self.global_period_s));
        let where_to = if self.cores > 1 { "" } else { " on a single core" };
        format!("the global model would need {work} of {period} for {name}{where_to}")
    }
}

/// A time to three digits.
fn short(seconds: f64) -> String {
    let (value, unit) = match seconds {
        ..1e-3 => (seconds * 1e6, "us"),
        1e-3..1.0 => (seconds * 1e3, "ms"),
        _ => (seconds, "s"),
    };
    let places = if value < 9.995 { 2 } else { usize::from(value < 99.95) };
    let text = format!("{value:.places$}");
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    format!("{text} {unit}")
}
