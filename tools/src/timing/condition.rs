//! What a log must not be like: `local.lateness.p99 > 200us`.

use std::fmt;
use std::str::FromStr;

use palpate::{Error, ErrorKind};

use super::figures::{Figure, Unit};

/// How a figure is compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Relation {
    Above,
    AtLeast,
    Below,
    AtMost,
}

impl Relation {
    /// Longest first, so that `>=` is not read as `>`.
    const ALL: [(&'static str, Self); 4] =
        [(">=", Self::AtLeast), ("<=", Self::AtMost), (">", Self::Above), ("<", Self::Below)];

    fn holds(self, value: f64, bound: f64) -> bool {
        match self {
            Self::Above => value > bound,
            Self::AtLeast => value >= bound,
            Self::Below => value < bound,
            Self::AtMost => value <= bound,
        }
    }
}

/// A figure, a relation and a bound with its unit, as text: `local.lateness.p99 > 200us`, `local.skipped > 0`,
/// `resync.jump_after.max > 50mN`, `core1.utilisation >= 80%`.
///
/// Units are `ns`, `us`, `ms`, `s`, `uN`, `mN`, `N`, `uJ`, `mJ`, `J` and `%`; a count has none. A figure that is not a
/// number fulfils every condition, so that it is seen.
#[derive(Clone, Debug, PartialEq)]
pub struct Condition {
    text: String,
    figure: String,
    relation: Relation,
    bound: f64,
    unit: &'static str,
}

/// The units that a bound can have: name, what it measures, factor to the figure's own unit.
const UNITS: [(&str, Unit, f64); 14] = [
    ("ns", Unit::Nanoseconds, 1.0),
    ("us", Unit::Nanoseconds, 1e3),
    ("\u{b5}s", Unit::Nanoseconds, 1e3),
    ("ms", Unit::Nanoseconds, 1e6),
    ("s", Unit::Nanoseconds, 1e9),
    ("uN", Unit::Newtons, 1e-6),
    ("mN", Unit::Newtons, 1e-3),
    ("N", Unit::Newtons, 1.0),
    ("uJ", Unit::Joules, 1e-6),
    ("mJ", Unit::Joules, 1e-3),
    ("J", Unit::Joules, 1.0),
    ("%", Unit::Share, 1e-2),
    ("", Unit::Count, 1.0),
    ("", Unit::Share, 1.0),
];

impl FromStr for Condition {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        let refuse = |why: &str| {
            let message = format!("condition `{text}`: {why}; write for example `local.lateness.p99 > 200us`");
            Error::new(ErrorKind::Usage, message)
        };
        let split = Relation::ALL.iter().find_map(|(sign, relation)| Some((text.split_once(sign)?, *relation)));
        let ((figure, bound), relation) = split.ok_or_else(|| refuse("has none of > >= < <="))?;
        let (figure, bound) = (figure.trim().replace("p99.9", "p999"), bound.trim());
        let number = bound.trim_end_matches(|c: char| c.is_alphabetic() || c == '%');
        let value: f64 = number.trim().parse().map_err(|_| refuse("its bound is no number"))?;
        let name = bound[number.len()..].trim();
        let known = UNITS.iter().find(|(unit, ..)| *unit == name);
        let (unit, ..) = known.ok_or_else(|| refuse(&format!("has the unknown unit `{name}`")))?;
        if figure.is_empty() || !value.is_finite() {
            return Err(refuse("needs a figure on the left and a finite number on the right"));
        }
        Ok(Self { text: text.trim().to_owned(), figure, relation, bound: value, unit })
    }
}

impl fmt::Display for Condition {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

impl Condition {
    /// The figure that fulfils the condition; `None` if it does not hold.
    ///
    /// # Errors
    /// [`ErrorKind::Usage`] if there is no such figure, or if the unit is not one of its.
    pub fn broken_by<'a>(&self, figures: &'a [Figure]) -> Result<Option<&'a Figure>, Error> {
        let figure = figures.iter().find(|figure| figure.name == self.figure).ok_or_else(|| self.unknown(figures))?;
        let value = figure.value.as_f64();
        let holds = self.relation.holds(value, self.bound_for(figure)?);
        Ok((holds || value.is_nan()).then_some(figure))
    }

