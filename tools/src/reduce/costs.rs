//! What model reduction costs: the bench `reduction`.

use std::time::{Duration, Instant};

use super::{PaperStudy, reduce_paper};
use crate::reduction::{Balanced, Modal, PaperMesh, low_rank, one_shift};

/// Frequencies that the low-rank path matches.
const SHIFTS: usize = 16;

/// Measures what reductions cost on one core and prints it, with `--json` among the arguments of the process as one line; `--cells N`
/// takes another mesh for the balancing.
pub fn reduction_costs() {
    let args: Vec<String> = std::env::args().collect();
    let after = |flag: &str| args.iter().position(|arg| arg == flag).and_then(|at| args.get(at + 1));
    let cells = after("--cells").and_then(|n| n.parse().ok()).unwrap_or(20);
    let mesh = PaperMesh::square(cells);
    let (dense_s, dense_pct) = best(3, || {
        let modal = Modal::new(&mesh.system().expect("a mesh")).expect("modes");
        Balanced::modal(&modal).expect("damped").tail_pct(20)
    });
    let (low_rank_s, low_rank_pct) =
        best(7, || low_rank(&mesh.system().expect("a mesh"), SHIFTS).expect("held").balanced.tail_pct(20));
    let order = mesh.system().expect("a mesh").order();
    if args.iter().any(|arg| arg == "--json") {
        println!(
            "{{\"order\": {order}, \"dense_s\": {}, \"dense_pct\": {dense_pct}, \"low_rank_s\": {}, \"low_rank_pct\": {low_rank_pct}}}",
            dense_s.as_secs_f64(),
            low_rank_s.as_secs_f64()
        );
        return;
    }
    println!("{cells} x {cells} cells, {order} states, to 20; assembly included, best of several");
    println!("  dense Gramians, modal   {dense_s:10.3?}  error {dense_pct:.6} %");
    println!("  rational Krylov first   {low_rank_s:10.3?}  error {low_rank_pct:.6} %");
    let system = PaperMesh::square(12).system().expect("a mesh");
    let shift = 0.5 * system.typical_frequency();
    let (one, order) = best(50, || one_shift(&system, shift, 5).expect("held").model.order());
    println!("12 x 12 cells, one shift, 5 moments, {order} states: {one:.3?}");
    let (tables, _) = best(2, || reduce_paper(&[PaperStudy::Table1, PaperStudy::Table2], |_| {}).expect("the paper's"));
    println!("all of Tables 1 and 2: {tables:.3?}");
}

/// The shortest of `rounds` runs, and what it gave.
fn best<T>(rounds: usize, mut run: impl FnMut() -> T) -> (Duration, T) {
    let mut shortest = None::<(Duration, T)>;
    for _ in 0..rounds {
        let started = Instant::now();
        let out = run();
        let took = started.elapsed();
        if shortest.as_ref().is_none_or(|(least, _)| took < *least) {
            shortest = Some((took, out));
        }
    }
    shortest.expect("at least one round")
}
