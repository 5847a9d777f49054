//! The one validation that builder and scene files pass through.

mod check;
mod counts;
mod devices;
mod friction;
mod link;
mod safety;
mod tissue;

pub(crate) use devices::MAX_DEVICES;
pub(super) use devices::tool;
pub(super) use tissue::mesh;

use super::device::numbered;
use super::patch::{free_faces, patch_fits};
use super::{
    BlockSpec, BodySpec, GlobalSpec, InitialSpec, LocalSpec, MassSpringSpec, ModelChoice, NodeSpec, Scene, StepKind,
};
use crate::error::Error;
use crate::model::ModelError;
use crate::model::body::Block;
use crate::model::contact::Equations;
use crate::model::local::BlendKind;
use crate::model::local::{Feedback, Kind};
use crate::model::mesh::Face;
use crate::runtime::Rate;
use check::{at_most_ms, inside, lengths_within, movable, not_negative, on_surface, positive};

/// Longest edge or offset (m); a larger number has the wrong unit.
const MAX_LENGTH_M: f64 = 1e3;
/// The contact takes a smaller triangle (twice its area) for none.
const MIN_TRIANGLE_M2: f64 = 1e-14;
/// Steps of 0.1 us: whatever needs more is no deformable body.
const MAX_SUBSTEPS_PER_MS: u32 = 10_000;
/// More than any machine of one memory.
const MAX_CORES: usize = 1024;
/// A dense tangent of 38 MB, far above what a haptic tick can multiply with.
const MAX_PATCH_NODES: usize = 512;
/// The corners of an element.
const LEAST_PATCH_NODES: usize = 4;
/// Far above what the ring of a patch can answer with.
const MAX_BASIS: usize = 500;
/// Longer than any global model is worth waiting for (ms).
const MAX_LATENCY_MS: f64 = 60_000.0;
/// Eleven days.
const MAX_DURATION_S: f64 = 1e6;

impl Scene {
    /// Refuses what cannot work, naming the field and what would be right.
    ///
    /// # Errors
    /// [`ErrorKind::Scene`](crate::ErrorKind::Scene), with the field's dotted path as its place.
    pub fn validate(&self) -> Result<(), Error> {
        validate(self)
    }
}

fn validate(scene: &Scene) -> Result<(), Error> {
    scene.check_counts()?;
    match &scene.body {
        Some(BodySpec::MassSpring(spec)) => body(spec)?,
        Some(BodySpec::Tetrahedra(spec)) => tissue::validate(spec)?,
        None => {}
    }
    friction::validate(&scene.contact)?;
    global(&scene.global)?;
    local(&scene.local, &scene.global)?;
    link::validate(scene)?;
    if scene.local.step == StepKind::Implicit && scene.contact.equations == Equations::Paper {
        let message =
            "\"implicit\" has the corrected contact equations only, leave it out or use equations = \"corrected\"";
        return Err(Error::scene("local.step", message));
    }
    devices::validate(&scene.devices, scene.contact.equations)?;
    safety::validate(&scene.safety)?;
    if let Some(spec) = &scene.initial {
        lengths_within("initial.pull.offset_m", spec.pull.offset_m, MAX_LENGTH_M)?;
    }
    match &scene.body {
        Some(BodySpec::MassSpring(spec)) => on_block(scene, &spec.block)?,
        Some(BodySpec::Tetrahedra(_)) => {
            on_no_lattice(
                scene,
                "is a place in a block, and the body is of tetrahedra: give the node's number or { near_m = [x, y, z] }",
            )?;
            any_patch(scene)?;
        }
        None => {
            on_no_lattice(scene, "names nodes of a block, and the body is the program's own")?;
            scene.local.patch.map_or(Ok(()), patch_of_program)?;
        }
    }
    duration(scene.run.duration_s, scene.local.rate_hz)
}

