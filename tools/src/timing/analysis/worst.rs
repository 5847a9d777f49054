//! The ticks that kept everybody waiting longest, each with what was going on around it.
//!
//! How bad a tick was is how long its work was overdue in periods of its deadline: from when the first of the periods that
//! it stands for was due (its own, or the first that was skipped before it) until it was done. One is just in time.

use palpate::runtime::Nanos;
use palpate::runtime::{SlipCause, TickTiming};

use super::recent::{ForcePoint, Moment, Recent, is_of};

/// How many are kept.
const KEPT: usize = 10;
/// Candidates whose surroundings have not passed, at most.
const MOST_WAITING: usize = 64;
/// A group is out of trouble after so many good releases; good ones are compared in parcels of as many.
const CALM: u64 = 4;
/// Periods on each side that belong to a moment, and their limits.
const PERIODS_AROUND: u64 = 12;
const LEAST_AROUND: Nanos = Nanos(15_000_000);
const MOST_AROUND: Nanos = Nanos(200_000_000);

/// One of the worst ticks of a log, the worst of its episode: a row of releases that slipped or missed their deadline.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct WorstTick {
    /// The name of its group.
    pub group: String,
    /// The tick.
    pub timing: TickTiming,
    /// Its period.
    pub period: Nanos,
    /// From when the first period that it stands for was due until its work was done.
    pub overdue: Nanos,
    /// Time overdue in deadlines: above one the tick was too late.
    pub severity: f64,
    /// Why; [`SlipCause::None`] if it was in time.
    pub cause: SlipCause,
    /// Time that each actor of the group took of the tick, by name.
    pub actors: Vec<(String, Nanos)>,
    /// Other groups that were at work while it was overdue and not yet running.
    pub meanwhile: Vec<String>,
    /// The largest change of a force, after the safety pipeline where the log says, from one haptic tick to the next within the
    /// time it was overdue and two ticks (N).
    pub force_step_n: Option<f64>,
    /// Its neighbours in all groups, and the force.
    pub moment: Moment,
}

impl WorstTick {
    /// True if it slipped or missed its deadline.
    pub fn is_trouble(&self) -> bool {
        self.timing.missed() || self.timing.slips > 0
    }
}

/// A tick that may be among the worst, and whose surroundings are not all known yet.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    timing: TickTiming,
    period: Nanos,
    episode: u64,
    severity: f64,
}

impl Candidate {
    fn first_due(&self) -> Nanos {
        let skipped = self.period.0.saturating_mul(self.timing.slips.into());
        self.timing.scheduled.saturating_sub(Nanos(skipped))
    }

    fn around(&self) -> [Nanos; 2] {
        let periods = Nanos(self.period.0.saturating_mul(PERIODS_AROUND));
        let around = periods.clamp(LEAST_AROUND, MOST_AROUND);
        [self.first_due().saturating_sub(around), self.timing.end.max(self.timing.woke) + around]
    }

    fn is_of_the_same_episode(&self, other: &Self) -> bool {
        (self.timing.group, self.episode) == (other.timing.group, other.episode)
    }
}

/// Where a group is between good and bad.
#[derive(Clone, Copy, Debug, Default)]
struct Course {
    episode: u64,
    /// The last release in trouble.
    trouble: Option<u64>,
    /// Good releases in this parcel.
    good: u64,
}

/// Finds the worst ticks in one pass.
#[derive(Clone, Debug, Default)]
pub(super) struct Worst {
    courses: Vec<Course>,
    waiting: Vec<Candidate>,
    found: Vec<(Candidate, Moment)>,
}

impl Worst {
    /// A release of a group with this period was read; `recent` holds it already.
    pub(super) fn push(&mut self, timing: &TickTiming, period: Nanos, recent: &Recent) {
        self.look_back(timing.scheduled, recent);
        let episode = self.episode(timing);
        let mut candidate = Candidate { timing: *timing, period, episode, severity: 0.0 };
        let deadline = timing.deadline.saturating_sub(timing.scheduled).0.max(1);
        let overdue = timing.end.saturating_sub(candidate.first_due());
        candidate.severity = overdue.0 as f64 / deadline as f64;
        if candidate.severity <= self.bar(&candidate) {
            return;
        }
        self.waiting.retain(|other| !other.is_of_the_same_episode(&candidate));
        self.waiting.push(candidate);
        // Times that never pass, as a foreign log may have, must not pile up.
        if self.waiting.len() > MOST_WAITING {
            let first = self.waiting.remove(0);
            self.keep(first, recent);
        }
    }

