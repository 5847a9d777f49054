//! The messages of the Haply Inverse service 3.5: commands written into a reused buffer, states and events read from one.
//!
//! Source: the vendor's pages on the simulation and the events channel, and the wire types of its crate `haply` 1.3.1.

use super::json::{Json, Malformed};
use std::io::Write;

/// What is needed of one state frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Reply {
    /// The device, if the frame lists it.
    pub(super) device: Option<Inverse>,
    /// Buttons of the first grip, a bit each: a (or the only one), b, c.
    pub(super) buttons: u16,
}

/// One Inverse3.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Inverse {
    /// Cursor in the session's basis, from the device's base (m).
    pub(super) position_m: [f64; 3],
    /// Its velocity (m/s).
    pub(super) velocity_m_s: [f64; 3],
    /// It knows where it is.
    pub(super) is_calibrated: bool,
    /// Calibrated, started and ready: its state means something.
    pub(super) is_ready: bool,
    /// And powered: it follows commands.
    pub(super) is_powered: bool,
}

/// What a message of the events channel means for a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Notice {
    /// The emergency brake is on.
    EbrakeTriggered,
    /// It is off again.
    EbrakeReleased,
    /// The FOD stage went up to high risk (level warning and above).
    FodRaised,
    /// It went back to low risk (level info or notice).
    FodLowered,
    /// A motor stalled.
    Stall,
    /// The device reached its stability ceiling.
    StabilityCeiling,
    /// A safety event that was not known when this was written.
    UnknownSafety,
    /// The device is there.
    Connected,
    /// The device is gone.
    Disconnected,
    /// Another session has it.
    Busy,
}

/// Reads a state frame; `id` is the device that is wanted.
pub(super) fn reply(frame: &[u8], id: &str) -> Result<Reply, Malformed> {
    let mut reply = Reply::default();
    let mut json = Json::new(frame);
    json.object(|json, key| match key {
        b"inverse3" => json.array(|json| {
            if let Some(device) = inverse(json, id)? {
                reply.device = Some(device);
            }
            Ok(())
        }),
        b"verse_grip" | b"wireless_verse_grip" | b"custom_verse_grip" => json.array(|json| {
            let pressed = grip(json)?;
            if reply.buttons == 0 {
                reply.buttons = pressed;
            }
            Ok(())
        }),
        _ => json.skip(),
    })?;
    json.end()?;
    Ok(reply)
}

/// One entry of `inverse3`; `None` if it is another device.
fn inverse(json: &mut Json<'_>, id: &str) -> Result<Option<Inverse>, Malformed> {
    let (mut is_wanted, mut position, mut velocity, mut status) = (false, None, None, None);
    json.object(|json, key| match key {
        b"device_id" => {
            is_wanted = json.string()? == id.as_bytes();
            Ok(())
        }
        b"state" => json.object(|json, key| {
            match key {
                b"cursor_position" => position = Some(json.vector()?),
                b"cursor_velocity" => velocity = Some(json.vector()?),
                _ => json.skip()?,
            }
            Ok(())
        }),
        b"status" => {
            // What is not said is not so; only a device without a supply of its own need not speak of it.
            let mut found = Inverse { is_powered: true, ..Inverse::default() };
            let (mut is_ready, mut is_started) = (false, false);
            json.object(|json, key| {
                match key {
                    b"calibrated" => found.is_calibrated = json.boolean()?,
                    b"ready" => is_ready = json.boolean()?,
                    b"started" => is_started = json.boolean()?,
                    b"power_supply" => found.is_powered = json.boolean()?,
                    _ => json.skip()?,
                }
                Ok(())
            })?;
            found.is_ready = is_ready && is_started && found.is_calibrated;
            found.is_powered &= found.is_ready;
            status = Some(found);
            Ok(())
        }
        _ => json.skip(),
    })?;
    if !is_wanted {
        return Ok(None);
    }
    let (Some(position_m), Some(velocity_m_s), Some(status)) = (position, velocity, status) else {
        return Err(Malformed);
    };
    Ok(Some(Inverse { position_m, velocity_m_s, ..status }))
}

