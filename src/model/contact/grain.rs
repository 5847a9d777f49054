//! How much deeper than its elements show a tool sinks into a body.

use super::steady::Steady;
use crate::body::Stiffness;

/// Elements that are pressed together give way more than in proportion: by this times the square of what they show, over the whole depth.
const CRUSHED: f64 = 0.05;
/// Edges, in tool radii, from which on elements are coarse however much is touched: a sphere that touches so much is a third of its radius
/// deep, where Hertz' theory ends.
pub(super) const COARSE: [f64; 2] = [0.32, 0.36];

/// How coarse the body is at some place, for a tool that sinks in.
///
/// The elements show the sinking of a load that is spread over them, c F with c = 1 / (2 sqrt(pi) sigma E*), sigma the spread of
/// corners and elements together, and under large loads a little more. A sphere on a half space sinks in by
/// (9 F^2 / (16 R E*^2))^(1/3) (Hertz 1882). What the elements lack of that the tool sinks in beside them.
#[derive(Clone, Copy, Debug)]
pub(super) struct Grain {
    /// The body's contact modulus (Pa).
    pub(super) modulus: f64,
    /// sigma^2 (m^2), along any one direction.
    pub(super) variance: f64,
    /// The tool does not sink in deeper than this beside the elements (m).
    pub(super) most: f64,
    /// The mean edge around (m).
    pub(super) edge: f64,
}

impl Grain {
    /// That of the body as stiff as it is now.
    pub(super) fn stiffened(self, stiffness: Stiffness) -> Self {
        Self { modulus: self.modulus * stiffness.factor(), ..self }
    }

    /// The radius of what a sphere of `radius` (m) touches under `force` (N), in edges; zero where elements are coarse however much it is.
    pub(super) fn edges_touched(&self, radius: f64, force: f64) -> f64 {
        self.reach(radius, force) / self.edge * (1.0 - ramp(self.edge / radius, COARSE))
    }

    /// What a sphere of `radius` (m) touches under `force` (N), pi a^2 (m^2), never more than its section, however soft the body is.
    pub(super) fn touched(&self, radius: f64, force: f64) -> f64 {
        std::f64::consts::PI * self.reach(radius, force).min(radius).powi(2)
    }

    /// The radius a = (3 F R / (4 E*))^(1/3) (m) of what a sphere touches (Hertz 1882).
    fn reach(&self, radius: f64, force: f64) -> f64 {
        (0.75 * force * radius / self.modulus).cbrt()
    }

    /// What a sphere of `radius` (m) sinks in beside the elements while it is `steady`.
    pub(super) fn sinking(&self, radius: f64, Steady { force: steady, fineness, .. }: Steady) -> Sinking {
        let shown = 1.0 / (2.0 * (std::f64::consts::PI * self.variance).sqrt() * self.modulus);
        let hertz = (9.0 / (16.0 * radius * self.modulus * self.modulus)).cbrt();
        // The elements lack most where they show the share s of the depth, 2 - 3 s - 4 c s^2 = 0.
        let at_turn = ((9.0 + 32.0 * CRUSHED).sqrt() - 3.0) / (8.0 * CRUSHED);
        let root = at_turn * hertz / shown;
        let turn = root.powi(3);
        // A stranger's stiffness may be beyond every body: nothing is known of what the elements lack.
        if ![shown, hertz, turn].iter().all(|figure| figure.is_finite()) {
            return Sinking { shown: 0.0, hertz: 0.0, turn: 0.0, share: 0.0, limit: self.most, most: 0.0 };
        }
        let whole = Sinking { shown, hertz, turn, share: 1.0, limit: self.most, most: 0.0 };
        let lacking = whole.beyond(turn, root);
        let share = if steady > turn { (whole.beyond(steady, steady.cbrt()) / lacking).max(0.0) } else { 1.0 };
        let share = share * (1.0 - fineness);
        Sinking { share, most: share * lacking * whole.bend(share * lacking), ..whole }
    }

    /// How much of a load at that squared distance (m^2) counts as one here.
    pub(super) fn nearness(&self, squared: f64) -> f64 {
        (1.0 - squared / (16.0 * self.variance)).max(0.0).powi(2)
    }
}

/// How deep a tool sinks in beside the elements, by its force: what they lack, up to where they lack most. Beyond, where they
/// show more and more of it, all of it fades with the steady force and not with that of one step: a depth that shrank under a
/// growing force would have no single answer.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sinking {
    shown: f64,
    hertz: f64,
    turn: f64,
    share: f64,
    /// It does not sink in as deep as this (m).
    limit: f64,
    /// The largest depth (m).
    most: f64,
}

impl Sinking {
    /// The depth (m) under `force` (N); it grows with the force.
    pub(super) fn at(&self, force: f64) -> f64 {
        if force >= self.turn {
            return self.most;
        }
        let force = force.max(0.0);
        let lacking = self.share * self.beyond(force, force.cbrt());
        lacking * self.bend(lacking)
    }

    /// The largest depth (m).
    pub(super) fn most(&self) -> f64 {
        self.most
    }

