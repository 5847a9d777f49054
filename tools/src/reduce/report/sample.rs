//! A study with something of everything, for the tests of the reports. Its numbers are made up.

use crate::reduce::findings::{
    BasisError, Budget, ContactLocality, FaceMap, HankelDecay, Locality, MeasuredLocality, ModelResponse, PatchError,
    ReductionRow, ReductionStudy, ReductionTable, ResponseFigure, StateShape, StateShapes, Truncation,
};

/// The study.
pub(super) fn sample() -> ReductionStudy {
    ReductionStudy {
        subject: "scenes/<nodule>.toml".into(),
        tables: vec![
            sizes(2, "Table 1, 2D", &[3.89e-6, 0.00396, 0.0383, 0.201, 0.307]),
            sizes(3, "Table 1, 3D", &[1.08e-13, 4.84e-13]),
            damping(),
        ],
        responses: vec![response()],
        shapes: vec![shapes([13, 13, 1]), shapes([6, 6, 6])],
        hankel: vec![hankel()],
        locality: Some(locality()),
        seconds: 1.25,
    }
}

fn sizes(axes: usize, title: &str, published: &[f64]) -> ReductionTable {
    let row = |(at, published): (usize, &f64)| ReductionRow {
        cells: vec![5 * (at + 1); axes],
        damping_ratio: 1.0,
        order: 76 * (at + 1) * (at + 1),
        reduced_order: 20,
        states: if axes == 3 { 14 } else { 20 },
        method: if at > 2 { "rational Krylov" } else { "modal" }.into(),
        error_pct: published * [0.7, 2.1, 1.4, 0.4, 0.5][at],
        hinf_pct: published * 0.3,
        published_error_pct: *published,
        published_s: Some(0.07 * 10_f64.powi(at as i32)),
        seconds: 0.0021 * (at + 1) as f64,
        is_stable: true,
    };
    ReductionTable { title: title.into(), rows: published.iter().enumerate().map(row).collect() }
}

fn damping() -> ReductionTable {
    let row = |(zeta, published): (f64, f64)| ReductionRow {
        cells: vec![12, 12],
        damping_ratio: zeta,
        order: 524,
        reduced_order: 20,
        states: 20,
        method: "modal".into(),
        error_pct: 0.9 * published,
        hinf_pct: 0.4 * published,
        published_error_pct: published,
        published_s: None,
        seconds: 0.05,
        is_stable: zeta < 2.0,
    };
    let rows = [(0.001, 51.1), (0.01, 38.4), (0.1, 13.7), (0.2, 4.24), (0.6, 0.146), (2.0, f64::NAN)].map(row);
    ReductionTable { title: "Table 2".into(), rows: rows.into() }
}

/// A resonance per channel, models that miss it more and more.
fn response() -> ResponseFigure {
    let hz: Vec<f64> = [0.0].into_iter().chain((0..120).map(|at| 10_f64.powf(f64::from(at) / 34.0))).collect();
    let gain = |hz: f64, w0: f64, miss: f64| {
        let (re, im) = (1.0 - (hz / w0).powi(2), 0.2 * hz / w0);
        let size = re * re + im * im;
        let off = miss / (1.0 + hz / 40.0);
        [120.0 + off - 60.0 * re / size, 0.3 * hz + 60.0 * im / size]
    };
    let model = |(name, order, miss, estimate_pct): (&str, usize, f64, Option<f64>)| ModelResponse {
        name: name.into(),
        order,
        gains: [40.0, 90.0].map(|w0| hz.iter().map(|&hz| gain(hz, w0, miss)).collect()).into(),
        at_rest_pct: miss,
        worst_pct: 1.8 * miss,
        worst_hz: if miss > 0.0 { 12.3 } else { 0.0 },
        estimate_pct,
        seconds: 0.0015,
    };
    let models = [
        ("full", 524, 0.0, None),
        ("local", 20, 66.0, None),
        ("balanced", 20, 0.05, Some(0.11)),
        ("second-order Krylov", 20, 0.2, Some(0.4)),
        ("Guyan", 20, 5.0, None),
        ("Craig-Bampton", 20, 1.0, Some(3.0)),
    ];
    ResponseFigure {
        title: "Fig. 8".into(),
        channels: vec!["tangential".into(), "normal".into()],
        unit: "N/m".into(),
        hz: hz.clone(),
        models: models.map(model).into(),
    }
}

