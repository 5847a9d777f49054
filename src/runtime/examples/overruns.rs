//! What each overrun policy makes of the same mishap: one release in virtual time that works for three and a half periods.
//!
//! `cargo run --release -p palpate-runtime --example overruns`

use palpate_runtime::{
    Disturbance, Execution, GraphError, GroupMode, Nanos, Outcome, OverrunPolicy, RateGroup, Runtime, actor_fn,
};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

const MS: u64 = 1_000_000;
/// The release that takes too long, of the ten after release 0.
const LONG: u64 = 3;

fn main() -> Result<(), GraphError> {
    println!("1 kHz; release {LONG} works for 3.5 ms. Releases that ran (~ in degraded mode):\n");
    for (name, policy) in [
        ("skip", OverrunPolicy::Skip),
        ("catch up, at most 2", OverrunPolicy::CatchUp { max: 2 }),
        ("rephase", OverrunPolicy::Rephase),
        ("degrade for 2", OverrunPolicy::Degrade { recover_after: 2 }),
        ("stop", OverrunPolicy::Stop),
    ] {
        let ran = Arc::new(Mutex::new(String::new()));
        let shown = Arc::clone(&ran);
        let actor = actor_fn("work", move |ctx| {
            let mark = if ctx.mode == GroupMode::Degraded { "~" } else { "" };
            *shown.lock().unwrap_or_else(PoisonError::into_inner) += &format!(" {}{mark}", ctx.tick);
            Outcome::Continue
        });
        let mut graph = Runtime::builder(Execution::Virtual);
        graph.group(RateGroup::hz(1000).name("work").overrun(policy), vec![actor]).until(Nanos(10 * MS));
        graph.disturb("work", |release| Disturbance {
            work: if release == LONG { Nanos(3 * MS + MS / 2) } else { Nanos::ZERO },
            ..Disturbance::default()
        });
        let running = graph.build()?.start()?;
        running.wait_for(Duration::MAX);
        let report = running.stop();
        println!("{name:20}{}", ran.lock().unwrap_or_else(PoisonError::into_inner));
        for group in &report.groups {
            assert_eq!(group.released + group.skipped, group.elapsed_periods, "no period is unaccounted for");
            let causes: Vec<String> =
                group.slips.iter().filter(|(_, n)| *n > 0).map(|(cause, n)| format!("{n} {}", cause.name())).collect();
            println!("{:20} {} skipped: {}\n", "", group.skipped, causes.join(", "));
        }
    }
    Ok(())
}
