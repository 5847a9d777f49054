//! A material law of the program's own: tissue that stiffens as it is stretched, on the elements of a mesh.
//!
//! Collagen makes organs stiffer the farther they are deformed. Demiray's law (J. Biomech. 5, 1972) says so with one more
//! number than Young's modulus and Poisson's ratio. All that palpate asks for it is `impl Body`: forces, their tangent, and what
//! of them depends on some nodes, the `restriction`; with that every local model works, `predictive` among them.
//!
//! Look for: the force of the stiffening beam beside that of the built-in law, and the error of `predictive` on it.
//!
//! `cargo run --release --example own_law`

#[path = "common/forces.rs"]
mod forces;

use forces::{Difference, forces, peak};
use palpate::model::Mat3;
use palpate::model::body::{Body, Restriction, State, TangentBlock, Tetrahedra, Tissue, Where};
use palpate::model::local::Kind;
use palpate::model::mesh::Surface;
use palpate::prelude::*;

/// W = mu/2a (exp(a (I - 3)) - 1) - mu (J - 1) + lambda/2 (J - 1)^2, I = tr F^T F: by how much it stiffens (a).
const STIFFENING: f64 = 4.0;

/// Elements of that law: nodes, inverse of the edges at rest (1/m), volume (m^3).
#[derive(Clone, Debug)]
struct Stiffening {
    rest: Vec<Vec3>,
    inverse_masses: Vec<f64>,
    surface: Surface,
    elements: Vec<([u32; 4], Mat3, f64)>,
    /// mu, lambda (Pa) and eta (Pa s).
    material: [f64; 3],
}

fn edges(at: &[Vec3], nodes: [u32; 4]) -> Mat3 {
    let [a, b, c, d] = nodes.map(|node| at[node as usize]);
    Mat3::from_columns(&[b - a, c - a, d - a])
}

impl Stiffening {
    /// The law on the mesh and with the masses of another body.
    fn on(body: &Tetrahedra, tissue: Tissue) -> Self {
        let mu = tissue.shear_modulus();
        let element = |&nodes: &[u32; 4]| {
            let edges = edges(body.rest(), nodes);
            (nodes, edges.try_inverse().expect("no element is flat"), edges.determinant() / 6.0)
        };
        Self {
            rest: body.rest().to_vec(),
            inverse_masses: body.inverse_masses().to_vec(),
            surface: body.surface().clone(),
            elements: body.mesh().tetrahedra.iter().map(element).collect(),
            material: [mu, tissue.lame() + mu, tissue.viscosity],
        }
    }

    /// The forces on the four nodes of an element (N): -V P grad N, P = dW/dF.
    fn element_forces(&self, &(nodes, inverse, volume): &([u32; 4], Mat3, f64), x: &[Vec3], v: &[Vec3]) -> [Vec3; 4] {
        let [mu, lambda, eta] = self.material;
        let (f, rate) = (edges(x, nodes) * inverse, edges(v, nodes) * inverse);
        let columns: [Vec3; 3] = std::array::from_fn(|n| f.column(n).into_owned());
        let [a, b, c] = columns;
        let cofactor = Mat3::from_columns(&[b.cross(&c), c.cross(&a), a.cross(&b)]);
        let stiffer = (STIFFENING * (f.norm_squared() - 3.0)).min(20.0).exp();
        let pressure = lambda * (f.determinant() - 1.0);
        let viscous = f * (f.tr_mul(&rate) + rate.tr_mul(&f)) * eta;
        let forces = (f * (mu * stiffer) + cofactor * (pressure - mu) + viscous) * inverse.transpose() * -volume;
        let [p, q, r]: [Vec3; 3] = std::array::from_fn(|n| forces.column(n).into_owned());
        [-(p + q + r), p, q, r]
    }
}

impl Body for Stiffening {
    fn rest(&self) -> &[Vec3] {
        &self.rest
    }

    fn inverse_masses(&self) -> &[f64] {
        &self.inverse_masses
    }

    fn surface(&self) -> &Surface {
        &self.surface
    }

    fn forces(&mut self, state: &State, forces: &mut [Vec3]) {
        forces.fill(Vec3::zeros());
        for element in &self.elements {
            let on_nodes = self.element_forces(element, &state.positions, &state.velocities);
            element.0.iter().zip(on_nodes).for_each(|(&node, force)| forces[node as usize] += force);
        }
    }

    fn node_forces(&self, state: &State, nodes: &[u32], forces: &mut [Vec3]) {
        let mut all = vec![Vec3::zeros(); self.rest.len()];
        self.clone().forces(state, &mut all);
        nodes.iter().zip(forces).for_each(|(&node, force)| *force = all[node as usize]);
    }

