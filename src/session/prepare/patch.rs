//! The patch of `predictive` by an error budget: the cheapest whose reduced surroundings keep it.

use super::choice::extended;
use crate::log::ModelReason;
use crate::model::body::Body;
use crate::model::local::Kind;
use crate::model::mesh::Lattice;
use crate::model::surroundings::{Estimate, Reduction, RestingBody, Size};
use crate::scene::{BodySpec, Scene, patch_fits};

/// What is tried, in the order of what a tick costs.
const SIZES: [[usize; 3]; 5] = [[4, 4, 2], [4, 4, 3], [5, 5, 2], [6, 6, 2], [6, 6, 3]];

/// A patch that was chosen, and what is expected of it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct PatchChoice {
    /// Nodes along the surface, along it, into depth.
    pub(super) size: [usize; 3],
    /// Of the reduced surroundings that the error is expected with.
    states: usize,
    expected_pct: f64,
    budget_pct: f64,
    /// The node that the window is around.
    place: String,
}

impl PatchChoice {
    /// The reason for the model, with that for the patch.
    pub(crate) fn reason(&self, of_model: Option<ModelReason>) -> ModelReason {
        let Self { size: [a, b, c], states, expected_pct, budget_pct, place } = self;
        let why = format!(
            "error_pct = {budget_pct} takes patch {a} x {b} x {c} ({expected_pct:.2} % expected with {states} states at \
             {place})"
        );
        let excess = expected_pct - budget_pct;
        let missed = (excess > 0.0).then(|| {
            format!(
                "error_pct = {budget_pct} is not met by any patch, {a} x {b} x {c} with {states} states is expected to be \
                 {expected_pct:.2} % off, {excess:.2} % too much"
            )
        });
        extended(of_model, why, missed)
    }
}

/// The first patch whose expected error is within `error_pct`, with as many states as `basis` says or a budget may take; the
/// best if none is. `None` if the scene has no budget or names its patch, and for models that have no reduced surroundings.
pub(super) fn choose(scene: &Scene, body: &dyn Body, attached: &[Option<u32>]) -> Option<PatchChoice> {
    let (None, Some(budget_pct)) = (scene.local.patch, scene.local.error_pct) else { return None };
    let basis = scene.local.basis_size();
    if scene.local.model.named() != Some(Kind::Predictive) || basis == Size::States(0) {
        return None;
    }
    let resting = RestingBody::new(body)?;
    let node = attached.first().copied().flatten().or_else(|| scene.first_touched(body))?;
    let triangle = *body.surface().at_node(node).first()?;
    let block = scene.body.as_ref().and_then(BodySpec::mass_spring).map(|spec| &spec.block);
    let place = match block {
        Some(block) => format!("node {:?}", Lattice { nodes: block.nodes }.coordinates(node)),
        None => format!("node {node}"),
    };
    let fits = |size: &[usize; 3]| block.is_none_or(|block| patch_fits(*size, block));
    let (mut best, mut patch, mut last) = (None::<PatchChoice>, Vec::new(), Vec::new());
    for size in SIZES.into_iter().filter(fits) {
        body.patch(&[triangle], size, &mut patch);
        // A thin body, or one that has no depth.
        if patch == last {
            continue;
        }
        last.clone_from(&patch);
        // What cannot be reduced is told by the actor, when it is wanted.
        let Ok(errors) = Reduction::errors_by_states(&resting, &patch) else { continue };
        let (states, expected_pct) = expected(&errors, basis);
        if best.as_ref().is_none_or(|best| expected_pct < best.expected_pct) {
            best = Some(PatchChoice { size, states, expected_pct, budget_pct, place: place.clone() });
        }
        if expected_pct <= budget_pct {
            break;
        }
    }
    best
}

