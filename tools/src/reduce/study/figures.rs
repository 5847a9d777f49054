//! The paper's figures: frequency responses of the models of a mesh, and where its balanced states live.

use std::time::Instant;

use nalgebra::Complex;
use palpate::Error;

use crate::reduce::findings::{HankelDecay, ModelResponse, ResponseFigure, StateShape, StateShapes, Truncation};
use crate::reduction::{
    Balanced, CMatrix, ErrorBound, Modal, PaperMesh, Projection, Response, SecondOrder, StateSpace, condensed,
    craig_bampton, gain_error, guyan, log_spaced, one_shift, patch,
};

/// Frequencies of a figure (Hz): rest, and from 0.1 Hz to 10 kHz.
const BAND_HZ: [f64; 2] = [0.1, 1e4];
const SAMPLES: usize = 121;
/// Where one-shift Krylov matches moments, as a share of the typical frequency.
const SHIFT: f64 = 0.5;
/// Modes of the inside that Craig and Bampton's model has.
const INNER_MODES: usize = 5;
/// Balanced states whose place is shown.
const SHOWN_STATES: usize = 8;
/// Between the nodes of the paper's meshes (m): a picture needs one, the numbers do not depend on it.
const SPACING_M: f64 = 0.01;

/// Cells as in `12 x 12`.
pub(super) fn in_words(mesh: &PaperMesh) -> String {
    mesh.cells.iter().map(usize::to_string).collect::<Vec<_>>().join(" x ")
}

/// A mesh with what its figures are made from.
pub(super) struct Studied {
    pub(super) mesh: PaperMesh,
    pub(super) system: SecondOrder,
    pub(super) modal: Modal,
    pub(super) balanced: Balanced,
    /// Wall time of the balancing (s).
    pub(super) seconds: f64,
}

impl Studied {
    pub(super) fn new(mesh: &PaperMesh) -> Result<Self, Error> {
        let started = Instant::now();
        let system = mesh.system()?;
        let modal = Modal::new(&system).ok_or_else(super::no_modes)?;
        let balanced = Balanced::modal(&modal)?;
        Ok(Self { mesh: mesh.clone(), system, modal, balanced, seconds: started.elapsed().as_secs_f64() })
    }

    /// How its Hankel singular values fall; `orders` are those whose errors are wanted.
    pub(super) fn decay(&self, orders: &[usize]) -> HankelDecay {
        let title = format!("{} cells, zeta {}", in_words(&self.mesh), self.mesh.damping_ratio);
        let hinf_pct = |truncated: &StateSpace| gain_error(&self.modal, truncated);
        hankel_decay(title, self.system.order(), &self.balanced, orders, &hinf_pct)
    }

    fn figure(&self, title: String, hz: &[f64]) -> FigureOf<'_> {
        let hz =
            if hz.is_empty() { [vec![0.0], log_spaced(BAND_HZ[0], BAND_HZ[1], SAMPLES)].concat() } else { hz.to_vec() };
        let channels = match self.mesh.dimensions() {
            2 => vec!["tangential", "normal"],
            _ => vec!["tangential x", "tangential y", "normal"],
        };
        let figure = ResponseFigure {
            title,
            channels: channels.into_iter().map(str::to_owned).collect(),
            unit: "N/m".to_owned(),
            hz,
            models: Vec::new(),
        };
        FigureOf::new(figure, &self.modal, (self.system.order(), self.seconds))
    }
}

/// How the Hankel singular values of `balanced` fall, of `order` states in all; `hinf_pct` says how far a truncation is from the whole. Of
/// `orders`, those above the numerical rank are one, the rank.
pub(super) fn hankel_decay(
    title: String,
    order: usize,
    balanced: &Balanced,
    orders: &[usize],
    hinf_pct: &dyn Fn(&StateSpace) -> f64,
) -> HankelDecay {
    let mut kept: Vec<usize> = orders.iter().map(|&order| order.min(balanced.rank())).collect();
    kept.sort_unstable();
    kept.dedup();
    let truncation = |order: usize| Truncation {
        order,
        error_pct: balanced.tail_pct(order),
        hinf_pct: hinf_pct(&balanced.truncated(order)),
    };
    HankelDecay {
        title,
        order,
        values: balanced.hankel[..balanced.rank()].to_vec(),
        unit: "N/m".to_owned(),
        truncations: kept.into_iter().map(truncation).collect(),
    }
}

