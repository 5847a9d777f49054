//! The contact of a tool at the end of a haptic tick, and the places at which a tool with a shape touches.
//!
//! Each place is a record of its own, before the [`ContactSample`] of its tick: a record has 64 bytes.

use super::packing::{Packed, Packing, Recorded, packed, packed_field};
use crate::model::contact::ContactMode;
use crate::runtime::{Nanos, Record};

/// The contact at the end of one haptic tick, on the topic `/contact`.
///
/// # Real-time
/// A plain value: its methods are wait-free and real-time safe.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ContactSample {
    /// The end of the tick.
    pub time: Nanos,
    /// The mode of the contact.
    pub mode: ContactMode,
    /// The global triangle id; `u32::MAX` without one.
    pub triangle: u32,
    /// The barycentric weights of the triangle's second and third node; the first is one minus both.
    pub weights: [f64; 2],
    /// The outward unit normal that was used.
    pub normal: [f32; 3],
    /// The force along the normal, mean over the tick (N).
    pub normal_force_n: f32,
    /// The magnitude of the force across it (N).
    pub tangential_force_n: f32,
    /// The area over which a tool with a shape touches (m^2); zero for a point.
    pub area_m2: f32,
    /// The number of places that touch; of a point one at most.
    pub count: u16,
    /// The number of the device in the scene, from 0.
    pub device: u16,
}

impl ContactSample {
    /// The most places of a tick that are logged, those with the largest forces: a viewer draws no more, and a log of 1000
    /// ticks a second holds no more. [`count`](Self::count) has all of them.
    pub const MOST_POINTS: usize = 16;

    /// The kind of its channel.
    pub(super) const KIND: u16 = 2;

    /// The force along the normal over the area (Pa); zero without an area.
    pub fn mean_pressure_pa(&self) -> f32 {
        if self.area_m2 > 0.0 { self.normal_force_n / self.area_m2 } else { 0.0 }
    }

    pub(super) fn unpack(record: &Record, device: u16) -> Self {
        let from = &mut Packing::of(*record);
        Self {
            time: record.stamp,
            mode: Packed::unpack(from),
            triangle: Packed::unpack(from),
            weights: Packed::unpack(from),
            normal: Packed::unpack(from),
            normal_force_n: Packed::unpack(from),
            tangential_force_n: Packed::unpack(from),
            area_m2: Packed::unpack(from),
            count: f32::unpack(from) as u16,
            device,
        }
    }
}

impl From<ContactSample> for Record {
    fn from(r: ContactSample) -> Self {
        let mut to = Packing::new(r.time, ContactSample::KIND, r.device);
        r.mode.pack(&mut to);
        r.triangle.pack(&mut to);
        r.weights.pack(&mut to);
        r.normal.pack(&mut to);
        r.normal_force_n.pack(&mut to);
        r.tangential_force_n.pack(&mut to);
        r.area_m2.pack(&mut to);
        // The record's one small number is the mode; a float holds every count exactly.
        f32::from(r.count).pack(&mut to);
        to.record
    }
}

impl Recorded for ContactSample {
    fn time(&self) -> Nanos {
        self.time
    }

    fn records(&self) -> [Option<Record>; 2] {
        [None, Some((*self).into())]
    }
}

/// One of the places at which a tool with a shape touches at the end of a haptic tick, in the message of its
/// [`ContactSample`].
///
/// # Real-time
/// A plain value: its methods are wait-free and real-time safe.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ContactPointSample {
    /// The end of the tick.
    pub time: Nanos,
    /// The place (m).
    pub place_m: [f32; 3],
    /// The unit normal, from the surface to the tool.
    pub normal: [f32; 3],
    /// The force on the tool (N).
    pub force_n: [f32; 3],
    /// The global triangle id.
    pub triangle: u32,
    /// The mode of this place.
    pub mode: ContactMode,
    /// The number of the device in the scene, from 0.
    pub device: u16,
}

