//! An axis: its range, linear or logarithmic, and where its ticks are.

/// More powers of ten than this have a line for each of them and none in between.
const FEW: f64 = 1e9;
/// Labels that fit beside each other.
const LABELS: i32 = 7;
/// Around the values.
const ROOM: f64 = 1.6;

/// An axis of a chart.
#[derive(Clone, Debug, Default)]
pub(crate) struct Axis {
    pub(crate) label: String,
    pub(crate) range: [f64; 2],
    is_log: bool,
    /// How a value is written, if not as a plain number.
    words: Option<fn(f64) -> String>,
}

/// A tick: where, and its label if it has one.
pub(crate) type Tick = (f64, Option<String>);

impl Axis {
    /// Shows exactly `range`.
    pub(crate) fn linear(label: &str, range: [f64; 2]) -> Self {
        let [from, to] = range;
        let range = if to > from { range } else { [from, from + 1.0] };
        Self { label: label.to_owned(), range, is_log: false, words: None }
    }

    /// From zero to a round value at or above `top`.
    pub(crate) fn from_zero(label: &str, top: f64) -> Self {
        let top = if top.is_finite() && top > 0.0 { top } else { 1.0 };
        let step = round_step(top / 8.0);
        Self::linear(label, [0.0, (top / step).ceil() * step])
    }

    /// `range` with a little room on both sides, and more above, where marks have their labels.
    pub(crate) fn around(label: &str, [from, to]: [f64; 2]) -> Self {
        let room = if to > from { 0.08 * (to - from) } else { 0.5 * to.abs().max(1e-9) };
        Self::linear(label, [from - room, to + 2.0 * room])
    }

    /// Shows exactly `range`, which is above zero.
    pub(crate) fn log(label: &str, [from, to]: [f64; 2]) -> Self {
        Self::log_down_to(label, [from.max(1e-12), to])
    }

    /// The same however small it is.
    pub(crate) fn log_down_to(label: &str, [from, to]: [f64; 2]) -> Self {
        let to = if to > from { to } else { 10.0 * from };
        Self { label: label.to_owned(), range: [from, to], is_log: true, words: None }
    }

    /// The same with values written by `words`, such as `10 us`.
    pub(crate) fn in_words(self, words: fn(f64) -> String) -> Self {
        Self { words: Some(words), ..self }
    }

    /// Where a value is, from 0 to 1; below the range of a logarithmic axis at its end.
    pub(crate) fn place(&self, value: f64) -> f64 {
        let scale = |value: f64| if self.is_log { value.max(self.range[0]).log10() } else { value };
        let [from, to] = self.range.map(scale);
        (scale(value) - from) / (to - from)
    }

    pub(crate) fn ticks(&self) -> Vec<Tick> {
        let ticks = self.plain_ticks();
        let Some(words) = self.words else { return ticks };
        ticks.into_iter().map(|(value, label)| (value, label.map(|_| words(value)))).collect()
    }

    fn plain_ticks(&self) -> Vec<Tick> {
        let [from, to] = self.range;
        if !self.is_log {
            let step = round_step((to - from) / 5.0);
            let (first, last) = ((from / step - 1e-9).ceil() as i64, (to / step + 1e-9).floor() as i64);
            let decimals = (-step.log10().floor()).max(0.0) as usize;
            return (first..=last)
                .map(|n| n as f64 * step)
                .map(|value| (value, Some(format!("{value:.decimals$}"))))
                .collect();
        }
        if let Some(ticks) = decades(self.range) {
            return ticks;
        }
        let is_short = to / from < 100.0;
        let decades = from.log10().floor() as i32..=to.log10().ceil() as i32;
        let lines = decades.flat_map(|exponent| (1..10).map(move |n| (n, exponent)));
        let tick = |(n, exponent): (i32, i32)| {
            let is_labelled = n == 1 || is_short && matches!(n, 2 | 5);
            (f64::from(n) * 10_f64.powi(exponent), is_labelled.then(|| plain(n, exponent)))
        };
        let is_inside = |value: f64| (from * (1.0 - 1e-9)..=to * (1.0 + 1e-9)).contains(&value);
        lines.map(tick).filter(|(value, _)| is_inside(*value)).collect()
    }
}

/// `n` times a power of ten, written out.
fn plain(n: i32, exponent: i32) -> String {
    let decimals = (-exponent).max(0) as usize;
    format!("{:.decimals$}", f64::from(n) * 10_f64.powi(exponent))
}

/// The smallest of 1, 2 and 5 times a power of ten that is not below `step`.
pub(crate) fn round_step(step: f64) -> f64 {
    let power = 10_f64.powf(step.log10().floor());
    [1.0, 2.0, 5.0].map(|n| n * power).into_iter().find(|round| *round >= step * (1.0 - 1e-9)).unwrap_or(10.0 * power)
}

