//! What a sphere feels against the continuum, wherever the nodes lie, and on finer and finer meshes, and a point beside it: the
//! tables of docs/tissue.md.
//!
//! Look for: ratios to Hertz near one, spreads of a few percent for spheres where points feel a factor, and forces under
//! refinement that come to a limit.
//!
//! `cargo run --release -p palpate-cli --example tool_convergence [-- slide|places|refine|hertz|presses|crushed|all]`: without a word the slide,
//! which takes seconds.

#[path = "../../src/model/tests/tissue_support/mod.rs"]
mod tissue_support;
#[path = "../../src/model/tests/tool_support/mod.rs"]
mod tool_support;

use palpate_model::Vec3;
use palpate_model::body::Body;
use palpate_model::contact::ToolShape;
use tool_support::*;

const DEPTH: f64 = 3e-3;
/// Sides of elements (m).
const SIZES: [f64; 4] = [4e-3, 2.5e-3, 1.8e-3, 1.5e-3];
const RATIOS: [f64; 3] = [0.3, 0.45, 0.49];

fn main() {
    let asked = std::env::args().nth(1).unwrap_or_else(|| "slide".to_owned());
    let parts: [(&str, fn()); 6] = [
        ("slide", slides),
        ("places", places),
        ("refine", refinement),
        ("hertz", table_of_hertz),
        ("presses", presses),
        ("crushed", crushed),
    ];
    parts.into_iter().filter(|(name, _)| asked == "all" || asked == *name).for_each(|(_, part)| part());
}

fn table_of_hertz() {
    println!("\n| R, depth (mm) | nu | 4.0 mm | 2.5 mm | 1.8 mm | 1.5 mm |");
    println!("| --- | ---: | {}", "---: | ".repeat(SIZES.len()).trim_end());
    for (radius, depth) in [(6e-3, 1e-3), (10e-3, 2e-3), (15e-3, 3e-3)] {
        for ratio in RATIOS {
            let (force, area) = hertz(radius, depth, ratio);
            let cells = SIZES.map(|size| {
                let pressed = press_tissue(radius, depth, ratio, size);
                let (share, area) = (pressed.wrench.force.z / force, pressed.area / area);
                format!("{share:.3} ({}, {area:.2})", pressed.places)
            });
            println!("| {:.0}, {:.0} | {ratio} | {} |", 1e3 * radius, 1e3 * depth, cells.join(" | "));
        }
    }
}

/// Spheres of any radius and depth anywhere on elements of any size and Poisson's ratio: how far the force is from Hertz', by how much is
/// touched.
fn presses() {
    const PRESSES: u32 = 200;
    /// Radius of what is touched, in edges.
    const BORDERS: [f64; 2] = [1.6, 2.3];
    /// Steps of a sequence that fills six dimensions evenly: powers of the root of x^7 = x + 1, which is 1.1128.
    const STEPS: [f64; 6] = [0.8987, 0.8076, 0.7257, 0.6522, 0.5861, 0.5267];
    let (mut errors, mut restless) = ([const { Vec::new() }; 4], 0);
    for n in 1..=PRESSES {
        let [size, coarse, ratio, deep, x, y] = STEPS.map(|step| (0.5 + f64::from(n) * step).fract());
        let size = 1.4e-3 + 1.6e-3 * size;
        // Each square of a face is cut in two.
        let edge = (2.0 + 2.0_f64.sqrt()) / 3.0 * size;
        let radius = edge / (0.12 + 0.2 * coarse);
        let depth = radius / (3.5 * (30.0_f64 / 3.5).powf(deep));
        if radius > 16e-3 || depth > 3.5e-3 {
            continue;
        }
        let ratio = 0.3 + 0.19 * ratio;
        let pressed = press_tissue_at([x - 0.5, y - 0.5], radius, depth, ratio, size);
        let share = pressed.wrench.force.z / hertz(radius, depth, ratio).0;
        restless += u32::from(!pressed.rests);
        let touched = (radius * depth).sqrt() / edge;
        let class = BORDERS.iter().filter(|&&border| touched > border).count();
        errors[class].push(100.0 * (share - 1.0).abs());
        errors[3].push(100.0 * (share - 1.0).abs());
    }
    println!("\nForces that did not come to rest: {restless}.");
    println!("\n| touched: radius in edges | presses | half (%) | 9 of 10 (%) | worst (%) |");
    println!("| --- | ---: | ---: | ---: | ---: |");
    let [low, high] = BORDERS;
    let names = [format!("up to {low}"), format!("{low} to {high}"), format!("more than {high}"), "all".to_owned()];
    print_errors(names, errors);
}

