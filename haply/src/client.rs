//! The device: one command per tick, one reply each.

use crate::events::Events;
use crate::guard::Guard;
use crate::hold::Hold;
use crate::link::{self, Link, Links, Lost};
use crate::options::HaplyOptions;
use crate::protocol::{self, Commands, Inverse, Reply};
use crate::pulse::Pulse;
use crate::watch::Watch;
use crate::wire::Wire;
use palpate::devices::{Calibration, Capabilities, Device, DeviceFault, DeviceState, ForceCommand};
use palpate::model::{Turn, Vec3, turn_of};
use palpate::runtime::Nanos;
use palpate::{Error, ErrorKind};
use std::time::{Duration, Instant};

/// Replies that one look takes: the service sends one for each command, and few are under way.
const MOST_PER_LOOK: usize = 64;
/// Between two looks at the socket while a reply is waited for. The system's own timeouts of a blocking socket count in its
/// ticks (asked for 2 ms, 12 ms passed at 250 Hz), which is too coarse for a force that has to be gone within three of ours.
const LOOK_AGAIN: Duration = Duration::from_micros(20);

/// A service that has just connected answers within this, or the first read fails.
const FIRST_REPLY: Duration = Duration::from_millis(100);

/// The counts of what has happened on the simulation channel so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct HaplyCounts {
    /// Messages sent.
    pub commands: u64,
    /// Replies to them.
    pub replies: u64,
    /// Commands that never had a reply, because the connection was given up.
    pub lost: u64,
    /// Times that a reply was missing for more than two ticks, and the force went to zero.
    pub stale: u64,
    /// Connections after the first.
    pub reconnects: u64,
}

/// An Inverse3 behind the Haply Inverse service.
///
/// Every tick one command and its reply, whose state is read in the next tick. The force goes to zero, and comes back over
/// 0.1 s when all is well again:
///
/// - at once, if a reply is missing for more than two ticks, is no state, or the connection is gone. Connecting again is the
///   business of another thread;
/// - while the events channel says that the device must not be driven, or is itself lost;
/// - while the service says that the device is not ready, or does not list it;
/// - when the command expires, by the client's own clock. Where the tick does not go on, a thread of its own says so.
///
/// A write says why nothing of its force is exerted. `NotReady` is also the fault of a force that comes before the service has
/// answered twenty times in a row, after each connection.
///
/// [`Device::wait`] waits for the reply. The service answers as soon as it can and has no pace of its own for its clients, so a
/// reply is given out one [`period`](HaplyOptions::period) after the one before at the earliest.
#[derive(Debug)]
pub struct Haply {
    options: HaplyOptions,
    id: String,
    name: String,
    commands: Commands,
    links: Links,
    events: Option<Events>,
    link: Option<Wire>,
    /// The next frame is the first of its connection.
    is_first: bool,
    guard: Guard,
    pulse: Pulse,
    /// What the last reply says of the device, if it lists it.
    device: Option<Inverse>,
    /// How its grip was turned when one last told it.
    orientation: Turn,
    /// What the last reply that lists it is to a read, until it was read.
    fresh: Option<Result<DeviceState, DeviceFault>>,
    /// There is a reply that [`Device::wait`] has not told of.
    is_new: bool,
    /// From when on [`Device::wait`] may tell of a reply.
    due: Option<Instant>,
    /// Nothing was read yet.
    is_unread: bool,
    /// A frame has gone out since the last read.
    is_driven: bool,
    hold: Hold,
    watch: Watch,
    commanded: [f64; 3],
    counts: HaplyCounts,
}

impl Haply {
    /// Connects to the service and finds the device.
    ///
    /// # Errors
    /// [`ErrorKind::Device`] if an option cannot be used, if one of the two channels does not answer, or if there is no such
    /// device.
    ///
    /// # Real-time
    /// Not called in a tick: blocks for up to some seconds.
    pub fn connect(options: HaplyOptions) -> Result<Self, Error> {
        options.check()?;
        let fail = |what: &str, address: &str, why: String| {
            let message =
                format!("{what} at {address} {why}; is the service running? (`palpate mock haply` is one to try)");
            Error::new(ErrorKind::Device, message).at("haply")
        };
        let (first, second, id) = link::connect(&options.address, options.device_id.as_deref())
            .map_err(|why| fail("the service", &options.address, why))?;
        let events = options.events_address.as_ref().map(|address| {
            let missing =
                |error: std::io::Error| fail("the events channel", address, format!("does not answer: {error}"));
            Events::connect(address.clone(), id.clone()).map_err(missing)
        });
        let commands = Commands::new(&options.profile, &options.basis, &id, options.max_force_n);
        let no_thread = |error| fail("the service", &options.address, format!("has no thread of its own: {error}"));
        let (watch, connections) = Watch::start(commands.clone()).map_err(no_thread)?;
        // There is room for the first.
        let _ = connections.try_send(second);
        let links = Links::new(options.address.clone(), id.clone(), connections).map_err(no_thread)?;
        let mut haply = Self {
            name: format!("haply {id}"),
            commands,
            id,
            links,
            events: events.transpose()?,
            link: None,
            is_first: true,
            guard: Guard::default(),
            pulse: Pulse::new(options.period),
            device: None,
            orientation: Turn::identity(),
            fresh: None,
            is_new: false,
            due: None,
            is_unread: true,
            is_driven: false,
            hold: Hold::new(Instant::now()),
            watch,
            commanded: [0.0; 3],
            counts: HaplyCounts::default(),
            options,
        };
        haply.use_link(first);
        Ok(haply)
    }

