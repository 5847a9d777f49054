//! What the log says of the run as a whole.

use crate::devices::DeviceState;
use crate::error::Error;
use crate::log::{Environment, GroupInfo, LoggedExecution, ToolSample};
use crate::model::body::Block;
use crate::model::contact::ToolShape;
use crate::runtime::{Execution, Nanos, Rate};
use crate::safety::Actions;
use crate::scene::{BodySpec, TetrahedraSpec};
use crate::session::prepare::{BASIS, LINK, Prepared, Tool};

/// The environment of a run whose devices gave these `first` states.
pub(super) fn environment(prepared: &Prepared, first: &[DeviceState]) -> Result<Environment, Error> {
    let session = Some(prepared.scene.to_toml()?);
    let tetrahedra = prepared.scene.body.as_ref().and_then(BodySpec::tetrahedra);
    let volume = tetrahedra.and_then(|spec| spec.volume.as_ref());
    let mesh = volume.filter(|_| prepared.options.log.is_some()).map(|volume| volume.file().into());
    let timing = &prepared.plan.timing;
    Ok(Environment {
        palpate_version: env!("CARGO_PKG_VERSION").to_owned(),
        instruction_set: Block::instruction_set().to_owned(),
        execution: match prepared.options.execution {
            Execution::Virtual => LoggedExecution::Virtual,
            // The logger knows better once it runs.
            Execution::Threaded => LoggedExecution::began(Nanos::ZERO),
        },
        model: prepared.plan.template.kind.name().to_owned(),
        model_reason: prepared.reason.clone(),
        body: tetrahedra.map(|spec| body(prepared, spec)),
        tools: tools(prepared),
        haptic_hz: timing.haptic.as_hz(),
        global_hz: if prepared.is_multi_rate() { timing.global.as_hz() } else { 0.0 },
        groups: groups(prepared),
        limit_stages: Actions::NAMES.map(str::to_owned).into(),
        safety_off: prepared.scene.safety.off.iter().map(|stage| stage.name().to_owned()).collect(),
        devices: match prepared.tools.as_slice() {
            [_] => Vec::new(),
            several => several.iter().map(|tool| tool.name.clone()).collect(),
        },
        shapes: shapes(&prepared.tools),
        // All of it: each device's ledger begins with an even share.
        stored_j: prepared.tools.iter().filter_map(|tool| Some(tool.limits.passivity?.stored_j)).sum(),
        coupling: couplings(&prepared.tools),
        granted: Default::default(),
        first_tools: (0..).zip(first).map(first_tool).collect(),
        scene: prepared.scene.source.clone(),
        session,
        mesh,
    })
}

/// A body of tetrahedra in words.
fn body(prepared: &Prepared, spec: &TetrahedraSpec) -> String {
    let body = prepared.simulation.body();
    let held = body.inverse_masses().iter().filter(|&&w| w == 0.0).count();
    format!("{} nodes, {held} of them held, {}", body.rest().len(), spec.in_words())
}

/// The tools with a shape in words, and whether the elements are fine against each.
fn tools(prepared: &Prepared) -> Option<String> {
    let named = |(index, tool): (usize, &Tool)| {
        let mm = |metres: f64| format!("{:.1} mm", 1e3 * metres);
        let shape = match tool.shape {
            ToolShape::Point => return None,
            ToolShape::Sphere { radius } => format!("sphere of {}", mm(radius)),
            ToolShape::Capsule { radius, half_axis } => {
                format!("capsule of {} and {}", mm(radius), mm(2.0 * half_axis.norm()))
            }
        };
        let words = match prepared.simulation.coarseness(index) {
            None => format!("{shape}, glued by its centre"),
            Some(found) => {
                let (edge, sinking) = (mm(found.edge), if found.sinks { ", sinking by Hertz" } else { "" });
                let until = found.fine_from.map(|radius| format!(" until it touches {} around", mm(radius)));
                let until = until.unwrap_or_default();
                match 100.0 * found.smoothed {
                    0.0 => format!("{shape}; elements of {edge} are fine against it"),
                    share => format!(
                        "{shape}; elements of {edge} are coarse against it{until}: corners smoothed on {share:.0} % of the surface{sinking}"
                    ),
                }
            }
        };
        Some(if tool.name.is_empty() { words } else { format!("{}: {words}", tool.name) })
    };
    let all: Vec<String> = prepared.tools.iter().enumerate().filter_map(named).collect();
    (!all.is_empty()).then(|| all.join("; "))
}

/// The rate groups, in graph order.
fn groups(prepared: &Prepared) -> Vec<GroupInfo> {
    let group = |name: &str, rate: Rate| GroupInfo::new(name, rate.as_hz());
    let timing = &prepared.plan.timing;
    let local = GroupInfo {
        budget: prepared.local.declared_budget(),
        actors: haptic_actors(prepared),
        ..group("local", timing.haptic)
    };
    let basis = || GroupInfo { background: true, ..group(BASIS, timing.global) };
    let global = || GroupInfo { budget: prepared.global.declared_budget(), ..group("global", timing.global) };
    let logger = group("logger", prepared.logger_group().rate());
    let [to_devices, to_global] = [prepared.has_global(), prepared.has_haptic()];
    let bridges =
        || [("global bridge", to_devices), ("haptic bridge", to_global)].into_iter().filter(|bridge| bridge.1);
    let bridges = || bridges().map(|(name, _)| name.to_owned()).collect();
    let link = || GroupInfo { background: true, actors: bridges(), ..group(LINK, timing.haptic) };
    let optional =
        [prepared.reduces().then(basis), prepared.has_global().then(global), prepared.is_linked().then(link)];
    let local = prepared.has_haptic().then_some(local);
    local.into_iter().chain(optional.into_iter().flatten()).chain([logger]).collect()
}

/// The haptic actors in the order of their ticks: the device of each tool, then what computes the forces on all.
fn haptic_actors(prepared: &Prepared) -> Vec<String> {
    let device = |tool: &Tool| if tool.name.is_empty() { "device".to_owned() } else { format!("{}/device", tool.name) };
    prepared.tools.iter().map(device).chain(["local".to_owned()]).collect()
}

fn first_tool((device, first): (u16, &DeviceState)) -> ToolSample {
    ToolSample {
        position_m: first.position.into(),
        velocity_m_s: first.velocity.into(),
        buttons: first.buttons,
        orientation: first.orientation,
        device,
        ..ToolSample::default()
    }
}

/// The shapes of the tools, unless all are points.
fn shapes(tools: &[Tool]) -> Vec<ToolShape> {
    let has_shape = tools.iter().any(|tool| tool.shape != ToolShape::Point);
    if has_shape { tools.iter().map(|tool| tool.shape).collect() } else { Vec::new() }
}

/// The gains of each tool's coupling in words.
fn couplings(tools: &[Tool]) -> Option<String> {
    let named = |tool: &Tool| {
        let design = tool.coupling?;
        Some(if tool.name.is_empty() { design.to_string() } else { format!("{}: {design}", tool.name) })
    };
    let all: Vec<String> = tools.iter().filter_map(named).collect();
    (!all.is_empty()).then(|| all.join("; "))
}
