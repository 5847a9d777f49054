//! Tick timing in logs of other programs: any MCAP channel whose messages have the fields below.
//!
//! | field | meaning |
//! | --- | --- |
//! | `scheduled_ns` | when the release was due; required |
//! | `woke_ns` | when it ran; required, or `start_ns` in its place |
//! | `start_ns`, `end_ns` | when its work began and was done; `woke_ns` and `start_ns` if left out |
//! | `deadline_ns` | when it had to be done; one period after it was due if left out |
//! | `tick` | the number of the release, counting skipped ones; by its time if left out |
//! | `slips` | periods skipped before it; from the numbers if left out |
//! | `cause` | why: a number of [`SlipCause`], or its name |
//!
//! All times are integers in nanoseconds of one clock, from 0 to 2^63; in the report they count from the whole second in which
//! the first release of the log was due; releases before that are left out, which an event says. Messages are JSON
//! (`message_encoding` `json`) or protobuf with their descriptors as the schema. A channel is read if its topic begins with
//! `/timing/`, or if its schema's name ends in `TickTiming`; the rest of the topic names the group. Channel metadata `rate_hz`
//! says the rate, which is otherwise taken from the first two releases.

use std::collections::BTreeMap;
use std::sync::Arc;

use prost::Message;
use prost::encoding::{WireType, decode_key, decode_varint};
use prost_types::FileDescriptorSet;
use prost_types::field_descriptor_proto::Type;

use crate::runtime::Nanos;
use crate::runtime::{SlipCause, TickTiming};

const SECOND: u64 = 1_000_000_000;

const FIELDS: [&str; 8] = ["scheduled_ns", "woke_ns", "start_ns", "end_ns", "deadline_ns", "tick", "slips", "cause"];
/// Places in [`FIELDS`].
const SCHEDULED: usize = 0;
const WOKE: usize = 1;
const START: usize = 2;
const END: usize = 3;
const DEADLINE: usize = 4;
const TICK: usize = 5;
const SLIPS: usize = 6;
const CAUSE: usize = 7;

/// The values of a message, in the order of [`FIELDS`].
type Values = [Option<u64>; FIELDS.len()];

/// How the messages of a channel are written.
#[derive(Clone, Debug, PartialEq)]
enum Encoding {
    Json,
    /// The place in [`FIELDS`] by field number.
    Protobuf(Arc<BTreeMap<u32, usize>>),
}

/// A schema, as far as tick timing goes.
#[derive(Clone, Debug)]
pub(super) struct ForeignSchema {
    is_named: bool,
    /// Those of a protobuf message that has what is required.
    numbers: Option<Arc<BTreeMap<u32, usize>>>,
}

impl ForeignSchema {
    /// The schema `name`; `descriptors` are looked at once for all of its channels.
    pub(super) fn of(name: &str, descriptors: &[u8]) -> Self {
        Self { is_named: name.ends_with("TickTiming"), numbers: numbers(name, descriptors).map(Arc::new) }
    }
}

/// A channel with tick timing.
#[derive(Clone, Debug)]
pub(super) struct ForeignChannel {
    group: u16,
    name: String,
    rate_hz: Option<f64>,
    encoding: Encoding,
    last: Option<TickTiming>,
    period: Option<u64>,
}

impl ForeignChannel {
    /// The channel `topic`, of group 0 so far; `None` if it does not hold tick timing.
    pub(super) fn of(
        topic: &str,
        message_encoding: &str,
        schema: Option<&ForeignSchema>,
        metadata: &BTreeMap<String, String>,
    ) -> Option<Self> {
        let is_named = schema.is_some_and(|schema| schema.is_named);
        let name = topic.strip_prefix("/timing/").or(is_named.then(|| topic.trim_start_matches('/')))?;
        let encoding = match (message_encoding, schema) {
            ("json", _) => Encoding::Json,
            ("protobuf", Some(schema)) => Encoding::Protobuf(schema.numbers.clone()?),
            _ => return None,
        };
        let rate_hz = metadata.get("rate_hz").and_then(|rate| rate.parse().ok()).filter(|rate| *rate > 0.0);
        let period = rate_hz.map(|rate: f64| (SECOND as f64 / rate).round() as u64).filter(|period| *period > 0);
        Some(Self { group: 0, name: name.to_owned(), rate_hz, encoding, last: None, period })
    }

    /// Gives its group a number.
    pub(super) fn set_group(&mut self, group: u16) {
        self.group = group;
    }