    /// The device's id.
    ///
    /// # Real-time
    /// Wait-free.
    pub fn id(&self) -> &str {
        &self.id
    }

    /// What has happened so far.
    ///
    /// # Real-time
    /// Wait-free.
    pub fn counts(&self) -> HaplyCounts {
        self.counts
    }

    /// From the last answered command to the look that found its reply: in [`Device::wait`] within some tens of
    /// microseconds of its arrival, otherwise at the next read.
    ///
    /// # Real-time
    /// Wait-free.
    pub fn round_trip(&self) -> Option<Duration> {
        self.pulse.round_trip()
    }

    /// The force that was sent last (N): what was asked for, or less, or zero.
    ///
    /// # Real-time
    /// Wait-free.
    pub fn commanded_n(&self) -> [f64; 3] {
        self.commanded
    }

    fn use_link(&mut self, link: Link) {
        self.link = Some(link.wire);
        self.is_first = true;
        self.pulse = Pulse::new(self.options.period);
        self.guard.reconnected();
        self.accept(link.first);
    }

    fn accept(&mut self, reply: Reply) {
        self.device = reply.device;
        if let Some(told) = reply.orientation {
            self.orientation = turn_of(told);
        }
        if let Some(device) = reply.device {
            let position = Vec3::from(device.position_m) + self.options.origin_m;
            let (velocity, orientation) = (device.velocity_m_s.into(), self.orientation);
            let state = DeviceState { position, velocity, orientation, buttons: reply.buttons };
            self.fresh = Some(if device.is_ready { Ok(state) } else { Err(DeviceFault::NotReady) });
        }
        self.is_new = true;
    }

    /// Takes everything that has arrived and judges what has not. Waits for nothing.
    fn look(&mut self) {
        let now = Instant::now();
        if let Some(events) = &self.events {
            while let Some(news) = events.next() {
                self.guard.take(news, now);
            }
        }
        if self.link.is_none()
            && let Some(link) = self.links.take()
        {
            self.counts.reconnects += 1;
            self.use_link(link);
        }
        for _ in 0..self.watch.zeros() {
            // Each has its reply, as a command of the tick has.
            self.counts.commands += 1;
            self.commanded = [0.0; 3];
            self.pulse.sent(now);
        }
        self.receive();
        // By the time before the look: the thread may have lost its core since.
        if self.pulse.turns_stale(now) {
            self.counts.stale += 1;
            self.send(now, Some([0.0; 3]));
        }
        if self.pulse.is_hopeless(now) {
            self.lose(Lost::Silent);
        }
    }

    fn receive(&mut self) {
        for _ in 0..MOST_PER_LOOK {
            let Some(wire) = &mut self.link else { return };
            let lost = match wire.receive() {
                Ok(None) => return,
                Ok(Some(frame)) => match protocol::reply(&frame, &self.id) {
                    Some(reply) => {
                        self.counts.replies += u64::from(self.pulse.waiting() > 0);
                        self.pulse.replied(Instant::now());
                        self.accept(reply);
                        continue;
                    }
                    None => Lost::Garbage,
                },
                Err(broken) => Lost::Broken(broken),
            };
            return self.lose(lost);
        }
        // Nobody has asked for so many.
        self.lose(Lost::Garbage);
    }

    fn lose(&mut self, why: Lost) {
        let Some(mut wire) = self.link.take() else { return };
        // A last word, in case that only the replies are lost; a command that has no reply either is not counted.
        let _ = wire.send(|out| self.commands.force(out, false, [0.0; 3]));
        self.counts.lost += self.pulse.waiting() as u64;
        self.pulse = Pulse::new(self.options.period);
        self.commanded = [0.0; 3];
        self.watch.expect(None);
        self.links.lose(why, wire);
    }

    /// Why there is no force now.
    fn fault(&mut self, now: Instant) -> Option<DeviceFault> {
        let Some(device) = self.device.filter(|_| self.link.is_some()) else { return Some(DeviceFault::Disconnected) };
        self.guard.fault(now).or((!device.is_powered).then_some(DeviceFault::NotReady))
    }

