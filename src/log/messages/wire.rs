//! Values as protobuf messages, each from one table of its fields.
//!
//! [`message!`](super::wire::message) says of a type which of its fields travels under which name and number: this makes
//! its encoder, its decoder and its descriptor, so that they cannot disagree. The type of a field says how it is written
//! ([`Wire`]). Every log embeds the descriptors and needs no plugin in a viewer.
//!
//! ```text
//! message! { "palpate.TickTiming" => for TickTiming {
//!     scheduled_ns = 3 (.scheduled),        the field `scheduled`
//!     lateness_ns = 1001 [lateness],        computed by a function, not read back
//! } }
//! messages! { package "foxglove"; message Point3 { x: f64 = 1, y: f64 = 2, z: f64 = 3, } }    with a struct of its own
//! ```
//!
//! Every single field is always written, though it is plain proto3 to a reader: proto3 leaves out what equals zero, and
//! -0.0 equals zero, so a force would not come back bit for bit.

use prost::DecodeError;
use prost::encoding::{self, DecodeContext, WireType};
use prost_types::field_descriptor_proto::{Label, Type};
use prost_types::{DescriptorProto, EnumDescriptorProto, EnumValueDescriptorProto, FieldDescriptorProto};

use crate::runtime::Nanos;

/// A protobuf message of a log.
pub(crate) trait LogMessage: Default {
    /// Its full protobuf name, which is the name of its MCAP schema.
    const NAME: &'static str;

    /// Its fields, without enums inside.
    fn descriptor() -> DescriptorProto;

    /// Appends its bytes.
    fn encode(&self, to: &mut Vec<u8>);

    /// Takes over the field with this number.
    fn merge(&mut self, number: u32, wire: WireType, from: &mut &[u8]) -> Result<(), DecodeError>;

    /// Reads a message; fields that are missing have their default, unknown ones are left out.
    fn decode(mut data: &[u8]) -> Result<Self, DecodeError> {
        let mut message = Self::default();
        while !data.is_empty() {
            let (number, wire) = encoding::decode_key(&mut data)?;
            message.merge(number, wire, &mut data)?;
        }
        Ok(message)
    }
}

/// A value that is a field of a message.
pub(crate) trait Wire {
    const TYPE: Type;
    const LABEL: Label = Label::Optional;
    /// The full name of its message or enum.
    const TYPE_NAME: Option<&'static str> = None;

    fn encode_field(&self, number: u32, to: &mut Vec<u8>);
    fn merge_field(&mut self, wire: WireType, from: &mut &[u8]) -> Result<(), DecodeError>;

    /// Its descriptor; only the type counts.
    fn describe(&self, name: &str, number: u32) -> FieldDescriptorProto {
        FieldDescriptorProto {
            name: Some(name.trim_start_matches("r#").into()),
            number: Some(number.cast_signed()),
            label: Some(Self::LABEL as i32),
            r#type: Some(Self::TYPE as i32),
            type_name: Self::TYPE_NAME.map(|name| format!(".{name}")),
            ..Default::default()
        }
    }
}

/// A number of four bytes, whatever its size.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Fixed32(pub(crate) u32);

/// Many numbers of four bytes, packed.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Fixed32s(pub(crate) Vec<u32>);

/// Many numbers, packed.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Uint64s(pub(crate) Vec<u64>);

/// Fields that protobuf knows by themselves: how each is encoded, described, and where in its type it is.
macro_rules! plain {
    ($label:ident $encode:ident $merge:ident: $($type:ty as $kind:ident $described:ident ($($at:tt)*)),*) => { $(
        impl Wire for $type {
            const TYPE: Type = Type::$described;
            const LABEL: Label = Label::$label;

            fn encode_field(&self, number: u32, to: &mut Vec<u8>) {
                encoding::$kind::$encode(number, &(*self) $($at)*, to);
            }

            fn merge_field(&mut self, wire: WireType, from: &mut &[u8]) -> Result<(), DecodeError> {
                encoding::$kind::$merge(wire, &mut (*self) $($at)*, from, DecodeContext::default())
            }
        }
    )* };
}

plain! { Optional encode merge: u32 as uint32 Uint32 (), u64 as uint64 Uint64 (), i32 as int32 Int32 () }
plain! { Optional encode merge: i64 as int64 Int64 (), f32 as float Float (), f64 as double Double () }
plain! { Optional encode merge: bool as bool Bool (), String as string String (), Fixed32 as fixed32 Fixed32 (.0) }
plain! { Repeated encode_packed merge_repeated: Fixed32s as fixed32 Fixed32 (.0), Uint64s as uint64 Uint64 (.0) }

