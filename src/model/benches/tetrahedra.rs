//! The kernel of tetrahedra and a plain loop, side by side: nanoseconds per element of a whole step, forces and integration.
//!
//! Contestants take turns; each figure is the least of many rounds. `cargo bench --bench tetrahedra --features parallel`

mod common;
mod cubes;

use std::hint::black_box;
use std::time::Instant;

use palpate_model::body::{Body, InstructionSet, State, Tetrahedra, Tissue};
use palpate_model::contact::{Contact, Law, ToolMotion};
use palpate_model::simulation::{Simulation, Stepping};
use palpate_model::{Mat3, Vec3};

use common::{Contestant, deformed, least};
use cubes::cube;

const STEP: f64 = 1e-7;
const TISSUE: Tissue = Tissue::LIVER;

/// The same equations one element after the other, as the independent reference has them.
struct Plain {
    elements: Vec<([u32; 4], Mat3, f64)>,
    inverse_volumes: Vec<f64>,
    dilations: Vec<f64>,
    is_averaged: bool,
}

/// [x1 - x0, x2 - x0, x3 - x0].
#[inline(always)]
fn edges(vectors: &[Vec3], nodes: &[u32; 4]) -> Mat3 {
    let [a, b, c, d] = nodes.map(|node| vectors[node as usize]);
    Mat3::from_columns(&[b - a, c - a, d - a])
}

impl Plain {
    /// Elements in the order of their nodes, so that what is near is near in memory.
    fn new(body: &Tetrahedra, is_averaged: bool) -> Self {
        let mut volumes = vec![0.0; body.rest().len()];
        let element = |nodes: &[u32; 4]| {
            let edges = edges(body.rest(), nodes);
            let volume = edges.determinant() / 6.0;
            nodes.iter().for_each(|&node| volumes[node as usize] += volume);
            (*nodes, edges.try_inverse().expect("no flat element"), volume)
        };
        let elements = body.mesh().tetrahedra.iter().map(element).collect();
        let dilations = vec![0.0; volumes.len()];
        Self { elements, inverse_volumes: volumes.iter().map(|v| 1.0 / v).collect(), dilations, is_averaged }
    }

    fn forces(&mut self, state: &State, forces: &mut [Vec3]) {
        let mu = TISSUE.shear_modulus();
        let lambda = TISSUE.lame() + mu;
        forces.fill(Vec3::zeros());
        if self.is_averaged {
            self.dilations.fill(0.0);
            for (nodes, ..) in &self.elements {
                let volume = edges(&state.positions, nodes).determinant() / 6.0;
                nodes.iter().for_each(|&node| self.dilations[node as usize] += volume);
            }
            self.dilations.iter_mut().zip(&self.inverse_volumes).for_each(|(d, inverse)| *d = *d * inverse - 1.0);
        }
        for (nodes, inverse, volume) in &self.elements {
            let f = edges(&state.positions, nodes) * inverse;
            let rate = edges(&state.velocities, nodes) * inverse;
            let column = |n: usize| f.column(n).into_owned();
            let (a, b, c) = (column(0), column(1), column(2));
            let cofactor = Mat3::from_columns(&[b.cross(&c), c.cross(&a), a.cross(&b)]);
            let dilation = match self.is_averaged {
                true => nodes.iter().map(|&node| self.dilations[node as usize]).sum::<f64>() * 0.25,
                false => a.dot(&b.cross(&c)) - 1.0,
            };
            let mixed = f.transpose() * rate;
            let viscous = f * ((mixed + mixed.transpose()) * TISSUE.viscosity);
            let stress = f * mu + cofactor * (lambda * dilation - mu) + viscous;
            let of_edges = stress * inverse.transpose() * -*volume;
            forces[nodes[0] as usize] -= of_edges.column_sum();
            (0..3).for_each(|n| forces[nodes[n + 1] as usize] += of_edges.column(n));
        }
    }
}

/// A whole step of symplectic Euler with `forces`.
fn step(body: &Tetrahedra, mut forces: impl FnMut(&State, &mut [Vec3]) + 'static) -> Box<dyn FnMut()> {
    let (mut state, inverse_masses) = (deformed(body.rest()), body.inverse_masses().to_vec());
    let mut out = vec![Vec3::zeros(); inverse_masses.len()];
    Box::new(move || {
        forces(black_box(&state), &mut out);
        for ((v, force), w) in state.velocities.iter_mut().zip(&out).zip(&inverse_masses) {
            *v += force * (STEP * w);
        }
        for (x, v) in state.positions.iter_mut().zip(&state.velocities) {
            *x += v * STEP;
        }
    })
}

