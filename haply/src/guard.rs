//! What the events channel has said about the device: may it exert a force now?
//!
//! | event | fault | until |
//! | --- | --- | --- |
//! | `ebrake_triggered` | `SafetyStop(EmergencyBrake)` | `ebrake_released` |
//! | `fod_stage_changed` up | `SafetyStop(Other)` | `fod_stage_changed` down |
//! | `stall_detected` | `SafetyStop(Stall)` | [`PAUSE`] without another event |
//! | `stability_ceiling` | `SafetyStop(Unstable)` | the same |
//! | an unknown safety event | `SafetyStop(Other)` | the same |
//! | `device-busy` | `Busy` | the same |
//! | `device-disconnected` | `Disconnected` | `device-connected` |
//! | the channel itself is lost | `SafetyStop(Other)` | it is back |
//!
//! What was latched is forgotten when both channels were connected again since: a service that was started again has no brake to
//! release. One of them alone says nothing about the brake.

use palpate::devices::{DeviceFault, SafetyStop};
use std::time::{Duration, Instant};

/// How long the force stays away after an event that nothing takes back.
pub(crate) const PAUSE: Duration = Duration::from_secs(1);

/// What has happened to the device or to the events channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum News {
    /// The emergency brake is on.
    EbrakeTriggered,
    /// It is off again.
    EbrakeReleased,
    /// The FOD stage went up to high risk (level warning and above).
    FodRaised,
    /// It went back to low risk (level info or notice).
    FodLowered,
    /// A motor stalled.
    Stall,
    /// The device reached its stability ceiling.
    StabilityCeiling,
    /// A safety event that was not known when this was written.
    UnknownSafety,
    /// The device is there.
    Connected,
    /// The device is gone.
    Disconnected,
    /// Another session has it.
    Busy,
    /// The channel itself is lost: whatever happens now is not heard of.
    ChannelLost,
    /// It is back.
    ChannelBack,
}

/// The state that the news have left.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Guard {
    is_braked: bool,
    is_guarded: bool,
    is_gone: bool,
    is_deaf: bool,
    /// Since the last event that latched something: simulation channel and events channel are new.
    renewed: [bool; 2],
    pause: Option<(Instant, DeviceFault)>,
}

impl Guard {
    /// Takes one piece of news.
    pub(crate) fn take(&mut self, news: News, now: Instant) {
        if matches!(news, News::EbrakeTriggered | News::FodRaised | News::Disconnected) {
            self.renewed = [false; 2];
        }
        match news {
            News::ChannelLost => self.is_deaf = true,
            News::ChannelBack => {
                self.is_deaf = false;
                self.renewed[1] = true;
                self.forget_another_service();
            }
            News::EbrakeTriggered => self.is_braked = true,
            News::EbrakeReleased => self.is_braked = false,
            News::FodRaised => self.is_guarded = true,
            News::FodLowered => self.is_guarded = false,
            News::Disconnected => self.is_gone = true,
            News::Connected => self.is_gone = false,
            News::Stall => self.pause(now, DeviceFault::SafetyStop(SafetyStop::Stall)),
            News::StabilityCeiling => self.pause(now, DeviceFault::SafetyStop(SafetyStop::Unstable)),
            News::UnknownSafety => self.pause(now, DeviceFault::SafetyStop(SafetyStop::Other)),
            News::Busy => self.pause(now, DeviceFault::Busy),
        }
    }

    fn pause(&mut self, now: Instant, fault: DeviceFault) {
        self.pause = Some((now + PAUSE, fault));
    }

    /// The simulation channel is connected again.
    pub(crate) fn reconnected(&mut self) {
        self.renewed[0] = true;
        self.forget_another_service();
    }

    fn forget_another_service(&mut self) {
        if self.renewed == [true; 2] {
            (self.is_braked, self.is_guarded, self.is_gone) = (false, false, false);
        }
    }

    /// Why there may be no force now.
    pub(crate) fn fault(&mut self, now: Instant) -> Option<DeviceFault> {
        if self.pause.is_some_and(|(until, _)| now >= until) {
            self.pause = None;
        }
        if self.is_gone {
            Some(DeviceFault::Disconnected)
        } else if self.is_braked {
            Some(DeviceFault::SafetyStop(SafetyStop::EmergencyBrake))
        } else if self.is_guarded || self.is_deaf {
            Some(DeviceFault::SafetyStop(SafetyStop::Other))
        } else {
            self.pause.map(|(_, fault)| fault)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stop(kind: SafetyStop) -> DeviceFault {
        DeviceFault::SafetyStop(kind)
    }

    #[test]
    fn every_event_stops_the_force_and_what_ends_it_lets_it_back() {
        let now = Instant::now();
        for (stop, end, fault) in [
            (News::EbrakeTriggered, News::EbrakeReleased, stop(SafetyStop::EmergencyBrake)),
            (News::FodRaised, News::FodLowered, stop(SafetyStop::Other)),
            (News::Disconnected, News::Connected, DeviceFault::Disconnected),
            (News::ChannelLost, News::ChannelBack, stop(SafetyStop::Other)),
        ] {
            let mut guard = Guard::default();
            assert_eq!(guard.fault(now), None);
            guard.take(stop, now);
            assert_eq!(guard.fault(now + 100 * PAUSE), Some(fault), "{stop:?}");
            guard.take(end, now);
            assert_eq!(guard.fault(now), None, "{end:?}");
        }
    }

    #[test]
    fn what_nothing_takes_back_stops_the_force_for_a_while() {
        let now = Instant::now();
        for (news, fault) in [
            (News::Stall, stop(SafetyStop::Stall)),
            (News::StabilityCeiling, stop(SafetyStop::Unstable)),
            (News::UnknownSafety, stop(SafetyStop::Other)),
            (News::Busy, DeviceFault::Busy),
        ] {
            let mut guard = Guard::default();
            guard.take(news, now);
            guard.take(news, now + PAUSE / 2);
            assert_eq!(guard.fault(now + PAUSE), Some(fault));
            assert_eq!(guard.fault(now + 3 * PAUSE / 2), None);
        }
    }

    #[test]
    fn a_service_that_was_started_again_has_no_brake_to_release() {
        let now = Instant::now();
        let mut guard = Guard::default();
        guard.take(News::EbrakeTriggered, now);
        guard.take(News::Disconnected, now);
        // Check that one new connection alone, before or after, does not release a brake
        guard.reconnected();
        assert_eq!(guard.fault(now), Some(DeviceFault::Disconnected));
        guard.take(News::ChannelLost, now);
        guard.take(News::ChannelBack, now);
        assert_eq!(guard.fault(now), None);
        guard.take(News::EbrakeTriggered, now);
        guard.reconnected();
        assert_eq!(guard.fault(now), Some(stop(SafetyStop::EmergencyBrake)));
        guard.take(News::ChannelBack, now);
        assert_eq!(guard.fault(now), None);
    }
}
