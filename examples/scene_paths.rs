//! Writes `scenes/paths/*.csv`, the tool paths of the scenes, from their formulas.
//!
//! Run it after changing a formula: `cargo run --example scene_paths`. A test compares the committed files with it.

use std::f64::consts::PI;
use std::fmt::Write as _;
use std::path::Path;

/// Distance of neighbouring nodes in every scene: 12 nodes over 0.1 m (m).
const SPACING_M: f64 = 0.1 / 11.0;

/// The position (m) at a time (s).
type Formula = fn(f64) -> [f64; 3];

/// Name, length (s) and formula of every path file.
const PATHS: [(&str, f64, Formula); 18] = [
    ("bend.csv", 2.0, bend),
    ("demo.csv", 5.0, demo),
    ("drag.csv", 2.5, drag),
    ("finger.csv", 5.0, finger),
    ("forceps_left.csv", 3.2, forceps_left),
    ("forceps_right.csv", 3.2, forceps_right),
    ("hand.csv", 0.8, hand),
    ("hand_release.csv", 0.4, hand_release),
    ("hold_right.csv", 2.5, hold_right),
    ("hover.csv", 0.0, hover),
    ("liver.csv", 4.2, liver),
    ("liver_slide.csv", 3.0, liver_slide),
    ("palpate.csv", 2.3, palpate),
    ("press.csv", 0.4, press),
    ("pull_release.csv", 1.0, pull_release),
    ("slide.csv", 2.7, slide),
    ("stick_slip.csv", 3.6, stick_slip),
    ("torso.csv", 60.0, torso),
];

/// The minimum-jerk step from 0 to 1: how a hand moves from one point to another.
fn min_jerk(u: f64) -> f64 {
    let u = u.clamp(0.0, 1.0);
    u * u * u * (10.0 + u * (6.0 * u - 15.0))
}

/// The middle of the cantilever's tip, 15 mm down and back, as far back along x as the bent beam is shorter.
fn bend(t: f64) -> [f64; 3] {
    const LENGTH_M: f64 = 0.1;
    let down = 0.015 * (min_jerk((t - 0.2) / 0.6) - min_jerk((t - 1.2) / 0.6));
    [LENGTH_M - 0.6 * down * down / LENGTH_M, 0.01, 0.01 - down]
}

/// A sphere of 8 mm on a block of 0.4 m: circles of 3 cm around its middle, one in five seconds, 12 mm deep after the first. To the
/// micrometre.
fn torso(t: f64) -> [f64; 3] {
    const TOOL_M: f64 = 0.008;
    let (y, x) = (0.4 * PI * t).sin_cos();
    let depth = -0.003 + 0.0075 * (1.0 - (PI * t.min(1.0)).cos());
    [0.2 + 0.03 * x, 0.2 + 0.03 * y, 0.4 + TOOL_M - depth].map(|coordinate| (coordinate * 1e6).round() / 1e6)
}

/// The top of the right lobe of the liver in `scenes/meshes` (m): that of its ellipsoid, half a millimetre above the mesh.
fn dome(x: f64) -> f64 {
    0.008 + 0.032 * (1.0 - ((x + 0.030) / 0.040).powi(2)).sqrt()
}

/// Press 6 mm into the liver, drag 24 mm over its dome, lift, tap twice.
fn liver(t: f64) -> [f64; 3] {
    let tap = |start_s: f64| 0.008 * (PI * ((t - start_s) / 0.3).clamp(0.0, 1.0)).sin().powi(2);
    let x = -0.042 + 0.024 * min_jerk((t - 1.0) / 1.2);
    let depth = -0.003 + 0.009 * (min_jerk((t - 0.2) / 0.4) - min_jerk((t - 2.4) / 0.3)) + tap(3.2) + tap(3.7);
    [x, 0.0031, dome(x) - depth]
}

/// Press 5 mm into the liver, slide 44 mm over its dome at that depth, lift.
fn liver_slide(t: f64) -> [f64; 3] {
    let x = -0.052 + 0.044 * min_jerk((t - 0.6) / 1.8);
    let depth = -0.003 + 0.008 * (min_jerk((t - 0.1) / 0.4) - min_jerk((t - 2.6) / 0.3));
    [x, -0.0037, dome(x) - depth]
}