fn own(mut body: Tetrahedra) -> Box<dyn FnMut()> {
    let whole = body.clone();
    step(&whole, move |state, forces| body.forces(state, forces))
}

fn per_element(elements: usize, is_averaged: bool) {
    let body = cube(elements, 0.08, is_averaged);
    let mut plain = Plain::new(&body, is_averaged);
    let state = deformed(body.rest());
    let mut expected = vec![Vec3::zeros(); body.rest().len()];
    plain.forces(&state, &mut expected);
    let scale = expected.iter().map(Vec3::norm).fold(0.0, f64::max);
    let mut contestants: Vec<Contestant> =
        vec![("plain loop".into(), step(&body, move |state, forces| plain.forces(state, forces)))];
    for set in InstructionSet::ALL.into_iter().filter(|set| set.is_available()) {
        let mut body = body.clone().with_instruction_set(set).expect("it is available");
        let mut forces = vec![Vec3::zeros(); expected.len()];
        body.forces(&state, &mut forces);
        let off = forces.iter().zip(&expected).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
        assert!(off < 1e-12 * scale, "{set:?}: {off:e} of {scale:e}");
        contestants.push((set.name().into(), own(body)));
    }
    let times = least(&mut contestants, 40, 3);
    let (count, kind) = (body.element_count(), if is_averaged { "nodal pressure" } else { "plain" });
    for ((name, _), time) in contestants.iter().zip(&times) {
        println!("| {count} | {kind} | {name} | {:.1} | {:.2} |", time * 1e9 / count as f64, time / times[0]);
    }
}

#[cfg(feature = "parallel")]
fn per_millisecond(elements: usize) {
    let there = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let body = cube(elements, 0.08, true);
    let threads: Vec<usize> = [1, 2, 4, 8].into_iter().filter(|&cores| cores <= there).collect();
    let of = |cores: &usize| (format!("{cores}"), own(body.clone().on_cores(*cores).expect("threads")));
    let mut contestants: Vec<Contestant> = threads.iter().map(of).collect();
    let times = least(&mut contestants, 200, 1);
    for ((cores, _), time) in contestants.iter().zip(&times) {
        let count = body.element_count();
        println!("| {count} | {cores} | {:.0} | {:.2} |", count as f64 * 1e-3 / time, times[0] / time);
    }
}

/// Ticks of `full` with a tool that rubs over the body, three substeps each: median and 99 of 100 (s).
fn full_tick(elements: usize) -> [f64; 2] {
    let body = cube(elements, 0.08, true);
    let state = State::at_rest(body.rest());
    let law = Law { friction: 0.5.into(), ..Law::default() };
    let stepping = Stepping { tick: 1e-3, substeps: 3 };
    let mut sim = Simulation::new(Box::new(body), state, Contact::default(), law, stepping).expect("it fits");
    let path = |k: usize| {
        let (pressed, angle) = ((k as f64 / 100.0).min(1.0), k as f64 * 0.01);
        Vec3::new(0.041 + 5e-3 * angle.cos(), 0.0402 + 5e-3 * angle.sin(), 0.081 - 0.004 * pressed)
    };
    let mut times = Vec::new();
    for k in 0..3000 {
        let start = Instant::now();
        black_box(sim.tick(ToolMotion::straight(path(k), path(k + 1))));
        times.push(start.elapsed().as_secs_f64());
    }
    assert!(sim.contact(0).is_touching(), "the ticks measured have a contact in them");
    let mut times = times.split_off(200);
    times.sort_by(f64::total_cmp);
    [times[times.len() / 2], times[times.len() * 99 / 100]]
}

fn main() {
    println!("instruction set of this machine: {}\n", InstructionSet::detect().name());
    println!("| elements | pressure | step by | ns per element | of the loop |\n| ---: | --- | --- | ---: | ---: |");
    for elements in [4_000, 20_000] {
        per_element(elements, false);
        per_element(elements, true);
    }
    #[cfg(feature = "parallel")]
    {
        println!("\n| elements | threads | elements per ms | ratio |\n| ---: | ---: | ---: | ---: |");
        [4_000, 12_000, 40_000].into_iter().for_each(per_millisecond);
    }
    let [p50, p99] = full_tick(12_000);
    println!(
        "\ntick of `full`, 12,000 elements, nodal pressure, 3 substeps: p50 {:.0} us, p99 {:.0} us",
        p50 * 1e6,
        p99 * 1e6
    );
}
