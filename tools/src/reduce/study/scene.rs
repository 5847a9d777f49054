//! The locality check of a scene: what a patch between held surroundings captures, and what more would need.

use std::time::Instant;

use palpate::Error;
use palpate::model::body::{Body, State};
use palpate::model::surroundings::{Reduction, RestingBody};
use palpate::scene::Scene;

use super::contact::{ContactGrid, Naming, contact_node, outward};
use super::figures::{FigureOf, hankel_decay};
use super::measure::measure;
use super::{ReduceOptions, ReduceProgress, Steps};
use crate::reduce::findings::{
    BasisError, Budget, ContactLocality, HankelDecay, Locality, PatchError, ReductionStudy, ResponseFigure,
};
use crate::reduction::{
    ContactStiffness, LinearBody, LocalityCheck, Matrix, Modal, StateSpace, StiffnessError, gain_error, log_spaced,
    low_rank, one_shift, stiffness_along, typical_gain_error,
};

/// What happens between two resyncs (Hz): 10 Hz is a third of the global model's rate, 1 kHz the haptic rate.
const BAND_HZ: [f64; 2] = [10.0, 1000.0];
/// The error in the band from which on the patch leaves out too much between resyncs: twice that of the paper's patch on a uniform body.
const BAND_LIMIT_PCT: f64 = 20.0;
/// The error at rest: a patch that is twice as stiff as the body does not stand for it.
const REST_LIMIT_PCT: f64 = 100.0;
/// The whole body's response in the band may be uncertain by this much before it is said.
const REFERENCE_LIMIT_PCT: f64 = 10.0;
/// Coordinates of the largest body that is checked: twelve factorisations are kept, some 4 GB.
const MOST_COORDINATES: usize = 45_000;
/// The share of contacts on the contact's face over a limit that is worth a warning.
const SHARE_LIMIT: f64 = 0.1;
/// Patches that are tried, along, along and into depth.
const SIZES: [[usize; 3]; 7] = [[2, 2, 2], [4, 4, 2], [4, 4, 4], [6, 6, 3], [8, 8, 4], [10, 10, 6], [12, 12, 8]];
/// Numbers of states of reduced surroundings that are shown.
const SHOWN_STATES: [usize; 9] = [2, 5, 10, 20, 35, 50, 75, 100, MOST_STATES];
/// The largest number that is tried.
const MOST_STATES: usize = 150;
/// Frequencies that the body is reduced at for balancing.
const SHIFTS: usize = 24;
/// Moments and place of the one-shift model of the whole body.
const MOMENTS: usize = 10;
const SHIFT_HZ: f64 = 30.0;

