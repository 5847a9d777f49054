//! What is wrong with a scene file, before the line is known: a dotted field, a place in the text, a message.

use std::fmt;

use serde::de::{Error, Expected, Unexpected};

use super::suggest::suggest;
use crate::error::quoted;

/// One reason to refuse a scene file.
///
/// It starts where serde finds it and collects field and place on its way out through the tables.
#[derive(Debug)]
pub(super) struct Fault {
    /// Dotted path, such as `body.block.nodes` or `probe[1].node`; empty for the whole file.
    pub(super) field: String,
    /// Byte offset in the text; the innermost value that is known.
    pub(super) offset: Option<usize>,
    /// What is wrong and what would be right.
    pub(super) message: String,
}

impl Fault {
    pub(super) fn new(message: impl Into<String>) -> Self {
        Self { field: String::new(), offset: None, message: message.into() }
    }

    /// The fault is inside `key` of the table around it.
    pub(super) fn under_key(mut self, key: &str) -> Self {
        let separator = if self.field.is_empty() || self.field.starts_with('[') { "" } else { "." };
        self.field = format!("{}{separator}{}", plain_key(key), self.field);
        self
    }

    /// The fault is inside entry `index` of the array around it.
    pub(super) fn under_index(mut self, index: usize) -> Self {
        let separator = if self.field.is_empty() || self.field.starts_with('[') { "" } else { "." };
        self.field = format!("[{index}]{separator}{}", self.field);
        self
    }

    /// The fault is at `offset`, unless a place further in is known.
    pub(super) fn or_at(mut self, offset: usize) -> Self {
        self.offset.get_or_insert(offset);
        self
    }
}

/// Twice the longest key that a scene knows.
const LONGEST_BARE: usize = 64;

/// A key as TOML writes it, quoted and escaped where it must be, so that it never breaks a line, and shortened.
pub(super) fn plain_key(key: &str) -> String {
    let bare = !key.is_empty() && key.bytes().all(|byte| byte.is_ascii_alphanumeric() || b"_-".contains(&byte));
    if bare && key.len() <= LONGEST_BARE { key.to_owned() } else { quoted(key) }
}

/// `"a", "b" or "c"`.
pub(super) fn one_of(words: &[&str]) -> String {
    match words {
        [] => "nothing".to_owned(),
        [word] => format!("{word:?}"),
        [first @ .., last] => {
            let first: Vec<String> = first.iter().map(|word| format!("{word:?}")).collect();
            format!("{} or {last:?}", first.join(", "))
        }
    }
}

fn found(unexpected: &Unexpected<'_>) -> String {
    match *unexpected {
        Unexpected::Str(text) => quoted(text),
        Unexpected::Bool(value) => value.to_string(),
        Unexpected::Unsigned(value) => value.to_string(),
        Unexpected::Signed(value) => value.to_string(),
        Unexpected::Float(value) => value.to_string(),
        Unexpected::Seq => "an array".to_owned(),
        Unexpected::Map => "a table".to_owned(),
        other => other.to_string(),
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.field, self.message)
    }
}

impl std::error::Error for Fault {}

impl Error for Fault {
    fn custom<T: fmt::Display>(message: T) -> Self {
        Self::new(message.to_string())
    }

    fn invalid_type(unexpected: Unexpected<'_>, expected: &dyn Expected) -> Self {
        Self::new(format!("is {}, must be {expected}", found(&unexpected)))
    }

    fn invalid_value(unexpected: Unexpected<'_>, expected: &dyn Expected) -> Self {
        Self::invalid_type(unexpected, expected)
    }

    fn unknown_variant(variant: &str, expected: &'static [&'static str]) -> Self {
        Self::new(format!("is {}, must be {}", quoted(variant), one_of(expected)))
    }

    fn unknown_field(key: &str, expected: &'static [&'static str]) -> Self {
        Self::new(match suggest(key, expected) {
            Some(meant) => format!("unknown key, did you mean {meant}?"),
            None => format!("unknown key, the keys here are {}", expected.join(", ")),
        })
    }

    fn missing_field(key: &'static str) -> Self {
        Self::new("is missing, it has no default").under_key(key)
    }

    fn duplicate_field(key: &'static str) -> Self {
        Self::new("is given twice, keep one").under_key(key)
    }
}
