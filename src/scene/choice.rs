//! Which local model a scene asks for: one by name, or the one that a session chooses.

use super::LocalModelKind;

/// A local model by name, or the choice of one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum ModelChoice {
    /// The cheapest that fits the rates and meets [`LocalSpec::error_pct`](super::LocalSpec::error_pct), chosen when a
    /// session is built.
    #[default]
    Auto,
    /// This one.
    Named(LocalModelKind),
}

impl ModelChoice {
    /// Every choice by name: the models in order of cost, then `auto`.
    pub const NAMES: &'static [&'static str] = &NAMES;

    /// Its name in scene files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => AUTO,
            Self::Named(kind) => kind.name(),
        }
    }

    /// The choice with this name.
    pub fn from_name(name: &str) -> Option<Self> {
        let named = || LocalModelKind::ALL.into_iter().find(|kind| kind.name() == name).map(Self::Named);
        if name == AUTO { Some(Self::Auto) } else { named() }
    }

    /// The model, if it is named.
    pub fn named(self) -> Option<LocalModelKind> {
        match self {
            Self::Auto => None,
            Self::Named(kind) => Some(kind),
        }
    }

    /// True if `holds` is true of the model, or of every one that could be chosen.
    pub(crate) fn all(self, holds: impl Fn(LocalModelKind) -> bool) -> bool {
        match self {
            Self::Auto => LocalModelKind::ALL.into_iter().all(holds),
            Self::Named(kind) => holds(kind),
        }
    }
}

const AUTO: &str = "auto";

const NAMES: [&str; LocalModelKind::ALL.len() + 1] = {
    let mut names = [AUTO; LocalModelKind::ALL.len() + 1];
    let mut index = 0;
    while index < LocalModelKind::ALL.len() {
        names[index] = LocalModelKind::ALL[index].name();
        index += 1;
    }
    names
};

impl From<LocalModelKind> for ModelChoice {
    fn from(kind: LocalModelKind) -> Self {
        Self::Named(kind)
    }
}

impl serde::Serialize for ModelChoice {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

impl<'de> serde::Deserialize<'de> for ModelChoice {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Name;
        impl serde::de::Visitor<'_> for Name {
            type Value = ModelChoice;

            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("the name of a local model")
            }

            fn visit_str<E: serde::de::Error>(self, name: &str) -> Result<ModelChoice, E> {
                ModelChoice::from_name(name).ok_or_else(|| E::unknown_variant(name, ModelChoice::NAMES))
            }
        }
        deserializer.deserialize_str(Name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_is_that_of_one_choice_and_auto_is_no_model() {
        for name in ModelChoice::NAMES {
            assert_eq!(ModelChoice::from_name(name).map(ModelChoice::name), Some(*name));
        }
        assert_eq!(ModelChoice::NAMES.len(), LocalModelKind::ALL.len() + 1);
        assert_eq!(ModelChoice::default().named(), None);
        assert_eq!(ModelChoice::from_name("boundary"), None);
    }
}