/// What names nodes of the block, or has to fit into it.
fn on_block(scene: &Scene, block: &BlockSpec) -> Result<(), Error> {
    // A body that is too small even for the least patch is fine for the models that have none.
    if scene.local.model.named().is_some_and(Kind::has_patch) || scene.local.patch.is_some() {
        patch(scene.patch_size(), block)?;
    }
    for (index, device) in scene.devices.iter().enumerate() {
        if let Some(NodeSpec::Lattice(node)) = device.attach_node {
            attached(node, block).map_err(|error| numbered(error, index, &scene.devices))?;
        }
    }
    if let Some(spec) = &scene.initial {
        initial(spec, block)?;
    }
    for (index, probe) in scene.probes.iter().enumerate() {
        if let NodeSpec::Lattice(node) = probe.node {
            inside(&format!("probe[{index}].node"), node, block)?;
        }
    }
    Ok(())
}

/// A body that is no block has no places in a lattice; `why` says what it has.
fn on_no_lattice(scene: &Scene, why: &str) -> Result<(), Error> {
    let is_place = |node: &NodeSpec| matches!(node, NodeSpec::Lattice(_));
    if let Some(index) = scene.devices.iter().position(|device| device.attach_node.as_ref().is_some_and(is_place)) {
        return Err(numbered(Error::scene("device.attach_node", why), index, &scene.devices));
    }
    let initial = scene.initial.as_ref();
    let of_initial = || initial.is_some_and(|initial| initial.hold.iter().chain([&initial.pull.node]).any(is_place));
    let of_probes = || scene.probes.iter().any(|probe| is_place(&probe.node));
    match () {
        () if of_initial() => Err(Error::scene("initial", why)),
        () if of_probes() => Err(Error::scene("probe", why)),
        () => Ok(()),
    }
}

/// Of a body without a lattice a patch has as many nodes as the product says.
fn any_patch(scene: &Scene) -> Result<(), Error> {
    let patch = scene.patch_size();
    if (LEAST_PATCH_NODES..=MAX_PATCH_NODES).contains(&nodes_of(patch)) {
        return Ok(());
    }
    let message = format!(
        "is {patch:?}, must be {LEAST_PATCH_NODES} to {MAX_PATCH_NODES} nodes in all: as many as that, the nearest to the tool, \
         are the patch of a body of tetrahedra"
    );
    Err(Error::scene("local.patch", message))
}

/// Of a program's own body nobody knows here how large a patch it has room for.
fn patch_of_program(patch: [usize; 3]) -> Result<(), Error> {
    if patch.iter().all(|&along| along >= 2) && nodes_of(patch) <= MAX_PATCH_NODES {
        return Ok(());
    }
    let message = format!("is {patch:?}, must be at least [2, 2, 2] and at most {MAX_PATCH_NODES} nodes in all");
    Err(Error::scene("local.patch", message))
}

/// How many nodes a patch has, or more than any may have.
fn nodes_of(patch: [usize; 3]) -> usize {
    patch.iter().fold(1, |nodes, &along| along.saturating_mul(nodes))
}

fn body(body: &MassSpringSpec) -> Result<(), Error> {
    lattice(&body.block)?;
    let material = &body.material;
    positive("body.material.node_mass_kg", material.node_mass_kg)?;
    positive("body.material.stiffness_n_per_m", material.stiffness_n_per_m)?;
    not_negative("body.material.damping_ratio", material.damping_ratio)?;
    let (m, k) = (material.node_mass_kg, material.stiffness_n_per_m);
    let damping_n_s_per_m = material.damping_ratio * (2.0 * m * k).sqrt();
    if !((k / m).is_finite() && damping_n_s_per_m.is_finite() && (damping_n_s_per_m / m).is_finite()) {
        let message = "stiffness or damping over mass is beyond all numbers, check the units (kg, N/m)";
        return Err(Error::scene("body.material", message));
    }
    // Regions that cannot be, or are nowhere.
    let refuse = |error: ModelError| Error::scene(&format!("body.{}", error.place()), error.message());
    body.builder().check_regions().map_err(refuse)
}

