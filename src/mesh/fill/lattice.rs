//! The body-centred cubic lattice: corners and centres of cubic cells.

use palpate_model::Vec3;

use crate::MeshError;

/// More cells than this are refused: 40 million points are what a workstation carries without a thought.
const MOST_CELLS: f64 = 20e6;

/// A lattice of nx x ny x nz cubic cells. A point has *steps*: its position in half cells, all even for a corner of cells and all
/// odd for the centre of one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Lattice {
    pub cells: [usize; 3],
    /// The edge of a cell: the long edge of a tetrahedron (m).
    pub cell_m: f64,
    origin: Vec3,
}

/// A point of the lattice by its steps.
pub(super) type Steps = [i32; 3];

/// The way to each neighbour that is not named from the other side: the long edges, then the short ones.
pub(super) const FORWARD: [Steps; 7] =
    [[2, 0, 0], [0, 2, 0], [0, 0, 2], [1, 1, 1], [-1, 1, 1], [1, -1, 1], [-1, -1, 1]];

impl Lattice {
    /// Around `bounds`, with two cells to spare on every side, and a multiple of `block` cells along each axis.
    pub fn around(bounds: [Vec3; 2], cell_m: f64, block: usize) -> Result<Self, MeshError> {
        let extent = bounds[1] - bounds[0];
        if !(bounds[0].iter().chain(&bounds[1]).all(|x| x.is_finite()) && extent.iter().all(|&x| x > 0.0)) {
            return Err(MeshError::new("the surface to be filled is empty, flat or not finite: nothing is inside it"));
        }
        let wanted = extent.map(|x| (x / cell_m).ceil() + 4.0);
        if wanted.product() > MOST_CELLS {
            let fits = (extent.product() / (0.8 * MOST_CELLS)).cbrt().max(extent.max() / 1e6);
            let message = format!(
                "an element size of {cell_m} m takes a lattice of {:.1e} cells, above {MOST_CELLS:.0e}: {fits:.2e} m fits",
                wanted.product()
            );
            return Err(MeshError::new(message));
        }
        // Cells that are added for the blocks are behind the others: the elements at the surface do not depend on those inside.
        let cells = wanted.map(|cells| (cells as usize).next_multiple_of(block)).into();
        Ok(Self { cells, cell_m, origin: (bounds[0] + bounds[1] - wanted * cell_m) / 2.0 })
    }

    /// How many corners there are: their ids come first.
    fn corners(&self) -> usize {
        self.cells.iter().map(|n| n + 1).product()
    }

    /// How many points there are.
    pub fn len(&self) -> usize {
        self.corners() + self.cells.iter().product::<usize>()
    }

    /// The id of the point at `steps`, if it is of the lattice.
    pub fn id(&self, steps: Steps) -> Option<u32> {
        let inside = (0..3).all(|axis| steps[axis] >= 0 && steps[axis] as usize <= 2 * self.cells[axis]);
        inside.then(|| self.id_inside(steps))
    }

    /// The id of the point at `steps`, which is of the lattice.
    pub fn id_inside(&self, steps: Steps) -> u32 {
        let [i, j, k] = steps.map(|step| step as usize / 2);
        let [nx, ny, _] = self.cells;
        match steps[0] % 2 {
            0 => (i + (nx + 1) * (j + (ny + 1) * k)) as u32,
            _ => (self.corners() + i + nx * (j + ny * k)) as u32,
        }
    }

    /// The steps of the point `id`.
    pub fn steps(&self, id: u32) -> Steps {
        let (id, corners) = (id as usize, self.corners());
        let (at, [nx, ny, _], odd) = match id < corners {
            true => (id, self.cells.map(|n| n + 1), 0),
            false => (id - corners, self.cells, 1),
        };
        [at % nx, at / nx % ny, at / nx / ny].map(|x| 2 * x as i32 + odd)
    }

    /// The position of the point at `steps` (m).
    pub fn position(&self, steps: Steps) -> Vec3 {
        self.origin + Vec3::from(steps.map(f64::from)) * (self.cell_m / 2.0)
    }

    /// The steps of the corners that enclose `bounds`, cut to the lattice.
    pub fn enclosing(&self, bounds: [Vec3; 2]) -> [[i32; 3]; 2] {
        let steps = |x: f64, axis: usize| 2 * (x.max(0.0) as i32).min(self.cells[axis] as i32);
        let [low, high] = bounds.map(|x| (x - self.origin) / self.cell_m);
        [[0, 1, 2].map(|axis| steps(low[axis].floor(), axis)), [0, 1, 2].map(|axis| steps(high[axis].ceil(), axis))]
    }
}

/// `steps` moved by `by` along `axis`.
pub(super) fn moved(mut steps: Steps, axis: usize, by: i32) -> Steps {
    steps[axis] += by;
    steps
}

/// The corners of a square face of half edge `half` around its middle, counter-clockwise seen from the far end of `axis`.
pub(super) fn face_ring(middle: Steps, axis: usize, half: i32) -> [Steps; 4] {
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    [[-1, -1], [1, -1], [1, 1], [-1, 1]].map(|[a, b]| moved(moved(middle, u, a * half), v, b * half))
}
