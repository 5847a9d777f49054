//! What ticks, builds and bases cost, at the level of the models: no session around them.

use std::sync::Arc;
use std::time::Instant;

use palpate::model::Vec3;
use palpate::model::body::{Block, Body, State};
use palpate::model::contact::{Contact, Law, ToolMotion};
use palpate::model::integrator::Spectrum;
use palpate::model::local::ToolForecast;
use palpate::model::local::{Kind, LocalModel, ResyncView, Template};
use palpate::model::mesh::Face;
use palpate::model::simulation::{Simulation, Stepping};
use palpate::model::surroundings::{Bases, Basis, RestingBody};
use palpate::runtime::{Nanos, Stopwatch};
use palpate::{Error, ErrorKind};
use palpate_cli::drawing::{Picture, Series, Sign};

use crate::common::{colour, figure, table, us};

const GLOBAL_HZ: f64 = 30.0;
/// A model is built for its lateness, its service and catching up: as a session does with results one period late.
const PERIODS_AHEAD: f64 = 2.25;
/// Of `predictive`, and of the models whose patch is the paper's.
const PATCH: [usize; 3] = [6, 6, 3];
const SMALL_PATCH: [usize; 3] = [4, 4, 2];
const STATES: usize = Basis::DEFAULT_STATES;
/// A basis is left out if it is expected to take longer (s).
const LONGEST_BASIS_S: f64 = 120.0;
const ROUNDS: usize = 3;
/// Measured from here on, in the midst of the drag (s).
const BEGIN: f64 = 0.3;

/// A tool that presses for 0.15 s and drags at 2 cm/s.
fn tool(t: f64) -> Vec3 {
    let pressed = (t / 0.15).min(1.0);
    Vec3::new(0.04 + 0.02 * (t - 0.15).max(0.0), 0.0512, 0.1005 - 8e-3 * pressed)
}

fn block(nodes: usize) -> Result<Block, Error> {
    let builder = Block::builder([nodes; 3], [0.1; 3]).stiffness(30.0).node_mass(0.5e-3).damping_ratio(0.3);
    Ok(builder.fix(Face::ZMin).build()?)
}

/// What a basis takes (s); `None` if it was left out.
#[derive(Clone, Copy)]
pub struct BasisCost {
    pub nodes: usize,
    pub seconds: Option<f64>,
}

/// The surroundings of the patch that [`tool`] is on in the midst of its drag.
pub struct Surroundings {
    pub cost: BasisCost,
    bases: Bases,
    /// That of `predictive`.
    patch: Vec<u32>,
}

impl Surroundings {
    /// Reduces them, unless the cost of smaller bodies says that it would take too long.
    pub fn new(nodes: usize, smaller: &[BasisCost]) -> Result<Self, Error> {
        let (mut sim, _) = simulation(block(nodes)?, 1000.0)?;
        advance(&mut sim, 0.0, BEGIN);
        let touched = sim.contact(0).triangle.ok_or_else(no_contact)?;
        let mut patch = Vec::new();
        sim.body().patch(&[touched], PATCH, &mut patch);
        let resting = RestingBody::new(sim.body()).ok_or_else(no_contact)?;
        // A direct factorisation of a body in space grows with the sixth power of its edge.
        let last = smaller.last().and_then(|last| Some((last.nodes, last.seconds?)));
        let expected = match (last, smaller.is_empty()) {
            (_, true) => 0.0,
            (None, _) => f64::INFINITY,
            (Some((edge, seconds)), _) => seconds * (nodes as f64 / edge as f64).powi(6),
        };
        if expected > LONGEST_BASIS_S {
            eprintln!("{nodes}^3: a basis is expected to take {expected:.0} s, left out");
            return Ok(Self { cost: BasisCost { nodes, seconds: None }, bases: Bases::default(), patch });
        }
        let begun = Instant::now();
        let mut bases = Bases::default();
        if let Some(basis) = Basis::compute(&resting, &patch, STATES)? {
            bases.insert(Arc::new(basis));
        }
        let seconds = begun.elapsed().as_secs_f64();
        eprintln!("{nodes}^3: a basis takes {seconds:.2} s");
        Ok(Self { cost: BasisCost { nodes, seconds: Some(seconds) }, bases, patch })
    }
}

/// p50 and p99 of one kind of tick.
pub type Tick = [Nanos; 2];

/// What one size at one rate costs.
pub struct Costs {
    pub nodes: usize,
    pub springs: usize,
    pub rate: f64,
    pub substeps: u32,
    /// Ticks that one stable step could span.
    pub ticks_per_step: u32,
    pub full: Tick,
    pub patch: Tick,
    pub predictive: Tick,
    /// The next model of `predictive`, with a look ahead of the whole body.
    pub build: Nanos,
    /// True if it has reduced surroundings.
    pub has_basis: bool,
    pub build_patch: Nanos,
    /// Following the tool for one period of the global model.
    pub follow: Nanos,
}

