//! Two bent bodies on regular meshes of tetrahedra, and what quadratic elements have for them.

use palpate_model::Vec3;
use palpate_model::body::{Body, State, Tetrahedra, Tissue, Where};
use palpate_model::linear_algebra::{Matrix, SparseFactor};
use palpate_model::mesh::{Group, TetrahedralMesh};

use super::{orient, reference};

/// Young's modulus (Pa) and load (N) of the quadratic elements.
const YOUNG: f64 = 5000.0;
pub const LOAD: f64 = 1e-5;

/// A body that is clamped where s.x = 0 and loaded where s.x = 1, s its place in the unit cube.
#[derive(Clone, Copy)]
pub struct Bent {
    pub name: &'static str,
    /// Cells of the coarsest mesh.
    cells: [usize; 3],
    /// The longest side of these cells (m).
    pub side: f64,
    place: fn(Vec3) -> Vec3,
    /// Direction of the load.
    pub direction: Vec3,
}

/// 0.1 x 0.02 x 0.02 m.
pub const CANTILEVER: Bent = Bent {
    name: "cantilever",
    cells: [10, 2, 2],
    side: 0.01,
    place: |s| Vec3::new(0.1 * s.x, 0.02 * s.y, 0.02 * s.z),
    direction: Vec3::new(0.0, 0.0, 1.0),
};

/// Cook's membrane, 48 mm long, 44 and 16 mm high at its ends, 10 mm thick, sides free.
pub const COOK: Bent = Bent {
    name: "cook",
    cells: [5, 4, 1],
    side: 0.011,
    place: |s| 1e-3 * Vec3::new(48.0 * s.x, 44.0 * s.x + (44.0 - 28.0 * s.x) * s.y, 10.0 * s.z),
    direction: Vec3::new(0.0, 1.0, 0.0),
};

/// How cells become tetrahedra.
#[derive(Clone, Copy, Debug)]
pub enum Split {
    /// The body-centred lattice, of which filled surfaces are made: two centres of cells and an edge of the face between them.
    Centred,
    /// Six around one diagonal, the same in all cells: stiff, and one-sided.
    Diagonal,
}

impl Bent {
    /// The body in cells that are split into tetrahedra, with the group `clamp`.
    pub fn mesh(&self, split: Split, refinement: usize) -> TetrahedralMesh {
        let cells = self.cells.map(|count| count * refinement);
        let place = |at: [f64; 3]| (self.place)(Vec3::from_fn(|axis, _| at[axis] / cells[axis] as f64));
        let corners = all(cells.map(|count| count + 1));
        let mut points: Vec<Vec3> = corners.map(|at| place(at.map(|n| n as f64))).collect();
        let is_clamped = |&node: &u32| points[node as usize].x.abs() < 1e-12;
        let nodes = (0..points.len() as u32).filter(is_clamped).collect();
        let groups = vec![Group { name: "clamp".to_owned(), nodes, tetrahedra: vec![] }];
        let tetrahedra = match split {
            Split::Diagonal => diagonal(cells),
            Split::Centred => {
                points.extend(all(cells).map(|at| place(at.map(|n| n as f64 + 0.5))));
                centred(cells)
            }
        };
        let mut mesh = TetrahedralMesh { points, tetrahedra, groups };
        orient(&mut mesh);
        mesh
    }

    /// The load on each node, of a uniform traction on the face where s.x = 1.
    pub fn loads(&self, body: &Tetrahedra) -> Vec<Vec3> {
        let mut shares = vec![0.0; body.rest().len()];
        let end = (self.place)(Vec3::x()).x;
        for triangle in &body.surface().triangles {
            let [a, b, c] = triangle.map(|node| body.rest()[node as usize]);
            if [a, b, c].iter().all(|x| (x.x - end).abs() < 1e-9) {
                let third = (b - a).cross(&(c - a)).norm() / 6.0;
                triangle.iter().for_each(|&node| shares[node as usize] += third);
            }
        }
        let area: f64 = shares.iter().sum();
        shares.into_iter().map(|share| self.direction * (LOAD * share / area)).collect()
    }

    /// The mean deflection of the loaded face by quadratic elements (m).
    fn converged(&self, poisson_ratio: f64) -> f64 {
        let text = std::fs::read_to_string(reference("quadratic.json")).expect("the results of quadratic elements");
        let number = |case: &str, key: &str| -> Option<f64> {
            let (_, value) = case.split_once(&format!("\"{key}\": "))?;
            value.split([',', '\n']).next()?.parse().ok()
        };
        let mut cases = text.split("\"body\": ").filter(|case| case.starts_with(&format!("\"{}\"", self.name)));
        let case = cases.find(|case| number(case, "poisson_ratio") == Some(poisson_ratio)).expect("such a case");
        number(case, "deflection_m").expect("a deflection")
    }

