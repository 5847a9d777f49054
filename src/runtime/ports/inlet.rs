//! Ports from outside the graph to a running actor: the newest value of a parameter, and commands in order.
//!
//! The outside takes a lock of its own, the actor's side is wait-free. What an actor takes is recorded with its value, as
//! a device's sample is: nothing in the graph could produce it again. In a [re-execution](crate::Recording) each release
//! gets what it got then, and what is set from outside has no effect but on observers.

use crate::actor::{Phase, TickContext};
use crate::ports::hot_swap::Swappable;
use crate::ports::hot_swap_queue::{Numbered, SwappableConsumer};
use crate::ports::port_state::{Looks, PortPlan, UseRecorder};
use crate::ports::port_traffic::Counter;
use crate::ports::restartable::{ExchangePair, RingPair, exchange_pair, ring_pair};
use crate::primitives::exchange::{ExchangeReader, ExchangeWriter};
use crate::primitives::fenced_counter::FencedCounter;
use crate::primitives::ring::Producer;
use crate::primitives::sync::lock;
use crate::records::port_use::PortUseKind;
use crate::reexecution::script::ScriptedPort;
use crate::time::Nanos;
use std::sync::{Arc, Mutex};

/// A value that fits into a record: what a [`Parameter`] or [`Commands`] can carry.
///
/// ```
/// use palpate_runtime::InputValue;
///
/// #[derive(Clone, Copy, Debug, PartialEq)]
/// enum Order {
///     Home,
///     MoveTo { x_m: f64 },
/// }
///
/// impl InputValue for Order {
///     fn to_words(self) -> [u64; 5] {
///         match self {
///             Self::Home => [0; 5],
///             Self::MoveTo { x_m } => [1, x_m.to_bits(), 0, 0, 0],
///         }
///     }
///
///     fn from_words(words: [u64; 5]) -> Self {
///         if words[0] == 0 { Self::Home } else { Self::MoveTo { x_m: f64::from_bits(words[1]) } }
///     }
/// }
///
/// let order = Order::MoveTo { x_m: 0.25 };
/// assert_eq!(Order::from_words(order.to_words()), order);
/// ```
pub trait InputValue: Copy + Send + 'static {
    /// The value as words; every bit of it counts.
    ///
    /// # Real-time
    /// Called in ticks: must be wait-free and allocate nothing.
    fn to_words(self) -> [u64; 5];

    /// The value that these words are.
    ///
    /// # Real-time
    /// Called in ticks: must be wait-free and allocate nothing.
    fn from_words(words: [u64; 5]) -> Self;
}

macro_rules! input {
    ($($type:ty: |$value:ident| $to:expr, |$word:ident| $from:expr;)*) => {
        $(impl InputValue for $type {
            fn to_words(self) -> [u64; 5] {
                let $value = self;
                [$to, 0, 0, 0, 0]
            }

            fn from_words([$word, ..]: [u64; 5]) -> Self {
                $from
            }
        })*
    };
}

input! {
    f64: |value| value.to_bits(), |word| f64::from_bits(word);
    bool: |value| u64::from(value), |word| word != 0;
    u64: |value| value, |word| word;
    i64: |value| value as u64, |word| word as i64;
    u32: |value| u64::from(value), |word| word as u32;
    i32: |value| value as u64, |word| word as i32;
}

macro_rules! input_array {
    ($($length:literal)*) => {
        $(impl InputValue for [f64; $length] {
            fn to_words(self) -> [u64; 5] {
                std::array::from_fn(|n| self.get(n).map_or(0, |value| value.to_bits()))
            }

            fn from_words(words: [u64; 5]) -> Self {
                std::array::from_fn(|n| f64::from_bits(words[n]))
            }
        })*
    };
}

input_array!(1 2 3 4 5);

/// True where the graph's own order decides what an actor sees: starts are the same in every run.
fn looks_outside(ctx: &TickContext) -> bool {
    matches!(ctx.phase, Phase::Release | Phase::Observer)
}

struct ParameterState<T> {
    plan: PortPlan,
    script: Option<ScriptedPort>,
    pair: ExchangePair<T>,
    writer: Swappable<ExchangeWriter<T>>,
    versions: FencedCounter,
    value: T,
    sent: Counter,
}

impl<T: Copy> ParameterState<T> {
    fn publish(&mut self) {
        let Some(version) = self.versions.next() else { return };
        *self.writer.half_mut().buffer() = self.value;
        self.writer.publish_as(version, Nanos::ZERO);
    }
}

