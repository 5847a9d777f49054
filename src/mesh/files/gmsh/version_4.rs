//! The sections of version 4.1.

use super::Reading;
use super::elements::element_type;
use crate::error::MeshError;
use crate::files::number::Number;
use crate::files::source::Source;

const INT: Number = Number::Int32;
const SIZE: Number = Number::UInt64;
const FLOAT: Number = Number::Float64;
/// Most physical groups that one entity is in: each of its elements is listed in all of them.
const MOST_AT_ONCE: usize = 16;

/// Which physical groups each point, curve, surface and volume of the geometry is in.
pub fn entities(source: &mut Source, reading: &mut Reading) -> Result<(), MeshError> {
    let counts = source.integers(SIZE, 4, "the number of entities")?;
    for (dimension, &count) in (0..).zip(&counts) {
        for _ in 0..count {
            let tag = source.integer(INT, "the tag of an entity")?;
            source.floats(FLOAT, if dimension == 0 { 3 } else { 6 }, "a coordinate of an entity")?;
            let physical = source.count(SIZE, "number of physical tags")?;
            let mut groups = Vec::new();
            for physical in source.integers(INT, physical, "a physical tag")? {
                let group = reading.group(dimension, physical).map_err(|error| source.error(error))?;
                if !groups.contains(&group) {
                    groups.push(group);
                }
                if groups.len() > MOST_AT_ONCE {
                    return Err(
                        source.error(format_args!("entity {tag} is in more than {MOST_AT_ONCE} physical groups"))
                    );
                }
            }
            if dimension > 0 {
                let bounding = source.count(SIZE, "number of bounding entities")?;
                source.integers(INT, bounding, "the tag of a bounding entity")?;
            }
            reading.entities.insert((dimension, tag), groups);
        }
    }
    Ok(())
}

/// The nodes, in blocks.
pub fn nodes(source: &mut Source, reading: &mut Reading) -> Result<(), MeshError> {
    let header = source.integers(SIZE, 4, "the number of node blocks")?;
    for _ in 0..header[0] {
        let [dimension, _, is_parametric] = three(&source.integers(INT, 3, "the entity of a node block")?);
        let count = source.count(SIZE, "number of nodes")?;
        let tags = source.integers(SIZE, count, "the tag of a node")?;
        // Coordinates on the entity follow those in space.
        let columns = 3 + if is_parametric == 0 { 0 } else { dimension.clamp(0, 3) as usize };
        for tag in tags {
            let place = source.floats(FLOAT, columns, "a coordinate of a node")?;
            reading.add_node(tag, three(&place)).map_err(|error| source.error(error))?;
        }
    }
    Ok(())
}

/// The elements, in blocks.
pub fn elements(source: &mut Source, reading: &mut Reading) -> Result<(), MeshError> {
    let header = source.integers(SIZE, 4, "the number of element blocks")?;
    let mut nodes = Vec::new();
    for _ in 0..header[0] {
        let [dimension, entity, number] = three(&source.integers(INT, 3, "the entity of an element block")?);
        let Some((corners, kind)) = element_type(number) else {
            return Err(source.error(format_args!("elements of Gmsh's type {number} are not known")));
        };
        let count = source.count(SIZE, "number of elements")?;
        let groups = reading.entities.get(&(dimension, entity)).cloned().unwrap_or_default();
        for _ in 0..count {
            let element = source.integers(SIZE, 1 + corners, "the tag of a node of an element")?;
            reading.indices(&element[1..], &mut nodes).map_err(|error| source.error(error))?;
            reading.found.add(kind, &nodes, &groups);
        }
    }
    Ok(())
}

/// The first three of at least as many.
fn three<T: Copy>(items: &[T]) -> [T; 3] {
    [items[0], items[1], items[2]]
}
