//! The safety pipeline over random inputs: limits, energy, and that nothing is done in silence. Pure functions of state and
//! counted time: no session, no threads.

#[path = "../../../tests/random/mod.rs"]
mod random;

use super::*;
use proptest::prelude::*;
use random::Random;

type V3 = [f64; 3];

fn norm(v: V3) -> f64 {
    v.iter().map(|c| c * c).sum::<f64>().sqrt()
}

fn dot(a: V3, b: V3) -> f64 {
    (0..3).map(|i| a[i] * b[i]).sum()
}

/// What computes the force.
#[derive(Clone, Copy, Debug)]
enum Law {
    /// A sampled spring: leaks.
    Spring(f64),
    /// A spring with negative damping.
    Active(f64, f64),
    /// The worst: always along the motion.
    Along(f64),
    /// A spring that is only looked at every 33 ms.
    Hold(f64),
    /// Another force each tick.
    Noise(f64),
    /// Always the same.
    Constant(V3),
}

impl Law {
    fn any(random: &mut Random) -> Self {
        match (random.next() * 6.0) as u32 {
            0 => Self::Spring(random.within(10.0, 5000.0)),
            1 => Self::Active(random.within(0.0, 1000.0), random.within(0.0, 20.0)),
            2 => Self::Along(random.within(0.1, 20.0)),
            3 => Self::Hold(random.within(10.0, 2000.0)),
            4 => Self::Noise(random.within(0.1, 20.0)),
            _ => Self::Constant(random.vector(3.0)),
        }
    }

    fn force(self, n: u32, tool: &Tool, last: V3, random: &mut Random) -> V3 {
        match self {
            Self::Spring(k) => tool.position.map(|c| -k * c),
            Self::Active(k, b) => std::array::from_fn(|i| -k * tool.position[i] + b * tool.velocity[i]),
            Self::Along(f) => tool.velocity.map(|c| f * c / norm(tool.velocity).max(1e-9)),
            Self::Hold(k) if n.is_multiple_of(33) => tool.position.map(|c| -k * c),
            Self::Hold(_) => last,
            Self::Noise(f) => random.vector(f),
            Self::Constant(f) => f,
        }
    }
}

/// A hand with a mass: its speed and its acceleration are bounded.
struct Tool {
    position: V3,
    velocity: V3,
    acceleration: V3,
    fastest: f64,
    left: u32,
}

/// What a hand on a light device reaches (m/s^2).
const MOST_ACCELERATION: f64 = 50.0;

impl Tool {
    fn new(fastest: f64) -> Self {
        Self { position: [0.0; 3], velocity: [0.0; 3], acceleration: [0.0; 3], fastest, left: 0 }
    }

    fn advance(&mut self, dt: f64, random: &mut Random) {
        if self.left == 0 {
            self.left = random.within(1.0, 60.0) as u32;
            let size = MOST_ACCELERATION / 3.0_f64.sqrt() * random.next();
            self.acceleration = random.vector(size);
        }
        self.left -= 1;
        for i in 0..3 {
            self.velocity[i] += self.acceleration[i] * dt;
        }
        let speed = norm(self.velocity);
        if speed > self.fastest {
            self.velocity = self.velocity.map(|c| c * self.fastest / speed);
        }
        for i in 0..3 {
            // Around the origin, so that it moves in and out of whatever is there.
            self.velocity[i] -= 2.0 * self.position[i] * dt;
            self.position[i] += self.velocity[i] * dt;
        }
    }
}

fn limits(random: &mut Random) -> Limits {
    let mut limits = Limits::new(&DeviceLimits::of_force(random.within(0.5, 12.0)));
    limits.start_up = limits.start_up.filter(|_| random.chance(0.3));
    limits.max_slew_n_per_s = random.within(100.0, 1000.0);
    limits
}

/// The request, now and then with something that no model should ever give.
fn spoilt(force: V3, random: &mut Random) -> V3 {
    let mut force = force;
    if random.chance(0.02) {
        let axis = (random.next() * 3.0) as usize % 3;
        force[axis] =
            [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, f64::MAX, -1e200][(random.next() * 5.0) as usize % 5];
    }
    force
}

