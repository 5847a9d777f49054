//! From a scene's safety section to the limits of the pipeline, and the gains of a virtual coupling.

use std::collections::BTreeMap;

use crate::devices::Capabilities;
use crate::error::Error;
use crate::model::body::{Body, State};
use crate::model::equilibrium::static_equilibrium;
use crate::model::{Mat3, Vec3};
use crate::safety::coupling::{Design, design};
use crate::safety::{DeviceLimits, Limits, ModelAge, Passivity, StartUp, Tank, ToolSpeed, Watchdog};
use crate::scene::{SafetySpec, SafetyStage, Scene};

/// A local model may miss two resyncs before it is old.
const PERIODS_UNTIL_OLD: f64 = 3.0;
/// A local model younger than this is never old (ms).
const YOUNGEST_OLD_MS: f64 = 100.0;

/// The period at which the limits of a device without a rate of its own are told (s).
const USUAL_PERIOD_S: f64 = 1e-3;

/// What a device is taken for: what the scene says of it, else what the device says, else what is least. No stage knows how
/// hot a motor is, so a force that it cannot exert for long is none that it gets by default.
pub(super) fn device_limits(safety: &SafetySpec, capabilities: &Capabilities) -> DeviceLimits {
    let Capabilities { max_stiffness_n_per_m: stiffness, native_rate_hz, .. } = *capabilities;
    let stiffness = safety.max_stiffness_n_per_m.unwrap_or(stiffness);
    let held_n = capabilities.continuous_force_n.unwrap_or(capabilities.max_force_n);
    // What a sampled wall of that stiffness asks for: b > K T / 2.
    let least_damping = 0.5 * stiffness * native_rate_hz.map_or(USUAL_PERIOD_S, f64::recip);
    DeviceLimits {
        max_force_n: safety.max_force_n.unwrap_or(held_n),
        // No scene makes a device turn a tool that cannot.
        max_torque_n_m: capabilities.max_torque_n_m.map(|most| safety.max_torque_n_m.unwrap_or(most)),
        max_stiffness_n_per_m: stiffness,
        max_damping_n_s_per_m: safety.max_damping_n_s_per_m.unwrap_or(capabilities.max_damping_n_s_per_m),
        damping_n_s_per_m: safety.device_damping_n_s_per_m.or(capabilities.damping_n_s_per_m).unwrap_or(least_damping),
        friction_n: safety.device_friction_n.or(capabilities.friction_n).unwrap_or(0.0),
        resolution_m: safety.device_resolution_m.or(capabilities.position_resolution_m).unwrap_or(0.0),
        delay_s: safety.device_delay_ms.map(|ms| 1e-3 * ms).or(capabilities.delay_s).unwrap_or(0.0),
    }
}

/// The scene's safety section with everything that it left to the device and the rates.
pub(super) fn resolved(scene: &Scene, device: &DeviceLimits) -> SafetySpec {
    let global = &scene.global;
    let old_ms = PERIODS_UNTIL_OLD * 1e3 / global.rate_hz + global.compute_latency_ms;
    let mut safety = scene.safety.clone();
    safety.max_force_n = device.max_force_n.is_finite().then_some(device.max_force_n);
    safety.max_torque_n_m = device.max_torque_n_m;
    safety.max_damping_n_s_per_m.get_or_insert(device.max_damping_n_s_per_m);
    safety.noise_m_s.get_or_insert(device.resolution_m * scene.local.rate_hz);
    safety.max_age_ms.get_or_insert(old_ms.max(YOUNGEST_OLD_MS));
    if scene.local.coupling {
        // What its gains follow from: a replay has no device to ask.
        safety.max_stiffness_n_per_m.get_or_insert(device.max_stiffness_n_per_m);
        safety.device_damping_n_s_per_m.get_or_insert(device.damping_n_s_per_m);
        safety.device_friction_n.get_or_insert(device.friction_n);
        safety.device_resolution_m.get_or_insert(device.resolution_m);
        safety.device_delay_ms.get_or_insert(1e3 * device.delay_s);
    }
    safety
}

