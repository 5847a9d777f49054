//! The report for programs: one JSON document.
//!
//! Field names are stable; later versions only add fields. Units are in the names; counts and nanoseconds are
//! integers. A number that is not finite, which JSON cannot hold, and a fact that is not known are `null`.
//!
//! | field | content |
//! | --- | --- |
//! | `schema_version` | 1 |
//! | `verdict`, `reason` | `OK`, `INCOMPLETE`, `LATE`, `RESTARTED` or `FAILED`, and why in one line |
//! | `duration_s` | time of the last record; of a part that begins later (`--from`), from its first record to its last |
//! | `virtual_time` | true if lateness is zero by construction |
//! | `damage` | what is wrong with the log and where, or `null` |
//! | `messages` | number of messages read, by topic |
//! | `environment` | versions, rates, in `body` what a body of tetrahedra is made of (`null` for others), in `tools` the shapes of the tools and how coarse the body is against them (`null` if all are points), in `model_reason` and `model_warning` why `model` was chosen or its patch and basis are that large (`null` if both were named), in `granted` what the system granted, `safety_off`, `stored_j` and `coupling`; `null` if unknown |
//! | `groups[]` | `name`, `rate_hz`, `released`, `skipped`, `missed`, `elapsed_periods`, `in_degraded_mode`, `lost_records`, `skipped_by_cause`, `missed_by_cause`, `lateness_ns`, `execution_ns`, `period_error_ns`, `jitter_ns`, `busy_ns` |
//! | `resyncs` | `count`, `jump_before_n`, `jump_after_n`, `age_ns` |
//! | `force` | `ticks`, `peak_n`, `peak_commanded_n`, `not_finite`, `model_age_s`, `served` (share of ticks by local model) |
//! | `contact` | haptic ticks `free`, `stick`, `slip`, `lost` |
//! | `touch` | of a tool with a shape `most_places` that touched at once, `peak_pressure_pa` (largest mean pressure), `area_at_peak_m2` (at the largest force); `null` for a point |
//! | `limits` | `ticks`, `limited`, `share` (0 to 1), `stages` by name, `energy_j` (`least` and `last` of the passivity ledger), `tank_j` (`least`) |
//! | `devices[]` | of each of several devices `name`, `resyncs`, `force`, `contact`, `touch` and `limits`; without it these are the only device's, with it they are also the first's |
//! | `lost_records` | of all groups |
//! | `figures` | every figure by its name, see [`crate::timing`]: times of releases in ns, all else as in the name's unit |
//! | `cores[]` | `cpu` (`null`: any), `share`, `groups` by name: share of the time (0 to 1) at work |
//! | `worst[]` | the worst ticks: `group`, `tick`, `t_s`, `overdue_ns`, `deadlines` (overdue in deadlines), `lateness_ns`, `execution_ns`, `slips`, `cause` (`null`: in time), `actors_ns` by name, `meanwhile`, `force_step_n`, `why`, `neighbours[]` with `group`, `tick`, `scheduled_ns`, `woke_ns`, `start_ns`, `end_ns`, `deadline_ns`, `slips`, `cause` |
//! | `span_s` | time of the first and of the last record that was looked at |
//! | `events` | `count`, `worst`, `first[]` with `t_s`, `level`, `message` |
//!
//! Distributions are `{count, p50, p90, p99, p999, max}`, nearest-rank, all zero if `count` is zero. Causes are
//! `late_wake`, `long_tick`, `stalled_peer`, `policy`, `fault` and `unattributed`.

use std::collections::BTreeMap;

use palpate::log::{
    DeviceReport, Environment, GroupSummary, Level, LoggedExecution, Percentiles, RunReport, TextEvent,
};
use palpate::runtime::SlipCounts;
use palpate::runtime::TickTiming;
use serde_json::{Map, Value, json};

use super::text::in_words;
use crate::timing::{Against, ComparedFigure, CoreUse, Figure, FigureValue, TimingReport, WorstTick, cause_name};

/// The timing of a run in detail as one JSON document.
pub fn timing_to_json(report: &TimingReport) -> String {
    timing_document(report).to_string()
}

fn timing_document(report: &TimingReport) -> Value {
    let mut document = document(&report.run);
    let figure = |figure: Figure| (figure.name, number(figure.value));
    document["figures"] = Value::Object(report.figures().into_iter().map(figure).collect());
    document["cores"] = report.cores.iter().map(core).collect();
    document["worst"] = report.worst.iter().map(|worst| worst_tick(worst, report)).collect();
    document["span_s"] = report.span.iter().map(|time| time.as_secs_f64()).collect();
    document
}