    /// By how much the deflection is too small (%), measured with that of quadratic elements.
    pub fn error(&self, split: Split, refinement: usize, poisson_ratio: f64, is_averaged: bool) -> f64 {
        let body = clamped(self.mesh(split, refinement), poisson_ratio, is_averaged);
        let loads = self.loads(&body);
        let deflection = work(&loads, &displacements(&body, &loads)) / LOAD;
        100.0 * (1.0 - deflection / self.converged(poisson_ratio))
    }
}

/// The body of `mesh` with its group `clamp` held.
pub fn clamped(mesh: TetrahedralMesh, poisson_ratio: f64, is_averaged: bool) -> Tetrahedra {
    let tissue = Tissue { young_modulus: YOUNG, poisson_ratio, ..Tissue::LIVER };
    let builder = Tetrahedra::builder(mesh).tissue(tissue).nodal_pressure(is_averaged);
    builder.fix(Where::Group("clamp".to_owned())).build().expect("a valid body")
}

/// The work of `loads` (N) along `displacements` (m).
pub fn work(loads: &[Vec3], displacements: &[Vec3]) -> f64 {
    loads.iter().zip(displacements).map(|(load, u)| load.dot(u)).sum()
}

/// What `loads` do to the body, linearised at rest (m).
pub fn displacements(body: &Tetrahedra, loads: &[Vec3]) -> Vec<Vec3> {
    let free: Vec<u32> = (0..loads.len() as u32).filter(|&node| body.inverse_masses()[node as usize] > 0.0).collect();
    let mut place = vec![usize::MAX; loads.len()];
    free.iter().enumerate().for_each(|(p, &node)| place[node as usize] = p);
    let mut entries = Vec::new();
    body.tangent(&State::at_rest(body.rest()), &free, false, &mut |block| {
        let (row, column) = (place[block.row as usize], place[block.column as usize]);
        if column <= row {
            let all = (0..9).map(|n| (3 * row + n / 3, 3 * column + n % 3, -block.position[(n / 3, n % 3)]));
            entries.extend(all.filter(|&(row, column, _)| column <= row));
        }
    });
    let n = 3 * free.len();
    let right = Matrix::from_iterator(n, 1, free.iter().flat_map(|&node| &loads[node as usize]).copied());
    let solution = SparseFactor::new(n, &entries, None).expect("a held body is positive definite").solve(right);
    let mut displacements = vec![Vec3::zeros(); loads.len()];
    for (&node, u) in free.iter().zip(solution.as_slice().as_chunks::<3>().0) {
        displacements[node as usize] = Vec3::from(*u);
    }
    displacements
}

/// All places of a lattice, the first axis fastest.
fn all([x, y, z]: [usize; 3]) -> impl Iterator<Item = [usize; 3]> {
    (0..x * y * z).map(move |n| [n % x, n / x % y, n / (x * y)])
}

fn id(at: [usize; 3], counts: [usize; 3]) -> u32 {
    (at[0] + counts[0] * (at[1] + counts[1] * at[2])) as u32
}

/// Along the axes in each order.
fn diagonal(cells: [usize; 3]) -> Vec<[u32; 4]> {
    let orders = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
    let split = |mut at: [usize; 3], axes: [usize; 3]| {
        let first = id(at, cells.map(|count| count + 1));
        let [b, c, d] = axes.map(|axis| {
            at[axis] += 1;
            id(at, cells.map(|count| count + 1))
        });
        [first, b, c, d]
    };
    all(cells).flat_map(|at| orders.map(|axes| split(at, axes))).collect()
}

/// Four tetrahedra on each inner face of cells, two on each outer one. The centres are numbered after the corners.
pub fn centred(cells: [usize; 3]) -> Vec<[u32; 4]> {
    let corners = cells.map(|count| count + 1);
    let centre = |at| corners.iter().product::<usize>() as u32 + id(at, cells);
    let mut tetrahedra = Vec::new();
    for axis in 0..3 {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let mut faces = cells;
        faces[axis] += 1;
        for at in all(faces) {
            let rim = [[0, 0], [1, 0], [1, 1], [0, 1]].map(|[du, dv]| {
                let mut at = at;
                at[u] += du;
                at[v] += dv;
                id(at, corners)
            });
            let mut below = at;
            below[axis] = at[axis].saturating_sub(1);
            if at[axis] > 0 && at[axis] < cells[axis] {
                let ends = [centre(below), centre(at)];
                tetrahedra.extend((0..4).map(|n| [ends[0], ends[1], rim[n], rim[(n + 1) % 4]]));
            } else {
                // Diagonals alternate, so that no direction is preferred.
                let [a, b, c, d] = std::array::from_fn(|n| rim[(n + at[u] + at[v]) % 4]);
                tetrahedra.extend([[centre(below), a, b, c], [centre(below), a, c, d]]);
            }
        }
    }
    tetrahedra
}