    /// The name of its group.
    pub(super) fn name(&self) -> &str {
        &self.name
    }

    /// The rate that it declares (Hz).
    pub(super) fn rate_hz(&self) -> Option<f64> {
        self.rate_hz
    }

    /// Reads one message; `base` is the time that counts as the start of the run, found by the first message of a log.
    /// `None` for a release before that.
    pub(super) fn tick(&mut self, data: &[u8], base: &mut Option<u64>) -> Result<Option<TickTiming>, String> {
        let values = match &self.encoding {
            Encoding::Json => of_json(data)?,
            Encoding::Protobuf(numbers) => of_protobuf(data, numbers)?,
        };
        if let Some(place) = values.iter().position(|value| value.is_some_and(|value| value > i64::MAX as u64)) {
            return Err(format!("its {} is negative or too large", FIELDS[place]));
        }
        let scheduled = values[SCHEDULED].ok_or("it has no scheduled_ns")?;
        let woke = values[WOKE].or(values[START]).ok_or("it has neither woke_ns nor start_ns")?;
        // Since 1970, since the machine's start or since the run's: the first second of the log is the first one here.
        let base = *base.get_or_insert(scheduled - scheduled % SECOND);
        if scheduled < base {
            return Ok(None);
        }
        let since = |time: u64| Nanos(time.saturating_sub(base));
        let start = values[START].unwrap_or(woke);
        let end = values[END].unwrap_or(start);
        if let Some(last) = self.last {
            let periods = values[TICK].map_or(1, |tick| tick.saturating_sub(last.tick).max(1));
            let step = since(scheduled).saturating_sub(last.scheduled).0 / periods;
            self.period = self.period.or((step > 0).then_some(step));
        }
        let tick = values[TICK].unwrap_or_else(|| self.number(since(scheduled)));
        let skipped = self.last.map_or(0, |last| tick.saturating_sub(last.tick).saturating_sub(1));
        let slips = u32::try_from(values[SLIPS].unwrap_or(skipped)).unwrap_or(u32::MAX);
        let deadline = values[DEADLINE].or(self.period.map(|period| scheduled.saturating_add(period)));
        let cause = SlipCause::from_code(values[CAUSE].and_then(|cause| u8::try_from(cause).ok()).unwrap_or(0));
        let timing = TickTiming {
            group: self.group,
            tick,
            scheduled: since(scheduled),
            woke: since(woke),
            start: since(start),
            end: since(end),
            // Without a period nothing is known to be late.
            deadline: since(deadline.unwrap_or(end)),
            slips,
            cause,
            ..TickTiming::default()
        };
        self.last = Some(timing);
        Ok(Some(timing))
    }

    /// The number of a release by its time: as many periods after the one before as it is later.
    fn number(&self, scheduled: Nanos) -> u64 {
        let Some(last) = self.last else { return 0 };
        let since = scheduled.saturating_sub(last.scheduled).0;
        let periods = self.period.map_or(1, |period| (since.saturating_add(period / 2)) / period);
        last.tick.saturating_add(periods.max(1))
    }
}

