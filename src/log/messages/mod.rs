//! The protobuf messages of a log: palpate's own here, those that viewers know by name in [`foxglove`].
//!
//! Fields are only ever added, with new numbers.

mod contact;
pub(crate) mod foxglove;
mod scene_update;
pub(crate) mod topic;
mod viewer;
pub(crate) mod wire;

use prost_types::{FileDescriptorProto, FileDescriptorSet};

pub(crate) use self::contact::Contact;
use self::contact::ContactPoint;
pub(crate) use self::wire::LogMessage;
use self::wire::{Uint64s, WireEnum, message, messages, wire_enum};
use super::percentiles::Percentiles;
use super::records::{CommandSample, ForceSample, GlobalTick, LinkSample, ProbeSample, Resync, ServedBy};
use super::stats::GroupStats;
use crate::model::contact::ContactMode;
use crate::runtime::{self, GroupMode, InputUse, Nanos, PortUse, PortUseKind, SlipCause, TickTiming};

/// The version of the schema that this build writes.
pub(crate) const SCHEMA_VERSION: u32 = 3;

wire_enum! { "palpate.SlipCause" for SlipCause { None, LateWake, LongTick, StalledPeer, Policy, Fault } }
wire_enum! { "palpate.PortUseKind" for PortUseKind { Took, Saw, Dropped } }
wire_enum! { "palpate.Mode" for GroupMode { Normal, Degraded, Stopping } }
wire_enum! { "palpate.ContactMode" for ContactMode { Free, Stick, Slip, Lost } }
wire_enum! { "palpate.ServedBy" for ServedBy {
    Unknown, Full, Hold, Patch, LinearBoundary, ScaledBoundary, Condensed, Predicted, Predictive,
} }

// A vector in world coordinates.
message! { "palpate.Vector3" => for [f64; 3] { x = 1 ([0]), y = 2 ([1]), z = 3 ([2]) } }

// Nearest-rank percentiles of durations.
message! { "palpate.Percentiles" => for Percentiles<u64> {
    count = 1 (.count),
    p50_ns = 2 (.p50),
    p90_ns = 3 (.p90),
    p99_ns = 4 (.p99),
    p999_ns = 5 (.p999),
    max_ns = 6 (.max),
} }

// `/timing/GROUP`: one release of a rate group.
message! { "palpate.TickTiming" => for TickTiming {
    group = 1 (.group),
    tick = 2 (.tick),
    scheduled_ns = 3 (.scheduled),
    woke_ns = 4 (.woke),
    start_ns = 5 (.start),
    end_ns = 6 (.end),
    deadline_ns = 7 (.deadline),
    slips = 8 (.slips),
    cause = 9 (.cause),
    given_up = 10 (.given_up),
    mode = 11 (.mode),
    // For viewers that plot fields and do not compute.
    lateness_ns = 1001 [|r: &Self| r.woke.saturating_sub(r.scheduled)],
    execution_ns = 1002 [|r: &Self| r.end.saturating_sub(r.start)],
} }

messages! {
    package "palpate";

    /// `/actors/GROUP`: what each actor of a group took of one release.
    message ActorTimes {
        time_ns: Nanos = 1,
        group: u16 = 2,
        spent_ns: Uint64s = 3,
    }
}

impl From<&runtime::ActorTimes> for ActorTimes {
    fn from(r: &runtime::ActorTimes) -> Self {
        let spent_ns = Uint64s(r.spent().iter().map(|spent| spent.0).collect());
        Self { time_ns: r.scheduled, group: r.group, spent_ns }
    }
}

impl From<ActorTimes> for runtime::ActorTimes {
    fn from(m: ActorTimes) -> Self {
        let mut spent = [Nanos::ZERO; Self::MAX];
        spent.iter_mut().zip(&m.spent_ns.0).for_each(|(to, from)| *to = Nanos(*from));
        let actors = u8::try_from(m.spent_ns.0.len()).unwrap_or(u8::MAX);
        Self { group: m.group, scheduled: m.time_ns, actors, spent }
    }
}

// `/ports`: what a release saw through a port from another group; see `PortUseKind` for the count.
message! { "palpate.PortUse" => for PortUse {
    time_ns = 1 (.time),
    group = 2 (.group),
    port = 3 (.port),
    // An unknown kind reads as one that its sequence number does not fit.
    kind = 4 (.kind),
    tick = 5 (.tick),
    count = 6 (.count),
    sequence = 7 (.sequence),
} }

// `/inputs`: a value that a release took from outside of the graph, as words.
message! { "palpate.InputUse" => for InputUse {
    time_ns = 1 (.time),
    group = 2 (.group),
    port = 3 (.port),
    sequence = 4 (.sequence),
    word_0 = 5 (.value[0]),
    word_1 = 6 (.value[1]),
    word_2 = 7 (.value[2]),
    word_3 = 8 (.value[3]),
    word_4 = 9 (.value[4]),
} }

// `/stats/GROUP`: how a group has kept time, once a second.
message! { "palpate.Stats" => for GroupStats {
    time_ns = 1 (.time),
    group = 2 (.group),
    released = 3 (.released),
    skipped = 4 (.skipped),
    missed = 5 (.missed),
    lost_records = 6 (.lost_records),
    lateness = 7 (.lateness),
    lateness_last_second = 8 (.lateness_last_second),
    execution = 9 (.execution),
    execution_last_second = 10 (.execution_last_second),
    port_uses = 11 (.port_uses),
    events = 12 (.events.count),
    events_digest = 13 (.events.digest),
} }

/// The descriptor of all messages and enums of palpate's own.
fn file() -> FileDescriptorProto {
    FileDescriptorProto {
        name: Some("palpate/log.proto".into()),
        package: Some("palpate".into()),
        syntax: Some("proto3".into()),
        message_type: vec![
            <[f64; 3]>::descriptor(),
            Percentiles::<u64>::descriptor(),
            TickTiming::descriptor(),
            ActorTimes::descriptor(),
            ForceSample::descriptor(),
            CommandSample::descriptor(),
            <[f32; 3]>::descriptor(),
            ContactPoint::descriptor(),
            Contact::descriptor(),
            Resync::descriptor(),
            GlobalTick::descriptor(),
            PortUse::descriptor(),
            InputUse::descriptor(),
            ProbeSample::descriptor(),
            GroupStats::descriptor(),
            LinkSample::descriptor(),
        ],
        enum_type: vec![
            SlipCause::enum_descriptor(false),
            PortUseKind::enum_descriptor(false),
            GroupMode::enum_descriptor(false),
            ContactMode::enum_descriptor(false),
            ServedBy::enum_descriptor(false),
        ],
        ..Default::default()
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
        let sent = [-0.0, f64::from_bits(0x7ff8_0000_0000_1234), 0.0];
        let mut bytes = Vec::new();
        LogMessage::encode(&sent, &mut bytes);
        let got = <[f64; 3] as LogMessage>::decode(&bytes).unwrap();
        assert_eq!(got.map(f64::to_bits), sent.map(f64::to_bits));
    }
}
