//! What a body costs on this machine, measured before a threaded run: a scene that cannot keep its rates is refused.

use std::time::{Duration, Instant};

use super::timing::Timing;
use crate::error::Error;
use crate::model::Vec3;
use crate::model::body::{Body, State};
use crate::model::local::Kind;
use crate::report::Quantity;
use crate::runtime::{Nanos, RateGroup};

/// Evaluations at most, and the time after which no other is begun: the least of several is what the machine can do when
/// nothing else disturbs it.
const EVALUATIONS: u32 = 16;
const ENOUGH: Duration = Duration::from_millis(20);
/// A body that would be refused is measured so many times more, each after a pause, as something else may have been at work; unless it
/// is so many times too slow.
const AGAIN: u32 = 10;
const PAUSE: Duration = Duration::from_millis(50);
const HOPELESS: u64 = 4;

/// Declares the budget of the group that evaluates the whole body's forces, if the program gave none. `measured` is what one of them
/// takes, where that is known, and `measure` looks.
///
/// # Errors
/// If the least that was measured is above the group's period.
pub(super) fn declare(
    measured: Option<Nanos>,
    mut measure: impl FnMut() -> Nanos,
    (nodes, timing, kind): (usize, Timing, Kind),
    [local, global]: [RateGroup; 2],
) -> Result<[RateGroup; 2], Error> {
    let at_work = if kind == Kind::Full { &local } else { &global };
    if at_work.declared_budget().is_some() {
        return Ok([local, global]);
    }
    let period = at_work.rate().period();
    let mut cost = Cost { evaluation: measured.unwrap_or_else(&mut measure), timing, nodes, kind };
    for _ in 0..AGAIN {
        let budget = cost.budget(at_work);
        if budget <= period || budget.0 > HOPELESS * period.0 {
            break;
        }
        std::thread::sleep(PAUSE);
        cost.evaluation = cost.evaluation.min(measure());
    }
    let budget = cost.budget(at_work);
    if budget > period {
        return Err(cost.refusal(at_work));
    }
    Ok(match kind {
        Kind::Full => [local.budget(budget), global],
        _ => [local, global.budget(budget)],
    })
}

/// The least time that one evaluation of all forces takes.
pub(super) fn force_evaluation(body: &mut dyn Body, state: &State) -> Nanos {
    let mut forces = vec![Vec3::zeros(); state.positions.len()];
    let (start, mut least) = (Instant::now(), Duration::MAX);
    for _ in 0..EVALUATIONS {
        let begun = Instant::now();
        body.forces(state, &mut forces);
        least = least.min(begun.elapsed());
        if start.elapsed() > ENOUGH {
            break;
        }
    }
    Nanos::from_duration(least)
}

struct Cost {
    /// One evaluation of all forces.
    evaluation: Nanos,
    timing: Timing,
    nodes: usize,
    kind: Kind,
}

impl Cost {
    /// Evaluations in a release of `group`.
    fn evaluations(&self, group: &RateGroup) -> f64 {
        let Timing { haptic, substeps, stride, .. } = self.timing;
        let stride = if self.kind == Kind::Full { 1 } else { stride };
        f64::from(substeps) / f64::from(stride) * haptic.as_hz() / group.rate().as_hz()
    }

    /// What a release of `group` takes at least.
    fn budget(&self, group: &RateGroup) -> Nanos {
        // A budget of zero would be refused, and a clock can be that coarse.
        Nanos::from_secs_f64(self.evaluation.as_secs_f64() * self.evaluations(group)).max(Nanos(1))
    }

    /// What is said of a body that does not fit the period of `group`.
    fn refusal(&self, group: &RateGroup) -> Error {
        let (evaluations, budget, period) = (self.evaluations(group), self.budget(group), group.rate().period());
        let fits = (self.nodes as f64 * period.as_secs_f64() / budget.as_secs_f64()) as usize;
        let (place, what, other) = match self.kind {
            Kind::Full => ("local.model", "a haptic tick of `full`", "another local model, "),
            _ => ("body", "a period of the global model", ""),
        };
        let message = format!(
            "{what} takes at least {} on this machine ({evaluations:.1} force evaluations of {}) and its period is {}: use \
             {other}fewer nodes (about {fits} of {} fit) or virtual time (--virtual)",
            Quantity::Nanoseconds(budget.0),
            Quantity::Nanoseconds(self.evaluation.0),
            Quantity::Nanoseconds(period.0),
            self.nodes,
        );
        Error::scene(place, message)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::runtime::Rate;

    fn cost(evaluation_us: u64, kind: Kind) -> Cost {
        let timing = Timing { haptic: Rate::hz(1000), global: Rate::hz(40), substeps: 2, stride: 1, horizon: 32 };
        Cost { evaluation: Nanos(evaluation_us * 1000), timing, nodes: 1000, kind }
    }

    #[test]
    fn a_global_period_takes_the_substeps_of_its_haptic_ticks() {
        let budget = cost(100, Kind::Hold).budget(&RateGroup::hz(40));
        assert_eq!(budget, Nanos(5_000_000));
        assert_eq!(cost(100, Kind::Full).budget(&RateGroup::hz(1000)), Nanos(200_000));
    }

    #[test]
    fn what_cannot_fit_is_refused_with_the_sum_and_what_would_fit() {
        let error = cost(1000, Kind::Hold).refusal(&RateGroup::hz(40)).to_string();
        for words in
            ["body: ", "50.0 ms", "50.0 force evaluations of 1.00 ms", "25.0 ms", "about 500 of 1000", "--virtual"]
        {
            assert!(error.contains(words), "{words:?} is not in {error}");
        }
        let error = cost(1000, Kind::Full).refusal(&RateGroup::hz(1000)).to_string();
        for words in ["local.model: ", "2.00 ms", "another local model", "about 500 of 1000"] {
            assert!(error.contains(words), "{words:?} is not in {error}");
        }
    }

    #[test]
    fn a_body_is_refused_only_if_it_stays_too_slow_and_at_once_if_it_is_hopeless() {
        let groups = || [RateGroup::hz(1000), RateGroup::hz(40)];
        let of = |costs_us: &[u64]| {
            let (mut costs, mut looks) = (costs_us.iter().copied(), 0);
            let measure = || {
                looks += 1;
                Nanos(1000 * costs.next().unwrap_or(costs_us[costs_us.len() - 1]))
            };
            let timing = cost(0, Kind::Hold).timing;
            let declared = declare(None, measure, (1000, timing, Kind::Hold), groups());
            (declared.ok().and_then(|[_, global]| global.declared_budget()), looks)
        };
        assert_eq!(of(&[100, 90]), (Some(Nanos(5_000_000)), 1));
        assert_eq!(of(&[700, 800, 400, 100]), (Some(Nanos(20_000_000)), 3), "50 evaluations in 25 ms");
        assert_eq!(of(&[700]), (None, 1 + AGAIN));
        assert_eq!(of(&[5000, 100]), (None, 1));
    }
}
