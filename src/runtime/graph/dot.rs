//! The picture of a graph in Graphviz's language.

use crate::graph::view::{GraphView, PortEnd};
use std::fmt::Write;

impl GraphView {
    /// The picture in Graphviz's language: a cluster per rate group, a node per actor, an edge per port.
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    pub fn to_dot(&self) -> String {
        of(self)
    }
}

/// A cluster per group, a node per actor, an edge per port; what nobody holds is drawn in red.
fn of(view: &GraphView) -> String {
    let mut dot = String::from(
        "digraph palpate {\n  rankdir=LR;\n  compound=true;\n  node [shape=box, style=rounded, fontname=\"sans-serif\"];\n  \
         edge [fontname=\"sans-serif\", fontsize=10];\n",
    );
    for (index, group) in view.groups.iter().enumerate() {
        let lines = [vec![group.name.clone(), group.contract()], group.figures()].concat();
        let style = if group.observer { "dashed" } else { "solid" };
        let _ = writeln!(dot, "  subgraph cluster_{index} {{\n    label={}; style={style};", quoted(&lines));
        // An edge needs a node, also in a group whose actor is not known.
        let _ = writeln!(dot, "    g{index} [shape=point, style=invis];");
        for (actor, name) in group.actors.iter().enumerate() {
            let _ = writeln!(dot, "    g{index}a{actor} [label={}];", quoted(std::slice::from_ref(name)));
        }
        dot.push_str("  }\n");
    }
    for (index, port) in view.ports.iter().enumerate() {
        let mut ends = Vec::new();
        for (side, end) in [("w", &port.from), ("r", &port.to)] {
            let colour = if *end == PortEnd::Nobody { "red" } else { "gray" };
            ends.push(match end {
                PortEnd::Group { group, actor: Some(actor) } => format!("g{group}a{actor}"),
                PortEnd::Group { group, actor: None } => format!("g{group}"),
                PortEnd::Outside(name) => {
                    let node = format!("o{}", outside(view, name));
                    let _ = writeln!(dot, "  {node} [label={}, shape=ellipse];", quoted(std::slice::from_ref(name)));
                    node
                }
                PortEnd::Unknown | PortEnd::Nobody => {
                    let node = format!("{side}{index}");
                    let _ = writeln!(dot, "  {node} [label={}, color={colour}];", quoted(&[view.in_words(end)]));
                    node
                }
            });
        }
        let mut label = vec![port.name.clone()];
        label.extend(view.elapsed.map(|_| port.traffic()));
        let _ = writeln!(dot, "  {} -> {} [label={}];", ends[0], ends[1], quoted(&label));
    }
    dot.push_str("}\n");
    dot
}

/// The number of the first port with an end of this name.
fn outside(view: &GraphView, name: &str) -> usize {
    let is = |end: &PortEnd| matches!(end, PortEnd::Outside(other) if other == name);
    view.ports.iter().position(|port| is(&port.from) || is(&port.to)).unwrap_or(0)
}

/// Lines as one quoted string. A backslash would begin one of Graphviz's escapes.
fn quoted(lines: &[String]) -> String {
    let lines: Vec<_> = lines.iter().map(|line| line.replace('\\', "\\\\").replace('"', "\\\"")).collect();
    format!("\"{}\"", lines.join("\\n"))
}
