//! The picture of a graph as text: a line per group and port.

use crate::executor::Execution;
use crate::graph::view::{GraphGroup, GraphPort, GraphView};
use crate::reports::text::{measured, percent, short};
use std::fmt;

impl GraphGroup {
    /// What was asked for: rate, policy, cores, budget.
    pub(crate) fn contract(&self) -> String {
        let mut parts = vec![self.rate.to_string(), self.policy.clone()];
        match &self.cores[..] {
            [] => {}
            [core] => parts.push(format!("core {core}")),
            cores => {
                let cores: Vec<_> = cores.iter().map(usize::to_string).collect();
                parts.push(format!("cores {}", cores.join(" ")));
            }
        }
        if let Some(budget) = self.budget {
            let share = percent(budget.as_secs_f64() / self.rate.period_s());
            parts.push(format!("budget {} ({share})", short(budget)));
        }
        if self.observer {
            parts.push("observer".to_owned());
        }
        parts.join(", ")
    }

    /// What was measured, a line each: counts, lateness, work. None before a run.
    pub(crate) fn figures(&self) -> Vec<String> {
        let Some(live) = &self.measured else { return Vec::new() };
        let times = |times: &crate::Histogram| {
            let [p50, p99] = [0.5, 0.99].map(|q| measured(times.percentile(q)));
            format!("p50 {p50}, p99 {p99}, max {}", measured(times.max()))
        };
        vec![
            format!("{} released, {} skipped, {} missed", live.released, live.skipped, live.missed),
            format!("late {}", times(&live.lateness)),
            format!("work {}", times(&live.execution)),
        ]
    }
}

impl GraphPort {
    /// What went through it.
    pub(crate) fn traffic(&self) -> String {
        let dropped = if self.dropped > 0 { format!(", {} dropped", self.dropped) } else { String::new() };
        format!("{} sent, {} taken{dropped}", self.sent, self.taken)
    }
}

impl fmt::Display for GraphView {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.execution {
            Execution::Threaded => write!(f, "graph in real time")?,
            Execution::Virtual => write!(f, "graph in virtual time")?,
        }
        match self.elapsed {
            Some(elapsed) => writeln!(f, ", after {}", measured(elapsed))?,
            None => writeln!(f)?,
        }
        for group in &self.groups {
            writeln!(f, "group      {}: {}", group.name, group.contract())?;
            if !group.actors.is_empty() {
                writeln!(f, "             actors {}", group.actors.join(", "))?;
            }
            group.figures().iter().try_for_each(|line| writeln!(f, "             {line}"))?;
        }
        for port in &self.ports {
            let GraphPort { name, kind, carries, .. } = port;
            let [from, to] = [&port.from, &port.to].map(|end| self.in_words(end));
            write!(f, "port       {name}: {from} -> {to}, {} of {carries}", kind.name())?;
            if self.elapsed.is_some() {
                write!(f, ", {}", port.traffic())?;
            }
            writeln!(f)?;
        }
        self.warnings.iter().try_for_each(|warning| writeln!(f, "warning    {warning}"))
    }
}
