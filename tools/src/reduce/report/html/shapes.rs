//! Where the balanced states move the body: a small picture for each.

use std::collections::HashSet;
use std::fmt::Write;

use super::super::figures::{figure as number, percent};
use super::super::tables;
use crate::drawing::html::escaped;
use crate::drawing::svg::{Axis, HeatScale};
use crate::reduce::findings::{StateShape, StateShapes};

/// States that are drawn.
const STATES: usize = 12;
/// Drawn width of a cell.
const CELL: f64 = 10.0;

/// All shapes.
pub(super) fn shapes(all: &[StateShapes]) -> String {
    let mut out = String::new();
    if all.is_empty() {
        return out;
    }
    let scale = HeatScale::new(Axis::linear("displacement over that of the node that moves most", [0.0, 1.0]));
    out.push_str("<h2 id=\"shapes\">Where the states move the body</h2>\n");
    for shapes in all {
        let views = View::all(shapes);
        // Writing to a string cannot fail.
        let _ = writeln!(out, "<section>\n<h3>{}</h3>\n<div class=\"states\">", escaped(&shapes.title));
        for (at, state) in shapes.states.iter().take(STATES).enumerate() {
            out.push_str("<figure class=\"state\">\n");
            views.iter().for_each(|view| out.push_str(&view.to_svg(shapes, state, &scale, at + 1)));
            let _ = writeln!(
                out,
                "<figcaption>{}: sigma {},<br>{} local</figcaption></figure>",
                at + 1,
                number(state.hankel),
                percent(100.0 * state.local_share)
            );
        }
        let names: Vec<String> = views.iter().map(|view| view.name.clone()).collect();
        let _ = writeln!(
            out,
            "</div>\n<figure class=\"bar\">{}</figure>\n<p class=\"faint\">{}. Disc: the node that is moved; its cell has no \
             colour. Outline: the local model's nodes; local: their share of the sum of squares. Sigma: Hankel singular \
             value over the largest.</p>",
            scale.to_svg(),
            escaped(&names.join("; "))
        );
        let _ = writeln!(
            out,
            "<details><summary>In numbers</summary>\n{}</details>\n</section>",
            tables::shares(shapes).to_html()
        );
    }
    out
}

/// Nodes that lie in one plane.
struct View {
    name: String,
    /// The axes to the right and upwards.
    axes: [usize; 2],
    /// Index of each node, and its column and row from the lower left.
    nodes: Vec<(usize, [usize; 2])>,
    size: [usize; 2],
    /// Where the moved node is.
    input: [f64; 2],
    /// Height of a cell over its width.
    tall: f64,
}

impl View {
    /// The mesh itself in 2D; the top layer and the vertical slice through the moved node in 3D.
    fn all(shapes: &StateShapes) -> Vec<Self> {
        let spacing = [0, 1, 2].map(|axis| spacing(shapes, axis));
        let flat = match spacing {
            [_, _, None] => Some([0, 1]),
            [_, None, _] => Some([0, 2]),
            [None, _, _] => Some([1, 2]),
            _ => None,
        };
        if let Some(axes) = flat {
            let [right, up] = axes.map(|axis| ["x", "y", "z"][axis]);
            let name = format!("The mesh, {right} to the right, {up} upwards");
            return Self::new(shapes, name, axes, |_| true).into_iter().collect();
        }
        let top = shapes.nodes.iter().map(|node| node[2]).fold(shapes.input[2], f64::max);
        let is_top = |node: &[f64; 3]| node[2] > top - spacing[2].map_or(0.0, |high| 0.5 * high);
        let of_top = Self::new(shapes, "Above: the top layer, x to the right, y upwards".to_owned(), [0, 1], is_top);
        let half = spacing[1].map_or(f64::INFINITY, |deep| 0.5 * deep);
        let at = shapes.input[1];
        let name = format!("below: the vertical slice at y = {} mm, x to the right, z upwards", number(1e3 * at));
        let of_slice = Self::new(shapes, name, [0, 2], |node| (node[1] - at).abs() < half);
        of_top.into_iter().chain(of_slice).collect()
    }

