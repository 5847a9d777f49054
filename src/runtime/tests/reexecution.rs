//! A recorded run is repeated bit for bit, whatever threads and clocks did to it; one that is not complete is refused.

use palpate_runtime::{
    Actor, ActorError, Execution, GraphError, GraphErrorKind, Nanos, Outcome, OverrunPolicy, PortUse, PortUseKind,
    QueueReader, QueueWriter, RateGroup, Reader, Record, Recording, Runtime, RuntimeBuilder, RuntimeReport,
    TickContext, TickTiming, Writer, actor_fn,
};
use proptest::prelude::*;
use std::sync::{Arc, Mutex};
use std::time::Duration;

const MS: u64 = 1_000_000;

/// What each release of each group computed: group, tick, slips, state.
type Outputs = Vec<Vec<(u64, u32, u64)>>;

/// A graph of three groups in which everybody talks to everybody.
#[derive(Clone, Debug)]
struct Plan {
    rates: [u32; 3],
    latencies: [u64; 3],
    /// Small ones overflow.
    queue: usize,
    /// Samples taken per release at most: fewer than arrive fill the queue.
    appetite: usize,
    policy: OverrunPolicy,
    until: Nanos,
}

/// The ways into and out of a group.
#[derive(Default)]
struct Ports {
    values_in: Vec<Reader<u64>>,
    values_out: Vec<Writer<u64>>,
    samples_in: Vec<QueueReader<u64>>,
    samples_out: Vec<QueueWriter<u64>>,
}

/// Mixes everything it sees, and the order in which it sees it, into one number.
struct Mixer {
    ports: Ports,
    inner: Writer<u64>,
    answers: Reader<u64>,
    state: u64,
    appetite: usize,
    /// Sleeps now and then, in a real run.
    stalls: bool,
    outputs: Arc<Mutex<Outputs>>,
    group: usize,
}

fn mixed(state: u64, with: u64) -> u64 {
    (state ^ with).wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(23)
}

impl Mixer {
    fn publish(&mut self, ctx: &TickContext) {
        for writer in &mut self.ports.values_out {
            *writer.buffer() = self.state;
            writer.publish(ctx);
        }
        for queue in &mut self.ports.samples_out {
            // Whether a sample was dropped is an input too.
            for n in 0..1 + self.state % 3 {
                let sent = queue.push(ctx, self.state ^ n);
                self.state = mixed(self.state, u64::from(sent) + queue.dropped());
            }
        }
    }
}

impl Actor for Mixer {
    fn name(&self) -> &str {
        "mixer"
    }

    fn start(&mut self, ctx: &TickContext) -> Result<(), ActorError> {
        self.publish(ctx);
        Ok(())
    }

    fn tick(&mut self, ctx: &TickContext) -> Outcome {
        for reader in &mut self.ports.values_in {
            if reader.refresh(ctx) {
                let seen = mixed(reader.version(), reader.published().0);
                self.state = mixed(self.state, seen ^ *reader.get());
            }
        }
        for queue in &mut self.ports.samples_in {
            for sample in (0..self.appetite).map_while(|_| queue.pop(ctx)) {
                self.state = mixed(self.state, sample);
            }
        }
        self.answers.refresh(ctx);
        self.state = mixed(self.state, *self.answers.get() ^ u64::from(ctx.slips));
        *self.inner.buffer() = self.state;
        self.inner.publish(ctx);
        if self.stalls && self.state.is_multiple_of(7) {
            std::thread::sleep(Duration::from_micros(self.state % 5000));
        }
        Outcome::Continue
    }

    fn commit(&mut self, ctx: &TickContext) -> Outcome {
        self.publish(ctx);
        self.outputs.lock().unwrap()[self.group].push((ctx.tick, ctx.slips, self.state));
        Outcome::Continue
    }
}

/// What a run left behind.
struct Ran {
    outputs: Outputs,
    records: Vec<Record>,
    report: RuntimeReport,
}

impl Ran {
    fn recording(&self) -> Recording {
        Recording::from_records(&self.records)
    }

