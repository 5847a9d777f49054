//! All borders of the sweep: measured on all cores, as a table and as a picture.

use std::sync::{Mutex, PoisonError};
use std::{fmt, thread};

use palpate::model::local::Kind as LocalModelKind;
use palpate::prelude::*;
use palpate_cli::drawing::{Colour, Curve, Panel, Sheet};

use crate::z_width::{STIFFNESS, Sweep, theory};

const MODELS: [(LocalModelKind, Colour); 4] = [
    (LocalModelKind::Hold, Colour::RED),
    (LocalModelKind::Patch, Colour::ORANGE),
    (LocalModelKind::Predictive, Colour::GREEN),
    (LocalModelKind::Full, Colour::BLUE),
];
const RATES_HZ: [f64; 3] = [500.0, 1000.0, 4000.0];
/// Dampings of the wall (N s/m).
const DAMPINGS: [f64; 5] = [0.05, 0.1, 0.2, 0.5, 1.0];
/// What one rate of the short sweep looks at.
const SHORT_DAMPINGS: [f64; 1] = [0.1];

/// One border.
#[derive(Clone, Copy)]
struct Case {
    model: LocalModelKind,
    rate_hz: f64,
    damping: f64,
}

/// Borders by case.
pub struct Table {
    rates_hz: Vec<f64>,
    dampings: Vec<f64>,
    device_damping: f64,
    borders: Vec<(Case, f64)>,
}

impl Table {
    /// Measures everything, or with `is_whole` false one rate and damping for `hold` and `patch`.
    pub fn measure(is_whole: bool) -> Result<Self, Error> {
        let (rates_hz, dampings) =
            if is_whole { (RATES_HZ.to_vec(), DAMPINGS.to_vec()) } else { (vec![1000.0], SHORT_DAMPINGS.to_vec()) };
        let sweep = Sweep::new()?;
        let mut cases = Vec::new();
        for (model, _) in &MODELS[..if is_whole { 4 } else { 2 }] {
            for &rate_hz in &rates_hz {
                cases.extend(dampings.iter().map(|&damping| Case { model: *model, rate_hz, damping }));
            }
        }
        // The longest first.
        cases.sort_by(|a, b| b.rate_hz.total_cmp(&a.rate_hz));
        let (queue, done) = (Mutex::new(cases.iter()), Mutex::new(Vec::new()));
        let next = || queue.lock().unwrap_or_else(PoisonError::into_inner).next();
        let work = || -> Result<(), Error> {
            while let Some(&case) = next() {
                let border = sweep.border(case.model, case.rate_hz, case.damping)?;
                let mut done = done.lock().unwrap_or_else(PoisonError::into_inner);
                done.push((case, border));
                let Case { model, rate_hz, damping } = case;
                let (name, n, of) = (model.name(), done.len(), cases.len());
                eprintln!("z_width {n} of {of}: {name} at {rate_hz} Hz, {damping} N s/m: {border:.0} N/m");
            }
            Ok(())
        };
        let workers = thread::available_parallelism().map_or(1, usize::from);
        thread::scope(|scope| -> Result<(), Error> {
            let workers: Vec<_> = (0..workers).map(|_| scope.spawn(work)).collect();
            workers.into_iter().try_for_each(|worker| match worker.join() {
                Ok(result) => result,
                Err(panic) => std::panic::resume_unwind(panic),
            })
        })?;
        let borders = done.into_inner().unwrap_or_else(PoisonError::into_inner);
        Ok(Self { rates_hz, dampings, device_damping: sweep.device_damping(), borders })
    }

    fn border(&self, model: LocalModelKind, rate_hz: f64, damping: f64) -> Option<f64> {
        let same = |case: &Case| case.model == model && case.rate_hz == rate_hz && case.damping == damping;
        self.borders.iter().find(|(case, _)| same(case)).map(|(_, border)| *border)
    }

    /// A panel per rate.
    pub fn sheet(&self) -> Sheet {
        let panel = |&rate_hz: &f64| {
            let points = |border: &dyn Fn(f64) -> Option<f64>, dampings: &[f64]| -> Vec<(f64, f64)> {
                let at = |&damping: &f64| Some((damping, border(damping)?));
                dampings.iter().filter_map(at).collect()
            };
            let fine: Vec<f64> = (0..=200).map(|n| f64::from(n) * 5e-3).collect();
            let passive = |delay_ticks| {
                let within = move |damping| {
                    let border = theory(self.device_damping, rate_hz, damping, delay_ticks);
                    (border >= STIFFNESS[0]).then_some(border)
                };
                points(&within, &fine)
            };
            let mut curves = vec![
                Curve { points: passive(0.0), colour: Colour::INK, is_wide: true },
                Curve { points: passive(0.5), colour: Colour::GREY, is_wide: true },
            ];
            curves.extend(MODELS.map(|(model, colour)| Curve {
                points: points(&|damping| self.border(model, rate_hz, damping), &self.dampings),
                colour,
                is_wide: false,
            }));
            Panel {
                caption: format!("{rate_hz} Hz"),
                x_label: "damping of the wall B (N s/m)",
                y_label: "stiffness of the wall K (N/m)",
                shown: 0.0..1.0 + 1e-9,
                is_log: true,
                curves,
                ..Panel::default()
            }
        };
        let mut legend = vec![("b > K T/2 + |B|".to_owned(), Colour::INK), ("b > K T + |B|".to_owned(), Colour::GREY)];
        legend.extend(MODELS.map(|(model, colour)| (model.name().to_owned(), colour)));
        Sheet {
            title: "z_width: the stiffest wall without a sustained limit cycle".to_owned(),
            subtitle: format!(
                "below a curve the tool rests, above it swings; device damping b = {} N s/m; {} and {} N/m are the ends of the sweep",
                self.device_damping, STIFFNESS[0], STIFFNESS[1]
            ),
            legend,
            rows: self.rates_hz.iter().map(|rate_hz| vec![panel(rate_hz)]).collect(),
        }
    }
}

impl fmt::Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "| rate | model |")?;
        self.dampings.iter().try_for_each(|damping| write!(f, " B = {damping} |"))?;
        write!(f, "\n| ---: | --- |{}", " ---: |".repeat(self.dampings.len()))?;
        let row = |f: &mut fmt::Formatter<'_>, rate_hz: f64, name: &str, of: &dyn Fn(f64) -> Option<f64>| {
            write!(f, "\n| {rate_hz} Hz | {name} |")?;
            self.dampings.iter().try_for_each(|&damping| match of(damping) {
                None => write!(f, " |"),
                Some(border) if border <= STIFFNESS[0] => write!(f, " < {} |", STIFFNESS[0]),
                Some(border) if border >= STIFFNESS[1] => write!(f, " > {} |", STIFFNESS[1]),
                Some(border) => write!(f, " {border:.0} |"),
            })
        };
        for &rate_hz in &self.rates_hz {
            for (name, delay_ticks) in [("b > K T/2 + B", 0.0), ("b > K T + B", 0.5)] {
                row(f, rate_hz, name, &|damping| Some(theory(self.device_damping, rate_hz, damping, delay_ticks)))?;
            }
            for (model, _) in MODELS {
                row(f, rate_hz, model.name(), &|damping| self.border(model, rate_hz, damping))?;
            }
        }
        Ok(())
    }
}
