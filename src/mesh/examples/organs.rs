//! Writes a parametric organ at any resolution, prints what its mesh is like, and draws the sections of both organs.
//!
//! Without an argument it describes the liver of 6 mm elements.
//!
//! ```sh
//! cargo run -p palpate-mesh --example organs -- liver --size-mm 6 --surface-mm 3 --out liver.msh
//! cargo run -p palpate-mesh --example organs -- beam --size-mm 5 --out cantilever.msh
//! cargo run -p palpate-mesh --example organs -- table                   # elements, angles, volume and time over sizes
//! cargo run -p palpate-mesh --example organs -- sections --out docs/img/organ_sections.svg
//! ```

#[path = "organs/sections.rs"]
mod sections;

use std::error::Error;
use std::time::Instant;

use palpate_mesh::{Sizes, organs};
use palpate_model::mesh::TetrahedralMesh;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let option = |name: &str| {
        let at = arguments.iter().position(|argument| argument == name)?;
        arguments.get(at + 1).cloned()
    };
    let metres = |name: &str| option(name).map(|text| text.parse::<f64>().map(|mm| mm / 1000.0)).transpose();
    let sizes = Sizes { element_m: metres("--size-mm")?.unwrap_or(0.006), surface_m: metres("--surface-mm")? };
    let mesh = match arguments.first().map(String::as_str) {
        None | Some("liver") => organs::liver(sizes)?,
        Some("prostate") => organs::prostate(sizes)?,
        Some("beam") => organs::beam([0.1, 0.02, 0.02], sizes.element_m)?,
        Some("table") => return print_table(),
        Some("sections") => {
            let drawing = sections::draw()?;
            return Ok(std::fs::write(option("--out").unwrap_or("organ_sections.svg".into()), drawing)?);
        }
        Some(_) => return Err("say liver, prostate, beam, table or sections; see the head of this file".into()),
    };
    describe(&mesh);
    for group in &mesh.groups {
        println!("group {:?}: {} nodes, {} elements", group.name, group.nodes.len(), group.tetrahedra.len());
    }
    if let Some(path) = option("--out") {
        let mut file = std::io::BufWriter::new(std::fs::File::create(path)?);
        palpate_mesh::write_msh(&rounded(mesh), &mut file)?;
    }
    Ok(())
}

/// With coordinates in whole tenths of a micrometre: a third of the digits, for files that are kept.
fn rounded(mut mesh: TetrahedralMesh) -> TetrahedralMesh {
    mesh.points.iter_mut().for_each(|point| *point = point.map(|x| (x * 1e7).round() / 1e7 + 0.0));
    mesh
}

fn describe(mesh: &TetrahedralMesh) {
    let quality = mesh.quality();
    println!(
        "{} nodes, {} elements, {:.1} to {:.1} degrees, smallest height {:.3} mm, {:.2} ml",
        quality.nodes,
        quality.elements,
        quality.smallest_angle_deg,
        quality.largest_angle_deg,
        1e3 * quality.smallest_height,
        1e6 * quality.volume
    );
}

/// The liver at sizes from 10 to 2 mm: the volume against that of the finest.
fn print_table() -> Result<(), Box<dyn Error>> {
    let finest = organs::liver(Sizes::uniform(0.0015))?.quality().volume;
    println!("| size, surface (mm) | nodes | elements | angles (degrees) | volume | time (s) |");
    println!("| --- | --- | --- | --- | --- | --- |");
    let sizes = [(10.0, None), (8.0, None), (6.0, None), (4.0, None), (3.0, None), (2.0, None)];
    for (size, surface) in sizes.into_iter().chain([(8.0, Some(4.0)), (8.0, Some(2.0)), (12.0, Some(3.0))]) {
        let start = Instant::now();
        let metres = |mm: f64| mm / 1000.0;
        let mesh = organs::liver(Sizes { element_m: metres(size), surface_m: surface.map(metres) })?;
        let (time, quality) = (start.elapsed().as_secs_f64(), mesh.quality());
        let name = surface.map_or(format!("{size}"), |surface| format!("{size}, {surface}"));
        println!(
            "| {name} | {} | {} | {:.1} to {:.1} | {:+.2} % | {time:.2} |",
            quality.nodes,
            quality.elements,
            quality.smallest_angle_deg,
            quality.largest_angle_deg,
            100.0 * (quality.volume / finest - 1.0)
        );
    }
    Ok(())
}