/// A sphere of 8 mm: press 5 mm beside the tumour, 5 mm over it, slide 44 mm over all at that depth, lift. Along the dome's normal.
fn finger(t: f64) -> [f64; 3] {
    const TOOL_M: f64 = 0.008;
    let x = -0.010 - 0.020 * min_jerk((t - 1.0) / 0.4) - 0.022 * min_jerk((t - 2.4) / 0.4)
        + 0.044 * min_jerk((t - 3.1) / 1.4);
    let press = |from: f64, to: f64| min_jerk((t - from) / 0.3) - min_jerk((t - to) / 0.3);
    let depth = -0.003 + 0.008 * (press(0.2, 0.7) + press(1.5, 2.1) + press(2.8, 4.5));
    let slope = -0.8 * (x + 0.030) / (0.040_f64.powi(2) - (x + 0.030).powi(2)).sqrt();
    let out = (TOOL_M - depth) / slope.hypot(1.0);
    [x - slope * out, -0.004, dome(x) + out]
}

/// The left jaw of a pair of forceps, a sphere of 6 mm: close on the fold from beside it, lift, open, leave.
fn forceps_left(t: f64) -> [f64; 3] {
    let closed = min_jerk((t - 0.1) / 0.7) - min_jerk((t - 2.3) / 0.5);
    let lifted = min_jerk((t - 0.9) / 0.7) - min_jerk((t - 1.8) / 0.4);
    [-0.008 + 0.013 * closed, 0.0276, 0.0452 + 0.008 * lifted]
}

/// The right jaw, in the mirror.
fn forceps_right(t: f64) -> [f64; 3] {
    let [x, y, z] = forceps_left(t);
    [0.03 - x, y, z]
}

/// A sphere of 8 mm: press 5 mm deep, drag 24 mm along x at 1 cm/s, lift.
fn stick_slip(t: f64) -> [f64; 3] {
    let x = 0.037 + 0.01 * (t - 0.6).clamp(0.0, 2.4);
    let z = 0.109 - 0.006 * min_jerk((t - 0.1) / 0.3) + 0.008 * min_jerk((t - 3.2) / 0.3);
    [x, 0.0512, z]
}

/// A sphere of 8 mm: a press of 7 mm, a drag, a circle, a lift and two taps.
fn demo(t: f64) -> [f64; 3] {
    const TOOL_M: f64 = 0.008;
    const RADIUS_M: f64 = 0.012;
    let angle = 2.0 * PI * min_jerk((t - 2.0) / 1.4);
    let tap = |start_s: f64| 0.011 * (PI * ((t - start_s) / 0.4).clamp(0.0, 1.0)).sin().powi(2);
    let x = 0.03 + 0.035 * min_jerk((t - 1.0) / 1.0) - RADIUS_M * (1.0 - angle.cos());
    let y = 0.0512 + RADIUS_M * angle.sin();
    let z =
        0.105 + TOOL_M - 0.012 * min_jerk((t - 0.2) / 0.6) + 0.012 * min_jerk((t - 3.4) / 0.4) - tap(4.0) - tap(4.5);
    [x, y, z]
}

/// Press 8 mm deep, drag 25 mm along x, lift: the reference's drag.
fn drag(t: f64) -> [f64; 3] {
    let x = 0.025 + 0.025 * min_jerk((t - 0.5) / 1.5);
    let z = 0.101 - 0.009 * min_jerk(t / 0.3) + 0.011 * min_jerk((t - 2.2) / 0.3);
    [x, 0.0512, z]
}

/// Node [5, 5, 11] in a hand that trembles at 2, 3 and 5 Hz.
fn hand(t: f64) -> [f64; 3] {
    let wave = |hz: f64| (2.0 * PI * hz * t).sin();
    let grown = min_jerk(t / 0.2);
    let x = 5.0 * SPACING_M + grown * 0.004 * wave(3.0);
    let z = 0.1 + grown * (-0.008 * wave(2.0) - 0.004 * wave(5.0));
    [x, 5.0 * SPACING_M, z]
}

