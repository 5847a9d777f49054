//! Packs the files that built-in scenes name: as text they would be an eighth of a release build of the command.

use std::path::Path;

/// In `scenes/`.
const FILES: [&str; 20] = [
    "meshes/cantilever.msh",
    "meshes/liver.msh",
    "paths/bend.csv",
    "paths/demo.csv",
    "paths/drag.csv",
    "paths/finger.csv",
    "paths/forceps_left.csv",
    "paths/forceps_right.csv",
    "paths/hand.csv",
    "paths/hand_release.csv",
    "paths/hold_right.csv",
    "paths/hover.csv",
    "paths/liver.csv",
    "paths/liver_slide.csv",
    "paths/palpate.csv",
    "paths/press.csv",
    "paths/pull_release.csv",
    "paths/slide.csv",
    "paths/stick_slip.csv",
    "paths/torso.csv",
];

/// Of zlib: what is gained by higher ones is not worth their time.
const LEVEL: u8 = 6;

/// Writes the files one after the other, each behind a line of its name and its length in bytes, deflated.
fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    let mut all = Vec::new();
    for name in FILES {
        let path = Path::new("scenes").join(name);
        println!("cargo::rerun-if-changed={}", path.display());
        let text = std::fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        all.extend(format!("{name} {}\n", text.len()).into_bytes());
        all.extend(text);
    }
    let folder = std::env::var_os("OUT_DIR").expect("cargo tells it");
    let packed = miniz_oxide::deflate::compress_to_vec(&all, LEVEL);
    std::fs::write(Path::new(&folder).join("scene_files"), packed).expect("the folder can be written");
}
