//! Haptic rates from 250 Hz to 4 kHz; the reference is `full` at the same rate.

use std::fmt::Write;

use palpate::Error;
use palpate::model::local::Kind as LocalModelKind;
use palpate::runtime::Rate;
use palpate_cli::compare::{CompareOptions, Comparison, Measured};
use palpate_cli::drawing::{Picture, Series, Sign};

use crate::Part;
use crate::common::{colour, compared, figure, scene, table, us};

const SCENES: [&str; 2] = ["hand", "drag_friction"];
const RATES: [f64; 5] = [250.0, 500.0, 1000.0, 2000.0, 4000.0];
const MODELS: [LocalModelKind; 3] = [LocalModelKind::Hold, LocalModelKind::Patch, LocalModelKind::Predictive];
const ROUNDS: usize = 1;
/// Simulated time: the drags up to their middle (s).
const DURATION_S: f64 = 1.2;

pub fn part(is_quick: bool) -> Result<Part, Error> {
    let (names, rates, rounds) =
        if is_quick { (&SCENES[..1], &RATES[2..3], 1) } else { (&SCENES[..], &RATES[..], ROUNDS) };
    let mut text = "## Haptic rates\n\n\
        Results are one period of the global model (33.34 ms) late, and the drag is run to its middle (1.2 s). The reference is `full` at the same rate, \
        with at least 2 substeps per ms and one per tick.\n"
        .to_owned();
    let mut pictures = Vec::new();
    for name in names {
        let mut measured = Vec::new();
        for &rate in rates {
            eprintln!("{name} at {rate} Hz");
            let mut varied = scene(name)?;
            varied.local.rate_hz = rate;
            let late = CompareOptions::one_period(Rate::from_hz(varied.global.rate_hz).expect("a scene has a rate"));
            let duration_s = Some(if is_quick { 0.2 } else { varied.run.duration_s.min(DURATION_S) });
            let options = CompareOptions { models: MODELS.into(), latencies: vec![late], duration_s, finer: false };
            measured.push((rate, compared(&varied, &options, rounds)?));
        }
        let file = format!("speed_vs_error_rates_{name}");
        let _ = write!(text, "\n### Rates on `{name}`\n\n![Rates on {name}](img/{file}.svg)\n\n");
        text.push_str(&rows(&measured));
        let _ = write!(text, "\n{}\n", told(&measured));
        pictures.push((file, picture(name, &measured).to_svg()));
    }
    Ok(Part { text, pictures })
}

/// `full` and the models that ran to their end.
fn runs(comparison: &Comparison) -> impl Iterator<Item = (&str, &Measured)> {
    let others = comparison.runs.iter().filter_map(|run| Some((&*run.model, run.measured()?)));
    [("full", &comparison.full)].into_iter().chain(others)
}

/// CPU of a tick, in % of its period.
fn share(comparison: &Comparison, run: &Measured) -> f64 {
    100.0 * us(run.cost.tick_p99) / us(comparison.haptic_period)
}

fn rows(measured: &[(f64, Comparison)]) -> String {
    let mut rows = Vec::new();
    for (rate, comparison) in measured {
        for (model, run) in runs(comparison) {
            let (error, cost) = (&run.error, &run.cost);
            let figures = [error.rms, error.max, us(cost.tick_p99), share(comparison, run), 1e3 * cost.total_load()];
            let first = [format!("{rate} Hz"), format!("`{model}`")];
            rows.push(first.into_iter().chain(figures.map(figure)).collect());
        }
        for run in &comparison.runs {
            if let Some(why) = run.missing() {
                rows.push(vec![format!("{rate} Hz"), format!("`{}`", run.model), why.to_owned()]);
            }
        }
    }
    let heads = ["rate", "model", "rms %", "max %", "tick p99 us", "p99 in % of period", "both ms/s"];
    table(&heads, 2, &rows)
}

/// Up to which rate each model keeps up.
fn told(measured: &[(f64, Comparison)]) -> String {
    let fits = |(_, comparison): &&(f64, Comparison)| share(comparison, &comparison.full) <= 100.0;
    let Some((rate, last)) = measured.iter().rfind(fits) else {
        return "`full` keeps none of these rates.".to_owned();
    };
    let left = 100.0 / share(last, &last.full);
    let predictive = |(rate, comparison): &(f64, Comparison)| {
        let (_, run) = runs(comparison).find(|(model, _)| *model == "predictive")?;
        Some((*rate, run.error.rms, share(comparison, run), run.cost.global_load))
    };
    let worst = measured.iter().filter_map(predictive).map(|at| at.1).fold(0.0, f64::max);
    let fastest = measured.last().and_then(predictive);
    let mut text = format!(
        "`full` keeps {rate} Hz with {} % of the period at p99 ({} nodes): at that rate a body {} times as large would be the \
         largest. `predictive` stays within {} % rms at every rate.",
        figure(share(last, &last.full)),
        last.nodes,
        figure(left),
        figure(worst),
    );
    if let Some((rate, _, share, load)) = fastest {
        let _ = write!(
            text,
            " At {rate} Hz it takes {} % of the period at p99 and {} ms/s of the global core.",
            figure(share),
            figure(1e3 * load)
        );
    }
    text
}

fn picture(scene: &str, measured: &[(f64, Comparison)]) -> Picture {
    let models = ["full", "predictive", "patch", "hold"];
    let last = measured.len().saturating_sub(1);
    let series = models.map(|model| Series {
        name: model.to_owned(),
        colour: colour(model),
        is_joined: true,
        sign: Sign::Disc,
        is_hollow: false,
        points: measured
            .iter()
            .enumerate()
            .filter_map(|(place, (rate, comparison))| {
                let (_, run) = runs(comparison).find(|(name, _)| *name == model)?;
                let label = if place == last { model.to_owned() } else { String::new() };
                Some((*rate, share(comparison, run), label))
            })
            .collect(),
    });
    Picture {
        title: format!("{scene}: haptic rate against the share of its period that a tick takes"),
        x: "haptic rate (Hz)".to_owned(),
        y: "CPU per haptic tick, p99 (% of the period)".to_owned(),
        marks: Vec::new(),
        levels: vec![(100.0, "the whole period".to_owned())],
        series: series.into(),
    }
}
