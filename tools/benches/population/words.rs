//! What the runs say, as distributions.

use std::fmt::Write;

use palpate::model::local::Kind;
use palpate_cli::drawing::{Colour, Picture, Series, Sign};

use super::cases::{Class, is_unseen};
use super::common::{figure, measured_on, table};
use super::paths::Motion;
use super::runs::{CaseResult, Run};

/// A document and its pictures by name.
pub struct Document {
    pub text: String,
    pub pictures: Vec<(String, String)>,
}

/// The error that `auto` is asked for where a scene says nothing (%).
const ASKED_PCT: f64 = 1.0;

const HEAD: &str = "\
# How far off on scenes that nobody tuned

See what to expect of `predictive` on a scene like yours, by kind of body and of motion; `palpate compare SCENE` measures yours itself.

```text
cargo bench -p palpate-cli --bench population               # writes this page and its pictures
cargo bench -p palpate-cli --bench population -- --seen     # prints the scenes that may be looked at while working, one by one
```

Each scene is made from its seed: cubes, bricks, slabs, pillars and sheets of springs (10 to 300 N/m, damping ratio 0.05 to 1; plain, in
layers or with a nodule), beams, a prostate and a liver of tetrahedra (3 to 15 kPa, Poisson's ratio 0.4 to 0.47), friction 0 to 1.5, points and
spheres, haptic rates of 0.5 to 4 kHz, a global model at 20 to 50 Hz. A hand kneads at 1 to 5 Hz, taps, draws spirals, scribbles, drags and
stops at once, or strokes at 0.2 to 0.5 m/s, always with tremor. A third of the scenes, those whose seed leaves 2 when divided by 3, is *unseen*:
nothing was chosen by what they say.

Each runs for 1.2 s in virtual time with the models' defaults, with results of the global model at once (*in time*) or one period late. *rms* is the error of
the force in % of the largest force of `full`; *jump* the largest change of the force in one tick beyond that of `full`, in the same; *peak* the
largest force over that of `full`. *Tick* is the CPU time of a haptic tick, the median over scenes of p50 and p99 (with catching up); *periods*
what the global model works, in periods of simulation. A basis takes its nominal time. *2x steps* is `full` itself in twice as many steps: how far
off the reference is.

The table after it has what `auto` chooses with nominal costs, how far that is off one period late, and how often it was more than the usual
`error_pct` of 1 % off without a word of it.

*Two tools* are scenes made in the same way with a second tool, a point or a sphere, that does something of its own at most five cells from the
first: they press the same nodes, cross and part. Errors are those of the tool that is farther off; a tick is that of both.
";

/// The cases with one tool and with two.
pub struct Populations {
    pub single: Vec<CaseResult>,
    pub pairs: Vec<CaseResult>,
}

pub fn document(Populations { single, pairs }: &Populations) -> Document {
    let mut text = format!("{HEAD}\n{}\n", measured_on("cargo bench --bench population"));
    let parts = [
        ("Unseen", single, true, true),
        ("Seen", single, false, false),
        ("Two tools, unseen", pairs, true, false),
        ("Two tools, seen", pairs, false, false),
    ];
    for (name, results, of_unseen, is_by_kind) in parts {
        let of: Vec<&CaseResult> = results.iter().filter(|result| is_unseen(result.seed) == of_unseen).collect();
        let _ = write!(text, "\n## {name} ({} scenes)\n\n{}", of.len(), distributions(&of, is_by_kind));
    }
    text.push_str("\n![Share of scenes above an error](img/population_error.svg)\n\n![Error against cost](img/population_cost.svg)\n");
    let pictures = vec![("population_error", errors(single, pairs)), ("population_cost", costs(single))];
    let pictures = pictures.into_iter().map(|(name, picture)| (name.to_owned(), picture.to_svg())).collect();
    Document { text, pictures }
}

/// The value below which that share of `values` lies.
fn quantile(mut values: Vec<f64>, share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    let place = share * values.len().saturating_sub(1) as f64;
    values.get(place.round() as usize).copied().unwrap_or(f64::NAN)
}

/// The runs of a model in time, or late, that came to their end.
fn runs<'a>(results: &[&'a CaseResult], kind: Kind, late: bool) -> Vec<&'a Run> {
    let of = |result: &&'a CaseResult| result.of(kind)?[usize::from(late)].as_ref().ok();
    results.iter().filter_map(of).collect()
}

/// What `auto` chooses, with what its models are off by one period late.
fn chosen(results: &[&CaseResult]) -> String {
    let row = |kind: Kind| {
        let those: Vec<&CaseResult> = results.iter().copied().filter(|result| result.auto.0 == kind).collect();
        let error = |result: &CaseResult| match kind {
            Kind::Full => 0.0,
            _ => result.of(kind).and_then(|runs| runs[1].as_ref().ok()).map_or(f64::INFINITY, |run| run.rms),
        };
        let errors: Vec<f64> = those.iter().map(|result| error(result)).collect();
        let is_broken = |result: &&&CaseResult| !result.auto.1 && error(result) > ASKED_PCT;
        (!those.is_empty()).then(|| {
            vec![
                kind.name().to_owned(),
                those.len().to_string(),
                figure(quantile(errors.clone(), 0.5)),
                figure(quantile(errors.clone(), 0.9)),
                figure(quantile(errors, 1.0)),
                those.iter().filter(|result| result.auto.1).count().to_string(),
                those.iter().filter(is_broken).count().to_string(),
            ]
        })
    };
    let rows: Vec<Vec<String>> = Kind::ALL.into_iter().filter_map(row).collect();
    let head = ["`auto` chooses", "scenes", "rms % p50", "p90", "worst", "says it is unsure", "breaks its word"];
    format!("{}\n", table(&head, 1, &rows))
}

