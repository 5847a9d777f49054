//! The first thing that the haptic side says: who it is, and what it is about to touch.
//!
//! Both sides have the scene, so that nothing of it has to cross. They must have the same one, and build the same models of it: what
//! differs is named before anything is started.

use super::message::{self, Refused, VERSION};
use crate::model::Pose;
use crate::model::bytes::{BytesReader, BytesWriter};
use crate::runtime::Nanos;

/// Bytes that a text has at most.
const MOST_TEXT: usize = 1 << 18;
/// Tools that a scene has at most: more are nobody's.
const MOST_TOOLS: u32 = 64;
/// Bytes of a tool at least: the length of its name, and whether it is there.
const TOOL: usize = 4 + 1;

/// The haptic side's word of itself, which the global side holds against its own.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Hello {
    /// Names the process that speaks, for as long as it runs.
    pub machine: u64,
    /// Names the session: messages of another one are nobody's.
    pub session: u64,
    /// What a message and its answer take (ns), as far as that is known: results are that late at least.
    pub round_trip: Nanos,
    /// The version of palpate and what it was built for.
    pub build: String,
    /// The instructions that the numerics use there. Others round otherwise, which is no reason to refuse.
    pub instructions: String,
    /// The scene as it is run, as TOML: body, contact, rates and models, without devices, safety and log.
    pub scene: String,
    /// A fingerprint of the body's nodes, masses and surface: a mesh is in no text.
    pub body: u64,
    /// The tools of the scene by name, and where each is at the start; `None` for one that is at another machine.
    pub tools: Vec<(String, Option<Pose>)>,
}

impl Hello {
    /// The first thing in which what `other`, the far side, says differs from this; `None` if both can work together.
    pub fn difference(&self, other: &Self) -> Option<String> {
        if self.build != other.build {
            return Some(format!("it is {} here and {} there: both sides need the same", self.build, other.build));
        }
        let names = |hello: &Self| hello.tools.iter().map(|(name, _)| name.clone()).collect::<Vec<_>>();
        if names(self) != names(other) {
            return Some(format!("the tools are {:?} here and {:?} there", names(self), names(other)));
        }
        if self.scene != other.scene {
            let (mut here, mut there) = (self.scene.lines(), other.scene.lines());
            let line = std::iter::from_fn(|| Some((here.next(), there.next())).filter(|pair| *pair != (None, None)));
            let (here, there) = line.into_iter().find(|(here, there)| here != there).unwrap_or_default();
            let [here, there] = [here, there].map(|line| line.unwrap_or("nothing more"));
            return Some(format!("the scene has `{here}` here and `{there}` there"));
        }
        (self.body != other.body).then(|| "the body has other nodes or another surface here than there".to_owned())
    }

    /// Writes it in place of `bytes`.
    pub fn write(&self, bytes: &mut Vec<u8>) {
        let to = &mut message::begin_kind(message::HELLO, bytes);
        [self.machine, self.session, self.round_trip.0, self.body].into_iter().for_each(|number| to.u64(number));
        [&self.build, &self.instructions, &self.scene].into_iter().for_each(|text| write_text(to, text));
        to.list(&self.tools, |to, (name, pose)| {
            write_text(to, name);
            to.u8(pose.is_some().into());
            pose.iter().for_each(|pose| to.pose(pose));
        });
    }

    /// Reads what anybody sent.
    ///
    /// # Errors
    /// If it is none of this version, to the last byte.
    pub fn read(bytes: &[u8]) -> Result<Self, Refused> {
        let (kind, mut from) = message::read_kind(bytes)?;
        if kind != message::HELLO {
            return Err(Refused::Kind(kind));
        }
        Self::read_body(&mut from).filter(|_| from.0.is_empty()).ok_or(Refused::Malformed)
    }

    fn read_body(from: &mut BytesReader<'_>) -> Option<Self> {
        let [machine, session, round_trip, body] = [from.u64()?, from.u64()?, from.u64()?, from.u64()?];
        let [build, instructions, scene] = [read_text(from)?, read_text(from)?, read_text(from)?];
        let mut tools = Vec::new();
        // Before there is room for them.
        let mut ahead = *from;
        ahead.u32().filter(|&count| count <= MOST_TOOLS)?;
        from.list(TOOL, &mut tools, |from| Some((read_text(from)?, read_place(from)?)))?;
        Some(Self { machine, session, round_trip: Nanos(round_trip), build, instructions, scene, body, tools })
    }

