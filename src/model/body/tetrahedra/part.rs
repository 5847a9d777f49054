//! A part of a mesh, as it is named.

use crate::body::Shape;

/// A part of a mesh: a shape, or a named group of it.
///
/// # Real-time
/// A plain value: its methods are wait-free and real-time safe.
#[derive(Clone, Debug, PartialEq)]
pub enum Where {
    /// All that lies in a shape.
    Shape(Shape),
    /// A group of the mesh.
    Group(String),
}