/// Of all models in time and late; if `is_by_kind`, of `predictive` by class and by motion too, then of `auto`.
pub fn distributions(results: &[&CaseResult], is_by_kind: bool) -> String {
    let mut rows = Vec::new();
    let row = |name: &str, word: &str, runs: &[&Run], scenes: usize| {
        let q = |of: fn(&Run) -> f64, share| figure(quantile(runs.iter().map(|run| of(run)).collect(), share));
        let (rms, jump) = (|run: &Run| run.rms, |run: &Run| run.jump);
        let errors =
            [q(rms, 0.5), q(rms, 0.9), q(rms, 0.95), q(rms, 1.0), q(jump, 0.9), q(jump, 1.0), q(|run| run.peak, 1.0)];
        let costs = [q(|run| run.tick_us[0], 0.5), q(|run| run.tick_us[1], 0.5), q(|run| run.periods, 0.5)];
        let first = [name.to_owned(), word.to_owned(), format!("{}/{scenes}", runs.len())];
        first.into_iter().chain(errors).chain(costs).collect::<Vec<_>>()
    };
    let of = |name: &str, kind: Kind, of: &dyn Fn(&CaseResult) -> bool| -> Vec<Vec<String>> {
        let those: Vec<&CaseResult> = results.iter().copied().filter(|result| of(result)).collect();
        let in_time_or_late = [(false, "in time"), (true, "late")].into_iter();
        let runs = in_time_or_late.map(|(late, word)| (word, runs(&those, kind, late)));
        runs.filter(|(_, runs)| !runs.is_empty()).map(|(word, runs)| row(name, word, &runs, those.len())).collect()
    };
    for kind in Kind::ALL {
        rows.extend(of(&format!("all, `{}`", kind.name()), kind, &|_| true));
    }
    let finer: Vec<&Run> = results.iter().filter_map(|result| result.finer.as_ref()).collect();
    let mut itself = row("all, `full` in 2x steps", "itself", &finer, results.len());
    itself.splice(10.., ["-"; 3].map(str::to_owned));
    rows.push(itself);
    for class in Class::ALL.into_iter().filter(|_| is_by_kind) {
        rows.extend(of(class.name(), Kind::Predictive, &|result| result.class == class));
    }
    for motion in Motion::ALL.into_iter().filter(|_| is_by_kind) {
        rows.extend(of(motion.name(), Kind::Predictive, &|result| result.motion == motion));
    }
    let head = [
        "scenes",
        "results",
        "ran",
        "rms % p50",
        "p90",
        "p95",
        "worst",
        "jump % p90",
        "worst",
        "peak, worst",
        "tick us",
        "p99",
        "periods",
    ];
    let chosen = if is_by_kind { chosen(results) } else { String::new() };
    format!("{}\n{chosen}", table(&head, 2, &rows))
}

/// The share of scenes above an error, by class and of two tools, one period late.
fn errors(single: &[CaseResult], pairs: &[CaseResult]) -> Picture {
    let of_class = |class: Class| (class.name(), single.iter().filter(|result| result.class == class).collect());
    let of = Class::ALL.into_iter().map(of_class).chain([("two tools", pairs.iter().collect())]);
    let series = |(number, (name, of)): (usize, (&str, Vec<&CaseResult>))| {
        let mut errors: Vec<f64> = runs(&of, Kind::Predictive, true).into_iter().map(|run| run.rms).collect();
        errors.sort_by(f64::total_cmp);
        let count = errors.len();
        let label = |place: usize| if place + 1 == count { name.to_owned() } else { String::new() };
        let point = |(place, error): (usize, f64)| (error, (count - place) as f64 / count as f64, label(place));
        Series {
            name: name.to_owned(),
            colour: Colour::numbered(number),
            is_joined: true,
            sign: Sign::Disc,
            is_hollow: false,
            points: errors.into_iter().enumerate().map(point).collect(),
        }
    };
    Picture {
        title: "predictive, one period late: share of scenes with at least that error".to_owned(),
        x: "rms error (% of peak)".to_owned(),
        y: "share of scenes".to_owned(),
        marks: Vec::new(),
        levels: vec![(0.5, "half".to_owned()), (0.1, "a tenth".to_owned())],
        series: of.enumerate().map(series).collect(),
    }
}

/// Error against the cost of a tick, in time and late.
fn costs(results: &[CaseResult]) -> Picture {
    let all: Vec<&CaseResult> = results.iter().collect();
    let series = |(late, name): (bool, &str)| Series {
        name: name.to_owned(),
        colour: Colour::numbered(1 + usize::from(late)),
        is_joined: false,
        sign: Sign::Disc,
        is_hollow: late,
        points: runs(&all, Kind::Predictive, late)
            .into_iter()
            .map(|run| (run.tick_us[0], run.rms, String::new()))
            .collect(),
    };
    Picture {
        title: "predictive: error against cost; discs in time, circles one period late".to_owned(),
        x: "CPU per haptic tick, p50 (us)".to_owned(),
        y: "rms error (% of peak)".to_owned(),
        marks: Vec::new(),
        levels: Vec::new(),
        series: [(false, "in time"), (true, "late")].into_iter().map(series).collect(),
    }
}
