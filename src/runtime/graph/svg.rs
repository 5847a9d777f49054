//! The picture of a graph as a drawing: columns of boxes, and between them the ports with their names.

use crate::graph::layout::{apart, columns};
use crate::graph::view::{GraphPort, GraphView, PortEnd};
use std::collections::BTreeMap;
use std::fmt::Write;

/// Pixels around everything, between two boxes of a column, and of a line of text.
const MARGIN: f64 = 28.0;
const BETWEEN: f64 = 34.0;
const LINE: f64 = 17.0;
/// Height of an actor's box with the room above it.
const ACTOR: f64 = 34.0;
/// Beside the labels between two columns: for the curves.
const BEND: f64 = 48.0;
/// An actor's arrows leave it above its middle and reach it below.
const APART: f64 = 6.0;
/// From one label to the next.
const LABEL: f64 = 40.0;

/// A box of the drawing: a group or a place outside.
struct Node {
    title: String,
    lines: Vec<String>,
    actors: Vec<String>,
    /// Ports between its own actors: drawn in it.
    inner: Vec<usize>,
    class: &'static str,
    x: f64,
    y: f64,
    width: f64,
    height: f64,
}

/// An arrow: from and to a box, and the actor in it.
struct Edge {
    from: (usize, Option<usize>),
    to: (usize, Option<usize>),
    label: [String; 2],
}

/// The width of a text, about: no font is asked.
fn width_of(text: &str, size: f64) -> f64 {
    0.56 * size * text.chars().count() as f64
}

impl Node {
    fn new(title: String, lines: Vec<String>, actors: Vec<String>, class: &'static str) -> Self {
        Self { title, lines, actors, inner: Vec::new(), class, x: 0.0, y: 0.0, width: 0.0, height: 0.0 }
    }

    fn size(&mut self, edges: &[Edge]) {
        let lines = self.lines.iter().map(|line| width_of(line, 12.0));
        let inner = self.inner.iter().flat_map(|edge| &edges[*edge].label).map(|line| width_of(line, 11.0));
        let inner = inner.fold(0.0, f64::max);
        let actors = self.actors_width() + if self.inner.is_empty() { 0.0 } else { inner + 40.0 };
        let widest = lines.chain([width_of(&self.title, 15.0), actors]).fold(0.0, f64::max);
        self.width = widest + 28.0;
        // Labels of inner ports stand below one another.
        let rows = (self.actors.len() as f64 * ACTOR).max(self.inner.len() as f64 * LABEL);
        self.height = self.head() + rows + if self.actors.is_empty() { 0.0 } else { 10.0 };
    }

    fn actors_width(&self) -> f64 {
        self.actors.iter().map(|actor| width_of(actor, 13.0) + 22.0).fold(0.0, f64::max)
    }

    /// Height of the part above the actors.
    fn head(&self) -> f64 {
        32.0 + LINE * self.lines.len() as f64
    }

    /// The middle of an actor, or of the title.
    fn port_y(&self, actor: Option<usize>) -> f64 {
        let row = actor.filter(|actor| *actor < self.actors.len());
        self.y + row.map_or(18.0, |actor| self.head() + actor as f64 * ACTOR + ACTOR / 2.0)
    }
}

fn nodes(view: &GraphView) -> (Vec<Node>, Vec<Edge>) {
    let mut nodes = Vec::new();
    for group in &view.groups {
        let mut lines: Vec<String> = group.contract().split(", ").map(str::to_owned).collect();
        // Rate and policy in one line.
        lines.splice(..2, [lines[..2].join(", ")]);
        lines.extend(group.figures());
        let late = group.measured.as_ref().is_some_and(|live| live.skipped + live.missed > 0);
        let class = match (group.observer, late) {
            (true, _) => "observer",
            (false, true) => "group late",
            (false, false) => "group",
        };
        nodes.push(Node::new(group.name.clone(), lines, group.actors.clone(), class));
    }
    let mut outside = BTreeMap::new();
    let mut edges: Vec<Edge> = Vec::new();
    for port in &view.ports {
        let mut end = |end: &PortEnd| match end {
            PortEnd::Group { group, actor } => Some((*group, *actor)),
            PortEnd::Outside(name) => {
                let index = *outside.entry(name.clone()).or_insert_with(|| {
                    nodes.push(Node::new(name.clone(), Vec::new(), Vec::new(), "outside"));
                    nodes.len() - 1
                });
                Some((index, None))
            }
            PortEnd::Unknown | PortEnd::Nobody => None,
        };
        if let (Some(from), Some(to)) = (end(&port.from), end(&port.to)) {
            let traffic =
                view.elapsed.map_or_else(|| format!("{} of {}", port.kind.name(), port.carries), |_| port.traffic());
            edges.push(Edge { from, to, label: [port.name.clone(), traffic] });
        }
    }
    for (index, edge) in edges.iter().enumerate().filter(|(_, edge)| edge.from.0 == edge.to.0) {
        nodes[edge.from.0].inner.push(index);
    }
    nodes.iter_mut().for_each(|node| node.size(&edges));
    (nodes, edges)
}

