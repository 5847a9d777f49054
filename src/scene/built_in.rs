//! Scenes that are part of the program, with the files that they name.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::LazyLock;

use super::body::Volume;
use super::{Scene, TetrahedraSpec};
use crate::devices::ToolPath;
use crate::error::{Error, ErrorKind};

macro_rules! scenes {
    ($($name:literal)*) => { &[$(($name, include_str!(concat!("../../scenes/", $name)))),*] };
}

/// The scenes of the folder `scenes/`.
static SCENES: &[(&str, &str)] = scenes![
    "cantilever.toml"
    "demo.toml"
    "device_faults.toml"
    "drag_friction.toml"
    "drag_slip.toml"
    "drag_stick.toml"
    "finger.toml"
    "forceps.toml"
    "hand.toml"
    "hand_release.toml"
    "haply.toml"
    "layers.toml"
    "liver.toml"
    "liver_tumour.toml"
    "nodule.toml"
    "pull_release.toml"
    "soft_deep.toml"
    "stick_slip.toml"
    "torso.toml"
    "two_hands.toml"
    "wave.toml"
    "wave_probe.toml"
    "z_width.toml"
];

/// What they name, by name: the build script has packed it.
static FILES: LazyLock<BTreeMap<String, String>> = LazyLock::new(|| {
    const PACKED: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/scene_files"));
    let all = miniz_oxide::inflate::decompress_to_vec(PACKED).expect("it was packed when this was built");
    let (mut files, mut rest) = (BTreeMap::new(), &*String::from_utf8(all).expect("files of text"));
    while let Some((head, after)) = rest.split_once('\n') {
        let (name, length) = head.split_once(' ').expect("a name and a length");
        let text;
        (text, rest) = after.split_at(length.parse().expect("a length"));
        files.insert(name.to_owned(), text.to_owned());
    }
    files
});

/// A scene that is part of the program.
///
/// ```
/// use palpate::scene::BuiltIn;
///
/// let scene = BuiltIn::named("drag_friction").unwrap();
/// assert!(scene.about().starts_with("The tool presses 8 mm into the top"));
/// assert_eq!(scene.load().run.duration_s, 2.5);
/// assert!(BuiltIn::all().count() > 20 && BuiltIn::named("nothing").is_none());
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BuiltIn {
    file: &'static str,
    text: &'static str,
}

impl BuiltIn {
    /// All of them, in the order of their names.
    pub fn all() -> impl Iterator<Item = Self> {
        SCENES.iter().map(|&(file, text)| Self { file, text })
    }

    /// The one of that name, if there is one.
    pub fn named(name: &str) -> Option<Self> {
        Self::all().find(|scene| scene.name() == name)
    }

    /// What it is called.
    pub fn name(self) -> &'static str {
        self.file.trim_end_matches(".toml")
    }

    /// What happens in it, in a sentence or two: the text's own first words.
    pub fn about(self) -> String {
        let comment = self.text.lines().map_while(|line| line.strip_prefix("# "));
        comment.take_while(|line| !line.starts_with("Look for:")).collect::<Vec<_>>().join(" ")
    }

    /// The scene as a file of it would be loaded. Reads no file.
    pub fn load(self) -> Scene {
        let path = |name: &Path| ToolPath::from_csv(text_of(name)?, &name.display().to_string());
        let volume = |spec: &TetrahedraSpec, name: &Path| {
            Volume::of_file(text_of(name)?.into(), &name.display().to_string(), spec.unit_m)
        };
        Scene::from_toml_with(self.text, self.file, true, path, volume).expect("tests load every one of them")
    }
}

/// The text of a file that scenes name.
fn text_of(name: &Path) -> Result<&'static str, Error> {
    let missing = || Error::new(ErrorKind::Io, "is not part of the program").at(name.display().to_string());
    name.to_str().and_then(|name| FILES.get(name)).map(|text| &**text).ok_or_else(missing)
}
