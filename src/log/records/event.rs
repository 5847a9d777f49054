//! Text events: what a reader of the log should be told in words.

use crate::runtime::Event;
use crate::runtime::Nanos;

/// The gravity of an event.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(u16)]
pub enum Level {
    /// Worth knowing.
    #[default]
    Info = 0,
    /// The run went on, but not as it should.
    Warning = 1,
    /// Something failed.
    Error = 2,
}

impl Level {
    /// A short name for tables and logs.
    pub fn name(self) -> &'static str {
        match self {
            Self::Info => "info",
            Self::Warning => "warning",
            Self::Error => "error",
        }
    }
}

/// One event in words.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct TextEvent {
    /// The moment of the event, since the start of the run.
    pub time: Nanos,
    /// The gravity of the event.
    pub level: Level,
    /// The event in one line.
    pub message: String,
}

/// In the words of a restart.
const RESTARTED: &str = "restarted after a fault";

impl TextEvent {
    /// True if it tells that a rate group was started again.
    pub fn tells_restart(&self) -> bool {
        self.level == Level::Warning && self.message.contains(RESTARTED)
    }

    /// An event record in words; `group` is the name of the rate group it happened in.
    pub fn describe(event: &Event, group: &str) -> Self {
        let (level, message) = match event.code {
            Event::PANIC => (Level::Error, format!("{group}: actor {} panicked", event.detail)),
            Event::FAULT => (Level::Error, format!("{group}: an actor reported fault {}", event.detail)),
            Event::STOPPED => {
                (Level::Error, format!("{group}: stopped by its overrun policy, {} periods behind", event.detail))
            }
            Event::DEGRADED if event.detail == Event::RECOVERED => (Level::Info, format!("{group}: back to normal")),
            Event::DEGRADED => (Level::Warning, format!("{group}: degraded, cause {}", event.detail)),
            Event::RESTARTED => (Level::Warning, format!("{group}: {RESTARTED}, restart {}", event.detail)),
            Event::ABANDONED => {
                let waited = Nanos(event.detail);
                (Level::Error, format!("{group}: a release did not return within {waited}, its thread was left behind"))
            }
            Event::STARVED => {
                let waited = Nanos(event.detail);
                (Level::Warning, format!("{group}: a release overdue by {waited} gets too little of a processor"))
            }
            Event::WINDING_DOWN => {
                (Level::Info, format!("{group}: winding down, {} more periods to come to rest", event.detail))
            }
            Event::MODE if event.detail == Event::RECOVERED => (Level::Info, format!("{group}: back in normal mode")),
            Event::MODE => {
                (Level::Warning, format!("{group}: in degraded mode after an overrun of {} periods", event.detail))
            }
            Event::WATCHDOG if event.detail == Event::RECOVERED => {
                (Level::Info, format!("{group}: the device delivers again"))
            }
            Event::WATCHDOG => (
                Level::Warning,
                format!("{group}: the device is silent, the watchdog took over at release {}", event.detail),
            ),
            code => (Level::Warning, format!("{group}: event {}, detail {}", code.code(), event.detail)),
        };
        Self { time: event.stamp, level, message }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::runtime::EventCode;

    #[test]
    fn a_degraded_group_and_its_recovery_are_told_apart() {
        let mut event = Event { stamp: Nanos(5), group: 0, code: Event::DEGRADED, detail: 7 };
        let text = TextEvent::describe(&event, "local");
        assert_eq!((text.level, text.message.as_str()), (Level::Warning, "local: degraded, cause 7"));
        event.detail = Event::RECOVERED;
        let text = TextEvent::describe(&event, "local");
        assert_eq!((text.level, text.message.as_str()), (Level::Info, "local: back to normal"));
    }

    #[test]
    fn a_change_of_mode_and_of_the_watchdog_is_told_from_its_end() {
        let text = |code, detail| {
            let text = TextEvent::describe(&Event { stamp: Nanos(5), group: 0, code, detail }, "local");
            (text.level, text.message)
        };
        let degraded = "local: in degraded mode after an overrun of 3 periods".to_owned();
        assert_eq!(text(Event::MODE, 3), (Level::Warning, degraded));
        assert_eq!(text(Event::MODE, Event::RECOVERED), (Level::Info, "local: back in normal mode".to_owned()));
        let silent = "local: the device is silent, the watchdog took over at release 40".to_owned();
        assert_eq!(text(Event::WATCHDOG, 40), (Level::Warning, silent));
        assert_eq!(
            text(Event::WATCHDOG, Event::RECOVERED),
            (Level::Info, "local: the device delivers again".to_owned())
        );
    }

    #[test]
    fn a_restart_is_told_from_every_other_event() {
        let describe = |code| TextEvent::describe(&Event { stamp: Nanos(5), group: 1, code, detail: 2 }, "global");
        assert_eq!(describe(Event::RESTARTED).message, "global: restarted after a fault, restart 2");
        let codes = (0..20).map(EventCode::from);
        let restarts: Vec<_> = codes.filter(|code| describe(*code).tells_restart()).collect();
        assert_eq!(restarts, [Event::RESTARTED]);
    }

    #[test]
    fn a_panic_is_an_error_that_names_group_and_actor() {
        let event = Event { stamp: Nanos(5), group: 1, code: Event::PANIC, detail: 2 };
        let text = TextEvent::describe(&event, "global");
        assert_eq!((text.level, text.message.as_str()), (Level::Error, "global: actor 2 panicked"));
    }
}
