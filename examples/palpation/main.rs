//! Finds a stiff nodule under soft tissue by touch: presses a grid of points of the top and maps how stiff each feels.
//!
//! The whole search is one run in virtual time: a scripted tool presses one point after the other, the local model resolves the
//! contact, and all that the program looks at is what a device would feel, the force of every tick.
//!
//! Look for: the stiffest points of the map, the place that follows from them, and how far that is from where the nodule was
//! put. The map is also drawn to `out/palpation/map.svg`.
//!
//! `cargo run --release --example palpation`

mod map;

use map::Map;
use palpate::log::LogRecord;
use palpate::model::body::{Region, Shape};
use palpate::model::local::Kind as LocalModelKind;
use palpate::prelude::*;

/// The block: 12 nodes along each edge (m).
const EDGE_M: f64 = 0.1;
const SPACING_M: f64 = EDGE_M / 11.0;
/// The nodule that the search knows nothing of (m).
const NODULE_M: [f64; 3] = [0.036, 0.058, 0.0773];
const RADIUS_M: f64 = 0.0175;
/// Points along an edge of the grid.
const POINTS: usize = 7;
/// How deep each is pressed, and from what height (m).
const DEPTH_M: f64 = 0.005;
const HEIGHT_M: f64 = 0.001;
/// What one point takes: to move there, to press, to hold, to lift (s).
const PHASES_S: [f64; 4] = [0.06, 0.08, 0.1, 0.06];
/// The last part of the hold, over which the force is averaged (s).
const FELT_S: f64 = 0.04;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let nodule = Region::new(Shape::Sphere { centre: NODULE_M, radius: RADIUS_M }).stiffness(300.0);
    let body = Block::builder([12; 3], [EDGE_M; 3]).stiffness(30.0).region(nodule).fix(Face::ZMin).build()?;
    let points = points();
    let (path, felt) = search(&points)?;
    let session = Session::builder(body)
        .duration_s(path.duration_s())
        .path(path)
        .model(LocalModelKind::LinearBoundary)
        .crossfade_ms(10.0)
        .friction(0.3)
        .virtual_time()
        .keep_records()
        .build()?;
    let summary = session.run()?;

    let mut map = Map::new(points);
    for record in &summary.records {
        let LogRecord::Force(sample) = record else { continue };
        let time_s = sample.time.as_secs_f64();
        // Whose hold it is in, if any.
        let point = felt.iter().position(|&(from, to)| time_s > from && time_s <= to);
        if let Some(point) = point {
            map.add(point, sample.force_n[2] / DEPTH_M);
        }
    }
    println!("apparent stiffness (N/m), seen from above: x to the right, y upwards\n\n{map}");
    let (found, truth) = (map.nodule(), [NODULE_M[0], NODULE_M[1]]);
    let off_m = (found[0] - truth[0]).hypot(found[1] - truth[1]);
    let mm = |at: [f64; 2]| format!("x {:.1} mm, y {:.1} mm", at[0] * 1e3, at[1] * 1e3);
    println!("the nodule is at  {}", mm(found));
    println!("it was put at     {}; off by {:.1} mm, its radius is {:.1} mm", mm(truth), off_m * 1e3, RADIUS_M * 1e3);
    std::fs::create_dir_all("out/palpation")?;
    std::fs::write("out/palpation/map.svg", map.svg(EDGE_M, found, (truth, RADIUS_M)))?;
    println!("map: out/palpation/map.svg");
    if off_m > SPACING_M {
        return Err(format!("the nodule was missed by {:.1} mm, more than a distance of nodes", off_m * 1e3).into());
    }
    Ok(())
}

/// The grid, row by row and every other row backwards (m). Each point has the same place in its cell of the mesh, since the
/// middle of a triangle gives way less than a corner.
fn points() -> Vec<[f64; 2]> {
    let at = |cell: usize| (cell as f64 + 2.6) * SPACING_M;
    let row =
        |y: usize| (0..POINTS).map(move |x| if y.is_multiple_of(2) { x } else { POINTS - 1 - x }).map(move |x| (x, y));
    (0..POINTS).flat_map(row).map(|(x, y)| [at(x), at(y) - 0.3 * SPACING_M]).collect()
}

/// The tool's path over `points`, and for each of them the time in which it is felt (s).
fn search(points: &[[f64; 2]]) -> Result<(ToolPath, Vec<(f64, f64)>), Error> {
    let (above, below) = (EDGE_M + HEIGHT_M, EDGE_M - DEPTH_M);
    let (mut times, mut places) = (vec![0.0], vec![[points[0][0], points[0][1], above]]);
    let (mut now, mut felt) = (0.0, Vec::new());
    for &[x, y] in points {
        for (phase, z) in PHASES_S.iter().zip([above, below, below, above]) {
            now += phase;
            times.push(now);
            places.push([x, y, z]);
        }
        let held_until = now - PHASES_S[3];
        felt.push((held_until - FELT_S, held_until));
    }
    Ok((ToolPath::new(times, places)?, felt))
}
