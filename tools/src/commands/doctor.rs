//! `palpate doctor`: is this machine ready for real time, and what is to be done?

use palpate::report::Page;
use palpate::runtime::{Plan, Readiness};
use palpate::scene::Scene;
use palpate::{Error, Session};

use super::shared;
use crate::units::plural;

/// Prints what real time needs of a machine, and how it stands there.
///
/// # Errors
/// If standard output cannot be written.
pub fn run() -> Result<(), Error> {
    // What a run of this scene asks for is what every run at 1 kHz asks for.
    let plan = Session::from_scene(Scene::demo()).build()?.plan()?;
    shared::print(&diagnosis(&plan))
}

fn diagnosis(plan: &Plan) -> String {
    let mut page = Page::default();
    let count = |state| plan.machine.iter().filter(|finding| finding.state == state).count();
    let (lacks, unknown) = (count(Readiness::Missing), count(Readiness::Unknown));
    let refused = plan.missing.len();
    page.paragraph(&match (refused, lacks, unknown) {
        (0, 0, 0) => "READY: everything that real time needs is there".to_owned(),
        (0, 0, _) => {
            let points = plural(unknown as u64, "point is", "points are");
            format!("READY: as far as the system says, {points} unknown")
        }
        (0, _, _) => "USABLE: every privilege is granted; on a machine that does other work too, the tail of the lateness is longer than it need be".to_owned(),
        _ => "LIMITED: the system refuses privileges; runs go on without, with more lateness, and their reports say so".to_owned(),
    });
    page.line(String::new());
    for refusal in &plan.missing {
        page.named("refused", refusal);
    }
    for finding in &plan.machine {
        let state = match finding.state {
            Readiness::Ready => "ready",
            Readiness::Missing => "missing",
            Readiness::Unknown => "unknown",
        };
        page.named(state, &format!("{}: {}", finding.name, finding.found));
        if finding.state == Readiness::Missing {
            page.named("  to do", finding.remedy);
        }
    }
    page.line(String::new());
    page.line("docs/realtime.md explains each; palpate run SCENE --plan is for one scene".to_owned());
    page.text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_finding_is_told_and_what_is_missing_has_its_remedy() {
        let mut plan = Session::from_scene(Scene::demo()).build().unwrap().plan().unwrap();
        plan.missing = vec!["SCHED_FIFO 80 is refused: see ulimit -r".to_owned()];
        let text = diagnosis(&plan);
        assert!(text.starts_with("LIMITED: ") && text.contains("refused    SCHED_FIFO 80 is refused"), "{text}");
        assert!(text.lines().all(|line| line.chars().count() <= 80), "{text}");
        assert!(plan.machine.len() > 5);
        let guide = include_str!("../../../docs/realtime.md").to_lowercase();
        for finding in &plan.machine {
            assert!(guide.contains(&format!("\n### {}\n", finding.name.to_lowercase())), "no section {}", finding.name);
            assert!(text.contains(finding.name), "{text}");
            let first = finding.remedy.split(' ').next().unwrap();
            assert!(finding.state != Readiness::Missing || text.contains(first), "{text}");
        }
        plan.missing.clear();
        plan.machine.iter_mut().for_each(|finding| finding.state = Readiness::Ready);
        assert!(diagnosis(&plan).starts_with("READY: everything"));
        plan.machine[1].state = Readiness::Unknown;
        assert!(diagnosis(&plan).starts_with("READY: as far as the system says, 1 point is unknown\n"));
    }
}
