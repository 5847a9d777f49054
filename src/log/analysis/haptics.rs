//! What a run did to the force: resyncs, contact, limits.

use crate::log::percentiles::{Distribution, Magnitudes, Percentiles};
use crate::log::records::{CommandSample, ContactSample, ForceSample, Resync, ServedBy};
use crate::model::contact::ContactMode;

/// The length of a vector, in its own unit.
pub fn magnitude([x, y, z]: [f64; 3]) -> f64 {
    (x * x + y * y + z * z).sqrt()
}

/// The bits of [`CommandSample::limits`].
const LIMIT_BITS: usize = 16;

/// The resyncs of a run.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ResyncReport {
    /// The jump of the force at the swap, before blending (N); its count is the number of resyncs.
    pub jump_before_n: Percentiles<f64>,
    /// The largest one-tick change that blending leaves of the jump (N).
    pub jump_after_n: Percentiles<f64>,
    /// The age of the new model's state on arrival (ns).
    pub age_ns: Percentiles<u64>,
}

/// The force of a run.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ForceReport {
    /// The number of haptic ticks with a force.
    pub ticks: u64,
    /// The largest finite magnitude before the safety pipeline (N).
    pub peak_n: f64,
    /// The largest finite magnitude after the safety pipeline (N).
    pub peak_commanded_n: f64,
    /// The number of forces before the safety pipeline that were not finite.
    pub not_finite: u64,
    /// The number of ticks that each local model served, by [`ServedBy`]'s number.
    pub served: [u64; ServedBy::ALL.len()],
    /// The age of the local model's last resync at each tick (s).
    pub model_age_s: Percentiles<f64>,
}

impl ForceReport {
    /// The models that served, with the share of ticks that each did, 0 to 1.
    pub fn shares(&self) -> impl Iterator<Item = (ServedBy, f64)> {
        let served = ServedBy::ALL.into_iter().zip(self.served).filter(|&(_, ticks)| ticks > 0);
        served.map(|(model, ticks)| (model, ticks as f64 / self.ticks as f64))
    }
}

/// The number of haptic ticks in each contact mode.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[allow(missing_docs)]
pub struct ContactReport {
    pub free: u64,
    pub stick: u64,
    pub slip: u64,
    pub lost: u64,
}

/// The contact of a tool with a shape over a run: most places, most pressure, area.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TouchReport {
    /// The largest number of places that touched at once.
    pub most_places: u16,
    /// The largest mean pressure (Pa).
    pub peak_pressure_pa: f64,
    /// The area at the largest force (m^2).
    pub area_at_peak_m2: f64,
}

/// The actions of the safety pipeline in a run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LimitReport {
    /// The number of commands that passed the pipeline.
    pub ticks: u64,
    /// The number of commands that at least one stage changed.
    pub limited: u64,
    /// The stages that acted, with the number of ticks on which they did.
    pub stages: Vec<(String, u64)>,
    /// The passivity ledger and the energy tank.
    pub energy: EnergyReport,
}

/// The passivity ledger and the energy tank; all zero without a command.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EnergyReport {
    /// The least balance of the ledger (J): negative is a deficit.
    pub least_j: f64,
    /// The balance of the ledger at the end (J).
    pub last_j: f64,
    /// The least energy in the tank (J).
    pub least_tank_j: f64,
}

impl LimitReport {
    /// The share of ticks on which at least one stage acted, 0 to 1.
    pub fn share(&self) -> f64 {
        if self.ticks == 0 { 0.0 } else { self.limited as f64 / self.ticks as f64 }
    }
}

/// The haptics of one device over a run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DeviceReport {
    /// The name of the device; empty for the only one.
    pub name: String,
    /// The resyncs of its local model.
    pub resyncs: ResyncReport,
    /// The force on its tool.
    pub force: ForceReport,
    /// The contact of its tool.
    pub contact: ContactReport,
    /// What its tool touched with, if it has a shape and has touched.
    pub touch: Option<TouchReport>,
    /// The actions of its safety pipeline.
    pub limits: LimitReport,
}

impl DeviceReport {
    /// True if nothing was told of it: it is elsewhere, beyond a link.
    pub fn is_empty(&self) -> bool {
        let ContactReport { free, stick, slip, lost } = self.contact;
        [self.force.ticks, self.limits.ticks, self.resyncs.jump_before_n.count, free, stick, slip, lost] == [0; 7]
    }
}

