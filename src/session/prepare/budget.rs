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

/// Declares the budget of the group that evaluates the whole body's forces, if the program gave none; `evaluation` is one
/// of them.
///
/// # Errors
/// If the least that was measured is above the group's period.
pub(super) fn declare(
    evaluation: impl FnOnce() -> Nanos,
    nodes: usize,
    timing: Timing,
    kind: Kind,
    [local, global]: [RateGroup; 2],
) -> Result<[RateGroup; 2], Error> {
    let at_work = if kind == Kind::Full { &local } else { &global };
    if at_work.declared_budget().is_some() {
        return Ok([local, global]);
    }
    let cost = Cost { evaluation: evaluation(), timing, nodes, kind };
    let budget = cost.budget(at_work)?;
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
    /// What a release of `group` takes at least, if that is within its period.
    fn budget(&self, group: &RateGroup) -> Result<Nanos, Error> {
        let Timing { haptic, substeps, stride, .. } = self.timing;
        let stride = if self.kind == Kind::Full { 1 } else { stride };
        let ticks = haptic.as_hz() / group.rate().as_hz();
        let evaluations = f64::from(substeps) / f64::from(stride) * ticks;
        // A budget of zero would be refused, and a clock can be that coarse.
        let budget = Nanos::from_secs_f64(self.evaluation.as_secs_f64() * evaluations).max(Nanos(1));
        let period = group.rate().period();
        if budget <= period {
            return Ok(budget);
        }
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
        Err(Error::scene(place, message))
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
        let budget = cost(100, Kind::Hold).budget(&RateGroup::hz(40)).unwrap();
        assert_eq!(budget, Nanos(5_000_000));
        assert_eq!(cost(100, Kind::Full).budget(&RateGroup::hz(1000)).unwrap(), Nanos(200_000));
    }

    #[test]
    fn what_cannot_fit_is_refused_with_the_sum_and_what_would_fit() {
        let error = cost(1000, Kind::Hold).budget(&RateGroup::hz(40)).unwrap_err().to_string();
        for words in
            ["body: ", "50.0 ms", "50.0 force evaluations of 1.00 ms", "25.0 ms", "about 500 of 1000", "--virtual"]
        {
            assert!(error.contains(words), "{words:?} is not in {error}");
        }
        let error = cost(1000, Kind::Full).budget(&RateGroup::hz(1000)).unwrap_err().to_string();
        for words in ["local.model: ", "2.00 ms", "another local model", "about 500 of 1000"] {
            assert!(error.contains(words), "{words:?} is not in {error}");
        }
    }
}
