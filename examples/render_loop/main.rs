//! A program that draws: a thread of its own reads the newest surface, tool and force at 60 Hz, and the tick never waits
//! for it.
//!
//! The liver scene runs in real time twice, alone and with a renderer that turns every frame into a shaded picture (SVG)
//! and writes a few of them to `out/render_loop/`. Reading through the `Viewer` is wait-free on both sides: there is no
//! lock that a slow frame could hold.
//!
//! Look for: the same median lateness of the haptic group in both rows, and the pictures. What else the machine does shows
//! up in either row: a p99 is worth comparing on a quiet machine only.
//!
//! `cargo run --release --example render_loop`

mod camera;
mod picture;
mod shading;

use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::{Duration, Instant};

use palpate::log::GroupSummary;
use palpate::prelude::*;
use palpate::scene::Scene;
use palpate::session::{Summary, Viewer};

/// Frames per second.
const FRAME_RATE: u32 = 60;
/// Length of each of the two runs (s).
const DURATION_S: f64 = 2.6;
/// Frames that are written to files: the first at or after each of these times.
const KEPT: [Nanos; 4] = [Nanos(700_000_000), Nanos(1_300_000_000), Nanos(1_700_000_000), Nanos(2_400_000_000)];

/// What the renderer did.
#[derive(Default)]
struct Frames {
    drawn: u32,
    /// Time spent in drawing.
    busy: Duration,
    files: Vec<PathBuf>,
}

fn main() -> Result<(), Box<dyn Error>> {
    let scene = Scene::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/liver.toml"))?;
    let folder = Path::new("out/render_loop");
    fs::create_dir_all(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    let session = || Session::from_scene(scene.clone()).duration_s(DURATION_S).build();

    eprintln!("{DURATION_S} s without a renderer ...");
    let alone = session()?.run()?;

    eprintln!("{DURATION_S} s with one at {FRAME_RATE} Hz ...");
    let mut running = session()?.start()?;
    let viewer = running.take_viewer().ok_or("the viewer is already taken")?;
    let (stop, stopped) = channel();
    let renderer = std::thread::spawn(move || render(viewer, &stopped, folder));
    running.wait();
    drop(stop);
    let drawn = running.stop();
    let frames = renderer.join().map_err(|_| "the renderer panicked")??;

    println!("Lateness of the haptic group (1 kHz):");
    println!("{:<18}{:>12}{:>12}{:>12}{:>10}{:>10}", "", "p50", "p99", "max", "skipped", "missed");
    for (name, summary) in [("alone", &alone), ("with a renderer", &drawn)] {
        let group = haptic(summary).ok_or("the report has no haptic group")?;
        let [p50, p99, max] = [group.lateness.p50, group.lateness.p99, group.lateness.max].map(microseconds);
        println!("{name:<18}{p50:>12}{p99:>12}{max:>12}{:>10}{:>10}", group.skipped.total(), group.missed.total());
    }
    let per_frame = frames.busy / frames.drawn.max(1);
    println!("\n{} frames drawn, {per_frame:.1?} each; some of them:", frames.drawn);
    for file in &frames.files {
        println!("  {}", file.display());
    }
    Ok(())
}

/// Draws at the frame rate until the other end of `stopped` is dropped.
fn render(mut viewer: Viewer, stopped: &Receiver<()>, folder: &Path) -> Result<Frames, std::io::Error> {
    let (triangles, rest) = (viewer.triangles(), viewer.surface().positions.clone());
    let mut kept = KEPT.into_iter().peekable();
    let mut frames = Frames::default();
    let start = Instant::now();
    loop {
        // The n-th frame is due at n periods: a late one does not delay those after it.
        let due = start + Duration::from_secs(1) * frames.drawn / FRAME_RATE;
        match stopped.recv_timeout(due.saturating_duration_since(Instant::now())) {
            Err(RecvTimeoutError::Timeout) => {}
            Ok(()) | Err(RecvTimeoutError::Disconnected) => return Ok(frames),
        }
        let begun = Instant::now();
        let tool = viewer.tool();
        let svg = picture::draw(&triangles, &rest, &viewer.surface().positions, &tool);
        frames.busy += begun.elapsed();
        frames.drawn += 1;
        if let Some(time) = kept.next_if(|&time| tool.time >= time) {
            let file = folder.join(format!("frame_{:04}_ms.svg", time.0 / 1_000_000));
            fs::write(&file, svg)?;
            frames.files.push(file);
        }
    }
}

fn haptic(summary: &Summary) -> Option<&GroupSummary> {
    summary.report.groups.iter().find(|group| group.name == "local")
}

fn microseconds(ns: u64) -> String {
    format!("{:.2} us", ns as f64 / 1e3)
}
