//! How many of each thing a scene may have: looked at first, before anything is read or made for them.

use super::super::device::field;
use super::super::{BodySpec, Scene};
use super::devices::MAX_DEVICES;
use crate::error::Error;

/// Each costs a record per haptic tick and device.
const MAX_PROBES: usize = 256;
/// What local actors may record (1/s); the buffers hold a quarter of a second of it at least.
const MAX_RECORDS_PER_S: f64 = 4e6;
/// Every node is asked whether it is in each.
const MAX_REGIONS: usize = 256;
/// A face of the largest cube.
const MAX_HELD: usize = 10_000;
/// A tick looks at all of them.
const MAX_FAULTS: usize = 256;
/// A change of the grip every 0.1 s for a quarter of an hour.
const MAX_GRIP_ROWS: usize = 10_000;
/// For lists of words: each word of them several times.
const MAX_WORDS: usize = 32;

impl Scene {
    /// Refuses more of anything than a run can have.
    pub(in crate::scene) fn check_counts(&self) -> Result<(), Error> {
        if self.devices.is_empty() || self.devices.len() > MAX_DEVICES {
            let message = format!("is given {} times, a scene has 1 to {MAX_DEVICES}", self.devices.len());
            return Err(Error::scene("device", message));
        }
        at_most("probe", self.probes.len(), MAX_PROBES)?;
        let records_per_s = self.probes.len() as f64 * self.local.rate_hz;
        if records_per_s > MAX_RECORDS_PER_S {
            let most = (MAX_RECORDS_PER_S / self.local.rate_hz).floor();
            let message = format!(
                "is given {} times, at local.rate_hz = {} at most {most} can be logged",
                self.probes.len(),
                self.local.rate_hz
            );
            return Err(Error::scene("probe", message));
        }
        if let Some(body) = &self.body {
            at_most("body.region", body.region_count(), MAX_REGIONS)?;
            match body {
                BodySpec::MassSpring(spec) => at_most("body.block.fixed", spec.block.fixed.len(), MAX_WORDS)?,
                BodySpec::Tetrahedra(spec) => at_most("body.fixed", spec.fixed.len(), MAX_WORDS)?,
            }
        }
        at_most("initial.hold", self.initial.as_ref().map_or(0, |initial| initial.hold.len()), MAX_HELD)?;
        at_most("safety.off", self.safety.off.len(), MAX_WORDS)?;
        for (index, device) in self.devices.iter().enumerate() {
            let counts = [
                ("fault", device.faults.len(), MAX_FAULTS),
                ("hand.grip", device.hand.grip.len(), MAX_GRIP_ROWS),
                ("plant.axes", device.plant.axes.len(), MAX_WORDS),
            ];
            for (name, count, most) in counts {
                at_most(&format!("{}.{name}", field(index, self.devices.len())), count, most)?;
            }
        }
        Ok(())
    }
}

fn at_most(field: &str, count: usize, most: usize) -> Result<(), Error> {
    if count <= most {
        return Ok(());
    }
    Err(Error::scene(field, format!("has {count} entries, a scene has at most {most}")))
}
