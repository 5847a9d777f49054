//! Where the threads of browsers and the one of the session meet. Locks here are held for moments, and by no real-time thread.

use std::sync::mpsc::Sender;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use bytes::Bytes;
use palpate::devices::PointerHandle;
use serde_json::{Value, json};

use crate::client::{Outbox, Picture};
use crate::guard::Token;
use crate::recent::Recent;
use crate::wish::Wish;

/// Browsers that are shown anything at a time.
pub(crate) const MOST_BROWSERS: usize = 4;

/// A browser that has shown the token.
#[derive(Debug)]
pub(crate) struct Browser {
    pub(crate) number: u64,
    /// By which its page is known when it comes again.
    key: Token,
    outbox: Mutex<Outbox>,
}

impl Browser {
    pub(crate) fn outbox(&self) -> MutexGuard<'_, Outbox> {
        locked(&self.outbox)
    }
}

#[derive(Debug, Default)]
struct State {
    browsers: Vec<Arc<Browser>>,
    entered: u64,
    /// The one whose pointer moves the tool.
    hand: Option<u64>,
    /// What a browser is told first: what is shown, its triangles and its newest surface.
    hello: Value,
    topology: Bytes,
    surface: Bytes,
    pointers: Vec<Option<PointerHandle>>,
    /// Where each pointer is, for the picture (m).
    targets: Vec<[f64; 3]>,
    /// Within which a pointer may be (m): low and high corner.
    bounds: [[f64; 3]; 2],
    is_over: bool,
    sent_bytes: u64,
}

/// Shared by all threads of a server.
pub(crate) struct Hub {
    pub(crate) token: Token,
    state: Mutex<State>,
    over: Condvar,
    wishes: Sender<(u64, Wish)>,
    pub(crate) recent: Mutex<Recent>,
}

/// What a session that begins brings.
pub(crate) struct Begun {
    pub(crate) hello: Value,
    pub(crate) topology: Bytes,
    pub(crate) pointers: Vec<Option<PointerHandle>>,
    pub(crate) homes: Vec<[f64; 3]>,
    pub(crate) bounds: [[f64; 3]; 2],
}