/// Spheres that crush slabs of any tissue to a part of their thickness, at any speed: how far the largest force is from that in a quarter of
/// the steps, and how many ran away.
fn crushed() {
    const PRESSES: u32 = 100;
    /// Depth as a share of the slab's thickness.
    const BORDERS: [f64; 2] = [0.4, 0.6];
    /// As in `presses`, for seven dimensions: powers of the root of x^8 = x + 1, which is 1.0970.
    const STEPS: [f64; 7] = [0.9116, 0.8310, 0.7576, 0.6906, 0.6296, 0.5739, 0.5232];
    let (mut errors, mut runaways) = ([const { Vec::new() }; 4], 0);
    for n in 1..=PRESSES {
        let [thick, size, radius, deep, ratio, fast, viscosity] = STEPS.map(|step| (0.5 + f64::from(n) * step).fract());
        let (thick, size, radius) = (6e-3 + 14e-3 * thick, 1.8e-3 + 1.7e-3 * size, 3e-3 + 6e-3 * radius);
        let depth = (0.3 + 0.5 * deep) * thick.min(1.6 * radius);
        let (ratio, viscosity) = ([0.3, 0.45, 0.48, 0.49][(4.0 * ratio) as usize], 4.0 * viscosity);
        // From 5 cm/s to 3 m/s.
        let speed = 0.05 * 60.0_f64.powf(fast);
        let slab = tissue_support::slab(thick, size, ratio, viscosity);
        let [felt, expected] = [1, 4].map(|times| crush(slab.clone(), thick, radius, [depth, speed], times, 60));
        if expected > 50.0 || felt > 1.5 * expected + 0.05 {
            runaways += 1;
            println!("ran away: {felt:.1e} of {expected:.1e} N, {:.1} mm deep in {:.1} mm", 1e3 * depth, 1e3 * thick);
            continue;
        }
        let class = BORDERS.iter().filter(|&&border| depth > border * thick).count();
        errors[class].push(100.0 * (felt / expected - 1.0).abs());
        errors[3].push(100.0 * (felt / expected - 1.0).abs());
    }
    println!("\nForces that ran away: {runaways} of {PRESSES}.");
    println!("\n| depth of the thickness | presses | half (%) | 9 of 10 (%) | worst (%) |");
    println!("| --- | ---: | ---: | ---: | ---: |");
    let [low, high] = BORDERS.map(|share| 100.0 * share);
    let names = [
        format!("{low:.0} % or less"),
        format!("{low:.0} to {high:.0} %"),
        format!("more than {high:.0} %"),
        "all".to_owned(),
    ];
    print_errors(names, errors);
}

/// A row for each class of presses.
fn print_errors(names: [String; 4], errors: [Vec<f64>; 4]) {
    for (name, mut errors) in names.into_iter().zip(errors) {
        errors.sort_by(f64::total_cmp);
        let at = |share: f64| errors[((errors.len() - 1) as f64 * share).round() as usize];
        println!("| {name} | {} | {:.1} | {:.1} | {:.1} |", errors.len(), at(0.5), at(0.9), at(1.0));
    }
}

/// Radii (m) of the spheres, a point first.
const RADII: [f64; 5] = [0.0, 4e-3, 8e-3, 12e-3, 20e-3];

fn shape(radius: f64) -> ToolShape {
    if radius > 0.0 { ToolShape::Sphere { radius } } else { ToolShape::Point }
}

fn name(radius: f64) -> String {
    if radius > 0.0 { format!("sphere, {:.0} mm", 1e3 * radius) } else { "point".to_owned() }
}

