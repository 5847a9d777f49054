//! VTU, the XML format of unstructured grids.

use std::cell::Cell;

use roxmltree::{Document, Node};

use super::cells::{Piece, joined};
use super::data_array::{Arrays, MOST_NUMBERS, kind};
use crate::error::{MeshError, quoted};
use crate::files::VolumeFile;
use crate::files::number::Number;

/// Most pieces of a file.
const MOST_PIECES: usize = 4096;
/// What precedes appended data.
const APPENDED: &[u8] = b"<AppendedData";

/// The volume mesh in `bytes`.
pub fn read(bytes: &[u8]) -> Result<VolumeFile, MeshError> {
    let refuse = |message: String| MeshError::new(message);
    let (text, appended) = parts(bytes)?;
    let text = std::str::from_utf8(text).map_err(|_| refuse("is no XML of UTF-8".to_owned()))?;
    // What follows appended data was cut off with them.
    let text = if appended.is_some() { format!("{text}</VTKFile>") } else { text.to_owned() };
    let document =
        Document::parse(&text).map_err(|error| refuse(format!("is no XML: {}", quoted(&error.to_string()))))?;
    let file = document.root_element();
    let kind = file.attribute("type").unwrap_or("");
    if file.tag_name().name() != "VTKFile" || kind != "UnstructuredGrid" {
        return Err(refuse(format!("{} is no unstructured grid: a volume mesh is one", quoted(kind))));
    }
    let is_compressed = match file.attribute("compressor").unwrap_or("") {
        "" => false,
        "vtkZLibDataCompressor" => true,
        other => return Err(refuse(format!("is compressed by {}: save it with zlib or uncompressed", quoted(other)))),
    };
    let arrays = Arrays {
        is_big_endian: file.attribute("byte_order") == Some("BigEndian"),
        header: if file.attribute("header_type") == Some("UInt64") { Number::UInt64 } else { Number::UInt32 },
        is_compressed,
        appended,
        room: Cell::new(MOST_NUMBERS),
    };
    let grid = child(file, "UnstructuredGrid")?;
    let pieces: Vec<Node> = children(grid, "Piece").collect();
    if pieces.len() > MOST_PIECES {
        return Err(refuse(format!("has {} pieces, at most {MOST_PIECES} are possible", pieces.len())));
    }
    let pieces: Result<Vec<Piece>, MeshError> = pieces.into_iter().map(|node| piece(node, &arrays)).collect();
    joined(pieces?)
}

/// A file without its appended data, and those: behind the underscore, raw or not.
#[expect(clippy::type_complexity, reason = "named where it is taken apart")]
fn parts(bytes: &[u8]) -> Result<(&[u8], Option<(&[u8], bool)>), MeshError> {
    let Some(at) = bytes.windows(APPENDED.len()).position(|window| window == APPENDED) else {
        return Ok((bytes, None));
    };
    let (text, rest) = bytes.split_at(at);
    let cut_off = || MeshError::new("the appended data are cut off");
    let tag_end = rest.iter().position(|byte| *byte == b'>').ok_or_else(cut_off)?;
    let data = rest[tag_end..].iter().position(|byte| *byte == b'_').ok_or_else(cut_off)?;
    let tag = String::from_utf8_lossy(&rest[..tag_end]);
    let is_raw = tag.contains("raw");
    let data = &rest[tag_end + data + 1..];
    // Base 64 ends where the XML goes on.
    let end = data.iter().position(|byte| *byte == b'<').filter(|_| !is_raw).unwrap_or(data.len());
    Ok((text, Some((&data[..end], is_raw))))
}

fn piece(node: Node, arrays: &Arrays) -> Result<Piece, MeshError> {
    let integers = |array| arrays.read(array, Number::integer);
    let cells = child(node, "Cells")?;
    let named = |name: &str| {
        let found = children(cells, "DataArray").find(|array| array.attribute("Name") == Some(name));
        found.ok_or_else(|| MeshError::new(format!("a piece has no array {}", quoted(name))))
    };
    let mut piece = Piece {
        points: arrays.read(child(child(node, "Points")?, "DataArray")?, Number::float)?,
        connectivity: integers(named("connectivity")?)?,
        ends: integers(named("offsets")?)?,
        types: integers(named("types")?)?,
        ..Piece::default()
    };
    for array in children(node, "CellData").flat_map(|data| children(data, "DataArray")) {
        let columns = array.attribute("NumberOfComponents").unwrap_or("1");
        let is_wanted = columns == "1" && kind(array).is_some_and(Number::is_integer);
        if let Some(name) = array.attribute("Name").filter(|name| is_wanted && piece.has_room(name)) {
            piece.keep_array(name, integers(array)?);
        }
    }
    Ok(piece)
}

fn children<'a, 'b>(node: Node<'a, 'b>, name: &'static str) -> impl Iterator<Item = Node<'a, 'b>> {
    node.children().filter(move |child| child.has_tag_name(name))
}

fn child<'a, 'b>(node: Node<'a, 'b>, name: &'static str) -> Result<Node<'a, 'b>, MeshError> {
    let found = children(node, name).next();
    found.ok_or_else(|| MeshError::new(format!("{} has no {name}", node.tag_name().name())))
}
