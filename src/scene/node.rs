//! How a scene names a node of the body.

use serde::de::value::MapAccessDeserializer;
use serde::de::{Deserialize, Deserializer, Error, MapAccess, SeqAccess, Unexpected, Visitor};

/// A node of the body: by its place in a lattice, by its number, or the nearest to a point.
///
/// In a file `[8, 5, 11]`, `1661` and `{ near_m = [0.05, 0.05, 0.1] }`.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
#[serde(untagged)]
pub enum NodeSpec {
    /// Its place in the lattice of a block.
    Lattice([usize; 3]),
    /// Its number: of a mesh, in the order of the file, counted from 0.
    Number(u32),
    /// The node that is nearest to a point at rest; of the surface where only those can be meant.
    Near {
        /// The point (m).
        near_m: [f64; 3],
    },
}

impl From<[usize; 3]> for NodeSpec {
    fn from(place: [usize; 3]) -> Self {
        Self::Lattice(place)
    }
}

impl From<u32> for NodeSpec {
    fn from(number: u32) -> Self {
        Self::Number(number)
    }
}

impl<'de> Deserialize<'de> for NodeSpec {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        from.deserialize_any(AnyNode)
    }
}

#[derive(serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct Near {
    near_m: [f64; 3],
}

struct AnyNode;

impl<'de> Visitor<'de> for AnyNode {
    type Value = NodeSpec;

    fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("a node: its place [i, j, k] in a block, its number, or { near_m = [x, y, z] }")
    }

    fn visit_u64<E: Error>(self, number: u64) -> Result<NodeSpec, E> {
        let number = u32::try_from(number).map_err(|_| E::invalid_value(Unexpected::Unsigned(number), &self))?;
        Ok(NodeSpec::Number(number))
    }

    fn visit_i64<E: Error>(self, number: i64) -> Result<NodeSpec, E> {
        let number = u32::try_from(number).map_err(|_| E::invalid_value(Unexpected::Signed(number), &self))?;
        Ok(NodeSpec::Number(number))
    }

    fn visit_f64<E: Error>(self, number: f64) -> Result<NodeSpec, E> {
        // A scene file's reader knows one kind of number.
        if number.fract() != 0.0 || !(0.0..=f64::from(u32::MAX)).contains(&number) {
            return Err(E::invalid_value(Unexpected::Float(number), &self));
        }
        Ok(NodeSpec::Number(number as u32))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut items: A) -> Result<NodeSpec, A::Error> {
        let (mut place, mut count) = ([0; 3], 0);
        while let Some(index) = items.next_element::<usize>()? {
            if let Some(entry) = place.get_mut(count) {
                *entry = index;
            }
            count += 1;
        }
        if count != place.len() {
            return Err(A::Error::custom(format!("has {count} entries, must be an array of 3")));
        }
        Ok(NodeSpec::Lattice(place))
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<NodeSpec, A::Error> {
        let Near { near_m } = Near::deserialize(MapAccessDeserializer::new(map))?;
        Ok(NodeSpec::Near { near_m })
    }
}
