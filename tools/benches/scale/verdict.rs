//! Which model a body fits, on one core for the haptic group and one for the global group.

use palpate::runtime::Nanos;

use crate::common::{figure, table, us};
use crate::costs::Costs;

/// Ticks of a late model and of the old one in one haptic tick while it catches up.
const CATCH_UP: u64 = 9;

/// Whether a thing fits, and by how much.
struct Share(f64);

impl Share {
    fn fits(&self) -> bool {
        self.0 <= 1.0
    }

    fn percent(&self) -> String {
        format!("{} %", figure(100.0 * self.0))
    }
}

fn of_period(costs: &Costs, time: Nanos) -> Share {
    Share(time.0 as f64 / costs.period().0 as f64)
}

struct Fit {
    full: Share,
    haptic: Share,
    global: Share,
    patch: Share,
    global_patch: Share,
}

impl Fit {
    fn of(costs: &Costs) -> Self {
        let catching_up = |p50: Nanos| Nanos(CATCH_UP * p50.0);
        Self {
            full: of_period(costs, costs.full[1]),
            haptic: of_period(costs, catching_up(costs.predictive[0]).max(costs.predictive[1])),
            global: Share(costs.global_load(costs.build)),
            patch: of_period(costs, catching_up(costs.patch[0]).max(costs.patch[1])),
            global_patch: Share(costs.global_load(costs.build_patch)),
        }
    }

    fn verdict(&self, costs: &Costs) -> String {
        let has_basis = costs.has_basis;
        if self.full.fits() {
            return "`full`".to_owned();
        }
        if self.haptic.fits() && self.global.fits() {
            let without = if has_basis { "" } else { " (without reduced surroundings)" };
            return format!("`predictive` on two cores{without}");
        }
        if self.patch.fits() && self.global_patch.fits() {
            return format!("`patch` on two cores; for `predictive` the global group needs {}", self.global.percent());
        }
        format!("none: the global model alone needs {} of a core", self.global_patch.percent())
    }
}

/// One line for the terminal.
pub fn line(costs: &Costs) -> String {
    row(costs).join(" | ")
}

fn row(costs: &Costs) -> Vec<String> {
    let fit = Fit::of(costs);
    vec![
        format!("{}^3", costs.nodes),
        format!("{} kHz", costs.rate * 1e-3),
        format!("{} of {} us", figure(us(costs.full[1])), figure(us(costs.period()))),
        fit.full.percent(),
        fit.haptic.percent(),
        fit.global.percent(),
        Share(costs.global_load_with_long_steps()).percent(),
        fit.global_patch.percent(),
        fit.verdict(costs),
    ]
}

/// The table of verdicts, and where the lines are.
pub fn text(all: &[Costs]) -> String {
    let heads = [
        "body",
        "rate",
        "`full` tick p99",
        "of the period",
        "`predictive` catching up, of the period",
        "its global group, of a core",
        "with the longest stable steps",
        "global group of `patch`",
        "what holds here",
    ];
    let rows: Vec<Vec<String>> = all.iter().map(row).collect();
    let mut rates: Vec<f64> = all.iter().map(|costs| costs.rate).collect();
    rates.sort_by(f64::total_cmp);
    rates.dedup();
    let lines: Vec<String> = rates.iter().map(|&rate| told(all, rate)).collect();
    format!(
        "## What holds\n\nOne core for the haptic group, one for the global one. `full` fits if its p99 fits the period of a \
         haptic tick. `predictive` fits if a haptic tick that catches up ({CATCH_UP} ticks at p50, or one at p99) fits that period \
         and the global group takes less than one core. Percentages above 100 say how many cores it would need. *With the longest stable steps* is what the global group would take \
         if its model made one step for several ticks (`ticks_per_step`) where that is stable. Device, \
         records and emptied caches of a session come on top: its ticks are in the table of errors.\n\n{}\n{}\n",
        table(&heads, 2, &rows),
        lines.join("\n")
    )
}

fn told(all: &[Costs], rate: f64) -> String {
    let at = || all.iter().filter(|costs| costs.rate == rate);
    let largest = |fits: &dyn Fn(&Fit) -> bool| {
        let last = at().filter(|costs| fits(&Fit::of(costs))).map(|costs| costs.nodes).max();
        last.map_or("none of them".to_owned(), |nodes| format!("{nodes}^3"))
    };
    let full = largest(&|fit| fit.full.fits());
    let predictive = largest(&|fit| fit.haptic.fits() && fit.global.fits());
    let mut text = format!(
        "- At {} kHz `full` carries up to {full} on one core, `predictive` up to {predictive} on two",
        rate * 1e-3
    );
    text.push_str(match at().any(|costs| {
        let fit = Fit::of(costs);
        !fit.full.fits() && fit.haptic.fits() && fit.global.fits()
    }) {
        true => ".",
        false => {
            ": the global model follows the tool with the same substeps as `full`, so that of these sizes there is none that \
             `predictive` carries and `full` does not."
        }
    });
    if let Some(first) = at().find(|costs| !Fit::of(costs).global.fits()) {
        let fit = Fit::of(first);
        text.push_str(&format!(
            " What stands in the way at {}^3 is the global group: {} of a core, {} of it for following the tool.",
            first.nodes,
            fit.global.percent(),
            Share(first.global_load(Nanos::ZERO)).percent(),
        ));
    }
    text
}
