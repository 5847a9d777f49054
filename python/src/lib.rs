//! palpate for Python: sessions, logs and studies, with numpy arrays for what they say.
//!
//! | module | what it does |
//! | --- | --- |
//! | `body`, `mesh_arrays`, `tool`, `path` | what is touched, what touches it, and how that moves |
//! | `scene` | scenes from files and dictionaries |
//! | `session`, `subject`, `live` | runs one in simulated time; what it is made of; lets one run on threads, and shows it |
//! | `own_device`, `own_body` | devices and bodies that are written in Python |
//! | `run`, `recording`, `table` | what a run leaves behind, whether it comes from memory or from a log |
//! | `studies` | comparing local models, reducing a body |
//! | `arrays`, `toml_value`, `errors` | arrays that Rust owns; Python's values as those of a scene file; errors as exceptions |

mod arrays;
mod body;
mod errors;
mod live;
mod mesh_arrays;
mod own_body;
mod own_device;
mod path;
mod recording;
mod run;
mod scene;
mod session;
mod studies;
mod subject;
mod table;
mod toml_value;
mod tool;

use pyo3::prelude::*;

/// The native part of the package `palpate`, which passes all of it on.
#[pymodule(gil_used = true)]
mod _palpate {
    #[pymodule_export]
    use super::body::{Block, Tetrahedra};
    #[pymodule_export]
    use super::live::Live;
    #[pymodule_export]
    use super::run::{Run, read};
    #[pymodule_export]
    use super::scene::Scene;
    #[pymodule_export]
    use super::session::Session;
    #[pymodule_export]
    use super::studies::{compare, reduce};
    #[pymodule_export]
    use super::table::Table;
    #[pymodule_export]
    use super::tool::{Capsule, Point, Sphere};

    #[pymodule_export]
    #[allow(non_upper_case_globals)]
    const __version__: &str = env!("CARGO_PKG_VERSION");
}
