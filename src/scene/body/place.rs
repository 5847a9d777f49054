//! What is held of a mesh: the name of a group, or a shape.

use serde::de::value::MapAccessDeserializer;
use serde::de::{Deserialize, Deserializer, Error, MapAccess, Visitor};
use serde::ser::{Serialize, SerializeSeq, Serializer};

use super::shape;
use crate::model::body::Where;

/// A place as a list holds it.
#[derive(Clone, Debug)]
pub(super) struct Place(pub(super) Where);

impl Serialize for Place {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        match &self.0 {
            Where::Group(name) => to.serialize_str(name),
            Where::Shape(shape) => shape::serialize(shape, to),
        }
    }
}

impl<'de> Deserialize<'de> for Place {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        struct NameOrShape;

        impl<'de> Visitor<'de> for NameOrShape {
            type Value = Place;

            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("the name of a group of the mesh, or a shape such as { sphere = { .. } }")
            }

            fn visit_str<E: Error>(self, name: &str) -> Result<Place, E> {
                Ok(Place(Where::Group(name.to_owned())))
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Place, A::Error> {
                Ok(Place(Where::Shape(shape::deserialize(MapAccessDeserializer::new(map))?)))
            }
        }

        from.deserialize_any(NameOrShape)
    }
}

/// Writes a list of places.
pub(super) fn serialize_all<S: Serializer>(places: &[Where], to: S) -> Result<S::Ok, S::Error> {
    let mut list = to.serialize_seq(Some(places.len()))?;
    for place in places {
        list.serialize_element(&Place(place.clone()))?;
    }
    list.end()
}
