//! What crosses, as bytes.
//!
//! ```text
//! magic "plnk"   4    version   2    kind   2
//! epoch          8    number    8    sent   8 (ns of the sender's clock)
//! body
//! ```
//!
//! Little-endian. A message is as long as it says and no longer; one byte more or less, another version, a kind that is not known or a
//! number that is none, and all of it is refused.

use std::fmt;

use super::lane::Lane;
use crate::model::Pose;
use crate::model::body::Stiffness;
use crate::model::bytes::{BytesReader, BytesWriter};
use crate::model::contact::Friction;
use crate::model::local::Shipment;
use crate::model::surroundings::Basis;
use crate::runtime::Nanos;

const MAGIC: [u8; 4] = *b"plnk";
/// The version of the format: of another one nothing is read.
pub const VERSION: u16 = 9;
/// No message is longer (bytes).
pub const LARGEST: usize = 1 << 25;

/// Ticks that one message has at most.
pub const MOST_TICKS: usize = 64;
/// Bases that one message names at most.
const MOST_HELD: usize = 1024;
/// Bytes of a place of the surface.
const PLACE: usize = 3 * 4;
/// Bytes of a tick.
const TICK: usize = 8 * 8;
/// No session lasts longer: 34 years at 1 kHz.
const LAST_TICK: u64 = 1 << 40;
/// No tool is farther away (m): what a body would be pulled to by one that is would be no number for long.
const FARTHEST: f64 = 1e3;

/// The header of every message of a link.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Header {
    /// The connection that it belongs to, by number: what belongs to an older one is dropped.
    pub epoch: u64,
    /// Counts the messages of one side in one lane.
    pub number: u64,
    /// When it was sent, by the sender's clock.
    pub sent: Nanos,
}

/// A message of one side of a link to the other.
#[derive(Clone, Debug)]
pub enum Message {
    /// To the global side: a tool at its last haptic ticks, oldest first. Each message repeats some of those before, so that one that is
    /// lost need not be sent again. To a haptic side: likewise a tool that is at another one.
    Ticks {
        /// The tool.
        tool: u16,
        /// Number of the haptic tick, and where the tool is at its end.
        ticks: Vec<(u64, Pose)>,
    },
    /// To the haptic side: what the next local models are built from.
    Models(Shipment),
    /// To the haptic side: reduced surroundings, once.
    Basis {
        /// What names it.
        key: u64,
        /// The surroundings.
        basis: Box<Basis>,
    },
    /// To the haptic side, behind the bases that were made before the session: unless one was lost they are there, and it may begin.
    Ready,
    /// To the global side, again and again: what is there and what is wanted.
    Wants {
        /// The bases that are there, by their keys.
        held: Vec<u64>,
        /// Friction between tools and body.
        friction: Friction,
        /// What the body's stiffness is to go to.
        stiffness: Stiffness,
        /// Somebody looks at the surface.
        is_watched: bool,
    },
    /// To the haptic side, while somebody looks: the body's surface.
    Surface {
        /// The haptic time that it belongs to.
        time: Nanos,
        /// How stiff the body is.
        stiffness: Stiffness,
        /// Positions (m) of the [surface's nodes](crate::model::mesh::Surface::nodes).
        places: Vec<[f32; 3]>,
    },
    /// To the global side: what time is it?
    Ping,
    /// To the haptic side: when the ping was sent, by the clock there, and when it came in, by the clock here.
    Pong {
        /// The time that was in the ping.
        sent: Nanos,
        /// When it came in.
        received: Nanos,
    },
}

const TICKS: u16 = 1;
const MODELS: u16 = 2;
const BASIS: u16 = 3;
const WANTS: u16 = 4;
const PING: u16 = 5;
const PONG: u16 = 6;
const SURFACE: u16 = 7;
const READY: u16 = 8;
/// A [`Hello`](super::Hello), which is none of the messages of a session.
pub(super) const HELLO: u16 = 9;

/// Why a message is not believed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refused {
    /// It is longer than any message.
    TooLong(usize),
    /// It does not begin as a message does.
    NoMessage,
    /// It is of another version.
    Version(u16),
    /// Nobody knows what it is.
    Kind(u16),
    /// It says something that cannot be.
    Malformed,
}