/// The field numbers of a protobuf message; `None` if it does not have what is required.
fn numbers(message: &str, descriptors: &[u8]) -> Option<BTreeMap<u32, usize>> {
    let set = FileDescriptorSet::decode(descriptors).ok()?;
    let mut found = BTreeMap::new();
    for file in &set.file {
        let prefix = if file.package().is_empty() { String::new() } else { format!("{}.", file.package()) };
        let described = file.message_type.iter().find(|described| format!("{prefix}{}", described.name()) == message);
        for field in described.into_iter().flat_map(|described| &described.field) {
            let place = FIELDS.iter().position(|name| *name == field.name());
            if place.is_some_and(|place| !is_integer(field.r#type(), place)) {
                return None;
            }
            found.extend(u32::try_from(field.number()).ok().zip(place));
        }
    }
    let has = |place: usize| found.values().any(|found| *found == place);
    (has(SCHEDULED) && (has(WOKE) || has(START))).then_some(found)
}

/// True for the types whose bytes are read as a number here; a cause may be an enum or a name as well.
fn is_integer(kind: Type, place: usize) -> bool {
    use Type::{Enum, Fixed32, Fixed64, Int32, Int64, Sfixed32, Sfixed64, String, Uint32, Uint64};
    matches!(kind, Uint64 | Uint32 | Int64 | Int32 | Fixed64 | Fixed32 | Sfixed64 | Sfixed32)
        || place == CAUSE && matches!(kind, Enum | String)
}

fn of_protobuf(mut data: &[u8], numbers: &BTreeMap<u32, usize>) -> Result<Values, String> {
    let mut values = Values::default();
    // What equals zero is left out.
    numbers.values().for_each(|&place| values[place] = Some(0));
    let wrong = |e: prost::DecodeError| e.to_string();
    while !data.is_empty() {
        let (number, wire) = decode_key(&mut data).map_err(wrong)?;
        let value = match wire {
            WireType::Varint => decode_varint(&mut data).map_err(wrong)?,
            WireType::SixtyFourBit => u64::from_le_bytes(taken(&mut data)?),
            WireType::ThirtyTwoBit => u32::from_le_bytes(taken(&mut data)?).into(),
            WireType::LengthDelimited => {
                let length = decode_varint(&mut data).map_err(wrong)?;
                let length = usize::try_from(length).map_err(|_| "a field is too long")?;
                let (text, rest) = data.split_at_checked(length).ok_or("it is cut off")?;
                data = rest;
                if numbers.get(&number) == Some(&CAUSE) {
                    cause_by_name(&String::from_utf8_lossy(text))
                } else {
                    continue;
                }
            }
            WireType::StartGroup | WireType::EndGroup => return Err("it has a group, which protobuf gave up".into()),
        };
        if let Some(&place) = numbers.get(&number) {
            values[place] = Some(value);
        }
    }
    // A field that the message may leave out and that is zero says nothing, but for times and numbers that may be zero.
    for place in [WOKE, START, END, DEADLINE] {
        if values[place] == Some(0) && values[SCHEDULED] != Some(0) {
            values[place] = None;
        }
    }
    Ok(values)
}

fn taken<const N: usize>(data: &mut &[u8]) -> Result<[u8; N], String> {
    let (value, rest) = data.split_first_chunk().ok_or("it is cut off")?;
    *data = rest;
    Ok(*value)
}

fn of_json(data: &[u8]) -> Result<Values, String> {
    let message: serde_json::Value = serde_json::from_slice(data).map_err(|e| e.to_string())?;
    let mut values = Values::default();
    for (value, name) in values.iter_mut().zip(FIELDS) {
        *value = match &message[name] {
            serde_json::Value::Null => None,
            serde_json::Value::String(text) if name == FIELDS[CAUSE] => Some(cause_by_name(text)),
            number => Some(number.as_u64().ok_or_else(|| format!("its {name} is no integer of at least 0"))?),
        };
    }
    Ok(values)
}

/// The number of a cause: `late wake` or `late_wake`; an unknown one is none.
fn cause_by_name(name: &str) -> u64 {
    let name = name.replace('_', " ").to_lowercase();
    SlipCause::ALL.into_iter().find(|cause| cause.name() == name).unwrap_or_default() as u64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::log::messages::{self, LogMessage as _};

    fn json(text: &str) -> Values {
        of_json(text.as_bytes()).unwrap()
    }

    fn channel(encoding: &str, schema: Option<(&str, &[u8])>, rate_hz: &str) -> Option<ForeignChannel> {
        let metadata = [("rate_hz".to_owned(), rate_hz.to_owned())].into();
        let schema = schema.map(|(name, descriptors)| ForeignSchema::of(name, descriptors));
        let mut channel = ForeignChannel::of("/timing/servo", encoding, schema.as_ref(), &metadata)?;
        channel.set_group(2);
        Some(channel)
    }

    #[test]
    fn what_is_left_out_is_found_from_the_rest() {
        let mut channel = channel("json", None, "1000").unwrap();
        assert_eq!((channel.name(), channel.rate_hz()), ("servo", Some(1000.0)));
        let mut base = None;
        let start = 1_790_000_000_500_000_000_u64;
        let mut tick = |late: u64, due: u64| {
            let (scheduled, woke) = (start + due * 1_000_000, start + due * 1_000_000 + late);
            let text = format!("{{\"scheduled_ns\": {scheduled}, \"woke_ns\": {woke}, \"cause\": \"late_wake\"}}");
            channel.tick(text.as_bytes(), &mut base).unwrap().unwrap()
        };
        let (first, second) = (tick(5, 0), tick(7, 4));
        assert_eq!((first.tick, first.scheduled, first.woke), (0, Nanos(500_000_000), Nanos(500_000_005)));
        assert_eq!((second.tick, second.slips, second.cause), (4, 3, SlipCause::LateWake));
        assert_eq!((second.start, second.end, second.deadline), (second.woke, second.woke, Nanos(505_000_000)));
        assert_eq!(second.group, 2);
    }

    #[test]
    fn a_period_is_taken_from_the_numbers_of_the_releases() {
        let mut channel = channel("json", None, "").unwrap();
        let mut tick = |tick: u64, due_ms: u64| {
            let due = due_ms * 1_000_000;
            let text = format!("{{\"scheduled_ns\": {due}, \"woke_ns\": {due}, \"tick\": {tick}}}");
            channel.tick(text.as_bytes(), &mut None).unwrap().unwrap()
        };
        tick(0, 10);
        let second = tick(3, 40);
        assert_eq!((second.slips, second.deadline), (2, Nanos(50_000_000)));
    }

    // Check that a release before time zero is not put there.
    #[test]
    fn a_release_before_the_first_second_of_the_log_is_left_out() {
        let (mut channel, mut base) = (channel("json", None, "10").unwrap(), None);
        let mut tick = |due: u64| {
            let text = format!("{{\"scheduled_ns\": {due}, \"woke_ns\": {due}}}");
            channel.tick(text.as_bytes(), &mut base).unwrap().map(|timing| (timing.tick, timing.scheduled))
        };
        assert_eq!(tick(5_000_000_000), Some((0, Nanos::ZERO)));
        assert_eq!(tick(4_900_000_000), None);
        assert_eq!(tick(5_100_000_000), Some((1, Nanos(100_000_000))));
    }

    // Check that palpate's own messages are read by their descriptors as by their types.
    #[test]
    fn protobuf_is_read_by_its_descriptors() {
        let name = "palpate.TickTiming";
        let descriptors = messages::descriptor_set(name);
        let mut channel = channel("protobuf", Some((name, &descriptors)), "").unwrap();
        let timing = TickTiming {
            group: 2,
            tick: 7,
            scheduled: Nanos(7_000_000),
            woke: Nanos(7_000_100),
            start: Nanos(7_000_200),
            end: Nanos(7_900_000),
            deadline: Nanos(8_000_000),
            slips: 2,
            cause: SlipCause::LongTick,
            ..TickTiming::default()
        };
        let mut message = Vec::new();
        timing.encode(&mut message);
        assert_eq!(channel.tick(&message, &mut None), Ok(Some(timing)));
        for cut in 1..message.len() {
            // Check that a cut message is an error or a message, never a panic
            let _ = of_protobuf(&message[..cut], &numbers(name, &descriptors).unwrap());
        }
    }

    #[test]
    fn times_that_are_no_integers_or_too_large_are_refused() {
        let file = |kind: Type| {
            let field = |name: &str, number, kind: Type| prost_types::FieldDescriptorProto {
                name: Some(name.into()),
                number: Some(number),
                r#type: Some(kind.into()),
                ..Default::default()
            };
            let field = vec![field("scheduled_ns", 1, kind), field("woke_ns", 2, Type::Uint64)];
            let message =
                prost_types::DescriptorProto { name: Some("LoopTickTiming".into()), field, ..Default::default() };
            let file = prost_types::FileDescriptorProto { message_type: vec![message], ..Default::default() };
            FileDescriptorSet { file: vec![file] }.encode_to_vec()
        };
        let reads = |kind| channel("protobuf", Some(("LoopTickTiming", &file(kind))), "").is_some();
        assert!(reads(Type::Uint64) && reads(Type::Fixed64) && !reads(Type::Double) && !reads(Type::Sint64));
        let mut channel = channel("json", None, "").unwrap();
        let error = channel.tick(b"{\"scheduled_ns\": 18446744073709551615, \"woke_ns\": 1}", &mut None).unwrap_err();
        assert!(error.contains("scheduled_ns is negative or too large"), "{error}");
    }

    #[test]
    fn channels_without_the_fields_are_left_alone() {
        let descriptors = messages::descriptor_set("palpate.Force");
        assert!(channel("protobuf", Some(("palpate.Force", &descriptors)), "").is_none());
        assert!(channel("ros1", None, "").is_none());
        assert!(ForeignChannel::of("/pose", "json", None, &BTreeMap::new()).is_none());
        assert_eq!(json("{\"scheduled_ns\": 3}")[SCHEDULED], Some(3));
        assert!(of_json(b"{\"scheduled_ns\": -3}").is_err() && of_json(b"nonsense").is_err());
    }
}
