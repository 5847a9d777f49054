//! Where the global side answers who comes: whom it works with, and why not with others.

use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use palpate::link::Hello;

use crate::inbox::Inbox;
use crate::unique;

/// A haptic machine that has been silent for so long no longer keeps others out.
const GONE_AFTER: Duration = Duration::from_secs(1);
/// Nobody works any more for one that has been silent for so long.
const ENDS_AFTER: Duration = Duration::from_secs(10);

/// An answer to hello.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Answer {
    /// Models come; by whom, as a number.
    Welcome(u64),
    /// Ask again: what is asked for is being prepared.
    Wait,
    /// Ask again: the machines of these devices are waited for.
    WaitFor(String),
    /// Another haptic machine has this device.
    Taken(String),
    /// No, and why.
    No(String),
}

impl Answer {
    /// The version of hello and of this, then what it says.
    pub(crate) fn write(&self) -> Vec<u8> {
        let (kind, rest) = match self {
            Self::Welcome(peer) => (1, peer.to_le_bytes().to_vec()),
            Self::Wait => (2, Vec::new()),
            Self::WaitFor(devices) => (3, devices.as_bytes().to_vec()),
            Self::Taken(device) => (4, device.as_bytes().to_vec()),
            Self::No(why) => (5, why.as_bytes().to_vec()),
        };
        let mut bytes = Hello::VERSION.to_le_bytes().to_vec();
        bytes.push(kind);
        bytes.extend(rest);
        bytes
    }

    /// Reads what anybody sent; `None` if it is no answer. That of another version is no.
    pub(crate) fn read(bytes: &[u8]) -> Option<Self> {
        let (version, rest) = bytes.split_first_chunk::<2>()?;
        let version = u16::from_le_bytes(*version);
        if version != Hello::VERSION {
            return Some(Self::No(format!(
                "it speaks version {version} of the link, this is version {}",
                Hello::VERSION
            )));
        }
        let (kind, rest) = rest.split_first()?;
        let text = || String::from_utf8_lossy(rest).into_owned();
        match kind {
            1 => Some(Self::Welcome(u64::from_le_bytes(rest.try_into().ok()?))),
            2 if rest.is_empty() => Some(Self::Wait),
            3 => Some(Self::WaitFor(text())),
            4 => Some(Self::Taken(text())),
            5 => Some(Self::No(text())),
            _ => None,
        }
    }
}

/// What is known of the haptic machines, and what they are told.
#[derive(Debug)]
pub(crate) struct Desk {
    ours: Hello,
    /// Names this process.
    peer: u64,
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Debug, Default)]
struct State {
    /// No two have a device in common.
    guests: Vec<Guest>,
    /// What nobody has begun to do yet, in its order.
    arrivals: VecDeque<Arrival>,
    /// There is a session to start.
    is_ready: bool,
    /// The session of those that are seated is being started, which takes a while where its bases are made first.
    is_beginning: bool,
}

/// A haptic machine that has come.
#[derive(Clone, Debug)]
pub(crate) struct Guest {
    pub(crate) hello: Hello,
    pub(crate) inbox: Arc<Inbox>,
    /// When it asked last.
    asked: Instant,
    /// It is of the session that runs.
    is_seated: bool,
    /// Why there is nothing for it.
    refused: Option<String>,
}

/// What is to be done for machines that have come.
#[derive(Clone, Debug)]
pub(crate) enum Arrival {
    /// Begin a session: these have all of its devices.
    All(Vec<Guest>),
    /// This one takes the place of one before, in the session that runs for others too.
    Again(Guest),
}

impl Guest {
    fn silent_for(&self) -> Duration {
        let asked = self.asked.elapsed();
        self.inbox.silent_for().map_or(asked, |silent| silent.min(asked))
    }

    /// It is there, and something may be done for it.
    fn is_present(&self) -> bool {
        self.refused.is_none() && self.silent_for() < GONE_AFTER
    }

    fn has(&self, tool: usize) -> bool {
        self.hello.own_tools().any(|own| own == tool)
    }
}

