//! Stage 6: a local model that nobody renews is trusted less and less.

/// The age at which a local model is too old to be trusted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ModelAge {
    /// Age up to which the model is trusted (ticks of the local group).
    pub max_ticks: f64,
    /// Further age over which the force fades to zero (ticks of the local group).
    pub fade_ticks: f64,
}

impl Default for ModelAge {
    /// 100 ms and 200 ms at 1 kHz.
    fn default() -> Self {
        Self { max_ticks: 100.0, fade_ticks: 200.0 }
    }
}

/// The gain of the stage: it falls with the age, and comes back over the time that it fades in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AgeFade {
    gain: f64,
}

impl Default for AgeFade {
    fn default() -> Self {
        Self { gain: 1.0 }
    }
}

impl AgeFade {
    /// The gain with a model `age` ticks old, `ticks` after the last: both are counted, not measured, so that a run can be
    /// repeated.
    pub(crate) fn advance(&mut self, limits: ModelAge, age: u32, ticks: f64) -> f64 {
        let trusted = (1.0 - (f64::from(age) - limits.max_ticks) / limits.fade_ticks).clamp(0.0, 1.0);
        self.gain = trusted.min(self.gain + ticks / limits.fade_ticks);
        self.gain
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_force_is_gone_200_ms_after_the_limit_and_comes_back_as_slowly() {
        let (limits, mut fade) = (ModelAge::default(), AgeFade::default());
        let gains: Vec<f64> = (0..=400).map(|age| fade.advance(limits, age, 1.0)).collect();
        assert!(gains[..=100].iter().all(|&gain| gain == 1.0));
        assert!((gains[200] - 0.5).abs() < 1e-12 && gains[299] > 0.0 && gains[300] == 0.0, "{gains:?}");
        assert_eq!(fade.advance(limits, 3, 1.0), 1.0 / 200.0, "a fresh model does not bring the force back at once");
        (0..199).for_each(|_| assert!(fade.advance(limits, 3, 1.0) <= 1.0));
        assert_eq!(fade.advance(limits, 3, 1.0), 1.0);
    }
}
