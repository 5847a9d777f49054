//! What a reader finds in a file of a volume: nodes, tetrahedra, groups, and cells of other kinds.

use std::collections::{BTreeMap, HashMap};

use palpate_model::Vec3;
use palpate_model::mesh::{Group, TetrahedralMesh};

use super::VolumeFile;
use crate::error::{MeshError, quoted};

/// Most groups of a file: each may list all nodes.
const MOST_GROUPS: usize = 256;
/// What a reader calls the cells that are kept.
pub const TETRAHEDRON: &str = "linear tetrahedra";

/// What a reader has found so far.
#[derive(Debug, Default)]
pub struct Collected {
    pub points: Vec<Vec3>,
    tetrahedra: Vec<[u32; 4]>,
    left_out: BTreeMap<String, usize>,
    groups: Vec<Group>,
    by_name: HashMap<String, usize>,
}

impl Collected {
    /// The number of a group; one of a new name is made.
    pub fn group(&mut self, name: &str) -> Result<usize, MeshError> {
        if let Some(&number) = self.by_name.get(name) {
            return Ok(number);
        }
        if self.groups.len() == MOST_GROUPS {
            return Err(MeshError::new(format!("group {} is one too many, {MOST_GROUPS} are possible", quoted(name))));
        }
        self.by_name.insert(name.to_owned(), self.groups.len());
        self.groups.push(Group { name: name.to_owned(), ..Group::default() });
        Ok(self.groups.len() - 1)
    }

    /// Adds a cell of `kind`, in these groups.
    pub fn add(&mut self, kind: &str, nodes: &[u32], groups: &[usize]) {
        let element = match <[u32; 4]>::try_from(nodes) {
            Ok(corners) if kind == TETRAHEDRON => {
                self.tetrahedra.push(corners);
                Some(self.tetrahedra.len() as u32 - 1)
            }
            _ => {
                self.leave_out(kind);
                None
            }
        };
        for &group in groups {
            self.join(group, nodes, element);
        }
    }

    /// Puts nodes, and an element, into a group.
    pub fn join(&mut self, group: usize, nodes: &[u32], element: Option<u32>) {
        self.groups[group].nodes.extend(nodes);
        self.groups[group].tetrahedra.extend(element);
    }

    /// Number of tetrahedra so far.
    pub fn elements(&self) -> u32 {
        self.tetrahedra.len() as u32
    }

    fn leave_out(&mut self, kind: &str) {
        match self.left_out.get_mut(kind) {
            Some(count) => *count += 1,
            None => {
                self.left_out.insert(kind.to_owned(), 1);
            }
        }
    }

    /// The mesh, its groups in the order in which they came.
    ///
    /// # Errors
    /// If there are no tetrahedra, or a coordinate is not finite.
    pub fn finish(mut self) -> Result<VolumeFile, MeshError> {
        if self.tetrahedra.is_empty() {
            let others: Vec<String> = self.left_out.iter().map(|(kind, count)| format!("{count} {kind}")).collect();
            let others = if others.is_empty() { String::new() } else { format!(", but {}", others.join(", ")) };
            return Err(MeshError::new(format!(
                "there are no linear tetrahedra{others}: save a volume mesh of order 1"
            )));
        }
        if let Some(node) = self.points.iter().position(|point| !point.iter().all(|x| x.is_finite())) {
            let [x, y, z] = self.points[node].into();
            return Err(MeshError::new(format!("node {node}, counted from 0, is at ({x}, {y}, {z}): no place")));
        }
        for group in &mut self.groups {
            group.nodes.sort_unstable();
            group.nodes.dedup();
        }
        self.groups.retain(|group| !group.nodes.is_empty());
        let Self { points, tetrahedra, left_out, groups, .. } = self;
        Ok(VolumeFile {
            mesh: TetrahedralMesh { points, tetrahedra, groups },
            left_out_elements: left_out.into_iter().collect(),
        })
    }
}
