//! From parsed TOML to the scene's structs, with faults that know their field and their place in the text.
//!
//! toml's own deserializer knows places but not fields, and describes types in Rust's words; this one speaks the scene
//! file's language and stops at the first fault in the order of the file.

use serde::Deserializer;
use serde::de::value::StrDeserializer;
use serde::de::{DeserializeSeed, Error, IntoDeserializer, MapAccess, SeqAccess, Unexpected, Visitor};
use toml::Spanned;
use toml::de::{DeArray, DeInteger, DeTable, DeValue};

use super::fault::{Fault, one_of};
use crate::error::quoted;
use crate::printable::printable;

/// A value of the file, ready to be read as what serde asks for.
pub(super) struct Reader<'a, 'i>(&'a DeValue<'i>);

/// Reads a `T` from a parsed document.
pub(super) fn read<T: serde::de::DeserializeOwned>(root: &DeTable<'_>) -> Result<T, Fault> {
    struct Root<'a, 'i>(&'a DeTable<'i>);
    impl<'de> Deserializer<'de> for Root<'_, '_> {
        type Error = Fault;
        fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Fault> {
            visitor.visit_map(Entries::of(self.0))
        }
        serde::forward_to_deserialize_any! {
            bool i8 i16 i32 i64 u8 u16 u32 u64 f32 f64 char str string bytes byte_buf option unit unit_struct
            newtype_struct seq tuple tuple_struct map struct enum identifier ignored_any
        }
    }
    T::deserialize(Root(root)).map_err(|fault| fault.or_at(0))
}

impl Reader<'_, '_> {
    fn wrong(&self, needed: &str) -> Fault {
        let found = match self.0 {
            DeValue::String(text) => quoted(text),
            DeValue::Integer(number) => printable(&number.to_string()).into_owned(),
            DeValue::Float(number) => printable(number.as_str()).into_owned(),
            DeValue::Boolean(value) => value.to_string(),
            DeValue::Datetime(_) => "a date".to_owned(),
            DeValue::Array(_) => "an array".to_owned(),
            DeValue::Table(_) => "a table".to_owned(),
        };
        Fault::new(format!("is {found}, must be {needed}"))
    }

    fn whole_number(&self) -> Result<u64, Fault> {
        let parsed = match self.0 {
            DeValue::Integer(number) => u64::from_str_radix(number.as_str(), number.radix()).ok(),
            _ => None,
        };
        parsed.ok_or_else(|| self.wrong("a whole number of at least 0"))
    }

    fn number(&self) -> Result<f64, Fault> {
        let parsed = match self.0 {
            DeValue::Integer(number) => integer(number).map(|number| number as f64),
            DeValue::Float(number) => number.as_str().parse().ok(),
            _ => None,
        };
        parsed.ok_or_else(|| self.wrong("a number"))
    }

    fn text(&self, needed: &str) -> Result<&str, Fault> {
        match self.0 {
            DeValue::String(text) => Ok(text),
            _ => Err(self.wrong(needed)),
        }
    }

    fn array(&self, needed: &str) -> Result<&DeArray<'_>, Fault> {
        match self.0 {
            DeValue::Array(array) => Ok(array),
            _ => Err(self.wrong(needed)),
        }
    }
}

fn integer(number: &DeInteger<'_>) -> Option<i128> {
    i128::from_str_radix(number.as_str(), number.radix()).ok()
}

impl<'de> Deserializer<'de> for Reader<'_, '_> {
    type Error = Fault;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Fault> {
        match self.0 {
            DeValue::String(text) => visitor.visit_str(text),
            DeValue::Integer(_) | DeValue::Float(_) => visitor.visit_f64(self.number()?),
            DeValue::Boolean(value) => visitor.visit_bool(*value),
            DeValue::Datetime(_) => Err(Fault::invalid_type(Unexpected::Other("a date"), &visitor)),
            DeValue::Array(array) => visitor.visit_seq(Items::of(array)),
            DeValue::Table(table) => visitor.visit_map(Entries::of(table)),
        }
    }

    fn deserialize_u32<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Fault> {
        let number = self.whole_number()?;
        let number = u32::try_from(number).map_err(|_| self.wrong(&format!("at most {}", u32::MAX)))?;
        visitor.visit_u32(number)
    }