/// A value that a program sets from outside while the graph runs; clones set the same one. Made by
/// [`RuntimeBuilder::parameter`](crate::RuntimeBuilder::parameter).
///
/// ```
/// use palpate_runtime::{Execution, Nanos, Outcome, RateGroup, Runtime, actor_fn};
/// use std::time::Duration;
///
/// let mut graph = Runtime::builder(Execution::Virtual);
/// let gain = graph.parameter(1.0);
/// let (mut read, mut seen) = (gain.reader(), Vec::new());
/// let (mut show, mut shown) = graph.outlet(Vec::new);
/// let actor = actor_fn("controller", move |ctx| {
///     read.refresh(ctx);
///     seen.push(read.get());
///     show.buffer().clone_from(&seen);
///     show.publish(ctx);
///     Outcome::Continue
/// });
/// let running = graph.group(RateGroup::hz(100), vec![actor]).until(Nanos(30_000_000)).build()?.start()?;
/// running.wait_for(Duration::from_millis(15));
/// gain.set(2.5); // from any thread
/// running.wait_for(Duration::MAX);
/// assert!(shown.refresh());
/// assert_eq!(*shown.get(), [1.0, 1.0, 2.5, 2.5]);
/// # Ok::<(), palpate_runtime::GraphError>(())
/// ```
///
/// # Real-time
/// Takes a lock among those who set it; the actor that reads it never waits.
pub struct Parameter<T>(Arc<Mutex<ParameterState<T>>>);

impl<T: InputValue> Parameter<T> {
    pub(crate) fn new(plan: PortPlan, script: Option<ScriptedPort>, initial: T) -> Self {
        let mut pair = exchange_pair(move || initial);
        let mut versions = FencedCounter::default();
        let (writer, versions) = pair.writer(&mut versions);
        let sent = plan.sides.writer.take();
        Self(Arc::new(Mutex::new(ParameterState { plan, script, pair, writer, versions, value: initial, sent })))
    }

    /// Sets the value: the next release of the actor that looks takes it.
    ///
    /// # Real-time
    /// Takes a lock: from outside of ticks.
    pub fn set(&self, value: T) {
        self.update(|old| *old = value);
    }

    /// Changes the value that was set last, whoever sets it meanwhile: the next release of the actor that looks takes the result.
    ///
    /// # Real-time
    /// Takes a lock: from outside of ticks.
    pub fn update(&self, change: impl FnOnce(&mut T)) {
        let state = &mut *lock(&self.0);
        let mut value = state.value;
        change(&mut value);
        // Only now: a change that panics changes nothing.
        state.value = value;
        state.publish();
        state.sent.pass_outside();
    }

    /// The value set last.
    ///
    /// # Real-time
    /// Takes a lock: from outside of ticks.
    pub fn value(&self) -> T {
        lock(&self.0).value
    }

    /// The actor's half; fences the one taken before. It begins with the initial value and takes the one set last at its
    /// first look.
    ///
    /// # Real-time
    /// Takes a lock and allocates: before the run, and for [factories](crate::RuntimeBuilder::restartable).
    pub fn reader(&self) -> ParameterReader<T> {
        let state = &mut *lock(&self.0);
        let half = state.pair.reader();
        let value = *half.half().get();
        if state.versions.last() > 0 {
            // The one before may have taken it already.
            state.publish();
        }
        let (took, taken) = (state.plan.recorder(PortUseKind::Took), state.plan.sides.reader.take());
        ParameterReader { half, value, looks: Looks::default(), took, script: state.script.clone(), taken }
    }
}

/// The actor's side of a [`Parameter`].
pub struct ParameterReader<T> {
    half: Swappable<ExchangeReader<T>>,
    value: T,
    looks: Looks,
    took: UseRecorder,
    script: Option<ScriptedPort>,
    taken: Counter,
}

impl<T: InputValue> ParameterReader<T> {
    /// Takes the value set last if it was not taken yet; returns whether there was one. A release looks once, and a start
    /// never finds one.
    ///
    /// # Real-time
    /// On threads wait-free, real-time safe; in a re-execution it takes an uncontended lock.
    pub fn refresh(&mut self, ctx: &TickContext) -> bool {
        if !looks_outside(ctx) || !self.looks.is_first(ctx) {
            return false;
        }
        let fresh = match &self.script {
            Some(script) if ctx.phase == Phase::Release => script.input(ctx).map(T::from_words),
            _ => self.half.refresh().then(|| *self.half.half().get()),
        };
        let Some(value) = fresh else { return false };
        self.value = value;
        self.taken.pass(ctx);
        if ctx.phase == Phase::Release {
            self.took.push_input(ctx, value.to_words());
        }
        true
    }