/// The boxes of each column, from top to bottom: each near those that it is connected with in the column before.
fn ordered(columns: &[usize], edges: &[Edge]) -> Vec<Vec<usize>> {
    let count = columns.iter().max().map_or(0, |last| last + 1);
    let mut ordered: Vec<Vec<usize>> = Vec::new();
    for column in 0..count {
        let mut nodes: Vec<usize> = (0..columns.len()).filter(|node| columns[*node] == column).collect();
        if let Some(before) = ordered.last() {
            let place = |node: usize| {
                let of = |edge: &Edge| match (edge.from.0, edge.to.0) {
                    (from, to) if to == node => before.iter().position(|other| *other == from),
                    (from, to) if from == node => before.iter().position(|other| *other == to),
                    _ => None,
                };
                let places: Vec<usize> = edges.iter().filter_map(of).collect();
                if places.is_empty() { f64::MAX } else { places.iter().sum::<usize>() as f64 / places.len() as f64 }
            };
            nodes.sort_by(|a, b| place(*a).total_cmp(&place(*b)));
        }
        ordered.push(nodes);
    }
    ordered
}

impl GraphView {
    /// The picture as a drawing: a box per rate group with its actors, arrows from left to right for what goes forward
    /// and from right to left for what comes back.
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    pub fn to_svg(&self) -> String {
        of(self)
    }
}

fn of(view: &GraphView) -> String {
    let (mut nodes, edges) = nodes(view);
    let pairs: Vec<_> = edges.iter().map(|edge| (edge.from.0, edge.to.0)).collect();
    let column = columns(nodes.len(), &pairs);
    let ordered = ordered(&column, &edges);
    // The gap that an edge between neighbours crosses.
    let gap_of = |edge: &Edge| {
        let (from, to) = (column[edge.from.0], column[edge.to.0]);
        (from.abs_diff(to) == 1).then_some(from.min(to))
    };
    let label_width = |edge: &Edge| edge.label.iter().map(|line| width_of(line, 11.0)).fold(0.0, f64::max);
    let crossing = |gap: usize| edges.iter().filter(move |edge| gap_of(edge) == Some(gap));
    let height_of = |nodes: &[Node], column: &[usize]| {
        column.iter().map(|node| nodes[*node].height + BETWEEN).sum::<f64>() - BETWEEN
    };
    let tall = ordered.iter().map(|column| height_of(&nodes, column)).fold(0.0, f64::max);
    let labels = (0..ordered.len()).map(|gap| crossing(gap).count() as f64 * LABEL).fold(0.0, f64::max);
    let tall = tall.max(labels);
    let (mut x, mut lefts) = (MARGIN, Vec::new());
    for (index, members) in ordered.iter().enumerate() {
        let width = members.iter().map(|node| nodes[*node].width).fold(0.0, f64::max);
        let mut y = MARGIN + (tall - height_of(&nodes, members)) / 2.0;
        for &node in members {
            // All boxes of a column are as wide as the widest.
            (nodes[node].x, nodes[node].y, nodes[node].width) = (x, y, width);
            y += nodes[node].height + BETWEEN;
        }
        lefts.push(x);
        x += width;
        if index + 1 < ordered.len() {
            x += crossing(index).map(label_width).fold(30.0, f64::max) + 2.0 * BEND;
        }
    }
    let width = x + MARGIN;
    let mut arrows = String::new();
    for gap in 0..ordered.len() {
        draw_gap(&mut arrows, &nodes, &crossing(gap).collect::<Vec<_>>(), label_width);
    }
    let mut y = MARGIN + tall + LABEL;
    for edge in edges.iter().filter(|edge| edge.from.0 != edge.to.0 && gap_of(edge).is_none()) {
        draw_long(&mut arrows, &nodes, edge, y);
        y += LABEL;
    }
    let mut boxes = String::new();
    for node in &nodes {
        draw_box(&mut boxes, node, &edges);
    }
    let unknown = |port: &&GraphPort| matches!(port.from, PortEnd::Unknown) || matches!(port.to, PortEnd::Unknown);
    let mut notes = view.warnings.clone();
    match view.ports.iter().filter(unknown).count() {
        0 => {}
        count => notes.push(format!(
            "{count} ports whose ends are not declared are not drawn; they are once they have been used"
        )),
    }
    for note in &notes {
        text(&mut boxes, "note", MARGIN, y, note);
        y += LINE;
    }
    let width = notes.iter().map(|note| width_of(note, 12.0) + 2.0 * MARGIN).fold(width, f64::max);
    format!("{}{arrows}{boxes}</svg>\n", head(width, y + MARGIN - LINE))
}

