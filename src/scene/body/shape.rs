//! A shape as a table of one key, its kind.

use serde::de::{Deserialize, Deserializer, Error};
use serde::ser::{Serialize, Serializer};

use crate::devices::Axis;
use crate::model::body::Shape;

#[derive(Default, serde::Deserialize, serde::Serialize)]
#[serde(deny_unknown_fields, default)]
struct Kinds {
    sphere: Option<Sphere>,
    #[serde(rename = "box")]
    cuboid: Option<Cuboid>,
    ellipsoid: Option<Ellipsoid>,
    layer: Option<Layer>,
}

#[derive(serde::Deserialize, serde::Serialize)]
#[serde(deny_unknown_fields)]
struct Sphere {
    centre_m: [f64; 3],
    radius_m: f64,
}

#[derive(serde::Deserialize, serde::Serialize)]
#[serde(deny_unknown_fields)]
struct Cuboid {
    min_m: [f64; 3],
    max_m: [f64; 3],
}

#[derive(serde::Deserialize, serde::Serialize)]
#[serde(deny_unknown_fields)]
struct Ellipsoid {
    centre_m: [f64; 3],
    radii_m: [f64; 3],
}

#[derive(serde::Deserialize, serde::Serialize)]
#[serde(deny_unknown_fields)]
struct Layer {
    axis: Axis,
    from_m: f64,
    to_m: f64,
}

pub(in crate::scene) fn serialize<S: Serializer>(shape: &Shape, to: S) -> Result<S::Ok, S::Error> {
    let mut kinds = Kinds::default();
    match *shape {
        Shape::Sphere { centre, radius } => kinds.sphere = Some(Sphere { centre_m: centre, radius_m: radius }),
        Shape::Box { min, max } => kinds.cuboid = Some(Cuboid { min_m: min, max_m: max }),
        Shape::Ellipsoid { centre, radii } => {
            kinds.ellipsoid = Some(Ellipsoid { centre_m: centre, radii_m: radii });
        }
        Shape::Layer { axis, from, to } => {
            let axis = [Axis::X, Axis::Y, Axis::Z][axis.min(2)];
            kinds.layer = Some(Layer { axis, from_m: from, to_m: to });
        }
    }
    kinds.serialize(to)
}

pub(in crate::scene) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Shape, D::Error> {
    let kinds = Kinds::deserialize(from)?;
    let found = [
        kinds.sphere.map(|sphere| Shape::Sphere { centre: sphere.centre_m, radius: sphere.radius_m }),
        kinds.cuboid.map(|cuboid| Shape::Box { min: cuboid.min_m, max: cuboid.max_m }),
        kinds.ellipsoid.map(|e| Shape::Ellipsoid { centre: e.centre_m, radii: e.radii_m }),
        kinds.layer.map(|l| Shape::Layer { axis: l.axis as usize, from: l.from_m, to: l.to_m }),
    ];
    let mut found = found.into_iter().flatten();
    match (found.next(), found.next()) {
        (Some(shape), None) => Ok(shape),
        (None, _) => Err(D::Error::custom("is empty, must be one of sphere, box, ellipsoid or layer")),
        _ => Err(D::Error::custom("has several kinds, give a region for each")),
    }
}
