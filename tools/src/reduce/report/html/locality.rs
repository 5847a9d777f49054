//! When the local model may be trusted: the verdict, the maps, and what a budget needs.

use std::fmt::Write;

use super::super::figures::{by, figure as number, hertz, percent};
use super::super::table::prose;
use super::super::{map, tables, words};
use super::{Curve, SIZE, figure, heights, with_points};
use crate::drawing::html::escaped;
use crate::drawing::svg::{Axis, Chart, HeatCell, HeatMap, HeatScale, Mark, power};
use crate::reduce::findings::{ContactLocality, FaceMap, Locality};

/// The least that the colours are spread over, from the largest error down.
const SPREAD: f64 = 10.0;
/// The most: what is less is as good as none.
const MOST_SPREAD: f64 = 1e4;

/// Is it local or not, where it fails, and the contact.
pub(super) fn verdict(locality: &Locality) -> String {
    let (class, badge) = match words::Extent::of(locality) {
        words::Extent::Throughout => ("good", "LOCAL"),
        // No green beside a large error at rest.
        words::Extent::BetweenResyncs => ("fair", "LOCAL BETWEEN RESYNCS"),
        words::Extent::None => ("bad", "NOT LOCAL"),
    };
    let mut out = format!(
        "<p class=\"lead {class}\"><span class=\"verdict\">{badge}</span> {}</p>\n",
        prose(&words::what_is_left_out(locality))
    );
    // Writing to a string cannot fail.
    for warning in &locality.warnings {
        let _ = writeln!(out, "<p class=\"note\"><strong>Warning:</strong> {}</p>", prose(warning));
    }
    let lines =
        [Some(words::contact(locality)), words::budget(locality), locality.measured.as_ref().map(words::measured)];
    for line in lines.into_iter().flatten() {
        let _ = writeln!(out, "<p>{}</p>", prose(&line));
    }
    out
}

/// The errors of the patch over the surface.
pub(super) fn maps(locality: &Locality) -> String {
    if locality.faces.is_empty() {
        return String::new();
    }
    let table = tables::percentiles(locality);
    let mut out = format!(
        "<h2 id=\"surface\">Over the surface</h2>\n<p class=\"faint\">{}</p>\n<h3>{}</h3>\n{}",
        prose(words::LOCALITY),
        escaped(&table.title),
        table.to_html()
    );
    let [low, high] = locality.band_hz.map(hertz);
    let between = format!("error (%), between resyncs ({low} to {high} Hz)");
    out.push_str(&chapter(locality, &between, |contact| contact.band_pct));
    out.push_str(&chapter(locality, "error (%), at rest", |contact| contact.at_rest_pct));
    let _ = writeln!(
        out,
        "<p class=\"faint\">One cell for each contact; its figures are read out where it is pointed at, and in <code>--json</code>. \
         Ring: the contact that stands for the scene. Outline: the size of the patch, {} nodes. Grey: held.</p>",
        by(&locality.patch)
    );
    out
}

/// The maps of one figure, all with the same colours.
fn chapter(locality: &Locality, label: &str, of: fn(&ContactLocality) -> f64) -> String {
    let contacts = locality.faces.iter().flat_map(|face| face.contacts.iter().flatten());
    let errors = contacts.map(of).filter(|error| error.is_finite() && *error > 0.0);
    let [least, most] = errors.fold([f64::INFINITY, 0.0], |[low, high], error| [error.min(low), error.max(high)]);
    if most == 0.0 {
        return String::new();
    }
    let scale =
        HeatScale::new(Axis::log(label, [least.clamp(most / MOST_SPREAD, most / SPREAD), most]).in_words(power));
    let mut out = format!("<section>\n<h3>{}</h3>\n<div class=\"charts\">\n", escaped(label));
    for face in map::faces(locality).into_iter().filter(|face| !face.first_m.is_empty() && !face.second_m.is_empty()) {
        out.push_str(&figure(&face_map(locality, face, &scale, of), ""));
    }
    let _ = writeln!(out, "</div>\n<figure class=\"bar\">{}</figure>\n</section>", scale.to_svg());
    out
}