impl Desk {
    /// Answers for a session that says of itself what `ours` does.
    pub(crate) fn new(ours: Hello) -> Self {
        let state = Mutex::new(State { is_ready: true, ..State::default() });
        Self { ours, peer: unique(), state, changed: Condvar::new() }
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Answers what somebody sent, and remembers who it was. Nothing at all is asked to learn how long an answer takes.
    pub(crate) fn answer(&self, question: &[u8]) -> Answer {
        if question.is_empty() {
            return Answer::Wait;
        }
        let hello = match Hello::read(question) {
            Ok(hello) => hello,
            Err(refused) => return Answer::No(format!("what came is {refused}")),
        };
        // In the words of the side that asks.
        if let Some(difference) = hello.difference(&self.ours) {
            return Answer::No(difference);
        }
        if hello.own_tools().next().is_none() {
            return Answer::No("it has none of the scene's devices".to_owned());
        }
        let mut state = self.state();
        let known = state.guests.iter_mut().find(|guest| guest.hello.session == hello.session);
        match known {
            Some(guest) => {
                guest.asked = Instant::now();
                if let Some(why) = &guest.refused {
                    return Answer::No(why.clone());
                }
                if guest.is_seated {
                    return if state.is_beginning { Answer::Wait } else { Answer::Welcome(self.peer) };
                }
            }
            None => {
                let is_another = |guest: &&Guest| guest.hello.machine != hello.machine && guest.is_present();
                let taken = |tool: &usize| state.guests.iter().filter(is_another).any(|guest| guest.has(*tool));
                if let Some(tool) = hello.own_tools().find(taken) {
                    return Answer::Taken(self.device(tool));
                }
                if !state.is_ready {
                    return Answer::Wait;
                }
                if self.admit(&mut state, hello) {
                    return Answer::Welcome(self.peer);
                }
            }
        }
        self.begin(&mut state)
    }

    /// Takes a machine in; those that had its devices before are gone. True if it takes the place of one of them.
    fn admit(&self, state: &mut State, hello: Hello) -> bool {
        let before = state.guests.extract_if(.., |other| hello.own_tools().any(|tool| other.has(tool)));
        let before: Vec<Guest> = before.collect();
        let goes_on = state.guests.iter().any(|other| other.is_seated && other.is_present());
        let has_the_same = matches!(&before[..], [one] if one.is_seated && one.hello.own_tools().eq(hello.own_tools()));
        let (is_seated, inbox, asked) = (goes_on && has_the_same, Arc::default(), Instant::now());
        let guest = Guest { hello, inbox, asked, is_seated, refused: None };
        if is_seated {
            state.arrivals.push_back(Arrival::Again(guest.clone()));
            self.changed.notify_all();
        } else if before.iter().any(|other| other.is_seated) {
            // What runs is over: its devices are no longer those of the machines that it was begun for.
            state.guests.iter_mut().for_each(|other| other.is_seated = false);
        }
        state.guests.push(guest);
        is_seated
    }

    /// Lets a session begin if all of its devices are there, unless one is being prepared; what the one that asks is told.
    fn begin(&self, state: &mut State) -> Answer {
        let waits = |guest: &&Guest| !guest.is_seated && guest.is_present();
        let has = |tool: usize| state.guests.iter().filter(waits).any(|guest| guest.has(tool));
        let lacking: Vec<String> =
            (0..self.ours.tools.len()).filter(|&tool| !has(tool)).map(|tool| self.device(tool)).collect();
        if !lacking.is_empty() {
            return Answer::WaitFor(lacking.join(" and "));
        }
        if !std::mem::take(&mut state.is_ready) {
            return Answer::Wait;
        }
        state.guests.retain(Guest::is_present);
        state.guests.iter_mut().for_each(|guest| guest.is_seated = true);
        state.is_beginning = true;
        state.arrivals.push_back(Arrival::All(state.guests.clone()));
        self.changed.notify_all();
        Answer::Wait
    }

    /// A device in words.
    fn device(&self, tool: usize) -> String {
        match self.ours.tools.get(tool).map(|(name, _)| name.as_str()) {
            Some("") | None => "the device".to_owned(),
            Some(name) => format!("device {name:?}"),
        }
    }

    /// What is to be done for machines that have come, if some come within `time`.
    pub(crate) fn wait_for_guests(&self, time: Duration) -> Option<Arrival> {
        let state = self.changed.wait_timeout_while(self.state(), time, |state| state.arrivals.is_empty());
        state.unwrap_or_else(PoisonError::into_inner).0.arrivals.pop_front()
    }

    /// The session that was to begin has begun: its machines are welcome.
    pub(crate) fn has_begun(&self) {
        self.state().is_beginning = false;
    }

    /// There is a session to start again.
    pub(crate) fn is_ready(&self) {
        self.state().is_ready = true;
    }

    /// There is nothing for the machines of the session that was to begin, and why; if they come again under another number it may be
    /// different.
    pub(crate) fn refuse(&self, why: &str) {
        let mut state = self.state();
        state.is_beginning = false;
        state.guests.iter_mut().for_each(|guest| guest.refused = Some(why.to_owned()));
    }

    /// Forgets all machines: with those that are still there it is begun anew.
    pub(crate) fn forget(&self) {
        self.state().guests.clear();
    }

    /// True if all that are of the session that runs have been silent for long.
    pub(crate) fn is_alone(&self) -> bool {
        self.state().guests.iter().filter(|guest| guest.is_seated).all(|guest| guest.silent_for() >= ENDS_AFTER)
    }
}

#[cfg(test)]
mod tests {
    use palpate::model::Pose;