    fn new(shapes: &StateShapes, name: String, axes: [usize; 2], is_in: impl Fn(&[f64; 3]) -> bool) -> Option<Self> {
        let steps = [spacing(shapes, axes[0])?, spacing(shapes, axes[1])?];
        let all = || shapes.nodes.iter().chain([&shapes.input]);
        let least = axes.map(|axis| all().map(|node| node[axis]).fold(f64::INFINITY, f64::min));
        let place = |node: &[f64; 3]| [0, 1].map(|at| (node[axes[at]] - least[at]) / steps[at]);
        let cell = |node: &[f64; 3]| place(node).map(|at| at.round() as usize);
        let nodes: Vec<(usize, [usize; 2])> = shapes
            .nodes
            .iter()
            .enumerate()
            .filter(|(_, node)| is_in(node))
            .map(|(at, node)| (at, cell(node)))
            .collect();
        let most = |at: usize| nodes.iter().map(|node| node.1[at]).max();
        let size = [most(0)? + 1, most(1)? + 1];
        Some(Self { name, axes, size, input: place(&shapes.input), tall: steps[1] / steps[0], nodes })
    }

    /// Left and top of a cell.
    fn corner(&self, [column, row]: [f64; 2]) -> (f64, f64) {
        (1.0 + CELL * column, 1.0 + CELL * self.tall * (self.size[1] as f64 - 1.0 - row))
    }

    fn to_svg(&self, shapes: &StateShapes, state: &StateShape, scale: &HeatScale, number: usize) -> String {
        let high = CELL * self.tall;
        let (width, height) = (CELL * self.size[0] as f64 + 2.0, high * self.size[1] as f64 + 2.0);
        let axes = self.axes.map(|axis| ["x", "y", "z"][axis]).join("-");
        let mut svg = format!(
            "<svg viewBox=\"0 0 {width:.1} {height:.1}\" role=\"img\" aria-label=\"state {number}, {axes}\">\n"
        );
        let _ = writeln!(
            svg,
            "<rect class=\"frame\" x=\"1\" y=\"1\" width=\"{:.1}\" height=\"{:.1}\"/>",
            width - 2.0,
            height - 2.0
        );
        // One path for each colour: a rectangle for each node would be ten times as long.
        let mut paths: Vec<(String, String)> = Vec::new();
        for (node, cell) in &self.nodes {
            let Some(amplitude) = state.amplitude.get(*node).filter(|amplitude| amplitude.is_finite()) else {
                continue;
            };
            let class = scale.class(*amplitude);
            let (x, y) = self.corner(cell.map(|at| at as f64));
            let cell = format!("M{x:.0} {y:.1}h{CELL}v{high:.1}h-{CELL}z");
            match paths.iter_mut().find(|(known, _)| *known == class) {
                Some((_, path)) => path.push_str(&cell),
                None => paths.push((class, cell)),
            }
        }
        for (class, path) in paths {
            let _ = writeln!(svg, "<path class=\"{class}\" d=\"{path}\"/>");
        }
        let outline = self.outline(shapes);
        let _ =
            writeln!(svg, "<path class=\"outline under\" d=\"{outline}\"/><path class=\"outline\" d=\"{outline}\"/>");
        let (x, y) = self.corner(self.input);
        let _ = writeln!(
            svg,
            "<circle class=\"here\" cx=\"{:.1}\" cy=\"{:.1}\" r=\"3\"/>\n</svg>",
            x + 0.5 * CELL,
            y + 0.5 * high
        );
        svg
    }

