//! What the three programs share: interleaved timing, percentiles of pooled samples, tables.
//!
//! The host of a virtual machine takes its cores away now and then and changes their speed. So nothing is compared
//! across invocations: the contestants take turns, A B C A B C ..., each ratio is taken between neighbours in time, and
//! the table shows the median over the rounds.

use palpate_runtime::GraphError;
use palpate_runtime::{Execution, Outcome, RateGroup, Runtime, actor_fn};
use palpate_runtime::Nanos;
use std::hint::black_box;
use std::time::{Duration, Instant};

/// One thing to be measured: its name, and a closure that does it so many times and returns how long that took.
pub struct Contestant<'a> {
    /// The name in the table.
    pub name: &'static str,
    /// Does it `count` times.
    pub run: Box<dyn FnMut(u32) -> Duration + 'a>,
}

impl<'a> Contestant<'a> {
    /// Repeats `once`; its result counts as used.
    pub fn repeat<R>(name: &'static str, mut once: impl FnMut() -> R + 'a) -> Self {
        let run = move |count| {
            let start = Instant::now();
            for _ in 0..count {
                black_box(once());
            }
            start.elapsed()
        };
        Self { name, run: Box::new(run) }
    }
}

/// The medians over the rounds for one contestant.
#[derive(Clone, Debug)]
pub struct Line {
    /// The name of the contestant.
    pub name: &'static str,
    /// Time of one repetition (ns).
    pub time_ns: f64,
    /// Its time over that of the contestant in place 1, the rival, in the same round.
    pub ratio: f64,
}

/// How long and how often to measure.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    /// Turns that each contestant gets.
    pub rounds: u32,
    /// How long a turn is meant to last.
    pub turn: Duration,
}

impl Effort {
    /// The effort of the published tables, or with `--smoke` just enough to see that everything runs.
    pub fn from_arguments() -> Self {
        if smoke() {
            Self { rounds: 2, turn: Duration::from_micros(200) }
        } else {
            Self { rounds: 101, turn: Duration::from_millis(2) }
        }
    }
}

/// True if the program was called with `--smoke`.
pub fn smoke() -> bool {
    std::env::args().any(|argument| argument == "--smoke")
}

/// Lets the contestants take turns. Place 0 is palpate, place 1 the rival that the ratios refer to.
pub fn compete(effort: Effort, mut contestants: Vec<Contestant>) -> Vec<Line> {
    // All repeat equally often, so that the rounds are alike: as often as the rival can in one turn.
    let mut count = 16;
    while (0..3).map(|_| (contestants[1].run)(count)).min() < Some(effort.turn) {
        count *= 2;
    }
    let mut times = vec![Vec::new(); contestants.len()];
    for round in 0..effort.rounds as usize {
        // Nobody always comes first.
        for turn in 0..contestants.len() {
            let place = (round + turn) % contestants.len();
            times[place].push((contestants[place].run)(count).as_secs_f64() * 1e9 / f64::from(count));
        }
    }
    let rival = times[1].clone();
    let line = |(contestant, times): (&Contestant, &Vec<f64>)| Line {
        name: contestant.name,
        time_ns: median(times.clone()),
        ratio: median(times.iter().zip(&rival).map(|(time, rival)| time / rival).collect()),
    };
    contestants.iter().zip(&times).map(line).collect()
}

/// How many cores there are.
pub fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// Runs both at once, each on a core of its own with a real-time priority where that is granted, so that a busy machine
/// disturbs them little. Returns when both are done.
///
/// # Errors
/// What the runtime says if it cannot run them.
pub fn on_two_cores(
    first: impl FnOnce() + Send + 'static,
    second: impl FnOnce() + Send + 'static,
) -> Result<(), GraphError> {
    let mut graph = Runtime::builder(Execution::Threaded);
    let mut group = |core: usize, work: Box<dyn FnOnce() + Send>| {
        let mut work = Some(work);
        let actor = actor_fn("work", move |_| {
            work.take().map_or(Outcome::Continue, |work| {
                work();
                Outcome::Continue
            })
        });
        graph.group(RateGroup::hz(1).pin(core).realtime(50), vec![actor]);
    };
    group(0, Box::new(first));
    group(1, Box::new(second));
    let running = graph.until(Nanos::ZERO).build()?.start()?;
    running.wait_for(Duration::MAX);
    let fault = running.stop().fault;
    assert_eq!(fault, None, "a hand-over went wrong");
    Ok(())
}

/// The middle value.
///
/// # Panics
/// If there is none.
pub fn median(values: Vec<f64>) -> f64 {
    percentile(&sorted(values), 50.0)
}

/// Sorts.
pub fn sorted(mut values: Vec<f64>) -> Vec<f64> {
    values.sort_by(f64::total_cmp);
    values
}

/// The nearest-rank percentile: the smallest of the sorted values that `percent` of them do not exceed.
///
/// # Panics
/// If there is none.
pub fn percentile(sorted: &[f64], percent: f64) -> f64 {
    let rank = (percent / 100.0 * sorted.len() as f64).ceil() as usize;
    sorted[rank.clamp(1, sorted.len()) - 1]
}

/// Prints the head of a table of [`Line`]s.
pub fn print_head() {
    println!("| what | size | contestant | time (ns) | ratio | target |");
    println!("| --- | ---: | --- | ---: | ---: | --- |");
}

/// Prints a row per contestant; `target` is the largest ratio that palpate, in place 0, is meant to have.
pub fn print_lines(what: &str, size: &str, lines: &[Line], target: Option<f64>) {
    for (place, line) in lines.iter().enumerate() {
        let verdict = match target {
            Some(target) if place == 0 => verdict(line.ratio, target),
            _ => String::new(),
        };
        println!("| {what} | {size} | {} | {:.1} | {:.2} | {verdict} |", line.name, line.time_ns, line.ratio);
    }
}

/// `<= TARGET: met` or `<= TARGET: missed`.
pub fn verdict(value: f64, target: f64) -> String {
    format!("<= {target}: {}", if value <= target { "met" } else { "missed" })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_nearest_ranks() {
        let values = sorted((1..=200).rev().map(f64::from).collect());
        assert_eq!([0.0, 50.0, 99.0, 99.9, 100.0].map(|p| percentile(&values, p)), [1.0, 100.0, 198.0, 200.0, 200.0]);
        assert_eq!(median(vec![3.0, 1.0, 2.0]), 2.0);
    }

    #[test]
    fn ratios_are_taken_between_turns_of_one_round() {
        let fixed = |name, ns: u64| {
            let mut turn = 0;
            // A machine that becomes slower from turn to turn.
            let run = move |count: u32| {
                turn += 1;
                Duration::from_nanos(u64::from(count) * ns * turn * 1000)
            };
            Contestant { name, run: Box::new(run) }
        };
        let effort = Effort { rounds: 11, turn: Duration::ZERO };
        let lines = compete(effort, vec![fixed("we", 2), fixed("rival", 4)]);
        assert_eq!(lines[1].ratio, 1.0);
        // Check that the drift cancels, but for the three turns by which the rival's count was found
        assert!((0.3..=0.5).contains(&lines[0].ratio), "{}", lines[0].ratio);
    }
}