packed! { ContactPointSample on 7 { place_m, normal, force_n, triangle, mode } of device }

packed_field! {
    [f32; 3]: |at, value| value.into_iter().for_each(|part| part.pack(at)), std::array::from_fn(|_| f32::unpack(at));
}

impl ContactPointSample {
    /// The force along the normal and the magnitude of the force across it (N).
    pub fn normal_and_tangential_n(&self) -> [f32; 2] {
        let (f, n) = (self.force_n, self.normal);
        let along = f[0] * n[0] + f[1] * n[1] + f[2] * n[2];
        let [x, y, z] = std::array::from_fn(|axis| f[axis] - along * n[axis]);
        [along, (x * x + y * y + z * z).sqrt()]
    }
}

/// Places that wait for the contact of their tick.
///
/// A ring that was full has lost some of them, or the contact itself: what is left is never taken for another tick.
#[derive(Clone, Debug, Default)]
pub(crate) struct WaitingPoints(Vec<ContactPointSample>);

impl WaitingPoints {
    /// Adds a place; others of its device and of another tick have waited in vain.
    pub(crate) fn add(&mut self, point: ContactPointSample) {
        self.0.retain(|other| other.device != point.device || other.time == point.time);
        if self.0.iter().filter(|other| other.device == point.device).count() < ContactSample::MOST_POINTS {
            self.0.push(point);
        }
    }

    /// Takes those of `contact`, in the order in which they came.
    pub(crate) fn take(&mut self, contact: &ContactSample) -> Vec<ContactPointSample> {
        let mut own: Vec<_> = self.0.extract_if(.., |point| point.device == contact.device).collect();
        own.retain(|point| point.time == contact.time);
        own
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_count_survives_the_trip_through_a_record() {
        for count in [0, 1, 255, 4097, u16::MAX - 1, u16::MAX] {
            let sent = ContactSample { count, normal: [0.25, -0.0, f32::MIN_POSITIVE], ..ContactSample::default() };
            assert_eq!(ContactSample::unpack(&sent.into(), 0), sent);
        }
    }

    #[test]
    fn a_place_without_the_contact_of_its_tick_belongs_to_no_other() {
        let point = |time, device| ContactPointSample { time: Nanos(time), device, ..ContactPointSample::default() };
        let contact = |time, device| ContactSample { time: Nanos(time), device, ..ContactSample::default() };
        let mut waiting = WaitingPoints::default();
        waiting.add(point(1, 0));
        waiting.add(point(1, 1));
        // The contact of tick 1 of device 0 was lost, and the places of tick 2.
        assert_eq!(waiting.take(&contact(2, 0)), []);
        assert_eq!(waiting.take(&contact(1, 0)), [], "too late");
        assert_eq!(waiting.take(&contact(1, 1)), [point(1, 1)]);
        waiting.add(point(3, 0));
        (0..20).for_each(|_| waiting.add(point(4, 0)));
        assert_eq!(waiting.take(&contact(4, 0)), [point(4, 0); ContactSample::MOST_POINTS]);
        assert_eq!(waiting.take(&contact(4, 0)), []);
    }

    #[test]
    fn a_force_has_a_part_along_the_normal_and_one_across() {
        let point = ContactPointSample { normal: [0.0, 0.6, 0.8], force_n: [3.0, 1.2, 1.6], ..Default::default() };
        let [normal, tangential] = point.normal_and_tangential_n();
        assert!((normal - 2.0).abs() < 1e-6 && (tangential - 3.0).abs() < 1e-6, "{normal} {tangential}");
        let contact = ContactSample { normal_force_n: 2.0, area_m2: 4e-6, ..ContactSample::default() };
        assert!((contact.mean_pressure_pa() - 5e5).abs() < 1.0);
        assert_eq!(ContactSample { area_m2: 0.0, ..contact }.mean_pressure_pa(), 0.0);
    }
}