    fn deserialize_u64<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Fault> {
        visitor.visit_u64(self.whole_number()?)
    }

    fn deserialize_f64<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Fault> {
        visitor.visit_f64(self.number()?)
    }

    fn deserialize_str<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Fault> {
        visitor.visit_str(self.text("a text in quotes")?)
    }

    fn deserialize_string<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Fault> {
        self.deserialize_str(visitor)
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Fault> {
        visitor.visit_some(self)
    }

    fn deserialize_seq<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Fault> {
        visitor.visit_seq(Items::of(self.array("an array")?))
    }

    fn deserialize_tuple<V: Visitor<'de>>(self, length: usize, visitor: V) -> Result<V::Value, Fault> {
        let needed = format!("an array of {length}");
        let array = self.array(&needed)?;
        if array.len() != length {
            return Err(Fault::new(format!("has {} entries, must be {needed}", array.len())));
        }
        visitor.visit_seq(Items::of(array))
    }

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _name: &'static str,
        keys: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Fault> {
        match self.0 {
            DeValue::Table(table) => visitor.visit_map(Entries::of(table)),
            _ => Err(self.wrong(&format!("a table with the keys {}", keys.join(", ")))),
        }
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        _name: &'static str,
        words: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Fault> {
        let word: StrDeserializer<'_, Fault> = self.text(&one_of(words))?.into_deserializer();
        visitor.visit_enum(word)
    }

    serde::forward_to_deserialize_any! {
        bool i8 i16 i32 i64 u8 u16 f32 char bytes byte_buf unit unit_struct newtype_struct tuple_struct map identifier
        ignored_any
    }
}

/// The entries of a table in the order of the file.
struct Entries<'a, 'i> {
    entries: std::vec::IntoIter<(&'a Spanned<std::borrow::Cow<'i, str>>, &'a Spanned<DeValue<'i>>)>,
    current: Option<(&'a str, &'a Spanned<DeValue<'i>>)>,
}

impl<'a, 'i> Entries<'a, 'i> {
    fn of(table: &'a DeTable<'i>) -> Self {
        let mut entries: Vec<_> = table.iter().collect();
        entries.sort_by_key(|(key, _)| key.span().start);
        Self { entries: entries.into_iter(), current: None }
    }
}

impl<'de> MapAccess<'de> for Entries<'_, '_> {
    type Error = Fault;

    fn next_key_seed<K: DeserializeSeed<'de>>(&mut self, seed: K) -> Result<Option<K::Value>, Fault> {
        let Some((key, value)) = self.entries.next() else { return Ok(None) };
        let name = key.get_ref().as_ref();
        self.current = Some((name, value));
        let deserializer: StrDeserializer<'_, Fault> = name.into_deserializer();
        seed.deserialize(deserializer).map(Some).map_err(|fault| fault.under_key(name).or_at(key.span().start))
    }

    fn next_value_seed<V: DeserializeSeed<'de>>(&mut self, seed: V) -> Result<V::Value, Fault> {
        let (name, value) = self.current.take().expect("serde asks for a value after its key");
        seed.deserialize(Reader(value.get_ref())).map_err(|fault| fault.under_key(name).or_at(value.span().start))
    }
}

/// The items of an array, counted for the dotted path.
struct Items<'a, 'i> {
    items: std::iter::Enumerate<std::slice::Iter<'a, Spanned<DeValue<'i>>>>,
}

impl<'a, 'i> Items<'a, 'i> {
    fn of(array: &'a DeArray<'i>) -> Self {
        Self { items: array.iter().enumerate() }
    }
}

impl<'de> SeqAccess<'de> for Items<'_, '_> {
    type Error = Fault;

    fn next_element_seed<T: DeserializeSeed<'de>>(&mut self, seed: T) -> Result<Option<T::Value>, Fault> {
        let Some((index, item)) = self.items.next() else { return Ok(None) };
        seed.deserialize(Reader(item.get_ref()))
            .map(Some)
            .map_err(|fault| fault.under_index(index).or_at(item.span().start))
    }
}
