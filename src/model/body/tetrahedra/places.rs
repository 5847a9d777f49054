//! Which nodes and elements a shape or a group means.

use super::{Tissue, TissueRegion, Where};
use crate::Vec3;
use crate::body::Shape;
use crate::error::ModelError;
use crate::mesh::{Group, TetrahedralMesh};

/// Groups that a message names, and characters of a name in it.
const NAMED: usize = 12;
const CHARACTERS: usize = 60;

/// Finds nodes and elements of a mesh.
pub(super) struct Places<'a> {
    pub(super) mesh: &'a TetrahedralMesh,
    /// A point this near to a shape's boundary lies on it (m).
    pub(super) tolerance: f64,
}

impl Places<'_> {
    /// The tissue of every element: `base`, and over it `regions` in order.
    pub(super) fn tissues(&self, base: Tissue, regions: &[TissueRegion]) -> Result<Vec<Tissue>, ModelError> {
        let mut tissues = vec![base; self.mesh.tetrahedra.len()];
        for (index, region) in regions.iter().enumerate() {
            self.apply(region, &mut tissues).map_err(|error| at_region(index, &error))?;
        }
        Ok(tissues)
    }

    fn apply(&self, region: &TissueRegion, tissues: &mut [Tissue]) -> Result<(), ModelError> {
        if region.is_idle() {
            let message = "differs in nothing, give young_modulus_pa, poisson_ratio, density_kg_m3 or viscosity_pa_s";
            return Err(ModelError::new(message));
        }
        let elements = match &region.place {
            Where::Shape(shape) => {
                self.check(shape)?;
                let is_in = |&element: &u32| self.holds(shape, &self.mesh.centroid(element));
                let elements: Vec<u32> = (0..tissues.len() as u32).filter(is_in).collect();
                if elements.is_empty() {
                    let message = "holds no element's centroid: move or enlarge it, or refine the mesh";
                    return Err(ModelError::of("shape", message));
                }
                elements
            }
            Where::Group(name) => {
                let group = self.group(name)?;
                if group.tetrahedra.is_empty() {
                    let message = format!("{} has no tetrahedra: name a group of volumes", quoted(name));
                    return Err(ModelError::of("group", message));
                }
                group.tetrahedra.clone()
            }
        };
        for element in elements {
            let tissue = &mut tissues[element as usize];
            *tissue = region.over(tissue);
            tissue.check()?;
        }
        Ok(())
    }

    /// True for each node that one of `fixed` holds.
    pub(super) fn held(&self, fixed: &[Where]) -> Result<Vec<bool>, ModelError> {
        let mut is_held = vec![false; self.mesh.points.len()];
        for (index, place) in fixed.iter().enumerate() {
            let nodes = self.nodes(place).map_err(|error| error.at(&format!("fixed[{index}]")))?;
            nodes.into_iter().for_each(|node| is_held[node as usize] = true);
        }
        Ok(is_held)
    }

    fn nodes(&self, place: &Where) -> Result<Vec<u32>, ModelError> {
        match place {
            Where::Shape(shape) => {
                self.check(shape)?;
                let is_in = |&node: &u32| self.holds(shape, &self.mesh.points[node as usize]);
                let nodes: Vec<u32> = (0..self.mesh.points.len() as u32).filter(is_in).collect();
                let empty = || ModelError::of("shape", "holds no node: move or enlarge it");
                if nodes.is_empty() { Err(empty()) } else { Ok(nodes) }
            }
            Where::Group(name) => {
                let nodes = self.group(name)?.nodes.clone();
                let empty =
                    || ModelError::new(format!("{} has no nodes: name another group, or a shape", quoted(name)));
                if nodes.is_empty() { Err(empty()) } else { Ok(nodes) }
            }
        }
    }

    fn group(&self, name: &str) -> Result<&Group, ModelError> {
        self.mesh.group(name).ok_or_else(|| {
            let groups = &self.mesh.groups;
            let names: Vec<String> = groups.iter().take(NAMED).map(|group| quoted(&group.name)).collect();
            let more = if groups.len() > NAMED { ", ..." } else { "" };
            let there = match names.is_empty() {
                true => "has none".to_owned(),
                false => format!("has {}{more}", names.join(", ")),
            };
            ModelError::of("group", format!("there is no {}: the mesh {there}", quoted(name)))
        })
    }

    fn check(&self, shape: &Shape) -> Result<(), ModelError> {
        shape.fault().map_or(Ok(()), |(key, message)| Err(ModelError::of(key, message)))
    }

    fn holds(&self, shape: &Shape, point: &Vec3) -> bool {
        shape.holds((*point).into(), [self.tolerance; 3])
    }
}

/// `region[index].key`, as scene files have it.
fn at_region(index: usize, error: &ModelError) -> ModelError {
    let dot = if error.place().is_empty() { "" } else { "." };
    ModelError::of(&format!("region[{index}]{dot}{}", error.place()), error.message())
}

/// A name from a file, bounded and in one line.
fn quoted(name: &str) -> String {
    let cut: String = name.chars().take(CHARACTERS).collect();
    format!("{cut:?}")
}