/// A figure in the making.
pub(super) struct FigureOf<'a> {
    reference: &'a dyn Response,
    figure: ResponseFigure,
}

impl<'a> FigureOf<'a> {
    /// An empty figure with `reference` as its first model.
    pub(super) fn new(figure: ResponseFigure, reference: &'a dyn Response, (order, seconds): (usize, f64)) -> Self {
        let mut of = Self { reference, figure };
        of.add("full", order, seconds, reference, None);
        of
    }

    /// Adds a model; `bound` is what its error is at most at a frequency (Hz).
    pub(super) fn add(
        &mut self,
        name: &str,
        order: usize,
        seconds: f64,
        model: &dyn Response,
        bound: Option<&dyn Fn(f64) -> f64>,
    ) {
        let channels = self.figure.channels.len();
        let mut out = ModelResponse { name: name.to_owned(), order, seconds, ..ModelResponse::default() };
        (out.at_rest_pct, out.worst_pct, out.worst_hz) = (f64::NAN, f64::NAN, f64::NAN);
        out.gains = vec![Vec::new(); channels];
        let mut estimates = Vec::new();
        for &hz in &self.figure.hz {
            // At a pole there is no response.
            let nothing = || CMatrix::from_element(channels, channels, Complex::new(f64::NAN, 0.0));
            let gain = model.at_hz(hz).unwrap_or_else(nothing);
            let reference = self.reference.at_hz(hz).unwrap_or_else(nothing);
            for (channel, gains) in out.gains.iter_mut().enumerate() {
                gains.push([gain[(channel, channel)].re, gain[(channel, channel)].im]);
            }
            let error_pct = 100.0 * (&gain - &reference).norm() / reference.norm();
            if hz == 0.0 {
                out.at_rest_pct = error_pct;
            } else if out.worst_hz.is_nan() || error_pct.is_nan() || error_pct > out.worst_pct {
                (out.worst_pct, out.worst_hz) = (error_pct, hz);
            }
            if let Some(bound) = bound {
                // The reference is at least so large: without it, that is what the error is divided by.
                let least = gain.norm() - bound(hz);
                let estimate = if least > 0.0 { 100.0 * bound(hz) / least } else { f64::INFINITY };
                estimates.push(estimate);
            }
        }
        // A bound that allows for no response at all says nothing.
        out.estimate_pct = estimates.into_iter().reduce(f64::max).filter(|estimate| estimate.is_finite());
        self.figure.models.push(out);
    }

    /// Adds a congruence of `system` with the bound of its error.
    pub(super) fn add_projection(
        &mut self,
        name: &str,
        seconds: f64,
        system: &SecondOrder,
        projection: &Projection,
    ) -> Result<(), Error> {
        let bound = ErrorBound::new(system, projection, SHIFT * system.typical_frequency())?;
        let at = |hz: f64| bound.at_hz(hz).unwrap_or(f64::INFINITY);
        self.add(name, projection.model.order(), seconds, &projection.model, Some(&at));
        Ok(())
    }

    /// Adds a truncation of a balanced model: its error is below twice the sum of what was left out (Enns, Glover).
    pub(super) fn add_balanced(&mut self, seconds: f64, balanced: &Balanced, order: usize) {
        let model: StateSpace = balanced.truncated(order);
        // The bound is of the largest singular value, the error a root of the sum of the squares.
        let bound = balanced.error_bound(model.order()) * (self.figure.channels.len() as f64).sqrt();
        self.add(&format!("balanced, {} states", model.order()), model.order(), seconds, &model, Some(&|_| bound));
    }

    pub(super) fn done(self) -> ResponseFigure {
        self.figure
    }
}

/// Fig. 4: the full and the balanced models.
pub(super) fn balanced_figure(mesh: &PaperMesh) -> Result<(ResponseFigure, HankelDecay), Error> {
    let studied = Studied::new(mesh)?;
    let title = format!("Fig. 4: full and balanced models, {} cells, zeta {}", in_words(mesh), mesh.damping_ratio);
    let mut figure = studied.figure(title, &[]);
    for order in [4, 10, 20] {
        figure.add_balanced(studied.seconds, &studied.balanced, order);
    }
    Ok((figure.done(), studied.decay(&[2, 4, 6, 8, 10, 15, 20, 30])))
}

