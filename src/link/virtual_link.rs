//! A link that is simulated: what a network would do to messages, the same in every run.
//!
//! A line that is as wide as it is said to be takes packets of [`PACKET`] bytes, of the most urgent message first. A message of one packet
//! that is lost is lost. Of a longer one the packets that are lost are sent again, as a transport of whole messages does: each time that
//! takes one more round trip. What is repeated takes no room on the line. Over TCP messages go by several lines, as over a real link, short ones are
//! repeated too, and whatever comes later by the same line waits for them. Once a line has lost something it also sends no quicker than it has as a
//! rule, as BBR does: a model is then spread over the time between two.

use std::collections::{BTreeMap, VecDeque};
use std::ops::Range;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::{LINES, Lane, Transport};
use crate::random::uniform;
use crate::runtime::Nanos;

/// What fits into a packet (bytes).
const PACKET: usize = 1200;
/// A packet is sent so many times more at most.
const MOST_REPEATS: u32 = 8;
/// A message that is held back comes so much later at least.
const LEAST_BACK: Nanos = Nanos(1_000_000);
/// Over TCP a line knows its rate from so many round trips, as BBR does, and sends so much quicker to learn whether it could.
const KNOWN_FROM: f64 = 10.0;
const PROBES: f64 = 1.25;
/// Less urgent messages that wait for the line: of more, the oldest is dropped.
const MOST_WAITING: usize = 256;

/// The behaviour of a simulated link, in either direction: delay, loss, order, rate and outages.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Conditions {
    /// One way, at least.
    pub delay: Nanos,
    /// Up to so much more, evenly.
    pub jitter: Nanos,
    /// Share of packets that are lost.
    pub loss: f64,
    /// Share of messages that come twice.
    pub duplicate: f64,
    /// Share of messages that are held back for one more delay, so that later ones overtake them.
    pub reorder: f64,
    /// As over connections of TCP, one for each [line](Lane::lines): what comes by one comes in the order in which it went, and nothing that a
    /// repeat can bring is lost.
    pub tcp: bool,
    /// Bits per second that the line takes; all at once if absent.
    pub bits_per_s: Option<f64>,
    /// Times in which nothing comes through: from, and until.
    pub down: Vec<[Nanos; 2]>,
    /// For the numbers that all chance is drawn from.
    pub seed: u64,
}

/// A link between two sides, in one process.
#[derive(Debug)]
pub struct VirtualLink;

impl VirtualLink {
    /// Its two ends. Until the session [begins](Transport::begin) at one of them, everything arrives at once.
    pub fn ends(conditions: Conditions) -> [VirtualEnd; 2] {
        let ways = [0, 1].map(|way| Way::new(conditions.seed.wrapping_mul(2).wrapping_add(way)));
        let line = Arc::new(Mutex::new(Line { conditions, ways, has_begun: false }));
        [0, 1].map(|side| VirtualEnd { line: Arc::clone(&line), side })
    }
}

/// One end of a [`VirtualLink`].
#[derive(Debug)]
pub struct VirtualEnd {
    line: Arc<Mutex<Line>>,
    side: usize,
}