impl fmt::Display for Refused {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TooLong(bytes) => write!(f, "a message of {bytes} bytes, {LARGEST} are the most"),
            Self::NoMessage => f.write_str("no message of palpate's"),
            Self::Version(version) => write!(f, "a message of version {version}, this is version {VERSION}"),
            Self::Kind(kind) => write!(f, "a message of kind {kind}, which this version does not know"),
            Self::Malformed => f.write_str("a message that is damaged"),
        }
    }
}

impl Message {
    /// Writes the message in place of `bytes`.
    pub fn write(&self, header: Header, bytes: &mut Vec<u8>) {
        let to = &mut begin(header, self.kind(), bytes);
        match self {
            Self::Ticks { tool, ticks } => {
                to.u16(*tool);
                to.list(&ticks[ticks.len().saturating_sub(MOST_TICKS)..], |to, (tick, pose)| {
                    to.u64(*tick);
                    to.pose(pose);
                });
            }
            Self::Models(shipment) => shipment.write(to),
            Self::Basis { key, basis } => {
                to.u64(*key);
                to.0.extend_from_slice(&basis.to_bytes(*key));
            }
            Self::Wants { held, friction, stiffness, is_watched } => {
                to.list(&held[..held.len().min(MOST_HELD)], |to, &key| to.u64(key));
                friction.write(to);
                to.f64(stiffness.factor());
                to.u8((*is_watched).into());
            }
            Self::Surface { time, stiffness, places } => {
                to.u64(time.0);
                to.f64(stiffness.factor());
                to.list(places, |to, place| place.iter().for_each(|&coordinate| to.f32(coordinate)));
            }
            Self::Ping | Self::Ready => {}
            Self::Pong { sent, received } => {
                to.u64(sent.0);
                to.u64(received.0);
            }
        }
    }

    /// Writes the message of a basis without a copy of it.
    pub fn write_basis(key: u64, basis: &Basis, header: Header, bytes: &mut Vec<u8>) {
        let to = &mut begin(header, BASIS, bytes);
        to.u64(key);
        to.0.extend_from_slice(&basis.to_bytes(key));
    }

    fn kind(&self) -> u16 {
        match self {
            Self::Ticks { .. } => TICKS,
            Self::Models(_) => MODELS,
            Self::Basis { .. } => BASIS,
            Self::Wants { .. } => WANTS,
            Self::Surface { .. } => SURFACE,
            Self::Ready => READY,
            Self::Ping => PING,
            Self::Pong { .. } => PONG,
        }
    }

    /// Reads a message of anybody's.
    ///
    /// # Errors
    /// If it is none of this version, to the last byte.
    pub fn read(bytes: &[u8]) -> Result<(Header, Self), Refused> {
        let (kind, mut from) = read_kind(bytes)?;
        if !(TICKS..=READY).contains(&kind) {
            return Err(Refused::Kind(kind));
        }
        Self::read_body(kind, &mut from).filter(|_| from.0.is_empty()).ok_or(Refused::Malformed)
    }

    /// What the beginning alone tells: how a message goes and its header, or that bytes are none, before they are kept for anybody.
    ///
    /// # Errors
    /// If [`read`](Self::read) would refuse them for that.
    pub fn glance(bytes: &[u8]) -> Result<(Lane, Header), Refused> {
        let (kind, mut from) = read_kind(bytes)?;
        let lane = match kind {
            TICKS | WANTS | PING | PONG => Lane::Urgent,
            MODELS => Lane::Models,
            BASIS | READY => Lane::Bulk,
            SURFACE => Lane::Pictures,
            _ => return Err(Refused::Kind(kind)),
        };
        Ok((lane, read_header(&mut from).ok_or(Refused::Malformed)?))
    }

    /// True if these bytes are the message [`Ready`](Self::Ready), as far as their beginning tells.
    pub fn is_ready(bytes: &[u8]) -> bool {
        read_kind(bytes).is_ok_and(|(kind, _)| kind == READY)
    }

