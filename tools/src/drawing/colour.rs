//! The colours of pictures for documents.

use std::fmt::{self, Display, Formatter};

/// A colour of a [`Picture`](super::Picture) or a [`Sheet`](super::Sheet). People who see colours differently tell them apart, too.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Colour(usize);

impl Colour {
    /// Near black, for a reference.
    pub const INK: Self = Self(0);
    /// The colour of most curves.
    pub const BLUE: Self = Self(1);
    /// A vermilion, for what diverges.
    pub const RED: Self = Self(2);
    /// A bluish green.
    pub const GREEN: Self = Self(3);
    /// A dark yellow, for the second curve.
    pub const ORANGE: Self = Self(5);
    /// A light grey, for what is drawn beside a theory.
    pub const GREY: Self = Self(8);

    /// One of eight colours, again from the first after the last; 0 is the reference's.
    pub const fn numbered(number: usize) -> Self {
        Self(number % 8)
    }
}

/// The class of the colour in the styles of a document.
impl Display for Colour {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        write!(f, "c{}", self.0)
    }
}
