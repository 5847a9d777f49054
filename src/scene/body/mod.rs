//! The body's part of a scene: a block of springs, or tetrahedra of a mesh.

mod block;
mod place;
mod region;
mod shape;
mod table;
mod tetrahedra;
mod volume;

pub use block::{BlockSpec, MassSpringSpec, MaterialSpec};
pub use region::RegionSpec;
pub use table::BodyKind;
pub(super) use table::{BODY_KEYS, REGION_KEYS, misplaced};
pub use tetrahedra::{TetrahedraSpec, TissueRegionSpec, TissueSpec};
pub use volume::Volume;

use crate::error::Error;
use crate::model::body::Body;

/// The soft body of a scene, by its `kind`.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum BodySpec {
    /// A block of point masses and springs: the kind that is meant where none is named.
    MassSpring(MassSpringSpec),
    /// Linear tetrahedra with tissue's own parameters.
    Tetrahedra(TetrahedraSpec),
}

impl BodySpec {
    /// Makes the body that this describes.
    ///
    /// # Errors
    /// If one of its numbers is impossible, a region or what is held is nowhere, or its mesh was not read.
    pub fn build(&self) -> Result<Box<dyn Body>, Error> {
        Ok(match self {
            Self::MassSpring(spec) => Box::new(spec.build()?),
            Self::Tetrahedra(spec) => Box::new(spec.build()?),
        })
    }

    /// The same with its forces computed on so many cores.
    ///
    /// # Errors
    /// Those of [`build`](Self::build); if there are more cores than one and the feature `parallel` is not there, or the system
    /// refuses a thread.
    pub fn build_on(&self, cores: usize) -> Result<Box<dyn Body>, Error> {
        if cores == 1 {
            return self.build();
        }
        #[cfg(feature = "parallel")]
        return Ok(match self {
            Self::MassSpring(spec) => Box::new(spec.build()?.on_cores(cores)?),
            Self::Tetrahedra(spec) => Box::new(spec.build()?.on_cores(cores)?),
        });
        #[cfg(not(feature = "parallel"))]
        Err(Error::scene("global.cores", format!("is {cores}: this program was built without the feature parallel")))
    }

    /// The kind of the body.
    pub fn kind(&self) -> BodyKind {
        match self {
            Self::MassSpring(_) => BodyKind::MassSpring,
            Self::Tetrahedra(_) => BodyKind::Tetrahedra,
        }
    }

    /// The number of its nodes; none if its mesh was not read.
    pub fn node_count(&self) -> usize {
        match self {
            Self::MassSpring(spec) => spec.block.nodes.iter().product(),
            Self::Tetrahedra(spec) => spec.volume.as_ref().map_or(0, |volume| volume.mesh().points.len()),
        }
    }

    /// The block of springs, if it is one.
    pub fn mass_spring(&self) -> Option<&MassSpringSpec> {
        match self {
            Self::MassSpring(spec) => Some(spec),
            Self::Tetrahedra(_) => None,
        }
    }

    /// The block of springs, if it is one, to be changed.
    pub fn mass_spring_mut(&mut self) -> Option<&mut MassSpringSpec> {
        match self {
            Self::MassSpring(spec) => Some(spec),
            Self::Tetrahedra(_) => None,
        }
    }

    /// The tetrahedra, if it is made of them.
    pub fn tetrahedra(&self) -> Option<&TetrahedraSpec> {
        match self {
            Self::MassSpring(_) => None,
            Self::Tetrahedra(spec) => Some(spec),
        }
    }

    /// The tetrahedra, if it is made of them, to be changed.
    pub fn tetrahedra_mut(&mut self) -> Option<&mut TetrahedraSpec> {
        match self {
            Self::MassSpring(_) => None,
            Self::Tetrahedra(spec) => Some(spec),
        }
    }

    /// The number of its regions.
    pub fn region_count(&self) -> usize {
        match self {
            Self::MassSpring(spec) => spec.regions.len(),
            Self::Tetrahedra(spec) => spec.regions.len(),
        }
    }
}
