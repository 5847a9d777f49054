//! The places at which a tool with a shape touches, as records: those with the largest forces.

use crate::log::{ContactPointSample, ContactSample};
use crate::model::Vec3;
use crate::model::contact::{Contact, ContactPoint};
use crate::runtime::Nanos;

/// The places that are recorded.
const MOST: usize = ContactSample::MOST_POINTS;

/// Gives `take` a record for each of the places of a tick with the largest forces, the largest first.
///
/// # Real-time
/// Bounded by the number of places, and real-time safe: what is kept has its room on the stack.
pub(super) fn records(points: &[ContactPoint], time: Nanos, device: u16, mut take: impl FnMut(ContactPointSample)) {
    let (mut strongest, mut kept) = ([0; MOST], 0);
    for (index, point) in points.iter().enumerate() {
        let force = |index: usize| points[index].force.norm_squared();
        // Of equal ones the first stays.
        let place = strongest[..kept].partition_point(|&other| force(other) >= point.force.norm_squared());
        if place < MOST {
            kept = (kept + 1).min(MOST);
            strongest[place..kept].rotate_right(1);
            strongest[place] = index;
        }
    }
    strongest[..kept].iter().for_each(|&index| take(record(&points[index], time, device)));
}

/// How many places touch: those of a tool with a shape, or the one `contact` of a point.
pub(super) fn count(points: &[ContactPoint], contact: &Contact) -> u16 {
    match points.len() {
        0 => contact.is_touching().into(),
        places => u16::try_from(places).unwrap_or(u16::MAX),
    }
}

fn record(point: &ContactPoint, time: Nanos, device: u16) -> ContactPointSample {
    ContactPointSample {
        time,
        place_m: single(point.place),
        normal: single(point.normal),
        force_n: single(point.force),
        triangle: point.triangle,
        mode: point.mode,
        device,
    }
}

/// In single precision.
pub(super) fn single(vector: Vec3) -> [f32; 3] {
    vector.map(|component| component as f32).into()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn forces(points: &[ContactPoint]) -> Vec<(u32, f32)> {
        let mut all = Vec::new();
        records(points, Nanos(3), 2, |r| {
            assert_eq!((r.time, r.device), (Nanos(3), 2));
            all.push((r.triangle, r.force_n[2]));
        });
        all
    }

    #[test]
    fn the_largest_forces_are_recorded_and_no_more_than_there_is_room_for() {
        let point = |triangle, force| ContactPoint { triangle, force: Vec3::z() * force, ..ContactPoint::default() };
        assert_eq!(forces(&[]), []);
        let some = [point(0, 1.0), point(1, -3.0), point(2, 2.0), point(3, 1.0)];
        assert_eq!(forces(&some), [(1, -3.0), (2, 2.0), (0, 1.0), (3, 1.0)]);
        // In an order that is neither rising nor falling.
        let many: Vec<_> = (0..100).map(|i| point(i, f64::from(i * 37 % 100))).collect();
        let largest = forces(&many);
        assert_eq!(
            largest.iter().map(|(_, force)| *force as u32).collect::<Vec<_>>(),
            (84..100).rev().collect::<Vec<_>>()
        );
        assert!(largest.iter().all(|&(triangle, force)| triangle * 37 % 100 == force as u32));
    }
}
