//! The thread of the session: starts it, shows it, and puts another in its place when a visitor wants that.

use std::sync::Arc;
use std::sync::mpsc::Receiver;
use std::time::Instant;

use palpate::Error;
use palpate::session::{Running, Summary};
use serde_json::{Value, json};

use crate::hub::Hub;
use crate::live::{Live, PERIOD};
use crate::subject::Pushed;
use crate::wish::{Change, Wish};

/// The session and what it is made of.
pub(crate) struct Stage {
    hub: Arc<Hub>,
    wishes: Receiver<(u64, Wish)>,
    /// None for a session that a program started: it is the only one.
    subject: Option<Pushed>,
    change: Change,
    live: Option<Live>,
}

impl Stage {
    /// A stage for a session that runs already.
    pub(crate) fn of_running(hub: Arc<Hub>, wishes: Receiver<(u64, Wish)>, running: Running) -> Self {
        let mut stage = Self { hub, wishes, subject: None, change: Change::default(), live: None };
        stage.put(running, &Change::default());
        stage
    }

    /// A stage for a scene, whose first session is started here.
    ///
    /// # Errors
    /// If the scene cannot be run.
    pub(crate) fn of_scene(hub: Arc<Hub>, wishes: Receiver<(u64, Wish)>, mut subject: Pushed) -> Result<Self, Error> {
        let change = Change::default();
        let running = subject.session(&change)?.start()?;
        let mut stage = Self { hub, wishes, subject: Some(subject), change: change.clone(), live: None };
        stage.put(running, &change);
        Ok(stage)
    }

    fn put(&mut self, running: Running, change: &Change) {
        let about = match &self.subject {
            Some(subject) => subject.about(change),
            None => json!({ "can_restart": false }),
        };
        let mut live = Live::new(running);
        live.begin(&self.hub, about);
        self.live = Some(live);
    }

    /// Shows the session until the server ends; says how it went.
    pub(crate) fn run(mut self) -> Option<Summary> {
        let mut next = Instant::now();
        while !self.hub.is_over() {
            // Of several that came meanwhile all count, in one new session.
            let mut wanted: Option<Change> = None;
            while let Ok((_, wish)) = self.wishes.try_recv() {
                if let Wish::Restart(change) = wish {
                    wanted = Some(change.after(wanted.unwrap_or_default()));
                }
            }
            wanted.into_iter().for_each(|change| self.restart(change));
            if let Some(live) = &mut self.live {
                live.publish(&self.hub);
            }
            next = (next + PERIOD).max(Instant::now());
            self.pause(next);
        }
        self.live.map(|live| live.running.stop())
    }

    /// Waits until `next`. In virtual time the session goes on by as much.
    fn pause(&self, next: Instant) {
        if let Some(live) = self.live.as_ref().filter(|live| !live.running.finished()) {
            live.running.wait_for(next.saturating_duration_since(Instant::now()));
        }
        let left = next.saturating_duration_since(Instant::now());
        if !left.is_zero() {
            self.hub.wait(left);
        }
    }

    /// Puts another session in the place of this one; a change that cannot be is only told of.
    fn restart(&mut self, change: Change) {
        let change = change.after(self.change.clone());
        self.hub.say(&note("The body starts anew ..."));
        let result = self.replace(&change);
        match result {
            Ok(()) => self.change = change,
            // What is shown goes on, or, if that has ended, starts anew as it was.
            Err(error) => {
                if self.live.is_none() {
                    let _ = self.replace(&self.change.clone());
                }
                let rest = if self.live.is_some() {
                    ""
                } else {
                    " There is no session now: reset, or start the command again."
                };
                self.hub.say(&note(&format!("That does not work: {error}.{rest}")));
            }
        }
    }

    /// Ends the session and starts one with this `change`. The one that is shown is ended only for one that is sure to work.
    fn replace(&mut self, change: &Change) -> Result<(), Error> {
        let Some(subject) = &mut self.subject else { return Ok(()) };
        let session = subject.session(change)?;
        // Two sessions at a time would be late by each other.
        drop(self.live.take().map(|live| live.running.stop()));
        self.put(session.start()?, change);
        Ok(())
    }
}

fn note(text: &str) -> Value {
    json!({ "kind": "note", "text": text })
}