impl Costs {
    pub fn period(&self) -> Nanos {
        Nanos((1e9 / self.rate) as u64)
    }

    /// Cores that the global group takes with a build of `build`.
    pub fn global_load(&self, build: Nanos) -> f64 {
        (self.follow.as_secs_f64() + build.as_secs_f64()) * GLOBAL_HZ
    }

    /// The same if the global model took the longest stable step in place of one at least per tick.
    pub fn global_load_with_long_steps(&self) -> f64 {
        let ticks = u64::from(self.ticks_per_step);
        (self.follow.as_secs_f64() + self.build.as_secs_f64()) / ticks as f64 * GLOBAL_HZ
    }
}

pub fn measure(nodes: usize, rate: f64, surroundings: &Surroundings) -> Result<Costs, Error> {
    let body = block(nodes)?;
    let springs = body.springs().len();
    let (mut sim, ticks_per_step) = simulation(body, rate)?;
    let tick = 1.0 / rate;
    advance(&mut sim, 0.0, BEGIN);
    let ticks_of_period = (rate / GLOBAL_HZ).ceil() as usize;
    // The simulation that everything else is built from stays where the drag begins; this one goes on.
    let mut dragged = sim.duplicate().ok_or_else(no_contact)?;
    let motion = |k: usize| ToolMotion::straight(tool(BEGIN + k as f64 * tick), tool(BEGIN + (k + 1) as f64 * tick));
    let full = least_of_rounds(|round| {
        let first = round * 2 * ticks_of_period;
        ticks(2 * ticks_of_period, |k| dragged.tick(motion(first + k)).force)
    });
    // Some 90 % of the ticks take no longer than 1.1 times the median; the mean would have the stalls of the machine in it.
    let follow = Nanos(full[0].0 * ticks_of_period as u64);
    let horizon = (PERIODS_AHEAD * rate / GLOBAL_HZ).ceil() as u32 + 1;
    let mut of = |kind: Kind, size: [usize; 3]| -> Result<(Nanos, Tick), Error> {
        let Surroundings { patch, bases, .. } = surroundings;
        let template = Template::new(kind, size, sim.body())?;
        let mut model = template.empty();
        let mut least = Nanos(u64::MAX);
        // The first build makes memory.
        for _ in 0..=ROUNDS {
            least = least.min(rebuild(&mut *model, &mut sim, horizon, patch, bases));
        }
        let half = horizon as usize / 2;
        let served = least_of_rounds(|_| {
            rebuild(&mut *model, &mut sim, horizon, patch, bases);
            ticks(half, |k| model.tick(&[motion(k)]).force)
        });
        Ok((least, served))
    };
    let (build_patch, patch) = of(Kind::Patch, SMALL_PATCH)?;
    let (build, predictive) = of(Kind::Predictive, PATCH)?;
    let substeps = sim.stepping().substeps;
    Ok(Costs {
        nodes,
        springs,
        rate,
        substeps,
        ticks_per_step,
        full,
        patch,
        predictive,
        build,
        has_basis: !surroundings.bases.is_empty(),
        build_patch,
        follow,
    })
}

/// The body at rest, stepped as the stability limit asks for, and the ticks that one stable step could span.
fn simulation(mut body: Block, rate: f64) -> Result<(Simulation, u32), Error> {
    let tick = 1.0 / rate;
    let spectrum = Spectrum::estimate(&mut body);
    let stepping = Stepping { tick, substeps: spectrum.substeps(tick) };
    // With the margin that substeps have.
    let span = (1..).take_while(|&ticks| spectrum.substeps(f64::from(ticks) * tick) == 1).last().unwrap_or(1);
    let state = State::at_rest(body.rest());
    let law = Law { friction: 1.0.into(), ..Law::default() };
    Ok((Simulation::new(Box::new(body), state, Contact::default(), law, stepping)?, span))
}

/// Along [`tool`] from `from` to `to` (s).
fn advance(sim: &mut Simulation, from: f64, to: f64) {
    let tick = sim.stepping().tick;
    for k in 0..((to - from) / tick).round() as usize {
        let t = from + k as f64 * tick;
        sim.tick(ToolMotion::straight(tool(t), tool(t + tick)));
    }
}

fn no_contact() -> Error {
    Error::new(ErrorKind::Fault, "the bench's own body does not touch its tool or cannot be copied")
}

