//! Stage 4: a tool that moves too fast to be held feels less and less.

/// The speeds of the tool between which the force fades.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ToolSpeed {
    /// Speed up to which the force passes as it is (m/s).
    pub fade_m_s: f64,
    /// Speed from which on there is no force (m/s).
    pub stop_m_s: f64,
}

impl Default for ToolSpeed {
    fn default() -> Self {
        Self { fade_m_s: 1.0, stop_m_s: 2.0 }
    }
}

/// The gain at `speed` (m/s): 1 up to the first limit, 0 from the second on, linear in between.
pub(crate) fn speed_gain(limits: ToolSpeed, speed: f64) -> f64 {
    if speed <= limits.fade_m_s {
        return 1.0;
    }
    // A speed that is no number is no reason to push.
    let gain = (limits.stop_m_s - speed) / (limits.stop_m_s - limits.fade_m_s);
    if gain > 0.0 { gain.min(1.0) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_force_fades_between_the_two_speeds_and_not_before() {
        let gains = [0.0, 1.0, 1.5, 2.0, 50.0, f64::INFINITY, f64::NAN].map(|v| speed_gain(ToolSpeed::default(), v));
        assert_eq!(gains, [1.0, 1.0, 0.5, 0.0, 0.0, 0.0, 0.0]);
    }
}
