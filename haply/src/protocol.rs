//! The messages of the Haply Inverse service 3.5: commands out, states and events in.
//!
//! States are read in the tick, into values that borrow from their frame: nothing is allocated for up to [`USUAL`] devices of a
//! kind. Source: the vendor's pages on the simulation and the events channel, and the wire types of its crate `haply` 1.3.1.

use crate::guard::News;
use serde::Deserialize;
use serde_json::value::RawValue;
use serde_json::{Map, Value};
use smallvec::SmallVec;
use std::borrow::Cow;
use std::io::Write;

/// Devices of a kind in one frame for which there is room without an allocation.
const USUAL: usize = 4;

/// What is needed of one state frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Reply {
    /// The device, if the frame lists it.
    pub(crate) device: Option<Inverse>,
    /// Buttons of the first grip with one pressed, a bit each: a (or the only one), b, c.
    pub(crate) buttons: u16,
    /// How the first grip that tells it is turned: a quaternion (w, x, y, z).
    pub(crate) orientation: Option<[f64; 4]>,
}

/// One Inverse3.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Inverse {
    /// Cursor in the session's basis, from the device's base (m).
    pub(crate) position_m: [f64; 3],
    /// Its velocity (m/s).
    pub(crate) velocity_m_s: [f64; 3],
    /// It knows where it is.
    pub(crate) is_calibrated: bool,
    /// Calibrated, started and ready: its state means something.
    pub(crate) is_ready: bool,
    /// And powered: it follows commands.
    pub(crate) is_powered: bool,
}

#[derive(Default, Deserialize)]
#[serde(default)]
struct State<'a> {
    #[serde(borrow)]
    inverse3: SmallVec<[Entry<'a>; USUAL]>,
    verse_grip: SmallVec<[Grip; USUAL]>,
    wireless_verse_grip: SmallVec<[Grip; USUAL]>,
    custom_verse_grip: SmallVec<[Grip; USUAL]>,
}

#[derive(Default, Deserialize)]
#[serde(default)]
struct Entry<'a> {
    #[serde(borrow)]
    device_id: Cow<'a, str>,
    state: Motion,
    status: Option<Status>,
}

#[derive(Default, Deserialize)]
#[serde(default)]
struct Motion {
    cursor_position: Option<Vector>,
    cursor_velocity: Option<Vector>,
    transform: Option<Nested>,
    transform_velocity: Option<Nested>,
}

/// Objects within an object, of which nothing is needed. What has no name here is stepped over with a stack of brackets, which
/// is on the heap from the second one on.
#[derive(Deserialize)]
struct Nested {}

#[derive(Clone, Copy, Debug, Deserialize)]
pub(crate) struct Vector {
    x: f64,
    y: f64,
    z: f64,
}

impl From<Vector> for [f64; 3] {
    fn from(Vector { x, y, z }: Vector) -> Self {
        [x, y, z]
    }
}

/// What is not said is not so; only a device without a supply of its own need not speak of it.
#[derive(Default, Deserialize)]
#[serde(default)]
struct Status {
    calibrated: bool,
    ready: bool,
    started: bool,
    power_supply: Option<bool>,
}

#[derive(Default, Deserialize)]
#[serde(default)]
struct Grip {
    state: Held,
}

#[derive(Default, Deserialize)]
#[serde(default)]
struct Held {
    button: Option<bool>,
    #[serde(deserialize_with = "if_a_turn")]
    orientation: Option<Quaternion>,
    #[serde(deserialize_with = "if_known")]
    buttons: Buttons,
    transform: Option<Nested>,
}

#[derive(Default, Deserialize)]
#[serde(default)]
struct Buttons {
    a: bool,
    b: bool,
    c: bool,
}

#[derive(Clone, Copy, Debug, Deserialize)]
struct Quaternion {
    w: f64,
    x: f64,
    y: f64,
    z: f64,
}

impl From<Quaternion> for [f64; 4] {
    fn from(Quaternion { w, x, y, z }: Quaternion) -> Self {
        [w, x, y, z]
    }
}

/// A grip that is not tracked yet tells zeros, or something else that is no quaternion: then it tells none.
fn if_a_turn<'de, D: serde::Deserializer<'de>>(raw: D) -> Result<Option<Quaternion>, D::Error> {
    let told: Option<Quaternion> = serde_json::from_str(<&RawValue>::deserialize(raw)?.get()).unwrap_or_default();
    Ok(told.filter(|&quaternion| <[f64; 4]>::from(quaternion) != [0.0; 4]))
}

