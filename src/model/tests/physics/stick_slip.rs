//! A surface that takes more to break loose than to keep sliding: stick-slip and steady sliding, against closed solutions.

use std::f64::consts::PI;

use crate::common::*;
use palpate_model::Vec3;
use palpate_model::body::{Body, State};
use palpate_model::contact::{Contact, ContactMode, Friction, Law, ToolMotion};
use palpate_model::simulation::{Simulation, Stepping};

/// What was felt in each tick.
struct Drag {
    tick: f64,
    /// Tangential and normal (N).
    forces: Vec<f64>,
    normals: Vec<f64>,
    modes: Vec<ContactMode>,
}

impl Drag {
    fn changes_to(&self, mode: ContactMode) -> Vec<usize> {
        (1..self.modes.len()).filter(|&n| self.modes[n] == mode && self.modes[n - 1] != mode).collect()
    }

    /// From sticking to slipping: the last ticks that stuck. The first touch is none.
    fn breakaways(&self) -> Vec<usize> {
        let slips = self.changes_to(ContactMode::Slip).into_iter().map(|n| n - 1);
        slips.filter(|&n| self.modes[n] == ContactMode::Stick).collect()
    }

    /// The second ticks that stick after each breakaway: the first still stops what is left of the slip.
    fn catches(&self) -> Vec<usize> {
        let first = self.breakaways()[0];
        self.changes_to(ContactMode::Stick).into_iter().map(|n| n + 1).filter(|&n| n > first + 1).collect()
    }

    fn changes(&self) -> usize {
        self.modes.windows(2).filter(|pair| pair[0] != pair[1]).count()
    }
}

/// A mass on a spring and a damper, pressed with N against a band that moves at `speed`.
struct Oscillator {
    mass: f64,
    stiffness: f64,
    damping: f64,
    normal: f64,
    speed: f64,
}

impl Oscillator {
    fn drag(&self, friction: Friction, tick: f64, seconds: f64) -> Drag {
        let (mut x, mut v, mut mode) = (0.0, 0.0, ContactMode::Free);
        let mut drag = Drag { tick, forces: Vec::new(), normals: Vec::new(), modes: Vec::new() };
        for _ in 0..(seconds / tick) as usize {
            v -= tick * (self.stiffness * x + self.damping * v) / self.mass;
            let holds = Vec3::x() * (self.mass * (v - self.speed));
            let impulse;
            let sticks = mode == ContactMode::Stick;
            (mode, impulse) = friction.resolve(sticks, holds, self.normal * tick, 1.0 / self.mass);
            v -= impulse.x / self.mass;
            x += tick * v;
            drag.forces.push(-impulse.x / tick);
            drag.normals.push(self.normal);
            drag.modes.push(mode);
        }
        drag
    }
}

/// Without damping a slip is an oscillation about mu_k N / K. It begins F / K above that, F = (mu_s - mu_k) N, with the band's
/// speed V, and ends F / K below with the same speed, (pi + 2 atan(K V / (w F))) / w later; sticking brings the 2 F / K back with
/// V.
#[test]
fn a_mass_on_a_spring_has_the_frequency_and_amplitude_of_the_closed_solution() {
    let oscillator = Oscillator { mass: 0.01, stiffness: 100.0, damping: 0.0, normal: 0.5, speed: 0.05 };
    let friction = Friction { kinetic: 0.4, breakaway: 0.8, stribeck: 0.0 };
    let (w, drop) = ((100.0_f64 / 0.01).sqrt(), 0.4 * 0.5);
    let ahead = (100.0 * 0.05 / (w * drop)).atan();
    let period = 2.0 * drop / (100.0 * 0.05) + (PI + 2.0 * ahead) / w;
    for rate_hz in [1000.0, 2000.0, 4000.0] {
        let tick = 1.0 / rate_hz;
        let drag = oscillator.drag(friction, tick, 20.5 * period);
        let (loose, caught) = (drag.breakaways(), drag.catches());
        assert!(loose.len() >= 19, "{rate_hz}: {} slips", loose.len());
        let measured = (loose[loose.len() - 1] - loose[0]) as f64 * tick / (loose.len() - 1) as f64;
        let falls = loose.iter().zip(&caught).map(|(&l, &c)| drag.forces[l] - drag.forces[c]);
        let fall = falls.sum::<f64>() / caught.len() as f64;
        println!("{rate_hz} Hz: period {measured:.4} s of {period:.4}, fall {fall:.4} N of {:.4}", 2.0 * drop);
        assert!((measured / period - 1.0).abs() < 0.02, "{rate_hz}: a period of {measured} s, {period} s is expected");
        assert!((fall / (2.0 * drop) - 1.0).abs() < 0.05, "{rate_hz}: a fall of {fall} N");
        // Check that the contact changes twice a cycle and never chatters
        assert!(drag.changes() <= 2 * loose.len() + 1, "{rate_hz}: {} changes", drag.changes());
        // Check that the force reaches breakaway, within the rise of one tick, and never passes it
        let rise = 100.0 * 0.05 * tick;
        assert!(loose.iter().all(|&n| drag.forces[n] <= 0.4 && drag.forces[n] > 0.4 - 1.5 * rise), "{rate_hz}");
    }
}

