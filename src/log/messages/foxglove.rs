//! The messages that viewers know by name: Foxglove's published schemas, with their names and field numbers.
//!
//! Where palpate has more to say than the schema holds, its own fields follow from number 1001 on in the same message (the
//! schema's newer editions add fields from 100 on). A viewer that goes by the well-known numbers skips them; one that goes
//! by the embedded descriptor shows them too. `ci/check_foxglove.py` compares all of it with the published schemas.

use prost_types::FileDescriptorProto;

use super::wire::{Fixed32, Fixed32s, LogMessage, WireEnum, messages, wire_enum};
use crate::runtime::Nanos;

messages! {
    package "google.protobuf";

    /// Unix time; simulated time in a log of virtual time.
    message Timestamp {
        seconds: i64 = 1,
        nanos: i32 = 2,
    }

    /// A span of time.
    message Duration {
        seconds: i64 = 1,
        nanos: i32 = 2,
    }
}

/// How grave a message is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Level {
    #[default]
    Unknown,
    Debug,
    Info,
    Warning,
    Error,
    Fatal,
}

/// What a deletion deletes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Type {
    #[default]
    MatchingId,
    All,
}

wire_enum! { "foxglove.Log.Level" for Level { Unknown, Debug, Info, Warning, Error, Fatal } }
wire_enum! { "foxglove.SceneEntityDeletion.Type" for Type { MatchingId, All } }

messages! {
    package "foxglove";

    /// A direction, or the position in a [`Pose`].
    message Vector3 {
        x: f64 = 1,
        y: f64 = 2,
        z: f64 = 3,
    }

    /// A point of a mesh.
    message Point3 {
        x: f64 = 1,
        y: f64 = 2,
        z: f64 = 3,
    }

    /// A rotation.
    message Quaternion {
        x: f64 = 1,
        y: f64 = 2,
        z: f64 = 3,
        w: f64 = 4,
    }

    /// A place and an orientation.
    message Pose {
        position: Vector3 = 1,
        orientation: Quaternion = 2,
    }

    /// From 0 to 1 each.
    message Color {
        r: f64 = 1,
        g: f64 = 2,
        b: f64 = 3,
        a: f64 = 4,
    }

    /// `/tool`: the raw device sample.
    message PoseInFrame {
        timestamp: Timestamp = 1,
        frame_id: String = 2,
        pose: Pose = 3,
        time_ns: Nanos = 1001,
        id: u32 = 1002,
        velocity_m_s: Vector3 = 1003,
        buttons: u16 = 1004,
        device: u16 = 1005,
    }

    /// `/log`: something that happened once, in the rate group `name`. `coded` ones came from it as numbers.
    message Log {
        timestamp: Timestamp = 1,
        level: Level = 2,
        message: String = 3,
        name: String = 4,
        file: String = 5,
        line: Fixed32 = 6,
        time_ns: Nanos = 1001,
        coded: bool = 1002,
        group: u16 = 1003,
        code: u32 = 1004,
        detail: u64 = 1005,
    }

    /// `/scene`: what can be seen, [`entities`](Self::entities) that each replace the one with the same id.
    message SceneUpdate {
        deletions: Vec<SceneEntityDeletion> = 1,
        entities: Vec<SceneEntity> = 2,
        time_ns: Nanos = 1001,
    }

    /// Never written: nothing leaves a scene.
    message SceneEntityDeletion {
        timestamp: Timestamp = 1,
        r#type: Type = 2,
        id: String = 3,
    }

    /// One thing to see. The schema's other primitives (8, 11, 13, 14) are never written and left out.
    message SceneEntity {
        timestamp: Timestamp = 1,
        frame_id: String = 2,
        id: String = 3,
        lifetime: Duration = 4,
        frame_locked: bool = 5,
        metadata: Vec<KeyValuePair> = 6,
        arrows: Vec<ArrowPrimitive> = 7,
        spheres: Vec<SpherePrimitive> = 9,
        cylinders: Vec<CylinderPrimitive> = 10,
        triangles: Vec<TriangleListPrimitive> = 12,
    }

    /// A remark.
    message KeyValuePair {
        key: String = 1,
        value: String = 2,
    }

    /// An arrow; without a rotation it points along x.
    message ArrowPrimitive {
        pose: Pose = 1,
        shaft_length: f64 = 2,
        shaft_diameter: f64 = 3,
        head_length: f64 = 4,
        head_diameter: f64 = 5,
        color: Color = 6,
    }

    /// A sphere; its size is the diameter.
    message SpherePrimitive {
        pose: Pose = 1,
        size: Vector3 = 2,
        color: Color = 3,
    }

    /// A cylinder along z, around its pose; its size is that of the box around it, and the scales are those of its ends.
    message CylinderPrimitive {
        pose: Pose = 1,
        size: Vector3 = 2,
        bottom_scale: f64 = 3,
        top_scale: f64 = 4,
        color: Color = 5,
    }

    /// A mesh: three indices into the points for each triangle.
    message TriangleListPrimitive {
        pose: Pose = 1,
        points: Vec<Point3> = 2,
        color: Color = 3,
        colors: Vec<Color> = 4,
        indices: Fixed32s = 5,
    }
}

/// What the messages above need, in the order in which it is to be known.
pub(crate) fn files() -> Vec<FileDescriptorProto> {
    let file = |path: &str, package: &str, message_type| FileDescriptorProto {
        name: Some(path.into()),
        package: Some(package.into()),
        syntax: Some("proto3".into()),
        message_type,
        ..Default::default()
    };
    let (timestamp, duration) = ("google/protobuf/timestamp.proto", "google/protobuf/duration.proto");
    let mut log = Log::descriptor();
    log.enum_type.push(Level::enum_descriptor(true));
    let mut deletion = SceneEntityDeletion::descriptor();
    deletion.enum_type.push(Type::enum_descriptor(true));
    let own = vec![
        Vector3::descriptor(),
        Point3::descriptor(),
        Quaternion::descriptor(),
        Pose::descriptor(),
        Color::descriptor(),
        PoseInFrame::descriptor(),
        log,
        SceneUpdate::descriptor(),
        deletion,
        SceneEntity::descriptor(),
        KeyValuePair::descriptor(),
        ArrowPrimitive::descriptor(),
        SpherePrimitive::descriptor(),
        CylinderPrimitive::descriptor(),
        TriangleListPrimitive::descriptor(),
    ];
    vec![
        file(timestamp, "google.protobuf", vec![Timestamp::descriptor()]),
        file(duration, "google.protobuf", vec![Duration::descriptor()]),
        FileDescriptorProto {
            dependency: vec![timestamp.into(), duration.into()],
            ..file("palpate/foxglove.proto", "foxglove", own)
        },
    ]
}
