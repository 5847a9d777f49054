//! Device-paced groups on threads: frames, silence, and actors that do not wait as they should.

mod device_clock;

use device_clock::DeviceClock;
use palpate_runtime::{
    Actor, Event, EventCode, Execution, Nanos, Outcome, OverrunPolicy, RateGroup, Record, Restart, Runtime,
    RuntimeReport, SlipCause, TickContext, TickTiming, actor_fn,
};
use std::sync::{Arc, Mutex};
use std::time::Duration;

const MS: u64 = 1_000_000;

/// What an actor answers when it is asked to wait for its device.
enum Answer {
    /// What the device says.
    Frames(DeviceClock),
    /// Has something new, always.
    Always,
    /// Returns at once without anything.
    Never,
    Panics,
}

struct Waiting {
    answer: Answer,
    asked: Arc<Mutex<u64>>,
}

impl Actor for Waiting {
    fn name(&self) -> &str {
        "waiting"
    }

    fn wait(&mut self, timeout: Nanos) -> bool {
        *self.asked.lock().unwrap() += 1;
        match &mut self.answer {
            Answer::Frames(clock) => clock.wait(timeout.to_duration()),
            Answer::Always => true,
            Answer::Never => false,
            Answer::Panics => panic!("deliberate"),
        }
    }

    fn tick(&mut self, _: &TickContext) -> Outcome {
        Outcome::Continue
    }
}

/// A device that is never silent.
fn frames_every(period: Duration) -> Answer {
    Answer::Frames(DeviceClock::new(period, [Duration::MAX; 2]))
}

/// What a run of one group at 1 kHz has left behind.
struct Left {
    report: RuntimeReport,
    timings: Vec<TickTiming>,
    events: Vec<Event>,
    asked: u64,
}

fn run(answer: Answer, watchdog_ms: u64, until_ms: u64) -> Left {
    let mut graph = Runtime::builder(Execution::Threaded);
    let mut drain = graph.drain();
    let asked: Arc<Mutex<u64>> = Arc::default();
    let actor = Waiting { answer, asked: Arc::clone(&asked) };
    let group = RateGroup::hz(1000).name("g").device_paced(Nanos(watchdog_ms * MS));
    graph.group(group, vec![Box::new(actor)]).until(Nanos(until_ms * MS));
    let running = graph.build().unwrap().start().unwrap();
    running.wait_for(Duration::from_secs(60));
    assert!(running.finished());
    let report = running.stop();
    let mut records: Vec<Record> = Vec::new();
    drain.drain(&mut records);
    let group = &report.groups[0];
    // Check what holds whatever the device does: every period is accounted for, and the clock is not stretched.
    assert_eq!((group.released + group.skipped, group.elapsed_periods), (until_ms + 1, until_ms + 1));
    assert_eq!(report.fault, None);
    let timings: Vec<_> = records.iter().filter_map(TickTiming::from_record).collect();
    assert!(timings.iter().all(|t| t.scheduled == Nanos(t.tick * MS) && t.woke + Nanos(MS) > t.scheduled));
    assert!(timings.windows(2).all(|pair| pair[1].tick == pair[0].tick + 1 + u64::from(pair[1].slips)));
    let asked = *asked.lock().unwrap();
    Left { report, timings, events: records.iter().filter_map(Event::from_record).collect(), asked }
}

fn codes(events: &[Event]) -> Vec<(EventCode, bool)> {
    events.iter().map(|event| (event.code, event.detail == Event::RECOVERED)).collect()
}

#[test]
fn frames_of_a_slower_clock_release_the_group_and_the_missing_ones_are_blamed_on_the_device() {
    let period = Duration::from_micros(1250);
    let Left { report, timings, events, .. } = run(frames_every(period), 200, 500);
    let group = &report.groups[0];
    // One period in five has no frame; the host may cost more, never fewer.
    assert!(group.skipped >= 99, "{group:?}");
    assert!(group.slips.of(SlipCause::StalledPeer) >= 99 && group.slips.of(SlipCause::LateWake) == 0, "{group:?}");
    assert_eq!((codes(&events), group.watchdog_takeovers), (vec![], 0));
    // Check that releases follow the device's clock: some begin before they are due on the nominal one.
    assert!(timings.iter().any(|t| t.woke < t.scheduled) && timings.iter().any(|t| t.woke > t.scheduled));
}

#[test]
fn of_a_faster_clock_a_second_frame_in_one_period_is_left_out() {
    let period = Duration::from_micros(400);
    let Left { report, asked, .. } = run(frames_every(period), 200, 500);
    assert!(report.groups[0].released <= 501);
    assert!(asked >= report.groups[0].released);
}

#[test]
fn the_watchdog_takes_over_from_a_silent_device_until_it_is_back() {
    let (period, silent) = (Duration::from_millis(1), [100, 300].map(Duration::from_millis));
    let Left { report, timings, events, .. } = run(Answer::Frames(DeviceClock::new(period, silent)), 50, 500);
    // The host may stop everything for longer than the watchdog: each take-over has its end but for the last.
    let pairs = [(Event::WATCHDOG, false), (Event::WATCHDOG, true)];
    assert_eq!(codes(&events)[..2], pairs);
    assert!(codes(&events).chunks(2).all(|chunk| chunk == &pairs[..chunk.len()]));
    assert_eq!(
        report.groups[0].watchdog_takeovers,
        events.iter().filter(|e| e.detail != Event::RECOVERED).count() as u64
    );
    // Check that the periods up to the take-over are the device's fault, and that the clock then goes on without it
    let takeover = timings.iter().find(|t| t.slips >= 40).unwrap();
    assert_eq!(takeover.cause, SlipCause::StalledPeer);
    let until_back = timings.iter().filter(|t| t.tick > takeover.tick && t.tick < 290).count();
    assert!(until_back > 50, "{until_back}");
    // The stamp and the detail name the release that the device did not bring.
    assert_eq!(
        (events[0].stamp.0 / MS, events[0].detail),
        (events[0].detail, takeover.tick - u64::from(takeover.slips))
    );
}