/// The buttons of one grip.
fn grip(json: &mut Json<'_>) -> Result<u16, Malformed> {
    let mut pressed = 0;
    json.object(|json, key| match key {
        b"state" => json.object(|json, key| match key {
            b"button" if json.peek()? != b'n' => {
                pressed |= u16::from(json.boolean()?);
                Ok(())
            }
            b"buttons" if json.peek()? == b'{' => json.object(|json, key| {
                let bit = match key {
                    b"a" => 0,
                    b"b" => 1,
                    b"c" => 2,
                    _ => return json.skip(),
                };
                pressed |= u16::from(json.boolean()?) << bit;
                Ok(())
            }),
            _ => json.skip(),
        }),
        _ => json.skip(),
    })?;
    Ok(pressed)
}

/// The ids in an inventory, in its order.
pub(super) fn device_ids(frame: &[u8]) -> Result<Vec<String>, Malformed> {
    let mut ids = Vec::new();
    Json::new(frame).object(|json, key| match key {
        b"inverse3" => json.array(|json| {
            json.object(|json, key| match key {
                b"device_id" => {
                    ids.push(String::from_utf8_lossy(json.string()?).into_owned());
                    Ok(())
                }
                _ => json.skip(),
            })
        }),
        _ => json.skip(),
    })?;
    Ok(ids)
}

/// Reads a message of the events channel; `None` if it means nothing for device `id`.
pub(super) fn notice(frame: &[u8], id: &str) -> Result<Option<Notice>, Malformed> {
    let (mut name, mut level, mut device, mut safety) = (&b""[..], &b""[..], None, &b""[..]);
    let mut json = Json::new(frame);
    json.object(|json, key| match key {
        b"name" => json.string().map(|text| name = text),
        b"level" => json.string().map(|text| level = text),
        b"data" if json.peek()? == b'{' => json.object(|json, key| match key {
            b"device_id" => json.string().map(|text| device = Some(text)),
            b"safety_type" => json.string().map(|text| safety = text),
            _ => json.skip(),
        }),
        _ => json.skip(),
    })?;
    json.end()?;
    if device.is_some_and(|device| device != id.as_bytes()) {
        return Ok(None);
    }
    Ok(match (name, safety) {
        (b"device-safety-triggered", b"ebrake_triggered") => Some(Notice::EbrakeTriggered),
        (b"device-safety-triggered", b"ebrake_released") => Some(Notice::EbrakeReleased),
        (b"device-safety-triggered", b"fod_stage_changed") => Some(match level {
            b"info" | b"notice" => Notice::FodLowered,
            _ => Notice::FodRaised,
        }),
        (b"device-safety-triggered", b"stall_detected") => Some(Notice::Stall),
        (b"device-safety-triggered", b"stability_ceiling") => Some(Notice::StabilityCeiling),
        (b"device-safety-triggered", _) => Some(Notice::UnknownSafety),
        (b"device-connected", _) => Some(Notice::Connected),
        (b"device-disconnected", _) => Some(Notice::Disconnected),
        (b"device-busy", _) => Some(Notice::Busy),
        _ => None,
    })
}

/// Writes command frames for one device.
#[derive(Clone, Debug)]
pub(super) struct Commands {
    /// `"session":{...},`, for the first frame of a connection.
    session: String,
    /// `"inverse3":[{"device_id":"...","commands":{`
    device: String,
    max_force_n: f64,
}

