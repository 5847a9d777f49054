//! What the stencils leave where the surface is finer than the elements: edges and nodes that merely touch, and loose crumbs.

use std::collections::{HashMap, HashSet};

use palpate_model::Vec3;
use palpate_model::mesh::TetrahedralMesh;

/// Parts of no more elements are crumbs: those around a single point of the lattice.
const CRUMB: usize = 24;

/// The mesh without crumbs, and without edges or nodes at which elements touch and share no face: of the elements at such an edge the
/// largest fan stays, and each part at such a node gets a node of its own.
pub(super) fn repaired(mesh: TetrahedralMesh) -> TetrahedralMesh {
    let TetrahedralMesh { points, mut tetrahedra, .. } = mesh;
    loop {
        let faces = Faces::of(&tetrahedra);
        let touching = touching_edges(&faces.outer);
        let dropped = match touching.is_empty() {
            true => crumbs(tetrahedra.len(), &faces.inner),
            false => small_fans(&tetrahedra, &touching),
        };
        if dropped.is_empty() {
            return with_nodes_split(points, tetrahedra, &faces.inner);
        }
        let mut element = 0..;
        tetrahedra.retain(|_| !element.next().is_some_and(|n: usize| dropped.contains(&n)));
    }
}

/// The faces of a mesh.
struct Faces {
    /// Two elements and the nodes of the face between them.
    inner: Vec<(usize, usize, [u32; 3])>,
    /// Faces of one element only, their nodes in increasing order.
    outer: Vec<[u32; 3]>,
}

impl Faces {
    fn of(tetrahedra: &[[u32; 4]]) -> Self {
        let mut all: Vec<([u32; 3], u32)> = Vec::with_capacity(4 * tetrahedra.len());
        for (element, nodes) in tetrahedra.iter().enumerate() {
            for without in 0..4 {
                let mut face = [1, 2, 3].map(|n| nodes[(without + n) % 4]);
                face.sort_unstable();
                all.push((face, element as u32));
            }
        }
        all.sort_unstable();
        let mut faces = Self { inner: Vec::new(), outer: Vec::new() };
        for same in all.chunk_by(|one, other| one.0 == other.0) {
            match same {
                [(face, _)] => faces.outer.push(*face),
                [(face, one), (_, other), ..] => faces.inner.push((*one as usize, *other as usize, *face)),
                [] => {}
            }
        }
        faces
    }
}

/// Edges of more than two outer faces.
fn touching_edges(outer: &[[u32; 3]]) -> HashSet<[u32; 2]> {
    let mut edges: Vec<[u32; 2]> = outer.iter().flat_map(|&[a, b, c]| [[a, b], [a, c], [b, c]]).collect();
    edges.sort_unstable();
    edges.chunk_by(|one, other| one == other).filter(|same| same.len() > 2).map(|same| same[0]).collect()
}

/// The elements at each of `edges` but for the largest group that hangs together by faces there.
fn small_fans(tetrahedra: &[[u32; 4]], edges: &HashSet<[u32; 2]>) -> HashSet<usize> {
    let mut at: HashMap<[u32; 2], Vec<usize>> = HashMap::new();
    for (element, nodes) in tetrahedra.iter().enumerate() {
        for (a, b) in [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)] {
            let edge = [nodes[a].min(nodes[b]), nodes[a].max(nodes[b])];
            if edges.contains(&edge) {
                at.entry(edge).or_default().push(element);
            }
        }
    }
    let mut dropped = HashSet::new();
    for elements in at.into_values() {
        let mut groups = Groups::new(elements.len());
        for (n, &one) in elements.iter().enumerate() {
            for (m, &other) in elements.iter().enumerate().take(n) {
                let shared = tetrahedra[one].iter().filter(|node| tetrahedra[other].contains(node)).count();
                if shared == 3 {
                    groups.join(n, m);
                }
            }
        }
        let sizes = groups.sizes();
        // The largest; of equals the one with the first element.
        let kept = (0..elements.len()).max_by_key(|&n| (sizes[groups.of(n)], elements.len() - n));
        let kept = kept.map(|n| groups.of(n));
        dropped.extend((0..elements.len()).filter(|&n| Some(groups.of(n)) != kept).map(|n| elements[n]));
    }
    dropped
}

/// The elements of parts of no more than [`CRUMB`], unless no part is larger.
fn crumbs(count: usize, inner: &[(usize, usize, [u32; 3])]) -> HashSet<usize> {
    let mut groups = Groups::new(count);
    inner.iter().for_each(|&(one, other, _)| groups.join(one, other));
    let sizes = groups.sizes();
    let largest = sizes.iter().copied().max().unwrap_or_default();
    (0..count).filter(|&n| sizes[groups.of(n)] <= CRUMB.min(largest.saturating_sub(1))).collect()
}

/// The mesh of these elements, nodes that parts without a common face share being one for each.
fn with_nodes_split(
    points: Vec<Vec3>,
    mut tetrahedra: Vec<[u32; 4]>,
    inner: &[(usize, usize, [u32; 3])],
) -> TetrahedralMesh {
    let mut corners = Groups::new(4 * tetrahedra.len());
    let corner = |element: usize, node: u32| {
        4 * element + tetrahedra[element].iter().position(|&other| other == node).unwrap_or_default()
    };
    for &(one, other, face) in inner {
        face.iter().for_each(|&node| corners.join(corner(one, node), corner(other, node)));
    }
    // Also leaves out the points that no element uses.
    let mut number = HashMap::new();
    let mut used = Vec::with_capacity(points.len());
    for (element, nodes) in tetrahedra.iter_mut().enumerate() {
        for (n, node) in nodes.iter_mut().enumerate() {
            *node = *number.entry(corners.of(4 * element + n)).or_insert_with(|| {
                used.push(points[*node as usize]);
                used.len() as u32 - 1
            });
        }
    }
    TetrahedralMesh { points: used, tetrahedra, groups: Vec::new() }
}

/// Groups that are joined one by one.
struct Groups(Vec<usize>);

impl Groups {
    fn new(count: usize) -> Self {
        Self((0..count).collect())
    }

    /// The group that `member` is in.
    fn of(&mut self, mut member: usize) -> usize {
        while self.0[member] != member {
            self.0[member] = self.0[self.0[member]];
            member = self.0[member];
        }
        member
    }

    fn join(&mut self, one: usize, other: usize) {
        let (one, other) = (self.of(one), self.of(other));
        self.0[one.max(other)] = one.min(other);
    }

    /// How many are in each group.
    fn sizes(&mut self) -> Vec<usize> {
        let mut sizes = vec![0; self.0.len()];
        for member in 0..self.0.len() {
            let group = self.of(member);
            sizes[group] += 1;
        }
        sizes
    }
}
