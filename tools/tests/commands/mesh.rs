//! `palpate mesh`: a surface becomes a volume that a scene can take, and what cannot be filled is refused in one line.

use std::fmt::Write;

use crate::support::Folder;

/// An octahedron of 40 mm across as an OBJ file in millimetres, without the last `missing` of its faces.
fn octahedron(missing: usize) -> String {
    let mut text = String::new();
    for [x, y, z] in [[1, 0, 0], [0, 1, 0], [0, 0, 1], [-1, 0, 0], [0, -1, 0], [0, 0, -1]] {
        let _ = writeln!(text, "v {} {} {}", 20 * x, 20 * y, 20 * z);
    }
    let faces = [[1, 2, 3], [2, 4, 3], [4, 5, 3], [5, 1, 3], [2, 1, 6], [4, 2, 6], [5, 4, 6], [1, 5, 6]];
    faces[..faces.len() - missing].iter().for_each(|[a, b, c]| {
        let _ = writeln!(text, "f {a} {b} {c}");
    });
    text
}

#[test]
fn a_surface_is_filled_reported_and_read_again() {
    let folder = Folder::new();
    folder.write("stone.obj", octahedron(0));
    let filled = folder.succeed(&["mesh", "stone.obj", "--size-mm", "4", "--unit-m", "0.001", "--out", "stone.msh"]);
    for word in ["nodes", "elements", "angles", "height", "step", "ml"] {
        assert!(filled.contains(word), "{word:?} is not in {filled}");
    }
    let json = folder.succeed(&["mesh", "stone.msh", "--check", "--json"]);
    let found: serde_json::Value = serde_json::from_str(&json).unwrap();
    // 4/3 of the cube of 20 mm; edges and corners are rounded.
    let volume = found["volume_m3"].as_f64().unwrap();
    assert!((volume / (4.0 / 3.0 * 0.02_f64.powi(3)) - 1.0).abs() < 0.05, "{volume}");
}

#[test]
fn what_cannot_be_filled_is_refused_with_its_place() {
    let folder = Folder::new();
    folder.write("open.obj", octahedron(1));
    folder.write("stone.obj", octahedron(0));
    for (args, words) in [
        (
            &["mesh", "open.obj", "--size-mm", "4", "--unit-m", "0.001", "--out", "a.msh"][..],
            "open.obj: the surface is open",
        ),
        (&["mesh", "stone.obj", "--size-mm", "0", "--unit-m", "0.001", "--out", "a.msh"], "size"),
        (&["mesh", "none.obj", "--size-mm", "4", "--out", "a.msh"], "none.obj"),
    ] {
        let called = folder.call(args);
        assert_eq!(called.code, Some(2), "{called:?}");
        assert!(called.err.contains(words) && called.err.trim_end().lines().count() <= 3, "{called:?}");
        assert!(!folder.path("a.msh").exists(), "nothing is left half-written");
    }
}