impl Commands {
    /// The names go into the frames as they are: their caller has made sure that they need no escape.
    pub(super) fn new(profile: &str, basis: &str, device_id: &str, max_force_n: f64) -> Self {
        Self {
            session: format!(
                r#""session":{{"configure":{{"profile":{{"name":"{profile}"}},"basis":{{"permutation":"{basis}"}}}}}},"#
            ),
            device: format!(r#""inverse3":[{{"device_id":"{device_id}","commands":{{"#),
            max_force_n,
        }
    }

    /// Appends the one command of a tick: `force` (N), zero in place of one that is not finite, shortened to the limit. Gives
    /// what was written.
    pub(super) fn force(&self, out: &mut Vec<u8>, is_first: bool, force: [f64; 3]) -> [f64; 3] {
        let length = force.iter().map(|c| c * c).sum::<f64>().sqrt();
        let [x, y, z] = match length {
            // NaN, infinite, or finite with a square beyond all numbers.
            length if !length.is_finite() => [0.0; 3],
            length if length > self.max_force_n => force.map(|c| c * (self.max_force_n / length)),
            _ => force,
        };
        self.begin(out, is_first);
        // Writing to memory does not fail; a micronewton is far below what a device resolves.
        let _ = write!(out, r#""set_cursor_force":{{"vector":{{"x":{x:.6},"y":{y:.6},"z":{z:.6}}}}}"#);
        out.extend_from_slice(b"}}]}");
        [x, y, z]
    }

    /// Appends a frame that only asks for the state.
    pub(super) fn probe(&self, out: &mut Vec<u8>, is_first: bool) {
        self.begin(out, is_first);
        out.extend_from_slice(br#""probe_position":{}}}]}"#);
    }

    fn begin(&self, out: &mut Vec<u8>, is_first: bool) {
        out.push(b'{');
        if is_first {
            out.extend_from_slice(self.session.as_bytes());
        }
        out.extend_from_slice(self.device.as_bytes());
    }
}

/// True for a name that a frame can hold without an escape.
pub(super) fn is_plain(name: &str) -> bool {
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
        "verse_grip":[],"wireless_verse_grip":[{"device_id":"1102","state":{"buttons":{"a":true,"b":false,"c":true},"hall":16}}]}"#;

    #[test]
    fn a_state_gives_the_wanted_device_and_the_buttons() {
        let reply = reply(STATE.as_bytes(), "049D").unwrap();
        let position_m = [0.12794551, 0.038903017, -0.05089721];
        let velocity_m_s = [-0.00018, -2.3e-5, 0.0];
        let device = Inverse { position_m, velocity_m_s, is_calibrated: true, is_ready: true, is_powered: true };
        assert_eq!(reply, Reply { device: Some(device), buttons: 0b101 });
        assert_eq!(device_ids(STATE.as_bytes()).unwrap(), ["04C3", "049D"]);
    }

    #[test]
    fn another_device_is_not_ours_and_half_a_frame_is_none() {
        assert_eq!(reply(STATE.as_bytes(), "FFFF").unwrap().device, None);
        let other = reply(STATE.as_bytes(), "04C3").unwrap().device.unwrap();
        // What its status does not say is not so.
        assert!(!other.is_calibrated && !other.is_ready && !other.is_powered, "{other:?}");
        for length in 0..STATE.len() {
            assert!(reply(&STATE.as_bytes()[..length], "049D").is_err(), "{length}");
        }
        let not_finite = STATE.replace("0.12794551", "NaN");
        assert!(reply(not_finite.as_bytes(), "049D").is_err());
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
        assert_eq!(
            String::from_utf8(out).unwrap(),
            r#"{"inverse3":[{"device_id":"049D","commands":{"probe_position":{}}}]}"#
        );
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
        let mut out = Vec::new();
        assert_eq!(commands.force(&mut out, false, [0.0, -30.0, 40.0]), [0.0, -3.0, 4.0]);
    }

    #[test]
    fn every_safety_event_and_every_way_of_losing_a_device_is_told_apart() {
        let event = |name: &str, level: &str, data: &str| {
            let text = format!(
                r#"{{"name":"{name}","category":"device","level":"{level}","data":{{{data}}},"message":"x: \"y\""}}"#
            );
            notice(text.as_bytes(), "049D").unwrap()
        };
        let safety = |kind: &str, level: &str| {
            event("device-safety-triggered", level, &format!(r#""device_id":"049D","safety_type":"{kind}""#))
        };
        assert_eq!(safety("ebrake_triggered", "error"), Some(Notice::EbrakeTriggered));
        assert_eq!(safety("ebrake_released", "notice"), Some(Notice::EbrakeReleased));
        assert_eq!(safety("fod_stage_changed", "warning"), Some(Notice::FodRaised));
        assert_eq!(safety("fod_stage_changed", "info"), Some(Notice::FodLowered));
        assert_eq!(safety("stall_detected", "warning"), Some(Notice::Stall));
        assert_eq!(safety("stability_ceiling", "warning"), Some(Notice::StabilityCeiling));
        assert_eq!(safety("something_new", "panic"), Some(Notice::UnknownSafety));
        let ours = r#""device_family":"inverse","device_id":"049D""#;
        assert_eq!(event("device-connected", "info", ours), Some(Notice::Connected));
        assert_eq!(event("device-disconnected", "warning", ours), Some(Notice::Disconnected));
        assert_eq!(event("device-busy", "warning", ours), Some(Notice::Busy));
        // Check that what concerns another device, or nobody that is known, is tolerated
        assert_eq!(event("device-disconnected", "warning", r#""device_id":"1102""#), None);
        assert_eq!(event("system-rate-report", "info", r#""mean_frequency":4000"#), None);
        assert_eq!(notice(br#"{"name":"session-new","data":[1]}"#, "049D"), Ok(None));
        assert_eq!(notice(b"garbage", "049D"), Err(Malformed));
    }
}
