//! A tool whose axis is inside the body: each part of it touches where its shortest way out is.

use super::closest;
use super::extent::Extent;
use super::near::{Near, outward};
use super::swept::MAX_DEPTH;
use super::touch::{MOST_POINTS, Touch};
use super::triangle::interpolate;
use super::vicinity::Vicinity;
use crate::Vec3;

/// A long axis is asked for its way out at its ends and between them; that of a needle at no more places.
pub(super) const MOST_PARTS: usize = 32;

/// The surface around a tool.
#[derive(Clone, Copy)]
pub(super) struct Surroundings<'a> {
    pub(super) vicinity: &'a Vicinity,
    /// Of the vicinity, at the start of the step and at its end if nothing presses (m).
    pub(super) corners: &'a [[Vec3; 2]],
    pub(super) touch: &'a Touch,
    /// The ends of the tool's axis (m).
    pub(super) axis: [Vec3; 2],
}

impl Surroundings<'_> {
    /// Parts of the axis that are inside the body touch where they would come out, and nowhere else.
    ///
    /// `outs` is working memory; `passes` is true if the axis goes through the surface.
    pub(super) fn leave_inside(&self, places: &mut Vec<Near>, outs: &mut Vec<Option<Near>>, passes: bool) {
        // Places nearer to each other than nodes are would press the same ones.
        let apart = self.touch.shape.radius().max(self.touch.skin.mean_edge());
        let parts = ((self.axis[1] - self.axis[0]).norm() / apart).ceil().min(MOST_PARTS as f64);
        outs.clear();
        outs.extend([0.0, 1.0].map(|share| self.way_out(share)));
        if !passes && outs.iter().all(Option::is_none) {
            return;
        }
        outs.pop();
        outs.extend((1..=parts as usize).map(|part| self.way_out(part as f64 / parts)));
        places.retain(|near| {
            let at = near.share * parts;
            match [at.floor(), at.ceil()].map(|part| outs[part as usize].is_some()) {
                [true, true] => false,
                [false, false] => true,
                _ => self.way_out(near.share).is_none(),
            }
        });
        places.extend(outs.iter().flatten().take(MOST_POINTS - places.len()));
    }

    /// Where the part of the axis at `share` comes out of the body on the shortest way; `None` for one that is outside, or deeper than
    /// it is held for inside.
    pub(super) fn way_out(&self, share: f64) -> Option<Near> {
        let Self { vicinity, corners, touch, axis } = self;
        let (radius, point) = (touch.shape.radius(), axis[0] + (axis[1] - axis[0]) * share);
        let around_point = Extent::around(&[point]);
        let (mut front, mut behind, mut found) = (f64::INFINITY, radius + MAX_DEPTH, None);
        for (number, places) in vicinity.corners.iter().enumerate() {
            let corners = places.map(|place| corners[place as usize][1]);
            if Extent::around(&corners).apart_squared(&around_point) > behind * behind * (1.0 + 1e-8) {
                continue;
            }
            let weights = closest::weights(&corners, &point);
            let place = interpolate(&weights, &corners);
            let out = place - point;
            let across = (corners[1] - corners[0]).cross(&(corners[2] - corners[0]));
            let distance = out.norm();
            if out.dot(&across) <= 0.0 {
                front = front.min(distance);
            } else if distance < behind {
                (behind, found) = (distance, Some((number, weights, place, across)));
            }
        }
        let (number, weights, place, across) = found.filter(|_| behind < front * (1.0 - 1e-9))?;
        let normal = outward(&(point - place), &across, radius)?;
        let gap = -behind - vicinity.depth(number, &weights, touch) - radius;
        let starts = vicinity.corners[number].map(|place| corners[place as usize][0]);
        let (triangle, from) = (vicinity.triangles[number], interpolate(&weights, &starts));
        Some(Near { triangle, weights, from, place, normal, gap, share })
    }
}
