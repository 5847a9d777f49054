//! A picture of the run as `foxglove.SceneUpdate`: entities `surface`, `tool`, `force` and, of a tool with a shape, `contacts`,
//! each replacing the one before.

use super::foxglove::{
    ArrowPrimitive, Color, CylinderPrimitive, Duration, KeyValuePair, Point3, Pose, Quaternion, SceneEntity,
    SceneUpdate, SpherePrimitive, TriangleListPrimitive, Vector3,
};
use super::viewer::{FRAME, UPRIGHT, timestamp, vector};
use super::wire::Fixed32s;
use crate::log::records::{ContactPointSample, SceneFrame, SceneTool};
use crate::model::contact::ToolShape;
use crate::model::{Turn, Vec3};
use crate::runtime::Nanos;

const FLESH: Color = Color { r: 0.85, g: 0.55, b: 0.48, a: 1.0 };
const STEEL: Color = Color { r: 0.35, g: 0.4, b: 0.45, a: 1.0 };
const SIGNAL: Color = Color { r: 0.95, g: 0.75, b: 0.1, a: 1.0 };

/// The head takes this share of an arrow.
const HEAD_SHARE: f64 = 0.25;
/// Diameters of an arrow, in diameters of the tool.
const SHAFT: f64 = 0.4;
const HEAD: f64 = 0.9;
/// The place of a contact, and the diameters of its arrow, in those of a tool and its arrow.
const PLACE: f64 = 0.35;

impl SceneUpdate {
    /// The picture of a run that started at `epoch_ns`. A tool or a force that is no number is not drawn.
    pub(crate) fn of(frame: &SceneFrame, epoch_ns: u64) -> Self {
        let mut entities = vec![surface(frame, epoch_ns)];
        for tool in &frame.tools {
            let is_finite = |v: [f64; 3]| v.iter().all(|x| x.is_finite());
            if is_finite(tool.position_m) {
                entities.push(body(tool, frame.tool_size_m, epoch_ns));
                let force_n = if is_finite(tool.force_n) { tool.force_n } else { [0.0; 3] };
                entities.push(force(tool, force_n, frame.tool_size_m, epoch_ns));
                if tool.shape != ToolShape::Point {
                    entities.push(contacts(tool, PLACE * frame.tool_size_m, epoch_ns));
                }
            }
        }
        Self { deletions: Vec::new(), entities, time_ns: frame.time }
    }

