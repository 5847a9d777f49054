//! What walls between crates cannot say: the order of the engine's modules, and where `unsafe`, atomics and the heavy libraries
//! may appear. Walls between crates are held by their manifests, circles of files by `ci/structure.py`.

use std::path::{Path, PathBuf};

/// The engine's modules, each built on those before it alone.
const ORDER: [(&str, &[&str]); 12] = [
    ("printable", &[]),
    ("error", &["printable"]),
    ("files", &["error"]),
    ("random", &[]),
    ("safety", &[]),
    ("link", &["error", "random"]),
    ("devices", &["error", "files", "random"]),
    ("scene", &["devices", "error", "files", "printable"]),
    ("log", &["error", "printable"]),
    ("report", &["error", "log"]),
    ("actors", &["devices", "error", "files", "link", "log", "report", "safety"]),
    ("session", &["actors", "devices", "error", "files", "link", "log", "report", "safety", "scene"]),
];

/// Words that belong to few files, or to few folders.
const QUARANTINE: [(&str, &[&str]); 9] = [
    (
        "unsafe",
        &[
            "ffi/src/exports/",
            "ffi/src/memory.rs",
            "src/model/body/kernel/avx2.rs",
            "src/model/body/kernel/avx512.rs",
            "src/runtime/primitives/exchange.rs",
            "src/runtime/primitives/ring.rs",
            "src/runtime/system/os.rs",
            "tools/src/main.rs",
        ],
    ),
    ("parry3d_f64", &["src/mesh/fill/distance.rs", "src/model/mesh/nearest.rs"]),
    ("roxmltree", &["src/mesh/files/vtk/"]),
    ("miniz_oxide", &["src/mesh/files/vtk/data_array.rs", "src/scene/built_in.rs"]),
    ("faer", &["src/model/linear_algebra/"]),
    ("rayon", &["src/model/body/kernel/cores.rs"]),
    ("atomic", &["src/runtime/primitives/sync.rs"]),
    ("loom::", &["src/runtime/primitives/sync.rs"]),
    ("libc", &["src/runtime/system/os.rs"]),
];

/// The sources of every crate, by their path in the repository, without comments and unit tests.
fn sources() -> Vec<(String, String)> {
    fn collect(folder: &Path, files: &mut Vec<PathBuf>) {
        for entry in std::fs::read_dir(folder).expect("a readable folder") {
            let path = entry.expect("a readable folder").path();
            match path.is_dir() {
                true if ["tests", "benches", "examples"].iter().any(|aside| path.ends_with(aside)) => {}
                true => collect(&path, files),
                false => files.push(path),
            }
        }
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut files = Vec::new();
    ["src", "ffi/src", "haply/src", "link/src", "python/src", "tools/src", "view/src"]
        .iter()
        .for_each(|folder| collect(&root.join(folder), &mut files));
    files.retain(|path| path.extension().is_some_and(|ending| ending == "rs"));
    let name = |path: &Path| path.strip_prefix(root).expect("below the root").display().to_string();
    files.iter().map(|path| (name(path), code(&std::fs::read_to_string(path).expect("UTF-8")))).collect()
}

/// What a file says before its unit tests, which end it, without comments.
fn code(text: &str) -> String {
    let is_test = |line: &&str| line.starts_with("#[cfg(test)]") || line.starts_with("#[cfg(all(test");
    let lines = text.lines().take_while(|line| !is_test(line));
    lines.map(|line| line.split("//").next().unwrap_or_default()).collect::<Vec<_>>().join("\n")
}

/// True if `word` stands in `code` and is no part of a longer name.
fn has_word(code: &str, word: &str) -> bool {
    let is_name = |c: char| c.is_alphanumeric() || c == '_';
    code.match_indices(word).any(|(at, _)| {
        let after = &code[at + word.len()..];
        !code[..at].ends_with(is_name) && (!word.ends_with(is_name) || !after.starts_with(is_name))
    })
}

#[test]
fn no_module_of_the_engine_names_one_that_is_built_on_it() {
    let modules = ORDER.map(|(module, _)| module);
    let mut faults = Vec::new();
    for (path, code) in sources() {
        let own = path.strip_prefix("src/").and_then(|path| path.split(['/', '.']).next());
        let Some((own, may)) = ORDER.into_iter().find(|(module, _)| Some(*module) == own) else { continue };
        let others = modules.iter().filter(|other| **other != own && !may.contains(other));
        faults.extend(
            others.filter(|other| has_word(&code, &format!("crate::{other}"))).map(|other| (path.clone(), *other)),
        );
    }
    assert!(faults.is_empty(), "{faults:#?}");
    for (place, (module, may)) in ORDER.iter().enumerate() {
        assert!(may.iter().all(|name| modules[..place].contains(name)), "{module}: {may:?}");
    }
}

#[test]
fn unsafe_code_atomics_and_heavy_libraries_stay_in_their_files() {
    let sources = sources();
    for (word, places) in QUARANTINE {
        let escaped = |(path, code): &&(String, String)| {
            has_word(code, word) && !places.iter().any(|place| path.starts_with(place))
        };
        let faults: Vec<&str> = sources.iter().filter(escaped).map(|(path, _)| path.as_str()).collect();
        assert!(faults.is_empty(), "{word}: {faults:#?}");
        // A quarantine that nothing needs any more is an open door.
        for place in places {
            let needs = |(path, code): &(String, String)| path.starts_with(place) && has_word(code, word);
            assert!(sources.iter().any(needs), "{place} has no {word}");
        }
    }
}

#[test]
fn files_stay_readable_in_one_sitting() {
    let lines = |code: &str| code.lines().filter(|line| !line.trim().is_empty()).count();
    let long: Vec<_> = sources().into_iter().filter(|(_, code)| lines(code) > 350).map(|(path, _)| path).collect();
    assert!(long.is_empty(), "{long:#?}");
}

#[test]
fn words_are_found_where_they_are_meant() {
    for text in ["unsafe { x() }", "x;\nunsafe fn f() {}"] {
        assert!(has_word(&code(text), "unsafe"), "{text}");
    }
    for text in ["#![deny(unsafe_op_in_unsafe_fn)]", "// unsafe", "#[cfg(test)]\nmod tests { unsafe {} }"] {
        assert!(!has_word(&code(text), "unsafe"), "{text}");
    }
    assert!(has_word("use std::{fmt, sync::{Arc, atomic::AtomicBool}};", "atomic"));
    assert!(has_word("crate::session::Session", "crate::session") && !has_word("crate::sessions", "crate::session"));
}