/// The locality check of a scene, and the reduction of its body at one contact.
///
/// # Errors
/// If the scene cannot be built or its body is not held.
pub fn reduce_scene(
    scene: &Scene,
    options: &ReduceOptions,
    mut progress: impl FnMut(&ReduceProgress),
) -> Result<ReductionStudy, Error> {
    let started = Instant::now();
    let mut scene = scene.clone();
    scene.local.patch = options.patch.or(scene.local.patch);
    scene.validate()?;
    let scene = &scene;
    let body = scene.body.as_ref().ok_or_else(|| Error::scene("body", "is missing"))?.build()?;
    let (body, naming) = (&*body, Naming::of(scene, &*body));
    let node = contact_node(scene, (body, &naming), options.node)?;
    let grids = ContactGrid::all(body, &naming, options.every, node);
    let mut steps = Steps::new(6 + grids.len() + usize::from(options.measure), &mut progress);
    steps.begin("factorising the body");
    let linear = LinearBody::new(body, &State::at_rest(body.rest()))?;
    if linear.system().coordinates() > MOST_COORDINATES {
        let message = format!(
            "has {} coordinates, three for each node that moves: the check keeps factorisations of at most {MOST_COORDINATES}",
            linear.system().coordinates()
        );
        return Err(Error::scene("body", message));
    }
    let study = Study {
        patch: scene.patch_size(),
        check: LocalityCheck::new(&linear, BAND_HZ)?,
        linear: &linear,
        body,
        naming,
    };
    let mut out = Locality { patch: study.patch, spacing_m: naming.spacing_m, band_hz: BAND_HZ, ..Locality::default() };
    (out.band_limit_pct, out.at_rest_limit_pct) = (BAND_LIMIT_PCT, REST_LIMIT_PCT);
    out.patch_bounds_m = study.bounds(node);
    steps.begin("the scene's contact");
    let coarse = study.whole(&[node]).remove(0);
    let whole = study.check.finer(&study.direction(node))?;
    out.reference_pct = 100.0 * StiffnessError::between(&coarse, &whole, study.check.frequencies()).band;
    out.contact = study.locality(node, &whole, study.patch)?.0;
    for grid in grids {
        steps.begin(format!("contacts on {}", grid.face.name()));
        let contacts = study.contacts(&grid.nodes)?;
        let mut map = grid.map();
        map.contacts = contacts;
        out.faces.push(map);
    }
    steps.begin("other patches");
    let contacts = || out.faces.iter().flat_map(|face| &face.contacts).flatten();
    let worst = contacts().max_by(|a, b| a.band_pct.total_cmp(&b.band_pct)).map_or(node, |contact| contact.node);
    let at_worst = study.whole(&[worst]).remove(0);
    for size in SIZES.into_iter().filter(|&size| naming.has_room(size)) {
        let (contact, nodes) = study.locality(node, &whole, size)?;
        out.sizes.push(PatchError { patch: size, nodes, contact, worst: study.locality(worst, &at_worst, size)?.0 });
    }
    steps.begin("responses");
    let figure = study.responses(node, &whole)?;
    steps.begin("balancing");
    let hankel = study.decay(node, options.order)?;
    if options.measure {
        steps.begin("measuring in the time domain");
        match measure(scene, body, node, study.patch, (&whole, &study.patch_at(node, study.patch)?)) {
            Ok(measured) => out.measured = Some(measured),
            Err(error) => out.warnings.push(format!("the error could not be measured: {error}")),
        }
    }
    steps.begin("reduced surroundings");
    let bases = study.bases(node)?;
    if let Some(error_pct) = options.error_pct {
        let meets = |size: &&PatchError| size.contact.band_pct <= error_pct;
        let patch = out.sizes.iter().find(meets).map(|size| size.patch);
        let states = bases.iter().find(|basis| basis.error_pct <= error_pct).map(|basis| basis.states);
        // Where nothing outside of the patch can move there is nothing to reduce.
        let states = if bases.is_empty() { Some(0) } else { states };
        out.budget = Some(Budget { error_pct, patch, states });
    }
    out.bases = bases.into_iter().filter(|basis| SHOWN_STATES.contains(&basis.states)).collect();
    judge(&mut out, &naming);
    Ok(ReductionStudy {
        subject: "scene".to_owned(),
        responses: vec![figure],
        hankel: vec![hankel],
        locality: Some(out),
        seconds: started.elapsed().as_secs_f64(),
        ..ReductionStudy::default()
    })
}

/// A body and what is asked about it.
struct Study<'a> {
    patch: [usize; 3],
    body: &'a dyn Body,
    naming: Naming,
    linear: &'a LinearBody,
    check: LocalityCheck<'a>,
}

