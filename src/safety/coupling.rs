//! Virtual coupling: a spring and damper between device and simulated tool that keeps what is felt within what the device
//! renders stably, whatever the simulation does.
//!
//! A held force gives a sampled spring K T / 2 of negative damping, which the device's own damping b has to make good:
//! b > K T / 2 + |B| (Colgate and Schenkel 1997), with a delay t_d: b >= K (T / 2 + t_d) + |B|. An encoder of step s asks
//! for K <= min(2 b / T, 2 F_c / s), F_c the dry friction (Abbott and Okamura 2005). K is what the device feels: the
//! coupling in series with the body, K = K_c K_l / (K_c + K_l).

use super::{DeviceLimits, Force};

/// The condition above is met with this factor to spare.
pub const MARGIN: f64 = 1.5;
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
    /// How stiff it is within one tick, masses and dampers included: what the simulated tool reckons with (N/m).
    pub tick_n_per_m: f64,
    /// What the device feels, K (N/m).
    pub felt_n_per_m: f64,
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
pub fn sampled_wall(damping: f64, virtual_damping: f64, period_s: f64, delay_s: f64) -> f64 {
    ((damping - virtual_damping.abs()) / (0.5 * period_s + delay_s)).max(0.0)
}

/// The largest stiffness (N/m) that an encoder of step s (m) leaves passive: min(2 b / T, 2 F_c / s). A friction or a step
/// of zero is one that is not known: its part says nothing.
///
/// # Real-time
/// Wait-free, real-time safe.
pub fn quantised_wall(damping: f64, friction_n: f64, step_m: f64, period_s: f64) -> f64 {
    let by_friction = if friction_n > 0.0 && step_m > 0.0 { 2.0 * friction_n / step_m } else { f64::INFINITY };
    (2.0 * damping / period_s).min(by_friction)
}

/// The stiffest coupling of `device` to a body of stiffness `local_n_per_m` (N/m) at period `period_s` that leaves
/// [`MARGIN`]. A body that the device could render alone gets the stiffest spring that the device has.
///
/// # Real-time
/// Wait-free, real-time safe.
pub fn design(device: &DeviceLimits, local_n_per_m: f64, period_s: f64) -> Design {
    let b = device.damping_n_s_per_m;
    let damper = (DAMPER_SHARE * b).min(device.max_damping_n_s_per_m);
    let limit = sampled_wall(b / MARGIN, damper, period_s, device.delay_s)
        .min(quantised_wall(b, device.friction_n, device.resolution_m, period_s) / MARGIN);
    let most = device.max_stiffness_n_per_m;
    let stiffness =
        if local_n_per_m > limit { (local_n_per_m * limit / (local_n_per_m - limit)).min(most) } else { most };
    let felt = stiffness * local_n_per_m / (stiffness + local_n_per_m);
    Design {
        coupling: Coupling { stiffness_n_per_m: stiffness, damping_n_s_per_m: damper },
        local_n_per_m,
        tick_n_per_m: local_n_per_m,
        felt_n_per_m: felt,
        limit_n_per_m: limit,
        margin: b / (felt * (0.5 * period_s + device.delay_s) + damper),
    }
}

impl std::fmt::Display for Design {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Coupling { stiffness_n_per_m: k, damping_n_s_per_m: b } = self.coupling;
        write!(
            f,
            "K_c {k:.0} N/m, B {b:.3} N s/m on a body of {:.0} N/m: felt {:.0} of at most {:.0} N/m (K (T/2 + t_d) + B <= b \
             with a margin of {:.2})",
            self.local_n_per_m, self.felt_n_per_m, self.limit_n_per_m, self.margin
        )
    }
}

/// A tool without mass that hangs on the device by a coupling.
///
/// Each tick it stands where coupling and body would balance if the body's force went on from its last value with its
/// stiffness within a tick: implicit in both springs, so no choice of gains makes it swing by itself while the body is less
/// than twice as stiff as that.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CoupledTool {
    gains: Coupling,
    tick_n_per_m: f64,
    tool: [f64; 3],
    device: [f64; 3],
    /// The body's force on the tool in the last tick (N).
    force: Force,
    felt: Force,
}

