//! The regular lattice of a block: numbering, neighbours and faces.

/// A face of the block.
///
/// ```
/// use palpate_model::mesh::Face;
///
/// assert_eq!((Face::ZMax.name(), Face::ZMax.axis(), Face::ZMax.is_max()), ("z_max", 2, true));
/// ```
///
/// # Real-time
/// A plain value: its methods are wait-free and real-time safe.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Deserialize, serde::Serialize), serde(rename_all = "snake_case"))]
pub enum Face {
    /// The face at x = 0.
    XMin,
    /// The face at x = the block's length.
    XMax,
    /// The face at y = 0.
    YMin,
    /// The face at y = the block's length.
    YMax,
    /// The face at z = 0: the bottom.
    ZMin,
    /// The face at z = the block's height: the top.
    ZMax,
}

impl Face {
    /// All six faces, in the order x, y, z.
    pub const ALL: [Self; 6] = [Self::XMin, Self::XMax, Self::YMin, Self::YMax, Self::ZMin, Self::ZMax];

    /// The face's name in scene files.
    pub fn name(self) -> &'static str {
        ["x_min", "x_max", "y_min", "y_max", "z_min", "z_max"][self as usize]
    }

    /// The axis across the face: 0, 1 or 2 for x, y or z.
    pub fn axis(self) -> usize {
        self as usize / 2
    }

    /// True if the face is at the far end of its axis.
    pub fn is_max(self) -> bool {
        self as usize % 2 == 1
    }

    /// True if `node` of a lattice of `nodes` per axis lies on the face.
    pub fn holds(self, node: [usize; 3], nodes: [usize; 3]) -> bool {
        node[self.axis()] == if self.is_max() { nodes[self.axis()] - 1 } else { 0 }
    }
}

/// A block of nx x ny x nz nodes; node id = i + nx (j + ny k).
///
/// # Real-time
/// Wait-free and real-time safe, but for the lists of triangles and nodes, which allocate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Lattice {
    /// Nodes per axis.
    pub nodes: [usize; 3],
}

impl Lattice {
    /// The 13 neighbour offsets that lead to higher node ids; with their opposites they are all 26.
    pub const FORWARD: [[isize; 3]; 13] = [
        [1, 0, 0],
        [-1, 1, 0],
        [0, 1, 0],
        [1, 1, 0],
        [-1, -1, 1],
        [0, -1, 1],
        [1, -1, 1],
        [-1, 0, 1],
        [0, 0, 1],
        [1, 0, 1],
        [-1, 1, 1],
        [0, 1, 1],
        [1, 1, 1],
    ];

    /// Number of nodes.
    pub fn len(&self) -> usize {
        self.nodes.iter().product()
    }

    /// True for a lattice without nodes.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The id of the node at `[i, j, k]`.
    pub fn id(&self, [i, j, k]: [usize; 3]) -> u32 {
        (i + self.nodes[0] * (j + self.nodes[1] * k)) as u32
    }

    /// The place of node `id` in the lattice, `[i, j, k]`: the inverse of [`id`](Self::id).
    pub fn coordinates(&self, id: u32) -> [usize; 3] {
        let [nx, ny, _] = self.nodes;
        let id = id as usize;
        [id % nx, id / nx % ny, id / (nx * ny)]
    }

    /// The node `offset` away from `at`, if it is inside.
    pub fn neighbour(&self, at: [usize; 3], offset: [isize; 3]) -> Option<[usize; 3]> {
        let mut to = [0; 3];
        for axis in 0..3 {
            to[axis] = at[axis].checked_add_signed(offset[axis]).filter(|&c| c < self.nodes[axis])?;
        }
        Some(to)
    }

    /// Surface triangles of all six faces, counter-clockwise seen from outside; each quad is split along
    /// (a, b)-(a+1, b+1), with a, b the two in-face axes in x < y < z order.
    pub fn surface_triangles(&self) -> Vec<[u32; 3]> {
        let mut triangles = Vec::new();
        for face in Face::ALL {
            let axis = face.axis();
            let [a, b] = match axis {
                0 => [1, 2],
                1 => [0, 2],
                _ => [0, 1],
            };
            let node = |u: usize, v: usize| {
                let mut at = [0; 3];
                at[axis] = if face.is_max() { self.nodes[axis] - 1 } else { 0 };
                at[a] = u;
                at[b] = v;
                self.id(at)
            };
            // (a, b, axis) is right-handed for x and z, left-handed for y.
            let outward = (axis != 1) == face.is_max();
            for u in 0..self.nodes[a] - 1 {
                for v in 0..self.nodes[b] - 1 {
                    let corners = [node(u, v), node(u + 1, v), node(u + 1, v + 1), node(u, v + 1)];
                    for [p, q, r] in [[0, 1, 2], [0, 2, 3]] {
                        let [p, q, r] = [corners[p], corners[q], corners[r]];
                        triangles.push(if outward { [p, q, r] } else { [p, r, q] });
                    }
                }
            }
        }
        triangles
    }

