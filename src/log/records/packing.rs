//! Records of a haptic tick as the runtime's 64-byte [`Record`], and back.
//!
//! # Real-time
//! Wait-free and real-time safe: plain copies.

use crate::model::{Turn, turn_of, wxyz};
use crate::runtime::Nanos;
use crate::runtime::{Channel, Record};

/// Channels of a device: each has its own of every kind.
const CHANNELS: u16 = 32;
/// In the kind of a record: its sample is not whole without the part that comes before it.
const HAS_PART: u16 = 16;
/// The kind of such a part; its code is the kind of the record that it belongs to.
pub(super) const PART: u16 = 31;

/// The most devices that a scene can have; channels beyond theirs are a program's own.
pub(crate) const MAX_DEVICES: u16 = 8;

/// The channel of `kind` for `device`.
fn channel(kind: u16, device: u16) -> Channel {
    Channel(Channel::FIRST_USER.0.saturating_add(device.saturating_mul(CHANNELS)).saturating_add(kind))
}

/// The kind and the device of a channel; `None` if it is not palpate's.
pub(super) fn kind_and_device(channel: Channel) -> Option<(u16, u16)> {
    let number = channel.0.checked_sub(Channel::FIRST_USER.0)?;
    Some((number % CHANNELS, number / CHANNELS)).filter(|&(_, device)| device < MAX_DEVICES)
}

/// True if a record of this kind belongs to a part that came before it.
pub(super) fn has_part(kind: u16) -> bool {
    kind != PART && kind & HAS_PART != 0
}

/// The kind of the record that `kind` is without its part.
pub(super) fn without_part(kind: u16) -> u16 {
    kind & !HAS_PART
}

/// A record and how many half words of it are in use.
pub(super) struct Packing {
    pub(super) record: Record,
    halves: usize,
}

impl Packing {
    pub(super) fn new(stamp: Nanos, kind: u16, device: u16) -> Self {
        Self::of(Record { stamp, channel: channel(kind, device), code: 0, index: 0, words: [0; 6] })
    }

    /// The record of `kind`, with a part before it or without.
    pub(super) fn main(stamp: Nanos, kind: u16, device: u16, has_part: bool) -> Self {
        Self::new(stamp, if has_part { kind | HAS_PART } else { kind }, device)
    }

    /// The part of a record of `kind`.
    pub(super) fn part(stamp: Nanos, kind: u16, device: u16) -> Self {
        let channel = channel(PART, device);
        Self::of(Record { stamp, channel, code: kind, index: 0, words: [0; 6] })
    }

    pub(super) fn of(record: Record) -> Self {
        Self { record, halves: 0 }
    }

    /// The next half of a word and how far to the left its bits are: the upper half comes first.
    fn half(&mut self) -> (&mut u64, usize) {
        self.halves += 1;
        (&mut self.record.words[(self.halves - 1) / 2], 32 * (self.halves % 2))
    }

    /// The next whole word.
    fn word(&mut self) -> &mut u64 {
        self.halves += 2;
        &mut self.record.words[self.halves / 2 - 1]
    }
}

/// A sample that is one record, or two.
pub(super) trait Recorded {
    /// Its log time.
    fn time(&self) -> Nanos;

    /// Its part, if it has one, and its record.
    fn records(&self) -> [Option<Record>; 2];
}

/// A field in a [`Record`]: a small number in its code, a number in its index, all else in its words in order.
pub(super) trait Packed: Sized {
    fn pack(self, to: &mut Packing);
    fn unpack(from: &mut Packing) -> Self;
}

macro_rules! packed_field {
    ($($type:ty: |$at:ident, $value:ident| $pack:expr, $unpack:expr;)*) => { $(
        impl $crate::log::records::packing::Packed for $type {
            fn pack(self, $at: &mut $crate::log::records::packing::Packing) {
                let $value = self;
                $pack
            }

            fn unpack($at: &mut $crate::log::records::packing::Packing) -> Self {
                $unpack
            }
        }
    )* };
}

packed_field! {
    u16: |at, value| at.record.code = value, at.record.code;
    u32: |at, value| at.record.index = value, at.record.index;
    u64: |at, value| *at.word() = value, *at.word();
    Nanos: |at, value| value.0.pack(at), Self(u64::unpack(at));
    f64: |at, value| value.to_bits().pack(at), Self::from_bits(u64::unpack(at));
    [f64; 2]: |at, value| value.into_iter().for_each(|part| part.pack(at)), std::array::from_fn(|_| f64::unpack(at));
    [f64; 3]: |at, value| value.into_iter().for_each(|part| part.pack(at)), std::array::from_fn(|_| f64::unpack(at));
    Turn: |at, value| wxyz(&value).into_iter().for_each(|part| part.pack(at)),
        turn_of(std::array::from_fn(|_| f64::unpack(at)));
    f32: |at, value| { let (word, shift) = at.half(); *word |= u64::from(value.to_bits()) << shift },
        { let (word, shift) = at.half(); Self::from_bits((*word >> shift) as u32) };
}

