//! The thread of the session: starts it, shows it, changes it as a visitor wants, and puts another in its place where that is needed.

use std::sync::Arc;
use std::sync::mpsc::Receiver;
use std::time::Instant;

use palpate::session::{Running, Summary};
use palpate::{Error, ErrorKind};
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
        // A session begins as its scene says. What was changed in the one before and cannot be here is left out.
        let _ = live.change(&Change { model: None, ..change.clone() });
        live.begin(&self.hub, about);
        self.live = Some(live);
    }

    /// Shows the session until the server ends; says how it went.
    pub(crate) fn run(mut self) -> Option<Summary> {
        let mut next = Instant::now();
        while !self.hub.is_over() {
            // Of several that came meanwhile all count: sliders send many.
            let (mut wanted, mut restarts) = (None::<Change>, false);
            while let Ok((_, wish)) = self.wishes.try_recv() {
                match wish {
                    Wish::Change(change) => wanted = Some(change.after(wanted.unwrap_or_default())),
                    Wish::Restart {} => restarts = true,
                    _ => {}
                }
            }
            if restarts || wanted.is_some() {
                self.change(wanted.unwrap_or_default(), restarts);
            }
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

    /// Changes the session that runs, or puts another in its place if that is wanted or a model cannot be reached otherwise. What cannot
    /// be is only told of.
    fn change(&mut self, change: Change, restarts: bool) {
        let is_reached = self.live.as_ref().is_some_and(|live| live.reaches(&change));
        let all = change.clone().after(self.change.clone());
        let result = if restarts || !is_reached {
            self.restart(&all)
        } else {
            self.live.as_mut().map_or(Ok(()), |live| live.change(&change))
        };
        match result {
            Ok(()) => self.change = all,
            Err(error) => self.hub.say(&note(&format!("That does not work: {error}."))),
        }
        if let Some(live) = &self.live {
            self.hub.set(live.settings());
        }
    }

    /// Puts another session in the place of this one. That of a program is the only one, and goes on.
    fn restart(&mut self, change: &Change) -> Result<(), Error> {
        if self.subject.is_none() {
            let only = "the session is a program's own, and only the program starts it anew";
            return Err(Error::new(ErrorKind::Usage, only.to_owned()));
        }
        self.hub.say(&note("The body starts anew ..."));
        let result = self.replace(change);
        // What is shown goes on, or, if that has ended, starts anew as it was.
        let has_ended = result.is_err() && self.live.is_none() && !self.hub.is_over();
        if has_ended && self.replace(&self.change.clone()).is_err() {
            self.hub.say(&note("There is no session now: reset, or start the command again."));
        }
        result
    }

    /// Ends the session and starts one with this `change`. The one that is shown is ended only for one that works by all that is here; what
    /// is over a link is asked when it starts.
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
