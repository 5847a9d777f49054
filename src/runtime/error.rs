//! Errors of the runtime: one line that says what, where and what to do.

use std::fmt;

/// Any error: an actor's start and a factory of actors may fail with it.
pub type ActorError = Box<dyn std::error::Error + Send + Sync>;

/// The kind of a [`GraphError`], as far as a program can act on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum GraphErrorKind {
    /// A graph was refused, or the system gave it no thread. Change the rate groups; a retry does not help.
    Refused,
    /// A recording has gaps. Record again with longer queues.
    Recording,
    /// An actor or a factory of actors failed or panicked while the graph was started.
    Actor,
}

/// The error of every fallible operation of the runtime.
///
/// # Real-time
/// Not real-time safe: allocates. Before the run.
///
/// # Real-time
/// Allocates: no tick makes one.
#[derive(Debug)]
pub struct GraphError {
    kind: GraphErrorKind,
    /// Where: a rate group, an actor. Empty if the message says it all.
    place: String,
    message: String,
    source: Option<ActorError>,
}

impl GraphError {
    pub(crate) fn new(kind: GraphErrorKind, message: impl Into<String>) -> Self {
        Self { kind, place: String::new(), message: one_line(&message.into()), source: None }
    }

    /// The refusal of a graph, or of a thread for it.
    pub(crate) fn refused(message: impl Into<String>) -> Self {
        Self::new(GraphErrorKind::Refused, message)
    }

    /// The error that an actor's start or a factory returned.
    pub(crate) fn from_actor(source: ActorError) -> Self {
        Self { source: Some(source), ..Self::new(GraphErrorKind::Actor, String::new()) }
    }

    /// The same error with its place put in front: `place: earlier place: message`.
    #[must_use]
    pub(crate) fn at(mut self, place: impl AsRef<str>) -> Self {
        let place = place.as_ref();
        self.place = if self.place.is_empty() { place.to_owned() } else { format!("{place}: {}", self.place) };
        self
    }

    /// Puts the rate group in front in which it happened.
    #[must_use]
    pub(crate) fn in_group(self, name: &str) -> Self {
        self.at(format!("rate group `{name}`"))
    }

    /// The kind, for programs.
    pub fn kind(&self) -> GraphErrorKind {
        self.kind
    }

    /// The rate group and actor that it happened in, in words; empty where it concerns the whole graph.
    pub fn place(&self) -> &str {
        &self.place
    }

    /// What is wrong and what would be right, without the place; empty where an actor's own error says it.
    pub fn message(&self) -> &str {
        &self.message
    }

    /// The error that an actor or a factory returned; the graph's own errors have none and come back as they are.
    ///
    /// # Errors
    /// The graph's own errors come back whole.
    pub fn into_actor_error(self) -> Result<ActorError, Self> {
        match self.source {
            Some(source) => Ok(source),
            None => Err(self),
        }
    }
}

impl fmt::Display for GraphError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if !self.place.is_empty() {
            write!(f, "{}: ", self.place)?;
        }
        match &self.source {
            Some(source) => write!(f, "{source}"),
            None => f.write_str(&self.message),
        }
    }
}

impl std::error::Error for GraphError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        self.source.as_deref().map(|source| source as _)
    }
}

/// A panic's text may have several lines.
fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}
