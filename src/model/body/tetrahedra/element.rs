//! One linear tetrahedron: what it is at rest, its force and its tangent.

use crate::body::State;
use crate::{Mat3, Vec3};

/// A linear tetrahedron of a stable neo-Hookean material (Smith, de Goes, Kim 2018, without their barrier) with shear viscosity.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Element {
    /// Positively oriented at rest.
    pub(crate) nodes: [u32; 4],
    /// B, the inverse of the edges [x1 - x0, x2 - x0, x3 - x0] at rest (1/m); its rows are the gradients of the shape functions.
    pub(crate) inverse: Mat3,
    /// V at rest (m^3).
    pub(crate) volume: f64,
    /// mu (Pa).
    pub(crate) shear_modulus: f64,
    /// lambda (Pa): Lame's first parameter and mu.
    pub(crate) bulk: f64,
    /// eta (Pa s).
    pub(crate) viscosity: f64,
    /// By how much the longest stable step of each of its nodes is longer at rest than that of the body, at least.
    pub(crate) spare: f64,
}

/// An element in a state: its edges and their rates in columns, and the gradient of six volumes by the three edges.
#[derive(Clone, Copy, Debug)]
pub(super) struct Moved {
    pub(super) edges: Mat3,
    rates: Mat3,
    /// cof D; a third of it for each of the nodes 1, 2, 3 is the area that belongs to it, twice.
    pub(super) areas: Mat3,
}

/// How the forces on the nodes 1, 2, 3 answer to the edges to them: `position[k][l]` = df_k / dd_l.
#[derive(Clone, Copy, Debug)]
pub(super) struct EdgeTangent {
    pub(super) position: [[Mat3; 3]; 3],
    pub(super) velocity: [[Mat3; 3]; 3],
}

/// The columns of cof D = d det D / dD.
fn cofactor(d: &Mat3) -> Mat3 {
    let column = |n: usize| d.column(n).into_owned();
    let (a, b, c) = (column(0), column(1), column(2));
    Mat3::from_columns(&[b.cross(&c), c.cross(&a), a.cross(&b)])
}

/// The matrix of v x.
fn cross(v: Vec3) -> Mat3 {
    Mat3::new(0.0, -v.z, v.y, v.z, 0.0, -v.x, -v.y, v.x, 0.0)
}

impl Element {
    /// A = V B B^T (m).
    pub(crate) fn metric(&self) -> Mat3 {
        self.inverse * self.inverse.transpose() * self.volume
    }

    /// The sum of the squares of twice the areas of the faces at rest (m^4).
    pub(crate) fn faces(&self) -> f64 {
        // cof D = det D D^-T.
        (6.0 * self.volume).powi(2) * (self.inverse.norm_squared() + self.inverse.row_sum().norm_squared())
    }

    /// The gradient of the shape function of `node` at rest (1/m).
    pub(super) fn gradient(&self, node: u32) -> Vec3 {
        match self.nodes.iter().position(|&corner| corner == node) {
            Some(corner @ 1..) => self.inverse.row(corner - 1).transpose(),
            _ => -self.inverse.row_sum().transpose(),
        }
    }

    pub(super) fn moved(&self, state: &State) -> Moved {
        let edges = |vectors: &[Vec3]| {
            let [a, b, c, d] = self.nodes.map(|node| vectors[node as usize]);
            Mat3::from_columns(&[b - a, c - a, d - a])
        };
        let (edges, rates) = (edges(&state.positions), edges(&state.velocities));
        Moved { edges, rates, areas: cofactor(&edges) }
    }

    /// V (J - 1) (m^3).
    pub(super) fn growth(&self, moved: &Moved) -> f64 {
        moved.edges.column(0).dot(&moved.areas.column(0)) / 6.0 - self.volume
    }

    /// The forces on the nodes 1, 2, 3 in columns (N), under `dilation`, the J - 1 of its pressure; that on node 0 is the
    /// opposite of their sum.
    pub(super) fn forces(&self, moved: &Moved, dilation: f64) -> Mat3 {
        let metric = self.metric();
        let mixed = moved.edges.transpose() * moved.rates;
        let rate = metric * (mixed + mixed.transpose()) * metric * (self.viscosity / self.volume);
        let pressure = self.bulk * dilation - self.shear_modulus;
        -(moved.edges * (metric * self.shear_modulus + rate)) - moved.areas * (pressure / 6.0)
    }

    /// mu/J (F F^T - 1), Cauchy's stress but for a pressure (Pa); `None` where there is no volume left.
    pub(super) fn shear_stress(&self, moved: &Moved) -> Option<Mat3> {
        let gradient = moved.edges * self.inverse;
        let ratio = gradient.determinant();
        let left = gradient * gradient.transpose() - Mat3::identity();
        (ratio > 0.0).then(|| left * (self.shear_modulus / ratio))
    }