fn rebuild(model: &mut dyn LocalModel, sim: &mut Simulation, horizon: u32, patch: &[u32], bases: &Bases) -> Nanos {
    let triangle = sim.contact(0).triangle.unwrap_or_default();
    let forecast = ToolForecast { position: tool(BEGIN), velocity: Vec3::x() * 0.02, ..ToolForecast::default() };
    let mut stopwatch = Stopwatch::new();
    let resync = ResyncView {
        global: sim,
        tick: 0,
        triangles: &[triangle],
        nearest: &[],
        patch: Some(patch),
        tools: &[forecast],
        index: 0,
        horizon,
        bases,
    };
    Stopwatch::around(Some(&mut stopwatch), || model.rebuild(resync));
    stopwatch.reader().snapshot().max()
}

/// CPU time of `count` ticks, p50 and p99.
fn ticks(count: usize, mut tick: impl FnMut(usize) -> Vec3) -> Tick {
    let mut stopwatch = Stopwatch::new();
    for k in 0..count {
        std::hint::black_box(Stopwatch::around(Some(&mut stopwatch), || tick(k)));
    }
    let snapshot = stopwatch.reader().snapshot();
    [0.5, 0.99].map(|q| snapshot.percentile(q))
}

fn least_of_rounds(mut round: impl FnMut(usize) -> Tick) -> Tick {
    (0..ROUNDS).map(&mut round).fold([Nanos(u64::MAX); 2], |a, b| [a[0].min(b[0]), a[1].min(b[1])])
}

/// The table of costs.
pub fn text(all: &[Costs], bases: &[BasisCost]) -> String {
    let pair = |tick: Tick| format!("{} / {}", figure(us(tick[0])), figure(us(tick[1])));
    let ms = |time: Nanos| figure(us(time) * 1e-3);
    let rows: Vec<Vec<String>> = all
        .iter()
        .map(|costs| {
            vec![
                format!("{}^3", costs.nodes),
                format!("{} kHz", costs.rate * 1e-3),
                costs.springs.to_string(),
                costs.substeps.to_string(),
                pair(costs.full),
                pair(costs.patch),
                pair(costs.predictive),
                ms(costs.follow),
                ms(costs.build_patch),
                ms(costs.build),
            ]
        })
        .collect();
    let heads = [
        "body",
        "rate",
        "springs",
        "substeps",
        "`full` tick us",
        "`patch` tick us",
        "`predictive` tick us",
        "follow ms",
        "build `patch` ms",
        "build `predictive` ms",
    ];
    let reduced: Vec<String> = bases
        .iter()
        .map(|basis| match basis.seconds {
            Some(seconds) => format!("{}^3 {} s", basis.nodes, figure(seconds)),
            None => format!("{}^3 left out (above {LONGEST_BASIS_S} s expected)", basis.nodes),
        })
        .collect();
    format!(
        "## Costs\n\n![CPU of a haptic tick against the size of the body](img/scale.svg)\n\nTicks with contact, p50 / p99, the least of {ROUNDS} rounds. \
         *Follow* is the global model along the tool's path for one period of 33.3 ms; the next model is built once in that \
         time, `predictive` by the whole body run {PERIODS_AHEAD} periods ahead. Without a basis the tick of `predictive` is that without reduced \
         surroundings.\n\n{}\nReducing the surroundings of one place of the patch, once and in the background (time on the wall, \
         one thread): {}.\n",
        table(&heads, 2, &rows),
        reduced.join(", ")
    )
}

/// CPU of a haptic tick against springs.
pub fn picture(all: &[Costs]) -> Picture {
    let mut series = Vec::new();
    for (model, tick) in [("full", 0), ("predictive", 1), ("patch", 2)] {
        for (rate, is_hollow) in [(1000.0, false), (4000.0, true)] {
            let at: Vec<&Costs> = all.iter().filter(|costs| costs.rate == rate).collect();
            let point = |(place, costs): (usize, &&Costs)| {
                let ticks = [costs.full, costs.predictive, costs.patch][tick];
                let is_last = place + 1 == at.len();
                let label = if is_last { format!("{model}, {} kHz", rate * 1e-3) } else { String::new() };
                (costs.springs as f64, us(ticks[0]), label)
            };
            let points = at.iter().enumerate().map(point).collect();
            series.push(Series {
                name: model.to_owned(),
                colour: colour(model),
                is_joined: true,
                is_hollow,
                points,
                sign: Sign::Disc,
            });
        }
    }
    let mut periods: Vec<Nanos> = all.iter().map(Costs::period).collect();
    periods.sort_unstable();
    periods.dedup();
    let level = |period: Nanos| (us(period), format!("period of {} kHz", 1e6 / period.0 as f64));
    Picture {
        title: "CPU of a haptic tick against the size of the body (8^3 to 40^3 nodes)".to_owned(),
        x: "springs".to_owned(),
        y: "CPU per haptic tick, p50 (us)".to_owned(),
        marks: Vec::new(),
        levels: periods.into_iter().map(level).collect(),
        series,
    }
}
