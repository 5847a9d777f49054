//! What the runs say, as distributions.

use palpate::model::local::Kind;
use palpate_cli::drawing::{Colour, Picture, Series, Sign};

use super::cases::{Class, LONGER, is_unseen};
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

/// An error that is none (%). Pictures draw what is less as this much.
const NOTHING_PCT: f64 = 1e-3;
/// The axis of errors.
const ERROR_AXIS: &str = "rms error (% of peak; 0.001 or less at the border)";

/// The cases with one tool, with two, with larger blocks, and with tools that have a shape.
pub struct Populations {
    pub single: Vec<CaseResult>,
    pub pairs: Vec<CaseResult>,
    pub larger: Vec<CaseResult>,
    pub shapes: Vec<CaseResult>,
}

/// Before the table of models.
const RAN: &str = "\
`patch` and `predictive` ran on every scene, any other local model only on the scenes for which `auto` chose it; *ran* says on how many.
";

/// Before the table of `auto`.
const AUTO: &str = "\
## What `auto` chooses, unseen

The table covers the first rows above: unseen scenes that are neither *pairs* nor *larger* nor *shapes*. Where `auto` chose another local model for
one of those, the first table has rows of it. Costs are nominal, results one period late. `auto` breaks its word where it is more than the usual
`error_pct` of 1 % off without a warning.
";

/// The columns of the table of models.
const OF_MODELS: [&str; 14] = [
    "scenes",
    "model",
    "results",
    "ran",
    "rms % p50",
    "p90",
    "p95",
    "worst",
    "jump % p90",
    "worst",
    "peak worst",
    "tick us",
    "p99",
    "periods",
];

/// The columns of the table of classes and motions.
const OF_KINDS: [&str; 10] =
    ["kind", "ran", "in time: rms % p50", "p90", "worst", "late: rms % p50", "p90", "worst", "late: tick us", "p99"];

