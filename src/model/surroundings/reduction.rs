//! The computation of a basis, in parts that end in time.

use super::basis::Basis;
use super::far::Far;
use super::force_errors::Contacts;
use super::products::Columns;
use super::reduced::{Damping, Reduced};
use super::resting::{Around, RestingBody};
use super::square::Square;
use crate::body::Restriction;
use crate::error::ModelError;
use crate::linear_algebra::{
    Matrix, SparseFactor, leading_combinations, leading_left_singular_vectors, modes, product, product_t,
};

/// The real frequency that the answers are expanded at (rad/s): between rest and the fastest that a hand does.
const EXPANSION: f64 = 2.0 * std::f64::consts::PI * 30.0;
/// Moments: Z_0, Z_1 and Z_2.
pub(super) const MOMENTS: usize = 3;
/// Combinations of unit forces that are followed to higher moments.
const LEADING: usize = 110;
/// More unknowns than this take longer than a stop waits for.
const LARGE: usize = 20_000;

/// A [`Basis`] in the making. Each part costs at most what the factorisation of the surroundings costs, and to begin it a look at all of the
/// body.
#[derive(Debug)]
pub struct Reduction {
    patch: Vec<u32>,
    /// What of a large body is around the patch; all else is in its numbering then.
    around: Option<Around>,
    /// What that looks like.
    likeness: Option<u64>,
    ring: Vec<u32>,
    pub(super) states: usize,
    pub(super) far: Far,
    restriction: Restriction,
    stage: Stage,
}

#[derive(Debug)]
enum Stage {
    /// Nothing is around the window, or another that looks the same has had its basis made.
    Known(Basis),
    Factorise,
    /// So many moments are there; `last` is the right-hand side of the next.
    Moments {
        factor: Box<SparseFactor>,
        count: usize,
        last: Matrix,
        all: Matrix,
    },
    Project {
        /// Columns that span the states, the most important first.
        columns: Matrix,
    },
    Done,
}

impl Reduction {
    /// Begins the basis of the surroundings of `patch` (ids in increasing order, all of which can move), with at most so many states;
    /// `None` if that is none, or the body has no restriction. A patch around which nothing can move has a basis that is there at once,
    /// of no states.
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    pub fn new(whole: &RestingBody, patch: &[u32], states: usize) -> Option<Self> {
        Self::begin(whole, patch, states, true)
    }

    /// The same, of its own surroundings even where others like them are known, unless it `shares`.
    fn begin(whole: &RestingBody, patch: &[u32], states: usize, shares: bool) -> Option<Self> {
        let mut around = whole.around(patch);
        let (body, local) = around.as_ref().map_or((whole, patch), |around| (&around.body, &around.patch));
        let restriction = body.restriction(local)?;
        let ring: Vec<u32> = restriction.ring(local.len()).to_vec();
        if states == 0 {
            return None;
        }
        let likeness = around.as_ref().filter(|_| shares).map(|around| around.likeness(whole, states));
        let known = likeness.and_then(|likeness| whole.alike(likeness));
        let stage = match known {
            _ if ring.is_empty() => Stage::Known(Basis::of_nothing(patch)),
            Some(basis) => Stage::Known(basis.moved_to(patch)),
            None => Stage::Factorise,
        };
        if let (Stage::Factorise, Some(around)) = (&stage, &mut around) {
            around.look_beyond(whole);
        }
        let (body, local) = around.as_ref().map_or((whole, patch), |around| (&around.body, &around.patch));
        let far = Far::new(body, local, &restriction);
        Some(Self { patch: patch.to_vec(), ring, states, far, stage, restriction, likeness, around })
    }

