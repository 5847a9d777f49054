//! The report on a mesh as text and as JSON.

use palpate::model::Vec3;
use palpate::model::mesh::{MeshQuality, TetrahedralMesh};
use palpate::printable;
use palpate_mesh::SurfaceFindings;
use serde_json::{Value, json};

use super::step::{TISSUE, stable_step};

/// Parts that the text lists.
const LISTED: usize = 10;

/// The report on a mesh.
pub struct MeshReport {
    /// The file as it is shown.
    pub file: String,
    /// The file that was written.
    pub out: Option<String>,
    /// Elements of other kinds that were left out.
    pub left_out_elements: Vec<(String, usize)>,
    /// Nodes that no element uses and that were left out.
    pub left_out_nodes: usize,
    /// True if the file was inverted throughout.
    pub turned: bool,
    /// The surface that was filled.
    pub surface: Option<SurfaceReport>,
    mesh: TetrahedralMesh,
    quality: MeshQuality,
    /// The longest stable step (s), or why there is none.
    step: Result<f64, String>,
}

/// The surface that was filled.
pub struct SurfaceReport {
    /// Its volume (m^3).
    pub volume_m3: f64,
    /// Number of triangles.
    pub triangles: usize,
    /// What was found and changed.
    pub findings: SurfaceFindings,
}

impl MeshReport {
    /// On a cleaned mesh.
    pub fn of(mesh: TetrahedralMesh) -> Self {
        Self {
            file: String::new(),
            out: None,
            left_out_elements: Vec::new(),
            left_out_nodes: 0,
            turned: false,
            surface: None,
            quality: mesh.quality(),
            step: stable_step(mesh.clone()),
            mesh,
        }
    }

    /// The report for people.
    pub fn to_text(&self) -> String {
        let quality = &self.quality;
        let size = quality.extent() * 1e3;
        let mut lines = vec![
            self.file.clone(),
            format!(
                "mesh       {} nodes, {} elements, {:.1} x {:.1} x {:.1} mm, {:.3} ml",
                quality.nodes,
                quality.elements,
                size.x,
                size.y,
                size.z,
                quality.volume * 1e6
            ),
        ];
        if let Some(surface) = &self.surface {
            lines.push(surface.in_words(quality.volume));
        }
        lines.push(format!(
            "angles     {:.1} to {:.1} degrees between faces: element {} and {}",
            quality.smallest_angle_deg,
            quality.largest_angle_deg,
            self.named(quality.sharpest_element),
            self.named(quality.bluntest_element)
        ));
        lines.push(format!(
            "height     {:.3} mm at least: element {}",
            quality.smallest_height * 1e3,
            self.named(quality.flattest_element)
        ));
        lines.push(match &self.step {
            Ok(step) => format!("step       {:.3} ms at most, {}", step * 1e3, tissue()),
            Err(why) => format!("step       none, {}: {why}", tissue()),
        });
        let parts = self.mesh.parts();
        if parts.len() > 1 {
            let count = parts.len();
            lines.push(format!("parts      {count} that do not touch: a body needs each of them held"));
            lines.extend(parts.iter().take(LISTED).map(|part| {
                let middle = part.nodes.iter().map(|&node| self.mesh.points[node as usize]).sum::<Vec3>();
                let at = place(&(middle / part.nodes.len() as f64));
                format!("           {}: {} elements around {at}", part.name, part.tetrahedra.len())
            }));
        }
        for group in &self.mesh.groups {
            let (name, nodes) = (printable(&group.name), group.nodes.len());
            let elements = match group.tetrahedra.len() {
                0 => String::new(),
                elements => format!(", {elements} elements"),
            };
            lines.push(format!("group      {name}: {nodes} nodes{elements}"));
        }
        let others = self.left_out_elements.iter().map(|(kind, count)| format!("{count} {kind}"));
        let nodes = (self.left_out_nodes > 0).then(|| format!("{} nodes that no element uses", self.left_out_nodes));
        let left_out: Vec<String> = others.chain(nodes).collect();
        if !left_out.is_empty() {
            lines.push(format!("left out   {}", left_out.join(", ")));
        }
        if self.turned {
            lines.push("turned     all elements: the file is inverted throughout".to_owned());
        }
        if let Some(out) = &self.out {
            lines.push(format!("written    {out}"));
        }
        lines.join("\n") + "\n"
    }

    /// One document for programs.
    pub fn to_json(&self) -> Value {
        let quality = &self.quality;
        let array = |point: Vec3| <[f64; 3]>::from(point);
        let element = |number: u32| json!({ "element": number, "at_m": array(self.mesh.centroid(number)) });
        let parts = self.mesh.parts();
        json!({
            "file": self.file,
            "out": self.out,
            "nodes": quality.nodes,
            "elements": quality.elements,
            "volume_m3": quality.volume,
            "low_m": array(quality.low),
            "high_m": array(quality.high),
            "smallest_angle_deg": quality.smallest_angle_deg,
            "sharpest": element(quality.sharpest_element),
            "largest_angle_deg": quality.largest_angle_deg,
            "bluntest": element(quality.bluntest_element),
            "smallest_height_m": quality.smallest_height,
            "flattest": element(quality.flattest_element),
            "stable_step_s": self.step.as_ref().ok(),
            "no_step_because": self.step.as_ref().err(),
            "step_young_modulus_pa": TISSUE.young_modulus,
            "step_poisson_ratio": TISSUE.poisson_ratio,
            "parts": parts.iter().map(|part| part.tetrahedra.len()).collect::<Vec<_>>(),
            "groups": self.mesh.groups.iter().map(|group| {
                json!({ "name": group.name, "nodes": group.nodes.len(), "elements": group.tetrahedra.len() })
            }).collect::<Vec<_>>(),
            "left_out_elements": self.left_out_elements.iter().cloned().collect::<std::collections::BTreeMap<_, _>>(),
            "left_out_nodes": self.left_out_nodes,
            "turned": self.turned,
            "surface": self.surface.as_ref().map(SurfaceReport::to_json),
        })
    }

    fn named(&self, element: u32) -> String {
        format!("{element} at {}", place(&self.mesh.centroid(element)))
    }
}

impl SurfaceReport {
    fn in_words(&self, filled: f64) -> String {
        let findings = &self.findings;
        let difference = 100.0 * (filled / self.volume_m3 - 1.0);
        let parts = match findings.parts.len() {
            1 => String::new(),
            parts => format!(", {parts} parts"),
        };
        let changed = [(findings.turned_triangles, "turned round"), (findings.left_out_triangles, "left out")];
        let changed = changed.iter().filter(|(count, _)| *count > 0).map(|(count, how)| format!(", {count} {how}"));
        format!(
            "surface    {} triangles{parts}{}, {:.3} ml: the mesh has {difference:+.2} %",
            self.triangles,
            changed.collect::<String>(),
            self.volume_m3 * 1e6
        )
    }

    fn to_json(&self) -> Value {
        json!({
            "triangles": self.triangles,
            "volume_m3": self.volume_m3,
            "parts": self.findings.parts.len(),
            "turned_triangles": self.findings.turned_triangles,
            "left_out_triangles": self.findings.left_out_triangles,
        })
    }
}

/// What the step is told for.
fn tissue() -> String {
    let (kpa, nu) = (TISSUE.young_modulus * 1e-3, TISSUE.poisson_ratio);
    format!("for liver of {kpa} kPa, Poisson's ratio {nu}, nodal pressure")
}

fn place(point: &Vec3) -> String {
    format!("({:.1}, {:.1}, {:.1}) mm", point.x * 1e3, point.y * 1e3, point.z * 1e3)
}
