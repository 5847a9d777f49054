//! The thread that takes the place of one that failed: it makes the actors anew, starts them, and goes on as the group's
//! thread. Nobody waits for it, however long that takes.

use super::deadline::Ledger;
use super::exchange::ExchangeReader;
use super::grant::{GroupGrant, set_up_thread};
use super::group_thread::{GroupThread, since};
use super::mailbox::MailSender;
use super::restart::Restarter;
use super::supervisor::{Control, Failure, Message};
use super::tenure::Tenure;
use std::sync::Arc;
use std::thread::JoinHandle;

/// What it takes to go on after a failure.
pub(super) struct Successor {
    pub(super) restarter: Restarter,
    pub(super) failure: Box<Failure>,
    pub(super) incarnation: usize,
    pub(super) base_ns: u64,
    pub(super) tenure: Arc<Tenure>,
    pub(super) control: Arc<Control>,
    pub(super) post: MailSender<Message>,
}

/// A successor has begun: what the supervisor needs to watch it.
#[derive(Debug)]
pub(crate) struct Restarted {
    pub(crate) group: usize,
    pub(super) restarter: Restarter,
    pub(super) books: ExchangeReader<Ledger>,
    pub(super) failure: Box<Failure>,
    pub(super) grant: GroupGrant,
}

impl Successor {
    /// Starts the thread.
    ///
    /// # Errors
    /// The failure, with what the system said, if it gives no thread.
    pub(super) fn spawn(self) -> Result<JoinHandle<()>, Box<Failure>> {
        let failure = self.failure.clone();
        let thread = std::thread::Builder::new().name(self.restarter.group().to_owned());
        thread.spawn(move || self.run()).map_err(|error| Box::new(failure.not_answered(&error)))
    }

    fn run(self) {
        let Self { mut restarter, failure, incarnation, base_ns, tenure, control, post } = self;
        match restarter.again(&failure.fault, failure.books, since(base_ns)) {
            Ok((group, books)) => {
                // The actors were started without it, like those before them.
                let granted = set_up_thread(&group.spec);
                let restartable = restarter.may_restart();
                let begun = Restarted { group: failure.group, restarter, books, failure, grant: granted.group };
                post.try_send(Message::Restarted(Box::new(begun)));
                let watched = true;
                GroupThread { group, base_ns, incarnation, restartable, watched, tenure, control, post }
                    .run(granted.waiter);
            }
            Err(error) => {
                post.try_send(Message::NotRestarted(Box::new(failure.not_answered(&error))));
            }
        }
    }
}