/// Two logs side by side as one JSON document: the report of this one, and in `against` the `log` that it is held against
/// with its `verdict`, in `figures` by name `this`, `other`, `ratio` and `interval` (95 % of the ratios lie there; both `null`
/// where there is nothing to say) and `differs`, and in `unmatched` the names that one of the two alone has.
pub fn against_to_json(against: &Against, this: &TimingReport, other: (&str, &TimingReport)) -> String {
    let compared = |compared: &ComparedFigure| {
        let value = json!({
            "this": number(compared.this.value),
            "other": number(compared.other.value),
            "ratio": compared.ratio,
            "interval": compared.interval,
            "differs": compared.differs(),
        });
        (compared.this.name.clone(), value)
    };
    let mut document = timing_document(this);
    document["against"] = json!({
        "log": other.0,
        "verdict": other.1.run.verdict().0.name(),
        "figures": against.figures.iter().map(compared).collect::<Map<_, _>>(),
        "unmatched": against.unmatched,
    });
    document.to_string()
}

/// A value as it is; `null` if it is not finite.
fn number(value: FigureValue) -> Value {
    match value {
        FigureValue::Integer(value) => json!(value),
        FigureValue::Real(value) => json!(value),
    }
}

fn core(core: &CoreUse) -> Value {
    let groups: Map<_, _> = core.groups.iter().map(|(name, share)| (name.clone(), json!(share))).collect();
    json!({ "cpu": core.cpu, "share": core.share(), "groups": groups })
}

fn worst_tick(worst: &WorstTick, report: &TimingReport) -> Value {
    let timing = &worst.timing;
    let unknown = Environment::default();
    let environment = report.run.environment.as_ref().unwrap_or(&unknown);
    let cause = |timing: &TickTiming| (timing.missed() || timing.slips > 0).then(|| cause_name(timing.cause));
    let neighbour = |tick: &TickTiming| {
        json!({
            "group": environment.group_name(tick.group),
            "tick": tick.tick,
            "scheduled_ns": tick.scheduled.0,
            "woke_ns": tick.woke.0,
            "start_ns": tick.start.0,
            "end_ns": tick.end.0,
            "deadline_ns": tick.deadline.0,
            "slips": tick.slips,
            "cause": cause(tick),
        })
    };
    json!({
        "group": worst.group,
        "tick": timing.tick,
        "t_s": timing.scheduled.as_secs_f64(),
        "overdue_ns": worst.overdue.0,
        "deadlines": worst.severity,
        "lateness_ns": timing.woke.saturating_sub(timing.scheduled).0,
        "execution_ns": timing.end.saturating_sub(timing.start).0,
        "slips": timing.slips,
        "cause": cause(timing),
        "actors_ns": worst.actors.iter().map(|(name, spent)| (name.clone(), json!(spent.0))).collect::<Map<_, _>>(),
        "meanwhile": worst.meanwhile,
        "force_step_n": worst.force_step_n,
        "why": in_words(worst),
        "neighbours": worst.moment.ticks.iter().map(neighbour).collect::<Vec<_>>(),
    })
}

fn document(report: &RunReport) -> Value {
    let (verdict, reason) = report.verdict();
    let mut document = json!({
        "schema_version": 1,
        "verdict": verdict.name(),
        "reason": reason,
        "duration_s": report.duration.as_secs_f64(),
        "virtual_time": report.is_virtual(),
        "damage": report.damage,
        "messages": report.messages,
        "environment": report.environment.as_ref().map(environment),
        "groups": report.groups.iter().map(group).collect::<Vec<_>>(),
        "lost_records": report.lost_records(),
        "events": {
            "count": report.event_count,
            "worst": report.worst_event.map(Level::name),
            "first": report.events.iter().map(event).collect::<Vec<_>>(),
        },
    });
    // The first device where the only one has always been, and all of them where there are several.
    let first = report.devices.first().map(device);
    if let (Some(document), Some(Value::Object(first))) = (document.as_object_mut(), first) {
        document.extend(first);
    }
    if report.devices.len() > 1 {
        let named = |of: &DeviceReport| {
            let mut all = device(of);
            all["name"] = json!(of.name);
            all
        };
        document["devices"] = report.devices.iter().map(named).collect();
    }
    document
}

