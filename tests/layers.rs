//! The layers of the crate: which module may name which, and where `unsafe`, atomics and the heavy libraries may appear.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// What each module may name, besides itself.
const ALLOWED: [(&str, &[&str]); 15] = [
    ("error", &[]),
    ("random", &[]),
    ("time", &[]),
    ("model", &["error"]),
    ("runtime", &["error", "time"]),
    ("safety", &["time"]),
    ("devices", &["error", "model", "random", "time"]),
    ("scene", &["devices", "error", "model", "time"]),
    ("log", &["error", "random", "runtime", "time"]),
    ("actors", &["devices", "error", "log", "model", "runtime", "safety", "time"]),
    ("report", &["error", "log", "runtime", "time"]),
    ("session", &["actors", "devices", "error", "log", "model", "runtime", "safety", "scene", "time"]),
    // The face of the crate re-exports what most programs need.
    ("lib", &["actors", "devices", "error", "log", "model", "report", "runtime", "safety", "scene", "session", "time"]),
    // The command is a program like any other: it names the library from outside.
    ("cli", &["actors", "devices", "error", "log", "report", "runtime", "scene", "session", "time"]),
    ("main", &["cli"]),
];

/// Words that belong to few files.
const QUARANTINE: [(&str, &[&str]); 6] = [
    (
        "unsafe",
        &[
            "model/body/kernel/avx2.rs",
            "model/body/kernel/avx512.rs",
            "runtime/primitives/exchange.rs",
            "runtime/system/os.rs",
            "runtime/primitives/ring.rs",
        ],
    ),
    ("parry3d_f64", &["model/geometry.rs"]),
    ("faer", &["model/dense.rs", "model/reduction/linalg.rs", "model/sparse.rs"]),
    ("rayon", &["model/body/kernel/cores.rs"]),
    // However the path to them is cut up into braces.
    ("atomic", &["runtime/primitives/sync.rs"]),
    ("loom::", &["runtime/primitives/sync.rs"]),
];

/// A source file by its path below `src/`.
struct Source {
    path: String,
    text: String,
}

impl Source {
    /// The module at the top: the folder, or the file's own name.
    fn module(&self) -> &str {
        self.path.split('/').next().map_or("", |first| first.trim_end_matches(".rs"))
    }
}

fn sources() -> Vec<Source> {
    fn collect(folder: &Path, files: &mut Vec<PathBuf>) {
        for entry in std::fs::read_dir(folder).expect("src/ is readable") {
            let path = entry.expect("src/ is readable").path();
            match path.is_dir() {
                true => collect(&path, files),
                false => files.push(path),
            }
        }
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    collect(&root, &mut files);
    files.retain(|path| path.extension().is_some_and(|ending| ending == "rs"));
    files.sort();
    let name = |path: &Path| path.strip_prefix(&root).expect("below src/").to_str().expect("UTF-8").replace('\\', "/");
    files.iter().map(|path| Source { path: name(path), text: std::fs::read_to_string(path).expect("UTF-8") }).collect()
}

/// The code without comments, strings, character literals and unit tests, which may name what they like.
fn code(text: &str) -> String {
    let mut code = String::new();
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        let skip = if rest.starts_with("//") {
            rest.find('\n').unwrap_or(rest.len())
        } else if rest.starts_with("/*") {
            rest.find("*/").map_or(rest.len(), |end| end + 2)
        } else if first == '"' {
            string_length(rest)
        } else if let Some(length) = character_length(rest) {
            length
        } else {
            code.push(first);
            rest = &rest[first.len_utf8()..];
            continue;
        };
        // Lines stay lines.
        code.extend(rest[..skip].chars().filter(|c| *c == '\n'));
        rest = &rest[skip..];
    }
    // By the house rules a unit test module is the end of its file.
    let tests = ["#[cfg(test)]\nmod ", "#[cfg(all(test, not(loom)))]\nmod ", "#[cfg(all(test, loom))]\nmod "];
    let end = tests.iter().filter_map(|start| code.find(start)).min().unwrap_or(code.len());
    code.truncate(end);
    code
}

fn string_length(text: &str) -> usize {
    let mut is_escaped = false;
    for (at, c) in text.char_indices().skip(1) {
        match c {
            '"' if !is_escaped => return at + 1,
            '\\' => is_escaped = !is_escaped,
            _ => is_escaped = false,
        }
    }
    text.len()
}

/// The length of a character literal at the start of `text`; `None` for a lifetime.
fn character_length(text: &str) -> Option<usize> {
    let inside = text.strip_prefix('\'')?;
    let length = match inside.strip_prefix('\\') {
        Some(escaped) => 1 + escaped.char_indices().skip(1).find(|(_, c)| *c == '\'')?.0,
        None => inside.chars().next()?.len_utf8(),
    };
    inside[length..].starts_with('\'').then_some(length + 2)
}