    use super::*;

    fn said(hello: &Hello) -> Vec<u8> {
        let mut bytes = Vec::new();
        hello.write(&mut bytes);
        bytes
    }

    /// Of a scene with one device.
    fn lone() -> Hello {
        Hello { tools: vec![(String::new(), Some(Pose::default()))], ..Hello::default() }
    }

    /// What a machine says of that number and session which has some of two devices.
    fn one_of_two(machine: u64, session: u64, own: [bool; 2]) -> Hello {
        let tools = ["left", "right"].into_iter().zip(own);
        let tools = tools.map(|(name, is_here)| (name.to_owned(), is_here.then(Pose::default)));
        Hello { machine, session, tools: tools.collect(), ..Hello::default() }
    }

    /// The sessions of the machines that a session is to begin for.
    fn all(arrival: Option<Arrival>) -> Vec<u64> {
        let Some(Arrival::All(guests)) = arrival else { panic!("{arrival:?}") };
        guests.iter().map(|guest| guest.hello.session).collect()
    }

    #[test]
    fn answers_come_back_as_they_were_given_and_others_are_none() {
        let words = || "the scene has `a` here".to_owned();
        for answer in
            [Answer::Welcome(7), Answer::Wait, Answer::WaitFor(words()), Answer::Taken(words()), Answer::No(words())]
        {
            assert_eq!(Answer::read(&answer.write()), Some(answer));
        }
        let cut = Answer::Welcome(7).write();
        assert!((0..cut.len()).all(|length| Answer::read(&cut[..length]).is_none()));
        let Some(Answer::No(why)) = Answer::read(&[9, 9, 1]) else { panic!("of another version") };
        assert!(why.contains("version 2313"), "{why}");
    }

    #[test]
    fn one_machine_at_a_time_has_the_only_device_and_the_same_one_may_begin_anew() {
        let desk = Desk::new(lone());
        let hello = |machine, session| said(&Hello { machine, session, ..lone() });
        let welcome = Answer::Welcome(desk.peer);
        assert_eq!(desk.answer(&[]), Answer::Wait);
        assert_eq!(desk.answer(&hello(1, 10)), Answer::Wait, "until its session has begun");
        desk.has_begun();
        assert_eq!([(); 2].map(|()| desk.answer(&hello(1, 10))), [welcome.clone(), welcome], "as often as it asks");
        assert_eq!(desk.answer(&hello(2, 20)), Answer::Taken("the device".to_owned()));
        assert_eq!(desk.answer(&hello(1, 11)), Answer::Wait, "until another session is ready");
        assert_eq!(all(desk.wait_for_guests(Duration::ZERO)), [10]);
        assert!(desk.wait_for_guests(Duration::ZERO).is_none());
        desk.is_ready();
        assert_eq!(desk.answer(&hello(1, 11)), Answer::Wait);
        assert_eq!(all(desk.wait_for_guests(Duration::ZERO)), [11]);
        desk.refuse("the tool is far away");
        assert_eq!(desk.answer(&hello(1, 11)), Answer::No("the tool is far away".to_owned()));
        desk.is_ready();
        assert_eq!(desk.answer(&hello(2, 20)), Answer::Wait, "nobody works with it now");
        assert_eq!(all(desk.wait_for_guests(Duration::ZERO)), [20]);
        desk.forget();
        assert!(desk.is_alone());
    }