fn shapes([nx, ny, nz]: [usize; 3]) -> StateShapes {
    let step = 0.01;
    let is_flat = nz == 1;
    let at = |x: usize, y: usize, z: usize| [x as f64 * step, y as f64 * step, z as f64 * step];
    let input = if is_flat { at(nx / 2, ny - 1, 0) } else { at(nx / 2, ny / 2, nz - 1) };
    let mut nodes = Vec::new();
    for z in 0..nz {
        for y in 0..ny {
            nodes.extend((0..nx).map(|x| at(x, y, z)));
        }
    }
    nodes.retain(|node| *node != input);
    let distance = |node: &[f64; 3]| {
        let square: f64 = node.iter().zip(input).map(|(a, b)| (a - b) * (a - b)).sum();
        square.sqrt() / step
    };
    let state = |number: usize| {
        let reach = 1.0 + 0.7 * number as f64;
        let amplitude: Vec<f64> = nodes.iter().map(|node| (-(distance(node) - 1.0) / reach).exp()).collect();
        StateShape { hankel: 0.2_f64.powi(number as i32), amplitude, local_share: 0.9 / (1.0 + 0.2 * number as f64) }
    };
    let title = if is_flat { "Fig. 5" } else { "At the contact" };
    StateShapes {
        title: title.into(),
        in_local: nodes.iter().map(|node| distance(node) < 2.5).collect(),
        states: (0..20).map(state).collect(),
        nodes,
        input,
    }
}

fn hankel() -> HankelDecay {
    let values: Vec<f64> = (0..48).map(|at| 118.0 * 0.52_f64.powi(at)).collect();
    let truncations = (1..=10).map(|at| 4 * at).map(|order| {
        let error_pct = 200.0 * 0.52_f64.powi(order);
        Truncation { order: order as usize, error_pct, hinf_pct: 0.4 * error_pct }
    });
    HankelDecay {
        title: "12 x 12 cells, zeta 1".into(),
        order: 524,
        truncations: truncations.collect(),
        values,
        unit: "N/m".into(),
    }
}

fn contact(node: u32, position_m: [f64; 3], band_pct: f64) -> ContactLocality {
    ContactLocality {
        node,
        position_m,
        stiffness_n_per_m: 85.3,
        at_rest_pct: (9.0 * band_pct).min(64.0),
        band_pct,
        worst_pct: 2.5 * band_pct,
    }
}

fn face(name: &str, axes: [&str; 2], nodes: [usize; 2], place: impl Fn(f64, f64) -> [f64; 3]) -> FaceMap {
    let places = |count: usize| (0..count).map(|at| at as f64 * 0.01).collect::<Vec<f64>>();
    let (first_m, second_m) = (places(nodes[0]), places(nodes[1]));
    let mut contacts = Vec::new();
    for (row, &second) in second_m.iter().enumerate() {
        for (column, &first) in first_m.iter().enumerate() {
            // Worst over the nodule; the bottom is held.
            let off = (first - 0.07).hypot(second - 0.06) / 0.02;
            let error = 0.4 + 23.6 * (-off * off).exp();
            let is_held = name == "x_max" && row == 0;
            // Each face has nodes of its own.
            let first_node = if name == "z_max" { 0 } else { 1000 };
            let node = u32::try_from(first_node + row * nodes[0] + column).unwrap();
            contacts.push((!is_held).then(|| contact(node, place(first, second), error)));
        }
    }
    let ends_m = nodes.map(|count| [0.0, (count - 1) as f64 * 0.01]);
    FaceMap { face: name.into(), axes: axes.map(str::to_owned), first_m, second_m, ends_m, contacts }
}

fn locality() -> Locality {
    let here = contact(66, [0.06, 0.05, 0.05], 7.2);
    let worst = contact(79, [0.07, 0.06, 0.05], 24.0);
    let size = |(patch, nodes, share): ([usize; 3], usize, f64)| {
        let shrunk = |of: ContactLocality| contact(of.node, of.position_m, of.band_pct * share);
        PatchError { patch, nodes, contact: shrunk(here), worst: shrunk(worst) }
    };
    Locality {
        patch: [4, 4, 2],
        spacing_m: [0.01; 3],
        band_limit_pct: 20.0,
        reference_pct: 0.4,
        at_rest_limit_pct: 100.0,
        patch_bounds_m: [[0.01, 0.01, 0.02], [0.04, 0.04, 0.03]],
        band_hz: [10.0, 1000.0],
        faces: vec![
            face("z_max", ["x", "y"], [12, 12], |x, y| [x, y, 0.05]),
            face("x_max", ["y", "z"], [12, 6], |y, z| [0.11, y, z]),
        ],
        contact: here,
        sizes: [([4, 4, 2], 32, 1.0), ([6, 6, 3], 108, 0.4), ([8, 8, 4], 256, 0.15), ([10, 10, 6], 600, 0.03)]
            .map(size)
            .into(),
        bases: [(6, 4.0), (12, 0.9), (24, 0.2), (48, 0.01)]
            .map(|(states, error_pct)| BasisError { states, error_pct })
            .into(),
        budget: Some(Budget { error_pct: 0.5, patch: Some([10, 10, 6]), states: Some(24) }),
        measured: Some(MeasuredLocality {
            predicted_pct: 7.2,
            measured_pct: 6.0,
            predicted_at_rest_pct: 64.0,
            measured_at_rest_pct: 60.0,
        }),
        is_local: false,
        warnings: vec!["a stiff inclusion at (70, 60, 40) mm: use `predictive`, or a patch of 8 x 8 x 4 nodes".into()],
    }
}