fn face_map(locality: &Locality, face: &FaceMap, scale: &HeatScale, of: fn(&ContactLocality) -> f64) -> String {
    let [first, second] = [edges(&face.first_m, face.ends_m[0]), edges(&face.second_m, face.ends_m[1])];
    let mut cells = Vec::new();
    for (row, y) in second.windows(2).enumerate() {
        for (column, x) in first.windows(2).enumerate() {
            let contact = face.contacts.get(row * face.first_m.len() + column).and_then(Option::as_ref);
            cells.push(HeatCell {
                x: [x[0], x[1]],
                y: [y[0], y[1]],
                value: contact.map(of).filter(|value| value.is_finite()),
                words: contact.map_or("held, or no surface".to_owned(), in_words),
            });
        }
    }
    let ends = |edges: &[f64]| [edges[0], edges[edges.len() - 1]];
    let (across, up) = (ends(&first), ends(&second));
    let is_here = face.contacts.iter().flatten().any(|contact| contact.node == locality.contact.node);
    let axis = |name: &str| ["x", "y", "z"].iter().position(|known| *known == name);
    let at = |which: usize| axis(&face.axes[which]).map(|axis| (1e3 * locality.contact.position_m[axis], axis));
    let here = at(0).zip(at(1)).filter(|_| is_here);
    let outline = here.and_then(|((_, of_x), (_, of_y))| {
        // Half a distance beyond the outermost nodes, as the cells are drawn.
        let [low, high] = locality.patch_bounds_m;
        let side = |axis: usize, [from, to]: [f64; 2]| {
            let beyond = 0.5 * locality.spacing_m[axis];
            [(1e3 * (low[axis] - beyond)).max(from), (1e3 * (high[axis] + beyond)).min(to)]
        };
        let sides = [side(of_x, across), side(of_y, up)];
        sides.iter().all(|[from, to]| to > from).then_some(sides)
    });
    HeatMap {
        title: face.face.clone(),
        x: Axis::linear(&format!("{} (mm)", face.axes[0]), across),
        y: Axis::linear(&format!("{} (mm)", face.axes[1]), up),
        scale,
        cells,
        outline,
        mark: here.map(|((x, _), (y, _))| [x, y]),
    }
    .to_svg()
}

/// What a cell is, in one line.
fn in_words(contact: &ContactLocality) -> String {
    let [x, y, z] = contact.position_m.map(|m| number(1e3 * m));
    format!(
        "node {} at ({x}, {y}, {z}) mm: {} between resyncs, {} at the worst frequency there, {} at rest; {} N/m",
        contact.node,
        percent(contact.band_pct),
        percent(contact.worst_pct),
        percent(contact.at_rest_pct),
        number(contact.stiffness_n_per_m)
    )
}

/// Edges (mm) of the cells around `places` (m), one more than there are places, on a body that ends at `from` and `to`.
fn edges(places: &[f64], [from, to]: [f64; 2]) -> Vec<f64> {
    let middles = places.windows(2).map(|pair| 500.0 * (pair[0] + pair[1]));
    // A body without extent has a cell of a millimetre.
    let beyond = if from < to { 0.0 } else { 0.5 };
    [1e3 * from - beyond].into_iter().chain(middles).chain([1e3 * to + beyond]).collect()
}

