//! Where the global side answers who comes: whom it works with, and why not with others.

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
    /// Another haptic machine is being worked for.
    Busy,
    /// No, and why.
    No(String),
}

impl Answer {
    /// The version of hello and of this, then what it says.
    pub(crate) fn write(&self) -> Vec<u8> {
        let (kind, rest) = match self {
            Self::Welcome(peer) => (1, peer.to_le_bytes().to_vec()),
            Self::Wait => (2, Vec::new()),
            Self::Busy => (3, Vec::new()),
            Self::No(why) => (4, why.as_bytes().to_vec()),
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
        match kind {
            1 => Some(Self::Welcome(u64::from_le_bytes(rest.try_into().ok()?))),
            2 if rest.is_empty() => Some(Self::Wait),
            3 if rest.is_empty() => Some(Self::Busy),
            4 => Some(Self::No(String::from_utf8_lossy(rest).into_owned())),
            _ => None,
        }
    }
}

/// What is known of the haptic side, and what it is told.
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
    guest: Option<Guest>,
    /// Nobody has begun to work for the guest yet.
    is_new: bool,
    /// There is a session to start.
    is_ready: bool,
}

#[derive(Debug)]
struct Guest {
    hello: Hello,
    came: Instant,
    inbox: Arc<Inbox>,
    /// Why there is nothing for it.
    refused: Option<String>,
}

impl Guest {
    fn silent_for(&self) -> Duration {
        self.inbox.silent_for().unwrap_or_else(|| self.came.elapsed())
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
        let mut state = self.state();
        if let Some(guest) = &state.guest {
            if guest.hello.session == hello.session {
                return guest.refused.clone().map_or(Answer::Welcome(self.peer), Answer::No);
            }
            if guest.hello.machine != hello.machine && guest.refused.is_none() && guest.silent_for() < GONE_AFTER {
                return Answer::Busy;
            }
        }
        if !state.is_ready {
            return Answer::Wait;
        }
        let inbox = Arc::default();
        state.guest = Some(Guest { hello, came: Instant::now(), inbox, refused: None });
        (state.is_new, state.is_ready) = (true, false);
        self.changed.notify_all();
        Answer::Welcome(self.peer)
    }

    /// Who has come and is not worked for yet, if somebody comes within `time`.
    pub(crate) fn wait_for_guest(&self, time: Duration) -> Option<(Hello, Arc<Inbox>)> {
        let state = self.changed.wait_timeout_while(self.state(), time, |state| !state.is_new);
        let mut state = state.unwrap_or_else(PoisonError::into_inner).0;
        std::mem::take(&mut state.is_new).then_some(())?;
        state.guest.as_ref().map(|guest| (guest.hello.clone(), Arc::clone(&guest.inbox)))
    }

    /// There is a session to start again.
    pub(crate) fn is_ready(&self) {
        self.state().is_ready = true;
    }

    /// There is nothing for the guest, and why; if it comes again under another number it may be different.
    pub(crate) fn refuse(&self, why: String) {
        if let Some(guest) = &mut self.state().guest {
            guest.refused = Some(why);
        }
    }

    /// Forgets the guest: if it is still there, it is begun anew with it.
    pub(crate) fn forget(&self) {
        self.state().guest = None;
    }

    /// True if the guest has been silent for long.
    pub(crate) fn is_alone(&self) -> bool {
        self.state().guest.as_ref().is_none_or(|guest| guest.silent_for() >= ENDS_AFTER)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said(hello: &Hello) -> Vec<u8> {
        let mut bytes = Vec::new();
        hello.write(&mut bytes);
        bytes
    }

    #[test]
    fn answers_come_back_as_they_were_given_and_others_are_none() {
        for answer in [Answer::Welcome(7), Answer::Wait, Answer::Busy, Answer::No("the scene has `a` here".to_owned())]
        {
            assert_eq!(Answer::read(&answer.write()), Some(answer));
        }
        let cut = Answer::Welcome(7).write();
        assert!((0..cut.len()).all(|length| Answer::read(&cut[..length]).is_none()));
        let Some(Answer::No(why)) = Answer::read(&[9, 9, 1]) else { panic!("of another version") };
        assert!(why.contains("version 2313"), "{why}");
    }

    #[test]
    fn one_machine_at_a_time_and_the_same_one_may_begin_anew() {
        let desk = Desk::new(Hello::default());
        let hello = |machine, session| said(&Hello { machine, session, ..Hello::default() });
        let welcome = Answer::Welcome(desk.peer);
        assert_eq!(desk.answer(&[]), Answer::Wait);
        assert_eq!(desk.answer(&hello(1, 10)), welcome);
        assert_eq!(desk.answer(&hello(1, 10)), welcome, "as often as it asks");
        assert_eq!(desk.answer(&hello(2, 20)), Answer::Busy);
        assert_eq!(desk.answer(&hello(1, 11)), Answer::Wait, "until another session is ready");
        assert_eq!(desk.wait_for_guest(Duration::ZERO).unwrap().0.session, 10);
        assert!(desk.wait_for_guest(Duration::ZERO).is_none());
        desk.is_ready();
        assert_eq!(desk.answer(&hello(1, 11)), welcome);
        desk.refuse("the tool is far away".to_owned());
        assert_eq!(desk.answer(&hello(1, 11)), Answer::No("the tool is far away".to_owned()));
        desk.is_ready();
        assert_eq!(desk.answer(&hello(2, 20)), welcome, "nobody works with it now");
        desk.forget();
        assert!(desk.is_alone());
    }

    #[test]
    fn garbage_and_another_scene_are_refused_by_name() {
        let desk = Desk::new(Hello { scene: "friction = 0.5".to_owned(), ..Hello::default() });
        let no = |question: &[u8]| match desk.answer(question) {
            Answer::No(why) => why,
            other => panic!("{other:?}"),
        };
        assert!(no(b"GET / HTTP/1.1").contains("no message of palpate's"));
        assert!(
            no(&said(&Hello { scene: "friction = 0.4".to_owned(), ..Hello::default() }))
                .contains("`friction = 0.4` here")
        );
        let mut other = said(&Hello::default());
        other[4] += 1;
        assert!(no(&other).contains("version"));
    }
}