    /// By differences: slow, and enough for a law that is still being tried.
    fn tangent(&self, state: &State, nodes: &[u32], _clamp: bool, emit: &mut dyn FnMut(TangentBlock)) {
        const STEP: f64 = 1e-7;
        let touched = |(corners, ..): &&([u32; 4], Mat3, f64)| corners.iter().any(|node| nodes.contains(node));
        for element in self.elements.iter().filter(touched) {
            let (x, v) =
                (element.0.map(|n| state.positions[n as usize]), element.0.map(|n| state.velocities[n as usize]));
            let local = ([0, 1, 2, 3], element.1, element.2);
            for column in 0..4 {
                let mut blocks = [[Mat3::zeros(); 4]; 2];
                for axis in 0..3 {
                    let mut slope = |by_velocity: bool| {
                        let moved = |by: f64| {
                            let mut at = [x, v];
                            at[usize::from(by_velocity)][column][axis] += by;
                            self.element_forces(&local, &at[0], &at[1])
                        };
                        let (plus, minus) = (moved(STEP), moved(-STEP));
                        let of = &mut blocks[usize::from(by_velocity)];
                        (0..4).for_each(|n| of[n].set_column(axis, &((plus[n] - minus[n]) / (2.0 * STEP))));
                    };
                    slope(false);
                    slope(true);
                }
                for (n, &row) in element.0.iter().enumerate().filter(|(_, row)| nodes.contains(row)) {
                    let (position, velocity) = (blocks[0][n], blocks[1][n]);
                    emit(TangentBlock { row, column: element.0[column], position, velocity });
                }
            }
        }
    }

    fn restriction(&self, nodes: &[u32]) -> Option<Restriction> {
        let touched = |(corners, ..): &&([u32; 4], Mat3, f64)| corners.iter().any(|node| nodes.contains(node));
        let mut elements: Vec<_> = self.elements.iter().filter(touched).copied().collect();
        let order = Restriction::order(nodes, elements.iter().flat_map(|(corners, ..)| *corners), &self.inverse_masses);
        let place = |node: u32| order.iter().position(|&other| other == node).expect("it is a corner") as u32;
        elements.iter_mut().for_each(|(corners, ..)| *corners = corners.map(place));
        let of = |all: &[Vec3]| order.iter().map(|&node| all[node as usize]).collect();
        let inverse_masses = order.iter().map(|&node| self.inverse_masses[node as usize]).collect();
        let part = Self { rest: of(&self.rest), inverse_masses, surface: Surface::default(), elements, ..*self };
        Some(Restriction { nodes: order, body: Box::new(part) })
    }

    fn duplicate(&self) -> Option<Box<dyn Body>> {
        Some(Box::new(self.clone()))
    }
}

/// Down onto the beam, 6 mm in, a little along it, and up.
fn press() -> Result<ToolPath, Error> {
    let (times, x, z) = ([0.0, 0.4, 0.8, 1.0], [0.031, 0.031, 0.036, 0.036], [0.022, 0.014, 0.014, 0.022]);
    ToolPath::new(times.into(), x.into_iter().zip(z).map(|(x, z)| [x, 0.011, z]).collect())
}

fn run(body: impl Body + 'static, model: Kind) -> Result<Vec<Vec3>, Error> {
    let session = Session::builder(body).path(press()?).friction(0.3).model(model).basis(100).duration_s(1.0);
    Ok(forces(&session.virtual_time().keep_records().build()?.run()?.records))
}

fn main() -> Result<(), Error> {
    let tissue = Tissue::LIVER;
    let mesh = palpate::mesh::organs::beam([0.06, 0.02, 0.02], 0.005)?;
    let elements = mesh.tetrahedra.len();
    let builtin = Tetrahedra::builder(mesh).tissue(tissue).nodal_pressure(false).fix(Where::Group("attached".into()));
    let builtin = builtin.build()?;
    let own = Stiffening::on(&builtin, tissue);
    println!("A beam of {elements} elements, held at one end and pressed from above (virtual time).\n");

    let usual = peak(&run(builtin, Kind::Full)?);
    let full = run(own.clone(), Kind::Full)?;
    println!("largest force: {usual:.3} N by the built-in law, {:.3} N by the stiffening one", peak(&full));
    let off = Difference::of(&run(own, Kind::Predictive)?, &full, peak(&full));
    println!("`predictive` on the own law, of that force: {:.2} % rms, {:.2} % at most;", off.rms, off.max);
    println!("largest change from one tick to the next {:.2} %", off.jump);
    Ok(())
}
