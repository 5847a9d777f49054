//! Protobuf messages from one definition each.
//!
//! [`proto_schema!`] makes the structs of a package, their field numbers and their descriptors from one text, so that
//! they cannot disagree; every log embeds the descriptors and needs no plugin in a viewer.
//!
//! ```text
//! package "palpate" in "palpate/log.proto" imports [];
//! enum Cause { None, LateWake }                     values with the prefix CAUSE_
//! enum Level in Log { Unknown, Debug }              inside the message Log, values without a prefix
//! message Log {
//!     time_ns: uint64 = 1,
//!     level: int32 as Level = 2,                    an enum: a number in the struct
//!     place: message of Vector3 = 3,
//!     busy_ns: repeated uint64 = 4,                 packed
//!     path: repeated message of Vector3 = 5,
//! }
//! ```
//!
//! Every single field is always written (`required` to prost, plain proto3 to a reader): proto3 leaves out what equals
//! zero, and -0.0 equals zero, so a force would not come back bit for bit.

use prost_types::field_descriptor_proto::{Label, Type};
use prost_types::{DescriptorProto, EnumDescriptorProto, EnumValueDescriptorProto, FieldDescriptorProto};

/// A protobuf message of a log.
pub(crate) trait LogMessage: prost::Message + Default {
    /// Its full protobuf name, which is the name of its MCAP schema.
    const NAME: &'static str;

    /// Its fields, without enums inside.
    fn descriptor() -> DescriptorProto;
}

/// An enum of a log's messages.
pub(crate) trait LogEnum {
    /// Its full protobuf name.
    const NAME: &'static str;
}

macro_rules! rust_type {
    (repeated $($single:tt)+) => {
        Vec<rust_type!(required $($single)+)>
    };
    (required uint32) => {
        u32
    };
    (required fixed32) => {
        u32
    };
    (required uint64) => {
        u64
    };
    (required int32) => {
        i32
    };
    (required int64) => {
        i64
    };
    (required float) => {
        f32
    };
    (required double) => {
        f64
    };
    (required bool) => {
        bool
    };
    (required string) => {
        String
    };
    (required message $of:ident) => {
        $of
    };
}

