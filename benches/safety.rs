//! The safety pipeline: time of one tick, every stage on. `cargo bench --bench safety`

use std::hint::black_box;
use std::time::Instant;

use palpate::safety::{DeviceLimits, Input, Limits, Pipeline, Request};

/// Ticks between two looks at the clock, which costs as much as half a tick.
const BATCH: u32 = 64;
const BATCHES: usize = 20_000;

/// Nanoseconds per tick, sorted.
fn measure(mut input: impl FnMut(u32) -> Input) -> (Vec<f64>, u64) {
    let mut pipeline = Pipeline::new(Limits::new(&DeviceLimits::of_force(3.3)));
    let (mut times, mut limited, mut n) = (Vec::with_capacity(BATCHES), 0, 0_u32);
    for _ in 0..BATCHES {
        let inputs: Vec<Input> = (n..n + BATCH).map(&mut input).collect();
        n += BATCH;
        let begun = Instant::now();
        for input in &inputs {
            let output = black_box(pipeline.apply(black_box(input)));
            limited += u64::from(output.actions.0 != 0);
        }
        times.push(begun.elapsed().as_secs_f64() * 1e9 / f64::from(BATCH));
    }
    times.sort_by(f64::total_cmp);
    (times, limited)
}

/// A name, and the input of each tick.
type Case = (&'static str, Box<dyn FnMut(u32) -> Input>);

fn main() {
    // Both after the start-up: 2 s and more are over in the first hundredth of the batches.
    let pressing = |n: u32| {
        let depth = -0.002 * (f64::from(n) * 0.006).sin().abs();
        (depth, Input::new(Request::Force([0.0, 0.0, -100.0 * depth]), [0.0, 0.0, depth], 1e-3))
    };
    let cases: [Case; 3] = [
        ("passive contact", Box::new(move |n| pressing(n).1)),
        ("energy deficit", {
            // Pushes along the motion: damped and withdrawn in every tick.
            Box::new(move |n| {
                let x = 0.01 * (f64::from(n) * 0.01).sin();
                let force = 0.5 * (f64::from(n) * 0.01).cos().signum();
                Input::new(Request::Force([force, 0.1, 0.0]), [x, 0.0, 0.0], 1e-3)
            })
        }),
        ("everything acts", {
            Box::new(move |n| Input {
                model_age_ticks: 150,
                stale_ticks: n % 5,
                swap_step: [0.3, 0.1, 0.0],
                ..Input::new(Request::Force([9.0, f64::from(n % 7), -9.0]), [0.0015 * f64::from(n % 2), 0.0, 0.0], 1e-3)
            })
        }),
    ];
    println!("| input | p50 (ns) | p99 (ns) | ticks limited |\n| --- | ---: | ---: | ---: |");
    for (name, input) in cases {
        let (times, limited) = measure(input);
        let at = |share: f64| times[((times.len() - 1) as f64 * share) as usize];
        let share = 100.0 * limited as f64 / (BATCHES as f64 * f64::from(BATCH));
        println!("| {name} | {:.0} | {:.0} | {share:.0} % |", at(0.5), at(0.99));
    }
}
