//! Settings that the local model of a session has no use for: they are said, so that nobody takes them for what is felt.

use crate::model::local::{BlendKind, Kind};
use crate::scene::{GlobalSpec, Scene};

/// What `scene` sets and `kind` does not use, as it is called in scenes. `has_global` says that a program gave a global group.
pub(super) fn settings(scene: &Scene, kind: Kind, has_global: bool) -> Vec<&'static str> {
    let local = &scene.local;
    // What is switched to may use all; over a link nothing is.
    let switchable = scene.run.switchable && scene.link.is_none();
    let is_alone = kind == Kind::Full && !switchable;
    let is_global_set = has_global || scene.global.rate_hz != GlobalSpec::default().rate_hz;
    let blend = match local.blend.kind {
        BlendKind::None => None,
        BlendKind::Crossfade | BlendKind::Offset => Some("local.blend"),
    };
    [
        blend.filter(|_| is_alone),
        (is_alone && is_global_set).then_some("global.rate_hz"),
        (is_alone && scene.link.is_some()).then_some("link"),
        (is_alone && local.feedback.is_some()).then_some("local.feedback"),
        (!switchable && local.patch.is_some() && !kind.has_patch()).then_some("local.patch"),
        (!switchable && local.basis.is_some() && kind != Kind::Predictive).then_some("local.basis"),
    ]
    .into_iter()
    .flatten()
    .collect()
}

/// `settings` in a clause, if there are any.
pub(super) fn in_words<T: AsRef<str>>(settings: &[T], kind: Kind) -> Option<String> {
    let (last, first) = settings.split_last()?;
    let mut words = format!("without effect in {}: ", kind.name());
    for (at, setting) in first.iter().enumerate() {
        words.push_str(setting.as_ref());
        words.push_str(if at + 1 == first.len() { " and " } else { ", " });
    }
    Some(words + last.as_ref())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{BlendSpec, LinkSpec};

    #[test]
    fn what_a_model_does_not_use_is_named_and_nothing_else() {
        let mut scene = Scene::of_program();
        assert_eq!(settings(&scene, Kind::Full, false), [""; 0]);
        scene.local.blend = BlendSpec { kind: BlendKind::Crossfade, ms: 10.0 };
        scene.local.basis = Some(50);
        assert_eq!(settings(&scene, Kind::Full, true), ["local.blend", "global.rate_hz", "local.basis"]);
        assert_eq!(settings(&scene, Kind::Patch, true), ["local.basis"]);
        assert_eq!(settings(&scene, Kind::Predictive, true), [""; 0]);
        let words = in_words(&settings(&scene, Kind::Full, true), Kind::Full).unwrap();
        assert_eq!(words, "without effect in full: local.blend, global.rate_hz and local.basis");
        scene.run.switchable = true;
        assert_eq!(settings(&scene, Kind::Full, true), [""; 0]);
        assert_eq!(in_words::<&str>(&[], Kind::Full), None);
        scene = Scene { link: Some(LinkSpec::default()), ..Scene::of_program() };
        assert_eq!(settings(&scene, Kind::Predictive, true), [""; 0]);
        assert_eq!(settings(&scene, Kind::Full, false), ["link"]);
        scene.run.switchable = true;
        assert_eq!(settings(&scene, Kind::Full, false), ["link"], "nothing else is switched to over it");
    }
}