impl Study<'_> {
    fn direction(&self, node: u32) -> Matrix {
        self.linear.contact(&[(node, 1.0)])
    }

    fn whole(&self, nodes: &[u32]) -> Vec<ContactStiffness> {
        let contacts: Vec<Matrix> = nodes.iter().map(|&node| self.direction(node)).collect();
        self.check.whole(&contacts)
    }

    fn patch_nodes(&self, node: u32, size: [usize; 3]) -> Vec<u32> {
        let mut nodes = Vec::new();
        let triangles: Vec<u32> = self.body.surface().at_node(node).first().copied().into_iter().collect();
        self.body.patch(&triangles, size, &mut nodes);
        nodes
    }

    fn coordinates(&self, node: u32, size: [usize; 3]) -> Vec<usize> {
        self.linear.coordinates(&self.patch_nodes(node, size))
    }

    /// The outermost places of the scene's patch at a contact (m).
    fn bounds(&self, node: u32) -> [[f64; 3]; 2] {
        let nodes = self.patch_nodes(node, self.patch);
        let places = || nodes.iter().map(|&node| self.body.rest()[node as usize]);
        let first = self.body.rest()[node as usize];
        [places().fold(first, |low, x| low.inf(&x)).into(), places().fold(first, |high, x| high.sup(&x)).into()]
    }

    fn patch_at(&self, node: u32, size: [usize; 3]) -> Result<ContactStiffness, Error> {
        Ok(self.check.patch(&self.coordinates(node, size), &self.direction(node))?)
    }

    /// What a patch of `size` captures at `node`, and how many nodes move in it.
    fn locality(
        &self,
        node: u32,
        whole: &ContactStiffness,
        size: [usize; 3],
    ) -> Result<(ContactLocality, usize), Error> {
        let coordinates = self.coordinates(node, size);
        let patch = self.check.patch(&coordinates, &self.direction(node))?;
        let error = StiffnessError::between(&patch, whole, self.check.frequencies());
        let locality = ContactLocality {
            node,
            position_m: self.body.rest()[node as usize].into(),
            stiffness_n_per_m: stiffness_along(whole, outward(self.body, node)),
            at_rest_pct: 100.0 * error.at_rest,
            band_pct: 100.0 * error.band,
            worst_pct: 100.0 * error.worst,
        };
        Ok((locality, coordinates.len() / 3))
    }

    /// `None` where there is no node, or it is held.
    fn contacts(&self, nodes: &[Option<u32>]) -> Result<Vec<Option<ContactLocality>>, Error> {
        let is_movable = |node: &u32| self.body.inverse_masses()[*node as usize] > 0.0;
        let movable: Vec<u32> = nodes.iter().flatten().copied().filter(is_movable).collect();
        let mut wholes = self.whole(&movable).into_iter();
        let of = |node: Option<u32>| {
            let Some(node) = node.filter(is_movable) else { return Ok(None) };
            wholes.next().map(|whole| Ok(self.locality(node, &whole, self.patch)?.0)).transpose()
        };
        nodes.iter().copied().map(of).collect()
    }

    /// The dynamic stiffness of the whole body, of patches and of one-shift Krylov at a contact.
    fn responses(&self, node: u32, whole: &ContactStiffness) -> Result<ResponseFigure, Error> {
        let figure = ResponseFigure {
            title: format!("Dynamic stiffness at {}", self.naming.node(node)),
            channels: ["x", "y", "z"].map(str::to_owned).to_vec(),
            unit: "N/m".to_owned(),
            hz: [vec![0.0], log_spaced(1.0, BAND_HZ[1], 61)].concat(),
            models: Vec::new(),
        };
        let order = self.linear.system().order();
        let mut figure = FigureOf::new(figure, whole, (order, 0.0));
        for size in [self.patch, [8, 8, 4]] {
            if !self.naming.has_room(size) {
                continue;
            }
            let started = Instant::now();
            let patch = self.patch_at(node, size)?;
            let [a, b, c] = size;
            let order = 2 * self.coordinates(node, size).len();
            figure.add(&format!("patch {a} x {b} x {c}"), order, started.elapsed().as_secs_f64(), &patch, None);
        }
        let started = Instant::now();
        let system = self.linear.compliance(&[(node, 1.0)])?;
        let krylov = one_shift(&system, 2.0 * std::f64::consts::PI * SHIFT_HZ, MOMENTS)?;
        let order = krylov.model.order();
        let seconds = started.elapsed().as_secs_f64();
        figure.add("Krylov, one shift", order, seconds, &ContactStiffness::of(krylov.model), None);
        Ok(figure.done())
    }

    /// The error of the linear contact force of `predictive` by the states of its reduced surroundings.
    fn bases(&self, node: u32) -> Result<Vec<BasisError>, Error> {
        let Some(resting) = RestingBody::new(self.body) else { return Ok(Vec::new()) };
        let errors = Reduction::force_errors(&resting, &self.patch_nodes(node, self.patch), MOST_STATES)?;
        let by_states = |(index, error): (usize, &f64)| BasisError { states: index + 1, error_pct: 100.0 * error };
        Ok(errors.iter().enumerate().map(by_states).collect())
    }

    /// The body balanced for the displacement of the contact's node, the paper's way, through a Krylov space.
    fn decay(&self, node: u32, order: Option<usize>) -> Result<HankelDecay, Error> {
        let system = self.linear.held(&[node])?;
        let reduced = low_rank(&system, SHIFTS)?;
        let mut orders = vec![2, 4, 6, 10, 15, 20, 30, 50];
        orders.extend(order);
        let (model, modal) = (&reduced.projection.model, Modal::of(&reduced.projection.model));
        let hinf_pct = |truncated: &StateSpace| match &modal {
            Some(modal) => gain_error(modal, truncated),
            None => typical_gain_error(&system, model, truncated),
        };
        let title = format!("force on {} by its displacement", self.naming.node(node));
        Ok(hankel_decay(title, system.order(), &reduced.balanced, &orders, &hinf_pct))
    }
}