/// Arrows between neighbouring columns: each passes below its label.
fn draw_gap(svg: &mut String, nodes: &[Node], edges: &[&Edge], label_width: impl Fn(&Edge) -> f64) {
    let ends = |edge: &Edge| {
        let (from, to) = (&nodes[edge.from.0], &nodes[edge.to.0]);
        let right = from.x < to.x;
        let (x1, x2) = if right { (from.x + from.width, to.x) } else { (from.x, to.x + to.width) };
        (x1, from.port_y(edge.from.1) - APART, x2, to.port_y(edge.to.1) + APART)
    };
    let wanted: Vec<f64> = edges.iter().map(|edge| ends(edge)).map(|(_, y1, _, y2)| (y1 + y2) / 2.0).collect();
    for (edge, y) in edges.iter().zip(apart(&wanted, LABEL, MARGIN + LINE)) {
        let (x1, y1, x2, y2) = ends(edge);
        let (middle, side) = ((x1 + x2) / 2.0, (x2 - x1).signum());
        let half = side * label_width(edge) / 2.0;
        let (a, b) = (middle - half, middle + half);
        let (c1, c2) = ((x1 + a) / 2.0, (b + x2) / 2.0);
        let path = format!(
            "M{x1:.1} {y1:.1}C{c1:.1} {y1:.1} {c1:.1} {y:.1} {a:.1} {y:.1}L{b:.1} {y:.1}C{c2:.1} {y:.1} {c2:.1} {y2:.1} {x2:.1} {y2:.1}"
        );
        arrow(svg, &path, middle, y, edge);
    }
}

/// An arrow past other columns: below them all, at height `y`.
fn draw_long(svg: &mut String, nodes: &[Node], edge: &Edge, y: f64) {
    let (from, to) = (&nodes[edge.from.0], &nodes[edge.to.0]);
    let right = from.x < to.x;
    let side = if right { 1.0 } else { -1.0 };
    let (x1, x2) = if right { (from.x + from.width, to.x) } else { (from.x, to.x + to.width) };
    let (y1, y2) = (from.port_y(edge.from.1) - APART, to.port_y(edge.to.1) + APART);
    // Down and up beside the boxes; rounded corners.
    let (a, b, r) = (x1 + side * 20.0, x2 - side * 26.0, 8.0);
    let s = side * r;
    let path = format!(
        "M{x1:.1} {y1:.1}L{:.1} {y1:.1}Q{a:.1} {y1:.1} {a:.1} {:.1}L{a:.1} {:.1}Q{a:.1} {y:.1} {:.1} {y:.1}L{:.1} {y:.1}Q{b:.1} {y:.1} {b:.1} {:.1}L{b:.1} {:.1}Q{b:.1} {y2:.1} {:.1} {y2:.1}L{x2:.1} {y2:.1}",
        a - s,
        y1 + r,
        y - r,
        a + s,
        b - s,
        y - r,
        y2 + r,
        b + s
    );
    arrow(svg, &path, (a + b) / 2.0, y, edge);
}

fn arrow(svg: &mut String, path: &str, x: f64, y: f64, edge: &Edge) {
    let _ = writeln!(svg, "<path class=\"port\" d=\"{path}\"/>");
    text(svg, "label name", x, y - 5.0, &edge.label[0]);
    text(svg, "label", x, y + 13.0, &edge.label[1]);
}

