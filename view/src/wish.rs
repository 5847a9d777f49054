//! What a page may say: a handful of short messages, none of which can name a file.

use palpate::scene::ModelChoice;
use serde::Deserialize;

/// Larger places and times are no place and no time.
const LARGEST: f64 = 1e3;
/// Friction that tissue and tools have, with room.
const MOST_FRICTION: f64 = 2.0;
/// Over more no friction of a surface falls (m/s).
const FASTEST_STRIBECK: f64 = 1.0;
/// How much softer or stiffer the body may be made.
const STIFFNESS: std::ops::RangeInclusive<f64> = 0.1..=10.0;

/// A message of the page.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(tag = "do", rename_all = "snake_case", deny_unknown_fields)]
pub(crate) enum Wish {
    /// The visitor knows the token of the address. A page whose connection was cut comes `again` with the key that it was given.
    Enter { token: String, again: Option<String> },
    /// The pointer of a device is at a place (m).
    Move { device: usize, to: [f64; 3] },
    /// Friction, stiffness or model become another while the session runs.
    Change(Change),
    /// The body starts anew, with what was changed.
    Restart {},
    /// The browser is shown the stress of the body, or no more.
    Stress { shown: bool },
    /// What a log shows at a time (s).
    Seek { time: f64 },
}

/// What a visitor changed; what is absent stays.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct Change {
    /// The name of the local model.
    pub(crate) model: Option<String>,
    /// Coulomb coefficient of sliding.
    pub(crate) friction: Option<f64>,
    /// What breaks a sticking tool loose.
    pub(crate) static_friction: Option<f64>,
    /// The speed over which it falls from one to the other (m/s).
    pub(crate) stribeck_m_s: Option<f64>,
    /// The stiffness of the whole body, in that of the scene.
    pub(crate) stiffness: Option<f64>,
}

impl Wish {
    /// The message in `text`, if it is one and every number of it can be.
    pub(crate) fn read(text: &str) -> Option<Self> {
        let wish: Self = serde_json::from_str(text).ok()?;
        let is_good = match &wish {
            Self::Enter { .. } | Self::Restart {} | Self::Stress { .. } => true,
            Self::Move { to, .. } => to.iter().all(|c| c.is_finite() && c.abs() <= LARGEST),
            Self::Seek { time } => time.is_finite() && *time >= 0.0,
            Self::Change(change) => change.can_be(),
        };
        is_good.then_some(wish)
    }
}

impl Change {
    fn can_be(&self) -> bool {
        self.model.as_deref().is_none_or(|name| ModelChoice::from_name(name).is_some())
            && [self.friction, self.static_friction].iter().flatten().all(|mu| (0.0..=MOST_FRICTION).contains(mu))
            && self.stribeck_m_s.is_none_or(|speed| (0.0..=FASTEST_STRIBECK).contains(&speed))
            && self.stiffness.is_none_or(|factor| STIFFNESS.contains(&factor))
    }

    /// This change after an `earlier` one.
    pub(crate) fn after(self, earlier: Self) -> Self {
        Self {
            model: self.model.or(earlier.model),
            friction: self.friction.or(earlier.friction),
            static_friction: self.static_friction.or(earlier.static_friction),
            stribeck_m_s: self.stribeck_m_s.or(earlier.stribeck_m_s),
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
        let enter = |again: Option<&str>| Wish::Enter { token: "t".into(), again: again.map(str::to_owned) };
        assert_eq!(Wish::read(r#"{"do":"enter","token":"t"}"#), Some(enter(None)));
        assert_eq!(Wish::read(r#"{"do":"enter","token":"t","again":"k"}"#), Some(enter(Some("k"))));
        let change = Change { model: Some("hold".into()), friction: Some(0.3), ..Change::default() };
        assert_eq!(Wish::read(r#"{"do":"change","model":"hold","friction":0.3}"#), Some(Wish::Change(change)));
        assert_eq!(Wish::read(r#"{"do":"restart"}"#), Some(Wish::Restart {}));
        assert_eq!(Wish::read(r#"{"do":"stress","shown":true}"#), Some(Wish::Stress { shown: true }));
    }

    /// Check that a limit that the page was told is not beyond it, or short of it, when the page says it again.
    #[test]
    fn numbers_come_back_as_they_were_told() {
        for n in 0..2000 {
            let stiffness = 1.0 + 5.0 * (1.7 * f64::from(n)).sin().abs();
            let told = serde_json::json!({ "do": "change", "stiffness": stiffness }).to_string();
            let change = Change { stiffness: Some(stiffness), ..Change::default() };
            assert_eq!(Wish::read(&told), Some(Wish::Change(change)), "{told}");
        }
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
            r#"{"do":"change","model":"../../x"}"#,
            r#"{"do":"change","friction":-1}"#,
            r#"{"do":"change","static_friction":1e9}"#,
            r#"{"do":"change","stribeck_m_s":-0.1}"#,
            r#"{"do":"change","stiffness":1e9}"#,
            r#"{"do":"change","scene":"x.toml"}"#,
            r#"{"do":"stress","shown":"x"}"#,
            r#"{"do":"restart","scene":"x.toml"}"#,
            r#"{"do":"seek","time":-1}"#,
            r#"{"do":"open","path":"x"}"#,
        ] {
            assert_eq!(Wish::read(text), None, "{text}");
        }
    }

    #[test]
    fn a_change_keeps_what_was_changed_before() {
        let earlier = Change { model: Some("hold".into()), friction: Some(0.3), ..Change::default() };
        let both = Change { friction: Some(0.5), stiffness: Some(2.0), ..Change::default() }.after(earlier.clone());
        assert_eq!(both, Change { friction: Some(0.5), stiffness: Some(2.0), ..earlier });
    }
}
