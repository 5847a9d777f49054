//! The contact's part of a scene: friction, normals, equations.

use std::fmt;

use serde::de::{Deserialize, Deserializer, Error, Visitor};
use serde::ser::{Serialize, Serializer};

use crate::model::contact::{self, Equations, Law, Normals};

/// The contact of the tools with the body: friction, normals, equations.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Deserialize, serde::Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct ContactSpec {
    /// Coulomb friction between tool and body; with a static coefficient as well, that of sliding.
    pub friction: FrictionSpec,
    /// The coefficient that breaks a sticking tool loose, at least that of sliding; the same if absent.
    pub static_friction: Option<f64>,
    /// The speed (m/s) over which the coefficient falls from the static one to that of sliding; 0 for a fall at once.
    pub stribeck_m_s: f64,
    /// The normal that a contact uses: of the face, or interpolated between nodes.
    pub normals: Normals,
    /// The equations that resolve a contact.
    pub equations: Equations,
}

impl ContactSpec {
    /// The law of this contact.
    pub(crate) fn law(&self) -> Law {
        let kinetic = self.friction.coefficient();
        let breakaway = self.static_friction.unwrap_or(kinetic);
        let friction = contact::Friction { kinetic, breakaway, stribeck: self.stribeck_m_s };
        Law { friction, normals: self.normals, equations: self.equations }
    }
}

/// Coulomb friction between tool and body, in a scene file a number or the word "stick".
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FrictionSpec {
    /// The coefficient mu >= 0.
    Coefficient(f64),
    /// Unbounded friction: a touching tool sticks until it is pulled off.
    Stick,
}

impl Default for FrictionSpec {
    fn default() -> Self {
        Self::Coefficient(0.0)
    }
}

impl FrictionSpec {
    /// The coefficient; infinite for [`FrictionSpec::Stick`].
    pub fn coefficient(self) -> f64 {
        match self {
            Self::Coefficient(mu) => mu,
            Self::Stick => f64::INFINITY,
        }
    }
}

impl<'de> Deserialize<'de> for FrictionSpec {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(FrictionVisitor)
    }
}

impl Serialize for FrictionSpec {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match *self {
            Self::Coefficient(coefficient) => serializer.serialize_f64(coefficient),
            Self::Stick => serializer.serialize_str("stick"),
        }
    }
}

struct FrictionVisitor;

impl Visitor<'_> for FrictionVisitor {
    type Value = FrictionSpec;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a number of at least 0 or \"stick\"")
    }

    fn visit_f64<E: Error>(self, coefficient: f64) -> Result<FrictionSpec, E> {
        Ok(FrictionSpec::Coefficient(coefficient))
    }

    fn visit_i64<E: Error>(self, coefficient: i64) -> Result<FrictionSpec, E> {
        Ok(FrictionSpec::Coefficient(coefficient as f64))
    }

    fn visit_u64<E: Error>(self, coefficient: u64) -> Result<FrictionSpec, E> {
        Ok(FrictionSpec::Coefficient(coefficient as f64))
    }

    fn visit_str<E: Error>(self, word: &str) -> Result<FrictionSpec, E> {
        if word == "stick" {
            Ok(FrictionSpec::Stick)
        } else {
            Err(E::invalid_value(serde::de::Unexpected::Str(word), &self))
        }
    }
}
