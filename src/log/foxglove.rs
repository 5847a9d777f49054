//! The messages that viewers know by name: Foxglove's published schemas, with their names and field numbers.
//!
//! Where palpate has more to say than the schema holds, its own fields follow from number 1001 on in the same message (the
//! schema's newer editions add fields from 100 on). A viewer that goes by the well-known numbers skips them; one that goes
//! by the embedded descriptor shows them too. `ci/check_foxglove.py` compares all of it with the published schemas.

use prost_types::FileDescriptorProto;

use super::proto::{proto_message, proto_schema, rust_type};

/// The time types of protobuf itself. They are written here for their descriptors, which prost does not give.
pub(crate) mod google {
    use super::{proto_message, proto_schema, rust_type};

    proto_schema! {
        package "google.protobuf" in "google/protobuf/timestamp.proto" imports [];

        /// Unix time; simulated time in a log of virtual time.
        message Timestamp {
            seconds: int64 = 1,
            nanos: int32 = 2,
        }
    }

    /// Durations have a file of their own.
    pub(crate) mod duration {
        use super::{proto_message, proto_schema, rust_type};

        proto_schema! {
            package "google.protobuf" in "google/protobuf/duration.proto" imports [];

            /// A span of time.
            message Duration {
                seconds: int64 = 1,
                nanos: int32 = 2,
            }
        }
    }
}

pub(crate) use google::Timestamp;
pub(crate) use google::duration::Duration;

/// How grave a message is.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Level {
    Unknown,
    Debug,
    Info,
    Warning,
    Error,
    Fatal,
}

/// What a deletion deletes.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Type {
    MatchingId,
    All,
}

proto_schema! {
    package "foxglove" in "palpate/foxglove.proto"
    imports ["google/protobuf/timestamp.proto", "google/protobuf/duration.proto"];

    enum Level in Log { Unknown, Debug, Info, Warning, Error, Fatal }
    enum Type in SceneEntityDeletion { MatchingId, All }

    /// A direction, or the position in a [`Pose`].
    message Vector3 {
        x: double = 1,
        y: double = 2,
        z: double = 3,
    }

    /// A point of a mesh.
    message Point3 {
        x: double = 1,
        y: double = 2,
        z: double = 3,
    }

    /// A rotation.
    message Quaternion {
        x: double = 1,
        y: double = 2,
        z: double = 3,
        w: double = 4,
    }

    /// A place and an orientation.
    message Pose {
        position: message of Vector3 = 1,
        orientation: message of Quaternion = 2,
    }

    /// From 0 to 1 each.
    message Color {
        r: double = 1,
        g: double = 2,
        b: double = 3,
        a: double = 4,
    }

    /// `/tool`: the raw device sample. The orientation is always the identity: the tool is a point.
    message PoseInFrame {
        timestamp: message of Timestamp = 1,
        frame_id: string = 2,
        pose: message of Pose = 3,
        time_ns: uint64 = 1001,
        id: uint32 = 1002,
        velocity_m_s: message of Vector3 = 1003,
        buttons: uint32 = 1004,
        device: uint32 = 1005,
    }

    /// `/log`: something that happened once, in the rate group `name`. `coded` ones came from it as numbers.
    message Log {
        timestamp: message of Timestamp = 1,
        level: int32 as Level = 2,
        message: string = 3,
        name: string = 4,
        file: string = 5,
        line: fixed32 = 6,
        time_ns: uint64 = 1001,
        coded: bool = 1002,
        group: uint32 = 1003,
        code: uint32 = 1004,
        detail: uint64 = 1005,
    }

    /// `/scene`: what can be seen, [`entities`](Self::entities) that each replace the one with the same id.
    message SceneUpdate {
        deletions: repeated message of SceneEntityDeletion = 1,
        entities: repeated message of SceneEntity = 2,
        time_ns: uint64 = 1001,
    }

    /// Never written: nothing leaves a scene.
    message SceneEntityDeletion {
        timestamp: message of Timestamp = 1,
        r#type: int32 as Type = 2,
        id: string = 3,
    }

    /// One thing to see. The schema's other primitives (6, 8, 10, 11, 13, 14) are never written and left out.
    message SceneEntity {
        timestamp: message of Timestamp = 1,
        frame_id: string = 2,
        id: string = 3,
        lifetime: message of Duration = 4,
        frame_locked: bool = 5,
        metadata: repeated message of KeyValuePair = 6,
        arrows: repeated message of ArrowPrimitive = 7,
        spheres: repeated message of SpherePrimitive = 9,
        triangles: repeated message of TriangleListPrimitive = 12,
    }

    /// A remark.
    message KeyValuePair {
        key: string = 1,
        value: string = 2,
    }

    /// An arrow; without a rotation it points along x.
    message ArrowPrimitive {
        pose: message of Pose = 1,
        shaft_length: double = 2,
        shaft_diameter: double = 3,
        head_length: double = 4,
        head_diameter: double = 5,
        color: message of Color = 6,
    }

    /// A sphere; its size is the diameter.
    message SpherePrimitive {
        pose: message of Pose = 1,
        size: message of Vector3 = 2,
        color: message of Color = 3,
    }

    /// A mesh: three indices into the points for each triangle.
    message TriangleListPrimitive {
        pose: message of Pose = 1,
        points: repeated message of Point3 = 2,
        color: message of Color = 3,
        colors: repeated message of Color = 4,
        indices: repeated fixed32 = 5,
    }
}

/// What the messages above need, in the order in which it is to be known.
pub(crate) fn files() -> Vec<FileDescriptorProto> {
    vec![google::file(), google::duration::file(), file()]
}
