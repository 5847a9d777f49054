//! How fast bodies of tetrahedra come to the continuum: the table of docs/tissue.md and its picture, of two bent bodies on
//! meshes of four sizes against quadratic elements of another program. Some 15 s.
//!
//! Look for: errors that fall with nearly the square of the element's size, but for plain elements near incompressibility.
//!
//! `cargo run --release --example tissue_convergence [-- PICTURE.svg]`

#[path = "../../src/model/tests/tissue_support/mod.rs"]
mod tissue_support;

use std::error::Error;

use palpate_cli::drawing::{Colour, Picture, Series, Sign};
use tissue_support::bent::{Bent, CANTILEVER, COOK, Split};

const REFINEMENTS: [usize; 4] = [1, 2, 3, 4];
const RATIOS: [f64; 3] = [0.3, 0.45, 0.49];

fn main() -> Result<(), Box<dyn Error>> {
    let mut picture = Picture {
        title: "Cantilever, Poisson's ratio 0.49: by how much its deflection is too small".into(),
        x: "side of a cell (mm)".into(),
        y: "error (%)".into(),
        ..Picture::default()
    };
    let second_order = |side: f64, label: &str| (side, 8.0 * (side / 10.0).powi(2), label.to_owned());
    picture.series.push(Series {
        name: "second order".into(),
        is_joined: true,
        points: vec![second_order(2.5, ""), second_order(10.0, "second order")],
        ..Series::default()
    });
    for bent in [CANTILEVER, COOK] {
        let sides = REFINEMENTS.map(|n| format!("{:.2} mm", 1e3 * bent.side / n as f64));
        println!("\n| {} | nu | pressure | {} | order |", bent.name, sides.join(" | "));
        println!("| --- | --- | --- | {}---: |", "---: | ".repeat(sides.len()));
        for split in [Split::Centred, Split::Diagonal] {
            for (ratio, is_averaged) in RATIOS.into_iter().flat_map(|ratio| [(ratio, false), (ratio, true)]) {
                let errors = REFINEMENTS.map(|n| bent.error(split, n, ratio, is_averaged));
                row(split, ratio, is_averaged, &errors);
                if bent.name == CANTILEVER.name && ratio == 0.49 {
                    picture.series.push(series(bent, split, is_averaged, &errors));
                }
            }
        }
    }
    if let Some(path) = std::env::args().nth(1) {
        std::fs::write(path, picture.to_svg())?;
    }
    Ok(())
}

/// A row of the table; the order is that between the two finest meshes.
fn row(split: Split, ratio: f64, is_averaged: bool, errors: &[f64; 4]) {
    let order = (errors[2] / errors[3]).ln() / (REFINEMENTS[3] as f64 / REFINEMENTS[2] as f64).ln();
    let cells = format!("{split:?}").to_lowercase();
    let pressure = if is_averaged { "nodal" } else { "plain" };
    let errors = errors.map(|error| format!("{error:.1}"));
    println!("| {cells} | {ratio} | {pressure} | {} | {order:.1} |", errors.join(" | "));
}

fn series(bent: Bent, split: Split, is_averaged: bool, errors: &[f64; 4]) -> Series {
    let pressure = if is_averaged { "nodal pressure" } else { "plain" };
    let name = format!("{split:?}, {pressure}").to_lowercase();
    let label = |refinement: usize| if refinement == 1 { name.clone() } else { String::new() };
    let point = |(&n, &error): (&usize, &f64)| (1e3 * bent.side / n as f64, error, label(n));
    // A picture's lines rise in x.
    let points = REFINEMENTS.iter().zip(errors).rev().map(point).collect();
    let colour = match (split, is_averaged) {
        (Split::Centred, true) => Colour::BLUE,
        (Split::Centred, false) => Colour::GREEN,
        (Split::Diagonal, true) => Colour::ORANGE,
        (Split::Diagonal, false) => Colour::RED,
    };
    Series { name, colour, is_joined: true, is_hollow: false, sign: Sign::Disc, points }
}
