//! How local models hold on scenes that nobody tuned them to: random cases, `full` against the others in time and one period
//! late. Writes docs/population.md and its pictures.
//!
//! `cargo bench --bench population`; with `-- --quick` a short form that prints and writes nothing; with `-- --seen` the two
//! thirds of the cases that may be looked at while working, case by case, written nowhere; with `-- --unseen` the distributions of the
//! rest; `--cases N` how many, `--from N` the first seed, or `--only A,B` which; `--pairs` those with two tools, `--larger
//! FACTOR` with blocks so many times as long each way, `--shapes` with capsules and spheres that press deep, one of the three; `--patch A,B,C`,
//! `--basis N`, `--basis-latency MS` and `--budget PERCENT` in place of the defaults; `--models A,B` in place of
//! `predictive` and `patch`; `--link MS,SHARE` with the global model behind a link of so much delay one way and such a share of lost
//! packets, which alone prints the document and writes nothing.

#[path = "../common/mod.rs"]
mod common;

mod cases;
mod paths;
#[path = "../../../tests/random/mod.rs"]
mod random;
mod runs;
mod shapes;
mod words;

use std::process::ExitCode;

use palpate::Error;
use palpate::model::local::Kind;
use palpate::scene::LinkSpec;

use cases::{Class, LONGER, Variety, is_unseen};
use runs::{CaseResult, Settings, run_all};
use words::Populations;

/// Cases of the document: with one tool, with two, those whose blocks are made larger, and with tools that have a shape.
const CASES: u64 = 180;
const PAIRS: u64 = 90;
const LARGER: u64 = 117;
const SHAPES: u64 = 90;

fn document(is_quick: bool, settings: &Settings) -> Result<(), Error> {
    let seeds = |count: u64| -> Vec<u64> { if is_quick { vec![0, 5] } else { (0..count).collect() } };
    let run = |seeds: &[u64], variety| run_all(seeds, &Settings { variety, ..settings.clone() }, |_| ());
    let single = run(&seeds(CASES), Variety::Single)?;
    let pairs = run(&seeds(PAIRS), Variety::Pairs)?;
    let is_block = |seed: &u64| single.iter().any(|result| result.seed == *seed && result.class != Class::Tissue);
    let blocks: Vec<u64> = seeds(LARGER).into_iter().filter(|seed| is_unseen(*seed) && is_block(seed)).collect();
    let larger = run(&blocks, Variety::Larger(LONGER))?;
    let shapes = run(&seeds(SHAPES), Variety::Shapes)?;
    let document = words::document(&Populations { single, pairs, larger, shapes });
    if is_quick || settings.link.is_some() {
        print!("{}", document.text);
        return Ok(());
    }
    for (name, svg) in &document.pictures {
        common::write(&format!("docs/img/{name}.svg"), svg)?;
    }
    common::write("docs/population.md", &document.text)
}

/// What may be looked at while working, or the distributions of what may not.
fn print(settings: &Settings, unseen: bool, from: u64, count: usize) -> Result<(), Error> {
    let listed = std::env::args().skip_while(|argument| argument != "--only").nth(1);
    let listed = listed.map(|list| list.split(',').filter_map(|seed| seed.parse().ok()).collect());
    let seeds: Vec<u64> =
        listed.unwrap_or_else(|| (from..).filter(|&seed| is_unseen(seed) == unseen).take(count).collect());
    let told = |result: &CaseResult| {
        if !unseen {
            println!("{result}")
        }
    };
    let results = run_all(&seeds, settings, told)?;
    print!("{}", words::distributions(&results.iter().collect::<Vec<_>>()));
    Ok(())
}

fn main() -> ExitCode {
    let Some(arguments) = common::arguments() else { return ExitCode::SUCCESS };
    let is_given = |flag: &str| std::env::args().any(|argument| argument == flag);
    let value = |flag: &str| std::env::args().skip_while(|argument| argument != flag).nth(1);
    let number = |flag: &str| value(flag).and_then(|value| value.parse::<usize>().ok());
    let kinds = |list: String| -> Vec<Kind> {
        list.split(',')
            .map(|name| Kind::ALL.into_iter().find(|kind| kind.name() == name).expect("--models takes names"))
            .collect()
    };
    let settings = Settings {
        models: value("--models").map_or_else(|| vec![Kind::Predictive, Kind::Patch], kinds),
        budget: value("--budget").and_then(|value| value.parse().ok()),
        patch: value("--patch").map(|sizes| {
            let mut sizes = sizes.split(',').map(|size| size.parse().expect("--patch takes A,B,C"));
            std::array::from_fn(|_| sizes.next().expect("--patch takes A,B,C"))
        }),
        basis: number("--basis"),
        latency_ms: value("--basis-latency").and_then(|value| value.parse().ok()),
        variety: match value("--larger").and_then(|value| value.parse().ok()) {
            Some(times) => Variety::Larger(times),
            None if is_given("--pairs") => Variety::Pairs,
            None if is_given("--shapes") => Variety::Shapes,
            None => Variety::Single,
        },
        link: value("--link").map(|conditions| {
            let mut numbers = conditions.split(',').map(|number| number.parse().expect("--link takes MS,SHARE"));
            let mut next = || numbers.next().expect("--link takes MS,SHARE");
            LinkSpec { delay_ms: next(), loss: next(), seed: 1, ..LinkSpec::default() }
        }),
    };
    let [seen, unseen] = ["--seen", "--unseen"].map(is_given);
    let done = if seen || unseen {
        print(&settings, unseen, number("--from").unwrap_or(0) as u64, number("--cases").unwrap_or(60))
    } else {
        document(arguments.is_quick, &settings)
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}