    /// The worst first; `name` names groups and `actor` their actors.
    pub(super) fn report(
        mut self,
        recent: &Recent,
        name: impl Fn(u16) -> String,
        actor: impl Fn(u16, usize) -> String,
    ) -> Vec<WorstTick> {
        self.look_back(Nanos(u64::MAX), recent);
        let describe = |(candidate, moment)| describe(candidate, moment, &name, &actor);
        self.found.into_iter().map(describe).collect()
    }

    /// What a tick must exceed: the worst of its own episode so far, and the last that is kept.
    fn bar(&self, candidate: &Candidate) -> f64 {
        let found = self.found.iter().map(|(found, _)| found);
        let own = found.chain(&self.waiting).filter(|other| other.is_of_the_same_episode(candidate));
        let last =
            if self.found.len() < KEPT { 0.0 } else { self.found.last().map_or(0.0, |(found, _)| found.severity) };
        own.map(|other| other.severity).fold(last, f64::max)
    }

    fn episode(&mut self, timing: &TickTiming) -> u64 {
        let group = usize::from(timing.group);
        if group >= self.courses.len() {
            self.courses.resize_with(group + 1, Course::default);
        }
        let course = &mut self.courses[group];
        // What was skipped is no calm.
        let after = |trouble: u64| timing.tick.saturating_sub(trouble.saturating_add(timing.slips.into()));
        let calm = course.trouble.is_none_or(|trouble| after(trouble) > CALM);
        match (timing.missed() || timing.slips > 0, calm) {
            (true, true) => {
                (course.episode, course.trouble) = (course.episode + 1, Some(timing.tick));
            }
            (true, false) => course.trouble = Some(timing.tick),
            (false, false) => {}
            (false, true) => {
                if course.trouble.take().is_some() || course.good.is_multiple_of(CALM) {
                    (course.episode, course.good) = (course.episode + 1, 0);
                }
                course.good += 1;
            }
        }
        course.episode
    }

    /// Keeps the candidates whose surroundings have passed at `now`.
    fn look_back(&mut self, now: Nanos, recent: &Recent) {
        let waiting = std::mem::take(&mut self.waiting);
        let (ready, waiting): (Vec<_>, Vec<_>) = waiting.into_iter().partition(|one| one.around()[1] < now);
        self.waiting = waiting;
        ready.into_iter().for_each(|candidate| self.keep(candidate, recent));
    }

    fn keep(&mut self, candidate: Candidate, recent: &Recent) {
        let [from, to] = candidate.around();
        self.found.retain(|(other, _)| !other.is_of_the_same_episode(&candidate));
        let place = self.found.partition_point(|(other, _)| other.severity >= candidate.severity);
        self.found.insert(place, (candidate, recent.between(from, to)));
        self.found.truncate(KEPT);
    }
}

fn describe(
    candidate: Candidate,
    moment: Moment,
    name: impl Fn(u16) -> String,
    actor: impl Fn(u16, usize) -> String,
) -> WorstTick {
    let Candidate { timing, period, severity, .. } = candidate;
    let first_due = candidate.first_due();
    let is_trouble = timing.missed() || timing.slips > 0;
    let spent = moment.actors.iter().find(|times| is_of(times, &timing)).map_or(&[][..], |times| times.spent());
    let at_work = |tick: &&TickTiming| {
        tick.group != timing.group && tick.start < timing.woke && tick.end > first_due && tick.end > tick.start
    };
    let mut meanwhile: Vec<String> = moment.ticks.iter().filter(at_work).map(|tick| name(tick.group)).collect();
    meanwhile.dedup();
    WorstTick {
        group: name(timing.group),
        timing,
        period,
        overdue: timing.end.saturating_sub(first_due),
        severity,
        cause: if is_trouble { timing.cause } else { SlipCause::None },
        actors: spent.iter().enumerate().map(|(number, spent)| (actor(timing.group, number), *spent)).collect(),
        meanwhile,
        force_step_n: force_step(&moment, first_due, timing.end + Nanos(2 * period.0.min(MOST_AROUND.0))),
        moment,
    }
}