/// Whoever panicked while holding one of these left nothing half-done that another thread would trip over.
pub(crate) fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Hub {
    pub(crate) fn new(token: Token, wishes: Sender<(u64, Wish)>) -> Self {
        Self { token, state: Mutex::default(), over: Condvar::new(), wishes, recent: Mutex::default() }
    }

    /// Lets a browser in that knows the token; `None` if there are too many. A page that comes `again` takes the place that it had, and
    /// the tool if it held it: a connection that broke off may seem to be there for long.
    pub(crate) fn enter(&self, again: Option<&str>) -> Option<Arc<Browser>> {
        let state = &mut *locked(&self.state);
        let before = again.and_then(|key| state.browsers.iter().position(|browser| browser.key.is(key)));
        if before.is_none() && state.browsers.len() >= MOST_BROWSERS {
            return None;
        }
        let key = Token::new().ok()?;
        state.entered += 1;
        let browser = Arc::new(Browser { number: state.entered, key, outbox: Mutex::default() });
        let place = before.unwrap_or(state.browsers.len());
        if let Some(place) = before {
            let old = state.browsers.remove(place);
            old.outbox().is_replaced = true;
            if state.hand == Some(old.number) {
                state.hand = Some(browser.number);
            }
        }
        state.hand.get_or_insert(browser.number);
        greet(state, &browser);
        state.browsers.insert(place, Arc::clone(&browser));
        Some(browser)
    }

    /// Forgets a browser that has gone. The one that has waited longest is the hand then.
    pub(crate) fn leave(&self, browser: &Browser) {
        let state = &mut *locked(&self.state);
        state.browsers.retain(|other| other.number != browser.number);
        if state.hand == Some(browser.number) {
            state.hand = state.browsers.first().map(|first| first.number);
            if let Some(next) = state.browsers.first() {
                next.outbox().say(json!({ "kind": "role", "role": "hand" }));
            }
        }
    }

    /// Does what a browser wants, if it may.
    pub(crate) fn wish(&self, browser: u64, wish: Wish) {
        let state = &mut *locked(&self.state);
        let is_hand = state.hand == Some(browser);
        match wish {
            Wish::Enter { .. } => {}
            // A second visitor watches: what it says was said before it knew, or by a page that is not ours.
            Wish::Move { .. } | Wish::Change(_) | Wish::Restart {} if !is_hand => {}
            Wish::Move { device, to } => {
                let [low, high] = state.bounds;
                let to = std::array::from_fn(|axis| to[axis].clamp(low[axis], high[axis]));
                if let Some(Some(pointer)) = state.pointers.get_mut(device)
                    && pointer.point(to)
                    && let Some(target) = state.targets.get_mut(device)
                {
                    *target = to;
                }
            }
            // The session's thread may have gone, with the server.
            Wish::Stress { shown } => {
                let browser = state.browsers.iter().find(|other| other.number == browser);
                browser.into_iter().for_each(|browser| browser.outbox().shows_stress = shown);
            }
            Wish::Change(_) | Wish::Restart {} | Wish::Seek { .. } => drop(self.wishes.send((browser, wish))),
        }
    }

    /// A session begins: everybody is told what it is, and where the pointers were is where they are.
    pub(crate) fn begin(&self, begun: Begun) {
        let state = &mut *locked(&self.state);
        let kept = std::mem::take(&mut state.targets);
        (state.hello, state.topology, state.surface) = (begun.hello, begun.topology, Bytes::new());
        (state.pointers, state.targets, state.bounds) = (begun.pointers, begun.homes, begun.bounds);
        for ((pointer, target), kept) in state.pointers.iter_mut().zip(&mut state.targets).zip(kept) {
            if pointer.as_mut().is_some_and(|pointer| pointer.point(kept)) {
                *target = kept;
            }
        }
        for browser in &state.browsers {
            browser.outbox().forget();
            greet(state, browser);
        }
    }

    /// What can be changed has become `settings`, for everybody and whoever comes.
    pub(crate) fn set(&self, settings: Value) {
        let state = &mut *locked(&self.state);
        let message = json!({ "kind": "settings", "settings": settings });
        state.hello["settings"] = settings;
        state.browsers.iter().for_each(|browser| browser.outbox().say(message.clone()));
    }

    /// True if a browser shows the stress of the body.
    pub(crate) fn shows_stress(&self) -> bool {
        locked(&self.state).browsers.iter().any(|browser| browser.outbox().shows_stress)
    }

    /// Where the pointers are (m), by device.
    pub(crate) fn targets(&self) -> Vec<[f64; 3]> {
        locked(&self.state).targets.clone()
    }

    pub(crate) fn show(&self, picture: Picture, bytes: &Bytes) {
        let state = &mut *locked(&self.state);
        if matches!(picture, Picture::Surface) {
            state.surface = bytes.clone();
        }
        state.browsers.iter().for_each(|browser| browser.outbox().show(picture, bytes.clone()));
    }

    pub(crate) fn plot(&self, bytes: &Bytes) {
        locked(&self.state).browsers.iter().for_each(|browser| browser.outbox().plot(bytes.clone()));
    }

    pub(crate) fn say(&self, message: &Value) {
        locked(&self.state).browsers.iter().for_each(|browser| browser.outbox().say(message.clone()));
    }

    /// Shows one browser what it asked for.
    pub(crate) fn to_one(&self, number: u64, tell: impl FnOnce(&mut Outbox)) {
        let browser = locked(&self.state).browsers.iter().find(|browser| browser.number == number).cloned();
        if let Some(browser) = browser {
            tell(&mut browser.outbox());
        }
    }

    pub(crate) fn count_sent(&self, bytes: usize) {
        locked(&self.state).sent_bytes += bytes as u64;
    }

    /// Browsers that are shown something, bytes sent and messages dropped so far.
    pub(crate) fn traffic(&self) -> (usize, u64, u64) {
        let state = &*locked(&self.state);
        (state.browsers.len(), state.sent_bytes, state.browsers.iter().map(|browser| browser.outbox().dropped).sum())
    }

    /// Ends all threads.
    pub(crate) fn end(&self) {
        locked(&self.state).is_over = true;
        self.over.notify_all();
    }

    pub(crate) fn is_over(&self) -> bool {
        locked(&self.state).is_over
    }

    /// Waits until the end, at most for `span`; true if it has come.
    pub(crate) fn wait(&self, span: Duration) -> bool {
        let state = locked(&self.state);
        let result = self.over.wait_timeout_while(state, span, |state| !state.is_over);
        result.unwrap_or_else(PoisonError::into_inner).0.is_over
    }
}

/// Tells a browser what there is to see and what it is.
fn greet(state: &State, browser: &Browser) {
    let mut hello = state.hello.clone();
    if !hello.is_object() {
        return;
    }
    hello["key"] = browser.key.text().into();
    hello["role"] = if state.hand == Some(browser.number) { "hand" } else { "watch" }.into();
    let mut outbox = browser.outbox();
    outbox.say(hello);
    outbox.show(Picture::Topology, state.topology.clone());
    if !state.surface.is_empty() {
        outbox.show(Picture::Surface, state.surface.clone());
    }
}
