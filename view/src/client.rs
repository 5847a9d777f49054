//! What waits for one browser: the newest picture, not all of them.

use std::collections::VecDeque;

use bytes::Bytes;

/// Blocks of samples that wait for a slow browser: three seconds of them.
const MOST_SAMPLES: usize = 60;
/// Texts that wait: a browser that takes none for so long is shown the newest.
const MOST_TEXTS: usize = 32;

/// A message to a browser.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Outgoing {
    Text(String),
    Bytes(Bytes),
}

/// Messages for one browser. A newer picture takes the place of one that was not taken.
#[derive(Debug, Default)]
pub(crate) struct Outbox {
    texts: VecDeque<String>,
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
    pub(crate) fn say(&mut self, text: String) {
        if self.texts.len() == MOST_TEXTS {
            self.texts.pop_front();
            self.dropped += 1;
        }
        self.texts.push_back(text);
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
        if let Some(text) = self.texts.pop_front() {
            return Some(Outgoing::Text(text));
        }
        let picture = self.newest.iter_mut().find_map(Option::take);
        picture.or_else(|| self.samples.pop_front()).map(Outgoing::Bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_browser_that_takes_nothing_for_a_minute_gets_the_newest_and_costs_no_more() {
        let mut outbox = Outbox::default();
        for n in 0_u32..3600 {
            outbox.say(n.to_string());
            outbox.show(Picture::Surface, Bytes::copy_from_slice(&n.to_le_bytes()));
            outbox.plot(Bytes::copy_from_slice(&n.to_le_bytes()));
        }
        let taken: Vec<_> = std::iter::from_fn(|| outbox.take()).collect();
        assert_eq!(taken.len(), MOST_TEXTS + 1 + MOST_SAMPLES);
        assert_eq!(taken[MOST_TEXTS - 1], Outgoing::Text("3599".into()));
        assert_eq!(taken[MOST_TEXTS], Outgoing::Bytes(Bytes::copy_from_slice(&3599_u32.to_le_bytes())));
        assert_eq!(outbox.dropped, 3 * 3600 - taken.len() as u64);
    }
}
