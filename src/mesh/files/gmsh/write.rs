//! Writing of MSH 4.1, ASCII.

use std::collections::BTreeMap;
use std::io::{self, Write};

use palpate_model::mesh::TetrahedralMesh;

/// Writes `mesh` as MSH 4.1, ASCII, in metres, so that Gmsh and its like open it: coordinates with all their digits, groups of
/// elements as physical volumes, groups of nodes alone as physical surfaces of the surface triangles that have all their
/// corners in them, or of points where there are no such triangles or they do not reach all nodes.
///
/// # Errors
/// Those of `out`.
pub fn write_msh(mesh: &TetrahedralMesh, out: &mut impl Write) -> io::Result<()> {
    let plan = Plan::of(mesh);
    writeln!(out, "$MeshFormat\n4.1 0 8\n$EndMeshFormat")?;
    plan.write_names(mesh, out)?;
    plan.write_entities(mesh, out)?;
    let nodes = mesh.points.len();
    writeln!(out, "$Nodes\n1 {nodes} 1 {nodes}\n3 1 0 {nodes}")?;
    (1..=nodes).try_for_each(|tag| writeln!(out, "{tag}"))?;
    for point in &mesh.points {
        // The shortest digits that are read as the same number.
        writeln!(out, "{:?} {:?} {:?}", point.x, point.y, point.z)?;
    }
    writeln!(out, "$EndNodes")?;
    plan.write_elements(out)
}

/// Which entities there are: elements of one kind that are in the same groups.
struct Plan {
    /// The dimension that each group has.
    dimensions: Vec<usize>,
    /// For each dimension the elements of each entity by the entity's groups.
    entities: [BTreeMap<Vec<usize>, Vec<Vec<u32>>>; 4],
}

impl Plan {
    fn of(mesh: &TetrahedralMesh) -> Self {
        let triangles = mesh.surface_triangles();
        let mut plan = Self { dimensions: Vec::new(), entities: Default::default() };
        let mut at_point: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
        let mut of_triangle = vec![Vec::new(); triangles.len()];
        let mut of_element = vec![Vec::new(); mesh.tetrahedra.len()];
        for (number, group) in mesh.groups.iter().enumerate() {
            let has = |node: &u32| group.nodes.binary_search(node).is_ok();
            let within: Vec<usize> = (0..triangles.len()).filter(|&t| triangles[t].iter().all(has)).collect();
            let mut reached: Vec<u32> = within.iter().flat_map(|&t| triangles[t]).collect();
            reached.sort_unstable();
            reached.dedup();
            let dimension = match () {
                () if !group.tetrahedra.is_empty() => 3,
                () if reached == group.nodes => 2,
                () => 0,
            };
            match dimension {
                3 => group.tetrahedra.iter().for_each(|&element| of_element[element as usize].push(number)),
                2 => within.iter().for_each(|&t| of_triangle[t].push(number)),
                _ => group.nodes.iter().for_each(|&node| at_point.entry(node).or_default().push(number)),
            }
            plan.dimensions.push(dimension);
        }
        for (node, groups) in at_point {
            plan.entities[0].entry(groups).or_default().push(vec![node]);
        }
        for (triangle, groups) in triangles.iter().zip(of_triangle).filter(|(_, groups)| !groups.is_empty()) {
            plan.entities[2].entry(groups).or_default().push(triangle.to_vec());
        }
        for (element, groups) in mesh.tetrahedra.iter().zip(of_element) {
            plan.entities[3].entry(groups).or_default().push(element.to_vec());
        }
        plan
    }

    /// The names of the groups, which are tagged by their numbers from 1.
    fn write_names(&self, mesh: &TetrahedralMesh, out: &mut impl Write) -> io::Result<()> {
        if mesh.groups.is_empty() {
            return Ok(());
        }
        writeln!(out, "$PhysicalNames\n{}", mesh.groups.len())?;
        for (number, (group, dimension)) in mesh.groups.iter().zip(&self.dimensions).enumerate() {
            // A name has no quotes and ends with its line.
            let name: String = group.name.chars().filter(|c| !c.is_control() && *c != '"').collect();
            writeln!(out, "{dimension} {} \"{name}\"", number + 1)?;
        }
        writeln!(out, "$EndPhysicalNames")
    }

    fn write_entities(&self, mesh: &TetrahedralMesh, out: &mut impl Write) -> io::Result<()> {
        let quality = mesh.quality();
        let corner = |point: palpate_model::Vec3| format!("{:?} {:?} {:?}", point.x, point.y, point.z);
        let counts = self.entities.each_ref().map(BTreeMap::len);
        writeln!(out, "$Entities\n{} {} {} {}", counts[0], counts[1], counts[2], counts[3])?;
        for (dimension, entities) in self.entities.iter().enumerate() {
            for (number, groups) in entities.keys().enumerate() {
                let tags: String = groups.iter().map(|group| format!(" {}", group + 1)).collect();
                let (tag, low, count) = (number + 1, corner(quality.low), groups.len());
                match dimension {
                    0 => writeln!(out, "{tag} {low} {count}{tags}")?,
                    _ => writeln!(out, "{tag} {low} {} {count}{tags} 0", corner(quality.high))?,
                }
            }
        }
        writeln!(out, "$EndEntities")
    }

    fn write_elements(&self, out: &mut impl Write) -> io::Result<()> {
        let blocks: usize = self.entities.iter().map(BTreeMap::len).sum();
        let all: usize = self.entities.iter().flat_map(BTreeMap::values).map(Vec::len).sum();
        writeln!(out, "$Elements\n{blocks} {all} 1 {all}")?;
        let mut tag = 0;
        for (dimension, entities) in self.entities.iter().enumerate() {
            let kind = [15, 1, 2, 4][dimension];
            for (number, elements) in entities.values().enumerate() {
                writeln!(out, "{dimension} {} {kind} {}", number + 1, elements.len())?;
                for nodes in elements {
                    tag += 1;
                    let nodes: String = nodes.iter().map(|node| format!(" {}", node + 1)).collect();
                    writeln!(out, "{tag}{nodes}")?;
                }
            }
        }
        writeln!(out, "$EndElements")
    }
}