    #[test]
    fn a_session_begins_when_all_devices_are_there_and_a_third_machine_is_told_who_has_its_device() {
        let desk = Desk::new(one_of_two(0, 0, [true; 2]));
        let asks = |machine, session, own| desk.answer(&said(&one_of_two(machine, session, own)));
        let welcome = Answer::Welcome(desk.peer);
        let [left, right] = [[true, false], [false, true]];
        assert!(matches!(asks(1, 10, [false; 2]), Answer::No(why) if why.contains("none")));
        assert_eq!(asks(1, 10, left), Answer::WaitFor("device \"right\"".to_owned()));
        assert_eq!(asks(3, 30, left), Answer::Taken("device \"left\"".to_owned()));
        assert_eq!(asks(3, 30, [true; 2]), Answer::Taken("device \"left\"".to_owned()));
        assert_eq!(asks(2, 20, right), Answer::Wait);
        assert_eq!(all(desk.wait_for_guests(Duration::ZERO)), [10, 20]);
        assert_eq!([asks(1, 10, left), asks(2, 20, right)], [Answer::Wait, Answer::Wait], "it is not there yet");
        desk.has_begun();
        assert_eq!([asks(1, 10, left), asks(2, 20, right)], [welcome.clone(), welcome]);
        desk.is_ready();
        assert_eq!(asks(3, 30, right), Answer::Taken("device \"right\"".to_owned()));
    }

    /// Check that a machine that begins anew takes its place while the other one goes on, and that all begins anew if no other does.
    #[test]
    fn a_machine_takes_its_place_again_while_the_other_one_goes_on() {
        let desk = Desk::new(one_of_two(0, 0, [true; 2]));
        let asks = |machine, session, own| desk.answer(&said(&one_of_two(machine, session, own)));
        let [left, right] = [[true, false], [false, true]];
        asks(1, 10, left);
        asks(2, 20, right);
        assert_eq!(all(desk.wait_for_guests(Duration::ZERO)), [10, 20]);
        desk.has_begun();
        desk.is_ready();
        assert_eq!(asks(2, 21, right), Answer::Welcome(desk.peer));
        let again = desk.wait_for_guests(Duration::ZERO);
        assert!(matches!(&again, Some(Arrival::Again(guest)) if guest.hello.session == 21), "{again:?}");
        // It comes with both devices: what runs is over, once the other one is gone.
        assert_eq!(asks(2, 22, [true; 2]), Answer::Taken("device \"left\"".to_owned()));
        std::thread::sleep(GONE_AFTER + Duration::from_millis(100));
        assert_eq!(asks(2, 22, [true; 2]), Answer::Wait);
        assert_eq!(all(desk.wait_for_guests(Duration::ZERO)), [22]);
    }

    #[test]
    fn garbage_and_another_scene_are_refused_by_name() {
        let desk = Desk::new(Hello { scene: "friction = 0.5".to_owned(), ..lone() });
        let no = |question: &[u8]| match desk.answer(question) {
            Answer::No(why) => why,
            other => panic!("{other:?}"),
        };
        assert!(no(b"GET / HTTP/1.1").contains("no message of palpate's"));
        assert!(no(&said(&Hello { scene: "friction = 0.4".to_owned(), ..lone() })).contains("`friction = 0.4` here"));
        let mut other = said(&lone());
        other[4] += 1;
        assert!(no(&other).contains("version"));
    }
}