    /// The value taken last, or the initial one.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn get(&self) -> T {
        self.value
    }
}

struct CommandsState<T> {
    plan: PortPlan,
    script: Option<ScriptedPort>,
    pair: RingPair<T>,
    writer: Swappable<Producer<Numbered<T>>>,
    attempts: FencedCounter,
    sent: Counter,
}

/// Commands that a program sends from outside while the graph runs, each of which arrives once, in order; clones send
/// into the same queue. Made by [`RuntimeBuilder::commands`](crate::RuntimeBuilder::commands).
///
/// # Real-time
/// Takes a lock among those who send; the actor that receives never waits.
pub struct Commands<T>(Arc<Mutex<CommandsState<T>>>);

impl<T: InputValue> Commands<T> {
    pub(crate) fn new(plan: PortPlan, script: Option<ScriptedPort>, capacity: usize) -> Self {
        let mut pair = ring_pair(capacity);
        let mut attempts = FencedCounter::default();
        let (writer, attempts) = pair.writer(&mut attempts);
        let sent = plan.sides.writer.take();
        Self(Arc::new(Mutex::new(CommandsState { plan, script, pair, writer, attempts, sent })))
    }

    /// Sends a command; false if the queue is full: the command is then dropped and counted.
    ///
    /// # Real-time
    /// Takes a lock: from outside of ticks.
    pub fn send(&self, command: T) -> bool {
        let state = &mut *lock(&self.0);
        let number = state.attempts.next().unwrap_or(0);
        let sent = state.writer.push(Numbered { number, value: command });
        if sent {
            state.sent.pass_outside();
        } else {
            state.sent.drop_one();
        }
        sent
    }

    /// The actor's half; fences the one taken before, and gets what is sent from then on.
    ///
    /// # Real-time
    /// Takes a lock and allocates: before the run, and for [factories](crate::RuntimeBuilder::restartable).
    pub fn receiver(&self) -> CommandReceiver<T> {
        let state = &mut *lock(&self.0);
        let (took, taken) = (state.plan.recorder(PortUseKind::Saw), state.plan.sides.reader.take());
        let consumer = SwappableConsumer::new(state.pair.reader());
        CommandReceiver { consumer, visible: 0, looks: Looks::default(), took, script: state.script.clone(), taken }
    }
}

/// The actor's side of [`Commands`].
pub struct CommandReceiver<T> {
    consumer: SwappableConsumer<T>,
    /// The number of the newest command that was there when this release looked.
    visible: u64,
    looks: Looks,
    took: UseRecorder,
    script: Option<ScriptedPort>,
    taken: Counter,
}

impl<T: InputValue> CommandReceiver<T> {
    /// Takes the oldest command that was there when the release looked first; a start never finds one.
    ///
    /// # Real-time
    /// On threads wait-free, real-time safe; in a re-execution it takes an uncontended lock.
    pub fn pop(&mut self, ctx: &TickContext) -> Option<T> {
        if !looks_outside(ctx) {
            return None;
        }
        let command = match &self.script {
            Some(script) if ctx.phase == Phase::Release => script.input(ctx).map(T::from_words)?,
            _ => {
                if self.looks.is_first(ctx) {
                    self.visible = self.consumer.newest().unwrap_or(self.visible);
                }
                self.consumer.pop(self.visible)?
            }
        };
        self.taken.pass(ctx);
        if ctx.phase == Phase::Release {
            self.took.push_input(ctx, command.to_words());
        }
        Some(command)
    }
}

impl<T> Clone for Parameter<T> {
    fn clone(&self) -> Self {
        Self(Arc::clone(&self.0))
    }
}

impl<T> Clone for Commands<T> {
    fn clone(&self) -> Self {
        Self(Arc::clone(&self.0))
    }
}

impl_debug!(Parameter<T>);

impl_debug!(Commands<T>);

impl_debug!(ParameterReader<T>);

impl_debug!(CommandReceiver<T>, "visible": |own| own.visible);
