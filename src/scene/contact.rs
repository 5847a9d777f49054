//! The contact's part of a scene: friction, normals, equations.

use std::fmt;

use serde::de::{Deserialize, Deserializer, Error, Visitor};
use serde::ser::{Serialize, Serializer};

use crate::model::contact::{Equations, Normals};

/// The contact of the tools with the body: friction, normals, equations.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Deserialize, serde::Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct ContactSpec {
    /// Coulomb friction between tool and body.
    pub friction: Friction,
    /// The normal that a contact uses: of the face, or interpolated between nodes.
    pub normals: Normals,
    /// The equations that resolve a contact.
    pub equations: Equations,
}

/// Coulomb friction between tool and body, in a scene file a number or the word "stick".
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Friction {
    /// The coefficient mu >= 0.
    Coefficient(f64),
    /// Unbounded friction: a touching tool sticks until it is pulled off.
    Stick,
}

impl Default for Friction {
    fn default() -> Self {
        Self::Coefficient(0.0)
    }
}

impl Friction {
    /// The coefficient; infinite for [`Friction::Stick`].
    pub fn coefficient(self) -> f64 {
        match self {
            Self::Coefficient(mu) => mu,
            Self::Stick => f64::INFINITY,
        }
    }
}

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