    /// The depth around `force` (N), as linear in it.
    pub(super) fn tangent(&self, force: f64) -> Sunk {
        if force >= self.turn {
            return Sunk { offset: self.most, slope: 0.0 };
        }
        // At no force it would be infinitely steep.
        let force = force.max(1e-9 * self.turn);
        let root = force.cbrt();
        let crushed = 4.0 / 3.0 * CRUSHED * self.shown * (self.shown / self.hertz) * root;
        let lacking = self.share * self.beyond(force, root);
        let bend = self.bend(lacking);
        let slope = self.share * (2.0 / 3.0 * self.hertz / root - self.shown - crushed) * bend.powi(9);
        Sunk { offset: lacking * bend - slope * force, slope }
    }

    /// What elements that are coarse by all means lack (m) under `force` (N) with that cubic root, beyond the turn too, where they show more
    /// and more of it.
    fn beyond(&self, force: f64, root: f64) -> f64 {
        let [whole, shown] = [self.hertz * root * root, self.shown * force];
        if shown == 0.0 { whole } else { whole - shown - CRUSHED * shown * (shown / whole) }
    }

    /// How much of what is `lacking` (m) the tool sinks in: nearly all, but never as much as the limit. It comes near to that in a bend,
    /// x / (1 + (x / limit)^8)^(1/8): at a corner the surface, which the tool has left behind, would have to keep up with it from one
    /// step to the next, and its inertia would be felt as a jump.
    fn bend(&self, lacking: f64) -> f64 {
        (1.0 + (lacking / self.limit).powi(8)).sqrt().sqrt().sqrt().recip()
    }
}

/// 0 below the first bound, 1 above the second, smooth in between.
pub(super) fn ramp(value: f64, [low, high]: [f64; 2]) -> f64 {
    let share = ((value - low) / (high - low)).clamp(0.0, 1.0);
    share * share * (3.0 - 2.0 * share)
}

/// A depth (m) that is linear in the force (N), or by how much the surface closes less on a tool that sinks in so deep within a step (m/s),
/// linear in the impulse (N s).
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sunk {
    offset: f64,
    pub(super) slope: f64,
}

impl Sunk {
    /// Under that force or impulse.
    pub(super) fn at(&self, load: f64) -> f64 {
        self.offset + self.slope * load
    }

    /// The speed for what was the depth, in a step of `d` seconds.
    pub(super) fn over(&self, d: f64) -> Self {
        Self { offset: self.offset / d, slope: self.slope / (d * d) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of a sphere of 8 mm on elements of 9 mm and 16 kPa.
    fn sinking(steady: f64) -> Sinking {
        Grain { modulus: 16e3, variance: 64e-6, most: 3e-3, edge: 9e-3 }
            .sinking(8e-3, Steady { force: steady, ..Steady::default() })
    }

    #[test]
    fn nothing_sinks_in_where_the_stiffness_is_beyond_every_body() {
        for modulus in [f64::INFINITY, 1e300, 1e-300, 5e-324] {
            let grain = Grain { modulus, variance: 64e-6, most: 3e-3, edge: 9e-3 };
            let sinking = grain.sinking(8e-3, Steady { force: 1.0, ..Steady::default() });
            let Sunk { offset, slope } = sinking.tangent(1.0);
            assert_eq!([sinking.at(1.0), sinking.most(), offset, slope], [0.0; 4], "{modulus}");
        }
    }

    #[test]
    fn a_tool_sinks_in_deeper_under_more_force_and_less_where_elements_show_all_of_it() {
        let depths: Vec<f64> = (0..1000).map(|n| sinking(0.0).at(5e-3 * f64::from(n))).collect();
        assert!(depths.windows(2).all(|pair| pair[1] >= pair[0]) && depths[0] == 0.0);
        assert!((depths[60] - 2.3e-3).abs() < 2e-4, "{}", depths[60]);
        assert!(depths[999] <= 3e-3);
        // Under a steady force far beyond the turn the elements show all of it.
        assert_eq!(sinking(1e3).most(), 0.0);
    }

    /// Check that how fast it sinks in changes little by little: under 1 % more force by at most a tenth of the steepest where the
    /// most is near, and by nothing like that at once.
    #[test]
    fn a_tool_that_comes_near_to_the_most_does_not_stop_at_once() {
        let sinking = sinking(0.0);
        let slopes: Vec<f64> = (0..400).map(|n| sinking.tangent(0.05 * 1.01_f64.powi(n)).slope).collect();
        let largest = slopes.windows(2).map(|pair| (pair[0] - pair[1]) / pair[0]).fold(0.0, f64::max);
        assert!(slopes.windows(2).all(|pair| pair[1] <= pair[0]) && sinking.most() > 0.9 * 3e-3);
        assert!(largest < 0.1, "{largest}");
    }

    #[test]
    fn the_tangent_touches_the_depth_and_is_never_less() {
        let sinking = sinking(0.0);
        for n in 1..400 {
            let force = 1e-2 * f64::from(n);
            let tangent = sinking.tangent(force);
            assert!((tangent.at(force) - sinking.at(force)).abs() < 1e-15);
            assert!(
                (0..400).all(|m| tangent.at(1e-2 * f64::from(m)) >= sinking.at(1e-2 * f64::from(m)) - 1e-12),
                "{force}"
            );
        }
        assert!(sinking.tangent(0.0).offset.abs() < 1e-5);
    }
}
