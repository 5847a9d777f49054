//! The pictures of docs/safety.md, from runs in virtual time: the same every time.
//!
//!     cargo run --release --example safety_figures            hand_release, device_faults, one rate of the sweep
//!     cargo run --release --example safety_figures -- --docs  the whole sweep (minutes); writes docs/img too
//!
//! Look for: `hold` diverging without safety stages and bounded with them; the force through each fault; the table of the
//! stiffness that each model holds at each rate. Files are in `out/safety_figures/`.

mod faults;
mod hand_release;
#[path = "../../tests/support/repository.rs"]
mod repository;
mod table;
mod z_width;

use std::path::Path;

use palpate_cli::drawing::Sheet;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let is_whole = std::env::args().any(|argument| argument == "--docs");
    let folders: &[&str] = if is_whole { &["out/safety_figures", "docs/img"] } else { &["out/safety_figures"] };
    let write = |name: &str, sheet: &Sheet| -> Result<(), Box<dyn std::error::Error>> {
        for folder in folders {
            std::fs::create_dir_all(folder)?;
            let path = Path::new(folder).join(name);
            std::fs::write(&path, sheet.to_svg())?;
            println!("{}", path.display());
        }
        Ok(())
    };
    write("hand_release.svg", &hand_release::sheet()?)?;
    write("device_faults.svg", &faults::sheet()?)?;
    let table = table::Table::measure(is_whole)?;
    println!("\n{table}");
    write("z_width.svg", &table.sheet())
}
