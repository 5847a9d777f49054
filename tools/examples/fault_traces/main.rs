//! The force at the device through each fault: a table and a picture, from runs on real threads.
//!
//!     cargo run --release --example fault_traces              writes out/fault_traces/fault_traces.svg
//!     cargo run --release --example fault_traces -- --docs    writes docs/img/fault_traces.svg too
//!
//! `tests/session_faults.rs` runs the same scenarios and checks them.

mod scenarios;

use std::path::Path;

use palpate::log::LogRecord;
use palpate_cli::drawing::{Colour, Curve, Panel, Sheet};

use scenarios::{FAULT_S, Fault, RAMP_S, Trace};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    println!("Fault injected at {FAULT_S} s; declared ramp time {} ms.\n", RAMP_S * 1e3);
    println!(
        "| fault | force before (N) | answer | force gone (ms after the fault) | largest step (N) | model age at most (ms) |"
    );
    println!("| --- | ---: | --- | ---: | ---: | ---: |");
    let mut panels = Vec::new();
    for fault in Fault::ALL {
        eprintln!("{} ...", title(fault));
        let trace = scenarios::run(fault)?;
        println!("{}", row(fault, &trace));
        panels.push(panel(fault, &trace));
    }
    let mut rows = Vec::new();
    while !panels.is_empty() {
        rows.push(panels.drain(..panels.len().min(2)).collect());
    }
    let sheet = Sheet {
        title: "The force at the device through each fault".to_owned(),
        subtitle: format!("magnitude of the commanded force; the fault comes at {FAULT_S} s"),
        legend: vec![("goes to rest".to_owned(), Colour::BLUE), ("stays".to_owned(), Colour::ORANGE)],
        rows,
    };
    let mut folders = vec!["out/fault_traces"];
    if std::env::args().any(|argument| argument == "--docs") {
        folders.push("docs/img");
    }
    for folder in folders {
        std::fs::create_dir_all(folder)?;
        let path = Path::new(folder).join("fault_traces.svg");
        std::fs::write(&path, sheet.to_svg())?;
        println!("\n{}", path.display());
    }
    Ok(())
}

fn title(fault: Fault) -> &'static str {
    match fault {
        Fault::LocalPanics => "the haptic model panics in a tick",
        Fault::LocalNotFinite => "the haptic model's state turns NaN",
        Fault::DeviceReadPanics => "the device panics while it is read",
        Fault::DeviceWritePanics => "the device panics while it is written",
        Fault::DeviceNotFinite => "the device reports NaN for 50 ms",
        Fault::GlobalPanics => "the global model panics",
        Fault::GlobalNotFinite => "the global model's state is not finite",
        Fault::GlobalStalls => "the global model stalls for 1 s",
        Fault::GlobalNeverReturns => "the global model never returns",
        Fault::DiskFull => "the disk is full",
        Fault::LoggerStuck => "the logger is stuck in a write",
        Fault::ProcessStopped => "SIGSTOP, SIGCONT after 0.6 s",
        Fault::StopRequested => "a stop is requested (Ctrl-C)",
        Fault::Dropped => "the running session is dropped",
    }
}

fn row(fault: Fault, trace: &Trace) -> String {
    let (before, rest) = trace.before_and_rest();
    let gone = match rest.filter(|_| !fault.leaves_the_force()) {
        Some(rest) => format!("{:.0}", (rest - FAULT_S) * 1e3),
        None => "stays".to_owned(),
    };
    let after: Vec<_> = trace.magnitudes().filter(|sample| sample.0 > FAULT_S - 0.01).collect();
    // Over a gap nothing is commanded.
    let steps = after.windows(2).filter(|pair| pair[1].0 - pair[0].0 < 0.1).map(|pair| (pair[1].1 - pair[0].1).abs());
    let step = steps.fold(0.0, f64::max);
    let summary = trace.summary.as_ref();
    let answer = match summary.map(|summary| &summary.runtime) {
        None => "ramps out, threads joined".to_owned(),
        Some(_) if fault == Fault::ProcessStopped => "zero first, then ramps in".to_owned(),
        Some(runtime)
            if fault.leaves_the_force()
                && (runtime.fault.is_some() || summary.is_some_and(|s| s.log_error.is_some())) =>
        {
            "the haptic side runs on, the report says what is missing".to_owned()
        }
        Some(runtime) if runtime.fault.is_some() => "ramps out, run stops with the fault".to_owned(),
        Some(runtime) if !runtime.restarts.is_empty() => "the haptic side runs on, the group is restarted".to_owned(),
        Some(_) if fault == Fault::StopRequested => "ramps out, run ends".to_owned(),
        Some(_) => "the haptic side runs on".to_owned(),
    };
    let ages = summary.into_iter().flat_map(|summary| &summary.records).filter_map(|record| match record {
        LogRecord::Force(force) => Some(force.model_age_s),
        _ => None,
    });
    let age = ages.fold(0.0, f64::max);
    format!("| {} | {before:.2} | {answer} | {gone} | {step:.3} | {:.0} |", title(fault), age * 1e3)
}

fn panel(fault: Fault, trace: &Trace) -> Panel {
    let end = if fault.leaves_the_force() { trace.written.last().map_or(1.0, |last| last.0) } else { 0.8 };
    let (times, values): (Vec<f64>, Vec<f64>) = trace.magnitudes().unzip();
    Panel {
        caption: title(fault).to_owned(),
        x_label: "time (s)",
        y_label: "force (N)",
        shown: 0.3..end,
        curves: vec![Curve::new(&times, values, if fault.leaves_the_force() { Colour::ORANGE } else { Colour::BLUE })],
        marks: vec![FAULT_S],
        ..Panel::default()
    }
}