    /// The picture's surface, as it was written; `None` if it has none, or if a corner is none of its points.
    pub(crate) fn surface(self) -> Option<SceneFrame> {
        let entity = self.entities.into_iter().find(|entity| entity.id == "surface")?;
        let mesh = entity.triangles.into_iter().next()?;
        let corners = mesh.indices.0.as_chunks::<3>().0;
        let points: Vec<[f64; 3]> = mesh.points.iter().map(|point| [point.x, point.y, point.z]).collect();
        let is_whole = corners.iter().flatten().all(|&corner| (corner as usize) < points.len())
            && points.iter().flatten().all(|c| c.is_finite());
        is_whole.then(|| SceneFrame {
            time: self.time_ns,
            surface_time: self.time_ns,
            triangles: corners.into(),
            points,
            ..SceneFrame::default()
        })
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

/// The tool in its shape; a point as a sphere that can be seen.
fn body(tool: &SceneTool, point_size_m: f64, epoch_ns: u64) -> SceneEntity {
    let entity = entity(format!("{}tool", tool.prefix), tool.time, epoch_ns);
    match tool.shape {
        ToolShape::Point => SceneEntity { spheres: vec![ball(tool.position_m, point_size_m, STEEL)], ..entity },
        ToolShape::Sphere { radius } => {
            SceneEntity { spheres: vec![ball(tool.position_m, 2.0 * radius, STEEL)], ..entity }
        }
        ToolShape::Capsule { radius, half_axis } => {
            let [w, x, y, z] = tool.orientation;
            let turn = Turn::from_quaternion([x, y, z, w].into());
            let (centre, half) = (Vec3::from(tool.position_m), turn * half_axis);
            let upright = Turn::rotation_between(&Vec3::z(), &half);
            // Half a turn about any axis across, if it points down.
            let along = upright.unwrap_or_else(|| Turn::from_axis_angle(&Vec3::x_axis(), std::f64::consts::PI));
            let [x, y, z, w] = along.into_inner().coords.into();
            let cylinder = CylinderPrimitive {
                pose: Pose { position: vector(tool.position_m), orientation: Quaternion { x, y, z, w } },
                size: vector([2.0 * radius, 2.0 * radius, 2.0 * half_axis.norm()]),
                bottom_scale: 1.0,
                top_scale: 1.0,
                color: STEEL,
            };
            let ends = [centre - half, centre + half].map(|end| ball(end.into(), 2.0 * radius, STEEL));
            SceneEntity { spheres: ends.into(), cylinders: vec![cylinder], ..entity }
        }
    }
}

fn ball(at_m: [f64; 3], diameter_m: f64, color: Color) -> SpherePrimitive {
    SpherePrimitive {
        pose: Pose { position: vector(at_m), orientation: UPRIGHT },
        size: vector([diameter_m; 3]),
        color,
    }
}

/// From the tool in the direction of the force on it.
fn force(tool: &SceneTool, force_n: [f64; 3], size_m: f64, epoch_ns: u64) -> SceneEntity {
    let (arrow, magnitude) = arrow(tool.position_m, force_n, size_m);
    let scale = KeyValuePair { key: "scale_m_per_n".into(), value: SceneFrame::FORCE_SCALE_M_PER_N.to_string() };
    let force = KeyValuePair { key: "force_n".into(), value: magnitude.to_string() };
    SceneEntity {
        metadata: vec![scale, force],
        arrows: vec![arrow],
        ..entity(format!("{}force", tool.prefix), tool.time, epoch_ns)
    }
}

/// The places that touch, each with its force. What is no number is not drawn.
fn contacts(tool: &SceneTool, size_m: f64, epoch_ns: u64) -> SceneEntity {
    let is_finite = |point: &&ContactPointSample| point.place_m.iter().chain(&point.force_n).all(|x| x.is_finite());
    let points = || tool.contacts.iter().filter(is_finite);
    SceneEntity {
        spheres: points().map(|point| ball(point.place_m.map(f64::from), size_m, SIGNAL)).collect(),
        arrows: points()
            .map(|point| arrow(point.place_m.map(f64::from), point.force_n.map(f64::from), size_m).0)
            .collect(),
        ..entity(format!("{}contacts", tool.prefix), tool.time, epoch_ns)
    }
}

/// The arrow of a force at a place, and the magnitude of the force (N).
fn arrow(at_m: [f64; 3], force_n: [f64; 3], size_m: f64) -> (ArrowPrimitive, f64) {
    let [x, y, z] = force_n;
    let magnitude = x.hypot(y).hypot(z);
    let length = magnitude * SceneFrame::FORCE_SCALE_M_PER_N;
    let arrow = ArrowPrimitive {
        pose: Pose { position: vector(at_m), orientation: from_x_to(force_n, magnitude) },
        shaft_length: (1.0 - HEAD_SHARE) * length,
        shaft_diameter: SHAFT * size_m,
        head_length: HEAD_SHARE * length,
        head_diameter: HEAD * size_m,
        color: SIGNAL,
    };
    (arrow, magnitude)
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
            let entity = force(&tool, force_n, 0.004, 0);
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

    /// The z axis turned by `q`.
    fn z_axis(q: &Quaternion) -> [f64; 3] {
        let Quaternion { x, y, z, w } = *q;
        [2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)]
    }

    #[test]
    fn a_tool_with_a_shape_is_drawn_in_its_size_and_turned_as_it_is() {
        let sphere = SceneTool { shape: ToolShape::Sphere { radius: 0.004 }, ..SceneTool::default() };
        let drawn = body(&sphere, 0.1, 0);
        assert_eq!((drawn.spheres.len(), drawn.cylinders.len(), drawn.spheres[0].size.x), (1, 0, 0.008));
        // Lying along x, turned about y by a right angle either way; about y by half a turn.
        let right = std::f64::consts::FRAC_1_SQRT_2;
        for (half_axis, orientation, axis) in [
            (Vec3::x(), [1.0, 0.0, 0.0, 0.0], [1.0, 0.0, 0.0]),
            (Vec3::x(), [right, 0.0, right, 0.0], [0.0, 0.0, -1.0]),
            (Vec3::x(), [right, 0.0, -right, 0.0], [0.0, 0.0, 1.0]),
            (Vec3::z(), [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, -1.0]),
        ] {
            let shape = ToolShape::Capsule { radius: 0.003, half_axis: 0.01 * half_axis };
            let tool = SceneTool { shape, orientation, position_m: [1.0, 2.0, 3.0], ..SceneTool::default() };
            let drawn = body(&tool, 0.1, 0);
            let cylinder = &drawn.cylinders[0];
            assert_eq!((cylinder.size.x, cylinder.size.y, cylinder.size.z), (0.006, 0.006, 0.02));
            let along = z_axis(&cylinder.pose.orientation);
            let end = &drawn.spheres[1].pose.position;
            for (found, (at, wanted)) in along.iter().zip([end.x - 1.0, end.y - 2.0, end.z - 3.0].iter().zip(axis)) {
                assert!((found - wanted).abs() < 1e-12 && (at - 0.01 * wanted).abs() < 1e-12, "{along:?} {axis:?}");
            }
        }
    }

    #[test]
    fn every_place_that_touches_has_its_arrow_and_a_tool_that_lets_go_has_none() {
        let point = |x: f32| ContactPointSample {
            place_m: [x, 0.0, 0.0],
            force_n: [0.0, 0.0, 0.5],
            ..ContactPointSample::default()
        };
        let mut tool = SceneTool {
            shape: ToolShape::Sphere { radius: 0.004 },
            contacts: vec![point(0.5), point(f32::NAN), point(0.25)],
            ..SceneTool::default()
        };
        let drawn = |tool: &SceneTool| {
            let update = SceneUpdate::of(&SceneFrame { tools: vec![tool.clone()], ..SceneFrame::default() }, 0);
            update.entities.into_iter().find(|entity| entity.id == "contacts")
        };
        let contacts = drawn(&tool).unwrap();
        assert_eq!(contacts.spheres.iter().map(|ball| ball.pose.position.x).collect::<Vec<_>>(), [0.5, 0.25]);
        assert!(contacts.arrows.iter().all(|arrow| arrow.shaft_length + arrow.head_length == 0.01));
        tool.contacts.clear();
        let contacts = drawn(&tool).unwrap();
        assert_eq!((contacts.spheres.len(), contacts.arrows.len()), (0, 0), "it replaces the one before");
        tool.shape = ToolShape::Point;
        assert_eq!(drawn(&tool), None);
    }
    #[test]
    fn a_surface_reads_back_as_it_was_written_and_one_that_is_none_not_at_all() {
        let frame = SceneFrame {
            time: Nanos(7),
            surface_time: Nanos(7),
            triangles: vec![[0, 1, 2], [2, 1, 0]].into(),
            points: vec![[0.1, 0.2, 0.3], [1e-300, -0.0, 5.0], [1.0, 2.0, 3.0]],
            ..SceneFrame::default()
        };
        assert_eq!(SceneUpdate::of(&frame, 1 << 60).surface(), Some(frame.clone()));
        let wrong = SceneFrame { triangles: vec![[0, 1, 3]].into(), ..frame.clone() };
        assert_eq!(SceneUpdate::of(&wrong, 0).surface(), None, "a corner that there is not");
        let endless = SceneFrame { points: vec![[f64::NAN; 3]; 3], ..frame };
        assert_eq!(SceneUpdate::of(&endless, 0).surface(), None);
        assert_eq!(SceneUpdate::default().surface(), None);
    }
}
