//! What the tests of tetrahedra share: meshes, states, and the forces by a plain loop over the elements.
#![allow(dead_code)]

pub mod bent;

use std::path::{Path, PathBuf};

use palpate_model::body::{Body, InstructionSet, Shape, State, Tetrahedra, Tissue, Where};
use palpate_model::mesh::TetrahedralMesh;
use palpate_model::{Mat3, Vec3};

/// The instruction sets of this machine.
pub fn sets() -> impl Iterator<Item = InstructionSet> {
    InstructionSet::ALL.into_iter().filter(|set| set.is_available())
}

/// The reference data of tissue.
pub fn reference(name: &str) -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folder = here.ancestors().map(|folder| folder.join("tests/reference/tissue")).find(|folder| folder.is_dir());
    folder.expect("the reference data are in the repository").join(name)
}

/// Three columns behind the time, a row per tick.
pub fn series(name: &str) -> Vec<Vec3> {
    let text = std::fs::read_to_string(reference(name)).expect("a reference series");
    let row = |line: &str| {
        let cells: Vec<f64> = line.split(',').map(|cell| cell.parse().expect("a number")).collect();
        Vec3::new(cells[1], cells[2], cells[3])
    };
    text.lines().skip(1).map(row).collect()
}

/// Nodes and tetrahedra of the reference organ, a Gmsh 4.1 text file.
pub fn organ() -> TetrahedralMesh {
    let text = std::fs::read_to_string(reference("organ_a.msh")).expect("the organ");
    let section = |name: &str| {
        let begin = text.find(&format!("${name}\n")).expect("the section") + name.len() + 2;
        text[begin..].split(&format!("$End{name}")).next().expect("its end").lines()
    };
    fn numbers<T: std::str::FromStr>(line: &str) -> Vec<T> {
        line.split_whitespace().map(|word| word.parse().ok().expect("a number")).collect()
    }
    let mut mesh = TetrahedralMesh::default();
    let mut tags = std::collections::HashMap::new();
    let mut lines = section("Nodes");
    lines.next();
    while let Some(head) = lines.next() {
        let count = numbers::<usize>(head)[3];
        let block: Vec<usize> = lines.by_ref().take(count).map(|line| numbers(line)[0]).collect();
        for tag in block {
            let at = numbers::<f64>(lines.next().expect("a position"));
            tags.insert(tag, mesh.points.len() as u32);
            mesh.points.push(Vec3::new(at[0], at[1], at[2]));
        }
    }
    let mut lines = section("Elements");
    lines.next();
    while let Some(head) = lines.next() {
        let head = numbers::<usize>(head);
        for line in lines.by_ref().take(head[3]) {
            let element = numbers::<usize>(line);
            if head[2] == 4 {
                mesh.tetrahedra.push([1, 2, 3, 4].map(|n| tags[&element[n]]));
            }
        }
    }
    orient(&mut mesh);
    mesh
}

/// Turns inverted elements round.
pub fn orient(mesh: &mut TetrahedralMesh) {
    for nodes in &mut mesh.tetrahedra {
        let [a, b, c, d] = nodes.map(|node| mesh.points[node as usize]);
        if Mat3::from_columns(&[b - a, c - a, d - a]).determinant() < 0.0 {
            nodes.swap(2, 3);
        }
    }
}

/// Reproducible numbers from -1 to 1.
pub struct Noise(pub u64);

impl Noise {
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    pub fn vector(&mut self) -> Vec3 {
        Vec3::new(self.next(), self.next(), self.next())
    }
}

/// A box of `size` (m) with `cells` along each axis, six elements each; inner nodes are moved by up to `share` of a cell.
pub fn irregular_box(cells: [usize; 3], size: [f64; 3], share: f64) -> TetrahedralMesh {
    let mut noise = Noise(7);
    let id = |at: [usize; 3]| (at[0] + (cells[0] + 1) * (at[1] + (cells[1] + 1) * at[2])) as u32;
    let mut mesh = TetrahedralMesh::default();
    for k in 0..=cells[2] {
        for j in 0..=cells[1] {
            for i in 0..=cells[0] {
                let at = [i, j, k];
                let is_inner = (0..3).all(|axis| at[axis] > 0 && at[axis] < cells[axis]);
                let moved = if is_inner { noise.vector() * share } else { Vec3::zeros() };
                mesh.points
                    .push(Vec3::from_fn(|axis, _| (at[axis] as f64 + moved[axis]) * size[axis] / cells[axis] as f64));
            }
        }
    }
    for (k, j, i) in (0..cells[2]).flat_map(|k| (0..cells[1]).flat_map(move |j| (0..cells[0]).map(move |i| (k, j, i))))
    {
        // Six around the diagonal: along the axes in each order.
        for axes in [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]] {
            let mut at = [i, j, k];
            let mut nodes = [id(at); 4];
            for (n, axis) in axes.into_iter().enumerate() {
                at[axis] += 1;
                nodes[n + 1] = id(at);
            }
            mesh.tetrahedra.push(nodes);
        }
    }
    orient(&mut mesh);
    mesh
}

