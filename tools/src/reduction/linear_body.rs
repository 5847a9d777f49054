//! A deformable body, linear around a state, with a port wherever a tool may touch it.

use palpate::model::ModelError;
use palpate::model::Vec3;
use palpate::model::body::{Body, State};
use palpate::model::linear_algebra::dissection;

use super::linalg::Matrix;
use super::system::{Assembly, Ports, SecondOrder};

/// The movable nodes of a body around a state, three coordinates each.
///
/// The state is taken as an equilibrium: velocities count as zero. The tangent then is symmetric, and with the negative geometric
/// stiffness of compressed springs left out it is positive definite, so that all that is made of it is stable.
#[derive(Clone, Debug)]
pub struct LinearBody {
    system: SecondOrder,
    /// The place of each node among the movable ones.
    places: Vec<Option<usize>>,
}

impl LinearBody {
    /// `body` around `state`.
    ///
    /// # Errors
    /// If the state does not fit the body, or nothing of it can move.
    pub fn new(body: &dyn Body, state: &State) -> Result<Self, ModelError> {
        let masses = body.inverse_masses();
        if state.positions.len() != masses.len() {
            let message = format!("a state of {} nodes for a body of {}", state.positions.len(), masses.len());
            return Err(ModelError::new(message));
        }
        let nodes: Vec<u32> = (0..masses.len() as u32).filter(|&node| masses[node as usize] > 0.0).collect();
        if nodes.is_empty() {
            return Err(ModelError::of("body", "none of its nodes can move"));
        }
        let mut places = vec![None; masses.len()];
        nodes.iter().enumerate().for_each(|(place, &node)| places[node as usize] = Some(place));
        let still = State::at_rest(&state.positions);
        let mut assembly = Assembly::default();
        for (place, &node) in nodes.iter().enumerate() {
            let mass = 1.0 / masses[node as usize];
            (0..3).for_each(|axis| assembly.add(3 * place + axis, 3 * place + axis, [mass, 0.0, 0.0]));
        }
        body.tangent(&still, &nodes, true, &mut |block| {
            let (Some(row), Some(column)) = (places[block.row as usize], places[block.column as usize]) else { return };
            for i in 0..3 {
                for j in 0..3 {
                    let values = [0.0, -block.velocity[(i, j)], -block.position[(i, j)]];
                    assembly.add(3 * row + i, 3 * column + j, values);
                }
            }
        });
        let n = 3 * nodes.len();
        let none = Ports::compliance(Matrix::zeros(n, 0));
        let points: Vec<Vec3> = nodes.iter().map(|&node| state.positions[node as usize]).collect();
        let joined = assembly.places().filter(|(row, column)| row % 3 == 0 && column % 3 == 0 && row != column);
        let order = dissection(&points, joined.map(|(row, column)| [row as u32 / 3, column as u32 / 3]));
        Ok(Self { system: assembly.build(n, none).eliminated_in(order), places })
    }

    /// M, C and K without ports.
    pub fn system(&self) -> &SecondOrder {
        &self.system
    }

    /// The coordinates of those of `nodes` that can move, in increasing order.
    pub fn coordinates(&self, nodes: &[u32]) -> Vec<usize> {
        let mut places: Vec<usize> = nodes.iter().filter_map(|&node| self.places[node as usize]).collect();
        places.sort_unstable();
        places.dedup();
        places.into_iter().flat_map(|place| 3 * place..3 * place + 3).collect()
    }

    /// G^T (n x 3) of a contact at a point with weights on nodes, such as the corners of a triangle: forces on the point as forces on
    /// the coordinates. Held nodes take their share.
    pub fn contact(&self, weights: &[(u32, f64)]) -> Matrix {
        let mut directions = Matrix::zeros(self.system.coordinates(), 3);
        for &(node, weight) in weights {
            if let Some(place) = self.places[node as usize] {
                (0..3).for_each(|axis| directions[(3 * place + axis, axis)] += weight);
            }
        }
        directions
    }

    /// The system with a force on a contact point as its input and the point's displacement as its output.
    ///
    /// # Errors
    /// None for weights on nodes of the body.
    pub fn compliance(&self, weights: &[(u32, f64)]) -> Result<SecondOrder, ModelError> {
        self.system.with_ports(Ports::compliance(self.contact(weights)))
    }

    /// The system with the displacements of `nodes` as inputs and the forces that move them as outputs: the reading of the paper's tables,
    /// for any set of nodes.
    ///
    /// # Errors
    /// If none of them can move.
    pub fn held(&self, nodes: &[u32]) -> Result<SecondOrder, ModelError> {
        let inputs = self.coordinates(nodes);
        if inputs.is_empty() {
            return Err(ModelError::of("node", "none of the nodes that are to be moved can move"));
        }
        let n = self.system.coordinates();
        let units = Matrix::from_fn(n, inputs.len(), |row, column| f64::from(inputs[column] == row));
        let free: Vec<usize> = (0..n).filter(|at| inputs.binary_search(at).is_err()).collect();
        let (stiffness, damping) = (self.system.times_stiffness(&units), self.system.times_damping(&units));
        let ports =
            Ports::held(stiffness.select_rows(&free), damping.select_rows(&free), stiffness.select_rows(&inputs));
        self.system.part(&free).with_ports(ports)
    }
}
