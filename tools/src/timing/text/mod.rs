//! The timing of a run for a terminal: the report of the run, with processor cores and the worst ticks.

mod against;
mod worst;

pub use self::against::{against_to_text, figure_to_text};
pub(super) use self::worst::in_words;
use palpate::report::Page;

use super::{CoreUse, TimingReport};

/// The timing of a run in detail as text, every line ended by a newline.
pub fn timing_to_text(report: &TimingReport) -> String {
    let run = &report.run;
    let mut page = Page::default();
    page.head(run);
    worst::sentence(&mut page, report);
    page.about(run);
    page.line(String::new());
    page.groups(run);
    cores(&mut page, &report.cores);
    page.line(String::new());
    for device in run.devices.iter().filter(|device| !device.is_empty()) {
        page.haptics(run, device);
    }
    page.events(run);
    worst::table(&mut page, report);
    page.text
}

/// How much of each core the groups used.
fn cores(page: &mut Page, cores: &[CoreUse]) {
    for (i, core) in cores.iter().enumerate() {
        let on = core.cpu.map_or("any".to_owned(), |cpu| format!("cpu {cpu}"));
        let groups: Vec<String> =
            core.groups.iter().map(|(group, share)| format!("{group} {:.1} %", 100.0 * share)).collect();
        page.named(if i == 0 { "cores" } else { "" }, &format!("{on}: {}", groups.join(", ")));
    }
}