/// Gathers the reports above.
#[derive(Clone, Debug, Default)]
pub(super) struct HapticsCounter {
    jump_before: Magnitudes,
    jump_after: Magnitudes,
    resync_age: Distribution,
    model_age: Magnitudes,
    force: ForceReport,
    contact: ContactReport,
    touch: Option<TouchReport>,
    /// The largest force of a tool with a shape (N).
    peak_touch_n: f32,
    commands: u64,
    limited: u64,
    limits: [u64; LIMIT_BITS],
    energy: EnergyReport,
}

impl HapticsCounter {
    /// A counter for a run of any length, see [`Distribution::bounded`].
    pub(super) fn bounded() -> Self {
        let [jump_before, jump_after, model_age] = [(); 3].map(|()| Magnitudes::bounded());
        Self { jump_before, jump_after, model_age, resync_age: Distribution::bounded(), ..Self::default() }
    }

    pub(super) fn push_force(&mut self, sample: &ForceSample) {
        self.force.ticks += 1;
        self.force.served[usize::from(sample.served_by as u16)] += 1;
        self.model_age.push(sample.model_age_s);
        let magnitude = magnitude(sample.force_n);
        if magnitude.is_finite() {
            self.force.peak_n = self.force.peak_n.max(magnitude);
        } else {
            self.force.not_finite += 1;
        }
    }

    pub(super) fn push_command(&mut self, sample: &CommandSample) {
        self.commands += 1;
        let energy = &mut self.energy;
        let is_first = self.commands == 1;
        let least = |so_far: f64, now: f64| if is_first { now } else { so_far.min(now) };
        energy.least_j = least(energy.least_j, sample.energy_j);
        energy.least_tank_j = least(energy.least_tank_j, sample.tank_j);
        energy.last_j = sample.energy_j;
        self.limited += u64::from(sample.limits != 0);
        for (bit, count) in self.limits.iter_mut().enumerate() {
            *count += u64::from(sample.limits >> bit & 1);
        }
        let magnitude = magnitude(sample.force_n);
        if magnitude.is_finite() {
            self.force.peak_commanded_n = self.force.peak_commanded_n.max(magnitude);
        }
    }

    pub(super) fn push_contact(&mut self, sample: &ContactSample) {
        let ticks = match sample.mode {
            ContactMode::Free => &mut self.contact.free,
            ContactMode::Stick => &mut self.contact.stick,
            ContactMode::Slip => &mut self.contact.slip,
            ContactMode::Lost => &mut self.contact.lost,
        };
        *ticks += 1;
        // A point has no area.
        if sample.area_m2 > 0.0 {
            let touch = self.touch.get_or_insert_default();
            touch.most_places = touch.most_places.max(sample.count);
            touch.peak_pressure_pa = touch.peak_pressure_pa.max(sample.mean_pressure_pa().into());
            let force_n = sample.normal_force_n.hypot(sample.tangential_force_n);
            if force_n >= self.peak_touch_n {
                self.peak_touch_n = force_n;
                touch.area_at_peak_m2 = sample.area_m2.into();
            }
        }
    }

    pub(super) fn push_resync(&mut self, resync: &Resync) {
        self.jump_before.push(resync.jump_before_n);
        self.jump_after.push(resync.jump_after_n);
        self.resync_age.push(resync.age.0);
    }

    /// `names` are those of the limit bits, lowest first.
    pub(super) fn report(&self, name: String, names: &[String]) -> DeviceReport {
        let stage = |bit: usize| names.get(bit).cloned().unwrap_or_else(|| format!("bit {bit}"));
        let acted = self.limits.iter().enumerate().filter(|&(_, &count)| count > 0);
        DeviceReport {
            name,
            resyncs: ResyncReport {
                jump_before_n: self.jump_before.percentiles(),
                jump_after_n: self.jump_after.percentiles(),
                age_ns: self.resync_age.percentiles(),
            },
            force: ForceReport { model_age_s: self.model_age.percentiles(), ..self.force },
            contact: self.contact,
            touch: self.touch,
            limits: LimitReport {
                ticks: self.commands,
                limited: self.limited,
                stages: acted.map(|(bit, &count)| (stage(bit), count)).collect(),
                energy: self.energy,
            },
        }
    }
}
