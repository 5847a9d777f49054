//! What a tool with a shape has pressed with lately, and how it meets the surface for it.

/// The time over which a force is a steady one (s).
const STEADY: f64 = 5e-3;

/// The radius of what a tool touches, in edges, below which elements are coarse, and above which they are fine. In between they stay what they
/// were: how the tool meets the surface changes the force by a few percent, and must not follow it to and fro.
const FINE: [f64; 2] = [1.4, 1.6];
/// The time in which the one goes over into the other (s).
const CHANGE: f64 = 30e-3;

/// The steady force, and how the tool meets the surface under it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Steady {
    /// The force that has pressed on the mean of the last milliseconds (N). Along a capsule as much of it as presses on a sphere's width.
    pub(crate) force: f64,
    /// How fine the elements are for what the tool touches, from 0 to 1: coarse ones are met by smoothed corners and as deep as they cannot
    /// show, fine ones as they are.
    pub(crate) fineness: f64,
    /// Where that goes: to 1 if true.
    pub(crate) is_fine: bool,
}

impl Steady {
    /// The radius of what is touched, in edges, from which on elements are fine.
    pub(super) const FINE: f64 = FINE[1];

    /// After a step of `d` seconds in which `force` (N) pressed.
    pub(super) fn follow(&mut self, force: f64, d: f64) {
        self.force += (force - self.force) * (d / STEADY).min(1.0);
    }

    /// Before a step of `d` seconds of a tool that touches so many `edges` around.
    pub(super) fn settle(&mut self, edges: f64, d: f64) {
        // On the way from one to the other the force may pass a border again.
        self.is_fine = edges > FINE[1] || (edges > FINE[0] && self.is_fine);
        let way = if self.is_fine { 1.0 - self.fineness } else { -self.fineness };
        self.fineness += way.clamp(-d / CHANGE, d / CHANGE);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn elements_stay_coarse_or_fine_between_the_borders_and_are_wholly_one_of_them_soon() {
        let after = |mut steady: Steady, edges: f64| {
            (0..100).for_each(|_| steady.settle(edges, 5e-4));
            steady
        };
        let fineness = [0.5, 1.5, 1.7, 1.5, 1.3].into_iter().scan(Steady::default(), |steady, edges| {
            *steady = after(*steady, edges);
            Some(steady.fineness)
        });
        assert_eq!(fineness.collect::<Vec<_>>(), [0.0, 0.0, 1.0, 1.0, 0.0]);
    }

    /// The force changes by a few percent on the way, and what is touched with it.
    #[test]
    fn a_change_goes_on_to_its_end() {
        let mut steady = Steady::default();
        (0..100).for_each(|n| steady.settle(if n == 0 { 1.65 } else { 1.5 }, 5e-4));
        assert_eq!(steady.fineness, 1.0);
    }

    #[test]
    fn a_change_takes_its_time() {
        let mut steady = Steady::default();
        steady.settle(3.0, 3e-3);
        assert!((steady.fineness - 0.1).abs() < 1e-12, "{steady:?}");
    }
}
