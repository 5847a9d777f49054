//! The contact of a tick with the places that touch as one message.

use super::wire::{message, messages};
use crate::log::records::{ContactPointSample, ContactSample};
use crate::model::contact::ContactMode;
use crate::runtime::Nanos;

// A vector in world coordinates, where half the digits do.
message! { "palpate.Vector3f" => for [f32; 3] { x = 1 ([0]), y = 2 ([1]), z = 3 ([2]) } }

messages! {
    package "palpate";

    /// One of the places at which a tool with a shape touches.
    message ContactPoint {
        triangle: u32 = 1,
        place_m: [f32; 3] = 2,
        normal: [f32; 3] = 3,
        force_n: [f32; 3] = 4,
        /// For viewers that plot fields and do not compute, as the next one.
        normal_force_n: f32 = 5,
        tangential_force_n: f32 = 6,
        mode: ContactMode = 7,
    }

    /// `/contact`: the state of the contact.
    message Contact {
        time_ns: Nanos = 1,
        mode: ContactMode = 2,
        triangle: u32 = 3,
        weight_a: f64 = 4,
        weight_b: f64 = 5,
        weight_c: f64 = 6,
        /// Once of 64 bits, and the type of a field stays.
        normal: [f64; 3] = 7,
        normal_force_n: f32 = 8,
        tangential_force_n: f32 = 9,
        device: u16 = 10,
        /// Not in logs of version 2.
        count: Option<u16> = 11,
        area_m2: f32 = 12,
        mean_pressure_pa: f32 = 13,
        points: Vec<ContactPoint> = 14,
    }
}

impl Contact {
    /// The contact of a tick with its places.
    pub(crate) fn of(r: &ContactSample, points: &[ContactPointSample]) -> Self {
        let [b, c] = r.weights;
        Self {
            time_ns: r.time,
            mode: r.mode,
            triangle: r.triangle,
            weight_a: 1.0 - b - c,
            weight_b: b,
            weight_c: c,
            normal: r.normal.map(f64::from),
            normal_force_n: r.normal_force_n,
            tangential_force_n: r.tangential_force_n,
            device: r.device,
            count: Some(r.count),
            area_m2: r.area_m2,
            mean_pressure_pa: r.mean_pressure_pa(),
            points: points.iter().map(ContactPoint::from).collect(),
        }
    }

    /// The contact as it was recorded. Where the count is not known, a contact that touches has one place.
    pub(crate) fn sample(&self) -> ContactSample {
        let touches = matches!(self.mode, ContactMode::Stick | ContactMode::Slip);
        ContactSample {
            time: self.time_ns,
            mode: self.mode,
            triangle: self.triangle,
            weights: [self.weight_b, self.weight_c],
            normal: self.normal.map(|component| component as f32),
            normal_force_n: self.normal_force_n,
            tangential_force_n: self.tangential_force_n,
            area_m2: self.area_m2,
            count: self.count.unwrap_or(touches.into()),
            device: self.device,
        }
    }

    /// The places as they were recorded.
    pub(crate) fn points(&self) -> impl Iterator<Item = ContactPointSample> {
        self.points.iter().map(|point| ContactPointSample {
            time: self.time_ns,
            place_m: point.place_m,
            normal: point.normal,
            force_n: point.force_n,
            triangle: point.triangle,
            mode: point.mode,
            device: self.device,
        })
    }
}

impl From<&ContactPointSample> for ContactPoint {
    fn from(r: &ContactPointSample) -> Self {
        let [normal_force_n, tangential_force_n] = r.normal_and_tangential_n();
        Self {
            triangle: r.triangle,
            place_m: r.place_m,
            normal: r.normal,
            force_n: r.force_n,
            normal_force_n,
            tangential_force_n,
            mode: r.mode,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::log::messages::LogMessage;

    #[test]
    fn a_contact_of_a_log_before_there_were_shapes_has_one_place_if_it_touches() {
        for (mode, places) in [(ContactMode::Free, 0), (ContactMode::Stick, 1), (ContactMode::Slip, 1)] {
            let older = Contact { count: None, ..Contact::of(&ContactSample { mode, ..Default::default() }, &[]) };
            let mut bytes = Vec::new();
            older.encode(&mut bytes);
            let read = Contact::decode(&bytes).unwrap();
            assert_eq!((read.count, read.sample().count, read.sample().area_m2), (None, places, 0.0));
        }
        let known = ContactSample { mode: ContactMode::Stick, count: 0, ..ContactSample::default() };
        let mut bytes = Vec::new();
        Contact::of(&known, &[]).encode(&mut bytes);
        assert_eq!(Contact::decode(&bytes).unwrap().sample(), known);
    }

    #[test]
    fn contact_and_places_come_back_bit_for_bit() {
        let sample = ContactSample {
            time: Nanos(7),
            normal: [-0.0, 0.1, f32::MIN_POSITIVE],
            normal_force_n: 2.0,
            area_m2: 3e-6,
            count: 40,
            device: 1,
            ..ContactSample::default()
        };
        let point = |x| ContactPointSample {
            time: Nanos(7),
            place_m: [x, -0.0, 0.3],
            force_n: [x, 0.0, 1.0],
            triangle: 9,
            mode: ContactMode::Slip,
            device: 1,
            ..ContactPointSample::default()
        };
        let points = [point(0.1), point(-0.2)];
        let mut bytes = Vec::new();
        Contact::of(&sample, &points).encode(&mut bytes);
        let read = Contact::decode(&bytes).unwrap();
        assert_eq!((read.sample(), read.points().collect::<Vec<_>>()), (sample, points.to_vec()));
        assert_eq!(read.sample().normal.map(f32::to_bits), sample.normal.map(f32::to_bits));
    }
}