impl CoupledTool {
    /// A tool at the device.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn new(design: &Design) -> Self {
        let zero = [0.0; 3];
        let Design { coupling: gains, tick_n_per_m, .. } = *design;
        Self { gains, tick_n_per_m, tool: zero, device: zero, force: zero, felt: zero }
    }

    /// Puts device and tool at `position` (m), without a force.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn begin(&mut self, position: [f64; 3]) {
        let zero = [0.0; 3];
        (self.tool, self.device, self.force, self.felt) = (position, position, zero, zero);
    }

    /// As [`lead`](Self::lead), for a device that reaches `target` (m) after `ticks` ticks of `dt` (s): by an even part of
    /// the way.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn follow(&mut self, target: [f64; 3], ticks: u64, dt: f64) -> [f64; 3] {
        let part = ticks.max(1) as f64;
        let device = std::array::from_fn(|i| self.device[i] + (target[i] - self.device[i]) / part);
        self.lead(device, dt)
    }

    /// Where the simulated tool goes (m) while the device moves to `device` (m) within `dt` (s).
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn lead(&mut self, device: [f64; 3], dt: f64) -> [f64; 3] {
        let Coupling { stiffness_n_per_m: k, damping_n_s_per_m: b } = self.gains;
        // Reckoned from where the tool would be if it moved with the device: what moves freely is not held back, and what
        // lost its contact goes back to the device over some ticks, not in one.
        let (damper, local, from) = (b / dt, self.tick_n_per_m, self.tool);
        for i in 0..3 {
            let with_device = from[i] + device[i] - self.device[i];
            let pulled = k * device[i] + (damper + local) * with_device + self.force[i];
            self.tool[i] = pulled / (k + damper + local);
            self.felt[i] = k * (self.tool[i] - device[i]) + damper * (self.tool[i] - with_device);
        }
        self.device = device;
        self.tool
    }

    /// The force on the device (N), once the body has answered with `force` on the simulated tool (N).
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn feel(&mut self, force: Force) -> Force {
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

    #[test]
    fn every_design_keeps_its_margin_and_what_the_device_can_do() {
        for force in [3.3, 8.5] {
            for local in [1.0, 50.0, 160.0, 170.0, 1e3, 1e6] {
                for period in [1.0 / 4000.0, 1e-3, 2e-3] {
                    let device = DeviceLimits { delay_s: 0.2e-3, ..DeviceLimits::of_force(force) };
                    let design = design(&device, local, period);
                    let told = format!("{local} N/m at {period} s: {design}");
                    assert!(design.margin >= MARGIN * (1.0 - 1e-12), "{told}");
                    assert!(design.coupling.stiffness_n_per_m <= device.max_stiffness_n_per_m, "{told}");
                    assert!(design.felt_n_per_m <= design.limit_n_per_m * (1.0 + 1e-12), "{told}");
                }
            }
        }
    }

    #[test]
    fn a_held_tool_feels_both_springs_in_series_and_a_free_one_nothing() {
        let mut design = design(&DeviceLimits::of_force(3.3), 300.0, 1e-3);
        design.tick_n_per_m = 1500.0;
        let mut tool = CoupledTool::new(&design);
        tool.begin([0.0; 3]);
        let mut felt = [0.0; 3];
        for n in 0..2000 {
            let depth = -5e-6 * f64::from(n.min(1000));
            let at = tool.lead([depth, 0.0, 0.0], 1e-3);
            felt = tool.feel([-300.0 * at[0], 0.0, 0.0]);
        }
        assert!((felt[0] - design.felt_n_per_m * 5e-3).abs() < 1e-9, "{felt:?}");
        tool.begin([0.0; 3]);
        for n in 1..100 {
            tool.lead([1e-4 * f64::from(n), 0.0, 0.0], 1e-3);
            assert!(tool.feel([0.0; 3])[0].abs() < 1e-12, "no drag in free space");
        }
    }
}
