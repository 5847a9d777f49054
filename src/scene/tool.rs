//! The shape of a device's tool in a scene.

use serde::de::value::MapAccessDeserializer;
use serde::de::{Deserialize, Deserializer, Error, MapAccess, Unexpected, Visitor};

use crate::model::Vec3;
use crate::model::contact::ToolShape;

/// The axis of a capsule that names none.
const UPRIGHT: [f64; 3] = [0.0, 0.0, 1.0];

/// The shape of a device's tool, around its centre and in its own axes.
///
/// In a file `"point"`, `{ shape = "sphere", radius_m = 0.004 }` and
/// `{ shape = "capsule", radius_m = 0.003, length_m = 0.02, axis = [0, 0, 1] }`.
///
/// ```
/// use palpate::model::contact::ToolShape;
/// use palpate::scene::ToolSpec;
///
/// assert_eq!(ToolSpec::Sphere { radius_m: 0.004 }.shape(), ToolShape::Sphere { radius: 0.004 });
/// assert_eq!(ToolSpec::default(), ToolSpec::Point);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
#[serde(into = "ToolTable")]
pub enum ToolSpec {
    /// A point: one contact, with a single triangle.
    #[default]
    Point,
    /// A sphere.
    Sphere {
        /// The radius (m), from 0.1 mm to 1 m.
        radius_m: f64,
    },
    /// A cylinder with a half sphere at both ends.
    Capsule {
        /// The radius (m), from 0.1 mm to 1 m.
        radius_m: f64,
        /// The distance between the centres of the two half spheres (m), below 1 m; with 0 it is a sphere.
        length_m: f64,
        /// The direction of the axis in the tool's own axes; of any length but 0.
        axis: [f64; 3],
    },
}

impl ToolSpec {
    /// The shape as contact takes it.
    pub fn shape(self) -> ToolShape {
        match self {
            Self::Point => ToolShape::Point,
            Self::Sphere { radius_m } => ToolShape::Sphere { radius: radius_m },
            Self::Capsule { radius_m, length_m: 0.0, .. } => ToolShape::Sphere { radius: radius_m },
            Self::Capsule { radius_m, length_m, axis } => {
                let axis = Vec3::from(axis);
                // Scaled first: the square of a number may be no number any more.
                let half_axis = (axis / axis.amax()).normalize() * (0.5 * length_m);
                ToolShape::Capsule { radius: radius_m, half_axis }
            }
        }
    }

    /// The name of the shape in scene files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Point => "point",
            Self::Sphere { .. } => "sphere",
            Self::Capsule { .. } => "capsule",
        }
    }
}

impl From<ToolShape> for ToolSpec {
    fn from(shape: ToolShape) -> Self {
        match shape {
            ToolShape::Point => Self::Point,
            ToolShape::Sphere { radius } => Self::Sphere { radius_m: radius },
            ToolShape::Capsule { radius, half_axis } if half_axis == Vec3::zeros() => Self::Sphere { radius_m: radius },
            ToolShape::Capsule { radius, half_axis } => {
                Self::Capsule { radius_m: radius, length_m: 2.0 * half_axis.norm(), axis: half_axis.into() }
            }
        }
    }
}

/// The shapes by name.
#[derive(Clone, Copy, Debug, serde::Deserialize, serde::Serialize)]
#[serde(rename_all = "snake_case")]
enum Kind {
    Point,
    Sphere,
    Capsule,
}

/// A tool as a file has it: the keys of every shape, of which each has its own.
#[derive(serde::Deserialize, serde::Serialize)]
#[serde(deny_unknown_fields, rename = "ToolSpec")]
struct ToolTable {
    shape: Kind,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    radius_m: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    length_m: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    axis: Option<[f64; 3]>,
}

impl From<ToolSpec> for ToolTable {
    fn from(tool: ToolSpec) -> Self {
        let of = |shape, radius_m| Self { shape, radius_m, length_m: None, axis: None };
        match tool {
            ToolSpec::Point => of(Kind::Point, None),
            ToolSpec::Sphere { radius_m } => of(Kind::Sphere, Some(radius_m)),
            ToolSpec::Capsule { radius_m, length_m, axis } => {
                Self { length_m: Some(length_m), axis: Some(axis), ..of(Kind::Capsule, Some(radius_m)) }
            }
        }
    }
}

impl ToolTable {
    fn tool<E: Error>(self) -> Result<ToolSpec, E> {
        let Self { shape, radius_m, length_m, axis } = self;
        let has_radius = !matches!(shape, Kind::Point);
        let is_capsule = matches!(shape, Kind::Capsule);
        let misplaced = [
            ("radius_m", radius_m.is_some() && !has_radius, "\"sphere\" or \"capsule\""),
            ("length_m", length_m.is_some() && !is_capsule, "\"capsule\""),
            ("axis", axis.is_some() && !is_capsule, "\"capsule\""),
        ];
        if let Some((key, _, shapes)) = misplaced.iter().find(|(_, is_misplaced, _)| *is_misplaced) {
            return Err(E::custom(format!("{key} belongs to shape = {shapes}, set that or leave it out")));
        }
        let radius_m = || radius_m.ok_or_else(|| E::missing_field("radius_m"));
        Ok(match shape {
            Kind::Point => ToolSpec::Point,
            Kind::Sphere => ToolSpec::Sphere { radius_m: radius_m()? },
            Kind::Capsule => ToolSpec::Capsule {
                radius_m: radius_m()?,
                length_m: length_m.ok_or_else(|| E::missing_field("length_m"))?,
                axis: axis.unwrap_or(UPRIGHT),
            },
        })
    }
}

impl<'de> Deserialize<'de> for ToolSpec {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        from.deserialize_any(WordOrTable)
    }
}

struct WordOrTable;

impl<'de> Visitor<'de> for WordOrTable {
    type Value = ToolSpec;

    fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("\"point\" or a table such as { shape = \"sphere\", radius_m = 0.004 }")
    }

    fn visit_str<E: Error>(self, word: &str) -> Result<ToolSpec, E> {
        match word {
            "point" => Ok(ToolSpec::Point),
            _ => Err(E::invalid_value(Unexpected::Str(word), &self)),
        }
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<ToolSpec, A::Error> {
        ToolTable::deserialize(MapAccessDeserializer::new(map))?.tool()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_axis_of_any_length_names_a_direction_and_the_length_is_from_centre_to_centre() {
        for axis in [[0.0, 3.0, 4.0], [0.0, 3e200, 4e200], [0.0, 3e-310, 4e-310]] {
            let tool = ToolSpec::Capsule { radius_m: 0.003, length_m: 0.02, axis };
            let ToolShape::Capsule { radius, half_axis } = tool.shape() else { panic!("{axis:?}") };
            assert_eq!(radius, 0.003);
            assert!((half_axis - Vec3::new(0.0, 0.006, 0.008)).norm() < 1e-12, "{half_axis:?}");
        }
        let short = ToolSpec::Capsule { radius_m: 0.003, length_m: 0.0, axis: UPRIGHT };
        assert_eq!(short.shape(), ToolShape::Sphere { radius: 0.003 });
    }

    #[test]
    fn a_shape_and_what_describes_it_are_the_same() {
        let shapes = [
            ToolShape::Point,
            ToolShape::Sphere { radius: 0.004 },
            ToolShape::Capsule { radius: 0.003, half_axis: Vec3::new(0.0, -0.01, 0.0) },
        ];
        for shape in shapes {
            assert_eq!(ToolSpec::from(shape).shape(), shape);
        }
    }
}
