//! Every public function that a tick may call says under `# Real-time` what it costs, and what stands near and must not
//! be called says that.
//!
//! A scan of plain text, in the shape that rustfmt gives it: items begin in column 0, methods in column 4.

use std::path::{Path, PathBuf};

/// Where such functions are, below `src/`. Nothing public in there is left out.
const SCANNED: [&str; 8] = [
    "actors",
    "devices",
    "log/records/contact.rs",
    "log/records/mod.rs",
    "log/records/samples.rs",
    "model",
    "runtime",
    "safety",
];

/// What a tick lives on: where the scan finds no function of one of these, it looks in the wrong place.
const USED_BY_TICKS: &str = "
    Actor Reader Writer QueueReader QueueWriter OutletReader OutletWriter Recorder RecordDrain
    ExchangePort QueuePort OutletPort RecorderPort StopHandle GrantHandle
    ExchangeReader ExchangeWriter Consumer Producer HistogramReader GroupLive
    Device ToolPath Pipeline Body LocalModel PatchGeometry Simulation Succession step";

/// Types whose own section speaks for all of their methods: plain values, actors, what is gone before a run.
const SPEAK_FOR_ALL: &str = "
    Nanos Rate TickContext TickTiming Event PortUse PortUseKind SlipCause SlipCounts Histogram GraphError ModelError
    LogRecord ContactSample ContactPointSample ContactMode Cause DeviceFault Capabilities DeviceState ForceCommand Actions Contact Friction ToolMotion Blend ToolForecast Spring Stepping TangentBlock Face Lattice Region Shape ToolShape Pose Wrench
    DeviceActor LocalActor LocalTool WholeActor GlobalActor LoggerActor LogSink HapticBridge GlobalBridge
    BytesWriter BytesReader Parcel Image
    Scripted Replayed
    Block BlockBuilder SpringNetwork SpringNetworkBuilder Tetrahedra TetrahedraBuilder Tissue TissueRegion InstructionSet RateGroup RuntimeBuilder Runtime Plan GroupPlan Recording";

/// The name of a public type, trait or function, or `Owner::name` of a public method; and whether its docs have the section,
/// with a text.
type Item = (String, bool);

fn name_of(text: &str) -> String {
    text.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect()
}

/// The type of an inherent impl, from what follows the keyword; `None` for a trait's.
fn inherent(header: &str) -> Option<String> {
    let mut depth = 0;
    let generics = header.find(|c| {
        depth += i32::from(c == '<') - i32::from(c == '>');
        depth == 0
    })?;
    (!header.contains(" for ")).then(|| name_of(header[generics + 1..].trim_start()))
}

fn items(text: &str) -> Vec<Item> {
    let (mut items, mut owner, mut in_trait, mut docs) = (Vec::new(), None, false, Vec::new());
    // By the house rules a unit test module is the end of its file.
    let is_code = |line: &&str| !line.starts_with("#[cfg(test)]") && !line.starts_with("#[cfg(all(test");
    for line in text.lines().take_while(is_code) {
        let code = line.trim_start();
        if let Some(doc) = code.strip_prefix("///") {
            docs.push(doc.trim());
        }
        if code.starts_with("///") || code.starts_with("#[") {
            continue;
        }
        let heading = docs.iter().position(|doc| *doc == "# Real-time");
        let section = heading.is_some_and(|at| docs.get(at + 1).is_some_and(|text| !text.is_empty()));
        docs.clear();
        let public = code.strip_prefix("pub ").map(|code| code.trim_start_matches("const "));
        match (line.len() - code.len(), public.or(in_trait.then_some(code)).and_then(|code| code.split_once(' '))) {
            (0, Some((kind @ ("struct" | "enum" | "trait" | "fn"), rest))) => {
                items.push((name_of(rest), section));
                (owner, in_trait) = ((kind == "trait").then(|| name_of(rest)), kind == "trait");
            }
            (4, Some(("fn", rest))) => {
                items.extend(owner.iter().map(|owner| (format!("{owner}::{}", name_of(rest)), section)));
            }
            (0, _) if code.starts_with("impl") => owner = inherent(&code["impl".len()..]),
            (0, _) if code == "}" => (owner, in_trait) = (None, false),
            _ => {}
        }
    }
    items
}

/// What is wrong, a line each.
fn faults(items: &[Item], used: &str, speak_for_all: &str) -> Vec<String> {
    let owner = |name: &str| name.split("::").next().unwrap_or_default().to_owned();
    // By Rust's own rules a type begins with a capital letter.
    let is_function = |name: &str| name.contains("::") || name.starts_with(char::is_lowercase);
    let is_there = |listed: &&str| items.iter().any(|(name, _)| is_function(name) && owner(name) == **listed);
    let listed = used.split_whitespace().chain(speak_for_all.split_whitespace());
    let gone = listed.filter(|name| !is_there(name)).map(|name| format!("{name} is listed and has no public function"));
    let must_speak = |name: &str| match speak_for_all.split_whitespace().any(|listed| listed == owner(name)) {
        true => !is_function(name),
        false => is_function(name),
    };
    let silent = items.iter().filter(|(name, section)| !section && must_speak(name));
    gone.chain(silent.map(|(name, _)| format!("{name} has no `# Real-time` section"))).collect()
}

/// The items of a file, or of all files of a folder but its tests, benches and examples.
fn scan(path: PathBuf) -> Vec<Item> {
    if path.ends_with("tests") || path.ends_with("benches") || path.ends_with("examples") {
        return Vec::new();
    }
    if !path.is_dir() {
        let is_rust = path.extension().is_none_or(|ending| ending == "rs");
        let text = is_rust.then(|| std::fs::read_to_string(path.with_extension("rs")).expect("UTF-8"));
        return text.map_or_else(Vec::new, |text| items(&text));
    }
    let entries = std::fs::read_dir(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    entries.flat_map(|entry| scan(entry.expect("src/ is readable").path())).collect()
}

#[test]
fn whatever_a_tick_may_call_says_what_it_costs() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let items: Vec<Item> = SCANNED.iter().flat_map(|place| scan(root.join(place))).collect();
    let faults = faults(&items, USED_BY_TICKS, SPEAK_FOR_ALL);
    assert!(faults.is_empty(), "{faults:#?}");
}

const SAMPLE: &str = "
/// # Real-time
/// Wait-free.
pub struct Plain;
impl Plain {
    pub const fn spoken_for() {}
}
pub enum Mute {}
impl Mute {
    pub fn spoken_for() {}
}
impl<T: Into<Option<u8>>> Port<T> {
    /// # Real-time
    /// Wait-free.
    #[inline]
    pub fn says() {}
    /// # Real-time
    pub fn empty() {}
    pub const fn silent() {}
    pub(super) fn hidden() {}
}
impl Clone for Port {
    fn clone() {}
}
pub trait Part {
    fn tick();
}
/// About real time, in passing.
pub fn free() {}
#[cfg(test)]
pub fn test() {}
";

#[test]
fn the_scan_finds_what_is_missing_and_names_that_are_gone() {
    let missing = ["Mute", "Port::empty", "Port::silent", "Part::tick", "free"];
    let gone = ["Gone", "Lost"].map(|name| format!("{name} is listed and has no public function"));
    let expected = gone.into_iter().chain(missing.map(|name| format!("{name} has no `# Real-time` section")));
    assert_eq!(faults(&items(SAMPLE), "Port Part free Gone", "Plain Mute Lost"), expected.collect::<Vec<_>>());
}