    /// The nodes around the cells that surface triangles with `corners` belong to, in increasing order, appended to `out`.
    ///
    /// On each face the cells' bounding box grows to `size` = (along, along, depth) nodes for a single cell, and by as much
    /// for several; it is clamped at the edges.
    pub fn window(&self, corners: impl Iterator<Item = [u32; 3]>, size: [usize; 3], out: &mut Vec<u32>) {
        let mut faces = [None::<[(usize, usize); 3]>; 6];
        for triangle in corners {
            let nodes = triangle.map(|node| self.coordinates(node));
            let cell: [(usize, usize); 3] = std::array::from_fn(|axis| {
                let along = nodes.map(|node| node[axis]);
                (along[0].min(along[1]).min(along[2]), along[0].max(along[1]).max(along[2]))
            });
            let across = (0..3).find(|&axis| cell[axis].0 == cell[axis].1).unwrap_or(2);
            let face = &mut faces[2 * across + usize::from(cell[across].0 > 0)];
            *face = Some(match face {
                None => cell,
                Some(box_) => {
                    std::array::from_fn(|axis| (box_[axis].0.min(cell[axis].0), box_[axis].1.max(cell[axis].1)))
                }
            });
        }
        let first = out.len();
        for (face, cells) in faces.iter().enumerate() {
            let Some(cells) = cells else { continue };
            let mut along = size[..2].iter();
            let range: [(usize, usize); 3] = std::array::from_fn(|axis| {
                let n = self.nodes[axis];
                if axis == face / 2 {
                    let depth = size[2].min(n);
                    return if cells[axis].0 > 0 { (n - depth, n) } else { (0, depth) };
                }
                let margin = along.next().map_or(2, |&width| width.max(2)) - 2;
                let (low, high) = cells[axis];
                let width = (high - low + 1 + margin).min(n);
                let start = low.saturating_sub(margin / 2).min(n - width);
                (start, start + width)
            });
            for k in range[2].0..range[2].1 {
                for j in range[1].0..range[1].1 {
                    out.extend((range[0].0..range[0].1).map(|i| self.id([i, j, k])));
                }
            }
        }
        out[first..].sort_unstable();
        out.dedup();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forward_offsets_lead_to_higher_ids_and_make_26_with_their_opposites() {
        let lattice = Lattice { nodes: [5, 4, 3] };
        let centre = [2, 2, 1];
        let mut seen = std::collections::HashSet::new();
        for offset in Lattice::FORWARD {
            let to = lattice.neighbour(centre, offset).unwrap();
            assert!(lattice.id(to) > lattice.id(centre));
            seen.insert(offset);
            seen.insert(offset.map(|c| -c));
        }
        assert_eq!(seen.len(), 26);
    }

    #[test]
    fn a_window_is_centred_on_the_cell_and_clamped_at_the_edge() {
        let lattice = Lattice { nodes: [12, 12, 12] };
        let cell = |i, j| [lattice.id([i, j, 11]), lattice.id([i + 1, j, 11]), lattice.id([i + 1, j + 1, 11])];
        let mut window = Vec::new();
        lattice.window([cell(5, 5)].into_iter(), [4, 4, 2], &mut window);
        assert_eq!(window.len(), 32);
        assert_eq!(lattice.coordinates(window[0]), [4, 4, 10]);
        assert_eq!(lattice.coordinates(window[31]), [7, 7, 11]);
        window.clear();
        lattice.window([cell(0, 10)].into_iter(), [4, 4, 2], &mut window);
        assert_eq!(lattice.coordinates(window[0]), [0, 8, 10]);
    }
    #[test]
    fn a_window_over_several_cells_covers_them_all_and_reaches_round_an_edge() {
        let lattice = Lattice { nodes: [12, 12, 12] };
        let top = |i, j| [lattice.id([i, j, 11]), lattice.id([i + 1, j, 11]), lattice.id([i + 1, j + 1, 11])];
        let side = |j, k| [lattice.id([11, j, k]), lattice.id([11, j + 1, k]), lattice.id([11, j + 1, k + 1])];
        let mut window = Vec::new();
        lattice.window([top(3, 5), top(6, 5)].into_iter(), [4, 4, 2], &mut window);
        assert_eq!(window.len(), 7 * 4 * 2);
        window.clear();
        lattice.window([top(10, 5), side(5, 9)].into_iter(), [4, 4, 2], &mut window);
        assert!(window.windows(2).all(|pair| pair[0] < pair[1]), "each node once");
        for node in top(10, 5).into_iter().chain(side(5, 9)) {
            assert!(window.contains(&node));
        }
    }
}
