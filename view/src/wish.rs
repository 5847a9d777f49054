//! What a page may say: a handful of short messages, none of which can name a file.

use palpate::scene::ModelChoice;
use serde::Deserialize;

/// Larger places and times are no place and no time.
const LARGEST: f64 = 1e3;
/// Friction that tissue and tools have, with room.
const MOST_FRICTION: f64 = 2.0;
/// How much softer or stiffer the body may be made.
const STIFFNESS: std::ops::RangeInclusive<f64> = 0.1..=10.0;

/// A message of the page.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(tag = "do", rename_all = "snake_case", deny_unknown_fields)]
pub(crate) enum Wish {
    /// The visitor knows the token of the address.
    Enter { token: String },
    /// The pointer of a device is at a place (m).
    Move { device: usize, to: [f64; 3] },
    /// Another session takes the place of this one: changed, or as it was.
    Restart(Change),
    /// What a log shows at a time (s).
    Seek { time: f64 },
}

/// What a visitor changed; what is absent stays.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct Change {
    /// The name of the local model.
    pub(crate) model: Option<String>,
    /// Coulomb coefficient.
    pub(crate) friction: Option<f64>,
    /// The stiffness of the whole body, in that of the scene.
    pub(crate) stiffness: Option<f64>,
}

impl Wish {
    /// The message in `text`, if it is one and every number of it can be.
    pub(crate) fn read(text: &str) -> Option<Self> {
        let wish: Self = serde_json::from_str(text).ok()?;
        let is_good = match &wish {
            Self::Enter { .. } => true,
            Self::Move { to, .. } => to.iter().all(|c| c.is_finite() && c.abs() <= LARGEST),
            Self::Seek { time } => time.is_finite() && *time >= 0.0,
            Self::Restart(change) => change.can_be(),
        };
        is_good.then_some(wish)
    }
}

impl Change {
    fn can_be(&self) -> bool {
        self.model.as_deref().is_none_or(|name| ModelChoice::from_name(name).is_some())
            && self.friction.is_none_or(|mu| (0.0..=MOST_FRICTION).contains(&mu))
            && self.stiffness.is_none_or(|factor| STIFFNESS.contains(&factor))
    }

    /// This change after an `earlier` one.
    pub(crate) fn after(self, earlier: Self) -> Self {
        Self {
            model: self.model.or(earlier.model),
            friction: self.friction.or(earlier.friction),
            stiffness: self.stiffness.or(earlier.stiffness),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_the_page_says_is_understood() {
        let to = [0.1, -0.02, 3e-3];
        assert_eq!(Wish::read(r#"{"do":"move","device":0,"to":[0.1,-0.02,3e-3]}"#), Some(Wish::Move { device: 0, to }));
        assert_eq!(Wish::read(r#"{"do":"seek","time":1.5}"#), Some(Wish::Seek { time: 1.5 }));
        let change = Change { model: Some("hold".into()), friction: Some(0.3), stiffness: None };
        assert_eq!(Wish::read(r#"{"do":"restart","model":"hold","friction":0.3}"#), Some(Wish::Restart(change)));
        assert_eq!(Wish::read(r#"{"do":"restart"}"#), Some(Wish::Restart(Change::default())));
    }

    #[test]
    fn what_cannot_be_is_nothing() {
        for text in [
            "",
            "{}",
            "move",
            "[1]",
            r#"{"do":"move","device":0,"to":[NaN,0,0]}"#,
            r#"{"do":"move","device":0,"to":[1e308,0,0]}"#,
            r#"{"do":"move","device":0,"to":[1e999,0,0]}"#,
            r#"{"do":"move","device":0,"to":[0,0]}"#,
            r#"{"do":"move","device":0,"to":[null,0,0]}"#,
            r#"{"do":"move","device":-1,"to":[0,0,0]}"#,
            r#"{"do":"move","device":0,"to":[0,0,0],"file":"/etc/passwd"}"#,
            r#"{"do":"restart","model":"../../x"}"#,
            r#"{"do":"restart","friction":-1}"#,
            r#"{"do":"restart","stiffness":1e9}"#,
            r#"{"do":"restart","scene":"x.toml"}"#,
            r#"{"do":"seek","time":-1}"#,
            r#"{"do":"open","path":"x"}"#,
        ] {
            assert_eq!(Wish::read(text), None, "{text}");
        }
    }

    #[test]
    fn a_change_keeps_what_was_changed_before() {
        let earlier = Change { model: Some("hold".into()), friction: Some(0.3), stiffness: None };
        let both = Change { friction: Some(0.5), stiffness: Some(2.0), model: None }.after(earlier);
        assert_eq!(both, Change { model: Some("hold".into()), friction: Some(0.5), stiffness: Some(2.0) });
    }
}