/// Makes a record of the fields of `$record` and reads it back. Fields behind `and` have a record of their own, which comes
/// before and only where they are not what they usually are.
macro_rules! packed {
    (@fields $record:ident on $kind:literal { $($field:ident),+ } $(and { $($more:ident),+ })? $(of $device:ident)?) => {
        impl $record {
            /// The kind of its channel.
            pub(super) const KIND: u16 = $kind;

            pub(super) fn unpack(record: &Record, _number: u16) -> Self {
                use $crate::log::records::packing::{Packed, Packing};
                let from = &mut Packing::of(*record);
                Self {
                    time: record.stamp,
                    $( $field: Packed::unpack(from), )+
                    $( $( $more: Default::default(), )+ )?
                    $( $device: _number, )?
                }
            }
        }
    };
    ($record:ident on $kind:literal { $($field:ident),+ } $(of $device:ident)?) => {
        $crate::log::records::packing::packed! { @fields $record on $kind { $($field),+ } $(of $device)? }

        impl From<$record> for Record {
            fn from(r: $record) -> Self {
                use $crate::log::records::packing::{Packed, Packing};
                let mut to = Packing::new(r.time, $kind, 0 $( + r.$device )?);
                $( r.$field.pack(&mut to); )+
                to.record
            }
        }

        impl $crate::log::records::packing::Recorded for $record {
            fn time(&self) -> Nanos {
                self.time
            }

            fn records(&self) -> [Option<Record>; 2] {
                [None, Some((*self).into())]
            }
        }
    };
    ($record:ident on $kind:literal { $($field:ident),+ } and { $($more:ident),+ } of $device:ident) => {
        $crate::log::records::packing::packed! { @fields $record on $kind { $($field),+ } and { $($more),+ } of $device }

        impl $record {
            /// Takes over what the part holds.
            pub(super) fn join(&mut self, part: &Record) {
                use $crate::log::records::packing::{Packed, Packing};
                let from = &mut Packing::of(*part);
                $( self.$more = Packed::unpack(from); )+
            }
        }

        impl $crate::log::records::packing::Recorded for $record {
            fn time(&self) -> Nanos {
                self.time
            }

            fn records(&self) -> [Option<Record>; 2] {
                use $crate::log::records::packing::{Packed, Packing};
                let part = |of: &Self| {
                    let mut to = Packing::part(self.time, $kind, self.$device);
                    $( of.$more.pack(&mut to); )+
                    to.record
                };
                let (own, usual) = (part(self), part(&Self::default()));
                let part = (own != usual).then_some(own);
                let mut to = Packing::main(self.time, $kind, self.$device, part.is_some());
                $( self.$field.pack(&mut to); )+
                [part, Some(to.record)]
            }
        }
    };
}

/// One declaration: a plain struct, its form as a [`Record`] and its protobuf message.
macro_rules! record {
    (
        $(#[$doc:meta])*
        $record:ident is $message:literal on $kind:literal {
            $(#[$time_doc:meta])*
            time = 1,
            $( $(#[$field_doc:meta])* $field:ident $(as $name:ident)?: $type:ty = $number:literal, )+
        }
        $( and { $( $(#[$more_doc:meta])* $more:ident: $more_type:ty = $more_number:literal, )+ } )?
        $(of $device:ident $device_number:literal)?
    ) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, Default, PartialEq)]
        pub struct $record {
            $(#[$time_doc])*
            pub time: Nanos,
            $( $(#[$field_doc])* pub $field: $type, )+
            $( $( $(#[$more_doc])* pub $more: $more_type, )+ )?
            $(
                /// The number of the device in the scene, from 0.
                pub $device: u16,
            )?
        }

        packed! { $record on $kind { $($field),+ } $(and { $($more),+ })? $(of $device)? }

        $crate::log::messages::wire::message! { $message => for $record {
            time_ns = 1 (.time),
            $( $field $(as $name)? = $number (.$field), )+
            $( $( $more = $more_number (.$more), )+ )?
            $( $device = $device_number (.$device), )?
        } }
    };
}

pub(super) use {packed, packed_field, record};
