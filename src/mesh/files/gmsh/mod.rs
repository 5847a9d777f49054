//! Gmsh's MSH format, versions 4.1 and 2.2, ASCII and binary: <https://gmsh.info/doc/texinfo/gmsh.html#Gmsh-file-formats>.

mod elements;
mod version_2;
mod version_4;
mod write;

pub use write::write_msh;

use std::collections::HashMap;

use palpate_model::Vec3;

use super::VolumeFile;
use super::collected::Collected;
use super::number::Number;
use super::source::{Encoding, Source};
use crate::error::{MeshError, quoted};

/// What elements of each dimension are called where a group has no name.
const KINDS: [&str; 4] = ["point", "curve", "surface", "volume"];

/// What is known of a file while it is read.
#[derive(Debug, Default)]
struct Reading {
    found: Collected,
    /// The encoding of numbers in sections that have any in binary.
    encoding: Option<Encoding>,
    /// Names of physical groups by dimension and tag.
    names: HashMap<(i64, i64), String>,
    /// The index of each node by its tag.
    nodes: HashMap<i64, u32>,
    /// Physical groups of each entity by its dimension and tag: of version 4.
    entities: HashMap<(i64, i64), Vec<usize>>,
    has_elements: bool,
}

/// The volume mesh in `bytes`.
pub fn read(bytes: &[u8]) -> Result<VolumeFile, MeshError> {
    let mut source = Source::new(bytes);
    let mut reading = Reading::default();
    let mut version = None;
    while let Some(word) = source.word() {
        let Some(section) = word.strip_prefix('$') else {
            return Err(source.error(format_args!("{} stands where a section should begin", quoted(word))));
        };
        match (section, version) {
            ("MeshFormat", _) => version = Some(format(&mut source, &mut reading)?),
            ("PhysicalNames", _) => names(&mut source, &mut reading)?,
            ("Entities" | "Nodes" | "Elements", None) => return Err(source.error("$MeshFormat must come before")),
            ("Entities" | "Nodes" | "Elements", Some(version)) => {
                if let Some(encoding) = reading.encoding {
                    source.line();
                    source.encoding = encoding;
                }
                match (section, version) {
                    ("Entities", 4) => version_4::entities(&mut source, &mut reading)?,
                    ("Nodes", 4) => version_4::nodes(&mut source, &mut reading)?,
                    ("Nodes", _) => version_2::nodes(&mut source, &mut reading)?,
                    ("Elements", 4) => version_4::elements(&mut source, &mut reading)?,
                    ("Elements", _) => version_2::elements(&mut source, &mut reading)?,
                    _ => {}
                }
                reading.has_elements |= section == "Elements";
                source.encoding = Encoding::Text;
            }
            ("PartitionedEntities", _) => return Err(source.error("the mesh is partitioned: save it in one piece")),
            // Data on nodes and elements, periodicity, parameters.
            _ => {}
        }
        source.skip_to(&format!("$End{section}"))?;
    }
    if !reading.has_elements {
        return Err(source.error("$Elements is missing: the file is damaged or cut off"));
    }
    reading.found.finish()
}

/// The section that says how the others are written: version 2 or 4.
fn format(source: &mut Source, reading: &mut Reading) -> Result<u8, MeshError> {
    let version = match source.need("the version")? {
        "4.1" => 4,
        "2" | "2.0" | "2.1" | "2.2" => 2,
        other => {
            let message = format!("version {} of MSH is not read: save the mesh as 4.1 or 2.2", quoted(other));
            return Err(source.error(message));
        }
    };
    let is_binary = source.parse::<u8>("0 for ASCII or 1 for binary")? == 1;
    let width: u8 = source.parse("the width of numbers")?;
    if width != 8 {
        return Err(source.error(format_args!("numbers have {width} bytes, 8 are needed")));
    }
    if is_binary {
        source.line();
        source.encoding = Encoding::LittleEndian;
        let one = source.integer(Number::Int32, "the number one")?;
        let encoding = match one {
            1 => Encoding::LittleEndian,
            0x0100_0000 => Encoding::BigEndian,
            _ => return Err(source.error(format_args!("{one} stands where a binary file has the number one"))),
        };
        source.encoding = Encoding::Text;
        reading.encoding = Some(encoding);
    }
    Ok(version)
}

/// The names of physical groups.
fn names(source: &mut Source, reading: &mut Reading) -> Result<(), MeshError> {
    let count: usize = source.parse("the number of physical names")?;
    for _ in 0..count {
        let dimension: i64 = source.parse("the dimension of a physical group")?;
        let tag: i64 = source.parse("the tag of a physical group")?;
        let line = source.line().unwrap_or_default();
        let name = line.strip_prefix('"').and_then(|line| line.strip_suffix('"')).unwrap_or(&line);
        reading.names.insert((dimension, tag), name.to_owned());
        // In the order of the file.
        reading.found.group(name).map_err(|error| source.error(error))?;
    }
    Ok(())
}

impl Reading {
    /// The number of a physical group.
    fn group(&mut self, dimension: i64, tag: i64) -> Result<usize, MeshError> {
        // A negative tag turns the elements' orientation round.
        let tag = tag.saturating_abs();
        match self.names.get(&(dimension, tag)) {
            Some(name) => self.found.group(name),
            None => {
                let kind = usize::try_from(dimension).ok().and_then(|dimension| KINDS.get(dimension));
                self.found.group(&format!("{} {tag}", kind.unwrap_or(&"group")))
            }
        }
    }

    /// Adds a node.
    fn add_node(&mut self, tag: i64, [x, y, z]: [f64; 3]) -> Result<(), MeshError> {
        let index = self.found.points.len() as u32;
        if self.nodes.insert(tag, index).is_some() {
            return Err(MeshError::new(format!("node {tag} is there twice")));
        }
        self.found.points.push(Vec3::new(x, y, z));
        Ok(())
    }

    /// The indices of nodes by their tags.
    fn indices(&self, tags: &[i64], nodes: &mut Vec<u32>) -> Result<(), MeshError> {
        nodes.clear();
        for tag in tags {
            let Some(&index) = self.nodes.get(tag) else {
                return Err(MeshError::new(format!("an element has node {tag}, which the file does not have")));
            };
            nodes.push(index);
        }
        Ok(())
    }
}