/// They are of many shapes, not all of them known.
fn if_known<'de, D: serde::Deserializer<'de>>(raw: D) -> Result<Buttons, D::Error> {
    Ok(serde_json::from_str(<&RawValue>::deserialize(raw)?.get()).unwrap_or_default())
}

impl Grip {
    fn pressed(&self) -> u16 {
        let Held { button, buttons: Buttons { a, b, c }, .. } = self.state;
        u16::from(a || button == Some(true)) | u16::from(b) << 1 | u16::from(c) << 2
    }
}

/// Reads a state frame; `id` is the device that is wanted. `None` if it is no state.
pub(crate) fn reply(frame: &[u8], id: &str) -> Option<Reply> {
    let state: State<'_> = serde_json::from_slice(frame).ok()?;
    let device = match state.inverse3.iter().rfind(|entry| entry.device_id == id) {
        Some(Entry { state, status, .. }) => {
            let status = status.as_ref()?;
            let is_ready = status.calibrated && status.started && status.ready;
            Some(Inverse {
                position_m: state.cursor_position?.into(),
                velocity_m_s: state.cursor_velocity?.into(),
                is_calibrated: status.calibrated,
                is_ready,
                is_powered: is_ready && status.power_supply != Some(false),
            })
        }
        None => None,
    };
    let mut grips = state.verse_grip.iter().chain(&state.wireless_verse_grip).chain(&state.custom_verse_grip);
    let buttons = grips.find_map(|grip| Some(grip.pressed()).filter(|pressed| *pressed != 0));
    let mut grips = state.verse_grip.iter().chain(&state.wireless_verse_grip);
    let orientation = grips.find_map(|grip| grip.state.orientation).map(Into::into);
    Some(Reply { device, buttons: buttons.unwrap_or(0), orientation })
}

/// The ids in an inventory, in its order.
pub(crate) fn device_ids(frame: &[u8]) -> Option<Vec<String>> {
    let state: State<'_> = serde_json::from_slice(frame).ok()?;
    Some(state.inverse3.into_iter().map(|entry| entry.device_id.into_owned()).collect())
}

/// Reads a message of the events channel; `Ok(None)` if it means nothing for device `id`.
///
/// # Errors
/// If it is no event.
pub(crate) fn news(frame: &[u8], id: &str) -> serde_json::Result<Option<News>> {
    let event = Value::from(serde_json::from_slice::<Map<String, Value>>(frame)?);
    let data = &event["data"];
    if data["device_id"].as_str().is_some_and(|device| device != id) {
        return Ok(None);
    }
    Ok(match (event["name"].as_str(), data["safety_type"].as_str()) {
        (Some("device-safety-triggered"), Some("ebrake_triggered")) => Some(News::EbrakeTriggered),
        (Some("device-safety-triggered"), Some("ebrake_released")) => Some(News::EbrakeReleased),
        (Some("device-safety-triggered"), Some("fod_stage_changed")) => Some(match event["level"].as_str() {
            Some("info" | "notice") => News::FodLowered,
            _ => News::FodRaised,
        }),
        (Some("device-safety-triggered"), Some("stall_detected")) => Some(News::Stall),
        (Some("device-safety-triggered"), Some("stability_ceiling")) => Some(News::StabilityCeiling),
        (Some("device-safety-triggered"), _) => Some(News::UnknownSafety),
        (Some("device-connected"), _) => Some(News::Connected),
        (Some("device-disconnected"), _) => Some(News::Disconnected),
        (Some("device-busy"), _) => Some(News::Busy),
        _ => None,
    })
}

/// Writes command frames for one device.
#[derive(Clone, Debug)]
pub(crate) struct Commands {
    /// `"session":{...},`, for the first frame of a connection.
    session: String,
    /// `"inverse3":[{"device_id":"...","commands":{`
    device: String,
    max_force_n: f64,
}

