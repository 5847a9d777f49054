//! Cells that grow inside: a balanced octree over the lattice, and the tetrahedra between its leaves (Labelle and Shewchuk 2007, section 4).
//!
//! A leaf of level l is a cube of 2^l cells along each edge. All cells that the surface comes near stay single, so it cuts and warps
//! tetrahedra of the plain lattice alone, and the larger elements inside keep their angles.

use super::lattice::{Lattice, Steps, face_ring, moved};

/// The leaves that the cells are parts of.
pub(super) struct Leaves {
    cells: [usize; 3],
    /// For each level which blocks of its size are in a leaf of that size or a larger one.
    merged: Vec<Vec<bool>>,
}

impl Leaves {
    /// Up to `levels` doublings over `lattice`, where a point by its steps `is_deep`: inside and not drawn to the surface.
    pub fn new(lattice: &Lattice, levels: usize, is_deep: impl Fn(Steps) -> bool) -> Self {
        let cells = lattice.cells;
        let single = cells.iter().product();
        let mut leaves = Self { cells, merged: vec![vec![true; single]] };
        for level in 1..=levels {
            let blocks = leaves.blocks(level);
            let mut merged = vec![false; blocks.iter().product()];
            for (n, merged) in merged.iter_mut().enumerate() {
                let block = [n % blocks[0], n / blocks[0] % blocks[1], n / blocks[0] / blocks[1]];
                *merged = leaves.can_merge(level, block) && (level > 1 || all_deep(block, &is_deep));
            }
            leaves.merged.push(merged);
        }
        leaves
    }

    /// How many blocks of this level there are along each axis.
    fn blocks(&self, level: usize) -> [usize; 3] {
        self.cells.map(|n| n >> level)
    }

    fn is_merged(&self, level: usize, block: [i64; 3]) -> bool {
        let blocks = self.blocks(level);
        let inside = (0..3).all(|axis| (0..blocks[axis] as i64).contains(&block[axis]));
        let [i, j, k] = block.map(|n| n as usize);
        inside && self.merged[level][i + blocks[0] * (j + blocks[1] * k)]
    }

    /// Whether the parts of a block and all around it are one level below: then neighbours never differ by more than one.
    fn can_merge(&self, level: usize, block: [usize; 3]) -> bool {
        let part = |axis: usize, n: usize| 2 * block[axis] as i64 - 1 + n as i64;
        (0..64).all(|n| self.is_merged(level - 1, [part(0, n % 4), part(1, n / 4 % 4), part(2, n / 16)]))
    }

    /// The level of the leaf that `cell` is in.
    fn level(&self, cell: [i64; 3]) -> usize {
        (1..self.merged.len()).take_while(|&level| self.is_merged(level, cell.map(|n| n >> level))).last().unwrap_or(0)
    }

    /// Calls `visit` with each tetrahedron between the leaves at `cell`, if a leaf starts there; positively oriented, corners 0-1 and 2-3
    /// being the long edges where all four are of the plain lattice.
    pub fn tetrahedra_of(&self, cell: [usize; 3], visit: &mut impl FnMut([Steps; 4])) {
        let start = cell.map(|n| n as i64);
        let level = self.level(start);
        let (size, half) = (1_i64 << level, 1_i32 << level);
        if start.iter().any(|n| n % size != 0) {
            return;
        }
        let centre = cell.map(|n| 2 * n as i32 + half);
        for (axis, sign) in [(0, 1), (1, 1), (2, 1), (0, -1), (1, -1), (2, -1)] {
            let mut across = start;
            across[axis] += if sign > 0 { size } else { -1 };
            if !(0..self.cells[axis] as i64).contains(&across[axis]) {
                continue;
            }
            let middle = moved(centre, axis, sign * half);
            let mut ring = face_ring(middle, axis, half);
            if sign < 0 {
                ring.reverse();
            }
            let edges = (0..4).map(|n| [ring[n], ring[(n + 1) % 4]]);
            let other = self.level(across);
            if other > level {
                // Half pyramids: the square is a quarter of the larger face, cut along the diagonal from the middle of that.
                let larger = across.map(|n| 2 * (n >> other << other) as i32 + (1 << other));
                let is_middle = |corner: &Steps| (0..3).all(|n| n == axis || corner[n] == larger[n]);
                let first = ring.iter().position(is_middle).unwrap_or_default();
                let [a, b, c, d] = [0, 1, 2, 3].map(|n| ring[(first + n) % 4]);
                visit([centre, a, b, c]);
                visit([centre, a, c, d]);
            } else if other < level {
                // A quarter of a tetrahedron: to the middle of the face, and half of its edge.
                for [a, b] in edges {
                    visit([centre, middle, a, between(a, b)]);
                    visit([centre, middle, between(a, b), b]);
                }
            } else if sign > 0 {
                let next = moved(centre, axis, 2 * half);
                for [a, b] in edges {
                    // A smaller leaf at the edge has a corner in the middle of it.
                    let outward = [0, 1, 2].map(|n| i64::from((a[n] + b[n]) / 2 - middle[n]) * size / i64::from(half));
                    let beside = |from: [i64; 3]| [0, 1, 2].map(|n| from[n] + outward[n]);
                    if [start, across].into_iter().any(|from| self.is_split(level, beside(from))) {
                        visit([centre, next, a, between(a, b)]);
                        visit([centre, next, between(a, b), b]);
                    } else {
                        visit([centre, next, a, b]);
                    }
                }
            }
        }
    }

    /// Whether the block of this level at `cell` consists of smaller leaves.
    fn is_split(&self, level: usize, cell: [i64; 3]) -> bool {
        let inside = (0..3).all(|axis| (0..self.cells[axis] as i64).contains(&cell[axis]));
        level > 0 && inside && !self.is_merged(level, cell.map(|n| n >> level))
    }
}

/// Whether all points of the tetrahedra at the eight cells of a block of level 1 are deep.
fn all_deep(block: [usize; 3], is_deep: &impl Fn(Steps) -> bool) -> bool {
    // From the centres of the cells before it to those behind; not the corners that no tetrahedron shares with the block.
    let low = block.map(|n| 4 * n as i32);
    let steps = |n: i32, axis: usize| low[axis] - 1 + n;
    (0..343).all(|n| {
        let at = [steps(n % 7, 0), steps(n / 7 % 7, 1), steps(n / 49, 2)];
        let beyond = (0..3).filter(|&axis| at[axis] < low[axis] || at[axis] > low[axis] + 4).count();
        let is_point = at.iter().all(|step| step % 2 == 0) || at.iter().all(|step| step.rem_euclid(2) == 1);
        !is_point || beyond > 1 || is_deep(at)
    })
}

/// Half way between two points.
fn between(a: Steps, b: Steps) -> Steps {
    [0, 1, 2].map(|axis| (a[axis] + b[axis]) / 2)
}