fn lattice(block: &BlockSpec) -> Result<(), Error> {
    let (nodes, size_m) = (block.nodes, block.size_m);
    if nodes.iter().any(|&count| count < 2) {
        return Err(Error::scene("body.block.nodes", format!("is {nodes:?}, must be at least 2 along every axis")));
    }
    let total = nodes.iter().try_fold(1_usize, |total, &count| total.checked_mul(count));
    if total.is_none_or(|total| total > Block::MAX_NODES) {
        let message = format!("is {nodes:?}, must be at most {} nodes in all", Block::MAX_NODES);
        return Err(Error::scene("body.block.nodes", message));
    }
    lengths_within("body.block.size_m", size_m, MAX_LENGTH_M)?;
    if let Some(edge_m) = size_m.iter().find(|&&edge_m| edge_m <= 0.0) {
        let message = format!("is {size_m:?}, every edge must be above 0 m and one is {edge_m}");
        return Err(Error::scene("body.block.size_m", message));
    }
    let spacing_m: [f64; 3] = std::array::from_fn(|axis| size_m[axis] / (nodes[axis] - 1) as f64);
    for [a, b] in [[0, 1], [0, 2], [1, 2]] {
        if spacing_m[a] * spacing_m[b] < MIN_TRIANGLE_M2 {
            let message = format!(
                "puts nodes {} m and {} m apart, which is too small for contact, make the body larger or its nodes fewer",
                spacing_m[a], spacing_m[b]
            );
            return Err(Error::scene("body.block.size_m", message));
        }
    }
    let is_free = |axis: usize| {
        let held = Face::ALL.iter().filter(|face| face.axis() == axis && block.fixed.contains(face)).count();
        nodes[axis] > held
    };
    if Face::ALL.iter().all(|face| block.fixed.contains(face)) {
        return Err(Error::scene("body.block.fixed", "holds all six faces, leave one free to be touched"));
    }
    if !(0..3).all(is_free) {
        let message = "holds every node, leave a face free or put nodes between the fixed ones";
        return Err(Error::scene("body.block.fixed", message));
    }
    Ok(())
}

fn rate(field: &str, hz: f64) -> Result<(), Error> {
    if Rate::from_hz(hz).is_some() {
        return Ok(());
    }
    Err(Error::scene(field, format!("is {hz}, must be 0.001 to 1000000 Hz with at most six decimals")))
}

fn global(global: &GlobalSpec) -> Result<(), Error> {
    rate("global.rate_hz", global.rate_hz)?;
    if let Some(substeps) = global.substeps_per_ms
        && !(1..=MAX_SUBSTEPS_PER_MS).contains(&substeps)
    {
        let message = format!(
            "is {substeps}, must be 1 to {MAX_SUBSTEPS_PER_MS}; leave it out to have it chosen from the stability limit"
        );
        return Err(Error::scene("global.substeps_per_ms", message));
    }
    if global.ticks_per_step == 0 {
        return Err(Error::scene("global.ticks_per_step", "is 0, must be at least 1"));
    }
    if !(1..=MAX_CORES).contains(&global.cores) {
        return Err(Error::scene("global.cores", format!("is {}, must be 1 to {MAX_CORES}", global.cores)));
    }
    if global.ahead_nodes == 0 {
        return Err(Error::scene("global.ahead_nodes", "is 0, must be at least 1"));
    }
    let latencies = [
        ("global.compute_latency_ms", Some(global.compute_latency_ms)),
        ("global.basis_latency_ms", global.basis_latency_ms),
    ];
    for (field, latency_ms) in latencies.into_iter().filter_map(|(field, latency_ms)| Some((field, latency_ms?))) {
        not_negative(field, latency_ms)?;
        at_most_ms(field, latency_ms, MAX_LATENCY_MS)?;
    }
    Ok(())
}