/// The ticks of an axis that is too long for lines between its powers of ten; `None` for a shorter one.
fn decades([from, to]: [f64; 2]) -> Option<Vec<Tick>> {
    if to / from < FEW {
        return None;
    }
    // Half a decade of nothing at an end has no tick.
    let (first, last) = ((from.log10() - 1e-9).ceil() as i32, (to.log10() + 1e-9).floor() as i32);
    let every = (last - first) / LABELS + 1;
    let tick = |exponent: i32| {
        let value = 10_f64.powi(exponent);
        (value, (exponent % every == 0).then(|| power(value)))
    };
    Some((first..=last).map(tick).collect())
}

impl Axis {
    /// A logarithmic axis that shows all of `values` which are above zero and finite, with powers of ten for labels.
    pub(crate) fn decades(label: &str, values: impl Iterator<Item = f64>) -> Self {
        let [low, high] = around(values);
        // Less than a decade has too few ticks to be read.
        let short = (10.0 * low / high).max(1.0).sqrt();
        Self::log_down_to(label, [low / short, high * short]).in_words(power)
    }
}

/// From below the least to above the largest of those above zero.
pub(crate) fn around(values: impl Iterator<Item = f64>) -> [f64; 2] {
    let shown = values.filter(|value| value.is_finite() && *value > 0.0);
    let [low, high] = shown.fold([f64::INFINITY, 0.0], |[low, high], value| [value.min(low), value.max(high)]);
    if low <= high { [low / ROOM, high * ROOM] } else { [0.1, 10.0] }
}

/// A value as a label: written out, or as a power of ten where that is shorter.
pub(crate) fn power(value: f64) -> String {
    match value.abs() {
        // Ticks are 1, 2 or 5 times a power of ten, within rounding.
        0.009_9..=50_000.0 => format!("{value:.5}").trim_end_matches('0').trim_end_matches('.').to_owned(),
        _ => format!("{value:.0e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(axis: &Axis) -> Vec<String> {
        axis.ticks().into_iter().filter_map(|(_, label)| label).collect()
    }

    #[test]
    fn ticks_are_round_and_inside() {
        assert_eq!(labels(&Axis::linear("", [0.0, 2.2])), ["0.0", "0.5", "1.0", "1.5", "2.0"]);
        assert_eq!(labels(&Axis::linear("", [1.233, 1.266])), ["1.24", "1.25", "1.26"]);
        assert_eq!(labels(&Axis::from_zero("", 97.0)), ["0", "20", "40", "60", "80", "100"]);
        assert_eq!(labels(&Axis::log("", [0.02, 30.0])), ["0.1", "1", "10"]);
        assert_eq!(labels(&Axis::log("", [0.1, 6.0])), ["0.1", "0.2", "0.5", "1", "2", "5"]);
        assert_eq!(Axis::log("", [0.1, 10.0]).ticks().len(), 19);
    }

    #[test]
    fn places_run_from_zero_to_one() {
        let axis = Axis::log("", [0.1, 10.0]);
        assert_eq!([0.1, 1.0, 10.0, 0.0].map(|value| axis.place(value)), [0.0, 0.5, 1.0, 0.0]);
        assert_eq!(Axis::linear("", [2.0, 4.0]).place(3.0), 0.5);
        assert_eq!(Axis::linear("", [2.0, 2.0]).range, [2.0, 3.0]);
        assert_eq!(Axis::around("", [1.0, 2.0]).range, [0.92, 2.16]);
    }

    #[test]
    fn a_long_axis_has_as_many_labels_as_fit() {
        let axis = Axis::decades("", [1e-14, 0.0, 1.0, f64::NAN].into_iter());
        assert_eq!(labels(&axis), ["1e-12", "1e-9", "1e-6", "1e-3", "1"]);
        // A line at each power of ten.
        assert_eq!(axis.ticks().len(), 15);
        assert!(axis.place(1e-14) > 0.0 && axis.place(1.0) < 1.0);
    }

    #[test]
    fn a_short_axis_has_more_than_one_label() {
        assert!(labels(&Axis::decades("", [3.0].into_iter())).len() >= 2);
        assert!(labels(&Axis::decades("", [0.001, 0.0012].into_iter())).len() >= 2);
        assert_eq!(labels(&Axis::decades("", std::iter::empty())), ["0.1", "1", "10"]);
        assert_eq!(around([0.0, 2.0, f64::NAN].into_iter()), [2.0 / ROOM, 2.0 * ROOM]);
    }

    #[test]
    fn labels_are_short() {
        assert_eq!([1e-6, 0.001, 0.5, 20.0, 1e5, 1e6].map(power), ["1e-6", "1e-3", "0.5", "20", "1e5", "1e6"]);
    }
}