/// What other sizes and what reduced surroundings would do.
pub(super) fn sizes(locality: &Locality) -> String {
    let mut out = String::new();
    if locality.sizes.is_empty() && locality.bases.is_empty() {
        return out;
    }
    out.push_str("<h2 id=\"sizes\">What a smaller error needs</h2>\n<div class=\"charts\">\n");
    let mut draw = |title: &str, x: Axis, curves: &[Curve<'_>], caption: &str| {
        let budget = locality.budget.map(|budget| budget.error_pct);
        let y = Axis::decades("error (%)", heights(curves).chain(budget));
        let mut chart = Chart::new(title, SIZE, x, y);
        chart.levels = budget.map(|at| Mark { at, label: "budget".to_owned() }).into_iter().collect();
        out.push_str(&with_points(chart, curves, caption));
    };
    if !locality.sizes.is_empty() {
        type Of = fn(&crate::reduce::findings::PatchError) -> f64;
        let by_nodes = |of: Of| {
            let mut points: Vec<(f64, f64)> = locality.sizes.iter().map(|size| (size.nodes as f64, of(size))).collect();
            points.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
            points.into_iter()
        };
        let curves = [
            Curve::new("contact, between resyncs", "c1", by_nodes(|size| size.contact.band_pct)),
            Curve::new("worst contact, between resyncs", "c2", by_nodes(|size| size.worst.band_pct)),
            Curve::new("contact, at rest", "c1", by_nodes(|size| size.contact.at_rest_pct)).hollow(),
            Curve::new("worst contact, at rest", "c2", by_nodes(|size| size.worst.at_rest_pct)).hollow(),
        ];
        let x = Axis::decades("nodes of the patch", locality.sizes.iter().map(|size| size.nodes as f64));
        draw("Size of the patch", x, &curves, "A patch between surroundings that are held.");
    }
    if !locality.bases.is_empty() {
        let points = locality.bases.iter().map(|basis| (basis.states as f64, basis.error_pct));
        let curves = [Curve::new("contact", "c3", points)];
        let x = Axis::decades("states r", locality.bases.iter().map(|basis| basis.states as f64));
        draw("Reduced surroundings", x, &curves, "The same patch between reduced surroundings: `predictive`.");
    }
    out.push_str("</div>\n");
    if !locality.sizes.is_empty() {
        let table = tables::sizes(locality);
        let _ = writeln!(out, "<h3>{}</h3>\n{}", escaped(&table.title), table.to_html());
    }
    if !locality.bases.is_empty() {
        let _ = writeln!(out, "<h3>Reduced surroundings</h3>\n{}", tables::bases(locality).to_html());
    }
    out
}

#[cfg(test)]
mod tests {
    use super::super::super::sample::sample;
    use super::*;

    #[test]
    fn cells_lie_around_their_contacts() {
        assert_eq!(edges(&[0.0, 0.01, 0.03], [0.0, 0.03]), [0.0, 5.0, 20.0, 30.0]);
        assert_eq!(edges(&[0.02], [0.02, 0.02]), [19.5, 20.5]);
        // The middles of cells, the last of which reaches beyond the body.
        assert_eq!(edges(&[0.005, 0.015, 0.025], [0.0, 0.0275]), [0.0, 10.0, 20.0, 27.5]);
    }

    #[test]
    fn a_large_error_at_rest_is_not_green() {
        let mut locality = sample().locality.unwrap();
        (locality.is_local, locality.contact.at_rest_pct) = (true, 68.0);
        assert!(!verdict(&locality).contains("good") && verdict(&locality).contains("LOCAL BETWEEN RESYNCS"));
        locality.contact.at_rest_pct = 5.0;
        assert!(verdict(&locality).contains("class=\"lead good\""));
    }

    #[test]
    fn every_contact_is_a_cell_with_its_figures() {
        let locality = sample().locality.unwrap();
        let maps = maps(&locality);
        assert_eq!(maps.matches("<rect class=\"cell ").count(), 2 * (144 + 72));
        assert_eq!(maps.matches("<rect class=\"cell none").count(), 2 * 12);
        assert!(maps.contains("node 79 at (70.0, 60.0, 50.0) mm: 24.0 % between resyncs"), "{maps}");
        // The ring and the outline of 4 x 4 nodes on the top alone.
        assert_eq!(maps.matches("class=\"here\"").count(), 2);
    }
}