fn device(DeviceReport { resyncs, force, contact, touch, limits, .. }: &DeviceReport) -> Value {
    json!({
        "resyncs": {
            "count": resyncs.jump_before_n.count,
            "jump_before_n": percentiles(resyncs.jump_before_n),
            "jump_after_n": percentiles(resyncs.jump_after_n),
            "age_ns": percentiles(resyncs.age_ns),
        },
        "force": {
            "ticks": force.ticks,
            "peak_n": force.peak_n,
            "peak_commanded_n": force.peak_commanded_n,
            "not_finite": force.not_finite,
            "model_age_s": percentiles(force.model_age_s),
            "served": force.shares().map(|(model, share)| (model.name(), share)).collect::<BTreeMap<_, _>>(),
        },
        "contact": { "free": contact.free, "stick": contact.stick, "slip": contact.slip, "lost": contact.lost },
        "touch": touch.map(|touch| json!({
            "most_places": touch.most_places,
            "peak_pressure_pa": touch.peak_pressure_pa,
            "area_at_peak_m2": touch.area_at_peak_m2,
        })),
        "limits": {
            "ticks": limits.ticks,
            "limited": limits.limited,
            "share": limits.share(),
            "energy_j": { "least": limits.energy.least_j, "last": limits.energy.last_j },
            "tank_j": { "least": limits.energy.least_tank_j },
            "stages": limits.stages.iter().map(|(name, count)| (name.clone(), json!(count))).collect::<Map<_, _>>(),
        },
    })
}

fn environment(environment: &Environment) -> Value {
    json!({
        "palpate_version": environment.palpate_version,
        "instruction_set": environment.instruction_set,
        "execution": match environment.execution {
            LoggedExecution::Virtual => "virtual",
            LoggedExecution::Threaded { .. } => "threaded",
        },
        "start_unix_ns": environment.epoch_ns(),
        "body": environment.body,
        "tools": environment.tools,
        "model": environment.model,
        "model_reason": environment.model_reason.as_ref().map(|reason| &reason.why),
        "model_warning": environment.model_reason.as_ref().and_then(|reason| reason.warning.as_ref()),
        "haptic_hz": environment.haptic_hz,
        "global_hz": environment.global_hz,
        "granted": environment.granted,
        "safety_off": environment.safety_off,
        "stored_j": environment.stored_j,
        "coupling": environment.coupling,
    })
}

fn group(group: &GroupSummary) -> Value {
    json!({
        "name": group.name,
        "rate_hz": group.rate_hz,
        "released": group.released,
        "skipped": group.skipped.total(),
        "missed": group.missed.total(),
        "elapsed_periods": group.elapsed_periods,
        "in_degraded_mode": group.in_degraded_mode,
        "lost_records": group.lost_records,
        "skipped_by_cause": causes(group.skipped),
        "missed_by_cause": causes(group.missed),
        "lateness_ns": percentiles(group.lateness),
        "execution_ns": percentiles(group.execution),
        "period_error_ns": percentiles(group.period_error),
        "jitter_ns": percentiles(group.jitter),
        "busy_ns": group.busy.0,
    })
}

fn causes(counts: SlipCounts) -> Value {
    Value::Object(counts.iter().map(|(cause, count)| (cause_name(cause).to_owned(), json!(count))).collect())
}

fn percentiles<T: Into<Value>>(p: Percentiles<T>) -> Value {
    let p = p.map(Into::into);
    json!({ "count": p.count, "p50": p.p50, "p90": p.p90, "p99": p.p99, "p999": p.p999, "max": p.max })
}

fn event(event: &TextEvent) -> Value {
    json!({ "t_s": event.time.as_secs_f64(), "level": event.level.name(), "message": event.message })
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate::log::{Analysis, LogRecord};
    use palpate::runtime::Nanos;
    use palpate::runtime::TickTiming;

    #[test]
    fn integers_survive_beyond_the_precision_of_doubles() {
        let mut analysis = Analysis::default();
        let end = Nanos((1 << 53) + 1);
        analysis.push(&LogRecord::Tick(TickTiming { end, deadline: end, ..TickTiming::default() }));
        let value: Value = serde_json::from_str(&document(&analysis.report()).to_string()).unwrap();
        assert_eq!(value["groups"][0]["execution_ns"]["max"], json!((1_u64 << 53) + 1));
        assert_eq!(value["groups"][0]["missed_by_cause"]["unattributed"], json!(0));
        assert_eq!((&value["damage"], &value["verdict"]), (&Value::Null, &json!("OK")));
    }
}
