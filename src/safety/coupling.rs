//! Virtual coupling: a spring and damper between device and simulated tool that keeps what is felt within what the device
//! renders stably, whatever the simulation does.
//!
//! A held force gives a sampled spring K T / 2 of negative damping, which the device's own damping b has to make good:
//! b > K T / 2 + |B| (Colgate and Schenkel 1997), with a delay t_d: b >= K (T / 2 + t_d) + |B|. An encoder of step s asks
//! for K <= min(2 b / T, 2 F_c / s), F_c the dry friction (Abbott and Okamura 2005). K is the most that the device feels: in
//! the fastest swing that the ticks know the simulated tool stands almost still by its mass m, so that
//! K = K_c K_m / (K_c + K_m) with K_m = 4 m / T^2 + K_l, K_l the body. Slow motion feels K_c K_l / (K_c + K_l), which is less.
//!
//! The body answers to the simulated tool one tick later, and what it answers within a tick is above all inertia: it keeps the
//! nodes that the tool moves at the tool's speed. An explicit exchange of the two multiplies an error by -m_e / m each tick, m_e
//! being the mass that the body puts on the tool: so the simulated tool has a mass m = [`MASS_RATIO`] m_e.

use super::force::Force;
use super::limits::DeviceLimits;

/// The condition above is met with this factor to spare.
pub const MARGIN: f64 = 1.5;
/// Mass of the simulated tool, as a multiple of what the body puts on it within a tick: an error halves each tick.
pub const MASS_RATIO: f64 = 2.0;
/// The share of the device's damping that the coupling's own damper may take of the margin.
const DAMPER_SHARE: f64 = 0.25;

/// Gains of a coupling.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coupling {
    /// K_c (N/m).
    pub stiffness_n_per_m: f64,
    /// B (N s/m).
    pub damping_n_s_per_m: f64,
}

/// A coupling and why it has these gains.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Design {
    /// The gains.
    pub coupling: Coupling,
    /// Stiffness of the body under the tool, K_l (N/m).
    pub local_n_per_m: f64,
    /// Mass of the simulated tool, m (kg).
    pub tool_kg: f64,
    /// What the device feels of slow motion (N/m).
    pub felt_n_per_m: f64,
    /// The most that it feels, K: in the fastest swing (N/m).
    pub fastest_n_per_m: f64,
    /// The largest stiffness that it may feel (N/m).
    pub limit_n_per_m: f64,
    /// b / (K (T / 2 + t_d) + B).
    pub margin: f64,
}

/// The largest stiffness (N/m) that `damping` b (N s/m) keeps passive beside a virtual damper B (N s/m), at a period T and a
/// delay t_d (s): (b - |B|) / (T / 2 + t_d).
///
/// # Real-time
/// Wait-free, real-time safe.
pub(crate) fn sampled_wall(damping: f64, virtual_damping: f64, period_s: f64, delay_s: f64) -> f64 {
    ((damping - virtual_damping.abs()) / (0.5 * period_s + delay_s)).max(0.0)
}

/// The largest stiffness (N/m) that an encoder of step s (m) leaves passive: min(2 b / T, 2 F_c / s). A friction or a step
/// of zero is one that is not known: its part says nothing.
pub(crate) fn quantised_wall(damping: f64, friction_n: f64, step_m: f64, period_s: f64) -> f64 {
    let by_friction = if friction_n > 0.0 && step_m > 0.0 { 2.0 * friction_n / step_m } else { f64::INFINITY };
    (2.0 * damping / period_s).min(by_friction)
}

/// The stiffest coupling of `device` to a body of stiffness `local_n_per_m` (N/m) that puts at most `body_kg` (kg) on the tool
/// within a tick of `period_s` (s), that leaves [`MARGIN`]. A body that the device could render alone gets the stiffest
/// spring that the device has.
pub(crate) fn design(device: &DeviceLimits, local_n_per_m: f64, body_kg: f64, period_s: f64) -> Design {
    let b = device.damping_n_s_per_m;
    let damper = (DAMPER_SHARE * b).min(device.max_damping_n_s_per_m);
    let limit = sampled_wall(b / MARGIN, damper, period_s, device.delay_s)
        .min(quantised_wall(b, device.friction_n, device.resolution_m, period_s) / MARGIN);
    let most = device.max_stiffness_n_per_m;
    let tool_kg = MASS_RATIO * body_kg;
    let held = 4.0 * tool_kg / (period_s * period_s) + local_n_per_m;
    let stiffness = if held > limit { (held * limit / (held - limit)).min(most) } else { most };
    let in_series = |other: f64| stiffness * other / (stiffness + other);
    Design {
        coupling: Coupling { stiffness_n_per_m: stiffness, damping_n_s_per_m: damper },
        local_n_per_m,
        tool_kg,
        felt_n_per_m: in_series(local_n_per_m),
        fastest_n_per_m: in_series(held),
        limit_n_per_m: limit,
        margin: b / (in_series(held) * (0.5 * period_s + device.delay_s) + damper),
    }
}

