//! A distribution as HdrHistogram's percentile text (`.hgrm`), which its plotter and many other tools read.
//!
//! The layout is that of `AbstractHistogram.outputPercentileDistribution` of HdrHistogram with five ticks per half
//! distance. The values are exact: nearest rank over all samples, with no buckets in between.

use std::collections::{BTreeMap, BTreeSet};
use std::io::{self, Read, Write};

use palpate::log::{Distribution, Environment, LogEntry, LogReader, LogRecord, TickGauge, Window};
use palpate::runtime::TickTiming;
use palpate::{Error, printable};

use super::table::lost_topic;
use super::{Micros, output_error, unknown};

/// Lines from one half of the rest to the next: 0 %, 10 %, ... 50 %, 55 %, ... 75 %, 77.5 % and so on.
const TICKS_PER_HALF: u128 = 5;

/// A duration that each release of a rate group has.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
#[non_exhaustive]
pub enum TickDuration {
    /// From when a release was due until its thread ran: woke - scheduled.
    Lateness,
    /// What its work took: end - start.
    Execution,
    /// How far a period was from what was scheduled: |(woke - woke before) - (scheduled - scheduled before)|.
    PeriodError,
    /// From cycle to cycle: the magnitude of the difference of two consecutive period errors, with their signs. Between
    /// releases without a skipped period that is the difference of two periods, each from wake to wake.
    Jitter,
}

impl TickDuration {
    /// Its name in words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Lateness => "lateness",
            Self::Execution => "execution time",
            Self::PeriodError => "period error",
            Self::Jitter => "cycle-to-cycle jitter",
        }
    }
}

/// Measures a figure release by release.
#[derive(Clone, Copy, Debug)]
struct Gauge {
    figure: TickDuration,
    releases: TickGauge,
}

impl Gauge {
    fn new(figure: TickDuration) -> Self {
        Self { figure, releases: TickGauge::default() }
    }

    /// The figure of this release (ns); `None` for the first ones of figures that compare releases.
    fn measure(&mut self, timing: &TickTiming) -> Option<u64> {
        let figures = self.releases.measure(timing);
        match self.figure {
            TickDuration::Lateness => Some(figures.lateness),
            TickDuration::Execution => Some(figures.execution),
            TickDuration::PeriodError => figures.period_error.map(i64::unsigned_abs),
            TickDuration::Jitter => figures.jitter,
        }
    }
}

/// Writes the distribution of a figure of the rate group `group` within `window`, in microseconds with three decimals,
/// which are the log's nanoseconds.
///
/// Memory grows with the number of distinct values, see [`Distribution`]. On a damaged log it writes what is readable; ask
/// [`LogReader::damage`] afterwards.
///
/// # Errors
/// [`ErrorKind::Log`](palpate::ErrorKind::Log) if the log has no such group, with the groups that it has;
/// [`ErrorKind::Io`](palpate::ErrorKind::Io) if `out` cannot be written.
pub fn export_percentiles<R: Read, W: Write>(
    reader: &mut LogReader<R>,
    group: &str,
    figure: TickDuration,
    window: &Window,
    out: &mut W,
) -> Result<(), Error> {
    let mut gauge = Gauge::new(figure);
    let mut values = Distribution::default();
    let mut environment = Environment::default();
    // By number, of groups that have releases.
    let mut names = BTreeMap::new();
    while let Some(Ok(entry)) = reader.next() {
        match &entry {
            LogEntry::Environment(told) => {
                environment.clone_from(told);
                names.clear();
            }
            LogEntry::Record(LogRecord::Tick(timing)) => {
                let name = names.entry(timing.group).or_insert_with(|| environment.group_name(timing.group));
                if name == group
                    && window.contains_entry(&entry)
                    && let Some(value) = gauge.measure(timing)
                {
                    values.push(value);
                }
            }
            _ => {}
        }
    }
    let named = environment.groups.iter().map(|info| &info.name);
    let groups: BTreeSet<&str> = named.chain(names.values()).map(String::as_str).collect();
    if !groups.contains(group) && lost_topic(reader, &format!("/timing/{group}")).is_none() {
        return Err(unknown(reader, "rate group", group, &groups.into_iter().collect::<Vec<_>>()));
    }
    let group = printable(group);
    let title = format!("{} of rate group {group} in microseconds, exact percentiles (nearest rank)", figure.name());
    write(&values, &title, out).and_then(|()| out.flush()).map_err(output_error)
}