fn draw_box(svg: &mut String, node: &Node, edges: &[Edge]) {
    let Node { x, y, width, height, class, .. } = node;
    let _ = writeln!(
        svg,
        "<rect class=\"{class}\" x=\"{x:.1}\" y=\"{y:.1}\" width=\"{width:.1}\" height=\"{height:.1}\" rx=\"8\"/>"
    );
    text(svg, "title", x + 14.0, y + 22.0, &node.title);
    for (row, line) in node.lines.iter().enumerate() {
        text(svg, "line", x + 14.0, y + 40.0 + LINE * row as f64, line);
    }
    let inner = if node.inner.is_empty() { width - 28.0 } else { node.actors_width() };
    for (row, actor) in node.actors.iter().enumerate() {
        let top = y + node.head() + ACTOR * row as f64 + 4.0;
        let _ = writeln!(
            svg,
            "<rect class=\"actor\" x=\"{:.1}\" y=\"{top:.1}\" width=\"{inner:.1}\" height=\"26\" rx=\"5\"/>",
            x + 14.0
        );
        text(svg, "name", x + 25.0, top + 17.5, actor);
    }
    for (row, edge) in node.inner.iter().map(|edge| &edges[*edge]).enumerate() {
        let (y1, y2) = (node.port_y(edge.from.1), node.port_y(edge.to.1));
        let (left, out) = (x + 14.0 + inner, x + 14.0 + inner + 22.0);
        let y1 = if y1 == y2 { y1 - 6.0 } else { y1 };
        let _ = writeln!(
            svg,
            "<path class=\"port\" d=\"M{left:.1} {y1:.1}C{out:.1} {y1:.1} {out:.1} {y2:.1} {left:.1} {y2:.1}\"/>"
        );
        let middle = y + node.head() + row as f64 * LABEL + 16.0;
        text(svg, "inner name", out + 4.0, middle, &edge.label[0]);
        text(svg, "inner", out + 4.0, middle + 14.0, &edge.label[1]);
    }
}

fn text(svg: &mut String, class: &str, x: f64, y: f64, text: &str) {
    let text = text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;");
    // XML has no other control characters.
    let text: String = text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    let _ = writeln!(svg, "<text class=\"{class}\" x=\"{x:.1}\" y=\"{y:.1}\">{text}</text>");
}

fn head(width: f64, height: f64) -> String {
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width:.0}\" height=\"{height:.0}\" viewBox=\"0 0 {width:.0} {height:.0}\">\n\
         <defs><marker id=\"tip\" viewBox=\"0 0 10 10\" refX=\"9\" refY=\"5\" markerWidth=\"8\" markerHeight=\"8\" orient=\"auto\">\
         <path d=\"M0 1L9 5L0 9Z\" fill=\"#5a6b82\"/></marker></defs>\n\
         <style>\n\
         text {{ font-family: system-ui, 'Helvetica Neue', Arial, sans-serif; fill: #1d2733; }}\n\
         .title {{ font-size: 15px; font-weight: 600; }}\n\
         .line {{ font-size: 12px; fill: #52606f; }}\n\
         .name {{ font-size: 13px; }}\n\
         .label, .inner {{ font-size: 11px; fill: #52606f; }}\n\
         .label {{ text-anchor: middle; }}\n\
         .label.name, .inner.name {{ font-size: 11px; font-weight: 600; fill: #1d2733; }}\n\
         .note {{ font-size: 12px; fill: #a33b2a; }}\n\
         rect {{ stroke: #8797ab; stroke-width: 1.2; fill: #eef3fa; }}\n\
         .late {{ stroke: #c2573f; fill: #fdf1ee; }}\n\
         .observer {{ stroke-dasharray: 5 4; fill: #f6f7f9; }}\n\
         .outside {{ fill: #fff; stroke-dasharray: 2 3; }}\n\
         .actor {{ fill: #fff; }}\n\
         .port {{ fill: none; stroke: #5a6b82; stroke-width: 1.4; marker-end: url(#tip); }}\n\
         .page {{ fill: #fff; stroke: none; }}\n\
         </style>\n\
         <rect class=\"page\" width=\"100%\" height=\"100%\"/>\n"
    )
}
