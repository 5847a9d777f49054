//! Boxes around places: what is quick to tell about how far things are apart.

use crate::Vec3;

/// The box around some places along the axes of the world: its least and its largest coordinates (m).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Extent {
    low: [f64; 3],
    high: [f64; 3],
}

impl Extent {
    /// Around these places.
    #[inline]
    pub(super) fn around<'a>(places: impl IntoIterator<Item = &'a Vec3>) -> Self {
        let [mut low, mut high] = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
        for place in places {
            for axis in 0..3 {
                // One instruction each, where `f64::min` looks for what is no number.
                low[axis] = if place[axis] < low[axis] { place[axis] } else { low[axis] };
                high[axis] = if place[axis] > high[axis] { place[axis] } else { high[axis] };
            }
        }
        Self { low, high }
    }

    /// Around both.
    #[inline]
    pub(super) fn and(&self, other: &Self) -> Self {
        let mut both = *self;
        for axis in 0..3 {
            if other.low[axis] < both.low[axis] {
                both.low[axis] = other.low[axis];
            }
            if other.high[axis] > both.high[axis] {
                both.high[axis] = other.high[axis];
            }
        }
        both
    }

    /// How far the boxes are apart, squared (m^2): no place of the one is nearer to one of the other.
    #[inline]
    pub(super) fn apart_squared(&self, other: &Self) -> f64 {
        let mut sum = 0.0;
        for axis in 0..3 {
            let [below, above] = [other.low[axis] - self.high[axis], self.low[axis] - other.high[axis]];
            let apart = if below > above { below } else { above };
            let apart = if apart > 0.0 { apart } else { 0.0 };
            sum += apart * apart;
        }
        sum
    }

    /// True if the box, grown by `distance` (m) along `axis`, meets the span of `coordinates`.
    #[inline]
    pub(super) fn is_within(&self, distance: f64, axis: usize, coordinates: &[f64]) -> bool {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for &coordinate in coordinates {
            low = if coordinate < low { coordinate } else { low };
            high = if coordinate > high { coordinate } else { high };
        }
        low <= self.high[axis] + distance && self.low[axis] - distance <= high
    }

    /// On which of its six sides all of these places are, a bit for each. What has one in common for all its corners is outside.
    #[inline]
    pub(super) fn sides(&self, [from, to]: &[Vec3; 2]) -> u8 {
        let mut sides = 0;
        for axis in 0..3 {
            let [a, b] = [from[axis], to[axis]];
            sides |= u8::from(a < self.low[axis] && b < self.low[axis]) << axis;
            sides |= u8::from(a > self.high[axis] && b > self.high[axis]) << (3 + axis);
        }
        sides
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boxes_are_as_far_apart_as_their_nearest_places() {
        let at = Vec3::new;
        let one = Extent::around(&[at(0.0, 0.0, 0.0), at(1.0, -2.0, 3.0)]);
        assert_eq!(one.apart_squared(&Extent::around(&[at(4.0, -6.0, 1.0)])), 25.0);
        assert_eq!(Extent::around(&[at(-1.0, 0.0, -2.0)]).apart_squared(&one), 5.0);
        assert_eq!(one.apart_squared(&one), 0.0);
        assert!(one.is_within(3.0, 0, &[4.0, 7.0]) && !one.is_within(2.9, 0, &[4.0, 7.0]));
        assert!(one.is_within(2.0, 1, &[-9.0, -4.0]) && one.is_within(0.0, 2, &[-9.0, 9.0]));
        assert_eq!(
            one.and(&Extent::around(&[at(2.0, 0.0, -1.0)])),
            Extent { low: [0.0, -2.0, -1.0], high: [2.0, 0.0, 3.0] }
        );
    }

    #[test]
    fn a_way_is_on_a_side_if_all_of_it_is() {
        let at = Vec3::new;
        let unit = Extent::around(&[Vec3::zeros(), Vec3::repeat(1.0)]);
        assert_eq!(unit.sides(&[at(-1.0, 0.5, 2.0), at(-2.0, 3.0, 3.0)]), 0b100_001);
        assert_eq!(unit.sides(&[at(-1.0, 0.5, 2.0), at(1.0, 3.0, 0.0)]), 0, "it may go through");
    }
}
