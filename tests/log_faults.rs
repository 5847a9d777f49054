//! A disk that is full, slow, stalls or never answers, and a logger that is killed: they cost log records, which are counted
//! and named, and never a haptic tick.

use std::io::{self, Write};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use palpate::Error;
use palpate::actors::{LogFile, LogSink, LoggerActor, LoggerOutcome};
use palpate::log::{
    Analysis, Environment, ForceSample, GroupInfo, GroupStats, LogEntry, LogReader, LogRecord, LoggedExecution,
    RunReport, TextEvent,
};
use palpate::runtime::Nanos;
use palpate::runtime::{
    Actor, Execution, Outcome, RateGroup, Runtime, RuntimeReport, STOP_BOUND, TickContext, actor_fn,
};

const MS: u64 = 1_000_000;
/// Records of each tick: more than a session of one device makes, of values that do not pack well.
const PER_TICK: u64 = 6;

/// A disk as a test wants it.
#[derive(Clone, Debug)]
struct Disk {
    bytes: Arc<Mutex<Vec<u8>>>,
    /// Called with the bytes written so far and the bytes to come.
    takes: fn(usize, usize) -> io::Result<usize>,
}

impl Disk {
    fn new(takes: fn(usize, usize) -> io::Result<usize>) -> Self {
        Self { bytes: Arc::default(), takes }
    }

    fn len(&self) -> usize {
        self.bytes.lock().unwrap().len()
    }

    /// The entries that are on it, and what is wrong.
    fn read(&self) -> (Vec<LogEntry>, Option<String>) {
        let bytes = self.bytes.lock().unwrap().clone();
        let mut reader = LogReader::new(bytes.as_slice(), "disk").expect("the magic is there");
        let entries = reader.readable().collect();
        (entries, reader.damage().map(str::to_owned))
    }
}

