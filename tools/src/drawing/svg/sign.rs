//! Small signs that differ in shape: what is told apart by colour must not be told apart by colour alone.

/// The shape of a mark.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Sign {
    /// A triangle that stands on a side.
    Triangle,
    /// A square that stands on a side.
    Square,
    /// A square that stands on a corner.
    Diamond,
    /// A disc.
    #[default]
    Disc,
    /// A diagonal cross.
    Cross,
}

impl Sign {
    /// The outline of the sign around a point, as the data of an SVG path.
    pub(crate) fn path(self, x: f64, y: f64) -> String {
        match self {
            Self::Triangle => format!("M{x:.1} {:.1}l4 7h-8z", y - 4.0),
            Self::Square => format!("M{:.1} {:.1}h6v6h-6z", x - 3.0, y - 3.0),
            Self::Diamond => format!("M{x:.1} {:.1}l4 4l-4 4l-4 -4z", y - 4.0),
            Self::Disc => format!("M{:.1} {y:.1}a3.5 3.5 0 1 0 7 0a3.5 3.5 0 1 0 -7 0z", x - 3.5),
            Self::Cross => {
                format!("M{:.1} {:.1}l3 3l3 -3l1 1l-3 3l3 3l-1 1l-3 -3l-3 3l-1 -1l3 -3l-3 -3z", x - 3.0, y - 4.0)
            }
        }
    }
}