/// With damping c > N |mu'(V)| sliding at V is steady: the band breaks the mass loose once, and it never sticks again.
#[test]
fn above_the_critical_slope_of_stribeck_sliding_is_steady() {
    let oscillator = Oscillator { mass: 0.01, stiffness: 100.0, damping: 0.5, normal: 0.5, speed: 5e-3 };
    for rate_hz in [1000.0, 2000.0, 4000.0] {
        let friction = Friction { kinetic: 0.4, breakaway: 0.8, stribeck: 0.2 };
        let drag = oscillator.drag(friction, 1.0 / rate_hz, 4.0);
        let settled = &drag.forces[drag.forces.len() / 2..];
        let expected = friction.sliding(5e-3) * 0.5;
        assert!(settled.iter().all(|force| (force / expected - 1.0).abs() < 1e-6), "{rate_hz}: {expected} {settled:?}");
        assert_eq!(drag.changes(), 1, "{rate_hz}");
        // Check that a fall within less than the speed of the drag makes the same mass stick and slip
        let abrupt = oscillator.drag(Friction { stribeck: 1e-3, ..friction }, 1.0 / rate_hz, 4.0);
        let cycles = abrupt.breakaways().len();
        assert!(cycles > 3 && abrupt.changes() <= 2 * cycles + 1, "{rate_hz}: {cycles}, {} changes", abrupt.changes());
    }
}

/// The reference block, pressed 4 mm deep into the middle of its top within 0.2 s and dragged along x from 0.5 s on at `speed`.
fn drag_block(friction: impl Into<Friction>, zeta: f64, speed: f64, rate_hz: f64, seconds: f64) -> Drag {
    let tick = 1.0 / rate_hz;
    let body = block((STD.0, STD.1, zeta));
    let stepping = Stepping { tick, substeps: (4000.0 / rate_hz) as u32 };
    let law = Law { friction: friction.into(), ..Law::default() };
    let state = State::at_rest(body.rest());
    let mut sim = Simulation::new(Box::new(body), state, Contact::default(), law, stepping).unwrap();
    let at = |t: f64| Vec3::new(0.04 + speed * (t - 0.5).max(0.0), 0.0512, 0.1005 - 4.5e-3 * minjerk(t / 0.2));
    let mut drag = Drag { tick, forces: Vec::new(), normals: Vec::new(), modes: Vec::new() };
    for n in 0..((0.5 + seconds) * rate_hz) as u32 {
        let [from, to] = [n, n + 1].map(|n| at(f64::from(n) * tick));
        let force = sim.tick(ToolMotion::straight(from, to)).force;
        let contact = sim.contact(0);
        let normal = force.dot(&contact.normal);
        drag.normals.push(normal);
        drag.forces.push((force - contact.normal * normal).norm());
        drag.modes.push(contact.mode);
    }
    drag
}

