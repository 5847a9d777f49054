//! A picture of the run as `foxglove.SceneUpdate`: entities `surface`, `tool` and `force`, each replacing the one before.

use super::foxglove::{
    ArrowPrimitive, Color, Duration, KeyValuePair, Point3, Pose, Quaternion, SceneEntity, SceneUpdate, SpherePrimitive,
    TriangleListPrimitive, Vector3,
};
use super::viewer::{FRAME, UPRIGHT, timestamp, vector};
use super::wire::Fixed32s;
use crate::log::records::{SceneFrame, SceneTool};
use crate::runtime::Nanos;

const FLESH: Color = Color { r: 0.85, g: 0.55, b: 0.48, a: 1.0 };
const STEEL: Color = Color { r: 0.35, g: 0.4, b: 0.45, a: 1.0 };
const SIGNAL: Color = Color { r: 0.95, g: 0.75, b: 0.1, a: 1.0 };

/// The head takes this share of an arrow.
const HEAD_SHARE: f64 = 0.25;
/// Diameters of an arrow, in diameters of the tool.
const SHAFT: f64 = 0.4;
const HEAD: f64 = 0.9;

impl SceneUpdate {
    /// The picture of a run that started at `epoch_ns`. A tool or a force that is no number is not drawn.
    pub(crate) fn of(frame: &SceneFrame, epoch_ns: u64) -> Self {
        let mut entities = vec![surface(frame, epoch_ns)];
        for tool in &frame.tools {
            let is_finite = |v: [f64; 3]| v.iter().all(|x| x.is_finite());
            if is_finite(tool.position_m) {
                entities.push(sphere(tool, frame.tool_size_m, epoch_ns));
                let force_n = if is_finite(tool.force_n) { tool.force_n } else { [0.0; 3] };
                entities.push(arrow(tool, force_n, frame.tool_size_m, epoch_ns));
            }
        }
        Self { deletions: Vec::new(), entities, time_ns: frame.time }
    }
}

fn entity(id: String, time: Nanos, epoch_ns: u64) -> SceneEntity {
    SceneEntity {
        timestamp: timestamp(epoch_ns, time),
        frame_id: FRAME.into(),
        id,
        // For ever, until the next of this id.
        lifetime: Duration::default(),
        ..SceneEntity::default()
    }
}

fn surface(frame: &SceneFrame, epoch_ns: u64) -> SceneEntity {
    let mesh = TriangleListPrimitive {
        pose: Pose { position: Vector3::default(), orientation: UPRIGHT },
        points: frame.points.iter().map(|&[x, y, z]| Point3 { x, y, z }).collect(),
        color: FLESH,
        colors: Vec::new(),
        indices: Fixed32s(frame.triangles.iter().flatten().copied().collect()),
    };
    SceneEntity { triangles: vec![mesh], ..entity("surface".into(), frame.surface_time, epoch_ns) }
}

fn sphere(tool: &SceneTool, size_m: f64, epoch_ns: u64) -> SceneEntity {
    let ball = SpherePrimitive {
        pose: Pose { position: vector(tool.position_m), orientation: UPRIGHT },
        size: vector([size_m; 3]),
        color: STEEL,
    };
    SceneEntity { spheres: vec![ball], ..entity(format!("{}tool", tool.prefix), tool.time, epoch_ns) }
}

/// From the tool in the direction of the force on it.
fn arrow(tool: &SceneTool, force_n: [f64; 3], size_m: f64, epoch_ns: u64) -> SceneEntity {
    let [x, y, z] = force_n;
    let magnitude = x.hypot(y).hypot(z);
    let length = magnitude * SceneFrame::FORCE_SCALE_M_PER_N;
    let arrow = ArrowPrimitive {
        pose: Pose { position: vector(tool.position_m), orientation: from_x_to(force_n, magnitude) },
        shaft_length: (1.0 - HEAD_SHARE) * length,
        shaft_diameter: SHAFT * size_m,
        head_length: HEAD_SHARE * length,
        head_diameter: HEAD * size_m,
        color: SIGNAL,
    };
    let scale = KeyValuePair { key: "scale_m_per_n".into(), value: SceneFrame::FORCE_SCALE_M_PER_N.to_string() };
    let force = KeyValuePair { key: "force_n".into(), value: magnitude.to_string() };
    SceneEntity {
        metadata: vec![scale, force],
        arrows: vec![arrow],
        ..entity(format!("{}force", tool.prefix), tool.time, epoch_ns)
    }
}

/// The shortest rotation of the x axis to `v`, which is `length` long; none for no vector.
fn from_x_to(v: [f64; 3], length: f64) -> Quaternion {
    if length <= f64::MIN_POSITIVE {
        return UPRIGHT;
    }
    let [x, y, z] = v.map(|component| component / length);
    // The half-angle form: axis x cross v, w = 1 + x dot v, then to unit length.
    let w = 1.0 + x;
    if w < 1e-9 {
        return Quaternion { x: 0.0, y: 0.0, z: 1.0, w: 0.0 };
    }
    let scale = 1.0 / y.hypot(z).hypot(w);
    Quaternion { x: 0.0, y: -z * scale, z: y * scale, w: w * scale }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::log::magnitude;

    /// The x axis turned by `q`.
    fn x_axis(q: &Quaternion) -> [f64; 3] {
        let Quaternion { x, y, z, w } = *q;
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)]
    }

    #[test]
    fn an_arrow_points_along_the_force_and_is_as_long_as_the_scale_says() {
        let forces = [[1.0, 0.0, 0.0], [-2.0, 0.0, 0.0], [-1.0, 1e-7, 0.0], [0.3, -0.4, 1.2], [0.0, 0.0, -1e-9]];
        for force_n in forces {
            let tool = SceneTool { force_n, position_m: [1.0, 2.0, 3.0], ..SceneTool::default() };
            let entity = arrow(&tool, force_n, 0.004, 0);
            let drawn = &entity.arrows[0];
            let magnitude = magnitude(force_n);
            let length = drawn.shaft_length + drawn.head_length;
            assert!((length - 0.02 * magnitude).abs() <= 1e-15, "{force_n:?}: {length}");
            let direction = x_axis(&drawn.pose.orientation);
            for (got, wanted) in direction.iter().zip(force_n) {
                assert!((got - wanted / magnitude).abs() < 1e-7, "{force_n:?}: {direction:?}");
            }
        }
    }

    #[test]
    fn no_force_is_an_arrow_of_no_length_and_what_is_no_number_is_not_drawn() {
        let tool = |prefix: &str, position_m, force_n| SceneTool {
            prefix: prefix.into(),
            position_m,
            force_n,
            ..SceneTool::default()
        };
        let frame = SceneFrame {
            tools: vec![
                tool("a/", [0.0; 3], [0.0; 3]),
                tool("b/", [0.0; 3], [f64::NAN, 0.0, 0.0]),
                tool("c/", [f64::INFINITY, 0.0, 0.0], [0.0; 3]),
            ],
            ..SceneFrame::default()
        };
        let update = SceneUpdate::of(&frame, 0);
        let ids: Vec<_> = update.entities.iter().map(|entity| entity.id.as_str()).collect();
        assert_eq!(ids, ["surface", "a/tool", "a/force", "b/tool", "b/force"]);
        for entity in [&update.entities[2], &update.entities[4]] {
            let drawn = &entity.arrows[0];
            assert_eq!((drawn.shaft_length, drawn.head_length, &drawn.pose.orientation), (0.0, 0.0, &UPRIGHT));
        }
    }
}
