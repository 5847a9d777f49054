//! The protobuf messages of a log that are palpate's own. Those that viewers know by name are in [`foxglove`](super::foxglove).
//!
//! Fields are only ever added, with new numbers.

use prost_types::FileDescriptorSet;

use super::foxglove;
use super::proto::{proto_message, proto_schema, rust_type};
use super::records::{ContactMode, ServedBy};
use crate::runtime::SlipCause;
// Logs know the mode by this name.
use crate::runtime::{GroupMode as Mode, PortUseKind};

pub(crate) use super::proto::LogMessage;

/// The version of the schema that this build writes.
pub(crate) const SCHEMA_VERSION: u32 = 2;

proto_schema! {
    package "palpate" in "palpate/log.proto" imports [];
    enum SlipCause { None, LateWake, LongTick, StalledPeer, Policy, Fault }
    enum PortUseKind { Took, Saw, Dropped }
    enum Mode { Normal, Degraded, Stopping }
    enum ContactMode { Free, Stick, Slip, Lost }
    enum ServedBy {
        Unknown, Full, Hold, Patch, LinearBoundary, ScaledBoundary, Condensed, Predicted, Predictive
    }

    /// A vector in world coordinates.
    message Vector3 {
        x: double = 1,
        y: double = 2,
        z: double = 3,
    }

    /// Nearest-rank percentiles of durations.
    message Percentiles {
        count: uint64 = 1,
        p50_ns: uint64 = 2,
        p90_ns: uint64 = 3,
        p99_ns: uint64 = 4,
        p999_ns: uint64 = 5,
        max_ns: uint64 = 6,
    }

    /// `/timing/GROUP`: one release of a rate group.
    message TickTiming {
        group: uint32 = 1,
        tick: uint64 = 2,
        scheduled_ns: uint64 = 3,
        woke_ns: uint64 = 4,
        start_ns: uint64 = 5,
        end_ns: uint64 = 6,
        deadline_ns: uint64 = 7,
        slips: uint32 = 8,
        cause: int32 as SlipCause = 9,
        given_up: uint32 = 10,
        mode: int32 as Mode = 11,
        /// Woke less scheduled: for viewers that plot fields and do not compute. Not read back.
        lateness_ns: uint64 = 1001,
        /// End less start; the same.
        execution_ns: uint64 = 1002,
    }

    /// `/actors/GROUP`: what each actor of a group took of one release.
    message ActorTimes {
        time_ns: uint64 = 1,
        group: uint32 = 2,
        spent_ns: repeated uint64 = 3,
    }

    /// `/force`: the force on the tool before the safety pipeline.
    message Force {
        time_ns: uint64 = 1,
        force_n: message of Vector3 = 2,
        model_version: uint32 = 3,
        model_age_s: double = 4,
        energy_j: double = 5,
        served_by: int32 as ServedBy = 6,
        device: uint32 = 7,
    }

    /// `/force_commanded`: the force after the safety pipeline.
    message CommandedForce {
        time_ns: uint64 = 1,
        force_n: message of Vector3 = 2,
        limits: uint32 = 3,
        energy_j: double = 4,
        tank_j: double = 5,
        device: uint32 = 6,
    }

    /// `/contact`: the state of the contact.
    message Contact {
        time_ns: uint64 = 1,
        mode: int32 as ContactMode = 2,
        triangle: uint32 = 3,
        weight_a: double = 4,
        weight_b: double = 5,
        weight_c: double = 6,
        normal: message of Vector3 = 7,
        normal_force_n: float = 8,
        tangential_force_n: float = 9,
        device: uint32 = 10,
    }

    /// `/resync`: the local model was replaced by a newer one.
    message Resync {
        time_ns: uint64 = 1,
        version: uint32 = 2,
        age_ns: uint64 = 3,
        jump_before_n: double = 4,
        jump_after_n: double = 5,
        energy_j: double = 6,
        device: uint32 = 7,
    }

    /// `/global`: one release of the global model.
    message GlobalTick {
        time_ns: uint64 = 1,
        version: uint32 = 2,
        first_tick: uint64 = 3,
        last_tick: uint64 = 4,
    }

    /// `/ports`: what a release saw through a port from another group; see `PortUseKind` for the count.
    message PortUse {
        time_ns: uint64 = 1,
        group: uint32 = 2,
        port: uint32 = 3,
        kind: int32 as PortUseKind = 4,
        tick: uint64 = 5,
        count: uint64 = 6,
        sequence: uint64 = 7,
    }

    /// `/probe`: a probed node.
    message Probe {
        time_ns: uint64 = 1,
        node: uint32 = 2,
        local_m: message of Vector3 = 3,
        global_m: message of Vector3 = 4,
        device: uint32 = 5,
    }

    /// `/stats/GROUP`: how a group has kept time, once a second.
    message Stats {
        time_ns: uint64 = 1,
        group: uint32 = 2,
        released: uint64 = 3,
        skipped: uint64 = 4,
        missed: uint64 = 5,
        lost_records: uint64 = 6,
        lateness: message of Percentiles = 7,
        lateness_last_second: message of Percentiles = 8,
        execution: message of Percentiles = 9,
        execution_last_second: message of Percentiles = 10,
        port_uses: uint64 = 11,
        events: uint64 = 12,
        events_digest: uint64 = 13,
    }
}

/// The descriptors of the message named `schema` and of all that it refers to, encoded: the data of its MCAP schema.
pub(crate) fn descriptor_set(schema: &str) -> Vec<u8> {
    let file = if schema.starts_with("palpate.") { vec![file()] } else { foxglove::files() };
    prost::Message::encode_to_vec(&FileDescriptorSet { file })
}

#[cfg(test)]
mod tests {
    use super::*;
    use prost::Message;
    use prost_types::field_descriptor_proto::Type;

    #[test]
    fn the_descriptor_names_every_field_with_the_number_on_the_wire() {
        let set = FileDescriptorSet::decode(descriptor_set(Contact::NAME).as_slice()).unwrap();
        let contact = set.file[0].message_type.iter().find(|m| m.name() == "Contact").unwrap();
        let fields: Vec<_> = contact.field.iter().map(|f| (f.name(), f.number(), f.r#type())).collect();
        assert_eq!(fields[1], ("mode", 2, Type::Enum));
        assert_eq!(contact.field[1].type_name(), ".palpate.ContactMode");
        assert_eq!(fields[6], ("normal", 7, Type::Message));
        assert_eq!(contact.field[6].type_name(), ".palpate.Vector3");
        assert_eq!(fields[8], ("tangential_force_n", 9, Type::Float));
        let cause = &set.file[0].enum_type[0];
        let values: Vec<_> = cause.value.iter().map(|v| (v.name(), v.number())).collect();
        assert_eq!(values[..2], [("SLIP_CAUSE_NONE", 0), ("SLIP_CAUSE_LATE_WAKE", 1)]);
    }

    #[test]
    fn negative_zero_and_nan_come_back_bit_for_bit() {
        let sent = Vector3 { x: -0.0, y: f64::from_bits(0x7ff8_0000_0000_1234), z: 0.0 };
        let got = Vector3::decode(sent.encode_to_vec().as_slice()).unwrap();
        assert_eq!([got.x, got.y, got.z].map(f64::to_bits), [sent.x, sent.y, sent.z].map(f64::to_bits));
    }
}