#[test]
fn an_actor_that_does_not_wait_is_waited_for_by_the_clock_and_never_spun_on() {
    for answer in [Answer::Always, Answer::Never] {
        let Left { report, asked, .. } = run(answer, 20, 300);
        // Check that the group goes on, and that it asks a few times per period, not as often as it can
        assert!(report.groups[0].released > 50, "{report}");
        assert!(asked <= 4 * 300 + 100, "{asked}");
    }
}

/// A group at 1 kHz whose actor panics in its first wait, for 100 ms at most.
fn panics_in_wait(group: RateGroup, asked: &Arc<Mutex<u64>>) -> (RateGroup, Box<dyn Actor>) {
    let actor = Waiting { answer: Answer::Panics, asked: Arc::clone(asked) };
    (group.name("g").device_paced(Nanos(20 * MS)), Box::new(actor))
}

#[test]
fn a_panic_in_its_wait_is_a_fault_like_any_other() {
    let asked: Arc<Mutex<u64>> = Arc::default();
    let (group, actor) = panics_in_wait(RateGroup::hz(1000), &asked);
    let mut graph = Runtime::builder(Execution::Threaded);
    let mut drain = graph.drain();
    let running = graph.group(group, vec![actor]).build().unwrap().start().unwrap();
    running.wait_for(Duration::from_secs(60));
    let report = running.stop();
    let fault = report.fault.clone().unwrap();
    assert_eq!((fault.group.as_str(), fault.actor.as_str(), fault.at), ("g", "waiting", Nanos::ZERO));
    assert!(fault.what.contains("/device_paced.rs:"), "{fault}");
    assert!(fault.what.ends_with("deliberate (in wait)"), "{fault}");
    // Check that it was asked once, ran nothing, and that the log says so
    assert_eq!((*asked.lock().unwrap(), report.groups[0].released), (1, 0));
    let mut records: Vec<Record> = Vec::new();
    drain.drain(&mut records);
    assert_eq!(codes(&records.iter().filter_map(Event::from_record).collect::<Vec<_>>()), [(Event::PANIC, false)]);
}

#[test]
fn while_a_group_winds_down_an_actor_that_panicked_in_its_wait_is_not_asked_again() {
    let asked: Arc<Mutex<u64>> = Arc::default();
    let (group, actor) = panics_in_wait(RateGroup::hz(1000).wind_down(Nanos(30 * MS)), &asked);
    let ticked: Arc<Mutex<u64>> = Arc::default();
    let count = Arc::clone(&ticked);
    let other = actor_fn("other", move |_| {
        *count.lock().unwrap() += 1;
        Outcome::Continue
    });
    let mut graph = Runtime::builder(Execution::Threaded);
    let running = graph.group(group, vec![actor, other]).build().unwrap().start().unwrap();
    running.wait_for(Duration::from_secs(60));
    let report = running.stop();
    let group = &report.groups[0];
    assert!(report.fault.is_some());
    // Check that the clock releases the others at once, without the watchdog's patience, until they are at rest. A busy machine may
    // wake them late, but nothing waits for the device any more.
    assert_eq!((group.watchdog_takeovers, *asked.lock().unwrap()), (0, 1));
    assert!(group.elapsed_periods >= 30 && group.released <= 30, "{report}");
    assert_eq!(*ticked.lock().unwrap(), group.released);
    assert!(group.released > 0, "{report}");
}

#[test]
fn a_group_that_panicked_in_its_wait_is_started_again() {
    let mut made = 0;
    let factory = move || {
        made += 1;
        let answer = if made == 1 { Answer::Panics } else { frames_every(Duration::from_millis(1)) };
        Ok(vec![Box::new(Waiting { answer, asked: Arc::default() }) as Box<dyn Actor>])
    };
    let mut graph = Runtime::builder(Execution::Threaded);
    let group = RateGroup::hz(1000).name("g").device_paced(Nanos(20 * MS));
    let running = graph.restartable(group, Restart::default(), factory).until(Nanos(500 * MS)).build().unwrap();
    let running = running.start().unwrap();
    running.wait_for(Duration::from_secs(60));
    let report = running.stop();
    assert_eq!((report.fault.as_ref(), report.restarts.len(), report.groups[0].elapsed_periods), (None, 1, 501));
    assert!(report.groups[0].released > 100, "{report}");
}

#[test]
fn a_stop_is_noticed_while_the_device_is_silent() {
    let silent = [Duration::ZERO, Duration::from_secs(3600)];
    let actor =
        Waiting { answer: Answer::Frames(DeviceClock::new(Duration::from_millis(1), silent)), asked: Arc::default() };
    let mut graph = Runtime::builder(Execution::Threaded);
    let group = RateGroup::hz(1000).device_paced(Nanos(1_000_000 * MS)).overrun(OverrunPolicy::Stop);
    let running = graph.group(group, vec![Box::new(actor)]).build().unwrap().start().unwrap();
    running.wait_for(Duration::from_millis(100));
    // A group that does not notice is given up after STOP_BOUND, which is an error.
    let report = running.stop();
    assert_eq!((report.fault, report.groups[0].released), (None, 0));
}
