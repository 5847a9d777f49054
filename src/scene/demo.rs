//! The scene that `palpate` alone runs, part of the program.

use super::{Scene, ToolPath};

const TOML: &str = include_str!("../../scenes/demo.toml");
const PATH_CSV: &str = include_str!("../../scenes/paths/demo.csv");

impl Scene {
    /// The built-in demo: five seconds of pressing, dragging, circling and tapping. Reads no file.
    pub fn demo() -> Self {
        Self::from_toml_with(TOML, "demo.toml", |path_csv| {
            ToolPath::from_csv(PATH_CSV, &path_csv.display().to_string())
        })
        .expect("the built-in scene is valid")
    }
}