impl std::fmt::Display for Design {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Coupling { stiffness_n_per_m: k, damping_n_s_per_m: b } = self.coupling;
        write!(
            f,
            "K_c {k:.0} N/m, B {b:.3} N s/m, a tool of {:.1} g on a body of {:.0} N/m: felt {:.0} N/m, in the fastest swing {:.0} \
             of at most {:.0} N/m (K (T/2 + t_d) + B <= b with a margin of {:.2})",
            self.tool_kg * 1e3,
            self.local_n_per_m,
            self.felt_n_per_m,
            self.fastest_n_per_m,
            self.limit_n_per_m,
            self.margin
        )
    }
}

/// A tool with a mass that hangs on the device by a coupling.
///
/// Each tick it takes the force of the body from the tick before and an implicit Euler step of m x'' = K_c (X - x) +
/// B (X' - x') + f: no choice of gains makes it swing by itself, and the body cannot while it puts less than m on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CoupledTool {
    gains: Coupling,
    mass_kg: f64,
    tool: [f64; 3],
    velocity: [f64; 3],
    device: [f64; 3],
    /// The body's force on the tool in the last tick (N).
    force: Force,
    felt: Force,
}

impl CoupledTool {
    /// A tool at the device.
    pub(crate) fn new(design: &Design) -> Self {
        let zero = [0.0; 3];
        let Design { coupling: gains, tool_kg: mass_kg, .. } = *design;
        Self { gains, mass_kg, tool: zero, velocity: zero, device: zero, force: zero, felt: zero }
    }

    /// Puts device and tool at `position` (m), at rest and without a force.
    pub(crate) fn begin(&mut self, position: [f64; 3]) {
        let zero = [0.0; 3];
        (self.tool, self.device) = (position, position);
        (self.velocity, self.force, self.felt) = (zero, zero, zero);
    }

    /// As [`lead`](Self::lead), for a device that reaches `target` (m) after `ticks` ticks of `dt` (s): by an even part of
    /// the way.
    pub(crate) fn follow(&mut self, target: [f64; 3], ticks: u64, dt: f64) -> [f64; 3] {
        let part = ticks.max(1) as f64;
        let device = std::array::from_fn(|i| self.device[i] + (target[i] - self.device[i]) / part);
        self.lead(device, dt)
    }

    /// Where the simulated tool goes (m) while the device moves to `device` (m) within `dt` (s).
    pub(crate) fn lead(&mut self, device: [f64; 3], dt: f64) -> [f64; 3] {
        let Coupling { stiffness_n_per_m: k, damping_n_s_per_m: b } = self.gains;
        for (i, &place) in device.iter().enumerate() {
            let device_velocity = (place - self.device[i]) / dt;
            let pushed = self.mass_kg * self.velocity[i]
                + dt * (self.force[i] + k * (place - self.tool[i]) + b * device_velocity);
            self.velocity[i] = pushed / (self.mass_kg + dt * (b + k * dt));
            self.tool[i] += dt * self.velocity[i];
            self.felt[i] = k * (self.tool[i] - place) + b * (self.velocity[i] - device_velocity);
        }
        self.device = device;
        self.tool
    }

