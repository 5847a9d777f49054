//! Regions of a block as a scene names them: layers and inclusions.

use super::shape;
use crate::model::body::{Region, Shape};

/// A part of a block that differs in material.
///
/// A node belongs to every region whose closed shape holds its rest position; of several that give the same value the
/// last one counts. [`BlockBuilder::region`](crate::model::body::BlockBuilder::region) says what becomes of springs
/// between two materials.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct RegionSpec {
    /// Name of the region, for the reader.
    pub name: Option<String>,
    /// The shape that holds its nodes.
    #[serde(serialize_with = "shape::serialize")]
    pub shape: Shape,
    /// Stiffness k of its springs (N/m); as it was if absent.
    pub stiffness_n_per_m: Option<f64>,
    /// Damping ratio zeta in b = zeta sqrt(2 m k), with the region's m and k; as it was if absent.
    pub damping_ratio: Option<f64>,
    /// Mass of each of its nodes (kg); as it was if absent.
    pub node_mass_kg: Option<f64>,
}

impl RegionSpec {
    /// The region as a block takes it.
    pub(super) fn region(&self) -> Region {
        Region {
            shape: self.shape,
            stiffness: self.stiffness_n_per_m,
            damping_ratio: self.damping_ratio,
            node_mass: self.node_mass_kg,
        }
    }
}