impl VirtualEnd {
    fn line(&self) -> MutexGuard<'_, Line> {
        self.line.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Transport for VirtualEnd {
    fn send(&mut self, lane: Lane, message: &[u8], now: Nanos) {
        let side = self.side;
        let Line { conditions, ways, has_begun } = &mut *self.line();
        let way = &mut ways[side];
        if *has_begun {
            way.pump(conditions, now);
            way.wait(conditions, lane, message, now);
        } else {
            way.arrive(now, 0, message.to_vec());
        }
    }

    fn receive(&mut self, now: Nanos, message: &mut Vec<u8>) -> bool {
        let from = 1 - self.side;
        let Line { conditions, ways, .. } = &mut *self.line();
        let way = &mut ways[from];
        way.pump(conditions, now);
        let Some(first) = way.arriving.first_entry().filter(|first| first.key().0 <= now) else { return false };
        *message = first.remove();
        true
    }

    fn begin(&mut self) {
        self.line().has_begun = true;
    }
}

#[derive(Debug)]
struct Line {
    conditions: Conditions,
    ways: [Way; 2],
    has_begun: bool,
}

/// One of its two directions.
#[derive(Debug)]
struct Way {
    seed: u64,
    /// Numbers that have been drawn.
    drawn: u64,
    /// The most urgent first.
    lanes: [VecDeque<Waiting>; Lane::COUNT],
    /// When the line takes the next packet.
    free_at: Nanos,
    /// By time, and by number where times are equal.
    arriving: BTreeMap<(Nanos, u64), Vec<u8>>,
    arrived: u64,
    lines: [Paced; LINES],
    /// Messages that had to go.
    sent: u64,
}

/// What TCP knows of a line.
#[derive(Clone, Copy, Debug, Default)]
struct Paced {
    /// When the latest of what goes by it comes.
    latest: Nanos,
    /// The mean of what went by it lately (bytes/s), and when it was taken.
    rate: f64,
    at: Nanos,
    has_lost: bool,
}

impl Paced {
    /// The time from packet to packet of a message of so many bytes that goes now, by a line of that round trip.
    fn apart(&mut self, bytes: usize, now: Nanos, round_trip: Nanos) -> Nanos {
        let known_from = KNOWN_FROM * round_trip.max(LEAST_BACK).as_secs_f64();
        let passed = now.saturating_sub(self.at).as_secs_f64();
        self.rate = self.rate * (-passed / known_from).exp() + bytes as f64 / known_from;
        self.at = now;
        if self.has_lost { Nanos::from_secs_f64(PACKET as f64 / (PROBES * self.rate)) } else { Nanos::ZERO }
    }
}

#[derive(Debug)]
struct Waiting {
    message: Vec<u8>,
    lines: Range<usize>,
    since: Nanos,
    /// Bytes that have not gone yet.
    left: usize,
}

impl Way {
    fn new(seed: u64) -> Self {
        let (lanes, arriving) = Default::default();
        Self { seed, drawn: 0, lanes, free_at: Nanos::ZERO, arriving, arrived: 0, lines: Default::default(), sent: 0 }
    }

    fn draw(&mut self) -> f64 {
        self.drawn += 1;
        uniform(self.seed, self.drawn)
    }

    fn wait(&mut self, conditions: &Conditions, lane: Lane, message: &[u8], now: Nanos) {
        let lines = if conditions.tcp { lane.lines(self.sent) } else { 0..1 };
        self.sent += 1;
        let waiting = &mut self.lanes[lane as usize];
        if lane.keeps_the_newest() {
            // One that has begun to go goes on.
            waiting.retain(|other| other.left < other.message.len());
        }
        if waiting.len() >= MOST_WAITING {
            waiting.pop_front();
        }
        waiting.push_back(Waiting { message: message.to_vec(), lines, since: now, left: message.len() });
    }

    /// Lets go what has its turn until `now`.
    fn pump(&mut self, conditions: &Conditions, now: Nanos) {
        loop {
            let first = self.lanes.iter().filter_map(|lane| lane.front()).map(|first| first.since).min();
            let Some(at) = first.map(|first| first.max(self.free_at)).filter(|&at| at <= now) else { return };
            let is_there = |lane: &&mut VecDeque<Waiting>| lane.front().is_some_and(|first| first.since <= at);
            let Some(lane) = self.lanes.iter_mut().find(is_there) else { return };
            let Some(first) = lane.front_mut() else { return };
            let packet = first.left.min(PACKET);
            first.left -= packet;
            let bits = 8.0 * (packet * first.lines.len()) as f64;
            let takes = conditions.bits_per_s.map_or(0.0, |rate| bits / rate);
            self.free_at = at + Nanos::from_secs_f64(takes);
            if first.left == 0
                && let Some(gone) = lane.pop_front()
            {
                gone.lines.for_each(|line| self.carry(conditions, line, &gone.message));
            }
        }
    }

    /// The last packet of `message` has gone by that line.
    fn carry(&mut self, conditions: &Conditions, line: usize, message: &[u8]) {
        let gone = self.free_at;
        let is_down = conditions.down.iter().any(|&[from, until]| from <= gone && gone < until);
        let packets = message.len().div_ceil(PACKET).max(1);
        let round_trip = Nanos(conditions.delay.0.saturating_mul(2).saturating_add(conditions.jitter.0));
        let apart = if conditions.tcp { self.lines[line].apart(message.len(), gone, round_trip) } else { Nanos::ZERO };
        let after = |packet: usize, repeats: u32| {
            Nanos(apart.0.saturating_mul(packet as u64).saturating_add(round_trip.0.saturating_mul(repeats.into())))
        };
        let mut lost: Vec<usize> = (0..packets).filter(|_| self.draw() < conditions.loss).collect();
        self.lines[line].has_lost |= !lost.is_empty();
        // When all of them are through, and how often one was sent again.
        let (mut through, mut repeats) = (after(packets - 1, 0), 0);
        while (packets > 1 || conditions.tcp)
            && repeats < MOST_REPEATS
            && let Some(&last) = lost.last()
        {
            repeats += 1;
            through = through.max(after(last, repeats));
            lost.retain(|_| self.draw() < conditions.loss);
        }
        let copies = if self.draw() < conditions.duplicate { 2 } else { 1 };
        let back = if self.draw() < conditions.reorder { conditions.delay.max(LEAST_BACK) } else { Nanos::ZERO };
        for _ in 0..copies {
            let jitter = Nanos((conditions.jitter.0 as f64 * self.draw()) as u64);
            if lost.is_empty() && !is_down {
                let at = gone + conditions.delay + jitter + back + through;
                let at = if conditions.tcp { at.max(self.lines[line].latest) } else { at };
                self.arrive(at, line, message.to_vec());
            }
        }
    }