/// Fields that travel as another type. Numbers that do not fit come only from a damaged or foreign log; they saturate.
macro_rules! converted {
    ($($type:ty as $plain:ty: |$value:ident| $there:expr, $back:expr;)*) => { $(
        impl Wire for $type {
            const TYPE: Type = <$plain as Wire>::TYPE;

            fn encode_field(&self, number: u32, to: &mut Vec<u8>) {
                let $value = *self;
                Wire::encode_field(&$there, number, to);
            }

            fn merge_field(&mut self, wire: WireType, from: &mut &[u8]) -> Result<(), DecodeError> {
                let mut $value = <$plain>::default();
                Wire::merge_field(&mut $value, wire, from)?;
                *self = $back;
                Ok(())
            }
        }
    )* };
}

converted! {
    u8 as u32: |value| u32::from(value), Self::try_from(value).unwrap_or(Self::MAX);
    u16 as u32: |value| u32::from(value), Self::try_from(value).unwrap_or(Self::MAX);
    Nanos as u64: |value| value.0, Self(value);
}

impl<M: LogMessage> Wire for M {
    const TYPE: Type = Type::Message;
    const TYPE_NAME: Option<&'static str> = Some(M::NAME);

    fn encode_field(&self, number: u32, to: &mut Vec<u8>) {
        encoding::encode_key(number, WireType::LengthDelimited, to);
        let start = to.len();
        self.encode(to);
        // The length is known by now and comes before.
        let end = to.len();
        encoding::encode_varint((end - start) as u64, to);
        let length_bytes = to.len() - end;
        to[start..].rotate_right(length_bytes);
    }

    fn merge_field(&mut self, wire: WireType, from: &mut &[u8]) -> Result<(), DecodeError> {
        encoding::check_wire_type(WireType::LengthDelimited, wire)?;
        encoding::merge_loop(self, from, DecodeContext::default(), |message, from, _| {
            let (number, wire) = encoding::decode_key(from)?;
            message.merge(number, wire, from)
        })
    }
}

/// A field of its own for each message.
impl<M: LogMessage> Wire for Vec<M> {
    const TYPE: Type = Type::Message;
    const LABEL: Label = Label::Repeated;
    const TYPE_NAME: Option<&'static str> = Some(M::NAME);

    fn encode_field(&self, number: u32, to: &mut Vec<u8>) {
        self.iter().for_each(|message| message.encode_field(number, to));
    }

    fn merge_field(&mut self, wire: WireType, from: &mut &[u8]) -> Result<(), DecodeError> {
        let mut message = M::default();
        message.merge_field(wire, from)?;
        self.push(message);
        Ok(())
    }
}

/// A number that older logs do not have.
impl Wire for Option<u16> {
    const TYPE: Type = u16::TYPE;

    fn encode_field(&self, number: u32, to: &mut Vec<u8>) {
        self.iter().for_each(|value| value.encode_field(number, to));
    }

    fn merge_field(&mut self, wire: WireType, from: &mut &[u8]) -> Result<(), DecodeError> {
        self.get_or_insert_default().merge_field(wire, from)
    }
}

/// An enum of a log's messages.
pub(crate) trait WireEnum: Wire {
    /// Names and numbers.
    const VARIANTS: &'static [(&'static str, i32)];

    /// Its descriptor for a file, where values carry its name as a prefix (protobuf scopes them beside their enum), or for
    /// the inside of a message.
    fn enum_descriptor(is_inside: bool) -> EnumDescriptorProto {
        let name = last_part(Self::TYPE_NAME.unwrap_or_default());
        let prefix = if is_inside { String::new() } else { format!("{}_", screaming(name)) };
        let value = |&(variant, number): &(&str, i32)| EnumValueDescriptorProto {
            name: Some(format!("{prefix}{}", screaming(variant))),
            number: Some(number),
            ..Default::default()
        };
        let value = Self::VARIANTS.iter().map(value).collect();
        EnumDescriptorProto { name: Some(name.into()), value, ..Default::default() }
    }
}