    fn read_body(kind: u16, from: &mut BytesReader<'_>) -> Option<(Header, Self)> {
        let header = read_header(from)?;
        let message = match kind {
            TICKS => {
                let (tool, mut ticks) = (from.u16()?, Vec::new());
                from.list(TICK, &mut ticks, read_tick)?;
                if ticks.len() > MOST_TICKS || !ticks.is_sorted_by(|(a, _), (b, _)| a < b) {
                    return None;
                }
                Self::Ticks { tool, ticks }
            }
            MODELS => Self::Models(Shipment::read(from)?),
            BASIS => {
                let key = from.u64()?;
                let basis = Box::new(Basis::from_bytes(std::mem::take(&mut from.0), key)?);
                Self::Basis { key, basis }
            }
            WANTS => {
                let mut held = Vec::new();
                from.list(8, &mut held, BytesReader::u64)?;
                if held.len() > MOST_HELD {
                    return None;
                }
                let (friction, stiffness) = (Friction::read(from)?, Stiffness::times(from.f64()?)?);
                let is_watched = from.u8().filter(|&byte| byte < 2)? == 1;
                Self::Wants { held, friction, stiffness, is_watched }
            }
            PING => Self::Ping,
            READY => Self::Ready,
            PONG => Self::Pong { sent: Nanos(from.u64()?), received: Nanos(from.u64()?) },
            _ => {
                let (time, stiffness) = (Nanos(from.u64()?), Stiffness::times(from.f64()?)?);
                let mut places = Vec::new();
                from.list(PLACE, &mut places, read_place)?;
                Self::Surface { time, stiffness, places }
            }
        };
        Some((header, message))
    }
}

/// Begins what every message of this version begins with.
pub(super) fn begin_kind(kind: u16, bytes: &mut Vec<u8>) -> BytesWriter<'_> {
    bytes.clear();
    bytes.extend_from_slice(&MAGIC);
    let mut to = BytesWriter(bytes);
    to.u16(VERSION);
    to.u16(kind);
    to
}

/// The kind of a message of this version, and what follows.
pub(super) fn read_kind(bytes: &[u8]) -> Result<(u16, BytesReader<'_>), Refused> {
    if bytes.len() > LARGEST {
        return Err(Refused::TooLong(bytes.len()));
    }
    let mut from = BytesReader(bytes.strip_prefix(&MAGIC).ok_or(Refused::NoMessage)?);
    let version = from.u16().ok_or(Refused::Malformed)?;
    if version != VERSION {
        return Err(Refused::Version(version));
    }
    Ok((from.u16().ok_or(Refused::Malformed)?, from))
}

fn begin(header: Header, kind: u16, bytes: &mut Vec<u8>) -> BytesWriter<'_> {
    let mut to = begin_kind(kind, bytes);
    to.u64(header.epoch);
    to.u64(header.number);
    to.u64(header.sent.0);
    to
}

fn read_header(from: &mut BytesReader<'_>) -> Option<Header> {
    Some(Header { epoch: from.u64()?, number: from.u64()?, sent: Nanos(from.u64()?) })
}

fn read_tick(from: &mut BytesReader<'_>) -> Option<(u64, Pose)> {
    Some((from.u64().filter(|&tick| tick <= LAST_TICK)?, read_pose(from)?))
}

/// A place in reach, in single precision.
fn read_place(from: &mut BytesReader<'_>) -> Option<[f32; 3]> {
    let place = [from.f32()?, from.f32()?, from.f32()?];
    place.iter().all(|coordinate| f64::from(coordinate.abs()) <= FARTHEST).then_some(place)
}

