//! Tools with a shape that are used as such: capsules that turn, spheres that press deep, friction that breaks away.

use std::f64::consts::TAU;

use palpate::Error;
use palpate::devices::ToolPath;
use palpate::model::Turn;
use palpate::scene::{Scene, ToolSpec};

use super::cases;
use super::paths::{Ground, Motion, PRESS_S, smooth};
use super::random::Random;

/// How soon a capsule that is down turns in full (s).
const TURNS_IN_S: f64 = 0.2;

/// Gives the scene's tool a shape, friction and a way of its own that goes up to twice as deep as `ground` says.
pub fn use_shape(scene: &mut Scene, motion: Motion, mut ground: Ground, random: &mut Random) -> Result<(), Error> {
    ground.depth_m *= random.within(1.0, 2.0);
    let (device, contact) = (&mut scene.devices[0], &mut scene.contact);
    if random.chance(0.4) {
        contact.static_friction = Some(contact.friction.coefficient() * random.within(1.2, 2.0) + 0.1);
        contact.stribeck_m_s = random.one_of(&[0.0, 0.01]);
    }
    if random.chance(0.25) {
        let radius_m = ground.cell_m * random.within(0.5, 1.5);
        device.tool = ToolSpec::Sphere { radius_m };
        device.path = Some(cases::path(motion, &ground, radius_m, random)?);
        return Ok(());
    }
    let radius_m = ground.cell_m * random.within(0.3, 1.0);
    let length_m = ground.cell_m * random.within(1.0, 5.0);
    let axis = random.one_of(&[[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 0.0, 1.0], [1.0, 1.0, 0.0]]);
    device.tool = ToolSpec::Capsule { radius_m, length_m, axis };
    let about: [f64; 3] = random.one_of(&[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
    let (angle, frequency) = (random.within(0.0, 1.2), random.within(0.3, 1.5));
    let turn = |t: f64| {
        let down = t - PRESS_S;
        let (sine, cosine) = (0.5 * angle * smooth(down / TURNS_IN_S) * (TAU * frequency * down).sin()).sin_cos();
        [cosine, sine * about[0], sine * about[1], sine * about[2]]
    };
    let path = cases::path(motion, &ground, radius_m, random)?;
    let turns: Vec<[f64; 4]> = path.times_s().iter().map(|&t| turn(t)).collect();
    let path = path.turned(&turns)?;
    // The lower end is as high as a sphere would be.
    let half_axis = device.tool.shape().half_axis();
    let lifted =
        |(position, turn): (&[f64; 3], &Turn)| [position[0], position[1], position[2] + (turn * half_axis).z.abs()];
    let positions = path.positions_m().iter().zip(path.orientations()).map(lifted).collect();
    device.path = Some(ToolPath::new(path.times_s().to_vec(), positions)?.turned(&turns)?);
    Ok(())
}