fn assert_reported(limits: &Limits, input: &Input, speed: f64, output: (V3, Actions)) -> Result<(), TestCaseError> {
    let (force, actions) = output;
    let has = |stage| actions.contains(stage);
    if let Request::Force(asked) = input.request {
        let finite = asked.iter().all(|c| c.is_finite());
        prop_assert_eq!(has(Actions::FINITE), !finite);
        let too_large = finite && asked.iter().any(|c| c.abs() > limits.max_force_n);
        prop_assert!(!too_large || has(Actions::CLAMP), "{input:?} {actions:?}");
        prop_assert!(force == asked || actions != Actions::default(), "{asked:?} became {force:?} in silence");
    } else {
        prop_assert!(has(Actions::RAMP));
    }
    let ToolSpeed { fade_m_s, .. } = limits.tool_speed.unwrap();
    prop_assert_eq!(has(Actions::TOOL_SPEED), speed.is_nan() || speed > fade_m_s);
    let is_old = f64::from(input.model_age_ticks) > limits.model_age.unwrap().max_ticks;
    prop_assert!(!is_old || has(Actions::MODEL_AGE));
    prop_assert_eq!(has(Actions::WATCHDOG), input.stale_ticks > limits.watchdog.unwrap().max_stale_ticks);
    Ok(())
}

const TICKS: u32 = 300;

/// Everything at once: forces that are no numbers, positions that are none, teleports, slips, gaps, silence, old models.
fn run_with_faults(seed: u64) -> Result<(), TestCaseError> {
    let random = &mut Random(seed);
    let (limits, law) = (limits(random), Law::any(random));
    let mut pipeline = Pipeline::new(limits);
    let fastest = random.within(0.01, 3.0);
    let mut tool = Tool::new(fastest);
    let (mut last, mut wanted, mut known, mut stale, mut age) = ([0.0; 3], [0.0; 3], None::<V3>, 0, 0);
    for n in 0..TICKS {
        if random.chance(0.003) {
            let output = pipeline.release();
            prop_assert_eq!((output.force, output.actions), ([0.0; 3], Actions::RAMP));
            (last, known) = ([0.0; 3], None);
            continue;
        }
        let dt = 1e-3 * if random.chance(0.05) { 1.0 + (random.next() * 20.0).floor() } else { 1.0 };
        tool.advance(dt, random);
        wanted = spoilt(law.force(n, &tool, wanted, random), random);
        stale = if random.chance(0.1) { stale + 1 } else { 0 };
        age = if random.chance(0.03) { 0 } else { age + (random.next() * 4.0) as u32 };
        let mut position = tool.position;
        if random.chance(0.02) {
            position[1] = [f64::NAN, f64::INFINITY, 1e300, -5.0][(random.next() * 4.0) as usize % 4];
        }
        let input = Input {
            request: if random.chance(0.03) { Request::Rest } else { Request::Force(wanted) },
            torque: [0.0; 3],
            dt,
            position,
            stale_ticks: stale,
            model_age_ticks: age,
            swap_step: if random.chance(0.05) { spoilt(random.vector(1.0), random) } else { [0.0; 3] },
            dissipated_j: spoilt(random.vector(1e-4), random)[0],
        };
        let output = pipeline.apply(&input);
        prop_assert!(output.force.iter().all(|c| c.is_finite()), "{input:?}: {output:?}");
        prop_assert!(norm(output.force) <= limits.max_force_n * (1.0 + 1e-12), "{input:?}: {output:?}");
        let change = norm(std::array::from_fn(|i| output.force[i] - last[i]));
        prop_assert!(change <= limits.max_slew_n_per_s * dt * (1.0 + 1e-9), "{input:?}: {last:?} {output:?}");
        let seen = position.iter().all(|c| c.is_finite());
        let moved = |from: V3| norm(std::array::from_fn(|i| (position[i] - from[i]) / dt));
        let speed = if seen { known.map_or(0.0, moved) } else { 0.0 };
        assert_reported(&limits, &input, speed, (output.force, output.actions))?;
        known = if seen { Some(position) } else { known };
        last = output.force;
    }
    Ok(())
}

/// What a case gave out, and what it may.
#[derive(Debug)]
struct Energy {
    /// The most that was ever out, net (J).
    out_j: f64,
    /// What was stored, the tolerance, and what the slew limit and the sampling let through (J).
    may_j: f64,
}

