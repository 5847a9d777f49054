//! The sweep of `examples/safety_figures` in short: where a sampled wall must rest, it rests, and far above it swings.
#![allow(dead_code)]

#[path = "support/repository.rs"]
mod repository;
#[path = "../examples/safety_figures/z_width.rs"]
mod z_width;

use palpate::model::local::Kind as LocalModelKind;

use z_width::{LIMIT_CYCLE_M, Sweep, Wall, theory};

const DAMPING: f64 = 0.1;

/// The tool's swing on walls of so many times the stiffness that theory allows at this rate.
fn swings(model: LocalModelKind, rate_hz: f64, shares: [f64; 2]) -> [f64; 2] {
    let sweep = Sweep::new().unwrap();
    let passive = theory(sweep.device_damping(), rate_hz, DAMPING, 0.0);
    shares.map(|share| {
        let wall = Wall { stiffness: share * passive, damping: DAMPING };
        let swing = sweep.swing(model, rate_hz, wall).unwrap();
        println!("{} at {rate_hz} Hz, {:.0} N/m: {:.0} um", model.name(), wall.stiffness, swing * 1e6);
        swing
    })
}

#[test]
fn below_the_border_the_tool_rests_and_above_it_swings() {
    for model in [LocalModelKind::Patch, LocalModelKind::Full] {
        for rate_hz in [500.0, 1000.0] {
            let [below, above] = swings(model, rate_hz, [0.25, 4.0]);
            assert!(below <= LIMIT_CYCLE_M && above > 10.0 * LIMIT_CYCLE_M, "{model:?}: {below} m, {above} m");
        }
    }
}

#[test]
fn a_faster_local_loop_holds_what_a_slower_one_cannot_and_hold_cannot_at_any_rate() {
    // 1200 N/m: twice the border at 1 kHz, half of that at 4 kHz.
    let [slow, _] = swings(LocalModelKind::Patch, 1000.0, [2.0, 0.5]);
    let [fast, _] = swings(LocalModelKind::Patch, 4000.0, [0.5, 0.25]);
    assert!(slow > LIMIT_CYCLE_M && fast <= LIMIT_CYCLE_M, "{slow} m, {fast} m");
    for rate_hz in [1000.0, 4000.0] {
        let [held, _] = swings(LocalModelKind::Hold, rate_hz, [0.125, 0.1]);
        assert!(held > 10.0 * LIMIT_CYCLE_M, "{held} m at {rate_hz} Hz");
    }
}
