//! Regions of the body as a scene names them: layers and inclusions.

use crate::model::body::{Region, Shape};

/// A part of the body that differs in material.
///
/// A node belongs to every region whose closed shape holds its rest position; of several that give the same value the
/// last one counts. [`BlockBuilder::region`](crate::model::body::BlockBuilder::region) says what becomes of springs
/// between two materials.
#[derive(Clone, Debug, PartialEq, serde::Deserialize, serde::Serialize)]
#[serde(deny_unknown_fields)]
pub struct RegionSpec {
    /// Name of the region, for the reader.
    #[serde(default)]
    pub name: Option<String>,
    /// The shape that holds its nodes.
    #[serde(with = "shape")]
    pub shape: Shape,
    /// Stiffness k of its springs (N/m); as it was if absent.
    #[serde(default)]
    pub stiffness_n_per_m: Option<f64>,
    /// Damping ratio zeta in b = zeta sqrt(2 m k), with the region's m and k; as it was if absent.
    #[serde(default)]
    pub damping_ratio: Option<f64>,
    /// Mass of each of its nodes (kg); as it was if absent.
    #[serde(default)]
    pub node_mass_kg: Option<f64>,
}

impl RegionSpec {
    /// The region as a block takes it.
    pub(super) fn region(&self) -> Region {
        Region {
            shape: self.shape,
            stiffness: self.stiffness_n_per_m,
            damping_ratio: self.damping_ratio,
            node_mass: self.node_mass_kg,
        }
    }
}

/// A shape as a table of one key, its kind.
mod shape {
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

    pub(super) fn serialize<S: Serializer>(shape: &Shape, to: S) -> Result<S::Ok, S::Error> {
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

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Shape, D::Error> {
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
}
