//! Wavefront OBJ: vertices and faces; normals, materials and names are left out.

use palpate_model::Vec3;

use super::source::Source;
use crate::SurfaceMesh;
use crate::error::{MeshError, quoted};
use crate::surface::Welded;

/// The surface in `bytes`: polygons are cut into triangles around their first corner.
pub fn read(bytes: &[u8]) -> Result<SurfaceMesh, MeshError> {
    let mut source = Source::new(bytes);
    let mut places: Vec<Vec3> = Vec::new();
    let mut welded = Welded::default();
    loop {
        let before = source.clone();
        let Some(line) = source.line() else { break };
        let mut words = line.split_ascii_whitespace();
        match words.next() {
            Some("v") => {
                let numbers: Vec<f64> = words.take(3).map_while(|word| word.parse().ok()).collect();
                let place = <[f64; 3]>::try_from(numbers).ok().filter(|place| place.iter().all(|x| x.is_finite()));
                let place = place.ok_or_else(|| before.error("a vertex has three finite coordinates"))?;
                places.push(Vec3::from(place));
            }
            Some("f") => {
                let mut corners = Vec::new();
                for word in words {
                    let place = place_of(word, &places);
                    corners.push(place.ok_or_else(|| before.error(format_args!("{} is no vertex", quoted(word))))?);
                }
                let [first, rest @ ..] = &corners[..] else { continue };
                rest.windows(2).for_each(|pair| welded.add([*first, pair[0], pair[1]]));
            }
            _ => {}
        }
    }
    Ok(welded.finish())
}

/// The vertex of a corner such as `3/1/7`: numbered from 1, or backwards from -1, the last one so far.
fn place_of(word: &str, places: &[Vec3]) -> Option<Vec3> {
    let number: i64 = word.split('/').next()?.parse().ok()?;
    let index =
        if number < 0 { number.checked_add(i64::try_from(places.len()).ok()?)? } else { number.checked_sub(1)? };
    places.get(usize::try_from(index).ok()?).copied()
}