/// The top-level modules that `code` names after `prefix`, such as `crate::`, single or in braces.
fn named_after(code: &str, prefix: &str, names: &mut BTreeSet<String>) {
    let is_name = |c: char| c.is_alphanumeric() || c == '_';
    for (at, _) in code.match_indices(prefix) {
        if code[..at].ends_with(|c: char| is_name(c) || c == ':') {
            continue;
        }
        let rest = &code[at + prefix.len()..];
        let first = |text: &str| text.trim_start().chars().take_while(|c| is_name(*c)).collect::<String>();
        match rest.strip_prefix('{') {
            None => names.extend([first(rest)]),
            Some(list) => {
                let mut depth = 0;
                let mut start = 0;
                for (at, c) in list.char_indices() {
                    match c {
                        '{' => depth += 1,
                        '}' | ',' if depth == 0 => {
                            names.extend([first(&list[start..at])]);
                            start = at + 1;
                            if c == '}' {
                                break;
                            }
                        }
                        '}' => depth -= 1,
                        _ => {}
                    }
                }
            }
        }
    }
}

/// The modules that a file names.
fn edges(source: &Source) -> BTreeSet<String> {
    let code = code(&source.text);
    let mut names = BTreeSet::new();
    match source.module() {
        // The binary's own `crate` and the library from outside.
        "cli" | "main" => {
            named_after(&code, "palpate::", &mut names);
            named_after(&code, "crate::", &mut names);
        }
        // Relative paths reach the top as well: `super` of a file at the top, a `mod` of the face.
        "lib" => {
            named_after(&code, "pub use ", &mut names);
            named_after(&code, "use ", &mut names);
            named_after(&code, "crate::", &mut names);
        }
        _ => {
            named_after(&code, "crate::", &mut names);
            let to_top =
                "super::".repeat(source.path.matches('/').count() + usize::from(!source.path.ends_with("/mod.rs")));
            named_after(&code, &to_top, &mut names);
        }
    }
    names
}

/// Every edge that is not allowed, as a line to read.
fn forbidden_edges(sources: &[Source]) -> Vec<String> {
    let allowed: BTreeMap<&str, &[&str]> = ALLOWED.into();
    let modules: BTreeSet<&str> = allowed.keys().copied().collect();
    let mut faults = Vec::new();
    for source in sources {
        let module = source.module();
        let Some(may) = allowed.get(module) else {
            faults.push(format!("{}: no layer has a module `{module}`", source.path));
            continue;
        };
        for name in edges(source).iter().map(String::as_str) {
            if name != module && modules.contains(name) && !may.contains(&name) {
                faults.push(format!("{}: {module} names {name}", source.path));
            }
        }
    }
    faults
}

/// True if `word` stands in `code`, not as a part of a longer name.
fn has_word(code: &str, word: &str) -> bool {
    let is_name = |c: char| c.is_alphanumeric() || c == '_';
    let is_path = !word.ends_with(is_name);
    code.match_indices(word)
        .any(|(at, _)| !code[..at].ends_with(is_name) && (is_path || !code[at + word.len()..].starts_with(is_name)))
}

/// Every word outside its quarantine, as a line to read.
fn escaped_words(sources: &[Source]) -> Vec<String> {
    let mut faults = Vec::new();
    for source in sources {
        let code = code(&source.text);
        for (word, files) in QUARANTINE {
            if has_word(&code, word) && !files.contains(&&*source.path) {
                faults.push(format!("{}: {word}", source.path));
            }
        }
    }
    faults
}

#[test]
fn no_module_names_one_that_its_layer_may_not() {
    let faults = forbidden_edges(&sources());
    assert!(faults.is_empty(), "{faults:#?}");
}

#[test]
fn model_and_runtime_never_name_each_other() {
    let allowed: BTreeMap<&str, &[&str]> = ALLOWED.into();
    for (one, other) in [("model", "runtime"), ("runtime", "model")] {
        assert!(!allowed[one].contains(&other), "{one} may not be given {other}");
    }
    // No ring of modules: each may only be built on what comes before it in the list.
    for (place, (module, may)) in ALLOWED.iter().enumerate() {
        let before: Vec<&str> = ALLOWED[..place].iter().map(|(name, _)| *name).collect();
        assert!(may.iter().all(|name| before.contains(name)), "{module}: {may:?}");
    }
}

