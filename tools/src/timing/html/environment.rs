//! What the run was made on, what the system granted, and how good the log is.

use std::fmt::Write;

use palpate::log::{Environment, LoggedExecution, RunReport};

use super::named_figures::{Numbers, grouped};
use crate::drawing::html::escaped;

/// Events that the page lists.
const EVENTS: usize = 40;

/// The card of the environment, the events, and the messages of the log.
pub(crate) fn environment(report: &RunReport, numbers: &Numbers) -> String {
    let mut out = String::from("<h2 id=\"environment\">Environment</h2>\n");
    let mut facts: Vec<(String, String)> = Vec::new();
    match &report.environment {
        Some(environment) => about(environment, &mut facts),
        None => facts.push(("run".into(), "the log does not say what it was made on".into())),
    }
    let mut facts: Vec<(String, String)> =
        facts.into_iter().map(|(what, text)| (escaped(&what), escaped(&text))).collect();
    facts.push(("log".into(), escaped(report.damage.as_deref().unwrap_or("read to its end, not damaged"))));
    facts.push(("lost records".into(), numbers.show("lost_records")));
    out.push_str("<dl class=\"facts\">\n");
    for (what, text) in facts {
        let _ = writeln!(out, "<div><dt>{what}</dt><dd>{text}</dd></div>");
    }
    out.push_str("</dl>\n");
    events(report, numbers, &mut out);
    messages(report, &mut out);
    out
}

fn about(environment: &Environment, facts: &mut Vec<(String, String)>) {
    let mut fact = |what: &str, text: String| {
        if !text.is_empty() {
            facts.push((what.to_owned(), text));
        }
    };
    let execution = match environment.execution {
        LoggedExecution::Virtual => "virtual time",
        LoggedExecution::Threaded { .. } => "real time, on threads",
    };
    fact("execution", execution.to_owned());
    // Logs of other programs have no version of palpate's.
    if environment.palpate_version.starts_with(|c: char| c.is_ascii_digit()) {
        fact("written by", format!("palpate {}", environment.palpate_version));
    }
    fact("instruction set", environment.instruction_set.clone());
    fact("body", environment.body.clone().unwrap_or_default());
    fact("tool", environment.tools.clone().unwrap_or_default());
    let reason = environment.model_reason.as_ref();
    fact(
        "local model",
        match reason {
            Some(reason) => format!("{}: {}", environment.model, reason.why),
            None => environment.model.clone(),
        },
    );
    fact("warning", reason.and_then(|reason| reason.warning.clone()).unwrap_or_default());
    if environment.haptic_hz > 0.0 {
        fact("rates", format!("haptic {} Hz, global {} Hz", environment.haptic_hz, environment.global_hz));
    }
    fact("devices", environment.devices.join(", "));
    fact("safety off", environment.safety_off.join(", "));
    fact("coupling", environment.coupling.clone().unwrap_or_default());
    for (what, text) in &environment.granted {
        fact(&format!("granted: {what}"), text.clone());
    }
    for (what, text) in [(Environment::SCENE, &environment.scene), (Environment::SESSION, &environment.session)] {
        if let Some(text) = text {
            fact("attached", format!("{what}, {} lines", text.lines().count()));
        }
    }
}

fn events(report: &RunReport, numbers: &Numbers, out: &mut String) {
    let _ = writeln!(out, "<h3>Events: {}</h3>", numbers.show("events"));
    if report.events.is_empty() {
        out.push_str("<p class=\"faint\">Nothing was reported during the run.</p>\n");
        return;
    }
    out.push_str("<ul class=\"events\">\n");
    for event in report.events.iter().take(EVENTS) {
        let _ = writeln!(
            out,
            "<li><span class=\"faint\">{:.3} s</span> <strong>{}</strong> {}</li>",
            event.time.as_secs_f64(),
            event.level.name(),
            escaped(&event.message)
        );
    }
    let hidden = report.event_count.saturating_sub(report.events.len().min(EVENTS) as u64);
    if hidden > 0 {
        let _ = writeln!(out, "<li class=\"faint\">and {} more</li>", grouped(hidden));
    }
    out.push_str("</ul>\n");
}

fn messages(report: &RunReport, out: &mut String) {
    if report.messages.is_empty() {
        return;
    }
    out.push_str("<details><summary>Messages in the log</summary>\n<table>\n<tbody>\n");
    for (topic, count) in &report.messages {
        let _ = writeln!(out, "<tr><th scope=\"row\">{}</th><td>{}</td></tr>", escaped(topic), grouped(*count));
    }
    out.push_str("</tbody>\n</table></details>\n");
}
