//! A comparison for programs: one JSON document.
//!
//! Field names are stable; later versions only add fields. Units are in the names; nanoseconds are integers. A figure that
//! is not there is `null`.
//!
//! | field | content |
//! | --- | --- |
//! | `schema_version` | 1 |
//! | `scene`, `nodes`, `haptic_period_ns`, `global_period_ns`, `duration_s` | what was compared |
//! | `link` | the scene's simulated link with the names of `[link]`; every `latency_ms` comes on top of it; `null` without |
//! | `palpate_version`, `instruction_set`, `debug_build`, `clock_ns` | what measured; `clock_ns` is in every tick and build |
//! | `peak_n`, `largest_energy_j` | of `full`: the whole of all percentages |
//! | `full_fits_tick` | whether the p99 of `full`'s tick is within the haptic period |
//! | `models[]` | `full` first; `model`, `latency_ms`, `ok`, `why_not`, `error_percent`, `cost`, `resyncs`, `degraded` |
//! | `models[].error_percent` | `rms`, `max`, `jump`, `resync_before_p99`, `resync_after_p99`, `energy` |
//! | `models[].cost` | `tick_p50_ns`, `tick_p99_ns`, `tick_max_ns`, `haptic_s_per_s`, `global_s_per_s`, `total_s_per_s`, `builds`, `build_p50_ns`, `build_p99_ns` |
//! | `devices[]` | of each of several devices `name`, `peak_n`, `largest_energy_j`; those of the document are then the largest |
//! | `models[].devices[]` | of each of several devices `name`, `error_percent`, `resyncs`; the model's `error_percent` is then, figure by figure, that of the worst |
//! | `finer[]` | as `models[]`: `full` with smaller steps, and with smaller elements where a surface was filled |
//! | `conclusions[]` | sentences, not for programs |

use serde_json::{Value, json};

use super::conclusions::full_fits;
use super::figures::{ComparedRun, Comparison, ForceDeviation, Measured, MeasuredDevice};

/// The comparison as one JSON document.
pub fn to_json(comparison: &Comparison) -> String {
    let full = model("full", 0, Some(&comparison.full), None);
    let row = |run: &ComparedRun| model(&run.model, run.latency.0, run.measured(), run.missing());
    let models = comparison.runs.iter().map(row);
    let energies = comparison.full.devices.iter().map(|device| device.trace.largest_energy_j());
    let largest_energy_j = energies.fold(0.0, f64::max);
    let models: Vec<Value> = [full].into_iter().chain(models).collect();
    let mut document = json!({
        "schema_version": 1,
        "scene": comparison.scene,
        "nodes": comparison.nodes,
        "haptic_period_ns": comparison.haptic_period.0,
        "global_period_ns": comparison.global_period.0,
        "duration_s": comparison.duration.as_secs_f64(),
        "link": comparison.link,
        "debug_build": comparison.is_debug_build,
        "palpate_version": comparison.palpate_version,
        "instruction_set": comparison.instruction_set,
        "clock_ns": comparison.clock.0,
        "peak_n": comparison.full.peak_n(),
        "largest_energy_j": largest_energy_j,
        "full_fits_tick": full_fits(comparison),
        "models": models,
        "finer": comparison.finer.iter().map(row).collect::<Vec<_>>(),
        "conclusions": comparison.conclusions(),
    });
    add_devices(
        &mut document,
        &comparison.full,
        |device| json!({ "peak_n": device.trace.peak_n(), "largest_energy_j": device.trace.largest_energy_j() }),
    );
    document.to_string()
}

/// Adds what there is to say of each device, with its name, where there are several.
fn add_devices(to: &mut Value, run: &Measured, of: impl Fn(&MeasuredDevice) -> Value) {
    let named = |device: &MeasuredDevice| {
        let mut value = of(device);
        value["name"] = json!(device.name);
        value
    };
    if !run.several().is_empty() {
        to["devices"] = run.several().iter().map(named).collect();
    }
}

fn error_percent(error: &ForceDeviation, resyncs: usize) -> Value {
    json!({
        "rms": error.rms,
        "max": error.max,
        "jump": error.jump,
        "resync_before_p99": (resyncs > 0).then_some(error.resync_before_p99),
        "resync_after_p99": (resyncs > 0).then_some(error.resync_after_p99),
        "energy": error.energy,
    })
}

fn model(name: &str, latency_ns: u64, run: Option<&Measured>, why_not: Option<&str>) -> Value {
    let resyncs = run.map_or(0, Measured::resyncs);
    let mut row = json!({
        "model": name,
        "latency_ms": latency_ns as f64 / 1e6,
        "ok": run.is_some(),
        "why_not": why_not,
        "error_percent": run.map(|run| error_percent(&run.error, resyncs)),
        "cost": run.map(|run| json!({
            "tick_p50_ns": run.cost.tick_p50.0,
            "tick_p99_ns": run.cost.tick_p99.0,
            "tick_max_ns": run.cost.tick_max.0,
            "haptic_s_per_s": run.cost.haptic_load,
            "global_s_per_s": run.cost.global_load,
            "total_s_per_s": run.cost.total_load(),
            "builds": run.cost.builds,
            "build_p50_ns": run.cost.build_p50.0,
            "build_p99_ns": run.cost.build_p99.0,
        })),
        "resyncs": resyncs,
        "degraded": run.map(|run| run.degraded),
    });
    if let Some(run) = run {
        add_devices(&mut row, run, |device| {
            let resyncs = device.trace.resyncs.len();
            json!({ "error_percent": error_percent(&device.error, resyncs), "resyncs": resyncs })
        });
    }
    row
}

#[cfg(test)]
mod tests {
    use super::super::figures::{ComparedRun, RunOutcome};
    use super::*;
    use palpate::runtime::Nanos;

    #[test]
    fn a_failed_run_has_its_reason_and_no_figures() {
        let outcome = RunOutcome::Failed("it diverged".into());
        let runs = vec![ComparedRun { model: "patch".into(), latency: Nanos(33_340_000), outcome }];
        let mut comparison = Comparison { runs, ..Comparison::default() };
        comparison.full.error.rms = f64::NAN;
        let document: Value = serde_json::from_str(&to_json(&comparison)).unwrap();
        let row = &document["models"][1];
        assert_eq!(
            (&row["ok"], &row["why_not"], &row["latency_ms"]),
            (&false.into(), &"it diverged".into(), &33.34.into())
        );
        assert!(row["error_percent"].is_null() && row["cost"].is_null() && row["degraded"].is_null(), "{row}");
        assert_eq!(document["link"], Value::Null);
        comparison.link = Some(palpate::scene::LinkSpec { delay_ms: 33.0, ..Default::default() });
        let document: Value = serde_json::from_str(&to_json(&comparison)).unwrap();
        assert_eq!(document["link"]["delay_ms"], 33.0);
        // Without a force there is no percentage, and JSON has no NaN.
        assert_eq!(document["models"][0]["error_percent"]["rms"], Value::Null);
    }
}