/// Writes the lines of a distribution of nanoseconds.
fn write(values: &Distribution, title: &str, out: &mut impl Write) -> io::Result<()> {
    writeln!(out, "{:>12} {:>14} {:>10} {:>14}\n", "Value", "Percentile", "TotalCount", "1/(1-Percentile)")?;
    let total = u128::from(values.count());
    // The level is `part` out of `whole`, in whole numbers: no rounding can pick a neighbour.
    let (mut part, mut whole, mut tick) = (0, 2 * TICKS_PER_HALF, 0);
    let (mut seen, mut max, mut distinct) = (0_u128, 0, 0_u64);
    for (value, count) in values.counts() {
        let before = seen;
        seen += u128::from(count);
        (max, distinct) = (value, distinct + 1);
        while before < total && part * total <= seen * whole {
            let (level, inverse) = (part as f64 / whole as f64, whole as f64 / (whole - part) as f64);
            writeln!(out, "{:>12} {level:2.12} {seen:>10} {inverse:>14.2}", Micros(value).to_string())?;
            (part, tick) = (part + 1, tick + 1);
            if tick == TICKS_PER_HALF {
                (part, whole, tick) = (2 * part, 2 * whole, 0);
            }
            if seen == total {
                break;
            }
        }
    }
    if total > 0 {
        writeln!(out, "{:>12} {:2.12} {total:>10}", Micros(max).to_string(), 1.0)?;
    }
    let mean = values.counts().into_iter().map(|(value, count)| u128::from(value) * u128::from(count)).sum::<u128>()
        as f64
        / (total as f64).max(1.0);
    // An empty sum of doubles would be -0.
    let squares =
        values.counts().into_iter().fold(0.0, |sum, (value, count)| sum + count as f64 * (value as f64 - mean).powi(2));
    let deviation = (squares / (total as f64).max(1.0)).sqrt();
    writeln!(out, "#[Mean    = {:>12.3}, StdDeviation   = {:>12.3}]", mean / 1e3, deviation / 1e3)?;
    writeln!(out, "#[Max     = {:>12}, Total count    = {total:>12}]", Micros(max).to_string())?;
    // Each value is a bucket of its own.
    writeln!(out, "#[Buckets = {distinct:>12}, SubBuckets     = {:>12}]", 1)?;
    writeln!(out, "# {title}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate::runtime::Nanos;

    fn text(values: impl IntoIterator<Item = u64>) -> String {
        let mut distribution = Distribution::default();
        values.into_iter().for_each(|value| distribution.push(value));
        let mut out = Vec::new();
        write(&distribution, "a title", &mut out).unwrap();
        String::from_utf8(out).unwrap()
    }

    // All lines but those on buckets and title are those of hdr-histogram-js 3.0.1 for 1..=100 with three digits.
    #[test]
    fn a_hundred_values_have_the_lines_of_the_reference_implementation() {
        let text = text((1..=100).map(|value| value * 1000));
        let mut lines = text.lines();
        assert_eq!(lines.next(), Some("       Value     Percentile TotalCount 1/(1-Percentile)"));
        assert_eq!(lines.next(), Some(""));
        let rows: Vec<Vec<&str>> = lines.clone().map(|line| line.split_whitespace().collect()).collect();
        let column = |place: usize| rows[..20].iter().map(|row| row[place]).collect::<Vec<_>>();
        let values = [1, 10, 20, 30, 40, 50, 55, 60, 65, 70, 75, 78, 80, 83, 85, 88, 89, 90, 92, 93];
        assert_eq!(column(0), values.map(|value: u32| format!("{value}.000")));
        assert_eq!(column(2), values.map(|value: u32| value.to_string()));
        assert_eq!(
            [lines.next(), lines.nth(4), lines.nth(5)],
            [
                Some("       1.000 0.000000000000          1           1.00"),
                Some("      50.000 0.500000000000         50           2.00"),
                Some("      78.000 0.775000000000         78           4.44"),
            ]
        );
        let tail: Vec<&str> = text.lines().rev().take(6).collect();
        assert_eq!(
            tail,
            [
                "# a title",
                "#[Buckets =          100, SubBuckets     =            1]",
                "#[Max     =      100.000, Total count    =          100]",
                "#[Mean    =       50.500, StdDeviation   =       28.866]",
                "     100.000 1.000000000000        100",
                "     100.000 0.990625000000        100         106.67",
            ]
        );
    }

    #[test]
    fn one_value_and_none_are_distributions_too() {
        let body = |text: String| text.lines().skip(2).take_while(|l| !l.starts_with('#')).map(str::to_owned).collect();
        let rows: Vec<String> = body(text([7]));
        assert_eq!(
            rows,
            ["       0.007 0.000000000000          1           1.00", "       0.007 1.000000000000          1"]
        );
        assert_eq!(body(text([])), [""; 0]);
        assert!(text([]).contains("#[Mean    =        0.000, StdDeviation   =        0.000]"));
    }

    #[test]
    fn each_figure_of_four_releases_is_what_its_definition_gives() {
        let timings = [(0, 5, 9), (100, 130, 140), (300, 310, 316), (400, 400, 450)].map(|(scheduled, woke, end)| {
            let (woke, start) = (Nanos(woke), Nanos(woke + 1));
            TickTiming { scheduled: Nanos(scheduled), woke, start, end: Nanos(end), ..TickTiming::default() }
        });
        let measured = |figure| {
            let mut gauge = Gauge::new(figure);
            timings.iter().filter_map(|timing| gauge.measure(timing)).collect::<Vec<_>>()
        };
        assert_eq!(measured(TickDuration::Lateness), [5, 30, 10, 0]);
        assert_eq!(measured(TickDuration::Execution), [3, 9, 5, 49]);
        // Periods of 125, 180 and 90 ns where 100, 200 and 100 were scheduled.
        assert_eq!(measured(TickDuration::PeriodError), [25, 20, 10]);
        // Errors of 25, -20 and -10 ns.
        assert_eq!(measured(TickDuration::Jitter), [45, 10]);
    }
}
