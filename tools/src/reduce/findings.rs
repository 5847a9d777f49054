//! What `palpate reduce` finds out, as plain data; the JSON document has these fields.

use serde::Serialize;

/// One invocation's results; what was not asked for is empty.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ReductionStudy {
    /// Name of the subject: `table1`, `fig4`, or a scene's file.
    pub subject: String,
    /// The paper's tables.
    pub tables: Vec<ReductionTable>,
    /// Frequency responses.
    pub responses: Vec<ResponseFigure>,
    /// The places at which the reduced states move the body.
    pub shapes: Vec<StateShapes>,
    /// Hankel singular values and what a truncation costs.
    pub hankel: Vec<HankelDecay>,
    /// When the scene's local model may be trusted.
    pub locality: Option<Locality>,
    /// Wall time of all of it (s).
    pub seconds: f64,
}

/// Rows of a table of the paper's, computed and published.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ReductionTable {
    /// Name of the table, such as `Table 1, 2D`.
    pub title: String,
    /// One row per mesh.
    pub rows: Vec<ReductionRow>,
}

/// A mesh, what reducing it costs in accuracy and in time, and what the paper says.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ReductionRow {
    /// Cells along each axis.
    pub cells: Vec<usize>,
    /// Damping ratio zeta.
    pub damping_ratio: f64,
    /// States of the full model.
    pub order: usize,
    /// States that were asked for.
    pub reduced_order: usize,
    /// States that were kept: fewer where the rest is below the numerical rank.
    pub states: usize,
    /// How it was reduced: `modal` (dense Gramians in closed form) or `rational Krylov` (low rank).
    pub method: String,
    /// 2 (sum of the Hankel singular values left out) / (sum of all), %.
    #[serde(rename = "error_percent")]
    pub error_pct: f64,
    /// Largest error of the frequency response over its largest gain, %.
    #[serde(rename = "hinf_percent")]
    pub hinf_pct: f64,
    /// The paper's published % error.
    #[serde(rename = "published_error_percent")]
    pub published_error_pct: f64,
    /// The paper's time (s), `None` where it gives none.
    #[serde(rename = "published_seconds")]
    pub published_s: Option<f64>,
    /// Wall time, assembly included (s).
    pub seconds: f64,
    /// True if every pole of the reduced model lies in the left half plane.
    #[serde(rename = "stable")]
    pub is_stable: bool,
}

/// Responses of several models over the same frequencies.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ResponseFigure {
    /// Title of the figure.
    pub title: String,
    /// Names of the channels, such as `tangential`: from a displacement along an axis to the force along it.
    pub channels: Vec<String>,
    /// Unit of the gains, such as `N/m`.
    pub unit: String,
    /// Frequencies (Hz); the first may be 0, for rest.
    #[serde(rename = "frequencies_hz")]
    pub hz: Vec<f64>,
    /// The models, the reference first.
    pub models: Vec<ModelResponse>,
}

/// The response of one model.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ModelResponse {
    /// Name of the model.
    pub name: String,
    /// Number of states of the model.
    pub order: usize,
    /// `[re, im]` for each channel and frequency.
    pub gains: Vec<Vec<[f64; 2]>>,
    /// Error at rest over all channels: norm of the difference over the norm of the reference, %; not a number if rest is not among the
    /// frequencies.
    #[serde(rename = "at_rest_error_percent")]
    pub at_rest_pct: f64,
    /// Error over all channels at the worst frequency above rest: norm of the difference over the norm of the reference, %; not a number if
    /// there is none.
    #[serde(rename = "worst_error_percent")]
    pub worst_pct: f64,
    /// Frequency of the worst error (Hz); not a number if there is none.
    pub worst_hz: f64,
    /// The error that the model itself estimates for its worst frequency, without the reference, in the same measure, %; `None` for
    /// the reference.
    #[serde(rename = "estimate_percent")]
    pub estimate_pct: Option<f64>,
    /// Wall time to make it (s).
    pub seconds: f64,
}

/// The places at which the states of a balanced model move the body.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct StateShapes {
    /// Title of the figure.
    pub title: String,
    /// Places of the nodes (m), z up; y = 0 in 2D.
    #[serde(rename = "nodes_m")]
    pub nodes: Vec<[f64; 3]>,
    /// The node that is moved (m).
    #[serde(rename = "input_m")]
    pub input: [f64; 3],
    /// True for the nodes of the local model.
    pub in_local: Vec<bool>,
    /// One entry per state, in the order of the Hankel singular values.
    pub states: Vec<StateShape>,
}

/// One balanced state.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct StateShape {
    /// Its Hankel singular value over the largest.
    pub hankel: f64,
    /// How far each node moves in it, over the node that moves most.
    pub amplitude: Vec<f64>,
    /// Share of the sum of squares of the displacements that the local model's nodes have.
    pub local_share: f64,
}

/// How the Hankel singular values of one system fall.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct HankelDecay {
    /// Name of the system.
    pub title: String,
    /// Number of states.
    pub order: usize,
    /// Hankel singular values, in decreasing order, those above the numerical rank.
    pub values: Vec<f64>,
    /// Unit of the values.
    pub unit: String,
    /// Errors of truncations, by their order.
    pub truncations: Vec<Truncation>,
}