    /// Every edge between a cell of the local model and one that is not.
    fn outline(&self, shapes: &StateShapes) -> String {
        let is_local = |node: &usize| shapes.in_local.get(*node).copied().unwrap_or(false);
        let local = self.nodes.iter().filter(|(node, _)| is_local(node)).map(|(_, cell)| *cell);
        let mut cells: HashSet<[usize; 2]> = local.collect();
        if cells.is_empty() {
            return String::new();
        }
        // The moved node is the local model's, and no node of its own.
        cells.insert(self.input.map(|at| at.round().max(0.0) as usize));
        let has =
            |column: Option<usize>, row: Option<usize>| column.zip(row).is_some_and(|(c, r)| cells.contains(&[c, r]));
        let high = CELL * self.tall;
        let mut sorted: Vec<[usize; 2]> = cells.iter().copied().collect();
        sorted.sort_unstable();
        let mut path = String::new();
        for [column, row] in sorted {
            let (x, y) = self.corner([column as f64, row as f64]);
            if !has(column.checked_sub(1), Some(row)) {
                let _ = write!(path, "M{x:.0} {y:.1}v{high:.1}");
            }
            if !has(Some(column + 1), Some(row)) {
                let _ = write!(path, "M{:.0} {y:.1}v{high:.1}", x + CELL);
            }
            if !has(Some(column), Some(row + 1)) {
                let _ = write!(path, "M{x:.0} {y:.1}h{CELL}");
            }
            if !has(Some(column), row.checked_sub(1)) {
                let _ = write!(path, "M{x:.0} {:.1}h{CELL}", y + high);
            }
        }
        path
    }
}

/// The least distance of two nodes along an axis, `None` if all lie in one plane.
fn spacing(shapes: &StateShapes, axis: usize) -> Option<f64> {
    let mut places: Vec<f64> = shapes.nodes.iter().chain([&shapes.input]).map(|node| node[axis]).collect();
    places.sort_unstable_by(f64::total_cmp);
    let length = places.last()? - places.first()?;
    let steps = places.windows(2).map(|pair| pair[1] - pair[0]);
    // Nodes of one plane may differ by rounding.
    let least = steps.filter(|step| *step > 1e-6 * length).fold(f64::INFINITY, f64::min);
    least.is_finite().then_some(least)
}

#[cfg(test)]
mod tests {
    use super::super::super::sample::sample;
    use super::*;

    #[test]
    fn a_flat_mesh_has_one_view_and_a_block_has_two() {
        let study = sample();
        let flat = View::all(&study.shapes[0]);
        assert_eq!((flat.len(), flat[0].size, flat[0].nodes.len()), (1, [13, 13], 168));
        let block = View::all(&study.shapes[1]);
        // The same however it stands.
        let mut upright = study.shapes[0].clone();
        upright.nodes.iter_mut().chain([&mut upright.input]).for_each(|node| node.swap(1, 2));
        let views = View::all(&upright);
        assert_eq!((views.len(), views[0].axes, views[0].size), (1, [0, 2], [13, 13]));
        // The moved node is missing in both.
        assert_eq!(block.iter().map(|view| (view.size, view.nodes.len())).collect::<Vec<_>>(), [([6, 6], 35); 2]);
        let input = |view: &View| view.input.map(f64::round);
        assert_eq!((input(&block[0]), input(&block[1])), ([3.0, 3.0], [3.0, 5.0]));
    }

    #[test]
    fn every_node_is_a_cell_of_its_colour() {
        let study = sample();
        let html = shapes(&study.shapes);
        assert_eq!(html.matches("<figure class=\"state\">").count(), 2 * STATES);
        let first = html.split("<figure class=\"state\">").nth(1).unwrap();
        let cells: usize =
            first.lines().filter(|line| line.contains("class=\"q")).map(|line| line.matches('z').count()).sum();
        assert_eq!(cells, 168);
        assert!(first.contains("class=\"q17\"") && first.contains("class=\"q0\""), "{first}");
        assert!(html.contains("1: sigma 1.00,<br>90.0 % local"), "{html}");
    }

    #[test]
    fn the_outline_goes_around_the_local_nodes() {
        let study = sample();
        let view = &View::all(&study.shapes[0])[0];
        let path = view.outline(&study.shapes[0]);
        // Within 2.5 spacings of the middle of the top edge: rows of 5, 5 and 3 cells. Its edge is 5 + 5 and 3 + 3 and the top and
        // bottom of the steps.
        assert_eq!(path.matches('M').count(), 16, "{path}");
    }
}
