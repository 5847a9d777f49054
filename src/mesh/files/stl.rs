//! STL, ASCII and binary.

use palpate_model::Vec3;

use super::number::Number;
use super::source::Source;
use crate::SurfaceMesh;
use crate::error::MeshError;
use crate::surface::Welded;

/// Bytes before the triangles of a binary file: a header for people and the number of triangles.
const HEADER: usize = 84;
/// Bytes of a triangle: its normal, its corners, and two for whatever a program wants.
const TRIANGLE: usize = 50;

/// True if `bytes` look like STL.
pub fn is_stl(bytes: &[u8]) -> bool {
    bytes.trim_ascii_start().starts_with(b"solid") || is_binary(bytes)
}

/// The length tells: the header of a binary file may begin like one of text.
fn is_binary(bytes: &[u8]) -> bool {
    let count = bytes.get(HEADER - 4..HEADER).and_then(|count| <[u8; 4]>::try_from(count).ok());
    count.is_some_and(|count| {
        bytes.len() as u64 == HEADER as u64 + TRIANGLE as u64 * u64::from(u32::from_le_bytes(count))
    })
}

/// The surface in `bytes`.
pub fn read(bytes: &[u8]) -> Result<SurfaceMesh, MeshError> {
    let mut welded = Welded::default();
    if is_binary(bytes) {
        for (number, triangle) in bytes[HEADER..].chunks_exact(TRIANGLE).enumerate() {
            let mut numbers = Number::Float32.split(&triangle[12..48], false).map(|bytes| Number::Float32.float(bytes));
            let corners = [(); 3].map(|()| Vec3::from_iterator(numbers.by_ref().take(3)));
            if !corners.iter().flatten().all(|x| x.is_finite()) {
                return Err(MeshError::new(format!("triangle {number}, counted from 0, has a corner at no place")));
            }
            welded.add(corners);
        }
        return Ok(welded.finish());
    }
    if !bytes.trim_ascii_start().starts_with(b"solid") {
        let message = "is neither ASCII STL nor as long as its number of triangles says: it is damaged or cut off";
        return Err(MeshError::new(message));
    }
    let mut source = Source::new(bytes);
    let mut corners = Vec::new();
    let mut is_open = false;
    // Names of solids may be any words, but none of them stands before three numbers.
    while let Some(word) = source.word() {
        match word {
            "solid" | "endsolid" => {
                is_open = word == "solid";
                source.line();
            }
            "vertex" => {
                let place = source.floats(Number::Float64, 3, "a coordinate")?;
                if !place.iter().all(|x| x.is_finite()) {
                    return Err(source.error("a coordinate is not finite"));
                }
                corners.push(Vec3::new(place[0], place[1], place[2]));
            }
            "endloop" => {
                let Ok(triangle) = <[Vec3; 3]>::try_from(&corners[..]) else {
                    return Err(source.error(format_args!("a facet has {} corners, three are needed", corners.len())));
                };
                welded.add(triangle);
                corners.clear();
            }
            _ => {}
        }
    }
    if is_open || !corners.is_empty() {
        return Err(source.error("the file ends within a solid: it is cut off"));
    }
    Ok(welded.finish())
}
