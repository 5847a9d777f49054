//! Where bases are kept from run to run.

use std::ffi::OsString;
use std::path::PathBuf;

use crate::runtime::Execution;
use crate::scene::Scene;

/// The folder for the bases of `scene`: the one that it names; else, on threads and for a scene that was read from a file, that of the
/// user's cache. Virtual time looks on no disk unless the scene says so: its runs are the same whatever others have left there.
pub(super) fn folder(scene: &Scene, execution: Execution) -> Option<PathBuf> {
    let of_cache = || {
        let is_asked = execution == Execution::Threaded && scene.source.is_some();
        is_asked.then(|| cache(|name| std::env::var_os(name))).flatten()
    };
    let local = &scene.local;
    local.keep_bases.then(|| local.basis_folder.clone().or_else(of_cache)).flatten()
}

/// Where programs keep what they can make again, by the variables of the environment; `None` if none says it. As the XDG Base
/// Directory Specification has it, or Apple's and Microsoft's counterparts.
fn cache(variable: impl Fn(&str) -> Option<OsString>) -> Option<PathBuf> {
    let absolute = |name: &str| variable(name).map(PathBuf::from).filter(|path| path.is_absolute());
    let of_system = || {
        if cfg!(windows) {
            return absolute("LOCALAPPDATA");
        }
        Some(absolute("HOME")?.join(if cfg!(target_os = "macos") { "Library/Caches" } else { ".cache" }))
    };
    Some(absolute("XDG_CACHE_HOME").or_else(of_system)?.join("palpate").join("bases"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(target_os = "linux")]
    #[test]
    fn the_cache_is_where_the_environment_says() {
        let of = |set: &[(&str, &str)]| {
            let set: Vec<(String, OsString)> = set.iter().map(|(name, to)| (name.to_string(), to.into())).collect();
            cache(|name| set.iter().find(|(set, _)| set == name).map(|(_, to)| to.clone()))
        };
        let path = |path: &str| Some(PathBuf::from(path));
        assert_eq!(of(&[("XDG_CACHE_HOME", "/c"), ("HOME", "/h")]), path("/c/palpate/bases"));
        assert_eq!(of(&[("HOME", "/h")]), path("/h/.cache/palpate/bases"));
        // The specification: what is not absolute counts as not set.
        assert_eq!(of(&[("XDG_CACHE_HOME", "c"), ("HOME", "/h")]), path("/h/.cache/palpate/bases"));
        assert_eq!(of(&[("XDG_CACHE_HOME", ""), ("HOME", "")]), None);
    }

    #[test]
    fn a_folder_that_is_named_counts_everywhere_and_the_cache_for_scenes_of_files_in_real_time() {
        let mut scene = Scene::of_program();
        let of = |scene: &Scene| [Execution::Threaded, Execution::Virtual].map(|execution| folder(scene, execution));
        assert_eq!(of(&scene), [None, None], "a program's own scene");
        scene.source = Some(String::new());
        assert_eq!(of(&scene), [cache(|name| std::env::var_os(name)), None]);
        scene.local.basis_folder = Some("bases".into());
        assert_eq!(of(&scene), [Some("bases".into()), Some("bases".into())]);
        scene.local.keep_bases = false;
        assert_eq!(of(&scene), [None, None]);
    }
}
