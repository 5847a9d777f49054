//! What a client's message asks for.

use super::super::json::{Json, Malformed};

/// One message, as far as the mock follows it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Request {
    /// It opens a session: profile, basis and the like.
    pub(super) configures_session: bool,
    /// It asks for the configuration of every device once more.
    pub(super) wants_inventory: bool,
    /// `set_*` commands for the device: two of them conflict.
    pub(super) set_commands: u32,
    /// The force of `set_cursor_force` (N), if it is to be executed.
    pub(super) force_n: Option<[f64; 3]>,
    pub(super) is_probe: bool,
}

/// Reads a message for the device `id`.
pub(super) fn request(message: &[u8], id: &str) -> Result<Request, Malformed> {
    let mut request = Request::default();
    let mut json = Json::new(message);
    json.object(|json, key| match key {
        b"session" => json.object(|json, key| {
            request.configures_session |= key == b"configure";
            request.wants_inventory |= key == b"force_render_full_state";
            json.skip()
        }),
        b"inverse3" => json.array(|json| {
            let entry = entry(json, id)?;
            if let Some(entry) = entry {
                request.set_commands += entry.set_commands;
                request.force_n = entry.force_n.or(request.force_n);
                request.is_probe |= entry.is_probe;
            }
            Ok(())
        }),
        _ => json.skip(),
    })?;
    json.end()?;
    Ok(request)
}

fn entry(json: &mut Json<'_>, id: &str) -> Result<Option<Request>, Malformed> {
    let (mut is_wanted, mut request) = (false, Request::default());
    json.object(|json, key| match key {
        b"device_id" => json.string().map(|found| is_wanted = found == id.as_bytes()),
        b"commands" => json.object(|json, key| {
            request.set_commands += u32::from(key.starts_with(b"set_"));
            request.is_probe |= key == b"probe_position";
            match key {
                b"set_cursor_force" => {
                    let (mut force, mut executes) = (None, true);
                    json.object(|json, key| match key {
                        b"vector" => json.vector().map(|vector| force = Some(vector)),
                        b"execute" => json.boolean().map(|execute| executes = execute),
                        _ => json.skip(),
                    })?;
                    request.force_n = force.filter(|_| executes);
                    Ok(())
                }
                _ => json.skip(),
            }
        }),
        _ => json.skip(),
    })?;
    Ok(is_wanted.then_some(request))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forces_probes_and_conflicts_are_told_apart() {
        let first = br#"{"session":{"configure":{"profile":{"name":"p"}}},"inverse3":[{"device_id":"049D","commands":
            {"set_cursor_force":{"vector":{"x":1,"y":-2,"z":0.5}}}}]}"#;
        let asked = Request {
            configures_session: true,
            set_commands: 1,
            force_n: Some([1.0, -2.0, 0.5]),
            ..Request::default()
        };
        assert_eq!(request(first, "049D"), Ok(asked));
        assert_eq!(request(first, "FFFF"), Ok(Request { configures_session: true, ..Request::default() }));
        let probe = br#"{"session":{"force_render_full_state":{}},"inverse3":[{"device_id":"1","commands":{"probe_position":{}}}]}"#;
        assert_eq!(request(probe, "1"), Ok(Request { wants_inventory: true, is_probe: true, ..Request::default() }));
        let both = br#"{"inverse3":[{"device_id":"1","commands":{"set_cursor_force":{"vector":{"x":0,"y":0,"z":0},
            "execute":false},"set_cursor_position":{"position":{"x":0,"y":0,"z":0}}}}]}"#;
        assert_eq!(request(both, "1"), Ok(Request { set_commands: 2, ..Request::default() }));
        assert!(request(b"{\"inverse3\":[{]}", "1").is_err());
    }
}