    fn uses(&self) -> Vec<PortUse> {
        let mut uses: Vec<_> = self.records.iter().filter_map(PortUse::from_record).collect();
        uses.sort_by_key(|used| (used.port, used.kind, used.sequence));
        uses
    }
}

fn run(mut graph: RuntimeBuilder, plan: &Plan, stalls: bool) -> Result<Ran, GraphError> {
    let outputs = Arc::new(Mutex::new(vec![Vec::new(); 3]));
    let records: Arc<Mutex<Vec<Record>>> = Arc::default();
    let mut drain = graph.drain();
    let mut ports: [Ports; 3] = Default::default();
    for from in 0..3 {
        for to in (0..3).filter(|to| *to != from) {
            let (writer, reader) = graph.exchange(|| 0);
            ports[from].values_out.push(writer);
            ports[to].values_in.push(reader);
            let (tx, rx) = graph.queue(plan.queue);
            ports[from].samples_out.push(tx);
            ports[to].samples_in.push(rx);
        }
    }
    for (group, ports) in ports.into_iter().enumerate() {
        let (inner, mut question) = graph.exchange(|| 0);
        let (mut answer, answers) = graph.exchange(|| 0);
        let (appetite, outputs) = (plan.appetite, Arc::clone(&outputs));
        let mixer = Mixer { ports, inner, answers, state: group as u64, appetite, stalls, outputs, group };
        let echo = actor_fn("echo", move |ctx| {
            // Within a group nothing is recorded: the order of its actors decides.
            assert!(question.refresh(ctx));
            *answer.buffer() = mixed(*question.get(), 1);
            answer.publish(ctx);
            Outcome::Continue
        });
        let spec = RateGroup::hz(plan.rates[group]).latency(Nanos(plan.latencies[group])).overrun(plan.policy);
        graph.group(spec, vec![Box::new(mixer), echo]);
    }
    let sink = Arc::clone(&records);
    let logger = actor_fn("logger", move |_| {
        drain.drain(&mut sink.lock().unwrap());
        Outcome::Continue
    });
    graph.group(RateGroup::hz(100).name("logger").observer(), vec![logger]).until(plan.until);
    let running = graph.build()?.start()?;
    running.wait_for(Duration::MAX);
    let report = running.stop();
    let outputs = outputs.lock().unwrap().clone();
    let records = records.lock().unwrap().clone();
    Ok(Ran { outputs, records, report })
}

fn rerun(recording: Recording, plan: &Plan) -> Ran {
    run(Runtime::reexecution(recording), plan, false).unwrap()
}

/// Check that a run and its re-execution gave the same outputs, and that the re-execution leaves the same recording.
fn assert_repeats(original: &Ran, plan: &Plan) {
    assert_eq!((original.report.lost_records, &original.report.fault), (0, &None));
    let again = rerun(original.recording(), plan);
    assert_eq!(again.report.fault, None);
    assert_eq!(again.outputs, original.outputs);
    assert_eq!(again.uses(), original.uses());
    for (group, (one, other)) in again.report.groups.iter().zip(&original.report.groups).enumerate().take(3) {
        assert_eq!((one.released, one.slips), (other.released, other.slips), "group {group}");
    }
}