/// The pipeline's limits: `safety` is [`resolved`], the environment stores `stored_j` (J) at the start, `tick_s` is the
/// period of the local group.
pub(super) fn limits(safety: &SafetySpec, device: &DeviceLimits, stored_j: f64, tick_s: f64) -> Limits {
    let ticks = |ms: f64| 1e-3 * ms / tick_s;
    let tool_speed = ToolSpeed { fade_m_s: safety.fade_speed_m_s, stop_m_s: safety.stop_speed_m_s };
    let tank = Tank { capacity_j: safety.tank_j, min_j: safety.tank_min_j, blend_s: 1e-3 * safety.swap_blend_ms };
    let passivity = Passivity {
        stored_j,
        tolerance_j: safety.energy_tolerance_j,
        max_damping_n_s_per_m: safety.max_damping_n_s_per_m.unwrap_or(device.max_damping_n_s_per_m),
        noise_m_s: safety.noise_m_s.unwrap_or(0.0),
    };
    let max_ms = safety.max_age_ms.unwrap_or(YOUNGEST_OLD_MS);
    let model_age = ModelAge { max_ticks: ticks(max_ms), fade_ticks: ticks(safety.age_fade_ms) };
    let start_up =
        StartUp { engage_force_n: safety.engage_force_n, ramp_s: 1e-3 * safety.start_up_ms, ..StartUp::default() };
    let watchdog = Watchdog { max_stale_ticks: safety.watchdog_ticks };
    let max_slew_n_per_s = if safety.has(SafetyStage::Slew) { safety.max_slew_n_per_ms * 1e3 } else { f64::INFINITY };
    Limits {
        max_slew_n_per_s,
        max_torque_n_m: device.max_torque_n_m,
        ramp_s: 1e-3 * safety.ramp_ms,
        tick_s,
        tool_speed: safety.has(SafetyStage::ToolSpeed).then_some(tool_speed),
        tank: safety.has(SafetyStage::Tank).then_some(tank),
        passivity: safety.has(SafetyStage::Passivity).then_some(passivity),
        model_age: safety.has(SafetyStage::ModelAge).then_some(model_age),
        start_up: safety.has(SafetyStage::StartUp).then_some(start_up),
        watchdog: safety.has(SafetyStage::Watchdog).then_some(watchdog),
        ..Limits::bare(device.max_force_n)
    }
}

/// A device's ball is one in its workspace: the whole is taken to be four times as wide.
const WORKSPACE_PER_BALL: f64 = 4.0;

/// How far a device is believed to go from where it began (m): across its whole workspace, or twice across `body`, if that is
/// farther: scenes may be larger than any device.
pub(super) fn reach_m(capabilities: &Capabilities, body: &dyn Body) -> f64 {
    let rest = body.rest();
    let corner = |by: fn(&Vec3, &Vec3) -> Vec3| rest.iter().copied().reduce(|a, b| by(&a, &b)).unwrap_or_default();
    let across_m = (corner(Vec3::sup) - corner(Vec3::inf)).norm();
    (2.0 * WORKSPACE_PER_BALL * capabilities.workspace_radius_m).max(2.0 * across_m)
}

/// Limits and gains follow from what the device says, so it must be possible; its largest force is [`check_ramp`]'s.
pub(super) fn check_capabilities(capabilities: Capabilities, limits: &Limits) -> Result<(), Error> {
    let asked = Capabilities { max_force_n: limits.max_force_n, continuous_force_n: None, ..capabilities };
    asked.fault().map_or(Ok(()), |words| Err(Error::scene("device", format!("has impossible capabilities: {words}"))))
}

/// The slew limit must not keep the force from being gone when the ramp is over.
pub(super) fn check_ramp(limits: &Limits) -> Result<(), Error> {
    if !(limits.max_force_n.is_finite() && limits.max_force_n > 0.0) {
        let message = format!("has a largest force of {} N, must be a finite number above 0", limits.max_force_n);
        return Err(Error::scene("device", message));
    }
    let needed_s = limits.max_force_n / limits.max_slew_n_per_s;
    if limits.ramp_s >= needed_s {
        return Ok(());
    }
    let message = format!(
        "is {} ms, but the largest force of {} N takes {} ms at the slew limit: use that or more, or raise \
         safety.max_slew_n_per_ms",
        limits.ramp_s * 1e3,
        limits.max_force_n,
        (needed_s * 1e3).ceil()
    );
    Err(Error::scene("safety.ramp_ms", message))
}

/// Steps along the straight way from rest to a state, over which the work of its forces is summed (Simpson's rule).
const WORK_STEPS: usize = 32;

/// The energy that `body` stores in `state` (J): the work against its elastic forces on the straight way from rest. Exact for
/// linear springs, and a Simpson sum for others; zero for a body that stores none.
pub(super) fn stored_energy(body: &mut dyn Body, state: &State) -> f64 {
    let rest = body.rest().to_vec();
    let moved: Vec<Vec3> = state.positions.iter().zip(&rest).map(|(position, rest)| position - rest).collect();
    if moved.iter().all(|moved| *moved == Vec3::zeros()) {
        return 0.0;
    }
    let mut forces = vec![Vec3::zeros(); rest.len()];
    let mut between = State::at_rest(&rest);
    let mut power = |share: f64| {
        for (position, (rest, moved)) in between.positions.iter_mut().zip(rest.iter().zip(&moved)) {
            *position = rest + moved * share;
        }
        body.forces(&between, &mut forces);
        -forces.iter().zip(&moved).map(|(force, moved)| force.dot(moved)).sum::<f64>()
    };
    let weight = |step: usize| match step {
        0 | WORK_STEPS => 1.0,
        odd if odd % 2 == 1 => 4.0,
        _ => 2.0,
    };
    let sum: f64 = (0..=WORK_STEPS).map(|step| weight(step) * power(step as f64 / WORK_STEPS as f64)).sum();
    let stored_j = sum / (3.0 * WORK_STEPS as f64);
    if stored_j.is_finite() { stored_j.max(0.0) } else { 0.0 }
}