/// A truncation of a balanced system.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Truncation {
    /// States kept.
    pub order: usize,
    /// 2 (sum of the Hankel singular values left out) / (sum of all), %.
    #[serde(rename = "error_percent")]
    pub error_pct: f64,
    /// Largest error of the frequency response over its largest gain, %.
    #[serde(rename = "hinf_percent")]
    pub hinf_pct: f64,
}

/// How much of the force response the patch of a local model captures, by contact.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Locality {
    /// Nodes of the patch along the surface, along it, into depth.
    pub patch: [usize; 3],
    /// Distance of neighbouring nodes along each axis of the body, the mean of its surface's edges for a mesh (m); zero if it is not known.
    pub spacing_m: [f64; 3],
    /// Least and largest frequency of what happens between resyncs (Hz).
    pub band_hz: [f64; 2],
    /// Largest error in the band at the contact for the patch to count as local (%).
    #[serde(rename = "band_limit_percent")]
    pub band_limit_pct: f64,
    /// Largest error at rest at the contact for the patch to count as local (%).
    #[serde(rename = "at_rest_limit_percent")]
    pub at_rest_limit_pct: f64,
    /// How far two models of the whole body, one twice as fine, are apart in the band at the contact (%): what the errors are uncertain by.
    #[serde(rename = "reference_percent")]
    pub reference_pct: f64,
    /// Ends of the patch at the contact, its outermost nodes along x, y and z (m).
    pub patch_bounds_m: [[f64; 3]; 2],
    /// One map per side of the body.
    pub faces: Vec<FaceMap>,
    /// At the contact that stands for the scene: where its tool touches first, else the middle of the top.
    pub contact: ContactLocality,
    /// Larger and smaller patches at the scene's contact and at the worst contact.
    pub sizes: Vec<PatchError>,
    /// Reduced surroundings (`predictive`) at the scene's contact by their number of states.
    pub bases: Vec<BasisError>,
    /// The patch and the states that an error budget needs, if one was given.
    pub budget: Option<Budget>,
    /// Predicted and measured, if it was measured.
    pub measured: Option<MeasuredLocality>,
    /// True if the paper's assumption holds: what the patch leaves out changes the force between resyncs by little.
    #[serde(rename = "local")]
    pub is_local: bool,
    /// Places where the assumption fails and what to do, in one line each.
    pub warnings: Vec<String>,
}

/// Contacts on a side of the body, row by row: a face of a block, or what is seen of another body from there.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct FaceMap {
    /// Name of the face, such as `z_max`.
    pub face: String,
    /// Names of the two axes along it, such as `x` and `y`.
    pub axes: [String; 2],
    /// Places along the first axis (m): of the nodes of a block, of the middles of a grid's cells over another body.
    pub first_m: Vec<f64>,
    /// Places along the second axis (m).
    pub second_m: Vec<f64>,
    /// Where the body ends along the two axes, from and to (m).
    pub ends_m: [[f64; 2]; 2],
    /// One entry for each pair, the first axis fastest; `None` where the node is held or there is none.
    pub contacts: Vec<Option<ContactLocality>>,
}

/// How much of the force response a patch captures at one contact. Errors are norms of the difference of the 3 x 3 dynamic
/// stiffnesses over the norm of the whole body's.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct ContactLocality {
    /// The node that the tool touches.
    pub node: u32,
    /// Place of the node at rest (m).
    pub position_m: [f64; 3],
    /// Stiffness of the whole body along the surface's normal at rest (N/m).
    pub stiffness_n_per_m: f64,
    /// Error of the patch at rest, %.
    #[serde(rename = "at_rest_error_percent")]
    pub at_rest_pct: f64,
    /// Error of the patch in the band, rms over the logarithm of the frequency, %.
    #[serde(rename = "band_error_percent")]
    pub band_pct: f64,
    /// The worst in the band, %.
    #[serde(rename = "worst_error_percent")]
    pub worst_pct: f64,
}

/// A patch's size and its errors.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct PatchError {
    /// Nodes along the surface, along it, into depth.
    pub patch: [usize; 3],
    /// Nodes that move in it.
    pub nodes: usize,
    /// At the scene's contact.
    pub contact: ContactLocality,
    /// At the worst contact of the map.
    #[serde(rename = "worst_contact")]
    pub worst: ContactLocality,
}

/// A number of states of the reduced surroundings and their error.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct BasisError {
    /// States r.
    pub states: usize,
    /// Error of the linear contact force against an imposed motion, %.
    #[serde(rename = "error_percent")]
    pub error_pct: f64,
}

/// The patch and the states that an error budget needs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Budget {
    /// The budget (%).
    #[serde(rename = "error_percent")]
    pub error_pct: f64,
    /// The smallest patch between held surroundings that meets it in the band, `None` if none does.
    pub patch: Option<[usize; 3]>,
    /// The smallest number of states of reduced surroundings, `None` if none meets it.
    pub states: Option<usize>,
}

/// The patch's error as predicted and as measured in the non-linear simulation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct MeasuredLocality {
    /// Predicted error in the band, %.
    #[serde(rename = "predicted_percent")]
    pub predicted_pct: f64,
    /// Measured with both models in the time domain, %.
    #[serde(rename = "measured_percent")]
    pub measured_pct: f64,
    /// Predicted error at rest, %.
    #[serde(rename = "predicted_at_rest_percent")]
    pub predicted_at_rest_pct: f64,
    /// Error at rest as measured with both models, %.
    #[serde(rename = "measured_at_rest_percent")]
    pub measured_at_rest_pct: f64,
}