/// Where the hand of the reference wants to be: from 1 mm below the surface to 11 mm.
fn hand_release(t: f64) -> [f64; 3] {
    [0.0475, 0.0512, 0.099 - 0.010 * min_jerk(t / 0.4)]
}

/// Press 8 mm deep on the right, hold, lift.
fn hold_right(t: f64) -> [f64; 3] {
    let z = 0.101 - 0.009 * min_jerk((t - 0.4) / 0.4) + 0.011 * min_jerk((t - 2.0) / 0.4);
    [0.0712, 0.0471, z]
}

/// 1 cm above node [8, 5, 11], motionless.
fn hover(_: f64) -> [f64; 3] {
    [8.0 * SPACING_M, 5.0 * SPACING_M, 0.11]
}

/// Press 6 mm deep, then five times 3 mm deeper while 2 cm along x, lift: fingers that feel for what is below.
fn palpate(t: f64) -> [f64; 3] {
    let deeper = 0.003 * (3.0 * PI * (t - 0.3)).sin().powi(2);
    let is_pressing = (0.3..0.3 + 5.0 / 3.0).contains(&t);
    let x = 0.035 + 0.02 * min_jerk((t - 0.3) / 1.6);
    let z = 0.101 - 0.007 * min_jerk(t / 0.3) + 0.009 * min_jerk((t - 2.0) / 0.3);
    [x, 0.0512, if is_pressing { z - deeper } else { z }]
}

/// From 1 mm above node [3, 3, 5] of a block of 6 x 6 x 6 nodes to 10 mm below, where a hand wants to be that presses.
fn press(t: f64) -> [f64; 3] {
    [0.0603, 0.0602, 0.101 - 0.011 * min_jerk(t / 0.4)]
}

/// Node [5, 5, 11] pulled up 2 cm and let back.
fn pull_release(t: f64) -> [f64; 3] {
    let z = 0.1 + 0.02 * min_jerk(t / 0.4) * (1.0 - min_jerk((t - 0.6) / 0.4));
    [5.0 * SPACING_M, 5.0 * SPACING_M, z]
}

/// Press 6 mm deep, slide 6 cm along x, lift.
fn slide(t: f64) -> [f64; 3] {
    let x = 0.02 + 0.06 * min_jerk((t - 0.4) / 1.8);
    let z = 0.101 - 0.007 * min_jerk(t / 0.3) + 0.009 * min_jerk((t - 2.3) / 0.3);
    [x, 0.0512, z]
}

/// File names and contents of all paths: a row per millisecond, without the rows inside a stretch of rest.
pub fn files() -> Vec<(&'static str, String)> {
    PATHS.iter().map(|&(name, length_s, position)| (name, csv(length_s, position))).collect()
}

fn csv(length_s: f64, position: Formula) -> String {
    // A path of a minute is a slow one.
    let rows_per_s = if length_s > 10.0 { 25.0 } else { 1000.0 };
    let time_s = |row: usize| row as f64 / rows_per_s;
    let last = (length_s * rows_per_s).round() as usize;
    let rows: Vec<[f64; 3]> = (0..=last).map(|row| position(time_s(row))).collect();
    let mut text = String::from("t_s,x_m,y_m,z_m\n");
    for (row, position @ [x, y, z]) in rows.iter().enumerate() {
        let rests = row > 0 && row < last && rows[row - 1] == *position && rows[row + 1] == *position;
        if !rests {
            writeln!(text, "{},{x},{y},{z}", time_s(row)).expect("a String takes every text");
        }
    }
    text
}

fn main() -> std::io::Result<()> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/paths");
    for (name, text) in files() {
        let path = folder.join(name);
        // The demo's path is compiled into the program: a file that is the same is left alone, or all of it is built anew.
        if std::fs::read_to_string(&path).ok().as_ref() != Some(&text) {
            std::fs::write(&path, &text)?;
        }
        println!("scenes/paths/{name}: {} rows", text.lines().count() - 1);
    }
    Ok(())
}