    /// The force on the device (N), once the body has answered with `force` on the simulated tool (N).
    pub(crate) fn feel(&mut self, force: Force) -> Force {
        self.force = force;
        self.felt
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_walls_are_those_of_the_literature() {
        // b = 1: 2000 N/m at 1 ms and 60 N/m at 33 ms.
        assert!((sampled_wall(1.0, 0.0, 1e-3, 0.0) - 2000.0).abs() < 1e-9);
        assert!((sampled_wall(1.0, 0.0, 1.0 / 30.0, 0.0) - 60.0).abs() < 1e-9);
        assert!((sampled_wall(1.0, 0.5, 1e-3, 0.5e-3) - 500.0).abs() < 1e-9);
        assert_eq!(sampled_wall(1.0, 2.0, 1e-3, 0.0), 0.0);
        assert!((quantised_wall(1.0, 0.01, 50e-6, 1e-3) - 400.0).abs() < 1e-9);
        assert_eq!(quantised_wall(1.0, 0.0, 50e-6, 1e-3), 2000.0);
    }

    /// The device's damping over what a sampled H needs of it, exactly (Colgate and Schenkel 1997):
    /// b > T / 2 / (1 - cos wT) Re{(1 - exp(-jwT)) H}, here for the coupling, the tool's mass and a body that answers a tick later.
    fn exact_margin(design: &Design, device_damping: f64, period_s: f64) -> f64 {
        type Complex = nalgebra::Complex<f64>;
        let Coupling { stiffness_n_per_m: k, damping_n_s_per_m: b } = design.coupling;
        let needed = (1..=2000).map(|n| {
            let angle = std::f64::consts::PI * f64::from(n) / 2000.0;
            let back = Complex::new(0.0, -angle).exp();
            let change = Complex::from(1.0) - back;
            let coupling = change * (b / period_s) + k;
            let tool = change * change * (design.tool_kg / (period_s * period_s)) + back * design.local_n_per_m;
            let felt = coupling * tool / (coupling + tool);
            0.5 * period_s / (1.0 - angle.cos()) * (change * felt).re
        });
        device_damping / needed.fold(0.0, f64::max)
    }

    #[test]
    fn every_design_keeps_its_margin_and_what_the_device_can_do() {
        for force in [3.3, 8.5] {
            for local in [1.0, 50.0, 160.0, 170.0, 1e3, 3e3] {
                for period in [1.0 / 4000.0, 1e-3, 2e-3] {
                    let device = DeviceLimits::of_force(force);
                    // What a body of that stiffness puts on the tool at least: its stiffness over a tick.
                    let design = design(&device, local, 1.5e-3 + local * period * period, period);
                    let told = format!("{local} N/m at {period} s: {design}");
                    assert!(design.margin >= MARGIN * (1.0 - 1e-12), "{told}");
                    assert!(design.coupling.stiffness_n_per_m <= device.max_stiffness_n_per_m, "{told}");
                    assert!(design.fastest_n_per_m <= design.limit_n_per_m * (1.0 + 1e-12), "{told}");
                    let exact = exact_margin(&design, device.damping_n_s_per_m, period);
                    assert!(exact >= MARGIN * (1.0 - 1e-9), "{exact} for {told}");
                    let delayed = super::design(&DeviceLimits { delay_s: 0.2e-3, ..device }, local, 1.5e-3, period);
                    assert!(delayed.margin >= MARGIN * (1.0 - 1e-12), "{delayed}");
                    assert!(delayed.coupling.stiffness_n_per_m <= design.coupling.stiffness_n_per_m, "{delayed}");
                }
            }
        }
    }

    #[test]
    fn a_held_tool_feels_both_springs_in_series_and_one_that_moves_freely_nothing() {
        let design = design(&DeviceLimits::of_force(3.3), 300.0, 2e-3, 1e-3);
        let mut tool = CoupledTool::new(&design);
        tool.begin([0.0; 3]);
        let mut felt = [0.0; 3];
        for n in 0..5000 {
            let depth = -5e-6 * f64::from(n.min(1000));
            let at = tool.lead([depth, 0.0, 0.0], 1e-3);
            felt = tool.feel([-300.0 * at[0], 0.0, 0.0]);
        }
        assert!((felt[0] - design.felt_n_per_m * 5e-3).abs() < 1e-6, "{felt:?}");
        tool.begin([0.0; 3]);
        let forces = (1..2000).map(|n| {
            tool.lead([1e-4 * f64::from(n), 0.0, 0.0], 1e-3);
            tool.feel([0.0; 3])[0].abs()
        });
        assert!(forces.last().unwrap() < 1e-9, "no drag in free space");
    }

    // Check the bound: a body of pure inertia, as stiff as a tick knows it.
    #[test]
    fn an_inertia_below_the_tools_mass_dies_out_and_one_above_grows() {
        let swing = |ratio: f64| {
            let design = design(&DeviceLimits::of_force(3.3), 0.0, 2e-3, 1e-3);
            let mut tool = CoupledTool::new(&design);
            tool.begin([0.0; 3]);
            let (mut at, mut speed, mut largest) = (0.0, 0.0, 0.0);
            for n in 0..60 {
                let device = if n < 3 { 1e-5 } else { 0.0 };
                let next = tool.lead([device, 0.0, 0.0], 1e-3)[0];
                let last = std::mem::replace(&mut speed, (next - at) / 1e-3);
                at = next;
                tool.feel([-ratio * design.tool_kg * (speed - last) / 1e-3, 0.0, 0.0]);
                largest = (speed - last).abs();
            }
            largest
        };
        assert!(swing(1.0 / MASS_RATIO) < 1e-4 && swing(1.2) > 1.0, "{} {}", swing(1.0 / MASS_RATIO), swing(1.2));
    }
}