/// A pose in reach.
pub(super) fn read_pose(from: &mut BytesReader<'_>) -> Option<Pose> {
    from.pose().filter(|pose| pose.position.amax() <= FARTHEST)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::body::Block;
    use crate::model::local::{Kind, LocalModels, Template};
    use crate::model::mesh::Face;
    use crate::model::{Vec3, turn_of};

    const HEADER: Header = Header { epoch: 3, number: 9, sent: Nanos(5) };

    fn bytes_of(message: &Message) -> Vec<u8> {
        let mut bytes = vec![7; 3];
        message.write(HEADER, &mut bytes);
        bytes
    }

    fn shipment() -> Shipment {
        let block = Block::builder([3; 3], [0.02; 3]).fix(Face::ZMin).build().unwrap();
        let template = Template::new(Kind::Hold, [2; 3], &block).unwrap();
        Shipment::of(&LocalModels::new(1, || template.departing()))
    }

    fn some() -> [Message; 7] {
        let ticks = (1..9).map(|tick| (tick, Pose::at(Vec3::new(tick as f64, -0.0, 1e-300)))).collect();
        [
            Message::Ticks { tool: 1, ticks },
            Message::Wants {
                held: vec![1, u64::MAX],
                friction: f64::INFINITY.into(),
                stiffness: Stiffness::times(0.7).unwrap(),
                is_watched: true,
            },
            Message::Surface { time: Nanos(3), stiffness: Stiffness::default(), places: vec![[1.0, -0.0, 1e-30]; 3] },
            Message::Ping,
            Message::Ready,
            Message::Pong { sent: Nanos(1), received: Nanos(2) },
            Message::Models(shipment()),
        ]
    }

    #[test]
    fn messages_come_back_as_they_were_sent_and_not_with_a_byte_more_or_less() {
        for message in some() {
            let bytes = bytes_of(&message);
            let (header, read) = Message::read(&bytes).unwrap();
            assert_eq!((header, format!("{read:?}")), (HEADER, format!("{message:?}")));
            for cut in 0..bytes.len() {
                assert!(Message::read(&bytes[..cut]).is_err(), "{message:?} cut at {cut}");
            }
            let longer = [&bytes[..], &[0]].concat();
            assert_eq!(Message::read(&longer).unwrap_err(), Refused::Malformed);
        }
    }

    #[test]
    fn another_version_another_kind_and_what_is_too_long_are_refused_by_name() {
        let mut bytes = bytes_of(&Message::Ping);
        assert_eq!(Message::read(&vec![0; LARGEST + 1]).unwrap_err(), Refused::TooLong(LARGEST + 1));
        assert_eq!(Message::read(b"GET / HTTP/1.1").unwrap_err(), Refused::NoMessage);
        bytes[6] = 99;
        assert_eq!(Message::read(&bytes).unwrap_err(), Refused::Kind(99));
        bytes[4] = 1;
        assert_eq!(Message::read(&bytes).unwrap_err(), Refused::Version(1));
        assert!(Refused::Version(1).to_string().contains(&format!("version 1, this is version {VERSION}")));
    }

    #[test]
    fn numbers_that_are_none_and_turns_that_turn_nothing_are_refused() {
        for wrong in [f64::NAN, f64::INFINITY] {
            let ticks = vec![(1, Pose::at(Vec3::new(0.0, wrong, 0.0)))];
            assert_eq!(Message::read(&bytes_of(&Message::Ticks { tool: 0, ticks })).unwrap_err(), Refused::Malformed);
        }
        for wrong in [f32::NAN, f32::INFINITY, 1e9] {
            let places = vec![[0.0, wrong, 0.0]];
            let surface = Message::Surface { time: Nanos(3), stiffness: Stiffness::default(), places };
            assert_eq!(Message::read(&bytes_of(&surface)).unwrap_err(), Refused::Malformed);
        }
        let turned = Pose { position: Vec3::zeros(), orientation: turn_of([0.5, 0.0, 0.0, 0.0]) };
        let far = Pose::at(Vec3::new(0.0, -1e200, 0.0));
        for wrong in [(1, turned), (1, far), (u64::MAX, Pose::default())] {
            let message = Message::Ticks { tool: 0, ticks: vec![wrong] };
            assert_eq!(Message::read(&bytes_of(&message)).unwrap_err(), Refused::Malformed, "{wrong:?}");
        }
    }

    #[test]
    fn a_huge_count_asks_for_no_memory() {
        let none = Message::Surface { time: Nanos(3), stiffness: Stiffness::default(), places: Vec::new() };
        let mut bytes = bytes_of(&none);
        let count = bytes.len() - 4;
        bytes[count..].copy_from_slice(&u32::MAX.to_le_bytes());
        assert_eq!(Message::read(&bytes).unwrap_err(), Refused::Malformed);
    }

    proptest::proptest! {
        #[test]
        fn any_bytes_are_refused_or_read(
            kind in 0_u16..9,
            body in proptest::collection::vec(proptest::prelude::any::<u8>(), 0..400),
            flips in proptest::collection::vec((0_usize..4000, 1_u8..), 0..4),
        ) {
            let mut garbage = Vec::new();
            begin(HEADER, kind, &mut garbage);
            garbage.extend_from_slice(&body);
            let _ = Message::read(&garbage);
            for message in some() {
                let mut bytes = bytes_of(&message);
                let length = bytes.len();
                flips.iter().for_each(|(at, flip)| bytes[at % length] ^= flip);
                let _ = Message::read(&bytes);
            }
        }
    }
}