/// The states of a basis of that size and the error that is expected with them (%).
fn expected(errors: &[(usize, Estimate)], basis: Size) -> (usize, f64) {
    let found = match basis {
        Size::States(states) => errors.get(..states.min(errors.len())).and_then(<[_]>::last),
        Size::ErrorPct(budget) => {
            errors.iter().find(|(_, estimate)| estimate.expected_pct() <= budget).or(errors.last())
        }
    };
    // Nothing around the patch can move, so nothing is reduced.
    found.map_or((0, Estimate::FLOOR_PCT), |(states, estimate)| (*states, estimate.expected_pct()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::devices::ToolPath;
    use crate::model::body::Block;
    use crate::model::mesh::Face;

    fn block() -> Block {
        let block = Block::builder([6; 3], [0.1; 3]).node_mass(0.5e-3).stiffness(30.0).damping_ratio(0.3);
        block.fix(Face::ZMin).build().unwrap()
    }

    fn scene(error_pct: f64, basis: Option<usize>) -> Scene {
        let mut scene = Scene::of_program().with_model(Kind::Predictive);
        (scene.local.error_pct, scene.local.basis) = (Some(error_pct), basis);
        scene
    }

    #[track_caller]
    fn chosen(scene: &Scene) -> PatchChoice {
        choose(scene, &block(), &[]).expect("a patch")
    }

    #[test]
    fn the_smallest_patch_that_keeps_the_budget_is_taken() {
        // The figures are those of `Reduction::errors_by_states`: 101 states keep 0.5 % around 4 x 4 x 2.
        let loose = chosen(&scene(0.5, None));
        assert!((loose.size, loose.states) == ([4, 4, 2], 101) && loose.expected_pct <= 0.5, "{loose:?}");
        // 150 states do not keep 0.4 % there, nor around 4 x 4 x 3.
        let tight = chosen(&scene(0.4, None));
        assert!((tight.size, tight.states) == ([5, 5, 2], 104) && tight.expected_pct <= 0.4, "{tight:?}");
        let reason = tight.reason(None);
        assert_eq!(reason.why, "error_pct = 0.4 takes patch 5 x 5 x 2 (0.40 % expected with 104 states at node 201)");
        assert_eq!(reason.warning, None);
    }

    #[test]
    fn a_given_basis_is_what_the_patch_is_chosen_for() {
        let with = |states| chosen(&scene(1.0, Some(states)));
        assert_eq!((with(100).size, with(100).states), ([4, 4, 2], 100));
        assert_eq!((with(50).size, with(50).states), ([6, 6, 2], 50));
        // More than are tried for a budget: those that are tried have to keep it.
        assert_eq!((with(400).size, with(400).states), ([4, 4, 2], 150));
    }

    #[test]
    fn the_best_patch_is_taken_where_none_keeps_the_budget_and_by_how_much_is_said() {
        let missed = chosen(&scene(1.0, Some(20)));
        assert_eq!(missed.size, [6, 6, 2]);
        let reason = missed.reason(Some(ModelReason { why: "it fits".into(), warning: None }));
        assert!(reason.why.starts_with("it fits; error_pct = 1 takes patch 6 x 6 x 2 (1.22 %"), "{reason:?}");
        let warning = reason.warning.unwrap();
        assert!(warning.contains("with 20 states is expected to be 1.22 % off, 0.22 % too much"), "{warning}");
        let earlier = ModelReason { why: "it fits".into(), warning: Some("it is tight".into()) };
        assert_eq!(missed.reason(Some(earlier)).warning.as_deref(), Some("it is tight"));
    }

    #[test]
    fn numbers_win_and_other_models_have_nothing_to_size() {
        let nothing_to_choose = |scene: Scene| assert_eq!(choose(&scene, &block(), &[]), None);
        let mut named = scene(0.4, None);
        named.local.patch = Some([4, 4, 2]);
        nothing_to_choose(named);
        nothing_to_choose(scene(0.4, Some(0)));
        for kind in Kind::ALL.into_iter().filter(|kind| *kind != Kind::Predictive) {
            nothing_to_choose(scene(0.4, None).with_model(kind));
        }
        let mut unasked = scene(0.4, None);
        unasked.local.error_pct = None;
        nothing_to_choose(unasked);
    }

    #[test]
    fn the_window_is_where_the_tool_is_glued_or_comes_first() {
        let block = block();
        let at = |scene: &Scene| block.lattice().coordinates(scene.first_touched(&block).unwrap());
        let mut moved = scene(0.5, None);
        assert_eq!(at(&moved), [3, 3, 5], "one of the four in the middle of the top");
        let path = |z: f64| ToolPath::new(vec![0.0, 1.0], vec![[0.02, 0.02, 0.12], [0.081, 0.06, z]]).unwrap();
        moved.devices[0].path = Some(path(0.09));
        assert_eq!(at(&moved), [4, 3, 5], "where the path enters");
        moved.devices[0].path = Some(path(0.11));
        assert_eq!(at(&moved), [3, 3, 5], "the path stays above");
        let glued = choose(&moved, &block, &[Some(block.lattice().id([0, 3, 5]))]).unwrap();
        assert_eq!(glued.place, format!("node {}", block.lattice().id([0, 3, 5])));
    }
}