/// What the page is about.
fn head() -> String {
    format!(
        "\
# How far off on scenes that nobody tuned

See what to expect of `predictive` on a scene like yours, by kind of body and of motion; `palpate compare SCENE` measures yours itself.

```text
cargo bench -p palpate-cli --bench population               # writes this page and its pictures
cargo bench -p palpate-cli --bench population -- --seen     # prints the scenes that may be looked at while working, one by one
```

The scenes are random: cubes, bricks, slabs, pillars and sheets of springs (10 to 300 N/m, damping ratio 0.05 to 1; plain, in layers or with a
nodule); beams, a prostate and a liver of tetrahedra (3 to 15 kPa, Poisson's ratio 0.4 to 0.47). Friction is 0 to 1.5, the tool a point or a
sphere, the haptic rate 0.5 to 4 kHz, the global one 20 to 50 Hz. A hand kneads at 1 to 5 Hz (*sine*), taps, draws spirals, scribbles, drags and
stops at once, or strokes at 0.2 to 0.5 m/s, always with tremor. A third of the scenes, those whose seed leaves
2 when divided by 3, is *unseen*: nothing was chosen by what they say.

*Pairs* are scenes with a second tool that does something of its own at most five cells from the first. Errors are those of the tool that is
farther off; a tick is that of both. `-- --seen --pairs` prints the seen ones.

*Larger* are scenes whose blocks have {LONGER} times as many nodes along each edge, up to 22^3 and 27 x 27 x 10, around the same motion: no
window takes all of most of them. `-- --seen --larger {LONGER}` prints the seen ones.

*Shapes* are scenes whose tool is a capsule that turns by up to 1.2 rad as it moves, 1 to 5 cells long, or in a quarter of them a sphere; it goes
up to twice as deep, elements of tissue are two thirds as long, and in two fifths friction takes more to break loose than to slide.
`-- --seen --shapes` prints the seen ones.

Each scene runs for 1.2 s in virtual time with the defaults, with results of the global model at once (*in time*) or one period *late*; a basis
takes its nominal time. Percentiles are over scenes:

- *rms*: error of the force, in % of the largest force of `full`
- *jump*: largest change of the force in one tick beyond that of `full`, in the same
- *peak*: largest force over that of `full`
- *tick*: CPU time of a haptic tick, with catching up: the medians of its p50 and p99
- *periods*: work of the global model, in periods of simulation
- *2x steps*: `full` in twice as many steps, which is how far off the reference itself is
"
    )
}

pub fn document(Populations { single, pairs, larger, shapes }: &Populations) -> Document {
    let parts = [
        ("unseen", single, true),
        ("seen", single, false),
        ("pairs, unseen", pairs, true),
        ("larger, unseen", larger, true),
        ("shapes, unseen", shapes, true),
        ("shapes, seen", shapes, false),
    ];
    let models: Vec<Vec<String>> =
        parts.into_iter().flat_map(|(name, results, unseen)| of_models(name, &part(results, unseen))).collect();
    let unseen = part(single, true);
    let text = format!(
        "{}\n{}\n\n## All scenes\n\n{RAN}\n{}\n{}\n## `predictive` by body and by motion, unseen\n\n{}\n{AUTO}\n{}\n\
         ![Share of scenes above an error](img/population_error.svg)\n\n\
         ![Error against cost](img/population_cost.svg)\n",
        head(),
        measured_on("cargo bench --bench population"),
        table(&OF_MODELS, 3, &models),
        without_small_bodies("unseen", &unseen),
        table(&OF_KINDS, 1, &of_kinds(&unseen)),
        chosen(&unseen),
    );
    let pictures = vec![("population_error", errors(single, pairs, shapes)), ("population_cost", costs(single))];
    let pictures = pictures.into_iter().map(|(name, picture)| (name.to_owned(), picture.to_svg())).collect();
    Document { text, pictures }
}

/// What is left of the errors one period late where a window does not take all of the body, as it does of small ones.
fn without_small_bodies(name: &str, results: &[&CaseResult]) -> String {
    let late = runs(results, Kind::Predictive, true);
    let errors: Vec<f64> = late.iter().map(|run| run.rms).filter(|&rms| rms >= NOTHING_PCT).collect();
    let [half, nine, worst] = [0.5, 0.9, 1.0].map(|share| figure(quantile(errors.clone(), share)));
    format!(
        "One period late, {} of {} scenes ({name}) are less than {NOTHING_PCT} % off with `predictive`, most of them with a body so small that a\n\
         window [takes all of it](predictive.md#the-parts). Of the others, half are within {half} %, 9 of 10 within {nine}, all within {worst}.\n",
        late.len() - errors.len(),
        late.len(),
    )
}

/// The unseen ones of `results`, or the others.
fn part(results: &[CaseResult], unseen: bool) -> Vec<&CaseResult> {
    results.iter().filter(|result| is_unseen(result.seed) == unseen).collect()
}

/// The value below which that share of `values` lies.
fn quantile(mut values: Vec<f64>, share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    let place = share * values.len().saturating_sub(1) as f64;
    values.get(place.round() as usize).copied().unwrap_or(f64::NAN)
}

/// That quantile of a figure of `runs`, to print.
fn quantile_of(runs: &[&Run], of: fn(&Run) -> f64, share: f64) -> String {
    figure(quantile(runs.iter().map(|run| of(run)).collect(), share))
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
    table(&head, 1, &rows)
}

/// Of each model, of `predictive` by class and motion, and of `auto`.
pub fn distributions(results: &[&CaseResult]) -> String {
    let models = table(&OF_MODELS, 3, &of_models("all", results));
    let [large, kinds] = [without_small_bodies("all", results), table(&OF_KINDS, 1, &of_kinds(results))];
    format!("{models}\n{large}\n{kinds}\n{}", chosen(results))
}

/// A row for each model in time and late, and one for `full` in twice as many steps.
fn of_models(name: &str, results: &[&CaseResult]) -> Vec<Vec<String>> {
    let row = |model: &str, word: &str, runs: &[&Run]| -> Vec<String> {
        let q = |of: fn(&Run) -> f64, share| quantile_of(runs, of, share);
        let rms = |run: &Run| run.rms;
        let first = [name, model, word].map(str::to_owned);
        let ran = format!("{}/{}", runs.len(), results.len());
        let errors = [q(rms, 0.5), q(rms, 0.9), q(rms, 0.95), q(rms, 1.0)];
        let jump = |run: &Run| run.jump;
        let largest = [q(jump, 0.9), q(jump, 1.0), q(|run| run.peak, 1.0)];
        let costs = [q(|run| run.tick_us[0], 0.5), q(|run| run.tick_us[1], 0.5), q(|run| run.periods, 0.5)];
        first.into_iter().chain([ran]).chain(errors).chain(largest).chain(costs).collect()
    };
    let mut rows = Vec::new();
    for kind in Kind::ALL {
        for (late, word) in [(false, "in time"), (true, "late")] {
            let of_kind = runs(results, kind, late);
            if !of_kind.is_empty() {
                rows.push(row(&format!("`{}`", kind.name()), word, &of_kind));
            }
        }
    }
    let finer: Vec<&Run> = results.iter().filter_map(|result| result.finer.as_ref()).collect();
    let mut itself = row("`full`", "2x steps", &finer);
    itself.splice(OF_MODELS.len() - 3.., ["-"; 3].map(str::to_owned));
    rows.push(itself);
    rows
}

/// A row of `predictive` for each class and for each motion; ticks are those with late results.
fn of_kinds(results: &[&CaseResult]) -> Vec<Vec<String>> {
    let row = |name: &str, is_of: &dyn Fn(&CaseResult) -> bool| -> Option<Vec<String>> {
        let those: Vec<&CaseResult> = results.iter().copied().filter(|result| is_of(result)).collect();
        let [in_time, late] = [false, true].map(|late| runs(&those, Kind::Predictive, late));
        let rms = |runs: &[&Run]| [0.5, 0.9, 1.0].map(|share| quantile_of(runs, |run| run.rms, share));
        let tick = [quantile_of(&late, |run| run.tick_us[0], 0.5), quantile_of(&late, |run| run.tick_us[1], 0.5)];
        let first = [name.to_owned(), format!("{}/{}", late.len(), those.len())];
        let cells = first.into_iter().chain(rms(&in_time)).chain(rms(&late)).chain(tick);
        (!late.is_empty()).then(|| cells.collect())
    };
    let classes = Class::ALL.into_iter().filter_map(|class| row(class.name(), &|result| result.class == class));
    let motions = Motion::ALL.into_iter().filter_map(|motion| row(motion.name(), &|result| result.motion == motion));
    classes.chain(motions).collect()
}

/// The error of a run as pictures draw it (%).
fn drawn(run: &Run) -> f64 {
    run.rms.max(NOTHING_PCT)
}

/// The share of scenes above an error, by class, of pairs and of shapes, one period late.
fn errors(single: &[CaseResult], pairs: &[CaseResult], shapes: &[CaseResult]) -> Picture {
    let of_class = |class: Class| (class.name(), single.iter().filter(|result| result.class == class).collect());
    let of = Class::ALL
        .into_iter()
        .map(of_class)
        .chain([("pairs", pairs), ("shapes", shapes)].map(|(name, of)| (name, of.iter().collect())));
    let series = |(number, (name, of)): (usize, (&str, Vec<&CaseResult>))| {
        let mut errors: Vec<f64> = runs(&of, Kind::Predictive, true).into_iter().map(drawn).collect();
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
        title: "predictive, one period late: share of all scenes, seen or not, with at least that error".to_owned(),
        x: ERROR_AXIS.to_owned(),
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
            .map(|run| (run.tick_us[0], drawn(run), String::new()))
            .collect(),
    };
    Picture {
        title: "predictive, all scenes, seen or not: error against cost; discs in time, circles one period late"
            .to_owned(),
        x: "CPU per haptic tick, p50 (us)".to_owned(),
        y: ERROR_AXIS.to_owned(),
        marks: Vec::new(),
        levels: Vec::new(),
        series: [(false, "in time"), (true, "late")].into_iter().map(series).collect(),
    }
}