/// One message: its fields are taken one by one into `[{documentation name label kind (message) (enum) number}]`, since
/// a pattern cannot tell a label from a kind.
macro_rules! proto_message {
    (
        $head:tt [$($known:tt)*]
        $(#[$doc:meta])* $field:ident: repeated $kind:ident $(of $of:ident)? $(as $as:ident)? = $tag:tt, $($rest:tt)*
    ) => {
        proto_message! { $head [$($known)* {[$(#[$doc])*] $field repeated $kind ($($of)?) ($($as)?) $tag}] $($rest)* }
    };
    (
        $head:tt [$($known:tt)*]
        $(#[$doc:meta])* $field:ident: $kind:ident $(of $of:ident)? $(as $as:ident)? = $tag:tt, $($rest:tt)*
    ) => {
        proto_message! { $head [$($known)* {[$(#[$doc])*] $field required $kind ($($of)?) ($($as)?) $tag}] $($rest)* }
    };
    (
        {$package:literal [$($doc:tt)*] $message:ident}
        [$( {[$($field_doc:tt)*] $field:ident $label:ident $kind:ident ($($of:ident)?) ($($as:ident)?) $tag:tt} )*]
    ) => {
        $($doc)*
        #[derive(Clone, PartialEq, prost::Message)]
        pub(crate) struct $message {
            $( $($field_doc)* #[prost($kind, $label, tag = $tag)] pub $field: rust_type!($label $kind $($of)?), )*
        }

        impl $crate::log::proto::LogMessage for $message {
            const NAME: &'static str = concat!($package, ".", stringify!($message));

            fn descriptor() -> prost_types::DescriptorProto {
                prost_types::DescriptorProto {
                    name: Some(stringify!($message).into()),
                    field: vec![$( $crate::log::proto::field_descriptor(
                        stringify!($field),
                        $tag,
                        stringify!($label),
                        stringify!($kind),
                        None$(.or(Some(<$of as $crate::log::proto::LogMessage>::NAME)))?
                            $(.or(Some(<$as as $crate::log::proto::LogEnum>::NAME)))?,
                    ) ),*],
                    ..Default::default()
                }
            }
        }
    };
}

macro_rules! proto_schema {
    (
        package $package:literal in $path:literal imports [$($import:literal),*];
        $(enum $enum:ident $(in $owner:ident)? { $($variant:ident),+ $(,)? })*
        $(
            $(#[$doc:meta])*
            message $message:ident { $($fields:tt)* }
        )*
    ) => {
        $( proto_message! { {$package [$(#[$doc])*] $message} [] $($fields)* } )*

        $( impl $crate::log::proto::LogEnum for $enum {
            const NAME: &'static str = concat!($package, ".", $(stringify!($owner), ".",)? stringify!($enum));
        } )*

        /// The descriptor of all messages and enums above.
        pub(crate) fn file() -> prost_types::FileDescriptorProto {
            // A new variant that is not listed in the schema fails to compile here.
            $( const _: fn($enum) = |value| match value { $($enum::$variant => {})+ }; )*
            let file = prost_types::FileDescriptorProto {
                name: Some($path.into()),
                package: Some($package.into()),
                syntax: Some("proto3".into()),
                dependency: vec![$($import.into()),*],
                message_type: vec![$(<$message as $crate::log::proto::LogMessage>::descriptor()),*],
                ..Default::default()
            };
            $( let file = $crate::log::proto::with_enum(
                file,
                None$(.or(Some(stringify!($owner))))?,
                stringify!($enum),
                &[$((stringify!($variant), $enum::$variant as i32)),+],
            ); )*
            file
        }
    };
}

pub(crate) use {proto_message, proto_schema, rust_type};

/// `file` with one more enum, in it or in its message `owner`.
pub(crate) fn with_enum(
    mut file: prost_types::FileDescriptorProto,
    owner: Option<&str>,
    name: &str,
    variants: &[(&str, i32)],
) -> prost_types::FileDescriptorProto {
    // Protobuf scopes the names of values beside their enum: in a file each carries it as a prefix.
    let prefix = if owner.is_some() { String::new() } else { format!("{}_", screaming(name)) };
    let value = |&(variant, number): &(&str, i32)| EnumValueDescriptorProto {
        name: Some(format!("{prefix}{}", screaming(variant))),
        number: Some(number),
        ..Default::default()
    };
    let values = variants.iter().map(value).collect();
    let descriptor = EnumDescriptorProto { name: Some(name.into()), value: values, ..Default::default() };
    match owner {
        None => file.enum_type.push(descriptor),
        Some(owner) => {
            let inside = file.message_type.iter_mut().find(|message| message.name() == owner);
            inside.into_iter().for_each(|message| message.enum_type.push(descriptor.clone()));
        }
    }
    file
}

pub(crate) fn field_descriptor(
    name: &str,
    number: i32,
    label: &str,
    kind: &str,
    type_name: Option<&str>,
) -> FieldDescriptorProto {
    let r#type = match (kind, type_name) {
        ("message", _) => Type::Message,
        (_, Some(_)) => Type::Enum,
        ("uint32", _) => Type::Uint32,
        ("fixed32", _) => Type::Fixed32,
        ("uint64", _) => Type::Uint64,
        ("int32", _) => Type::Int32,
        ("int64", _) => Type::Int64,
        ("float", _) => Type::Float,
        ("double", _) => Type::Double,
        ("bool", _) => Type::Bool,
        (_, _) => Type::String,
    };
    let label = if label == "repeated" { Label::Repeated } else { Label::Optional };
    FieldDescriptorProto {
        name: Some(name.trim_start_matches("r#").into()),
        number: Some(number),
        label: Some(label as i32),
        r#type: Some(r#type as i32),
        type_name: type_name.map(|name| format!(".{name}")),
        ..Default::default()
    }
}

/// `LateWake` as `LATE_WAKE`.
fn screaming(name: &str) -> String {
    let mut out = String::with_capacity(name.len() + 4);
    for (i, c) in name.chars().enumerate() {
        if i > 0 && c.is_uppercase() {
            out.push('_');
        }
        out.push(c.to_ascii_uppercase());
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use prost::Message;

    #[derive(Clone, Copy)]
    enum Cause {
        None,
        LateWake,
    }

    #[derive(Clone, Copy)]
    enum Level {
        Unknown,
        Debug,
    }

    proto_schema! {
        package "sample" in "sample/sample.proto" imports ["other.proto"];
        enum Cause { None, LateWake }
        enum Level in Sample { Unknown, Debug }

        /// A place.
        message Point { x: double = 1, }

        /// One field of every form.
        message Sample {
            number: uint32 = 1,
            /// Documented.
            busy_ns: repeated uint64 = 4,
            path: repeated message of Point = 5,
            level: int32 as Level = 6,
            causes: repeated int32 as Cause = 7,
            names: repeated string = 8,
            place: message of Point = 9,
            indices: repeated fixed32 = 10,
            seconds: int64 = 11,
        }
    }

    #[test]
    fn the_descriptor_says_label_type_and_number_of_every_form() {
        let file = file();
        assert_eq!((file.name(), file.package(), file.syntax()), ("sample/sample.proto", "sample", "proto3"));
        assert_eq!(file.dependency, ["other.proto"]);
        let fields: Vec<_> = file.message_type[1]
            .field
            .iter()
            .map(|f| (f.name(), f.number(), f.label(), f.r#type(), f.type_name()))
            .collect();
        let expected = [
            ("number", 1, Label::Optional, Type::Uint32, ""),
            ("busy_ns", 4, Label::Repeated, Type::Uint64, ""),
            ("path", 5, Label::Repeated, Type::Message, ".sample.Point"),
            ("level", 6, Label::Optional, Type::Enum, ".sample.Sample.Level"),
            ("causes", 7, Label::Repeated, Type::Enum, ".sample.Cause"),
            ("names", 8, Label::Repeated, Type::String, ""),
            ("place", 9, Label::Optional, Type::Message, ".sample.Point"),
            ("indices", 10, Label::Repeated, Type::Fixed32, ""),
            ("seconds", 11, Label::Optional, Type::Int64, ""),
        ];
        assert_eq!(fields, expected);
        let values =
            |e: &EnumDescriptorProto| e.value.iter().map(|v| (v.name().to_owned(), v.number())).collect::<Vec<_>>();
        assert_eq!(values(&file.enum_type[0]), [("CAUSE_NONE".to_owned(), 0), ("CAUSE_LATE_WAKE".to_owned(), 1)]);
        let inside = &file.message_type[1].enum_type[0];
        assert_eq!((inside.name(), values(inside)[1].0.as_str()), ("Level", "DEBUG"));
        assert_eq!((Sample::NAME, <Level as LogEnum>::NAME), ("sample.Sample", "sample.Sample.Level"));
    }

    #[test]
    fn repeated_numbers_are_packed_and_repeated_messages_are_not() {
        let sample = Sample {
            busy_ns: vec![1, 300],
            path: vec![Point { x: -0.0 }, Point { x: 2.0 }],
            causes: vec![Cause::LateWake as i32, Cause::None as i32],
            names: vec!["a".into(), String::new()],
            indices: vec![7],
            level: Level::Debug as i32,
            ..Sample::default()
        };
        let bytes = sample.encode_to_vec();
        let holds = |part: &[u8]| bytes.windows(part.len()).any(|window| window == part);
        // Tag (number << 3 | 2), length, values: one field for all numbers.
        assert!(holds(&[4 << 3 | 2, 3, 1, 0xac, 2]));
        assert!(holds(&[7 << 3 | 2, 2, 1, 0]));
        assert!(holds(&[10 << 3 | 2, 4, 7, 0, 0, 0]));
        // A field of its own for each message and each string; -0.0 and "" are there.
        let minus_zero = [5 << 3 | 2, 9, 1 << 3 | 1, 0, 0, 0, 0, 0, 0, 0, 0x80];
        assert!(holds(&minus_zero) && holds(&[8 << 3 | 2, 1, b'a', 8 << 3 | 2, 0]));
        let got = Sample::decode(bytes.as_slice()).unwrap();
        assert_eq!(got, sample);
        assert_eq!(got.path[0].x.to_bits(), (-0.0_f64).to_bits());
        // Nothing repeated takes no byte; number, level, place and seconds are always there.
        assert_eq!(Sample::default().encode_to_vec().len(), 2 + 2 + 11 + 2);
    }
}