impl Write for Disk {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let count = (self.takes)(self.len(), bytes.len())?;
        self.bytes.lock().unwrap().extend_from_slice(&bytes[..count]);
        Ok(count)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

fn healthy(_: usize, more: usize) -> io::Result<usize> {
    Ok(more)
}

fn full(there: usize, more: usize) -> io::Result<usize> {
    match 200_000_usize.saturating_sub(there).min(more) {
        0 => Err(io::ErrorKind::StorageFull.into()),
        room => Ok(room),
    }
}

fn throttled(_: usize, more: usize) -> io::Result<usize> {
    // 20 kB/s.
    std::thread::sleep(Duration::from_millis(50));
    Ok(more.min(1000))
}

fn stalls_once(there: usize, more: usize) -> io::Result<usize> {
    if (100_000..200_000).contains(&there) && more > 0 {
        std::thread::sleep(Duration::from_millis(3000));
        return Ok(more.min(200_000));
    }
    Ok(more)
}

fn never_answers(there: usize, more: usize) -> io::Result<usize> {
    if there > 100_000 {
        loop {
            std::thread::sleep(Duration::from_secs(3600));
        }
    }
    Ok(more)
}

fn panics(there: usize, more: usize) -> io::Result<usize> {
    assert!(there < 100_000, "no disk any more");
    Ok(more)
}

/// Closed until it is opened.
#[derive(Clone, Default)]
struct Gate(Arc<(Mutex<bool>, std::sync::Condvar)>);

impl Gate {
    fn open(&self) {
        *self.0.0.lock().unwrap() = true;
        self.0.1.notify_all();
    }
}

/// A disk that takes nothing until the gate is opened.
struct Gated(Gate, Disk);

impl Write for Gated {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let (is_open, opened) = &*self.0.0;
        drop(opened.wait_while(is_open.lock().unwrap(), |is_open| !*is_open).unwrap());
        self.1.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// How a run went.
struct Ran {
    report: RunReport,
    error: Option<Error>,
    runtime: RuntimeReport,
    took: Duration,
    /// Ticks that the haptic actor saw.
    ticks: u64,
}

fn environment(execution: Execution) -> Environment {
    let group = |name: &str, rate_hz| GroupInfo::new(name, rate_hz);
    let execution = match execution {
        Execution::Virtual => LoggedExecution::Virtual,
        Execution::Threaded => LoggedExecution::Threaded { start_unix_ns: 1_700_000_000_000_000_000 },
    };
    Environment { execution, groups: vec![group("local", 1000.0), group("logger", 20.0)], ..Environment::default() }
}

/// A haptic group and a logger that writes to `sink`, for `ms` ms; without a logger if there is no sink.
fn run(execution: Execution, ms: u64, buffered_ms: u64, sink: Option<Box<dyn LogSink>>) -> Ran {
    let mut graph = Runtime::builder(execution);
    let outcome = LoggerOutcome::default();
    let logged = sink.is_some();
    let drain = logged.then(|| graph.drain());
    let mut recorder = graph.recorder((PER_TICK * buffered_ms) as usize);
    let ticks = Arc::new(Mutex::new(0));
    let seen = Arc::clone(&ticks);
    let haptic = actor_fn("haptic", move |ctx| {
        *seen.lock().unwrap() += 1;
        for i in 0..PER_TICK {
            // Digits that repeat nowhere, so that packing does not make a slow disk fast.
            let noise =
                |k: u64| f64::from_bits((ctx.tick * 31 + i * 7 + k + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 2);
            let force_n = [noise(1), noise(2), noise(3)];
            LogRecord::Force(ForceSample { time: ctx.scheduled, force_n, ..ForceSample::default() })
                .push_to(&mut recorder);
        }
        Outcome::Continue
    });
    graph.group(RateGroup::hz(1000).name("local"), vec![haptic]);
    if let (Some(drain), Some(sink)) = (drain, sink) {
        let logger = LoggerActor::new(
            drain,
            Given(sink, Gate::default()),
            environment(execution),
            graph.grants(),
            outcome.clone(),
        );
        graph.group(RateGroup::hz(20).name("logger").observer(), vec![Box::new(logger)]);
    }
    finish(graph.until(Nanos(ms * MS)).build().unwrap(), &outcome, &ticks)
}

fn finish(graph: Runtime, outcome: &LoggerOutcome, ticks: &Mutex<u64>) -> Ran {
    let begun = Instant::now();
    let running = graph.start().unwrap();
    running.wait_for(Duration::MAX);
    let runtime = running.stop();
    let took = begun.elapsed();
    let (report, error) = outcome.take();
    Ran { report, error, runtime, took, ticks: *ticks.lock().unwrap() }
}

fn on(disk: &Disk, execution: Execution) -> Box<dyn LogSink> {
    Box::new(LogFile::new(disk.clone(), "disk", &environment(execution)).unwrap())
}

/// A sink in a box, and a gate that opens before the sink is finished.
struct Given(Box<dyn LogSink>, Gate);

impl LogSink for Given {
    fn record(&mut self, record: &LogRecord) -> Result<(), Error> {
        self.0.record(record)
    }
    fn text(&mut self, event: &TextEvent) -> Result<(), Error> {
        self.0.text(event)
    }
    fn stats(&mut self, stats: &GroupStats) -> Result<(), Error> {
        self.0.stats(stats)
    }
    fn environment(&mut self, environment: &Environment) {
        self.0.environment(environment);
    }
    fn flush(&mut self, log_time: Nanos, now: Nanos) -> Result<(), Error> {
        self.0.flush(log_time, now)
    }
    fn ending(&mut self) {
        self.0.ending();
    }
    fn finish(&mut self) -> Result<(), Error> {
        self.1.open();
        self.0.finish()
    }
    fn take_loss(&mut self) -> Option<palpate::actors::Loss> {
        self.0.take_loss()
    }
}

/// Every period of the haptic group is accounted for and every release ran, whatever the log did.
fn assert_haptic_is_whole(ran: &Ran, ms: u64) {
    let local = &ran.runtime.groups.iter().find(|group| group.name == "local").unwrap();
    assert_eq!((local.released + local.skipped, local.elapsed_periods), (ms + 1, ms + 1));
    assert_eq!(ran.ticks, local.released);
}

fn events(ran: &Ran) -> String {
    ran.report.events.iter().map(|event| event.message.clone() + "\n").collect()
}

fn messages(entries: &[LogEntry]) -> u64 {
    let is_message = |entry: &&LogEntry| !matches!(entry, LogEntry::Environment(_) | LogEntry::Attachment { .. });
    entries.iter().filter(is_message).count() as u64
}

#[test]
fn a_full_disk_loses_what_comes_after_it_and_counts_that() {
    for (execution, ms) in [(Execution::Virtual, 3000), (Execution::Threaded, 3000)] {
        let disk = Disk::new(full);
        let ran = run(execution, ms, 4000, Some(on(&disk, execution)));
        assert_haptic_is_whole(&ran, ms);
        assert_eq!(ran.runtime.fault, None);
        assert!(ran.error.as_ref().unwrap().to_string().contains("disk: "), "{:?}", ran.error);
        // Check that what is on the disk and what was lost is all there was: records, ticks, statistics
        let (got, damage) = disk.read();
        assert!(damage.is_some() && messages(&got) > 100, "{damage:?}");
        let given = ran.ticks * PER_TICK;
        let (lost, saved) = (ran.report.lost_records(), messages(&got));
        assert!(lost + saved >= given && lost < given + ms + 200, "{lost} lost, {saved} saved of {given} and ticks");
        assert!(events(&ran).contains("records lost between"), "{}", events(&ran));
        assert_eq!(ran.report.groups[0].released, ran.ticks, "the statistics go on");
    }
}

#[test]
fn a_disk_that_stalls_for_three_seconds_loses_nothing() {
    let disk = Disk::new(stalls_once);
    let ran = run(Execution::Threaded, 5000, 4000, Some(on(&disk, Execution::Threaded)));
    assert_haptic_is_whole(&ran, 5000);
    assert_eq!((ran.report.lost_records(), ran.error.is_none(), ran.runtime.fault), (0, true, None));
    let bytes = disk.bytes.lock().unwrap().clone();
    // Check that it is whole: the index counts every message, and the data fits its checksum
    let mut reader = LogReader::new(bytes.as_slice(), "disk").unwrap();
    let read = reader.readable().count() as u64;
    assert!(reader.damage().is_none() && reader.is_checksummed(), "{:?}", reader.damage());
    assert!(read > ran.ticks * PER_TICK, "{read} of {} ticks", ran.ticks);
}

#[test]
fn a_disk_of_20_kb_per_second_costs_records_within_bounds_of_memory_and_time() {
    let disk = Disk::new(throttled);
    let ran = run(Execution::Threaded, 9000, 4000, Some(on(&disk, Execution::Threaded)));
    assert_haptic_is_whole(&ran, 9000);
    assert_eq!(ran.runtime.fault, None, "the logger did not hang");
    assert!(ran.took < Duration::from_secs(9) + LogFile::LAST_WAIT + Duration::from_secs(2), "{:?}", ran.took);
    assert!(ran.error.unwrap().to_string().contains("the disk did not take the last "));
    let (got, _) = disk.read();
    let (lost, given) = (ran.report.lost_records(), ran.ticks * PER_TICK);
    assert!(lost > given / 2 && lost + messages(&got) >= given, "{lost} of {given}");
    assert!(ran.report.events.iter().any(|event| event.message.contains("records lost between")));
}

// Check that a gap in the middle is in the log itself with its times, and that what waits is bounded: the disk takes nothing
// until the gate opens.
#[test]
fn a_gap_is_told_in_the_log_with_its_times() {
    let gate = Gate::default();
    let disk = Disk::new(healthy);
    let environment = environment(Execution::Threaded);
    let mut file = LogFile::new(Gated(gate.clone(), disk.clone()), "disk", &environment).unwrap();
    let record = |n: u64| {
        let noise = |k: u64| f64::from_bits((n * 31 + k + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 2);
        LogRecord::Force(ForceSample {
            time: Nanos(n * MS),
            force_n: [noise(1), noise(2), noise(3)],
            ..Default::default()
        })
    };
    let mut n = 0;
    // Until three times as much was given as may wait.
    let (mut first_lost, most) = (None, 3 * LogFile::MOST_WAITING / 40);
    while n < most {
        file.record(&record(n)).unwrap();
        file.flush(Nanos(n * MS), Nanos(n * MS)).unwrap();
        n += 1;
    }
    assert_eq!(file.take_loss(), None, "the gap is not over");
    gate.open();
    let begun = Instant::now();
    let loss = loop {
        file.record(&record(n)).unwrap();
        file.flush(Nanos(n * MS), Nanos(n * MS)).unwrap();
        n += 1;
        if let Some(loss) = file.take_loss() {
            break loss;
        }
        assert!(begun.elapsed() < Duration::from_secs(60));
        std::thread::sleep(Duration::from_micros(100));
    };
    (0..100).for_each(|_| {
        file.record(&record(n)).unwrap();
        n += 1;
    });
    file.finish().unwrap();
    assert_eq!(file.take_loss(), None);
    // Check that exactly the records of the gap are missing
    let (got, damage) = disk.read();
    assert_eq!((damage, messages(&got) + loss.records), (None, n));
    let mut expected = 0;
    for entry in &got {
        let LogEntry::Record(record) = entry else { continue };
        if record.time().0 != expected * MS {
            assert_eq!(first_lost.replace(expected), None, "one gap");
            assert_eq!(loss.from, Nanos(expected * MS));
            expected += loss.records;
            assert_eq!(loss.to, Nanos((expected - 1) * MS));
            assert_eq!(record.time(), Nanos(expected * MS));
        }
        expected += 1;
    }
    assert!(first_lost.is_some() && loss.records > most / 4);
}

// Check that the end of the log says so itself: the disk takes nothing until the run is over, and then everything.
#[test]
fn a_gap_that_is_open_at_the_end_of_a_run_is_told_in_the_log() {
    let (gate, disk) = (Gate::default(), Disk::new(healthy));
    // The log of a run in real time does not wait for its disk; that the run is in simulated time makes the test short.
    let file = LogFile::new(Gated(gate.clone(), disk.clone()), "disk", &environment(Execution::Threaded)).unwrap();
    let ran = run(Execution::Virtual, 15_000, 4000, Some(Box::new(Given(Box::new(file), gate))));
    let (got, damage) = disk.read();
    assert_eq!((damage, ran.error.is_none()), (None, true), "{:?}", ran.error);
    let mut read = Analysis::default();
    got.iter().for_each(|entry| read.push_entry(entry));
    let (read, lost) = (read.report(), ran.report.lost_records());
    assert!(lost > 0 && read.lost_records() == lost, "{lost} lost, {} by the log", read.lost_records());
    assert!(read.events.iter().any(|event| event.message.contains("records lost between")), "{:?}", read.events);
}

#[test]
fn a_disk_that_never_answers_again_ends_the_run_in_bounded_time() {
    let disk = Disk::new(never_answers);
    let ran = run(Execution::Threaded, 2000, 4000, Some(on(&disk, Execution::Threaded)));
    assert_haptic_is_whole(&ran, 2000);
    assert_eq!(ran.runtime.fault, None);
    assert!(ran.took < Duration::from_secs(2) + LogFile::LAST_WAIT + Duration::from_secs(2), "{:?}", ran.took);
    let (got, damage) = disk.read();
    assert!(damage.is_some());
    assert!(ran.report.lost_records() + messages(&got) >= ran.ticks * PER_TICK);
    assert!(ran.error.unwrap().to_string().contains("within 3s"));
    assert_eq!(ran.report.groups[0].released, ran.ticks, "all statistics are there");
}

#[test]
fn a_panicking_disk_or_sink_is_a_log_that_failed() {
    let disk = Disk::new(panics);
    let ran = run(Execution::Threaded, 1500, 4000, Some(on(&disk, Execution::Threaded)));
    assert_haptic_is_whole(&ran, 1500);
    assert!(ran.error.unwrap().to_string().contains("panicked") && ran.report.lost_records() > 0);

    struct Panics;
    impl LogSink for Panics {
        fn record(&mut self, _: &LogRecord) -> Result<(), Error> {
            panic!("no sink")
        }
        fn text(&mut self, _: &TextEvent) -> Result<(), Error> {
            Ok(())
        }
        fn stats(&mut self, _: &GroupStats) -> Result<(), Error> {
            Ok(())
        }
        fn environment(&mut self, _: &Environment) {}
        fn flush(&mut self, _: Nanos, _: Nanos) -> Result<(), Error> {
            Ok(())
        }
        fn finish(&mut self) -> Result<(), Error> {
            Ok(())
        }
    }
    for execution in [Execution::Virtual, Execution::Threaded] {
        let ran = run(execution, 500, 4000, Some(Box::new(Panics)));
        assert_haptic_is_whole(&ran, 500);
        assert_eq!(ran.runtime.fault, None);
        assert!(ran.error.unwrap().to_string().contains("what writes the log panicked"));
        let lost = ran.report.lost_records();
        assert!(lost >= ran.ticks * PER_TICK, "{lost} of {}", ran.ticks * PER_TICK);
        assert_eq!(ran.report.groups[0].released, ran.ticks);
    }
}

/// A logger that is killed at a tick: it panics, or never returns.
struct Killed {
    logger: LoggerActor,
    at: u64,
    hangs: bool,
}

impl Actor for Killed {
    fn name(&self) -> &str {
        "logger"
    }
    fn tick(&mut self, ctx: &TickContext) -> Outcome {
        if ctx.tick >= self.at {
            assert!(self.hangs, "killed");
            loop {
                std::thread::sleep(Duration::from_secs(3600));
            }
        }
        self.logger.tick(ctx)
    }
    fn stop(&mut self, ctx: &TickContext) {
        self.logger.stop(ctx);
    }
}

// Check that the rings fill up and lose records, which are counted, and that the haptic group runs to its end.
#[test]
fn a_killed_logger_costs_records_and_no_tick() {
    for (execution, hangs) in [(Execution::Virtual, false), (Execution::Threaded, false), (Execution::Threaded, true)] {
        let mut graph = Runtime::builder(execution);
        let (outcome, ticks, disk) = (LoggerOutcome::default(), Arc::new(Mutex::new(0)), Disk::new(healthy));
        let drain = graph.drain();
        let mut recorder = graph.recorder(1000);
        let seen = Arc::clone(&ticks);
        let haptic = actor_fn("haptic", move |ctx| {
            *seen.lock().unwrap() += 1;
            LogRecord::Force(ForceSample { time: ctx.scheduled, ..ForceSample::default() }).push_to(&mut recorder);
            Outcome::Continue
        });
        graph.group(RateGroup::hz(1000).name("local"), vec![haptic]);
        let sink = Given(on(&disk, execution), Gate::default());
        let logger = LoggerActor::new(drain, sink, environment(execution), graph.grants(), outcome.clone());
        let logger = Killed { logger, at: 10, hangs };
        graph.group(RateGroup::hz(20).name("logger").observer(), vec![Box::new(logger)]);
        let ran = finish(graph.until(Nanos(3000 * MS)).build().unwrap(), &outcome, &ticks);
        assert_haptic_is_whole(&ran, 3000);
        assert_eq!(ran.runtime.fault.as_ref().unwrap().group, "logger");
        // The ring holds a thousand and the logger took fewer before: the rest of what was given is lost. A busy machine gives less.
        let lost = ran.runtime.lost_records;
        assert!(lost > 0 && lost + 2000 > ran.ticks, "{lost} of {}", ran.ticks);
        let bound = Duration::from_secs(3) + 2 * STOP_BOUND;
        assert!(ran.took < bound, "{:?}", ran.took);
        if !hangs {
            // It was stopped in order at the end: the log is whole but for the gap, which it names.
            let (got, damage) = disk.read();
            assert_eq!(damage, None);
            assert_eq!(ran.report.lost_records(), ran.runtime.lost_records);
            let text = |entry: &LogEntry| matches!(entry, LogEntry::Text(text) if text.message.contains("records lost between"));
            assert!(got.iter().any(text), "{}", events(&ran));
        }
    }
}

#[test]
fn in_virtual_time_the_log_changes_nothing_and_a_slow_disk_loses_nothing() {
    fn slow(_: usize, more: usize) -> io::Result<usize> {
        std::thread::sleep(Duration::from_millis(2));
        Ok(more)
    }
    let without = run(Execution::Virtual, 2000, 4000, None);
    for takes in [healthy, slow, full, panics] {
        let disk = Disk::new(takes);
        let ran = run(Execution::Virtual, 2000, 4000, Some(on(&disk, Execution::Virtual)));
        assert_eq!((ran.ticks, &ran.runtime.groups[0]), (without.ticks, &without.runtime.groups[0]));
        let keeps_all = disk.read().1.is_none();
        assert_eq!(ran.report.lost_records() == 0, keeps_all);
        assert_eq!(ran.error.is_none(), keeps_all);
    }
}