/// A tool that moves like one, whatever the environment does.
fn run_for_energy(seed: u64, with_controller: bool) -> Result<Energy, TestCaseError> {
    let random = &mut Random(seed);
    let (mut limits, law) = (limits(random), Law::any(random));
    limits.start_up = None;
    // From slow hands, for which the bound is little more than the tolerance, to the speed at which there is no force.
    let fastest = 0.02 * 95.0_f64.powf(random.next());
    let step = [0.0, 0.0, 10e-6, 60e-6][(random.next() * 4.0) as usize % 4];
    let slips = random.chance(0.3);
    let mut passivity = limits.passivity.unwrap();
    passivity.stored_j = if random.chance(0.3) { random.within(0.0, 0.02) } else { 0.0 };
    passivity.noise_m_s = step / 1e-3;
    // A step of the encoder looks like a motion of its own.
    let fastest_seen = fastest + 2.0 * 3.0_f64.sqrt() * step / 1e-3;
    let longest = if slips { 5e-3 } else { 1e-3 };
    let may_j =
        passivity.stored_j + passivity.bound_j(limits.max_force_n, limits.max_slew_n_per_s, fastest_seen, longest);
    limits.passivity = with_controller.then_some(passivity);
    let mut pipeline = Pipeline::new(limits);
    let mut tool = Tool::new(fastest);
    let (mut last, mut known, mut wanted) = ([0.0; 3], None::<V3>, [0.0; 3]);
    let (mut balance, mut out_j) = (0.0, 0.0_f64);
    let mut asks_nothing = true;
    for n in 0..4 * TICKS {
        let dt = 1e-3 * if slips && random.chance(0.05) { 1.0 + (random.next() * 5.0).floor() } else { 1.0 };
        tool.advance(dt, random);
        let position = tool.position.map(|c| if step > 0.0 { (c / step).round() * step } else { c });
        if let Some(known) = known {
            balance += dot(last, std::array::from_fn(|i| position[i] - known[i]));
        }
        known = Some(position);
        out_j = out_j.max(balance);
        wanted = spoilt(law.force(n, &tool, wanted, random), random);
        let step = if n.is_multiple_of(33) { random.vector(0.5) } else { [0.0; 3] };
        let request = if random.chance(0.01) { Request::Rest } else { Request::Force(wanted) };
        let output = pipeline.apply(&Input { swap_step: step, ..Input::new(request, position, dt) });
        if with_controller {
            let booked = passivity.stored_j - balance;
            prop_assert!((output.energy_j - booked).abs() < 1e-9, "{} J booked, {booked} J done", output.energy_j);
            // A deficit is never served in silence.
            let acted = output.actions.0 & (Actions::PASSIVITY.0 | Actions::WITHDRAWN.0) != 0;
            // Of no force, or of a NaN's zero, nothing can be withdrawn; a rest keeps what was asked last, also that.
            if let Request::Force(asked) = request {
                let is_zero = asked == [0.0; 3] || output.actions.contains(Actions::FINITE);
                asks_nothing = is_zero && !output.actions.contains(Actions::SLEW);
            }
            let is_empty = output.force == [0.0; 3] || asks_nothing || output.actions.contains(Actions::FINITE);
            prop_assert!(acted || is_empty || booked >= -1e-12, "{output:?}");
        }
        last = output.force;
    }
    Ok(Energy { out_j, may_j })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 10_000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn no_input_makes_a_command_that_is_not_finite_too_large_or_too_fast_and_none_is_changed_in_silence(seed: u64) {
        run_with_faults(seed)?;
    }

    #[test]
    fn with_the_controller_on_no_more_energy_comes_out_than_was_stored_and_the_tolerance(seed: u64) {
        let Energy { out_j, may_j } = run_for_energy(seed, true)?;
        prop_assert!(out_j <= may_j, "{out_j} J of {may_j} J came out");
    }
}

/// Check that the property above can fail: the same cases without the controller give out more.
#[test]
fn without_the_controller_many_of_the_same_cases_break_the_bound() {
    let broken = (0..1000).filter(|&seed| {
        let Energy { out_j, may_j } = run_for_energy(seed, false).unwrap();
        out_j > may_j
    });
    let broken = broken.count();
    assert!(broken > 100, "{broken} of 1000");
}

/// A hand, a spring and a damper to where it wants to be, that holds a device along one axis.
struct Held {
    mass: f64,
    stiffness: f64,
    damping: f64,
    wants: f64,
    x: f64,
    v: f64,
}

impl Held {
    /// A millisecond under the command `force` (N).
    fn advance(&mut self, force: f64) {
        const SUBSTEPS: u32 = 20;
        for _ in 0..SUBSTEPS {
            let force = force + self.stiffness * (self.wants - self.x) - self.damping * self.v;
            self.v += force / self.mass * 1e-3 / f64::from(SUBSTEPS);
            self.x += self.v * 1e-3 / f64::from(SUBSTEPS);
        }
    }
}