    /// The tangent of the forces under `dilation`, which stays as it is if it `is_averaged` and else is the element's own;
    /// `clamp` leaves out what is not positive semidefinite, and how viscous forces answer to positions.
    pub(super) fn tangent(&self, moved: &Moved, dilation: f64, is_averaged: bool, clamp: bool) -> EdgeTangent {
        let own_pressure = if is_averaged { 0.0 } else { self.bulk };
        let metric = self.metric();
        let pressure = self.bulk * dilation - self.shear_modulus;
        let eta = self.viscosity / self.volume;
        let (along, across) = (moved.edges * metric, moved.rates * metric);
        let mixed = moved.edges.transpose() * moved.rates;
        let rate = metric * (mixed + mixed.transpose()) * metric;
        let (stretch, drag) = (moved.edges * along.transpose(), moved.edges * across.transpose());
        let column = |matrix: &Mat3, n: usize| matrix.column(n).into_owned();
        let outer = |a: &Mat3, k: usize, b: &Mat3, l: usize| column(a, k) * column(b, l).transpose();
        let mut tangent = EdgeTangent { position: [[Mat3::zeros(); 3]; 3], velocity: [[Mat3::zeros(); 3]; 3] };
        for (k, l) in (0..9).map(|n| (n / 3, n % 3)) {
            tangent.velocity[k][l] = -(stretch * metric[(l, k)] + outer(&along, l, &along, k)) * eta;
            if clamp {
                continue;
            }
            // cof D is made of products of the two other edges.
            let turning = match (l + 3 - k) % 3 {
                1 => -cross(column(&moved.edges, (k + 2) % 3)),
                2 => cross(column(&moved.edges, (k + 1) % 3)),
                _ => Mat3::zeros(),
            };
            let swelling = outer(&moved.areas, k, &moved.areas, l) * (own_pressure / (36.0 * self.volume));
            let drag = Mat3::identity() * rate[(l, k)] + outer(&along, l, &across, k) + drag * metric[(l, k)];
            tangent.position[k][l] = -(Mat3::identity() * (self.shear_modulus * metric[(k, l)])
                + turning * (pressure / 6.0)
                + swelling
                + drag * eta);
        }
        if clamp {
            self.clamped(moved, pressure, is_averaged, &mut tangent.position);
        }
        tangent
    }

    /// The positive semidefinite part of the elastic tangent, by its closed eigensystem (Smith, de Goes, Kim 2018, section 5).
    ///
    /// Under an averaged dilation the rest of the element lets its volume go with a stiffness of -mu, even at rest, where the
    /// tangent is to stay as it is: a third of mu is lent to it for the cut, and that of the rest state taken back.
    fn clamped(&self, moved: &Moved, pressure: f64, is_averaged: bool, position: &mut [[Mat3; 3]; 3]) {
        let gradient = moved.edges * self.inverse;
        let Some((u, sigma, v)) = rotations_and_stretches(&gradient) else { return };
        let mut add = |direction: Mat3, eigenvalue: f64| {
            if eigenvalue <= 0.0 {
                return;
            }
            // On the edges: each mode of F is one of forces, by the gradients of the shape functions.
            let mode = u * direction * v.transpose() * self.inverse.transpose();
            for (k, l) in (0..9).map(|n| (n / 3, n % 3)) {
                position[k][l] -= mode.column(k) * mode.column(l).transpose() * (eigenvalue * self.volume);
            }
        };
        let mu = self.shear_modulus;
        let swelling = if is_averaged { mu / 3.0 } else { self.bulk };
        for (i, j, k) in [(0, 1, 2), (1, 2, 0), (2, 0, 1)] {
            for sign in [-1.0, 1.0] {
                let mut direction = Mat3::zeros();
                (direction[(i, j)], direction[(j, i)]) = (0.5_f64.sqrt(), sign * 0.5_f64.sqrt());
                add(direction, mu - sign * pressure * sigma[k]);
            }
        }
        let area = Vec3::new(sigma.y * sigma.z, sigma.z * sigma.x, sigma.x * sigma.y);
        let [x, y, z] = [sigma.x, sigma.y, sigma.z].map(|stretch| stretch * pressure);
        let scaling = Mat3::new(mu, z, y, z, mu, x, y, x, mu) + area * area.transpose() * swelling;
        let eigen = scaling.symmetric_eigen();
        for n in 0..3 {
            add(Mat3::from_diagonal(&eigen.eigenvectors.column(n).into_owned()), eigen.eigenvalues[n]);
        }
        if is_averaged {
            for (k, l) in (0..9).map(|n| (n / 3, n % 3)) {
                let lent = moved.areas.column(k) * moved.areas.column(l).transpose();
                position[k][l] += lent * (swelling / (36.0 * self.volume));
            }
        }
    }
}

/// F = U diag(sigma) V^T; `None` if it has a number that is not finite.
fn rotations_and_stretches(gradient: &Mat3) -> Option<(Mat3, Vec3, Mat3)> {
    if !gradient.iter().all(|x| x.is_finite()) {
        return None;
    }
    let svd = gradient.svd(true, true);
    let (mut u, mut sigma, v) = (svd.u?, svd.singular_values, svd.v_t?.transpose());
    // The determinant's sign is in the stretches, as cof F wants it.
    if u.determinant() * v.determinant() < 0.0 {
        sigma.z = -sigma.z;
        let last = -u.column(2);
        u.set_column(2, &last);
    }
    Some((u, sigma, v))
}
