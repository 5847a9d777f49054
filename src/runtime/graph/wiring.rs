//! What is known of a graph's ports: names and ends as declared, who holds the halves, and who used them.

use crate::error::GraphError;
use crate::executor::Execution;
use crate::graph::view::{GraphPort, GraphView, PortEnd, PortKind};
use crate::group::group_run::GroupRun;
use crate::ports::port_traffic::{Sides, Traffic};
use crate::rate_group::RateGroup;

/// A name and two ends, as declared.
#[derive(Debug)]
struct Link {
    name: String,
    from: String,
    to: String,
}

#[derive(Debug)]
struct Port {
    link: Option<Link>,
    kind: PortKind,
    carries: String,
    sides: Sides,
    /// As declared, and as found when the graph was built.
    ends: [PortEnd; 2],
}

/// All ports of a graph, and the actors that they may belong to.
#[derive(Debug, Default)]
pub(crate) struct Wiring {
    ports: Vec<Port>,
    /// For the port that is made next.
    pending: Option<Link>,
    /// Links that were declared one after the other without a port between them.
    unused: Option<String>,
    /// The names of each group's actors.
    actors: Vec<Vec<String>>,
}

impl Wiring {
    pub(crate) fn link(&mut self, name: String, from: String, to: String) {
        let before = self.pending.replace(Link { name, from, to });
        self.unused = self.unused.take().or(before.map(|link| link.name));
    }

    pub(crate) fn add<T>(&mut self, kind: PortKind, sides: &Sides) {
        let carries = without_paths(std::any::type_name::<T>());
        let ends = [PortEnd::Unknown, PortEnd::Unknown];
        self.ports.push(Port { link: self.pending.take(), kind, carries, sides: sides.clone(), ends });
    }

    /// Finds the declared ends among the groups and notes which halves nobody holds.
    ///
    /// # Errors
    /// [`GraphErrorKind::Refused`](crate::GraphErrorKind::Refused) for a link whose end is not in the graph or could be
    /// several actors, for two links of one name, and for a link without a port.
    pub(crate) fn close(&mut self, groups: &[GroupRun]) -> Result<(), GraphError> {
        self.actors = groups.iter().map(GroupRun::actor_names).collect();
        if let Some(name) = self.unused.take().or(self.pending.take().map(|link| link.name)) {
            let wrong = "names no port; make the port right after it, or leave it out";
            return Err(GraphError::refused(format!("link `{name}` {wrong}")));
        }
        let names: Vec<&str> = groups.iter().map(|group| group.spec.name.as_str()).collect();
        for index in 0..self.ports.len() {
            let name = self.name(index);
            if (0..index).any(|earlier| self.name(earlier) == name) {
                return Err(GraphError::refused(format!("two ports are called `{name}`; give each its own name")));
            }
            let port = &self.ports[index];
            let [from, to] = match &port.link {
                None => match port.kind {
                    PortKind::Outlet => [PortEnd::Unknown, outside()],
                    PortKind::Parameter | PortKind::Commands => [outside(), PortEnd::Unknown],
                    PortKind::Exchange | PortKind::Queue => [PortEnd::Unknown, PortEnd::Unknown],
                },
                Some(link) => {
                    let place = |end: &str| self.find(&names, end).map_err(|error| error.at(format!("link `{name}`")));
                    match port.kind {
                        PortKind::Outlet => [place(&link.from)?, PortEnd::Outside(link.to.clone())],
                        PortKind::Parameter | PortKind::Commands => {
                            [PortEnd::Outside(link.from.clone()), place(&link.to)?]
                        }
                        PortKind::Exchange | PortKind::Queue => [place(&link.from)?, place(&link.to)?],
                    }
                }
            };
            let held = |held: bool, end| if held { end } else { PortEnd::Nobody };
            let ends = [held(port.sides.writer.is_held(), from), held(port.sides.reader.is_held(), to)];
            self.ports[index].ends = ends;
        }
        Ok(())
    }