#[test]
fn unsafe_code_atomics_and_heavy_libraries_stay_in_their_files() {
    let sources = sources();
    let faults = escaped_words(&sources);
    assert!(faults.is_empty(), "{faults:#?}");
    // A quarantine that nothing needs any more is an open door.
    for (word, files) in QUARANTINE {
        for file in files {
            let source = sources.iter().find(|source| source.path == *file);
            assert!(source.is_some_and(|source| has_word(&code(&source.text), word)), "{file} has no {word}");
        }
    }
}

#[test]
fn files_stay_readable_in_one_sitting() {
    let lines = |source: &Source| code(&source.text).lines().filter(|line| !line.trim().is_empty()).count();
    let long: Vec<String> =
        sources().iter().filter(|source| lines(source) > 350).map(|s| format!("{}: {}", s.path, lines(s))).collect();
    assert!(long.is_empty(), "{long:#?}");
}

fn faults_of(path: &str, text: &str) -> Vec<String> {
    forbidden_edges(&[Source { path: path.into(), text: text.into() }])
}

#[test]
fn the_checker_finds_forbidden_edges_however_they_are_written() {
    for (path, text) in [
        ("model/blend.rs", "use crate::runtime::Actor;"),
        ("model/blend.rs", "use crate::{error::Error, runtime::Actor};"),
        ("model/blend.rs", "use crate::{\n    error::{Error, ErrorKind},\n    runtime,\n};"),
        ("model/blend.rs", "fn f() -> crate::runtime::Outcome { todo() }"),
        ("model/blend.rs", "pub(crate) use crate::runtime::ring;"),
        ("model/blend.rs", "use super::super::runtime::ring;"),
        ("model/mesh/mod.rs", "use super::super::runtime::ring;"),
        ("model/local/hold.rs", "use super::super::super::time::Nanos;"),
        ("time.rs", "use super::error::Error;"),
        ("runtime/system/os.rs", "let x = 'a'; let s = \"// \\\" \"; use crate::model::Vec3;"),
        ("runtime/system/os.rs", "fn f<'a>(x: &'a str) {} use crate::model::Vec3;"),
        ("safety/clamp.rs", "use crate::devices::Device;"),
        ("log/mod.rs", "/* a comment */ use crate::scene::Scene;"),
        ("report/csv.rs", "use crate::session::Summary;"),
        ("session/running.rs", "crate::report::to_text(&report)"),
        ("cli/run.rs", "use palpate::safety::Pipeline;"),
        ("main.rs", "use palpate::session::Session;"),
        ("render.rs", ""),
    ] {
        assert_eq!(faults_of(path, text).len(), 1, "{path}: {text}");
    }
}

#[test]
fn the_checker_allows_what_is_allowed_and_does_not_read_comments_strings_and_tests() {
    for (path, text) in [
        ("model/blend.rs", "use crate::error::Error;\nuse super::contact;\nuse crate::model::Vec3;"),
        ("model/blend.rs", "/// As [`crate::runtime::Actor`].\n// use crate::runtime::Actor;"),
        ("model/blend.rs", "let place = \"crate::runtime::Actor\";"),
        ("model/blend.rs", "use super::Vec3;\n#[cfg(test)]\nmod tests {\n    use crate::runtime::Actor;\n}\n"),
        ("model/blend.rs", "use other_crate::runtime::Runtime;"),
        ("session/graph.rs", "use crate::{actors::LocalActor, scene::Scene};"),
    ] {
        assert_eq!(faults_of(path, text), [""; 0], "{path}: {text}");
    }
}

#[test]
fn the_checker_finds_words_outside_their_quarantine() {
    let escaped = |path: &str, text: &str| escaped_words(&[Source { path: path.into(), text: text.into() }]);
    for text in [
        "unsafe { x() }",
        "use faer::Mat;",
        "parry3d_f64::math::Real",
        "use std::sync::atomic::AtomicU8;",
        "use core::sync::atomic::*;",
        "use std::{fmt, sync::{Arc, atomic::{AtomicBool, Ordering}}};",
        "use std::sync::atomic as raw;",
        "let stop = ::std::sync::atomic::AtomicBool::new(false);",
        "use loom::sync::Mutex;",
    ] {
        assert_eq!(escaped("model/blend.rs", text).len(), 1, "{text}");
    }
    for text in [
        "#![deny(unsafe_op_in_unsafe_fn)]",
        "// unsafe",
        "let loomed = \"unsafe\";",
        "/// The atomic swap of [`std::sync::atomic`].",
        "use super::sync::{AtomicU64, Ordering};",
        "#[cfg(all(test, loom))]",
        "let atomics = 3;",
    ] {
        assert_eq!(escaped("model/blend.rs", text), [""; 0], "{text}");
    }
    assert_eq!(escaped("runtime/primitives/ring.rs", "unsafe { x() }"), [""; 0]);
}
