//! Physics and numerics: bodies, contact, local models. No threads (but those of a body's forces, with the feature
//! `parallel`), clocks, channels or logging.
//!
//! The equations are those of the paper (Jacobs, Moore, Cavusoglu, IJRR 2010) with the corrections that docs/contact.md
//! lists. One step of any model, whole body or patch, is [`contact::step`].

pub mod body;
pub mod bytes;
pub mod contact;
pub mod equilibrium;
mod error;
pub mod integrator;
mod linear;
pub mod linear_algebra;
pub mod local;
pub mod mesh;
mod pose;
pub mod simulation;
pub mod surroundings;
mod turn;

pub use error::ModelError;
pub use pose::{Pose, Wrench};
pub use turn::{turn_of, wxyz};

/// A point, direction or force in space.
pub type Vec3 = nalgebra::Vector3<f64>;

/// A rotation.
pub type Turn = nalgebra::UnitQuaternion<f64>;

/// A 3 x 3 block of a tangent.
pub type Mat3 = nalgebra::Matrix3<f64>;