/// A hand that presses a device against a wall whose force is renewed every 33 ms: the amplitude in the last second (m).
fn pressed_on_a_held_wall(passivity: bool) -> (f64, u32) {
    let wall_k = 600.0;
    let mut hand = Held { mass: 0.175, stiffness: 300.0, damping: 1.0, wants: -0.005, x: 0.001, v: 0.0 };
    let mut limits = Limits::new(&DeviceLimits::of_force(8.0));
    (limits.start_up, limits.model_age, limits.tank) = (None, None, None);
    limits.passivity = limits.passivity.filter(|_| passivity);
    let mut pipeline = Pipeline::new(limits);
    let (mut wall, mut acted) = (0.0, 0);
    let mut range = (f64::MAX, f64::MIN);
    for n in 0..5000_u32 {
        if n % 33 == 0 {
            wall = if hand.x < 0.0 { -wall_k * hand.x } else { 0.0 };
        }
        let output = pipeline.apply(&Input::new(Request::Force([wall, 0.0, 0.0]), [hand.x, 0.0, 0.0], 1e-3));
        acted += u32::from(output.actions.0 & (Actions::PASSIVITY.0 | Actions::WITHDRAWN.0) != 0);
        hand.advance(output.force[0]);
        if n >= 4000 {
            range = (range.0.min(hand.x), range.1.max(hand.x));
        }
    }
    (range.1 - range.0, acted)
}

#[test]
fn a_held_wall_swings_without_the_controller_and_rests_with_it() {
    let (without, none) = pressed_on_a_held_wall(false);
    let (with, acted) = pressed_on_a_held_wall(true);
    println!("peak to peak in the last second: {:.3} mm without, {:.3} mm with", 1e3 * without, 1e3 * with);
    assert!(none == 0 && acted > 0);
    assert!(with < 0.2 * without, "{with} m, {without} m without");
}

/// A hand that rests on a wall, as stiff as the device may render, after more energy has come out than there was.
struct Resting {
    /// Peak to peak in the last half second (m).
    swings: f64,
    /// What comes out after two seconds (J).
    drained: f64,
}

fn resting_on_a_wall(seed: u64) -> Resting {
    let random = &mut Random(seed);
    let [mass, stiffness, wall_k] = [[0.04, 0.3], [50.0, 600.0], [100.0, 600.0]].map(|[a, b]| random.within(a, b));
    let damping = random.within(0.2, 2.0) * (stiffness * mass).sqrt();
    let mut limits = Limits::new(&DeviceLimits::of_force(3.3));
    (limits.start_up, limits.model_age, limits.tank) = (None, None, None);
    (limits.max_slew_n_per_s, limits.ramp_s) = (random.within(100.0, 1000.0), 1e-3);
    let passivity = limits.passivity.as_mut().unwrap();
    passivity.max_damping_n_s_per_m = random.within(3.0, 8.0);
    passivity.stored_j = -random.within(0.05, 0.95) * passivity.tolerance_j;
    let mut pipeline = Pipeline::new(limits);
    let pressed = random.within(0.3, 3.0);
    let x = -pressed / wall_k;
    let mut hand = Held { mass, stiffness, damping, wants: x - pressed / stiffness, x, v: 0.0 };
    let (mut range, mut then, mut energy) = ((f64::MAX, f64::MIN), 0.0, 0.0);
    for n in 0..4000 {
        let force = Request::Force([(-wall_k * hand.x).max(0.0), 0.0, 0.0]);
        let output = pipeline.apply(&Input::new(force, [hand.x, 0.0, 0.0], 1e-3));
        energy = output.energy_j;
        if n == 2000 {
            then = energy;
        }
        hand.advance(output.force[0]);
        if n >= 3500 {
            range = (range.0.min(hand.x), range.1.max(hand.x));
        }
    }
    Resting { swings: range.1 - range.0, drained: then - energy }
}

/// A controller that switches as the tool trembles keeps the deficit that it is there to pay back.
#[test]
fn a_hand_that_rests_on_a_wall_comes_to_rest_whatever_has_come_out_before() {
    for seed in 0..1000 {
        let Resting { swings, drained } = resting_on_a_wall(seed);
        assert!(swings < 1e-6, "seed {seed}: {swings} m");
        assert!(drained < 1e-6, "seed {seed}: {drained} J");
    }
}