    /// Sends a force, or only asks for the state.
    fn send(&mut self, now: Instant, force: Option<[f64; 3]>) {
        let Some(wire) = &mut self.link else { return };
        let sent = wire.send(|out| match force {
            Some(force) => self.commands.force(out, self.is_first, force),
            None => {
                self.commands.probe(out, self.is_first);
                [0.0; 3]
            }
        });
        match sent {
            Ok(written) => {
                (self.is_first, self.is_driven, self.commanded) = (false, true, written);
                self.watch.expect(self.hold.ends().filter(|_| written != [0.0; 3]));
                self.counts.commands += 1;
                self.pulse.sent(now);
            }
            Err(broken) => self.lose(Lost::Broken(broken)),
        }
    }

    /// Sends the command of a tick: what is held, as far as it is allowed. Gives why nothing of it is exerted.
    fn command(&mut self) -> Option<DeviceFault> {
        let now = Instant::now();
        let fault = self.fault(now);
        let gain = self.pulse.gain(fault.is_none(), now);
        let (held, none) = (self.hold.force(now), [0.0; 3]);
        let force = if gain > 0.0 { held.map(|c| c * gain) } else { none };
        let is_end = force == none && self.commanded != none;
        if self.pulse.may_send() || is_end {
            self.send(now, Some(force));
        }
        let is_early = gain == 0.0 && held != none;
        fault
            .or(self.link.is_none().then_some(DeviceFault::Disconnected))
            .or(self.pulse.is_stale().then_some(DeviceFault::Stale))
            .or(is_early.then_some(DeviceFault::NotReady))
    }

    /// Before the first tick the state may be of any age: asks for a new one.
    fn refresh(&mut self) {
        self.fresh = None;
        let now = Instant::now();
        self.send(now, None);
        let until = now + FIRST_REPLY;
        while self.fresh.is_none() && self.link.is_some() && Instant::now() < until {
            std::thread::sleep(LOOK_AGAIN);
            self.receive();
        }
        // It is read at once: there is nothing to tell of.
        self.is_new = false;
    }

    /// Tells of a reply that has come, one period after the one before at the earliest.
    fn tell(&mut self, now: Instant, deadline: Instant) -> bool {
        let due = self.due.unwrap_or(now);
        if due > deadline {
            std::thread::sleep(deadline.saturating_duration_since(now));
            return false;
        }
        std::thread::sleep(due.saturating_duration_since(now));
        let period = self.options.period;
        // On a grid, so that late wake-ups do not add up; after a gap, on a new one.
        self.due = Some(if now > due + period { now + period } else { due + period });
        self.is_new = false;
        true
    }
}

impl Device for Haply {
    fn name(&self) -> &str {
        &self.name
    }

    fn capabilities(&self) -> Capabilities {
        // No source names more: the service has no pace of its own for its clients, and the pages no limits.
        Capabilities::of_force(self.options.max_force_n)
    }

    fn calibration(&self) -> Calibration {
        if self.device.is_some_and(|device| !device.is_calibrated) { Calibration::Needed } else { Calibration::Done }
    }

    fn wait(&mut self, timeout: Duration) -> bool {
        let deadline = Instant::now() + timeout;
        self.is_unread = false;
        loop {
            self.look();
            let now = Instant::now();
            if self.is_new {
                return self.tell(now, deadline);
            }
            if self.link.is_some() && self.pulse.waiting() == 0 {
                // Nobody has commanded since the last reply, and without a command there is no other.
                self.command();
            }
            if now >= deadline {
                return false;
            }
            std::thread::sleep(LOOK_AGAIN.min(deadline - now));
        }
    }

    fn read(&mut self, time: Nanos) -> Result<DeviceState, DeviceFault> {
        self.look();
        let now = Instant::now();
        self.hold.saw(time, now);
        let has_ended = self.commanded != [0.0; 3] && self.hold.force(now) == [0.0; 3];
        if std::mem::take(&mut self.is_unread) {
            self.refresh();
        } else if has_ended || !self.is_driven {
            // Nobody has written since the last read, or too long ago: commands do not persist, so the force that is held is
            // said again.
            self.command();
        }
        self.is_driven = false;
        let is_there = self.link.is_some() && self.device.is_some();
        let missing = if is_there { DeviceFault::Stale } else { DeviceFault::Disconnected };
        self.fresh.take().unwrap_or(Err(missing))
    }

    fn write(&mut self, command: ForceCommand) -> Result<(), DeviceFault> {
        let is_finite = command.is_finite();
        self.hold.set(if is_finite { command } else { ForceCommand::ZERO });
        match self.command() {
            _ if !is_finite => Err(DeviceFault::Refused),
            Some(fault) => Err(fault),
            None => Ok(()),
        }
    }

    fn exerted(&self) -> Option<Vec3> {
        Some(self.commanded.into())
    }
}

impl Drop for Haply {
    fn drop(&mut self) {
        if let Some(wire) = &mut self.link {
            let _ = wire.send(|out| self.commands.force(out, self.is_first, [0.0; 3]));
            wire.close();
        }
    }
}
