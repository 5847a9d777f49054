//! The sections of version 2.2.

use std::collections::HashMap;

use super::Reading;
use super::elements::element_type;
use crate::error::MeshError;
use crate::files::collected::TETRAHEDRON;
use crate::files::number::Number;
use crate::files::source::{Encoding, Source};

const INT: Number = Number::Int32;

/// The nodes.
pub fn nodes(source: &mut Source, reading: &mut Reading) -> Result<(), MeshError> {
    let count: usize = source.parse("the number of nodes")?;
    after_count(source);
    for _ in 0..count {
        let tag = source.integer(INT, "the tag of a node")?;
        let place = source.floats(Number::Float64, 3, "a coordinate of a node")?;
        reading.add_node(tag, [place[0], place[1], place[2]]).map_err(|error| source.error(error))?;
    }
    Ok(())
}

/// The elements: in binary in blocks of one type.
pub fn elements(source: &mut Source, reading: &mut Reading) -> Result<(), MeshError> {
    let count: usize = source.parse("the number of elements")?;
    after_count(source);
    let is_text = source.encoding == Encoding::Text;
    let mut known = HashMap::new();
    let mut nodes = Vec::new();
    let mut read = 0;
    while read < count {
        // In ASCII each element is a block of its own, its tag in front and the number of those that follow left out.
        if is_text {
            source.integer(INT, "the tag of an element")?;
        }
        let number = source.integer(INT, "the type of an element")?;
        let Some((corners, kind)) = element_type(number) else {
            return Err(source.error(format_args!("elements of Gmsh's type {number} are not known")));
        };
        let follow = if is_text { 1 } else { source.count(INT, "number of elements")? };
        if follow == 0 || follow > count - read {
            return Err(source.error(format_args!("{follow} elements follow, {} should", count - read)));
        }
        let tags = source.count(INT, "number of tags")?;
        for _ in 0..follow {
            if !is_text {
                source.integer(INT, "the tag of an element")?;
            }
            let tags = source.integers(INT, tags, "a tag of an element")?;
            let element = source.integers(INT, corners, "the tag of a node of an element")?;
            reading.indices(&element, &mut nodes).map_err(|error| source.error(error))?;
            // The first tag is the physical group, 0 if there is none.
            let physical = tags.first().filter(|tag| **tag != 0);
            let dimension = dimension_of(kind);
            let group = physical.map(|tag| reading.group(dimension, *tag)).transpose();
            let group = group.map_err(|error| source.error(error))?;
            add(reading, &mut known, kind, &nodes, group);
        }
        read += follow;
    }
    Ok(())
}

/// In binary the numbers begin on the line that follows.
fn after_count(source: &mut Source) {
    if source.encoding != Encoding::Text {
        source.line();
    }
}

/// The file lists an element once for each of its physical groups.
fn add(
    reading: &mut Reading,
    known: &mut HashMap<Vec<u32>, (u32, Vec<usize>)>,
    kind: &str,
    nodes: &[u32],
    group: Option<usize>,
) {
    if let (TETRAHEDRON, Some(group)) = (kind, group) {
        match known.get_mut(nodes) {
            // Twice in one group it is there twice.
            Some((element, groups)) if !groups.contains(&group) => {
                groups.push(group);
                return reading.found.join(group, nodes, Some(*element));
            }
            _ => {
                known.insert(nodes.to_vec(), (reading.found.elements(), vec![group]));
            }
        }
    }
    reading.found.add(kind, nodes, group.as_slice());
}

/// The dimension of elements by what they are called.
fn dimension_of(kind: &str) -> i64 {
    match kind.rsplit(' ').next().unwrap_or(kind) {
        "points" => 0,
        "lines" => 1,
        "triangles" | "quadrangles" => 2,
        _ => 3,
    }
}
