//! What waits for one browser: the newest picture, not all of them.

use std::collections::VecDeque;

use bytes::Bytes;
use serde_json::Value;

/// Blocks of samples that wait for a slow browser: three seconds of them.
const MOST_SAMPLES: usize = 60;

/// A message to a browser.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Outgoing {
    Text(String),
    Bytes(Bytes),
}

/// Messages for one browser. A newer picture takes the place of one that was not taken.
#[derive(Debug, Default)]
pub(crate) struct Outbox {
    /// The newest of each kind: the page has no use for what was said before it, and it can push out no other kind.
    texts: VecDeque<Value>,
    /// Topology, surface and tools, in this order.
    newest: [Option<Bytes>; 3],
    samples: VecDeque<Bytes>,
    /// True if the browser shows the stress of the body.
    pub(crate) shows_stress: bool,
    /// True if the same page has come again by another connection: this one is over.
    pub(crate) is_replaced: bool,
    /// Messages that were not sent because newer ones took their places.
    pub(crate) dropped: u64,
}

/// Which picture a message is.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Picture {
    Topology = 0,
    Surface = 1,
    Tools = 2,
}

impl Outbox {
    pub(crate) fn say(&mut self, message: Value) {
        let before = self.texts.len();
        self.texts.retain(|old| old["kind"] != message["kind"]);
        self.dropped += (before - self.texts.len()) as u64;
        self.texts.push_back(message);
    }

    pub(crate) fn show(&mut self, picture: Picture, bytes: Bytes) {
        let before = self.newest[picture as usize].replace(bytes);
        self.dropped += u64::from(before.is_some());
    }

    pub(crate) fn plot(&mut self, bytes: Bytes) {
        if self.samples.len() == MOST_SAMPLES {
            self.samples.pop_front();
            self.dropped += 1;
        }
        self.samples.push_back(bytes);
    }

    /// What is of a session that is over.
    pub(crate) fn forget(&mut self) {
        self.newest = Default::default();
        self.forget_samples();
    }

    /// Samples of another time than the browser shows now.
    pub(crate) fn forget_samples(&mut self) {
        self.samples.clear();
    }

    /// The next message to send.
    pub(crate) fn take(&mut self) -> Option<Outgoing> {
        if let Some(message) = self.texts.pop_front() {
            return Some(Outgoing::Text(message.to_string()));
        }
        let picture = self.newest.iter_mut().find_map(Option::take);
        picture.or_else(|| self.samples.pop_front()).map(Outgoing::Bytes)
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn a_browser_that_takes_nothing_for_a_minute_gets_the_newest_and_costs_no_more() {
        let mut outbox = Outbox::default();
        for n in 0_u32..3600 {
            outbox.say(json!({ "kind": "stats", "n": n }));
            outbox.show(Picture::Surface, Bytes::copy_from_slice(&n.to_le_bytes()));
            outbox.plot(Bytes::copy_from_slice(&n.to_le_bytes()));
        }
        let taken: Vec<_> = std::iter::from_fn(|| outbox.take()).collect();
        assert_eq!(taken.len(), 1 + 1 + MOST_SAMPLES);
        assert_eq!(taken[0], Outgoing::Text(json!({ "kind": "stats", "n": 3599 }).to_string()));
        assert_eq!(taken[1], Outgoing::Bytes(Bytes::copy_from_slice(&3599_u32.to_le_bytes())));
        assert_eq!(outbox.dropped, 3 * 3600 - taken.len() as u64);
    }

    #[test]
    fn what_is_said_once_is_not_pushed_out_by_what_is_said_every_second() {
        let mut outbox = Outbox::default();
        let role = |role: &str| json!({ "kind": "role", "role": role });
        outbox.say(role("watch"));
        outbox.say(json!({ "kind": "settings" }));
        outbox.say(role("hand"));
        (0..40).for_each(|n| outbox.say(json!({ "kind": "stats", "n": n })));
        let taken: Vec<_> = std::iter::from_fn(|| outbox.take()).collect();
        let expected = [json!({ "kind": "settings" }), role("hand"), json!({ "kind": "stats", "n": 39 })];
        assert_eq!(taken, expected.map(|message| Outgoing::Text(message.to_string())));
    }
}