/// How far a node is moved to measure how stiff the body is there, as a share of the distance to its neighbours.
const PROBE_SHARE: f64 = 1e-3;

/// The coupling for a body whose stiffness is measured at `node`, or without one at the movable node of the surface nearest to
/// the middle of all: a replay, which has no path, must find the same.
///
/// # Errors
/// If the body has no equilibrium to measure.
pub(super) fn coupling(
    body: &mut dyn Body,
    node: Option<u32>,
    device: &DeviceLimits,
    period_s: f64,
) -> Result<Design, Error> {
    let movable = |node: &u32| body.inverse_masses()[*node as usize] > 0.0;
    let mut surface: Vec<u32> = body.surface().triangles.iter().flatten().copied().filter(movable).collect();
    surface.sort_unstable();
    surface.dedup();
    let rest = |node: u32| body.rest()[node as usize];
    let middle = surface.iter().map(|&node| rest(node)).sum::<Vec3>() / surface.len().max(1) as f64;
    let distance = |node: u32| (rest(node) - middle).norm();
    let nearest = || surface.iter().copied().min_by(|&a, &b| distance(a).total_cmp(&distance(b)));
    let Some(node) = node.filter(movable).or_else(nearest) else {
        return Err(Error::scene("local.coupling", "needs a surface that can move"));
    };
    let triangle = body.surface().triangles[body.surface().at_node(node)[0] as usize];
    let [a, b, c] = triangle.map(|corner| body.rest()[corner as usize]);
    let inwards = -(b - a).cross(&(c - a)).normalize() * (b - a).norm() * PROBE_SHARE;
    let at = body.rest()[node as usize] + inwards;
    let state = static_equilibrium(body, &[(node, at)]).map_err(|error| error.at("local.coupling"))?;
    let mut forces = vec![Vec3::zeros(); state.positions.len()];
    body.forces(&state, &mut forces);
    let local = forces[node as usize].norm() / inwards.norm();
    Ok(design(device, local, mass_on_tool(body, &state, period_s), period_s))
}

