//! Embeds the runtime: a soft block, a tool path of the program's own, real time, a log and a report at the end.
//!
//! `cargo run --release --example minimal`, then `cargo run --release -- timing minimal.mcap`.

use std::time::Duration;

use palpate::prelude::*;

fn main() -> Result<(), Error> {
    let body = Block::builder([12; 3], [0.1; 3]) // nodes per axis, size in metres
        .stiffness(30.0) // N/m, every spring
        .damping_ratio(0.3)
        .node_mass(0.5e-3) // kg
        .fix(Face::ZMin)
        .build()?;
    // Press a sphere of 8 mm 9 mm into the top, drag it 3 cm along x, lift. Seconds and metres, of its centre.
    let (over, pressed) = ([0.03, 0.05, 0.113], [0.03, 0.05, 0.099]);
    let (dragged, lifted) = ([0.06, 0.05, 0.099], [0.06, 0.05, 0.113]);
    let path = ToolPath::new(vec![0.0, 0.6, 1.8, 2.2], vec![over, pressed, dragged, lifted])?;
    let session = Session::builder(body)
        .path(path) // or .device(...): anything that implements `Device`
        .tool(ToolShape::Sphere { radius: 0.008 })
        .local(RateGroup::hz(1000).pin(1).realtime(80))
        .friction(0.5)
        .log("minimal.mcap")
        .build()?; // refuses what cannot work, and says why
    let running = session.start()?; // threads are up
    running.wait_for(Duration::from_millis(2500));
    println!("{}", running.stop()); // lateness, slips, jumps, what the system granted
    Ok(())
}
