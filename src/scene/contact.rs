//! The contact's part of a scene: friction, normals, equations.

use crate::model::contact::{Equations, Normals};

/// How the tool touches the body.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Deserialize, serde::Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct ContactSpec {
    /// Coulomb friction.
    pub friction: Friction,
    /// Which normal a contact uses.
    pub normals: Normals,
    /// Which equations resolve it.
    pub equations: Equations,
}

/// Coulomb friction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Friction {
    /// The coefficient mu >= 0.
    Coefficient(f64),
    /// Unbounded: a touching tool sticks until it is pulled off.
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
