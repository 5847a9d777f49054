//! The linear model of a patch, and the implicit step that it can take.

mod implicit;
mod tangent;

pub(crate) use implicit::ImplicitStep;
pub(crate) use tangent::{Drift, PatchTangent};