/// Fig. 8: every kind of reduced model against the full one.
pub(super) fn models_figure(mesh: &PaperMesh, order: usize, hz: &[f64]) -> Result<ResponseFigure, Error> {
    let studied = Studied::new(mesh)?;
    let title = format!("Fig. 8: models of {} cells, zeta {}", in_words(mesh), mesh.damping_ratio);
    all_models(&studied, title, order, hz)
}

pub(super) fn all_models(studied: &Studied, title: String, order: usize, hz: &[f64]) -> Result<ResponseFigure, Error> {
    let Studied { mesh, system, balanced, seconds, .. } = studied;
    let mut figure = studied.figure(title, hz);
    figure.add_balanced(*seconds, balanced, order);
    let kept = local_coordinates(mesh);
    // A space of more states than there are would be looked for without end.
    let moments = (order.min(system.order()) / 2).div_ceil(system.ports.inputs()).max(1);
    let shift = SHIFT * system.typical_frequency();
    let mut add = |name: &str, make: &dyn Fn() -> Result<Projection, Error>| {
        let started = Instant::now();
        let made = make()?;
        figure.add_projection(name, started.elapsed().as_secs_f64(), system, &made)
    };
    add("Krylov, one shift", &|| Ok(one_shift(system, shift, moments)?))?;
    add("local (the paper's)", &|| Ok(patch(system, &kept)))?;
    add("Guyan", &|| Ok(guyan(system, &kept)?))?;
    let modes = format!("Craig-Bampton, {INNER_MODES} modes");
    add(&modes, &|| Ok(craig_bampton(system, &kept, INNER_MODES)?))?;
    // Its mass is no congruence: there is no bound.
    let started = Instant::now();
    let condensed = condensed(system, &kept)?;
    figure.add("condensed K and C", condensed.model.order(), started.elapsed().as_secs_f64(), &condensed.model, None);
    Ok(figure.done())
}

/// True for the free nodes that the paper's local model has.
fn in_local(mesh: &PaperMesh) -> Vec<bool> {
    let (middle, local) = (mesh.middle(), mesh.local());
    let top = mesh.dimensions() - 1;
    let inside = |node: &Vec<usize>| {
        (0..=top).all(|axis| {
            let reach = if axis == top { local.cells[axis] } else { local.cells[axis] / 2 };
            node[axis].abs_diff(middle[axis]) < reach
        })
    };
    mesh.free_nodes().iter().map(inside).collect()
}

/// The coordinates of those nodes, in increasing order.
fn local_coordinates(mesh: &PaperMesh) -> Vec<usize> {
    let d = mesh.dimensions();
    let nodes = in_local(mesh).into_iter().enumerate().filter(|&(_, inside)| inside);
    nodes.flat_map(|(node, _)| d * node..d * (node + 1)).collect()
}

/// Fig. 5: how far each node moves in each of the first balanced states.
pub(super) fn shapes_figure(mesh: &PaperMesh) -> Result<StateShapes, Error> {
    let studied = Studied::new(mesh)?;
    let (d, in_local) = (mesh.dimensions(), in_local(mesh));
    let place = |node: &[usize]| {
        let at = |axis: usize| node[axis] as f64 * SPACING_M;
        if d == 2 { [at(0), 0.0, at(1)] } else { [at(0), at(1), at(2)] }
    };
    let hankel = &studied.balanced.hankel;
    let states = (0..SHOWN_STATES.min(studied.balanced.rank())).map(|state| {
        let column = studied.balanced.displacements.column(state);
        let squares: Vec<f64> = column.as_slice().chunks_exact(d).map(|x| x.iter().map(|x| x * x).sum()).collect();
        let largest = squares.iter().fold(f64::MIN_POSITIVE, |largest: f64, &square| largest.max(square));
        let inside: f64 = squares.iter().zip(&in_local).filter(|(_, inside)| **inside).map(|(square, _)| square).sum();
        StateShape {
            hankel: hankel[state] / hankel[0],
            amplitude: squares.iter().map(|square| (square / largest).sqrt()).collect(),
            local_share: inside / squares.iter().sum::<f64>(),
        }
    });
    Ok(StateShapes {
        title: format!("Fig. 5: balanced states of {} cells, zeta {}", in_words(mesh), mesh.damping_ratio),
        nodes: mesh.free_nodes().iter().map(|node| place(node)).collect(),
        input: place(&mesh.middle()),
        states: states.collect(),
        in_local,
    })
}