/// Says whether the paper's assumption holds, and where it does not.
fn judge(out: &mut Locality, naming: &Naming) {
    let contact = out.contact;
    let over = |contact: &ContactLocality| contact.band_pct > BAND_LIMIT_PCT || contact.at_rest_pct > REST_LIMIT_PCT;
    out.is_local = !over(&contact);
    let place = |contact: &ContactLocality| naming.node(contact.node);
    if contact.at_rest_pct > REST_LIMIT_PCT {
        out.warnings.push(format!(
            "at {} the patch is some {:.0} times as stiff at rest as the body: what gives way lies outside of it, as soft deep tissue \
             under a stiff skin does, or what is soft around a stiff nodule; use `predictive` or `full`",
            place(&contact),
            1.0 + contact.at_rest_pct / 100.0
        ));
    }
    if contact.band_pct > BAND_LIMIT_PCT {
        out.warnings.push(format!(
            "at {} the patch leaves out {:.0} % of the response between resyncs ({} to {} Hz): the force is made outside of it",
            place(&contact),
            contact.band_pct,
            BAND_HZ[0],
            BAND_HZ[1]
        ));
    }
    // Faces that are alike make one line.
    let mut alike: Vec<(usize, usize, Vec<&str>, &ContactLocality)> = Vec::new();
    for face in &out.faces {
        let all = || face.contacts.iter().flatten();
        let (count, of) = (all().filter(|contact| over(contact)).count(), all().count());
        let Some(worst) = all().filter(|contact| over(contact)).max_by(|a, b| a.band_pct.total_cmp(&b.band_pct)) else {
            continue;
        };
        if count as f64 <= SHARE_LIMIT * of as f64 {
            continue;
        }
        match alike.iter_mut().find(|known| (known.0, known.1) == (count, of)) {
            Some((_, _, names, most)) => {
                names.push(&face.face);
                *most = if worst.band_pct > most.band_pct { worst } else { most };
            }
            None => alike.push((count, of, vec![&face.face], worst)),
        }
    }
    for (count, of, names, worst) in alike {
        out.warnings.push(format!(
            "on {} the patch is not enough at {count} of {of} contacts{}, worst at {}: {:.0} % between resyncs, {:.0} % at rest",
            names.join(", "),
            if names.len() > 1 { " each" } else { "" },
            place(worst),
            worst.band_pct,
            worst.at_rest_pct
        ));
    }
    if out.reference_pct > REFERENCE_LIMIT_PCT {
        out.warnings.push(format!(
            "this body rings: its response between resyncs is known to some {:.0} % only, at this contact, and all errors there are uncertain by as \
             much; `--measure` and `palpate compare` are not",
            out.reference_pct
        ));
    }
}
