//! What a run did to the force.

use super::page::Page;
use crate::log::{DeviceReport, Percentiles, RunReport};
use crate::report::units::{force, seconds};

/// Resyncs, model age, contact, force, energy and limits of one device.
pub fn haptics(page: &mut Page, run: &RunReport, report: &DeviceReport) {
    if run.devices.len() > 1 {
        page.named("DEVICE", report.name.clone());
    }
    let resyncs = &report.resyncs;
    page.named("resyncs", resyncs.jump_before_n.count.to_string());
    if resyncs.jump_before_n.count > 0 {
        let of = |p: Percentiles<f64>, show: fn(f64) -> String| {
            format!("p50 {:>9}   p99 {:>9}   max {:>9}", show(p.p50), show(p.p99), show(p.max))
        };
        page.named("  jump", format!("before blending  {}", of(resyncs.jump_before_n, force)));
        page.named("", format!("after blending   {}", of(resyncs.jump_after_n, force)));
        page.named("  age", format!("on arrival       {}", of(resyncs.age_ns.map(|ns| ns as f64 / 1e9), seconds)));
        page.named("", format!("at each tick     {}", of(report.force.model_age_s, seconds)));
    }
    let shares: Vec<String> =
        report.force.shares().map(|(model, share)| format!("{} {:.2} %", model.name(), 100.0 * share)).collect();
    if !shares.is_empty() {
        page.named("served by", shares.join(", "));
    }
    let contact = report.contact;
    page.named(
        "contact",
        format!(
            "free {}, stick {}, slip {}, lost {} (haptic ticks)",
            contact.free, contact.stick, contact.slip, contact.lost
        ),
    );
    let not_finite = match report.force.not_finite {
        0 => String::new(),
        count => format!(", {count} not finite"),
    };
    page.named(
        "force",
        format!("peak {}, commanded {}{not_finite}", force(report.force.peak_n), force(report.force.peak_commanded_n)),
    );
    if report.limits.ticks > 0 {
        let energy = report.limits.energy;
        let [least, last, tank] = [energy.least_j, energy.last_j, energy.least_tank_j].map(|j| 1e3 * j);
        page.named("energy", format!("ledger least {least:.3} mJ, end {last:.3} mJ; tank least {tank:.3} mJ"));
    }
    if report.limits.limited > 0 {
        let stages = report.limits.stages.iter().map(|(name, count)| format!("{name} {count}"));
        let share = 100.0 * report.limits.share();
        page.wrapped("limits", &format!("{} ({share:.2} % of ticks)", stages.collect::<Vec<_>>().join(", ")));
    }
}
