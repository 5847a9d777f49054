//! The contact's part of a scene: friction, normals, equations.

/// How the tool touches the body.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Deserialize), serde(deny_unknown_fields, default))]
pub struct ContactSpec {
    /// Coulomb friction.
    pub friction: Friction,
    /// Which normal a contact uses.
    pub normals: NormalKind,
    /// Which equations resolve it.
    pub equations: ContactEquations,
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

/// Which normal a contact uses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "scene", derive(serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum NormalKind {
    /// Unit vertex normals interpolated over the triangle: continuous along the surface.
    #[default]
    Interpolated,
    /// The triangle's own normal, as printed in the paper.
    Face,
}

/// Which equations resolve the contact.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "scene", derive(serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum ContactEquations {
    /// Velocity level, mass-weighted.
    #[default]
    Corrected,
    /// The paper's printed equations (10) to (31), to show the difference.
    Paper,
}
