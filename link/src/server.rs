//! The global side: listens, and runs a session for the haptic machines that come.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use palpate::link::{HapticMachine, Hello, Lane, Transport};
use palpate::runtime::Nanos;
use palpate::session::{GlobalSession, Running, Summary};
use palpate::{Error, ErrorKind};
use zenoh::Wait;

use crate::access::Access;
use crate::desk::{Arrival, Desk, Guest};
use crate::inbox::Inbox;
use crate::line::{HELLO, Lines, Way};
use crate::sockets::{limit_waiting, places};

/// Between two looks whether somebody has come, or whoever serves wants to end.
const LOOK: Duration = Duration::from_millis(50);

/// What happens on the global side, to be shown.
#[derive(Debug)]
#[non_exhaustive]
pub enum Event {
    /// It listens, and a session is ready.
    Listening,
    /// A session has begun: the global model runs for these haptic machines; what they say of themselves.
    Began(Vec<Hello>),
    /// A haptic machine has taken its place in the session that runs.
    Came(Box<Hello>),
    /// Haptic machines have come, and there is nothing for them; why.
    Refused(Error),
    /// The session is over: its machines have gone or begun anew, or the global model failed.
    Ended(Box<Summary>),
}

/// Listens at `address` and runs the global model of a session, made by `make`, for the haptic machine that comes, or for those that have
/// its devices between them; until `is_over`. What happens is told to `tell`, on this thread.
///
/// A session begins when all of its devices are there. A machine that comes again after a break of its link goes on with the session as
/// it is. One that was started anew takes its place in the session of another one that goes on; without one, a session begins anew, from the
/// body as it was made.
///
/// # Errors
/// If `access` does not allow the address, it is taken, or `make` fails.
pub fn serve(
    mut make: impl FnMut() -> Result<GlobalSession, Error>,
    address: &str,
    access: &Access,
    mut is_over: impl FnMut() -> bool,
    mut tell: impl FnMut(Event),
) -> Result<(), Error> {
    let config = access.listening(address)?;
    let mut ready = make()?;
    let desk = Arc::new(Desk::new(ready.hello().clone()));
    let refused = |error: zenoh::Error| Error::new(ErrorKind::Runtime, format!("cannot listen: {error}")).at(address);
    let zenoh = zenoh::open(config).wait().map_err(refused)?;
    limit_waiting(&places(address));
    let asked = Arc::clone(&desk);
    let answer = move |query: zenoh::query::Query| {
        let question = query.payload().map(|payload| payload.to_bytes()).unwrap_or_default();
        let _ = query.reply(query.key_expr().clone(), asked.answer(&question).write()).wait();
    };
    let _queryable = zenoh.declare_queryable(HELLO).callback(answer).wait().map_err(refused)?;
    tell(Event::Listening);
    let mut serving: Option<Serving> = None;
    while !is_over() {
        match desk.wait_for_guests(LOOK) {
            Some(Arrival::All(guests)) => {
                serving.take().into_iter().for_each(|serving| serving.end(&mut tell));
                match Serving::begin(&zenoh, ready, &guests) {
                    Ok(begun) => {
                        desk.has_begun();
                        serving = Some(begun);
                        tell(Event::Began(guests.into_iter().map(|guest| guest.hello).collect()));
                    }
                    Err(error) => {
                        desk.refuse(&error.to_string());
                        tell(Event::Refused(error));
                    }
                }
                ready = make()?;
                desk.is_ready();
            }
            Some(Arrival::Again(guest)) => {
                if let Some(serving) = &serving {
                    match serving.seat(&zenoh, &guest) {
                        Ok(()) => tell(Event::Came(Box::new(guest.hello))),
                        Err(error) => tell(Event::Refused(error)),
                    }
                }
            }
            None => {}
        }
        let has_failed = serving.as_ref().is_some_and(|serving| serving.running.finished());
        if has_failed || (serving.is_some() && desk.is_alone()) {
            desk.forget();
            serving.take().into_iter().for_each(|serving| serving.end(&mut tell));
        }
    }
    serving.into_iter().for_each(|serving| serving.end(&mut tell));
    Ok(())
}

/// A session that runs, and the places of its machines.
struct Serving {
    running: Running,
    seats: Vec<(Vec<usize>, Seat)>,
}

impl Serving {
    fn begin(zenoh: &zenoh::Session, session: GlobalSession, guests: &[Guest]) -> Result<Self, Error> {
        let (mut seats, mut machines): (Vec<_>, Vec<HapticMachine>) = Default::default();
        for guest in guests {
            let seat = Seat::new(HapticSide::new(zenoh, guest)?);
            seats.push((guest.hello.own_tools().collect(), seat.clone()));
            machines.push((Box::new(seat), guest.hello.clone()));
        }
        Ok(Self { running: session.start(machines)?, seats })
    }

    /// Lets a machine take the place of the one that had the same tools.
    fn seat(&self, zenoh: &zenoh::Session, guest: &Guest) -> Result<(), Error> {
        let way = HapticSide::new(zenoh, guest)?;
        if let Some((_, seat)) = self.seats.iter().find(|(tools, _)| guest.hello.own_tools().eq(tools.iter().copied()))
        {
            seat.take(way);
        }
        Ok(())
    }

    fn end(self, tell: &mut impl FnMut(Event)) {
        tell(Event::Ended(Box::new(self.running.stop())));
    }
}

/// The place of a haptic machine in a session, for its length: another machine may take it.
#[derive(Clone, Debug)]
struct Seat(Arc<Mutex<Seated>>);

#[derive(Debug)]
struct Seated {
    way: HapticSide,
    /// The machine that takes the place when the bridge next asks who is there, so that none hears what is said to the one before.
    next: Option<HapticSide>,
    /// The way to the one before: ending it asks the network, which is not the bridge's to wait for.
    before: Option<HapticSide>,
    /// How many have had the place.
    machines: u64,
}

impl Seat {
    fn new(way: HapticSide) -> Self {
        Self(Arc::new(Mutex::new(Seated { way, next: None, before: None, machines: 1 })))
    }

    fn seated(&self) -> MutexGuard<'_, Seated> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn take(&self, way: HapticSide) {
        let mut seated = self.seated();
        let gone = [seated.next.replace(way), seated.before.take()];
        drop(seated);
        drop(gone);
    }
}

impl Transport for Seat {
    fn send(&mut self, lane: Lane, message: &[u8], _: Nanos) {
        self.seated().way.lines.put(lane, message);
    }

    fn receive(&mut self, _: Nanos, message: &mut Vec<u8>) -> bool {
        self.seated().way.inbox.take(message)
    }

    fn peer(&mut self) -> u64 {
        let seated = &mut *self.seated();
        if let Some(next) = seated.next.take() {
            seated.before = Some(std::mem::replace(&mut seated.way, next));
            seated.machines += 1;
        }
        seated.machines
    }
}

/// The way to a haptic machine.
#[derive(Debug)]
struct HapticSide {
    lines: Lines,
    inbox: Arc<Inbox>,
}

impl HapticSide {
    fn new(zenoh: &zenoh::Session, guest: &Guest) -> Result<Self, Error> {
        let inbox = Arc::clone(&guest.inbox);
        Ok(Self { lines: Lines::new(zenoh, guest.hello.session, Way::Down, &inbox)?, inbox })
    }
}