    fn bound_for(&self, figure: &Figure) -> Result<f64, Error> {
        // Seconds are nanoseconds in another measure.
        let (of, scale) = match figure.unit {
            Unit::Seconds => (Unit::Nanoseconds, 1e-9),
            unit => (unit, 1.0),
        };
        let factor = UNITS.iter().find(|(name, unit, _)| *name == self.unit && *unit == of);
        let units = || {
            let names = UNITS.iter().filter(|(name, unit, _)| *unit == of && !name.is_empty());
            names.map(|(name, ..)| *name).collect::<Vec<_>>().join(", ")
        };
        let refuse = || {
            let needs = match units() {
                none if none.is_empty() => "is a count and has no unit".to_owned(),
                some => format!("needs one of the units {some}"),
            };
            Error::new(ErrorKind::Usage, format!("condition `{self}`: {} {needs}", figure.name))
        };
        factor.map(|(_, _, factor)| self.bound * factor * scale).ok_or_else(refuse)
    }

    fn unknown(&self, figures: &[Figure]) -> Error {
        let counted = format!("{}.count", self.figure.rsplit_once('.').map_or("", |(of, _)| of));
        let has_none = figures.iter().any(|figure| figure.name == counted);
        let message = if has_none {
            format!("condition `{self}`: the log has no sample of {}", self.figure)
        } else {
            let first = self.figure.split('.').next().unwrap_or_default();
            let alike: Vec<&str> = figures
                .iter()
                .map(|figure| figure.name.as_str())
                .filter(|name| name.split('.').next() == Some(first))
                .collect();
            let all = "`palpate timing LOG --json` lists them all under `figures`";
            match alike.as_slice() {
                [] => format!("condition `{self}`: the log has no figure {}; {all}", self.figure),
                alike => format!(
                    "condition `{self}`: the log has no figure {}, but {}; {all}",
                    self.figure,
                    alike[..alike.len().min(8)].join(", ")
                ),
            }
        };
        Error::new(ErrorKind::Usage, message)
    }
}

#[cfg(test)]
mod tests {
    use super::super::figures::FigureValue;
    use super::*;

    fn figures() -> Vec<Figure> {
        let figure = |name: &str, unit, value| Figure { name: name.to_owned(), unit, value };
        vec![
            figure("local.lateness.count", Unit::Count, FigureValue::Integer(9)),
            figure("local.lateness.p999", Unit::Nanoseconds, FigureValue::Integer(200_000)),
            figure("local.jitter.count", Unit::Count, FigureValue::Integer(0)),
            figure("force.model_age.p99", Unit::Seconds, FigureValue::Real(0.05)),
            figure("resync.jump_after.max", Unit::Newtons, FigureValue::Real(f64::NAN)),
            figure("core1.utilisation", Unit::Share, FigureValue::Real(0.8)),
        ]
    }

    fn broken(condition: &str) -> bool {
        condition.parse::<Condition>().unwrap().broken_by(&figures()).unwrap().is_some()
    }

    #[test]
    fn a_bound_is_compared_in_the_unit_of_its_figure() {
        assert!(!broken("local.lateness.p999 > 200us") && broken("local.lateness.p99.9>=0.2ms"));
        assert!(broken("local.lateness.p999 < 1 s") && !broken("local.lateness.p999 <= 199999ns"));
        assert!(broken("force.model_age.p99 > 49ms") && !broken("force.model_age.p99 > 50ms"));
        assert!(broken("core1.utilisation >= 80%") && !broken("core1.utilisation > 0.8"));
        assert!(broken("local.lateness.count < 10"));
        // Check that what is no number does not pass unseen
        assert!(broken("resync.jump_after.max > 5N") && broken("resync.jump_after.max < 5N"));
    }

    #[test]
    fn what_cannot_be_compared_is_refused_in_words() {
        let error = |condition: &str| match condition.parse::<Condition>() {
            Ok(condition) => condition.broken_by(&figures()).unwrap_err().to_string(),
            Err(error) => error.to_string(),
        };
        for (condition, words) in [
            ("local.lateness.p999", "has none of"),
            ("local.lateness.p999 > fast", "no number"),
            ("local.lateness.p999 > 5 furlong", "unknown unit `furlong`"),
            ("local.lateness.p999 > 5", "needs one of the units ns, us"),
            ("local.lateness.count > 5us", "is a count and has no unit"),
            ("local.latenes.p999 > 5us", "no figure local.latenes.p999, but local.lateness.count"),
            ("local.jitter.p99 > 5us", "no sample of local.jitter.p99"),
            ("nothing > 5us", "--json"),
            ("> 5us", "needs a figure"),
        ] {
            assert!(error(condition).contains(words), "{condition}: {}", error(condition));
        }
    }
}
