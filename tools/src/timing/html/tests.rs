use palpate::log::{CommandSample, Environment, ForceSample, GroupInfo, LogEntry, LogRecord, LoggedExecution, Resync};
use palpate::runtime::Nanos;
use palpate::runtime::{ActorTimes, SlipCause, TickTiming};

use super::timing_html;
use crate::timing::{Selection, TimingAnalysis, TimingReport};

const MS: u64 = 1_000_000;

fn tick(group: u16, tick: u64, period: u64, late: u64, work: u64, slips: u32, cause: SlipCause) -> LogRecord {
    let scheduled = Nanos(tick * period);
    let woke = scheduled + Nanos(late);
    LogRecord::Tick(TickTiming {
        group,
        tick,
        scheduled,
        woke,
        start: woke,
        end: woke + Nanos(work),
        deadline: scheduled + Nanos(period),
        slips,
        cause,
        ..TickTiming::default()
    })
}

/// Two groups and a force; `local` skips six periods at 0.5 s, while `global` is at work.
fn troubled() -> TimingReport {
    let mut analysis = TimingAnalysis::new(Selection::default());
    let environment = Environment {
        execution: LoggedExecution::Threaded { start_unix_ns: 1 },
        model: "<patch>".into(),
        groups: vec![
            GroupInfo {
                actors: vec!["device".into(), "local".into()],
                cpu: Some(0),
                ..GroupInfo::new("local", 1000.0)
            },
            GroupInfo { budget: Some(Nanos(9 * MS)), ..GroupInfo::new("global", 30.0) },
        ],
        ..Environment::default()
    };
    analysis.push_entry(&LogEntry::Environment(environment));
    for n in 0..1000_u64 {
        if (500..506).contains(&n) {
            continue;
        }
        let (slips, late) = if n == 506 { (6, 400_000) } else { (0, 5_000 + n * 7919 % 40_000) };
        let cause = if slips > 0 { SlipCause::LateWake } else { SlipCause::None };
        let time = Nanos(n * MS);
        let records = [
            tick(0, n, MS, late, 20_000, slips, cause),
            LogRecord::Actors(ActorTimes { group: 0, scheduled: time, actors: 2, spent: [Nanos(10_000); 12] }),
            LogRecord::Force(ForceSample {
                time,
                force_n: [0.0, 0.0, n as f64 * 1e-3],
                model_age_s: 0.02,
                ..ForceSample::default()
            }),
            LogRecord::Command(CommandSample { time, force_n: [0.0, 0.0, 0.5], ..CommandSample::default() }),
        ];
        records.into_iter().for_each(|record| analysis.push_entry(&LogEntry::Record(record)));
        if n.is_multiple_of(33) {
            let work = if n == 495 { 20 * MS } else { 8 * MS };
            analysis.push_entry(&LogEntry::Record(tick(1, n / 33, 33 * MS, 50_000, work, 0, SlipCause::None)));
            let resync = Resync { time, jump_before_n: 0.2, jump_after_n: 0.01, ..Resync::default() };
            analysis.push_entry(&LogEntry::Record(LogRecord::Resync(resync)));
        }
    }
    analysis.report()
}

fn count(page: &str, words: &str) -> usize {
    page.matches(words).count()
}

fn is_sound(page: &str) {
    for wrong in ["NaN", "inf\"", ">inf", "http://", "https://", "src=", "@import"] {
        assert!(!page.contains(wrong), "{wrong:?} in {page}");
    }
    for element in ["svg", "figure", "table", "section", "div", "dl", "ul", "ol", "p", "span", "li"] {
        let (open, plain) = (count(page, &format!("<{element} ")), count(page, &format!("<{element}>")));
        assert_eq!(open + plain, count(page, &format!("</{element}>")), "{element}");
    }
}

#[test]
fn a_page_says_who_was_late_and_why_and_shows_it() {
    let report = troubled();
    let page = timing_html(&report, "a<b.mcap");
    is_sound(&page);
    for words in [
        "a&lt;b.mcap",
        "Worst: <code>local</code> at 0.5060 s",
        "woken too late",
        "meanwhile <code>global</code> was at work",
        "&lt;patch&gt;",
        "local: lateness over time",
        "local: percentiles",
        "local: execution of device",
        "resync jumps",
        "id=\"moment0\"",
        "skipped: late wake",
    ] {
        assert!(page.contains(words), "{words:?}");
    }
}

// Check that every figure of a group and of the force is in the page, each with the value that the figures have.
#[test]
fn the_numbers_are_those_of_the_figures() {
    let report = troubled();
    let page = timing_html(&report, "log");
    for figure in report.figures() {
        let is_wanted =
            ["lateness", "jitter", "skipped", "model_age", "jump", "utilisation", "lost_records", "execution"];
        let mark = format!("data-figure=\"{}\" data-value=\"", figure.name);
        let found = page.find(&mark).map(|at| page[at + mark.len()..].split('"').next().unwrap());
        match found {
            Some(raw) => assert_eq!(raw.parse::<f64>().unwrap(), figure.value.as_f64(), "{}", figure.name),
            None => assert!(!is_wanted.iter().any(|wanted| figure.name.contains(wanted)), "{}", figure.name),
        }
    }
}

#[test]
fn logs_that_hold_little_make_a_page_too() {
    let empty = timing_html(&TimingReport::default(), "empty.mcap");
    is_sound(&empty);
    assert!(empty.contains("no release of any group is in the log") && !empty.contains("<script>"));

    let mut analysis = TimingAnalysis::new(Selection::default());
    (0..50).for_each(|n| analysis.push_entry(&LogEntry::Record(tick(0, n, MS, 0, 0, 0, SlipCause::None))));
    let zero = timing_html(&analysis.report(), "virtual.mcap");
    is_sound(&zero);
    assert!(zero.contains("there is nothing to draw") && zero.contains("holds no forces"));

    let mut analysis = TimingAnalysis::new(Selection::default());
    (0..50).for_each(|n| analysis.push_entry(&LogEntry::Record(tick(0, n, MS, 1000 + n, 0, 0, SlipCause::None))));
    let foreign = timing_html(&analysis.report(), "cyclictest.json");
    is_sound(&foreign);
    assert!(foreign.contains("group-0: lateness") && !foreign.contains("group-0: execution\""));
}

// Check that fast groups in long moments cannot make the page large.
#[test]
fn the_page_stays_small() {
    let mut analysis = TimingAnalysis::new(Selection::default());
    for n in 0..200_000_u64 {
        let late = if n.is_multiple_of(10_000) { 90_000 + n } else { 3_000 + n * 7919 % 5_000 };
        analysis.push_entry(&LogEntry::Record(tick(0, n, 100_000, late, 7_000, 0, SlipCause::None)));
        let force = ForceSample { time: Nanos(n * 100_000), force_n: [n as f64, 0.0, 0.0], ..ForceSample::default() };
        analysis.push_entry(&LogEntry::Record(LogRecord::Force(force)));
    }
    let page = timing_html(&analysis.report(), "fast");
    assert!(page.len() < 2_000_000, "{}", page.len());
}