impl Commands {
    /// The names go into the frames as they are: their caller has made sure that they need no escape.
    pub(crate) fn new(profile: &str, basis: &str, device_id: &str, max_force_n: f64) -> Self {
        Self {
            session: format!(
                r#""session":{{"configure":{{"profile":{{"name":"{profile}"}},"basis":{{"permutation":"{basis}"}}}}}},"#
            ),
            device: format!(r#""inverse3":[{{"device_id":"{device_id}","commands":{{"#),
            max_force_n,
        }
    }

    /// Writes the one command of a tick to memory: `force` (N), zero in place of one that is not finite, shortened to the limit.
    /// Gives what was written.
    pub(crate) fn force(&self, out: &mut dyn Write, is_first: bool, force: [f64; 3]) -> [f64; 3] {
        let length = force.iter().map(|c| c * c).sum::<f64>().sqrt();
        let [x, y, z] = match length {
            // NaN, infinite, or finite with a square beyond all numbers.
            length if !length.is_finite() => [0.0; 3],
            length if length > self.max_force_n => force.map(|c| c * (self.max_force_n / length)),
            _ => force,
        };
        let (session, device) = (if is_first { &*self.session } else { "" }, &self.device);
        // Writing to memory does not fail; a micronewton is far below what a device resolves.
        let vector = format_args!(r#"{{"x":{x:.6},"y":{y:.6},"z":{z:.6}}}"#);
        let _ = write!(out, r#"{{{session}{device}"set_cursor_force":{{"vector":{vector}}}}}}}]}}"#);
        [x, y, z]
    }

    /// Writes a frame to memory that only asks for the state.
    pub(crate) fn probe(&self, out: &mut dyn Write, is_first: bool) {
        let (session, device) = (if is_first { &*self.session } else { "" }, &self.device);
        let _ = write!(out, r#"{{{session}{device}"probe_position":{{}}}}}}]}}"#);
    }
}

/// True for a name that a frame can hold without an escape.
pub(crate) fn is_plain(name: &str) -> bool {
    !name.is_empty()
        && name.len() <= 64
        && name.bytes().all(|byte| byte.is_ascii_alphanumeric() || b"._:-+/ ".contains(&byte))
}

#[cfg(test)]
mod tests {
    use super::*;

    const STATE: &str = r#"{"session_id":7,"inverse3":[{"device_id":"04C3","state":{"angular_position":{"a0":-89.6,"a1":222.8,
        "a2":-22.7},"cursor_position":{"x":9,"y":9,"z":9},"cursor_velocity":{"x":0,"y":0,"z":0}},"status":{"ready":false}},
        {"device_id":"049D","config":{"type":"inverse3","device_info":{"id":"049D"}},"state":{"cursor_position":{"x":0.12794551,
        "y":0.038903017,"z":-0.05089721},"cursor_velocity":{"x":-0.00018,"y":-2.3e-5,"z":0},"mode":"idle","transform":{}},
        "status":{"calibrated":true,"in_use":false,"power_supply":true,"ready":true,"started":true}}],
        "verse_grip":[],"wireless_verse_grip":[{"device_id":"1102","state":{"buttons":{"a":true,"b":false,"c":true},"hall":16}}],
        "custom_verse_grip":[{"state":{"buttons":[7]}}]}"#;

    #[test]
    fn a_state_gives_the_wanted_device_and_the_buttons() {
        let position_m = [0.12794551, 0.038903017, -0.05089721];
        let velocity_m_s = [-0.00018, -2.3e-5, 0.0];
        let device = Inverse { position_m, velocity_m_s, is_calibrated: true, is_ready: true, is_powered: true };
        assert_eq!(
            reply(STATE.as_bytes(), "049D"),
            Some(Reply { device: Some(device), buttons: 0b101, orientation: None })
        );
        assert_eq!(device_ids(STATE.as_bytes()).unwrap(), ["04C3", "049D"]);
        let one = STATE.replace(r#"{"a":true,"b":false,"c":true}"#, r#"null,"button":true"#);
        assert_eq!(reply(one.as_bytes(), "049D").unwrap().buttons, 1);
    }

    #[test]
    fn a_grip_tells_how_it_is_turned_or_nothing() {
        let told = |orientation: &str| {
            let state = STATE.replace(r#""hall":16"#, &format!(r#""hall":16,"orientation":{orientation}"#));
            reply(state.as_bytes(), "049D").unwrap().orientation
        };
        assert_eq!(told(r#"{"x":0,"y":0.6,"z":0,"w":0.8}"#), Some([0.8, 0.0, 0.6, 0.0]));
        for none in [r#"{"x":0,"y":0,"z":0,"w":0}"#, "{}", "null", "[1,0,0]", r#"{"a0":0,"a1":1}"#] {
            assert_eq!(told(none), None, "{none}");
        }
    }

    #[test]
    fn another_device_is_not_ours_and_half_a_frame_is_none() {
        assert_eq!(reply(STATE.as_bytes(), "FFFF").unwrap().device, None);
        let other = reply(STATE.as_bytes(), "04C3").unwrap().device.unwrap();
        // What its status does not say is not so.
        assert!(!other.is_calibrated && !other.is_ready && !other.is_powered, "{other:?}");
        for length in 0..STATE.len() {
            assert_eq!(reply(&STATE.as_bytes()[..length], "049D"), None, "{length}");
        }
        for bad in ["NaN", "1e999", "null", "\"1\"", "Infinity", "0x10"] {
            assert_eq!(reply(STATE.replace("0.12794551", bad).as_bytes(), "049D"), None, "{bad}");
        }
    }

    #[test]
    fn the_first_command_is_the_documented_handshake_and_the_later_ones_have_no_session() {
        let commands = Commands::new("co.example:app", "XYZ", "049D", 5.0);
        let mut out = Vec::new();
        assert_eq!(commands.force(&mut out, true, [0.0; 3]), [0.0; 3]);
        assert_eq!(
            String::from_utf8(out).unwrap(),
            concat!(
                r#"{"session":{"configure":{"profile":{"name":"co.example:app"},"basis":{"permutation":"XYZ"}}},"#,
                r#""inverse3":[{"device_id":"049D","commands":{"set_cursor_force":{"vector":"#,
                r#"{"x":0.000000,"y":0.000000,"z":0.000000}}}}]}"#
            )
        );
        let mut out = Vec::new();
        commands.probe(&mut out, false);
        assert_eq!(out, br#"{"inverse3":[{"device_id":"049D","commands":{"probe_position":{}}}]}"#);
    }

    #[test]
    fn no_force_that_is_not_finite_or_too_large_is_ever_written() {
        let commands = Commands::new("p", "XYZ", "049D", 5.0);
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, f64::MAX, -1e200] {
            let mut out = Vec::new();
            assert_eq!(commands.force(&mut out, false, [1.0, bad, 0.0]), [0.0; 3], "{bad}");
            let text = String::from_utf8(out).unwrap();
            assert!(text.contains(r#"{"x":0.000000,"y":0.000000,"z":0.000000}"#), "{text}");
        }
        assert_eq!(commands.force(&mut Vec::new(), false, [0.0, -30.0, 40.0]), [0.0, -3.0, 4.0]);
    }

    #[test]
    fn every_safety_event_and_every_way_of_losing_a_device_is_told_apart() {
        let event = |name: &str, level: &str, data: &str| {
            let text = format!(
                r#"{{"name":"{name}","category":"device","level":"{level}","data":{{{data}}},"message":"x: \"y\""}}"#
            );
            news(text.as_bytes(), "049D").unwrap()
        };
        let safety = |kind: &str, level: &str| {
            event("device-safety-triggered", level, &format!(r#""device_id":"049D","safety_type":"{kind}""#))
        };
        assert_eq!(safety("ebrake_triggered", "error"), Some(News::EbrakeTriggered));
        assert_eq!(safety("ebrake_released", "notice"), Some(News::EbrakeReleased));
        assert_eq!(safety("fod_stage_changed", "warning"), Some(News::FodRaised));
        assert_eq!(safety("fod_stage_changed", "info"), Some(News::FodLowered));
        assert_eq!(safety("stall_detected", "warning"), Some(News::Stall));
        assert_eq!(safety("stability_ceiling", "warning"), Some(News::StabilityCeiling));
        assert_eq!(safety("something_new", "panic"), Some(News::UnknownSafety));
        let ours = r#""device_family":"inverse","device_id":"049D""#;
        assert_eq!(event("device-connected", "info", ours), Some(News::Connected));
        assert_eq!(event("device-disconnected", "warning", ours), Some(News::Disconnected));
        assert_eq!(event("device-busy", "warning", ours), Some(News::Busy));
        // Check that what concerns another device, or nobody that is known, is tolerated
        assert_eq!(event("device-disconnected", "warning", r#""device_id":"1102""#), None);
        assert_eq!(event("system-rate-report", "info", r#""mean_frequency":4000"#), None);
        assert_eq!(news(br#"{"name":"session-new","data":[1]}"#, "049D").unwrap(), None);
        assert!(news(b"garbage", "049D").is_err() && news(b"[]", "049D").is_err());
    }
}