    /// The place of `group/actor`, of an actor, or of a group.
    fn find(&self, groups: &[&str], end: &str) -> Result<PortEnd, GraphError> {
        let mut found = Vec::new();
        for (group, (name, actors)) in groups.iter().zip(&self.actors).enumerate() {
            let is = |actor: &String| {
                actor == end || end.strip_prefix(name).and_then(|e| e.strip_prefix('/')) == Some(actor)
            };
            found.extend(actors.iter().enumerate().filter(|(_, a)| is(a)).map(|(actor, _)| (group, Some(actor))));
        }
        if found.is_empty() {
            found.extend(groups.iter().position(|name| *name == end).map(|group| (group, None)));
        }
        match found[..] {
            [(group, actor)] => Ok(PortEnd::Group { group, actor }),
            [] => {
                let all = groups
                    .iter()
                    .zip(&self.actors)
                    .flat_map(|(group, actors)| actors.iter().map(move |actor| format!("{group}/{actor}")));
                let all = all.collect::<Vec<_>>().join(", ");
                Err(GraphError::refused(format!("`{end}` is no actor and no rate group; there are {all}")))
            }
            _ => Err(GraphError::refused(format!("several actors are called `{end}`; write group/actor"))),
        }
    }

    fn name(&self, index: usize) -> String {
        self.ports[index].link.as_ref().map_or_else(|| format!("port-{index}"), |link| link.name.clone())
    }

    /// The picture, with what has gone through the ports so far.
    pub(crate) fn view(&self, execution: Execution, groups: &[RateGroup]) -> GraphView {
        let mut view = GraphView::of_groups(execution, groups);
        for (group, actors) in view.groups.iter_mut().zip(&self.actors) {
            group.actors.clone_from(actors);
        }
        for (index, port) in self.ports.iter().enumerate() {
            let name = self.name(index);
            let (sent, taken) = (port.sides.writer.traffic(), port.sides.reader.traffic());
            for (end, (does, traffic)) in port.ends.iter().zip([("writes", &sent), ("reads", &taken)]) {
                if *end == PortEnd::Nobody {
                    view.warnings.push(format!(
                        "port `{name}`: nobody {does} it; give its half to an actor, or leave the port out"
                    ));
                }
                if contradicts(end, traffic) {
                    let (declared, used) = (view.in_words(end), view.in_words(&seen(traffic)));
                    view.warnings.push(format!("port `{name}`: `{used}` {does} it, not `{declared}` as its link says"));
                }
            }
            view.ports.push(GraphPort {
                name,
                kind: port.kind,
                carries: port.carries.clone(),
                from: in_force(&port.ends[0], &sent),
                to: in_force(&port.ends[1], &taken),
                sent: sent.passed,
                taken: taken.passed,
                dropped: sent.dropped,
            });
        }
        view
    }
}

fn outside() -> PortEnd {
    PortEnd::Outside("outside".to_owned())
}

fn seen(traffic: &Traffic) -> PortEnd {
    traffic.place.map_or(PortEnd::Unknown, |(group, actor)| PortEnd::Group { group, actor: Some(actor) })
}

/// Where the end is: what was seen is truer than what was declared.
fn in_force(declared: &PortEnd, traffic: &Traffic) -> PortEnd {
    match seen(traffic) {
        PortEnd::Unknown => declared.clone(),
        seen => seen,
    }
}

fn contradicts(declared: &PortEnd, traffic: &Traffic) -> bool {
    let (PortEnd::Group { group, actor }, Some((used, by))) = (declared, traffic.place) else { return false };
    *group != used || actor.is_some_and(|actor| actor != by)
}

/// A type's name without the paths in it.
fn without_paths(name: &str) -> String {
    let mut short = String::new();
    for part in name.split_inclusive(|c: char| !(c.is_alphanumeric() || c == '_' || c == ':')) {
        short.push_str(part.rsplit("::").next().unwrap_or(part));
    }
    short
}

#[cfg(all(test, not(loom)))]
mod tests {
    use super::*;

    #[test]
    fn the_name_of_a_type_is_shown_without_its_paths() {
        assert_eq!(without_paths(std::any::type_name::<Vec<Option<RateGroup>>>()), "Vec<Option<RateGroup>>");
        assert_eq!(without_paths(std::any::type_name::<[f64; 3]>()), "[f64; 3]");
        assert_eq!(without_paths("(a::b::C, &[d::E])"), "(C, &[E])");
    }
}