/// What is at z = 0.
pub fn bottom() -> Where {
    Where::Shape(Shape::Layer { axis: 2, from: -1e-9, to: 1e-9 })
}

/// A body of one tissue with its bottom held.
pub fn body(mesh: TetrahedralMesh, tissue: Tissue, is_averaged: bool) -> Tetrahedra {
    let builder = Tetrahedra::builder(mesh).tissue(tissue).nodal_pressure(is_averaged);
    builder.fix(bottom()).build().expect("a valid body")
}

/// Width of a slab (m).
pub const WIDE: f64 = 0.03;

/// A slab of tissue, `thick` (m) and held at its bottom, with irregular elements of `size` (m).
pub fn slab(thick: f64, size: f64, poisson_ratio: f64, viscosity: f64) -> Tetrahedra {
    slab_of(thick, size, poisson_ratio, viscosity, true)
}

/// The same with pressures averaged over nodes, or not.
pub fn slab_of(thick: f64, size: f64, poisson_ratio: f64, viscosity: f64, is_averaged: bool) -> Tetrahedra {
    let cells = [WIDE, WIDE, thick].map(|extent| ((extent / size) as usize).max(2));
    let tissue = Tissue { young_modulus: 5e3, poisson_ratio, density: 1060.0, viscosity };
    body(irregular_box(cells, [WIDE, WIDE, thick], 0.15), tissue, is_averaged)
}

/// A state with displacements up to `size` (m) and velocities up to `speed` (m/s).
pub fn shaken(rest: &[Vec3], size: f64, speed: f64) -> State {
    let mut noise = Noise(3);
    State {
        positions: rest.iter().map(|x| x + noise.vector() * size).collect(),
        velocities: rest.iter().map(|_| noise.vector() * speed).collect(),
    }
}

/// The body's forces.
pub fn forces(body: &mut dyn Body, state: &State) -> Vec<Vec3> {
    let mut forces = vec![Vec3::from_element(f64::NAN); state.positions.len()];
    body.forces(state, &mut forces);
    forces
}

/// The largest of some vectors.
pub fn largest(vectors: &[Vec3]) -> f64 {
    vectors.iter().map(Vec3::norm).fold(0.0, f64::max)
}

/// The stress of the law, P, in F with the rate Fdot and the pressure p.
pub fn stress(tissue: &Tissue, f: &Mat3, rate: &Mat3, p: f64) -> Mat3 {
    let mu = tissue.shear_modulus();
    let column = |n: usize| f.column(n).into_owned();
    let (a, b, c) = (column(0), column(1), column(2));
    let cofactor = Mat3::from_columns(&[b.cross(&c), c.cross(&a), a.cross(&b)]);
    let mixed = f.transpose() * rate;
    f * mu + cofactor * (p - mu) + f * (mixed + mixed.transpose()) * tissue.viscosity
}

/// The forces by a plain loop over the elements, straight from the equations.
pub fn plain_loop(body: &Tetrahedra, is_averaged: bool, state: &State) -> Vec<Vec3> {
    let mesh = body.mesh();
    let edges = |vectors: &[Vec3], nodes: &[u32; 4]| {
        let [a, b, c, d] = nodes.map(|node| vectors[node as usize]);
        Mat3::from_columns(&[b - a, c - a, d - a])
    };
    let count = mesh.points.len();
    let (mut now, mut rest) = (vec![0.0; count], vec![0.0; count]);
    for nodes in &mesh.tetrahedra {
        for &node in nodes {
            now[node as usize] += edges(&state.positions, nodes).determinant() / 6.0;
            rest[node as usize] += edges(&mesh.points, nodes).determinant() / 6.0;
        }
    }
    let mut forces = vec![Vec3::zeros(); count];
    for (element, nodes) in mesh.tetrahedra.iter().enumerate() {
        let tissue = body.tissue_of(element as u32);
        let at_rest = edges(&mesh.points, nodes);
        let inverse = at_rest.try_inverse().expect("no flat elements");
        let (f, rate) = (edges(&state.positions, nodes) * inverse, edges(&state.velocities, nodes) * inverse);
        let dilation = match is_averaged {
            true => nodes.map(|node| now[node as usize] / rest[node as usize] - 1.0).iter().sum::<f64>() / 4.0,
            false => f.determinant() - 1.0,
        };
        let p = (tissue.lame() + tissue.shear_modulus()) * dilation;
        let of_edges = stress(tissue, &f, &rate, p) * inverse.transpose() * (-at_rest.determinant() / 6.0);
        for n in 0..3 {
            forces[nodes[n + 1] as usize] += of_edges.column(n);
            forces[nodes[0] as usize] -= of_edges.column(n);
        }
    }
    forces
}