/// The stiffness K of the block's contact point along the surface (N/m), from a drag that cannot slip.
fn stiffness_along() -> f64 {
    let (speed, rate_hz) = (5e-3, 1000.0);
    let drag = drag_block(f64::INFINITY, STD.2, speed, rate_hz, 0.8);
    let [a, b] = [1000, 1250];
    (drag.forces[b] - drag.forces[a]) / (speed * (b - a) as f64 / rate_hz)
}

/// The block damps its contact point so much that a slip does not swing through: the fall is (mu_s - mu_k) N, and not twice that.
/// Sticking raises the force with K V, K that of the place where the tool sticks: near a node, as where the drag begins, more
/// than between nodes, by up to a third.
#[test]
fn a_tool_dragged_slowly_over_a_block_sticks_and_slips_and_never_chatters() {
    let (speed, stiffness) = (5e-3, stiffness_along());
    let friction = Friction { kinetic: 0.4, breakaway: 0.8, stribeck: 0.0 };
    let mut times = Vec::new();
    for rate_hz in [1000.0, 2000.0, 4000.0] {
        let drag = drag_block(friction, STD.2, speed, rate_hz, 4.0);
        let (loose, caught) = (drag.breakaways(), drag.catches());
        println!("{rate_hz} Hz: {} slips, {} changes, K {stiffness:.1} N/m", loose.len(), drag.changes());
        // Check that the contact changes twice a cycle: the touch, and then loose and caught
        assert_eq!((loose.len(), caught.len(), drag.changes()), (6, 6, 13), "{rate_hz}");
        for (&l, &c) in loose.iter().zip(&caught) {
            let (held, kept) = (drag.forces[l] / drag.normals[l], drag.forces[c] / drag.normals[c]);
            println!("  from {held:.3} to {kept:.3} of the normal force in {:.3} s", (c - l) as f64 * drag.tick);
            // In the mean over the substeps of a tick it may have broken loose in one and not before
            assert!(held > 0.97 * 0.8 && held < 0.8 + 1e-9, "{rate_hz}: loose at {held} of the normal force");
            assert!(kept > 0.97 * 0.4 && kept < 0.4 + 1e-9, "{rate_hz}: caught at {kept} of the normal force");
        }
        for (&c, &l) in caught.iter().zip(&loose[1..]) {
            let rise = (drag.forces[l] - drag.forces[c]) / ((l - c) as f64 * drag.tick * stiffness * speed);
            println!("  rises with {rise:.3} K V");
            assert!((0.66..1.0).contains(&rise), "{rate_hz}: {rise}");
        }
        times.push(loose.iter().map(|&n| n as f64 * drag.tick).collect::<Vec<_>>());
    }
    // Check that it is the surface that decides when, and not the rate
    for (n, &reference) in times[2].iter().enumerate() {
        assert!(times.iter().all(|of_rate| (of_rate[n] - reference).abs() < 5e-3), "slip {n}: {times:?}");
    }
}

/// A Stribeck speed above that of the drag, a body that damps more than the coefficient falls: no stick-slip.
#[test]
fn a_tool_dragged_over_a_damped_block_slower_than_stribeck_slides_steadily() {
    let friction = Friction { kinetic: 0.4, breakaway: 0.5, stribeck: 0.1 };
    for rate_hz in [1000.0, 2000.0, 4000.0] {
        let drag = drag_block(friction, 1.0, 0.05, rate_hz, 0.6);
        let settled = (0.8 * rate_hz) as usize..drag.modes.len();
        assert!(drag.modes[settled.clone()].iter().all(|&mode| mode == ContactMode::Slip), "{rate_hz}");
        let felt = settled.map(|n| drag.forces[n] / drag.normals[n]);
        let (least, most) = felt.fold((f64::INFINITY, 0.0_f64), |(least, most), mu| (least.min(mu), most.max(mu)));
        let expected = friction.sliding(0.05);
        println!("{rate_hz} Hz: {least:.3} to {most:.3} of the normal force, {expected:.3} is expected");
        // The surface moves a little with the tool and back, from triangle to triangle
        assert!(least > 0.97 * expected && most < 1.03 * expected, "{rate_hz}: {least} to {most}");
    }
}
