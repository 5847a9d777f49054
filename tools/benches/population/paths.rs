//! How a hand moves a tool: what it does on purpose, and the tremor that is in every hand.

use std::f64::consts::TAU;

use super::random::Random;

/// Time of the way down and of the way up (s).
pub const PRESS_S: f64 = 0.2;
const LIFT_S: f64 = 0.15;

/// Where a tool can go on a body.
pub struct Ground {
    /// The middle of the motion, x and y (m).
    pub centre_m: [f64; 2],
    /// How far from it the tool may go along x and y (m).
    pub room_m: [f64; 2],
    /// How deep it presses (m).
    pub depth_m: f64,
    /// Edge of a cell or an element (m).
    pub cell_m: f64,
    /// The height of the surface at x, y (m).
    pub surface: Box<dyn Fn([f64; 2]) -> f64>,
}

/// What a hand does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motion {
    /// Presses, and kneads at 1 to 5 Hz.
    Sine,
    /// Taps from above, 2 to 5 times a second.
    Tap,
    /// A spiral outwards, 1 to 2.5 turns a second.
    Spiral,
    /// To and fro in no order.
    Scribble,
    /// A drag that ends at once, stands and goes back.
    Stop,
    /// A stroke of 0.2 to 0.5 m/s that lands in motion.
    Stroke,
}

impl Motion {
    pub const ALL: [Self; 6] = [Self::Sine, Self::Tap, Self::Spiral, Self::Scribble, Self::Stop, Self::Stroke];

    pub fn name(self) -> &'static str {
        match self {
            Self::Sine => "sine",
            Self::Tap => "tap",
            Self::Spiral => "spiral",
            Self::Scribble => "scribble",
            Self::Stop => "stop",
            Self::Stroke => "stroke",
        }
    }

    /// The place of the middle of a tool of that radius at a time, for `duration` seconds (m).
    pub fn way<'a>(
        self,
        ground: &'a Ground,
        radius: f64,
        duration: f64,
        random: &mut Random,
    ) -> impl Fn(f64) -> [f64; 3] + use<'a> {
        let angle = random.within(0.0, TAU);
        let [rx, ry] = ground.room_m;
        // What of the room an amplitude takes, along the direction of the motion.
        let reach = (rx * angle.cos().abs()).min(rx).hypot((ry * angle.sin().abs()).min(ry));
        let size = reach * random.within(0.3, 0.9);
        let frequency = match self {
            Self::Sine => random.within(1.0, 5.0),
            Self::Tap => random.within(2.0, 5.0),
            Self::Spiral => random.within(1.0, 2.5),
            _ => random.within(0.8, 2.0),
        };
        let speed = if self == Self::Stroke { random.within(0.2, 0.5) } else { random.within(0.05, 0.25) };
        let waves: [[f64; 3]; 4] =
            std::array::from_fn(|n| [(1.0 + n as f64) * frequency, random.within(0.0, TAU), random.within(0.0, TAU)]);
        let tremor: [[f64; 2]; 3] = std::array::from_fn(|_| [random.within(8.0, 12.0), random.within(0.0, TAU)]);
        let trembles = random.sized(0.03e-3, 0.25e-3);
        let depth = ground.depth_m;
        let (along, across) = ([angle.cos(), angle.sin()], [-angle.sin(), angle.cos()]);
        move |t| {
            // Since the tool is down.
            let down = (t - PRESS_S).max(0.0);
            let press = smooth(t / PRESS_S) - smooth((t - duration + LIFT_S) / LIFT_S);
            // Ways along and across, and the depth as a share.
            let (a, b, deep) = match self {
                Self::Sine => {
                    let wave = (TAU * frequency * down).sin();
                    (size * wave, 0.0, press * (1.0 + 0.3 * (0.7 * TAU * frequency * down).sin()))
                }
                Self::Tap => (0.2 * size * (TAU * 0.5 * t).sin(), 0.0, (TAU * frequency * t).sin() - 0.1),
                Self::Spiral => {
                    let (r, turn) = (size * (down / 0.8).min(1.0), TAU * frequency * down);
                    (r * turn.cos(), r * turn.sin(), press)
                }
                Self::Scribble => {
                    let sum = |phase: usize| -> f64 {
                        let wave = |[f, p, q]: [f64; 3]| (TAU * f * down + if phase == 0 { p } else { q }).sin() / f;
                        waves.iter().map(|&w| wave(w)).sum::<f64>() * frequency
                    };
                    (0.5 * size * sum(0), 0.5 * size * sum(1), press)
                }
                Self::Stop => {
                    // Goes, stands, comes back.
                    let time = 2.0 * size / speed;
                    let there = (down / time).min(1.0) - ((down - time - 0.25) / time).clamp(0.0, 1.0);
                    (size * (2.0 * there - 1.0), 0.0, press)
                }
                Self::Stroke => {
                    // To and fro with a sudden turn; down while it moves.
                    let period = 4.0 * size / speed;
                    let phase = (t / period).fract();
                    (
                        size * (4.0 * (phase - 0.5).abs() - 1.0),
                        0.0,
                        smooth(t / 0.08) - smooth((t - duration + 0.1) / 0.1),
                    )
                }
            };
            let noise = |n: usize| trembles * (TAU * tremor[n][0] * t + tremor[n][1]).sin();
            let place = |n: usize| ground.centre_m[n] + a * along[n] + b * across[n];
            let clamped =
                |n: usize| place(n).clamp(ground.centre_m[n] - ground.room_m[n], ground.centre_m[n] + ground.room_m[n]);
            let (x, y) = (clamped(0), clamped(1));
            let above = 0.3 * depth * (1.0 - press.clamp(0.0, 1.0));
            let z = (ground.surface)([x, y]) + radius - depth * deep + if self == Self::Tap { 0.0 } else { above };
            [x + noise(0), y + noise(1), z + 0.5 * noise(2)]
        }
    }
}

/// From 0 to 1, without a kink.
pub fn smooth(part: f64) -> f64 {
    let part = part.clamp(0.0, 1.0);
    part * part * (3.0 - 2.0 * part)
}
