//! Patch sizes, basis sizes, substeps and the two predictions, results one period late.

use palpate::Error;
use palpate::model::local::Kind as LocalModelKind;
use palpate::model::surroundings::Basis;
use palpate::runtime::Rate;
use palpate::scene::Scene;
use palpate_cli::compare::{CompareOptions, Comparison, Measured};
use palpate_cli::drawing::{Picture, Series, Sign};

use crate::Part;
use crate::common::{colour, compared, figure, scene, table, us};

const SCENES: [&str; 2] = ["hand", "drag_friction"];
const ROUNDS: usize = 1;
/// Simulated time: the drags up to their middle (s).
const DURATION_S: f64 = 1.2;

/// One setting that differs from the default.
struct Variant {
    name: String,
    change: Box<dyn Fn(&mut Scene)>,
    /// Other models know of it too.
    is_for_all: bool,
}

fn variants() -> Vec<Variant> {
    let variant = |name: String, is_for_all, change: Box<dyn Fn(&mut Scene)>| Variant { name, change, is_for_all };
    let patch = |size: [usize; 3]| {
        let [a, b, c] = size;
        variant(
            format!("patch {a} x {b} x {c}"),
            true,
            Box::new(move |scene: &mut Scene| scene.local.patch = Some(size)),
        )
    };
    let basis =
        |states| variant(format!("basis {states}"), false, Box::new(move |scene| scene.local.basis = Some(states)));
    let substeps = |count| {
        let change = move |scene: &mut Scene| scene.global.substeps_per_ms = Some(count);
        variant(format!("{count} substeps per ms"), true, Box::new(change))
    };
    let default = variant("default".into(), true, Box::new(|_| ()));
    let sizes = [patch([4, 4, 2]), patch([6, 6, 2]), basis(50), basis(100), substeps(4), substeps(8)];
    [default].into_iter().chain(sizes).collect()
}

pub fn part(is_quick: bool) -> Result<Part, Error> {
    let mut variants = variants();
    let (names, rounds) = if is_quick { (&SCENES[..1], 1) } else { (&SCENES[..], ROUNDS) };
    if is_quick {
        variants.truncate(2);
    }
    let mut text = format!(
        "## Sizes and substeps\n\n\
         One setting at a time differs from the default: for `predictive` patch 6 x 6 x 3 and basis {}, for the others patch 4 x 4 x 2; 2 substeps per ms. Results of \
         the global model are one period late, and the drag is run to its middle (1.2 s). The reference `full` has the same substeps.\n",
        Basis::DEFAULT_STATES
    );
    let mut pictures = Vec::new();
    for name in names {
        let mut measured = Vec::new();
        for variant in &variants {
            eprintln!("{name}: {}", variant.name);
            let mut varied = scene(name)?;
            (variant.change)(&mut varied);
            let late = CompareOptions::one_period(Rate::from_hz(varied.global.rate_hz).expect("a scene has a rate"));
            let linear = variant.is_for_all.then_some(LocalModelKind::Patch);
            let models = [LocalModelKind::Predictive].into_iter().chain(linear).collect();
            let duration_s = Some(if is_quick { 0.2 } else { varied.run.duration_s.min(DURATION_S) });
            let options = CompareOptions { models, latencies: vec![late], duration_s, finer: false };
            measured.push((variant.name.as_str(), compared(&varied, &options, rounds)?));
        }
        let file = format!("speed_vs_error_sizes_{name}");
        text.push_str(&format!("\n### Sizes on `{name}`\n\n![Sizes on {name}](img/{file}.svg)\n\n"));
        text.push_str(&rows(&measured));
        pictures.push((file, picture(name, &measured).to_svg()));
    }
    Ok(Part { text, pictures })
}

fn rows(measured: &[(&str, Comparison)]) -> String {
    let mut rows = Vec::new();
    for (variant, comparison) in measured {
        for run in &comparison.runs {
            let figures = match run.measured() {
                Some(Measured { error, cost, .. }) => {
                    let costs = [cost.tick_p50, cost.tick_p99, cost.build_p50].map(|time| figure(us(time)));
                    let errors = [error.rms, error.max].map(figure);
                    errors.into_iter().chain(costs).chain([figure(1e3 * cost.total_load())]).collect()
                }
                None => vec![run.missing().unwrap_or_default().to_owned()],
            };
            rows.push([format!("`{}`", run.model), (*variant).to_owned()].into_iter().chain(figures).collect());
        }
    }
    rows.sort_by_key(|row: &Vec<String>| row[0].clone());
    let heads = ["model", "setting", "rms %", "max %", "tick p50 us", "tick p99 us", "build p50 us", "both ms/s"];
    table(&heads, 2, &rows)
}

fn of<'a>(comparison: &'a Comparison, model: &str) -> Option<&'a Measured> {
    comparison.runs.iter().find(|run| run.model == model).and_then(|run| run.measured())
}

fn picture(scene: &str, measured: &[(&str, Comparison)]) -> Picture {
    let series = ["patch", "predictive"].map(|model| Series {
        name: model.to_owned(),
        colour: colour(model),
        is_joined: false,
        sign: Sign::Disc,
        is_hollow: false,
        points: measured
            .iter()
            .filter_map(|(name, comparison)| {
                let run = of(comparison, model)?;
                let label = if *name == "default" { format!("{model}, default") } else { (*name).to_owned() };
                Some((us(run.cost.tick_p50), run.error.rms, label))
            })
            .collect(),
    });
    Picture {
        title: format!("{scene}: sizes of patch and predictive, results one period late"),
        x: "CPU per haptic tick, p50 (us)".to_owned(),
        y: "rms error (% of peak)".to_owned(),
        marks: Vec::new(),
        levels: Vec::new(),
        series: series.into(),
    }
}
