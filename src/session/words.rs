//! Errors of a session that a program built, in the words of the builder: the fields of scenes are not what it wrote.

use crate::error::Error;
use crate::model::local::{BlendKind, Kind};
use crate::scene::Scene;

/// Fields of scenes, and what sets them on a builder; a field comes before those that it begins with.
const CALLS: &[(&str, &str)] = &[
    ("global.substeps_per_ms", "substeps_per_ms()"),
    ("global.compute_latency_ms", "global()"),
    ("global.rate_hz", "global()"),
    ("local.rate_hz", "local()"),
    ("local.model", "model()"),
    ("local.error_pct", "error_pct()"),
    ("local.patch", "patch()"),
    ("local.basis", "basis()"),
    ("local.feedback", "feedback()"),
    ("local.step", "local_step()"),
    ("local.coupling", "coupling()"),
    ("contact.friction", "friction()"),
    ("contact.static_friction", "static_friction()"),
    ("contact.stribeck_m_s", "stribeck_m_s()"),
    ("safety.off", "safety_off()"),
    ("run.duration_s", "duration_s()"),
    ("device.attach_node", "attach_node()"),
    ("device.tool", "tool()"),
    ("device.path_csv", "path()"),
    ("virtual time (--virtual)", "virtual time (virtual_time())"),
    ("a path_csv, an attach_node or", "a path(), an attach_node() or"),
];

/// `error` of a session whose scene is a program's own.
pub(super) fn of_builder(error: Error, scene: &Scene) -> Error {
    error.reworded(|text| in_calls(text, scene.local.blend.kind))
}

/// `text` with the calls of a builder in the place of fields.
pub(super) fn in_calls(text: &str, blend: BlendKind) -> String {
    let blend = if blend == BlendKind::Offset { "offset_ms()" } else { "crossfade_ms()" };
    let mut text = text.replace("local.blend.ms", blend).replace("local.blend", blend);
    for (field, call) in CALLS {
        text = text.replace(field, call);
    }
    for kind in Kind::ALL {
        text = text.replace(&format!("model = {:?}", kind.name()), &format!("model(Kind::{kind:?})"));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_become_calls_wherever_they_are_named() {
        let words = |text| in_calls(text, BlendKind::Offset);
        assert_eq!(
            words("local.rate_hz: is 20, must be at least global.rate_hz, 30"),
            "local(): is 20, must be at least global(), 30"
        );
        assert_eq!(words("local.blend.ms: is 0"), "offset_ms(): is 0");
        assert_eq!(words("or model = \"scaled_boundary\""), "or model(Kind::ScaledBoundary)");
        assert_eq!(words("device.tool.radius_m: is -1"), "tool().radius_m: is -1");
    }
}
