//! Friction in a scene file: a number, or the word that stands for no bound.

use std::fmt;

use serde::de::{Deserialize, Deserializer, Error, Visitor};
use serde::ser::{Serialize, Serializer};

use super::Friction;

impl<'de> Deserialize<'de> for Friction {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(FrictionVisitor)
    }
}

impl Serialize for Friction {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match *self {
            Self::Coefficient(coefficient) => serializer.serialize_f64(coefficient),
            Self::Stick => serializer.serialize_str("stick"),
        }
    }
}

struct FrictionVisitor;

impl Visitor<'_> for FrictionVisitor {
    type Value = Friction;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a number of at least 0 or \"stick\"")
    }

    fn visit_f64<E: Error>(self, coefficient: f64) -> Result<Friction, E> {
        Ok(Friction::Coefficient(coefficient))
    }

    fn visit_i64<E: Error>(self, coefficient: i64) -> Result<Friction, E> {
        Ok(Friction::Coefficient(coefficient as f64))
    }

    fn visit_u64<E: Error>(self, coefficient: u64) -> Result<Friction, E> {
        Ok(Friction::Coefficient(coefficient as f64))
    }

    fn visit_str<E: Error>(self, word: &str) -> Result<Friction, E> {
        if word == "stick" {
            Ok(Friction::Stick)
        } else {
            Err(E::invalid_value(serde::de::Unexpected::Str(word), &self))
        }
    }
}