    /// The tools that are at the machine that speaks, by number.
    pub fn own_tools(&self) -> impl Iterator<Item = usize> {
        self.tools.iter().enumerate().filter(|(_, (_, pose))| pose.is_some()).map(|(tool, _)| tool)
    }

    /// The version of messages, and of what an answer to this says.
    pub const VERSION: u16 = VERSION;
}

/// Where a tool is, if it is there.
fn read_place(from: &mut BytesReader<'_>) -> Option<Option<Pose>> {
    match from.u8()? {
        0 => Some(None),
        1 => Some(Some(message::read_pose(from)?)),
        _ => None,
    }
}

fn write_text(to: &mut BytesWriter<'_>, text: &str) {
    // Of a longer one the far side would believe nothing.
    to.list(text.as_bytes(), |to, &byte| to.u8(byte));
}

fn read_text(from: &mut BytesReader<'_>) -> Option<String> {
    let mut bytes = Vec::new();
    from.list(1, &mut bytes, BytesReader::u8)?;
    if bytes.len() > MOST_TEXT {
        return None;
    }
    String::from_utf8(bytes).ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Vec3;

    fn hello() -> Hello {
        Hello {
            machine: 1,
            session: u64::MAX,
            round_trip: Nanos(28_000_000),
            build: "palpate 1 for x86_64".to_owned(),
            instructions: "AVX2".to_owned(),
            scene: "[body]\nfriction = 0.5\n".to_owned(),
            body: 7,
            tools: vec![("left".to_owned(), Some(Pose::at(Vec3::new(0.1, -0.0, 3.0)))), (String::new(), None)],
        }
    }

    #[test]
    fn it_comes_back_as_it_was_said_and_not_with_a_byte_more_or_less() {
        let (hello, mut bytes) = (hello(), Vec::new());
        hello.write(&mut bytes);
        assert_eq!(Hello::read(&bytes).unwrap(), hello);
        assert_eq!(hello.own_tools().collect::<Vec<_>>(), [0]);
        assert!((0..bytes.len()).all(|cut| Hello::read(&bytes[..cut]).is_err()));
        assert_eq!(Hello::read(&[&bytes[..], &[0]].concat()), Err(Refused::Malformed));
        bytes[4] = VERSION as u8 + 1;
        assert_eq!(Hello::read(&bytes), Err(Refused::Version(VERSION + 1)));
    }

    #[test]
    fn what_differs_is_named() {
        let here = hello();
        assert_eq!(here.difference(&Hello { machine: 9, instructions: "none".to_owned(), ..hello() }), None);
        let named = |there: Hello| here.difference(&there).unwrap();
        assert!(named(Hello { build: "palpate 2".to_owned(), ..hello() }).contains("palpate 2 there"));
        assert!(
            named(Hello { scene: "[body]\nfriction = 0.4\n".to_owned(), ..hello() }).contains("`friction = 0.4` there")
        );
        assert!(named(Hello { scene: "[body]\n".to_owned(), ..hello() }).contains("`nothing more` there"));
        assert!(named(Hello { body: 8, ..hello() }).contains("nodes"));
        assert!(named(Hello { tools: Vec::new(), ..hello() }).contains("[] there"));
        let elsewhere = hello().tools.into_iter().map(|(name, _)| (name, None)).collect();
        assert_eq!(here.difference(&Hello { tools: elsewhere, ..hello() }), None, "whose they are is no difference");
    }

    proptest::proptest! {
        #[test]
        fn any_bytes_are_refused_or_read(
            flips in proptest::collection::vec((0_usize..4000, 1_u8..), 1..6),
            cut in 0_usize..400,
        ) {
            let mut bytes = Vec::new();
            hello().write(&mut bytes);
            bytes.truncate(bytes.len().saturating_sub(cut / 4));
            let length = bytes.len();
            flips.iter().for_each(|(at, flip)| bytes[at % length] ^= flip);
            let _ = Hello::read(&bytes);
        }
    }
}
