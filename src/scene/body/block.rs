//! A block of springs as a scene describes it: shape, fixed faces, material.

use super::RegionSpec;
use crate::error::Error;
use crate::model::body::{Block, BlockBuilder};
use crate::model::mesh::Face;

/// A block of nodes joined by springs to all 26 neighbours.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct MassSpringSpec {
    /// The block's lattice: nodes, edge lengths, fixed faces.
    pub block: BlockSpec,
    /// The material of all nodes and springs outside of regions.
    pub material: MaterialSpec,
    /// Parts of the body that differ in material, in order: later ones win.
    #[serde(rename = "region", skip_serializing_if = "Vec::is_empty")]
    pub regions: Vec<RegionSpec>,
}

impl MassSpringSpec {
    /// Makes the body that this describes.
    ///
    /// # Errors
    /// If one of its numbers is impossible, or a region is nowhere.
    pub fn build(&self) -> Result<Block, Error> {
        Ok(self.builder().build().map_err(|error| error.at("body"))?)
    }

    /// The builder of this body.
    pub(in crate::scene) fn builder(&self) -> BlockBuilder {
        let builder = Block::builder(self.block.nodes, self.block.size_m)
            .node_mass(self.material.node_mass_kg)
            .stiffness(self.material.stiffness_n_per_m)
            .damping_ratio(self.material.damping_ratio);
        let builder = self.regions.iter().fold(builder, |builder, spec| builder.region(spec.region()));
        self.block.fixed.iter().fold(builder, |builder, &face| builder.fix(face))
    }
}

/// A block's lattice.
#[derive(Clone, Debug, PartialEq, serde::Deserialize, serde::Serialize)]
#[serde(deny_unknown_fields)]
pub struct BlockSpec {
    /// Nodes per axis, at least 2 each; node id = i + nx (j + ny k).
    pub nodes: [usize; 3],
    /// Edge lengths (m).
    pub size_m: [f64; 3],
    /// Faces of the block that are held stationary.
    #[serde(default = "default_fixed")]
    pub fixed: Vec<Face>,
}

fn default_fixed() -> Vec<Face> {
    vec![Face::ZMin]
}

/// The material of all springs and nodes that are in no region.
#[derive(Clone, Copy, Debug, PartialEq, serde::Deserialize, serde::Serialize)]
#[serde(deny_unknown_fields)]
pub struct MaterialSpec {
    /// Mass of a node (kg).
    pub node_mass_kg: f64,
    /// Stiffness k of a spring (N/m).
    pub stiffness_n_per_m: f64,
    /// Damping ratio zeta in b = zeta sqrt(2 m k), the paper's definition.
    pub damping_ratio: f64,
}