    fn arrive(&mut self, at: Nanos, line: usize, message: Vec<u8>) {
        self.arrived += 1;
        let latest = &mut self.lines[line].latest;
        *latest = at.max(*latest);
        self.arriving.insert((at, self.arrived), message);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: u64 = 1_000_000;

    /// When which of a hundred messages of so many bytes come, one sent every millisecond: (number, ms).
    fn arrivals(conditions: Conditions, bytes: usize) -> Vec<(u8, u64)> {
        let [mut here, mut there] = VirtualLink::ends(conditions);
        here.begin();
        let (mut message, mut came) = (Vec::new(), Vec::new());
        for ms in 0..2000 {
            let now = Nanos(ms * MS);
            if ms < 100 {
                here.send(Lane::Urgent, &vec![ms as u8; bytes], now);
            }
            while there.receive(now, &mut message) {
                came.push((message[0], ms));
            }
        }
        assert!(!here.receive(Nanos(u64::MAX), &mut message), "nothing goes the other way");
        came
    }

    #[test]
    fn a_message_takes_the_delay_and_the_time_of_its_bytes() {
        let delay = Nanos(14 * MS);
        let came = arrivals(Conditions { delay, ..Conditions::default() }, 100);
        assert_eq!(came, (0..100).map(|n| (n, u64::from(n) + 14)).collect::<Vec<_>>());
        // 1000 bytes at 4 Mbit/s take 2 ms.
        let narrow = arrivals(Conditions { delay, bits_per_s: Some(4e6), ..Conditions::default() }, 1000);
        assert_eq!(narrow, (0..100).map(|n| (n, 2 * (u64::from(n) + 1) + 14)).collect::<Vec<_>>());
    }

    #[test]
    fn chance_is_as_large_as_was_said_and_the_same_every_time() {
        let conditions =
            |seed| Conditions { loss: 0.2, duplicate: 0.3, jitter: Nanos(9 * MS), seed, ..Conditions::default() };
        let came = arrivals(conditions(1), 10);
        assert_eq!(came, arrivals(conditions(1), 10));
        assert_ne!(came, arrivals(conditions(2), 10));
        let mut numbers: Vec<u8> = came.iter().map(|&(n, _)| n).collect();
        numbers.sort_unstable();
        let all = numbers.len();
        numbers.dedup();
        // Three standard deviations of a binomial count.
        assert!(numbers.len().abs_diff(80) <= 12 && (all - numbers.len()).abs_diff(24) <= 14, "{came:?}");
        assert!(came.iter().all(|&(n, ms)| (u64::from(n)..=u64::from(n) + 9).contains(&ms)));
        assert!(came.windows(2).any(|pair| pair[0].0 > pair[1].0), "jitter overtakes");
    }

    #[test]
    fn a_long_message_comes_late_where_a_short_one_is_lost() {
        let conditions = Conditions { delay: Nanos(10 * MS), loss: 0.05, ..Conditions::default() };
        let short = arrivals(conditions.clone(), 100);
        let long = arrivals(conditions, 20 * PACKET);
        assert!(short.len() < 100 && short.iter().all(|&(n, ms)| ms == u64::from(n) + 10));
        assert_eq!(long.len(), 100);
        assert!(long.iter().any(|&(n, ms)| ms == u64::from(n) + 30), "one round trip more: {long:?}");
    }

    /// Check that nothing is lost over TCP, and that what goes by the same line as a message that is repeated waits for it, and no other.
    #[test]
    fn over_tcp_nothing_is_lost_and_only_what_goes_by_the_same_line_waits_for_a_loss() {
        let delay = Nanos(10 * MS);
        let mut came = arrivals(Conditions { delay, loss: 0.05, tcp: true, ..Conditions::default() }, 100);
        came.sort_unstable();
        assert_eq!(came.iter().map(|&(n, _)| n).collect::<Vec<_>>(), (0..100).collect::<Vec<u8>>());
        let line = |n: u8| Lane::Urgent.lines(n.into()).start;
        let (mut late, mut waiting, mut latest) = (0, 0, [0; LINES]);
        for (n, ms) in came {
            let at_best = (u64::from(n) + 10).max(latest[line(n)]);
            late += usize::from(ms == u64::from(n) + 30);
            waiting += usize::from(ms == at_best && ms > u64::from(n) + 10);
            assert!(ms == at_best || ms == u64::from(n) + 30 || ms == u64::from(n) + 50, "{n} comes after {ms} ms");
            latest[line(n)] = ms;
        }
        assert!(late > 0 && waiting > late, "{late} {waiting}");
    }

    /// How long (ms) models of 20 packets take that go every 40 ms over TCP, in increasing order, but for those of the first second.
    fn models_take(loss: f64) -> Vec<u64> {
        let [mut here, mut there] =
            VirtualLink::ends(Conditions { delay: Nanos(10 * MS), loss, tcp: true, ..Conditions::default() });
        here.begin();
        let (mut message, mut newest, mut took) = (Vec::new(), None, Vec::new());
        for ms in 0..9000 {
            let now = Nanos(ms * MS);
            if ms % 40 == 0 {
                here.send(Lane::Models, &[(ms / 40) as u8; 20 * PACKET], now);
            }
            while there.receive(now, &mut message) {
                if newest < Some(message[0]) {
                    newest = Some(message[0]);
                    took.push(ms - 40 * u64::from(message[0]));
                }
            }
        }
        took.drain(..25);
        took.sort_unstable();
        took
    }

    /// Check that a model over TCP is spread over the time between two once something was lost, and that of its copies one is there by then.
    #[test]
    fn over_tcp_a_model_takes_no_longer_than_it_is_spread_over_as_one_copy_loses_nothing() {
        let took = models_take(0.0);
        assert!(took.len() == 200 && took.iter().all(|&ms| ms == 10), "{took:?}");
        let took = models_take(0.01);
        let [half, most] = [0.5, 0.9].map(|share| took[(share * took.len() as f64) as usize]);
        assert!(took.len() > 190 && (30..50).contains(&half) && most <= half + 2, "{took:?}");
    }

    #[test]
    fn while_the_link_is_down_nothing_comes_through() {
        let down = vec![[Nanos(20 * MS), Nanos(40 * MS)]];
        let came = arrivals(Conditions { down, ..Conditions::default() }, 10);
        assert_eq!(came.iter().map(|&(n, _)| n).collect::<Vec<_>>(), (0..20).chain(40..100).collect::<Vec<u8>>());
    }

    #[test]
    fn an_urgent_message_passes_a_large_one_and_only_the_newest_model_waits() {
        let [mut here, mut there] = VirtualLink::ends(Conditions { bits_per_s: Some(9.6e6), ..Conditions::default() });
        here.begin();
        let mut came = Vec::new();
        for ms in 0..60 {
            let now = Nanos(ms * MS);
            if ms == 0 {
                here.send(Lane::Bulk, &[9; 20 * PACKET], now);
            }
            if ms < 5 {
                here.send(Lane::Models, &[ms as u8; 3 * PACKET], now);
            }
            if ms == 2 {
                here.send(Lane::Urgent, &[7; 10], now);
            }
            let mut message = Vec::new();
            while there.receive(now, &mut message) {
                came.push((message[0], ms));
            }
        }
        // A packet a millisecond: model 0 waits for the packet that went before it and is through when model 4 comes, 1 to 3 are
        // outdated by then, and the large one is last.
        assert_eq!(came.iter().map(|&(n, _)| n).collect::<Vec<_>>(), [7, 0, 4, 9], "{came:?}");
    }

    #[test]
    fn before_the_session_begins_everything_arrives_at_once() {
        let [mut here, mut there] =
            VirtualLink::ends(Conditions { delay: Nanos(MS), loss: 1.0, ..Conditions::default() });
        here.send(Lane::Bulk, &[1; 9000], Nanos::ZERO);
        let mut message = Vec::new();
        assert!(there.receive(Nanos::ZERO, &mut message) && message.len() == 9000);
    }
}