fn local(local: &LocalSpec, global: &GlobalSpec) -> Result<(), Error> {
    rate("local.rate_hz", local.rate_hz)?;
    if local.rate_hz < global.rate_hz {
        let message = format!("is {}, must be at least global.rate_hz, {}", local.rate_hz, global.rate_hz);
        return Err(Error::scene("local.rate_hz", message));
    }
    if let Some(feedback) = local.feedback
        && !local.model.all(|kind| feedback.fits(kind))
    {
        return Err(Error::scene("local.feedback", misfit(feedback, local.model)));
    }
    if local.step == StepKind::Implicit && !local.model.all(Kind::is_linear) {
        let message =
            format!("\"implicit\" needs a linear patch and the model is {:?}, leave it out", local.model.name());
        return Err(Error::scene("local.step", message));
    }
    if let Some(error_pct) = local.error_pct {
        positive("local.error_pct", error_pct)?;
    }
    if let Some(basis) = local.basis.filter(|&basis| basis > MAX_BASIS) {
        let message = format!("is {basis}, must be at most {MAX_BASIS}: more cost time and add nothing");
        return Err(Error::scene("local.basis", message));
    }
    not_negative("local.blend.ms", local.blend.ms)?;
    let name = match local.blend.kind {
        BlendKind::None => return Ok(()),
        BlendKind::Crossfade => "a crossfade",
        BlendKind::Offset => "an offset",
    };
    let ms = local.blend.ms;
    if ms == 0.0 {
        return Err(Error::scene("local.blend.ms", format!("is 0 or missing, {name} needs a time above 0 such as 10")));
    }
    let period_ms = 1e3 / global.rate_hz;
    if ms > period_ms {
        // A model that comes while its predecessor is blended in waits, and grows old.
        let message = format!(
            "is {ms}, must be at most {period_ms:.3}: {name} ends before the next resync; lower it, or global.rate_hz"
        );
        return Err(Error::scene("local.blend.ms", message));
    }
    Ok(())
}

fn misfit(feedback: Feedback, model: ModelChoice) -> String {
    let (fed, name) = (feedback.name(), model.name());
    if matches!(model.named(), Some(Kind::Condensed | Kind::ScaledBoundary)) {
        return format!("{fed:?} with model = {name:?} would count the surroundings' compliance twice, leave it out");
    }
    let fitting = Kind::ALL.into_iter().filter(|&model| feedback.fits(model));
    let fitting = fitting.map(|model| format!("{:?}", model.name())).collect::<Vec<_>>().join(" or ");
    format!("{fed:?} needs model = {fitting} and the model is {name:?}, leave it out")
}

fn patch(patch: [usize; 3], block: &BlockSpec) -> Result<(), Error> {
    if !patch_fits(patch, block) {
        let on = |(face, limits): (&Face, [usize; 3])| format!("{limits:?} on {}", face.name());
        let largest = free_faces(block).map(on).collect::<Vec<_>>().join(", ");
        let message = format!("is {patch:?}, must be at least [2, 2, 2] and fit a free face: at most {largest}");
        return Err(Error::scene("local.patch", message));
    }
    let nodes: usize = patch.iter().product();
    if nodes > MAX_PATCH_NODES {
        let message = format!(
            "is {patch:?}, {nodes} nodes, must be at most {MAX_PATCH_NODES}: its tangent is dense; use model = \"full\""
        );
        return Err(Error::scene("local.patch", message));
    }
    Ok(())
}

fn attached(node: [usize; 3], block: &BlockSpec) -> Result<(), Error> {
    let field = "device.attach_node";
    movable(field, node, block, "the tool could not move it")?;
    if !on_surface(node, block.nodes) {
        let message = format!("{node:?} is inside the body, the tool can only be glued to a node of the surface");
        return Err(Error::scene(field, message));
    }
    Ok(())
}

fn initial(initial: &InitialSpec, block: &BlockSpec) -> Result<(), Error> {
    let pulled = initial.pull.node;
    if let NodeSpec::Lattice(node) = pulled {
        movable("initial.pull.node", node, block, "it cannot be pulled")?;
    }
    for &held in &initial.hold {
        let NodeSpec::Lattice(node) = held else { continue };
        inside("initial.hold", node, block)?;
        if held == pulled {
            return Err(Error::scene(
                "initial.hold",
                format!("{node:?} is the pulled node, it cannot be held as well"),
            ));
        }
    }
    if block.fixed.is_empty() {
        let message = "needs a fixed face: a body that floats has no equilibrium, set body.block.fixed";
        return Err(Error::scene("initial.pull", message));
    }
    Ok(())
}

fn duration(duration_s: f64, haptic_rate_hz: f64) -> Result<(), Error> {
    positive("run.duration_s", duration_s)?;
    let period_s = 1.0 / haptic_rate_hz;
    // Half a period of tolerance: 0.003 at 333.3 Hz is one tick, whatever the last digit says.
    if duration_s > MAX_DURATION_S || duration_s < 0.5 * period_s {
        let message = format!("is {duration_s}, must be one haptic period ({period_s} s) to {MAX_DURATION_S} s");
        return Err(Error::scene("run.duration_s", message));
    }
    Ok(())
}
