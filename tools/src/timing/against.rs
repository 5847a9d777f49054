//! Two logs side by side.

use std::collections::HashMap;

use super::analysis::{Block, Buckets, GroupTiming, TimingReport};
use super::bootstrap::{percentile_ratios, share_ratio};
use super::figures::Figure;

/// One figure in both logs.
#[derive(Clone, Debug, PartialEq)]
pub struct ComparedFigure {
    /// Its value in the log, with name and unit.
    pub this: Figure,
    /// Its value in the log that this one is held against.
    pub other: Figure,
    /// This over other; `None` if one of them is zero or no number.
    pub ratio: Option<f64>,
    /// Where 95 % of the ratios lie that runs like these two would give; `None` if the logs hold too little to say, or if
    /// a figure is a single sample, such as a maximum.
    pub interval: Option<[f64; 2]>,
}

impl ComparedFigure {
    /// True if the interval leaves no doubt that the two differ.
    pub fn differs(&self) -> bool {
        self.interval.is_some_and(|[low, high]| low > 1.0 || high < 1.0)
    }
}

/// A log held against another.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Against {
    /// The figures that both have, in the order of [`TimingReport::figures`].
    pub figures: Vec<ComparedFigure>,
    /// Names of figures that one of the two alone has.
    pub unmatched: Vec<String>,
}

impl Against {
    /// Holds `this` against `other`.
    pub fn of(this: &TimingReport, other: &TimingReport) -> Self {
        let (mine, theirs) = (this.figures(), other.figures());
        let (in_mine, in_theirs) = (by(&mine, |figure| &figure.name), by(&theirs, |figure| &figure.name));
        let groups = by(&other.groups, |group| &group.name);
        let mut intervals = HashMap::new();
        for group in this.groups.iter().rev() {
            if let Some(of_other) = groups.get(group.name.as_str()) {
                intervals.extend(group_intervals(group, of_other));
            }
        }
        let interval = |name: &str| intervals.get(name).copied().flatten();
        let unmatched = mine.iter().filter(|figure| !in_theirs.contains_key(figure.name.as_str()));
        let unmatched = unmatched.chain(theirs.iter().filter(|figure| !in_mine.contains_key(figure.name.as_str())));
        let unmatched = unmatched.map(|figure| figure.name.clone()).collect();
        let compare = |figure: &Figure| {
            let (figure, other) = (figure.clone(), (*in_theirs.get(figure.name.as_str())?).clone());
            let ratio = figure.value.as_f64() / other.value.as_f64();
            let ratio = (ratio.is_finite() && ratio > 0.0).then_some(ratio);
            Some(ComparedFigure { interval: ratio.and(interval(&figure.name)), this: figure, other, ratio })
        };
        Self { figures: mine.iter().filter_map(compare).collect(), unmatched }
    }
}

/// What has a name, by it; the first of several.
fn by<'a, T>(all: &'a [T], name: impl Fn(&'a T) -> &'a str) -> HashMap<&'a str, &'a T> {
    all.iter().rev().map(|one| (name(one), one)).collect()
}

/// A figure of a block.
type FigureOf = fn(&Block) -> &Buckets;
type Interval = (String, Option<[f64; 2]>);

/// The intervals of this over other for the figures of a group.
fn group_intervals(this: &GroupTiming, other: &GroupTiming) -> Vec<Interval> {
    // The bootstrap gives second over first.
    let blocks = [other.blocks.bins(), this.blocks.bins()];
    let mut intervals = Vec::new();
    let figures: [(&str, FigureOf); 4] = [
        ("lateness", |block| &block.lateness),
        ("execution", |block| &block.execution),
        ("period_error", |block| &block.period_error),
        ("jitter", |block| &block.jitter),
    ];
    for (figure, of) in figures {
        let ratios = percentile_ratios(blocks, of);
        let named = ["p50", "p90", "p99", "p999"].into_iter().zip(ratios);
        intervals.extend(named.map(|(which, interval)| (format!("{}.{figure}.{which}", this.name), interval)));
    }
    let periods = |block: &Block| block.released + block.skipped;
    intervals.push((format!("{}.skipped_share", this.name), share_ratio(blocks, |b| [b.skipped, periods(b)])));
    intervals.push((format!("{}.missed_share", this.name), share_ratio(blocks, |b| [b.missed, periods(b)])));
    intervals
}
