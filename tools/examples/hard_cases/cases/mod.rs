//! The hard cases: what is simulated, what goes wrong with it, and how far each model may be from `full`.

use palpate::model::local::Kind as LocalModelKind;

pub mod late;
pub mod materials;
pub mod motions;
pub mod places;

/// A situation in which simulations usually fail.
#[derive(Clone, Copy, Debug)]
pub struct Case {
    pub name: &'static str,
    pub body: Setup,
    /// What is hard about it.
    pub hard: &'static str,
    pub upset: Upset,
    /// The tool has left the body at the end: the force must be gone.
    pub ends_free: bool,
    pub runs: &'static [Run],
}

/// Where body and tool come from.
#[derive(Clone, Copy, Debug)]
pub enum Setup {
    /// A file in `scenes`, without its extension.
    Scene(&'static str),
    /// A network of springs whose neighbours have 0.5 g and 0.5 mg.
    UnequalMasses,
}

/// What goes wrong with the global model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Upset {
    Nothing,
    /// The release at this time (s) takes a second.
    Stall(f64),
    /// Every second release does not happen.
    EverySecondLost,
}

/// One model in a case.
#[derive(Clone, Copy, Debug)]
pub struct Run {
    pub model: LocalModelKind,
    /// How late results of the global model are, in its periods.
    pub late: f64,
    pub at_most: Bound,
}

/// The largest errors that are accepted, as in `ModelError` (% of the peak of `full`, or of its energy).
#[derive(Clone, Copy, Debug)]
pub struct Bound {
    pub rms: f64,
    pub max: f64,
    pub jump: f64,
    pub energy: f64,
}

const fn run(model: LocalModelKind, late: f64, [rms, max, jump, energy]: [f64; 4]) -> Run {
    Run { model, late, at_most: Bound { rms, max, jump, energy } }
}

const fn case(name: &'static str, scene: &'static str, hard: &'static str, runs: &'static [Run]) -> Case {
    Case { name, body: Setup::Scene(scene), hard, upset: Upset::Nothing, ends_free: false, runs }
}

impl Case {
    const fn upset(self, upset: Upset) -> Self {
        Self { upset, ..self }
    }

    const fn ends_free(self) -> Self {
        Self { ends_free: true, ..self }
    }
}

/// All hard cases, by kind. A bound is the measured error, a fifth of it and a tenth of a percent (energy: three tenths).
pub const KINDS: [&[Case]; 4] = [materials::CASES, motions::CASES, places::CASES, late::CASES];