    /// Ids of the patch nodes that the basis is for.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn patch(&self) -> &[u32] {
        &self.patch
    }

    /// Nodes that follow a coarse grid.
    pub(super) fn beyond(&self) -> usize {
        self.around.as_ref().and_then(|around| around.body.beyond()).map_or(0, |beyond| beyond.nodes)
    }

    /// True for a body so large that the parts should not be done in one go.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn is_large(&self) -> bool {
        self.far.unknowns() > LARGE
    }

    /// True where there is nothing to make: for surroundings like others whose basis was [made](Self::advance) or [learnt](Self::learn)
    /// before, and where nothing can move.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn is_known(&self) -> bool {
        matches!(self.stage, Stage::Known(_))
    }

    /// Takes `basis`, which was made of the same by another run, for surroundings of `body` that are like these: as if it had been made
    /// here.
    ///
    /// # Real-time
    /// Not real-time safe: allocates, takes a lock.
    pub fn learn(&self, body: &RestingBody, basis: &Basis) {
        self.likeness.inspect(|&likeness| body.keep_alike(likeness, basis));
    }

    /// Does the next part; returns the basis after the last one.
    ///
    /// # Errors
    /// If nothing holds the surroundings together, so that they have no finite answer.
    ///
    /// # Real-time
    /// Not real-time safe: allocates, and takes a second for a large body.
    pub fn advance(&mut self, body: &RestingBody) -> Result<Option<Basis>, ModelError> {
        let (far, ring) = (&self.far, &self.ring);
        match std::mem::replace(&mut self.stage, Stage::Done) {
            Stage::Factorise => {
                let factor = Box::new(far.factorised(EXPANSION).ok_or_else(indefinite)?);
                let all = Matrix::zeros(far.unknowns(), 0);
                self.stage = Stage::Moments { factor, count: 0, last: far.unit_forces(ring), all };
            }
            Stage::Moments { factor, count, last, mut all } => {
                let last = append_moment(far, factor.solve(last), &mut all, count);
                self.stage = match count + 1 {
                    MOMENTS => Stage::Project { columns: leading_left_singular_vectors(&all, self.states) },
                    count => Stage::Moments { factor, count, last, all },
                };
            }
            Stage::Project { columns } => {
                let answers = reduced(far, ring, &columns).ok_or_else(indefinite)?;
                let basis = Basis { patch: self.patch.clone(), answers };
                self.learn(body, &basis);
                return Ok(Some(basis));
            }
            Stage::Known(basis) => return Ok(Some(basis)),
            Stage::Done => {}
        }
        Ok(None)
    }
}

/// The surroundings `far` in the span of the columns of `shapes`. `None` if there is no motion in that span, nothing that holds it or
/// a number is not finite.
fn reduced(far: &Far, ring: &[u32], shapes: &Matrix) -> Option<Reduced> {
    if !far.is_held_together() {
        return None;
    }
    let (stiffness, damping) = far.stiffness_and_damping(shapes);
    let (modes, values) = modes(&far.mass(shapes), &stiffness).filter(|(_, values)| !values.is_empty())?;
    let states = values.len();
    let shapes = product(shapes, &modes);
    let damping = match far.proportional_damping() {
        Some(share) => Damping::Diagonal(values.iter().map(|value| share * value).collect()),
        None => {
            let damping = product_t(&modes, &product(&damping, &modes));
            Damping::Full(Square::new(states, |row, column| damping[(row, column)]))
        }
    };
    let on_ring = Columns::new(&shapes.select_rows(&far.unknowns_of(ring)));
    Some(Reduced { states, shapes: on_ring, stiffness: values, damping })
}

fn indefinite() -> ModelError {
    ModelError::new("the surroundings of a patch are not held together").at("local.patch")
}

/// Appends Z_n/|Z_n| to `all` and returns M Z_n for the `moment` Z_n. From the first on they are followed in the combinations
/// of columns that are largest in Z_0: what is small there is even smaller in the rest.
fn append_moment(far: &Far, mut moment: Matrix, all: &mut Matrix, n: usize) -> Matrix {
    let scale = 1.0 / moment.iter().map(|x| x * x).sum::<f64>().sqrt();
    if n == 0 {
        moment = leading_combinations(moment, LEADING);
    }
    append(all, &(&moment * scale));
    far.times_mass(&mut moment);
    moment
}

/// Appends the columns of `more`.
fn append(matrix: &mut Matrix, more: &Matrix) {
    let columns = matrix.ncols();
    matrix.resize_horizontally_mut(columns + more.ncols(), 0.0);
    matrix.columns_mut(columns, more.ncols()).copy_from(more);
}

