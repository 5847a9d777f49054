//! How large a body can be: cubes of 8^3 to 40^3 nodes at 1 and 4 kHz. What each part of each model costs, whether that fits
//! one core for the haptic group and one for the global one, and how far `predictive` is from `full` one period late.
//! Writes all tables to target/scale.md, of which docs/scale.md has what a reader needs, and draws its picture.
//!
//! `cargo bench --bench scale`; with `-- --quick` a short form that prints and writes nothing, with
//! `-- --only-errors` only the errors, printed as they come, with `-- --only-tissue` only the bodies of tetrahedra.

#[path = "../common/mod.rs"]
mod common;
mod costs;
mod runs;
mod tissue;
mod verdict;

use std::process::ExitCode;

use palpate::Error;

use costs::{BasisCost, Costs};

const SIZES: [usize; 7] = [8, 12, 16, 20, 24, 32, 40];
const RATES: [f64; 2] = [1000.0, 4000.0];
const QUICK_SIZES: [usize; 2] = [6, 8];

const HEAD: &str = "\
# How large a body can be

Cubes of 0.1 m of the reference material: the same springs (30 N/m), node masses (0.5 g) and damping at every size, 2 explicit
substeps per tick at 1 kHz and 1 at 4 kHz, as the stability limit asks for. A tool presses 8 mm into the top and drags with a
friction coefficient of 1. The global model runs at 30 Hz and its results are one period late. A patch has 4 x 4 x 2 nodes,
that of `predictive` 6 x 6 x 3, and its reduced surroundings as many states as by default.
";

fn document(is_quick: bool) -> Result<(), Error> {
    let sizes = if is_quick { &QUICK_SIZES[..] } else { &SIZES[..] };
    let mut basis_costs: Vec<BasisCost> = Vec::new();
    let mut all: Vec<Costs> = Vec::new();
    for &nodes in sizes {
        let surroundings = costs::Surroundings::new(nodes, &basis_costs)?;
        basis_costs.push(surroundings.cost);
        for rate in RATES {
            let costs = costs::measure(nodes, rate, &surroundings)?;
            eprintln!("{}", verdict::line(&costs));
            all.push(costs);
        }
    }
    if !is_quick {
        common::write("docs/img/scale.svg", &costs::picture(&all).to_svg())?;
    }
    let date = common::measured_on("cargo bench --bench scale");
    let costs = costs::text(&all, &basis_costs);
    let first = [format!("{HEAD}\n{date}\n"), verdict::text(&all), costs, tissue::text(is_quick)?].join("\n");
    // Long: what is there is written after every case.
    runs::all(is_quick, |runs| {
        let text = format!("{first}\n{}", runs::text(runs));
        if is_quick {
            print!("{text}");
            return Ok(());
        }
        common::write("target/scale.md", &text)
    })
}

fn main() -> ExitCode {
    let Some(arguments) = common::arguments() else { return ExitCode::SUCCESS };
    let is_quick = arguments.is_quick;
    let done = match (arguments.only_errors, std::env::args().any(|argument| argument == "--only-tissue")) {
        (true, _) => runs::all(is_quick, |_| Ok(())),
        (_, true) => tissue::text(is_quick).map(|text| println!("{text}")),
        _ => document(is_quick),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}