fn plans() -> impl Strategy<Value = Plan> {
    let rates = [20_u32..1000, 20_u32..1000, 20_u32..1000];
    let latency = || prop_oneof![Just(0_u64), 0_u64..50 * MS];
    let latencies = [latency(), latency(), latency()];
    (rates, latencies, 1_usize..64, 1_usize..20).prop_map(|(rates, latencies, queue, appetite)| Plan {
        rates,
        latencies,
        queue,
        appetite,
        policy: OverrunPolicy::Skip,
        until: Nanos(150 * MS),
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    #[test]
    fn a_virtual_run_is_repeated_from_its_recording(plan in plans()) {
        let original = run(Runtime::builder(Execution::Virtual), &plan, false).unwrap();
        assert_repeats(&original, &plan);
    }
}

fn threaded_plan(policy: OverrunPolicy) -> Plan {
    Plan { rates: [1000, 400, 90], latencies: [0; 3], queue: 16, appetite: 12, policy, until: Nanos(600 * MS) }
}

#[test]
fn a_run_on_threads_that_stall_is_repeated_from_its_recording() {
    for policy in [OverrunPolicy::Skip, OverrunPolicy::CatchUp { max: 3 }] {
        let plan = threaded_plan(policy);
        let original = run(Runtime::builder(Execution::Threaded), &plan, true).unwrap();
        // Check that the run was one that only its recording can tell: slips, drops and late values
        assert!(original.report.groups[0].skipped > 0 || policy != OverrunPolicy::Skip);
        let kinds = |kind| original.uses().iter().filter(|used| used.kind == kind).count();
        assert!(kinds(PortUseKind::Took) > 50 && kinds(PortUseKind::Saw) > 50 && kinds(PortUseKind::Dropped) > 0);
        assert_repeats(&original, &plan);
    }
}

#[test]
fn a_recording_of_a_reexecution_can_be_repeated_in_turn() {
    let plan = threaded_plan(OverrunPolicy::Skip);
    let original = run(Runtime::builder(Execution::Threaded), &plan, true).unwrap();
    let again = rerun(original.recording(), &plan);
    assert_repeats(&again, &plan);
}

/// A virtual run to spoil.
fn small() -> (Ran, Plan) {
    let plan = Plan {
        rates: [500, 200, 50],
        latencies: [0, MS, 5 * MS],
        queue: 8,
        appetite: 3,
        policy: OverrunPolicy::Skip,
        until: Nanos(100 * MS),
    };
    (run(Runtime::builder(Execution::Virtual), &plan, false).unwrap(), plan)
}

#[test]
fn a_missing_release_or_use_is_refused_when_the_graph_is_built() {
    let (ran, plan) = small();
    for kind in ["release", "took", "saw", "dropped"] {
        let is_kind = |record: &Record| match kind {
            "release" => TickTiming::from_record(record).is_some_and(|timing| timing.group == 1 && timing.tick == 7),
            _ => PortUse::from_record(record).is_some_and(|used| used.kind.name() == kind && used.sequence == 1),
        };
        let place = ran.records.iter().position(is_kind).unwrap_or_else(|| panic!("no {kind} to take away"));
        let mut records = ran.records.clone();
        records.remove(place);
        let error = run(Runtime::reexecution(Recording::from_records(&records)), &plan, false).err().unwrap();
        assert_eq!(error.kind(), GraphErrorKind::Recording, "{kind}: {error}");
        assert!(error.to_string().starts_with("the recording is not complete"), "{kind}: {error}");
    }
}

#[test]
fn a_release_that_waits_for_what_was_never_written_ends_the_run_with_its_name() {
    let (ran, plan) = small();
    // Group 2 ends early: what group 0 took from it afterwards is never published.
    let is_kept = |record: &&Record| TickTiming::from_record(record).is_none_or(|t| t.group != 2 || t.tick < 2);
    let records: Vec<Record> = ran.records.iter().filter(is_kept).copied().collect();
    let again = rerun(Recording::from_records(&records), &plan);
    let fault = again.report.fault.unwrap();
    assert!(["group-0", "group-1"].contains(&&*fault.group), "{fault}");
    assert!(fault.what.contains("not complete: release") && fault.what.contains("of port"), "{fault}");
    // Up to there it is the run that was recorded.
    for (again, original) in again.outputs.iter().zip(&ran.outputs) {
        assert!(!again.is_empty() && original.starts_with(again));
    }
}

#[test]
fn a_recording_cut_at_a_time_is_repeated_up_to_there() {
    let (ran, plan) = small();
    let again = rerun(ran.recording().before(Nanos(50 * MS)), &plan);
    assert_eq!(again.report.fault, None);
    let periods = [25, 10, 3];
    for (group, (again, original)) in again.outputs.iter().zip(&ran.outputs).enumerate() {
        assert_eq!(again.len(), periods[group], "releases before 50 ms");
        assert!(original.starts_with(again));
    }
}

// Check that a cut is no excuse: a use before it that its release cannot have had ends the run, with its place.
#[test]
fn a_use_before_the_cut_of_what_was_never_written_ends_the_run_with_its_name() {
    let (ran, plan) = small();
    let is_one = |used: &PortUse| used.group == 0 && used.kind == PortUseKind::Took && used.time < Nanos(50 * MS);
    let last = ran.uses().into_iter().filter(is_one).max_by_key(|used| used.time).unwrap();
    let changed = |record: &Record| match PortUse::from_record(record) {
        Some(used) if used == last => PortUse { count: used.count + 100, ..used }.into(),
        _ => *record,
    };
    let records: Vec<Record> = ran.records.iter().map(changed).collect();
    let again = rerun(Recording::from_records(&records).before(Nanos(50 * MS)), &plan);
    let fault = again.report.fault.unwrap();
    assert_eq!((&*fault.group, fault.at), ("group-0", last.time));
    assert!(fault.what.contains(&format!("waits for number {} of port {}", last.count + 100, last.port)), "{fault}");
    assert!(again.report.groups[0].released < 25);
}

#[test]
fn an_actor_that_does_not_look_where_it_looked_has_left_the_recording() {
    let graph = |mut graph: RuntimeBuilder, looks: bool| {
        let records: Arc<Mutex<Vec<Record>>> = Arc::default();
        let sink = Arc::clone(&records);
        let mut drain = graph.drain();
        let (mut writer, mut reader) = graph.exchange(|| 0);
        let write = actor_fn("writer", move |ctx| {
            writer.publish(ctx);
            Outcome::Continue
        });
        let read = actor_fn("reader", move |ctx| {
            if looks || ctx.tick != 4 {
                reader.refresh(ctx);
            }
            Outcome::Continue
        });
        let logger = actor_fn("logger", move |_| {
            drain.drain(&mut sink.lock().unwrap());
            Outcome::Continue
        });
        graph.group(RateGroup::hz(100).name("w"), vec![write]).group(RateGroup::hz(100).name("r"), vec![read]);
        graph.group(RateGroup::hz(100).observer(), vec![logger]).until(Nanos(100 * MS));
        let running = graph.build().unwrap().start().unwrap();
        running.wait_for(Duration::MAX);
        let report = running.stop();
        let records = records.lock().unwrap().clone();
        (report, records)
    };
    let (_, records) = graph(Runtime::builder(Execution::Virtual), true);
    let (report, _) = graph(Runtime::reexecution(Recording::from_records(&records)), false);
    let fault = report.fault.unwrap();
    assert_eq!((&*fault.group, fault.at), ("r", Nanos(40 * MS)));
    assert!(fault.what.contains("left the recording: release 4 has not read port 0"), "{fault}");
}

#[test]
fn a_recording_of_another_graph_is_refused() {
    let (ran, _) = small();
    let mut graph = Runtime::reexecution(ran.recording());
    let error = graph.group(RateGroup::hz(100), vec![]).build().unwrap_err();
    assert_eq!(error.kind(), GraphErrorKind::Refused);
    assert!(error.to_string().contains("another graph"), "{error}");
}

#[test]
fn an_observers_fault_does_not_end_the_re_execution() {
    let run = |mut graph: RuntimeBuilder, fails: bool| {
        let records = Arc::new(Mutex::new(Vec::new()));
        let (mut drain, all) = (graph.drain(), Arc::clone(&records));
        let log = actor_fn("log", move |ctx| {
            assert!(!fails || ctx.tick < 2, "injected");
            drain.drain(&mut all.lock().unwrap());
            Outcome::Continue
        });
        graph.group(RateGroup::hz(1000).name("work"), vec![actor_fn("idle", |_| Outcome::Continue)]);
        graph.group(RateGroup::hz(1000).name("log").observer(), vec![log]).until(Nanos(50 * MS));
        let running = graph.build().unwrap().start().unwrap();
        running.wait_for(Duration::MAX);
        let report = running.stop();
        (report, Recording::from_records(records.lock().unwrap().iter()))
    };
    let (report, recording) = run(Runtime::builder(Execution::Virtual), false);
    let (again, _) = run(Runtime::reexecution(recording), true);
    assert_eq!((report.groups[0].released, again.groups[0].released), (51, 51));
    assert_eq!(again.fault.map(|fault| fault.group).as_deref(), Some("log"));
}