impl Basis {
    /// The basis of the surroundings of `patch` (ids in increasing order), with at most so many states. `None` if that is none, or the body
    /// has no restriction.
    ///
    /// # Errors
    /// If nothing holds the surroundings together, so that they have no finite answer.
    ///
    /// # Real-time
    /// Not real-time safe: factorises a matrix of the whole body's size, seconds of work for a large one. [`Reduction`] does
    /// the same in parts.
    pub fn compute(body: &RestingBody, patch: &[u32], states: usize) -> Result<Option<Self>, ModelError> {
        let Some(mut reduction) = Reduction::new(body, patch, states) else { return Ok(None) };
        loop {
            if let Some(basis) = reduction.advance(body)? {
                return Ok(Some(basis));
            }
        }
    }
}

impl Reduction {
    /// The relative error of the linear contact force by the number of states of the surroundings of `patch` (ids in increasing order),
    /// from one on up to `most`, in one pass: against an imposed motion of a touched node at rest, root mean square over four real
    /// frequencies, the worst of the nodes in the middle of the patch. Empty if nothing around the patch can move.
    ///
    /// # Errors
    /// If nothing holds the surroundings together.
    ///
    /// # Real-time
    /// Not real-time safe: factorises the body several times.
    pub fn force_errors(body: &RestingBody, patch: &[u32], most: usize) -> Result<Vec<f64>, ModelError> {
        let reduction = Self::begin(body, patch, most, false);
        let Some(mut reduction) = reduction.filter(|reduction| !reduction.ring.is_empty()) else {
            return Ok(Vec::new());
        };
        loop {
            if let Self { stage: Stage::Project { columns }, far, restriction, around, .. } = &reduction {
                let body = around.as_ref().map_or(body, |around| &around.body);
                return Contacts::new(body, (restriction, patch.len()), far, columns).errors().ok_or_else(indefinite);
            }
            reduction.advance(body)?;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::{Block, Body};
    use crate::mesh::Face;

    #[test]
    fn of_a_large_body_only_what_is_around_a_window_is_reduced_and_windows_that_look_the_same_share_a_basis() {
        let block = Block::builder([26, 26, 16], [0.225, 0.225, 0.135]).fix(Face::ZMin).build().unwrap();
        let resting = RestingBody::new(&block).unwrap();
        let nearest = crate::mesh::NearestTriangle::new(block.surface(), block.rest()).unwrap();
        let patch = |x: f64| {
            let mut patch = Vec::new();
            block.patch(&[nearest.find(&crate::Vec3::new(x, 0.113, 0.135))], [4, 4, 2], &mut patch);
            patch
        };
        let [middle, beside, edge] = [0.113, 0.122, 0.005].map(patch);
        assert!(middle != beside);
        let first = Basis::compute(&resting, &middle, 20).unwrap().unwrap();
        let is_known = |patch: &[u32]| {
            let reduction = Reduction::new(&resting, patch, 20).unwrap();
            assert!((reduction.far.unknowns() / 3) < 3000, "{}", (reduction.far.unknowns() / 3));
            matches!(reduction.stage, Stage::Known(_))
        };
        assert!(is_known(&beside) && !is_known(&edge));
        let shared = Basis::compute(&resting, &beside, 20).unwrap().unwrap();
        assert_eq!((shared.patch(), &shared.answers), (&beside[..], &first.answers));
        // Check that it is what would have been made, but for what is beyond, which is that of the first.
        let alone = Basis::compute(&RestingBody::new(&block).unwrap(), &beside, 20).unwrap().unwrap();
        let off = |(a, b): (&f64, &f64)| (a - b).abs() / b.abs();
        let worst = alone.answers.stiffness.iter().zip(&shared.answers.stiffness).map(off).fold(0.0, f64::max);
        assert!(worst < 0.01, "{worst}");
    }

    #[test]
    fn windows_whose_neighbourhoods_look_the_same_share_no_basis_where_the_body_beyond_does_not() {
        // Held at one side face: there the layer beyond a neighbourhood is held, elsewhere it gives way.
        let block = Block::builder([40, 20, 14], [0.39, 0.19, 0.13]).fix(Face::ZMin).fix(Face::XMin).build().unwrap();
        let resting = RestingBody::new(&block).unwrap();
        let nearest = crate::mesh::NearestTriangle::new(block.surface(), block.rest()).unwrap();
        let patch = |cell: u32| {
            let (mut patch, x) = (Vec::new(), 0.01 * f64::from(cell) + 0.004);
            block.patch(&[nearest.find(&crate::Vec3::new(x, 0.093, 0.13))], [4, 4, 2], &mut patch);
            patch
        };
        let middle = patch(20);
        Basis::compute(&resting, &middle, 20).unwrap();
        let own = |cell: u32| resting.around(&patch(cell)).unwrap();
        let looks = |cell: u32| own(cell).body.inverse_masses().to_vec() == own(20).body.inverse_masses();
        let is_known = |cell: u32| Reduction::new(&resting, &patch(cell), 20).unwrap().is_known();
        let nearest_to_the_side = (4..20).find(|&cell| looks(cell)).unwrap();
        assert!(!is_known(nearest_to_the_side));
        assert!(is_known(21));
    }

    #[test]
    fn around_a_wide_window_all_of_its_ring_is_reduced() {
        let block = Block::builder([26, 26, 16], [0.225, 0.225, 0.135]).fix(Face::ZMin).build().unwrap();
        let nearest = crate::mesh::NearestTriangle::new(block.surface(), block.rest()).unwrap();
        for size in [[14, 14, 6], [18, 10, 6], [22, 22, 3]] {
            let mut patch = Vec::new();
            block.patch(&[nearest.find(&crate::Vec3::new(0.113, 0.113, 0.135))], size, &mut patch);
            let reduction = Reduction::new(&RestingBody::new(&block).unwrap(), &patch, 20).unwrap();
            let ring = block.restriction(&patch).unwrap().ring(patch.len()).len();
            assert_eq!(reduction.ring.len(), ring, "{size:?}");
            // Check that there is more than the ring
            assert!(
                (reduction.far.unknowns() / 3) > 2 * ring,
                "{size:?}: {} of {ring}",
                (reduction.far.unknowns() / 3)
            );
        }
    }

    #[test]
    fn a_patch_around_which_nothing_can_move_has_a_basis_of_no_states_at_once() {
        let block = Block::builder([3; 3], [0.02; 3]).fix(Face::ZMin).build().unwrap();
        let patch: Vec<u32> =
            (0..).zip(block.inverse_masses()).filter(|&(_, &w)| w > 0.0).map(|(node, _)| node).collect();
        let resting = RestingBody::new(&block).unwrap();
        assert!(Reduction::new(&resting, &patch, 20).unwrap().is_known());
        let basis = Basis::compute(&resting, &patch, 20).unwrap().unwrap();
        assert_eq!((basis.patch(), basis.states()), (&patch[..], 0));
        assert!(basis.answers.is_of(0) && !basis.answers.is_of(3));
        assert_eq!(Basis::from_bytes(&basis.to_bytes(1), 1), Some(basis));
        assert!(Reduction::force_errors(&resting, &patch, 20).unwrap().is_empty());
        assert!(Reduction::new(&resting, &patch, 0).is_none(), "no states are asked for");
    }

    // Check a small body whose patch is all that can move but a corner: what is left hangs on the patch alone.
    #[test]
    fn surroundings_that_only_the_patch_holds_are_refused() {
        let block = Block::builder([3; 3], [0.02; 3]).fix(Face::ZMin).build().unwrap();
        let corner = block.lattice().id([0, 0, 2]);
        let is_in_patch = |node: &u32| *node != corner && block.inverse_masses()[*node as usize] > 0.0;
        let patch: Vec<u32> = (0..block.rest().len() as u32).filter(is_in_patch).collect();
        let resting = RestingBody::new(&block).unwrap();
        let refused = Basis::compute(&resting, &patch, 20).unwrap_err().to_string();
        assert!(refused.contains("not held together"), "{refused}");
    }
}