/// The most that `body` puts on a tool within a tick (kg), wherever on its surface: the nodes of a triangle that move as one,
/// with what their dampers and springs resist within the tick.
///
/// A contact with weights w moves the body by w^T A^-1 w per impulse, A = M + T B + T^2 K. With w^T u = 1 for u = (1, 1, 1) that is
/// at least 1 / u^T A u, by Cauchy's inequality: u^T A u is the bound for all weights. A triangle with a held corner has none,
/// and counts by the nodes that move.
fn mass_on_tool(body: &dyn Body, state: &State, period_s: f64) -> f64 {
    let triangles = &body.surface().triangles;
    let mut nodes: Vec<u32> = triangles.iter().flatten().copied().collect();
    nodes.sort_unstable();
    nodes.dedup();
    nodes.retain(|&node| body.inverse_masses()[node as usize] > 0.0);
    let mut resisting: BTreeMap<(u32, u32), Mat3> = BTreeMap::new();
    body.tangent(state, &nodes, true, &mut |block| {
        let within_tick = block.position * (period_s * period_s) + block.velocity * period_s;
        *resisting.entry((block.row, block.column)).or_default() -= within_tick;
    });
    let of_triangle = |corners: &[u32; 3]| {
        let moving = || corners.iter().filter(|&node| nodes.binary_search(node).is_ok());
        let mass: f64 = moving().map(|&node| 1.0 / body.inverse_masses()[node as usize]).sum();
        let pairs = moving().flat_map(|&row| moving().map(move |&column| (row, column)));
        let sum: Mat3 = pairs.filter_map(|pair| resisting.get(&pair)).sum();
        mass + sum.symmetric_eigenvalues().amax()
    };
    triangles.iter().map(of_triangle).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::body::Block;
    use crate::model::mesh::Face;

    fn block() -> Block {
        Block::builder([4; 3], [0.03; 3]).fix(Face::ZMin).build().unwrap()
    }

    // Check against the work of a tool that pulls the node out: half of force times way, for a small one.
    #[test]
    fn the_stored_energy_is_the_work_of_pulling() {
        let mut body = block();
        let node = body.lattice().id([2, 2, 3]);
        assert_eq!(stored_energy(&mut body, &State::at_rest(block().rest())), 0.0);
        let offset = 1e-4;
        let held = [(node, body.rest()[node as usize] + Vec3::z() * offset)];
        let state = static_equilibrium(&mut body, &held).unwrap();
        let mut forces = vec![Vec3::zeros(); state.positions.len()];
        body.forces(&state, &mut forces);
        let work = 0.5 * -forces[node as usize].z * offset;
        let stored = stored_energy(&mut body, &state);
        assert!(work > 0.0 && (stored / work - 1.0).abs() < 0.02, "{stored} J, not {work} J");
    }

    #[test]
    fn a_stage_that_is_off_is_none_and_the_others_follow_the_rates() {
        let mut scene = Scene::of_program();
        scene.global.rate_hz = 10.0;
        scene.local.rate_hz = 2000.0;
        scene.safety.off = vec![SafetyStage::Slew, SafetyStage::Tank];
        let device = DeviceLimits::of_force(3.0);
        let limits = limits(&resolved(&scene, &device), &device, 0.25, 0.5e-3);
        assert_eq!((limits.max_slew_n_per_s, limits.tank), (f64::INFINITY, None));
        assert_eq!(limits.passivity.unwrap().stored_j, 0.25);
        let age = limits.model_age.unwrap();
        assert!((age.max_ticks - 600.0).abs() < 1e-9 && (age.fade_ticks - 400.0).abs() < 1e-9, "{age:?}");
        assert!(limits.start_up.is_some() && limits.watchdog.is_some() && limits.tool_speed.is_some());
    }

    #[test]
    fn a_torque_needs_a_device_that_exerts_it() {
        let said = SafetySpec { max_torque_n_m: Some(0.02), ..SafetySpec::default() };
        let able = Capabilities { max_torque_n_m: Some(0.05), ..Capabilities::TOUCH };
        let most = |safety: &SafetySpec, device: &Capabilities| device_limits(safety, device).max_torque_n_m;
        assert_eq!(most(&SafetySpec::default(), &able), Some(0.05));
        assert_eq!(most(&said, &able), Some(0.02));
        assert_eq!(most(&said, &Capabilities::TOUCH), None);
        let device = device_limits(&said, &able);
        let resolved = resolved(&Scene::of_program(), &device);
        assert_eq!(limits(&resolved, &device, 0.0, 1e-3).max_torque_n_m, Some(0.02));
        assert_eq!(resolved.max_torque_n_m, Some(0.02), "a replay has no device to ask");
    }

    #[test]
    fn limits_are_what_the_scene_says_else_what_the_device_says_else_the_least() {
        let touch = Capabilities { position_resolution_m: Some(50e-6), ..Capabilities::TOUCH };
        let device = device_limits(&SafetySpec::default(), &touch);
        assert_eq!((device.max_force_n, device.max_stiffness_n_per_m, device.max_damping_n_s_per_m), (3.3, 400.0, 4.0));
        assert_eq!((device.damping_n_s_per_m, device.friction_n, device.resolution_m), (0.2, 0.0, 50e-6));
        let resolved = resolved(&Scene::of_program(), &device);
        assert_eq!((resolved.max_damping_n_s_per_m, resolved.noise_m_s), (Some(4.0), Some(0.05)));
        let own = Capabilities {
            continuous_force_n: Some(1.4),
            damping_n_s_per_m: Some(0.7),
            friction_n: Some(0.1),
            delay_s: Some(1e-3),
            ..Capabilities::FALCON
        };
        let device = device_limits(&SafetySpec::default(), &own);
        assert_eq!((device.max_force_n, device.damping_n_s_per_m, device.friction_n), (1.4, 0.7, 0.1));
        assert_eq!((device.max_stiffness_n_per_m, device.delay_s), (3000.0, 1e-3));
        let said = SafetySpec { max_force_n: Some(5.0), max_stiffness_n_per_m: Some(100.0), ..SafetySpec::default() };
        let device = device_limits(&said, &Capabilities::FALCON);
        assert_eq!((device.max_force_n, device.max_stiffness_n_per_m, device.damping_n_s_per_m), (5.0, 100.0, 0.05));
    }

    #[test]
    fn a_coupling_knows_the_body_under_the_tool() {
        let device = DeviceLimits::of_force(3.0);
        let design = coupling(&mut block(), None, &device, 1e-3).unwrap();
        assert!(design.local_n_per_m > 10.0 && design.local_n_per_m < 1e4, "{design}");
        let held = Face::ALL.into_iter().fold(Block::builder([4; 3], [0.03; 3]), |block, face| block.fix(face));
        assert!(coupling(&mut held.build().unwrap(), None, &device, 1e-3).is_err());
    }
}
