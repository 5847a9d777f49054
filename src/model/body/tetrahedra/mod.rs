//! Bodies of linear tetrahedra with tissue's own parameters.

mod builder;
mod tissue;

pub use builder::{TetrahedraBuilder, Where};
pub use tissue::{Tissue, TissueRegion};