/// `Force` of `palpate.Force`.
pub(crate) fn last_part(name: &'static str) -> &'static str {
    name.rsplit('.').next().unwrap_or(name)
}

/// `LateWake` as `LATE_WAKE`.
fn screaming(name: &str) -> String {
    let mut out = String::new();
    for c in name.chars() {
        out.extend((c.is_uppercase() && !out.is_empty()).then_some('_'));
        out.push(c.to_ascii_uppercase());
    }
    out
}

macro_rules! message {
    ($message:expr => for $type:ty { $($field:ident $(as $name:ident)? = $number:literal $of:tt),+ $(,)? }) => {
        impl $crate::log::messages::wire::LogMessage for $type {
            const NAME: &'static str = $message;

            fn descriptor() -> prost_types::DescriptorProto {
                use $crate::log::messages::wire::{Wire, last_part};
                let value = &Self::default();
                let field = vec![$(
                    $crate::log::messages::wire::message_field!(@get value $of)
                        .describe($crate::log::messages::wire::message_field!(@name $field $($name)?), $number)
                ),+];
                prost_types::DescriptorProto { name: Some(last_part($message).into()), field, ..Default::default() }
            }

            fn encode(&self, to: &mut Vec<u8>) {
                use $crate::log::messages::wire::Wire;
                $( $crate::log::messages::wire::message_field!(@get self $of).encode_field($number, to); )+
            }

            fn merge(
                &mut self,
                number: u32,
                wire: prost::encoding::WireType,
                from: &mut &[u8],
            ) -> Result<(), prost::DecodeError> {
                use $crate::log::messages::wire::last_part;
                let (merged, field) = match number {
                    $( $number => (
                        $crate::log::messages::wire::message_field!(@merge self $of number wire from),
                        $crate::log::messages::wire::message_field!(@name $field $($name)?),
                    ), )+
                    _ => return prost::encoding::skip_field(wire, number, from, Default::default()),
                };
                merged.map_err(|mut error| {
                    error.push(last_part($message), field);
                    error
                })
            }
        }
    };
}

/// A field of a table: a place in the value, or computed from it.
macro_rules! message_field {
    (@get $value:ident ($($place:tt)+)) => { $value $($place)+ };
    (@get $value:ident [$get:expr]) => { $get($value) };
    (@merge $value:ident ($($place:tt)+) $number:ident $wire:ident $from:ident) => {
        $crate::log::messages::wire::Wire::merge_field(&mut $value $($place)+, $wire, $from)
    };
    (@merge $value:ident [$get:expr] $number:ident $wire:ident $from:ident) => {
        prost::encoding::skip_field($wire, $number, $from, Default::default())
    };
    (@name $field:ident) => { stringify!($field) };
    (@name $field:ident $name:ident) => { stringify!($name) };
}

/// Messages that have a struct of their own.
macro_rules! messages {
    (
        package $package:literal;
        $(
            $(#[$doc:meta])*
            message $message:ident { $( $(#[$field_doc:meta])* $field:ident: $type:ty = $number:literal, )* }
        )*
    ) => { $(
        $(#[$doc])*
        #[derive(Clone, Debug, Default, PartialEq)]
        pub(crate) struct $message {
            $( $(#[$field_doc])* pub(crate) $field: $type, )*
        }

        $crate::log::messages::wire::message! {
            concat!($package, ".", stringify!($message)) => for $message { $($field = $number (.$field)),* }
        }
    )* };
}

/// An enum as a field: its number; an unknown one reads as the default.
macro_rules! wire_enum {
    ($name:literal for $enum:ident { $($variant:ident),+ $(,)? }) => {
        impl $crate::log::messages::wire::Wire for $enum {
            const TYPE: prost_types::field_descriptor_proto::Type = prost_types::field_descriptor_proto::Type::Enum;
            const TYPE_NAME: Option<&'static str> = Some($name);

            fn encode_field(&self, number: u32, to: &mut Vec<u8>) {
                (*self as i32).encode_field(number, to);
            }

            fn merge_field(
                &mut self,
                wire: prost::encoding::WireType,
                from: &mut &[u8],
            ) -> Result<(), prost::DecodeError> {
                let mut code = 0_i32;
                code.merge_field(wire, from)?;
                *self = [$($enum::$variant),+].into_iter().find(|known| *known as i32 == code).unwrap_or_default();
                Ok(())
            }
        }

        impl $crate::log::messages::wire::WireEnum for $enum {
            const VARIANTS: &'static [(&'static str, i32)] = &[$((stringify!($variant), $enum::$variant as i32)),+];
        }

        // A new variant that is not listed fails to compile here.
        const _: fn($enum) = |value| match value { $($enum::$variant => {})+ };
    };
}

pub(crate) use {message, message_field, messages, wire_enum};

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Clone, Copy, Debug, Default, PartialEq)]
    pub(crate) enum Cause {
        #[default]
        None,
        LateWake,
    }

    #[derive(Clone, Copy, Debug, Default, PartialEq)]
    pub(crate) enum Level {
        #[default]
        Unknown,
        Debug,
    }

    wire_enum! { "sample.Cause" for Cause { None, LateWake } }
    wire_enum! { "sample.Sample.Level" for Level { Unknown, Debug } }

    messages! {
        package "sample";

        /// A place.
        message Point { x: f64 = 1, }

        /// One field of every form.
        message Sample {
            number: u32 = 1,
            /// Documented.
            busy_ns: Uint64s = 4,
            path: Vec<Point> = 5,
            level: Level = 6,
            cause: Cause = 7,
            r#type: String = 8,
            place: Point = 9,
            indices: Fixed32s = 10,
            seconds: i64 = 11,
        }
    }

    #[test]
    fn the_descriptor_says_label_type_and_number_of_every_form() {
        let message = Sample::descriptor();
        let fields: Vec<_> =
            message.field.iter().map(|f| (f.name(), f.number(), f.label(), f.r#type(), f.type_name())).collect();
        let expected = [
            ("number", 1, Label::Optional, Type::Uint32, ""),
            ("busy_ns", 4, Label::Repeated, Type::Uint64, ""),
            ("path", 5, Label::Repeated, Type::Message, ".sample.Point"),
            ("level", 6, Label::Optional, Type::Enum, ".sample.Sample.Level"),
            ("cause", 7, Label::Optional, Type::Enum, ".sample.Cause"),
            ("type", 8, Label::Optional, Type::String, ""),
            ("place", 9, Label::Optional, Type::Message, ".sample.Point"),
            ("indices", 10, Label::Repeated, Type::Fixed32, ""),
            ("seconds", 11, Label::Optional, Type::Int64, ""),
        ];
        assert_eq!(fields, expected);
        let values =
            |e: EnumDescriptorProto| e.value.iter().map(|v| (v.name().to_owned(), v.number())).collect::<Vec<_>>();
        let cause = values(Cause::enum_descriptor(false));
        assert_eq!(cause, [("CAUSE_NONE".to_owned(), 0), ("CAUSE_LATE_WAKE".to_owned(), 1)]);
        let inside = Level::enum_descriptor(true);
        assert_eq!((inside.name(), inside.value[1].name()), ("Level", "DEBUG"));
        assert_eq!((Sample::NAME, message.name()), ("sample.Sample", "Sample"));
    }

    #[test]
    fn repeated_numbers_are_packed_and_repeated_messages_are_not() {
        let sample = Sample {
            busy_ns: Uint64s(vec![1, 300]),
            path: vec![Point { x: -0.0 }, Point { x: 2.0 }],
            cause: Cause::LateWake,
            indices: Fixed32s(vec![7]),
            level: Level::Debug,
            ..Sample::default()
        };
        let mut bytes = Vec::new();
        sample.encode(&mut bytes);
        let holds = |part: &[u8]| bytes.windows(part.len()).any(|window| window == part);
        // Tag (number << 3 | 2), length, values: one field for all numbers.
        assert!(holds(&[4 << 3 | 2, 3, 1, 0xac, 2]));
        assert!(holds(&[10 << 3 | 2, 4, 7, 0, 0, 0]));
        // A field of its own for each message; -0.0, enums and "" are there.
        let minus_zero = [5 << 3 | 2, 9, 1 << 3 | 1, 0, 0, 0, 0, 0, 0, 0, 0x80];
        assert!(holds(&minus_zero) && holds(&[7 << 3, 1, 8 << 3 | 2, 0]));
        let got = Sample::decode(bytes.as_slice()).unwrap();
        assert_eq!(got, sample);
        assert_eq!(got.path[0].x.to_bits(), (-0.0_f64).to_bits());
        // Nothing repeated takes no byte; the rest is always there.
        bytes.clear();
        Sample::default().encode(&mut bytes);
        assert_eq!(bytes.len(), 2 + 2 + 2 + 2 + 11 + 2);
    }

    #[test]
    fn damage_is_named_with_message_and_field_and_an_unknown_enum_is_the_default() {
        let error = Sample::decode(&[9 << 3 | 2, 2, 1 << 3, 1]).unwrap_err().to_string();
        assert!(error.contains("Point.x: Sample.place: invalid wire type"), "{error}");
        assert!(Sample::decode(&[9 << 3 | 2, 200]).is_err());
        assert_eq!(Sample::decode(&[6 << 3, 77, 100 << 1]).map(|sample| sample.level).ok(), None);
        assert_eq!(Sample::decode(&[6 << 3, 77, 12 << 3, 5]).map(|sample| sample.level), Ok(Level::Unknown));
    }
}