fn places() {
    println!("\n| lattice, 3 mm deep | node | edge | diagonal | face | spread (%) |");
    println!("| --- | ---: | ---: | ---: | ---: | ---: |");
    for radius in RADII {
        let forces = on_lattice(12)
            .map(|(_, place)| press(Box::new(lattice(12)), shape(radius), place, Vec3::z(), DEPTH).wrench.force.z);
        println!("| {} | {} | {:.1} |", name(radius), newtons(&forces), spread(&forces));
    }
    let organ = organ_body();
    let middle = organ.rest().iter().sum::<Vec3>() / organ.rest().len() as f64;
    for offset in [Vec3::zeros(), Vec3::x() * 0.015, Vec3::y() * 0.015, Vec3::x() * -0.015, Vec3::y() * -0.015] {
        let (places, outward) = on_top(&organ, middle + offset);
        println!(
            "\n| organ near {:.0?} mm, 3 mm deep | node | edge | face | spread (%) | spread from the facet (%) |",
            1e3 * places[0].1
        );
        println!("| --- | ---: | ---: | ---: | ---: | ---: |");
        for radius in RADII {
            let force = |place: Vec3, depth: f64| {
                press(Box::new(organ_body()), shape(radius), place, outward, depth).wrench.force.dot(&outward)
            };
            let touched = |place: Vec3| first_touch(Box::new(organ_body()), shape(radius), place, outward);
            let forces = places.map(|(_, place)| force(place, DEPTH + touched(place)));
            let facets = places.map(|(_, place)| force(place, DEPTH));
            println!("| {} | {} | {:.1} | {:.1} |", name(radius), newtons(&forces), spread(&forces), spread(&facets));
        }
    }
}

fn newtons(forces: &[f64]) -> String {
    forces.iter().map(|force| format!("{force:.4} N")).collect::<Vec<_>>().join(" | ")
}

fn slides() {
    println!("\n| slide over four cells of the lattice | mean (N) | from least to most (%) | within a cell (%) |");
    println!("| --- | ---: | ---: | ---: |");
    let cell = SIDE / 11.0;
    let path = [3.5, 7.5].map(|x| Vec3::new(x * cell, 0.0512, SIDE));
    for radius in RADII {
        let forces = slide(Box::new(lattice(12)), shape(radius), path, Vec3::z(), DEPTH, 4.0);
        let mean = forces.iter().sum::<f64>() / forces.len() as f64;
        let ripple = ripple(&forces, forces.len() / 4);
        println!("| {} | {mean:.4} | {:.2} | {ripple:.2} |", name(radius), spread(&forces));
    }
}

fn refinement() {
    const NODES: [usize; 5] = [8, 12, 16, 20, 24];
    let middle = Vec3::new(0.5 * SIDE, 0.5 * SIDE, SIDE);
    println!(
        "\n| middle of the block | depth (mm) | {} | spread (%) | order |",
        NODES.map(|n| n.to_string()).join(" | ")
    );
    println!("| --- | {}---: |", "---: | ".repeat(NODES.len() + 2));
    for (radius, depth) in RADII.into_iter().flat_map(|radius| [(radius, 1e-3), (radius, DEPTH)]) {
        let forces =
            NODES.map(|nodes| press(Box::new(lattice(nodes)), shape(radius), middle, Vec3::z(), depth).wrench.force.z);
        let (spread, order) = (spread(&forces), order(&NODES, &forces));
        println!("| {} | {:.0} | {} | {spread:.1} | {order} |", name(radius), 1e3 * depth, newtons(&forces));
    }
}

/// The order p for which the forces on the last three lattices are f + c h^p.
fn order(nodes: &[usize; 5], forces: &[f64; 5]) -> String {
    let size = |n: usize| 1.0 / (nodes[n] - 1) as f64;
    let ratio = (forces[2] - forces[3]) / (forces[3] - forces[4]);
    let of = |p: f64| (size(2).powf(p) - size(3).powf(p)) / (size(3).powf(p) - size(4).powf(p));
    let (mut low, mut high) = (0.01, 8.0);
    if !(of(low) < ratio && ratio < of(high)) {
        return "none".to_owned();
    }
    for _ in 0..60 {
        let p = 0.5 * (low + high);
        if of(p) < ratio { low = p } else { high = p }
    }
    format!("{low:.1}")
}