/// The largest change of a force from one sample to the next that ends between two times.
fn force_step(moment: &Moment, from: Nanos, to: Nanos) -> Option<f64> {
    let step = |pair: &[&ForcePoint]| {
        // What the hand feels comes after the safety pipeline.
        let [a, b] = [0, 1].map(|n| pair[n].commanded_n.unwrap_or(pair[n].force_n));
        let squares: f64 = a.iter().zip(b).map(|(a, b)| (b - a) * (b - a)).sum();
        (from..=to).contains(&pair[1].time).then(|| squares.sqrt())
    };
    let devices: std::collections::BTreeSet<u16> = moment.forces.iter().map(|point| point.device).collect();
    let steps = devices.into_iter().flat_map(|device| {
        let points: Vec<_> = moment.forces.iter().filter(|point| point.device == device).collect();
        points.windows(2).filter_map(step).collect::<Vec<_>>()
    });
    steps.filter(|step| step.is_finite()).reduce(f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: u64 = 1_000_000;

    fn tick(tick: u64, late: u64, work: u64, slips: u32, cause: SlipCause) -> TickTiming {
        let scheduled = Nanos(tick * MS);
        let woke = scheduled + Nanos(late);
        let (end, deadline) = (woke + Nanos(work), scheduled + Nanos(MS));
        TickTiming { tick, scheduled, woke, start: woke, end, deadline, slips, cause, ..TickTiming::default() }
    }

    fn worst(ticks: impl IntoIterator<Item = TickTiming>) -> Vec<WorstTick> {
        let (mut recent, mut worst) = (Recent::default(), Worst::default());
        for tick in ticks {
            recent.push_tick(&tick);
            worst.push(&tick, Nanos(MS), &recent);
        }
        worst.report(&recent, |group| format!("g{group}"), |_, actor| format!("a{actor}"))
    }

    // Check that an episode gives one tick, its worst, with the neighbours on both sides, and that the order is right.
    #[test]
    fn each_episode_gives_its_worst_tick_with_its_neighbours() {
        let good = |n: u64| tick(n, n * 7919 % 1000, 10_000, 0, SlipCause::None);
        let ticks = (0..5000).filter_map(|n| match n {
            1000 => Some(tick(n, 100, 5 * MS + 50, 0, SlipCause::LongTick)),
            1001..=1004 => None,
            1005 => Some(tick(n, 200, 10_000, 4, SlipCause::LongTick)),
            3000..=3006 => None,
            3007 => Some(tick(n, 900_000, 10_000, 7, SlipCause::LateWake)),
            _ => Some(good(n)),
        });
        let found = worst(ticks);
        assert_eq!(found.len(), KEPT);
        let of = |n: usize| (found[n].timing.tick, found[n].cause, found[n].is_trouble());
        assert_eq!(of(0), (3007, SlipCause::LateWake, true));
        assert_eq!(of(1), (1000, SlipCause::LongTick, true));
        assert!(found[2..].iter().all(|found| !found.is_trouble() && found.severity < 0.1));
        assert_eq!(found[0].overdue, Nanos(7 * MS + 910_000));
        assert!((found[0].severity - 7.91).abs() < 1e-9);
        let around: Vec<u64> = found[0].moment.ticks.iter().map(|tick| tick.tick).collect();
        assert!(around.starts_with(&[2985, 2986]) && around.ends_with(&[3021, 3022]), "{around:?}");
        assert!(found.windows(2).all(|pair| pair[0].severity >= pair[1].severity));
    }

    #[test]
    fn what_ran_meanwhile_is_named_and_a_perfect_run_has_no_worst_tick() {
        let busy =
            TickTiming { group: 1, end: Nanos(5 * MS), deadline: Nanos(33 * MS), ..tick(0, 0, 0, 0, SlipCause::None) };
        let late = tick(4, 900_000, 10, 3, SlipCause::LateWake);
        let found = worst([busy, tick(0, 0, 5, 0, SlipCause::None), late]);
        assert_eq!((found[0].timing.tick, &found[0].meanwhile[..]), (4, &["g1".to_owned()][..]));
        assert_eq!(worst((0..100).map(|n| tick(n, 0, 0, 0, SlipCause::None))), []);
    }

    #[test]
    fn the_step_of_the_force_is_that_at_the_tick() {
        let point = |ms: u64, device, x| ForcePoint {
            time: Nanos(ms * MS),
            device,
            force_n: [x, 0.0, 0.0],
            ..Default::default()
        };
        let forces = vec![point(1, 0, 0.0), point(2, 0, 5.0), point(3, 0, 5.5), point(3, 1, 9.0), point(9, 0, 5.0)];
        let moment = Moment { forces, ..Moment::default() };
        assert_eq!(force_step(&moment, Nanos(3 * MS), Nanos(8 * MS)), Some(0.5));
        assert_eq!(force_step(&moment, Nanos(20 * MS), Nanos(30 * MS)), None);
    }
}
