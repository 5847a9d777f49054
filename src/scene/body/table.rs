//! The table `[body]` as a file has it: the keys of every kind, of which a body has those of its own.

use serde::de::{Deserialize, Deserializer, Error};

use super::place::Place;
use super::tetrahedra::{TetrahedraSpec, TissueRegionSpec, TissueSpec};
use super::{BlockSpec, BodySpec, MassSpringSpec, MaterialSpec, RegionSpec, shape};
use crate::model::body::{Shape, Where};

/// The kinds of body that a scene file can name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Deserialize, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum BodyKind {
    /// Point masses and springs.
    #[default]
    MassSpring,
    /// Linear tetrahedra.
    Tetrahedra,
}

impl BodyKind {
    /// The name in scene files.
    pub fn name(self) -> &'static str {
        match self {
            Self::MassSpring => "mass_spring",
            Self::Tetrahedra => "tetrahedra",
        }
    }
}

/// The keys that one kind of body has in a table and the other does not.
pub(in crate::scene) type KeysOf = [(BodyKind, &'static [&'static str]); 2];

/// Those of `[body]`.
pub(in crate::scene) const BODY_KEYS: KeysOf = [
    (BodyKind::MassSpring, &["block", "material"]),
    (BodyKind::Tetrahedra, &["mesh", "surface", "element_size_m", "surface_size_m", "unit_m", "fixed", "tissue"]),
];

/// Those of `[[body.region]]`.
pub(in crate::scene) const REGION_KEYS: KeysOf = [
    (BodyKind::MassSpring, &["stiffness_n_per_m", "damping_ratio", "node_mass_kg"]),
    (BodyKind::Tetrahedra, &["group", "young_modulus_pa", "poisson_ratio", "density_kg_m3", "viscosity_pa_s"]),
];

/// What is wrong with `key` in a table of a body of `kind`; `None` if it may be there or is nobody's.
pub(in crate::scene) fn misplaced(key: &str, kind: BodyKind, keys: &KeysOf) -> Option<String> {
    let (other, _) = keys.iter().find(|(other, keys)| *other != kind && keys.contains(&key))?;
    let own = keys.iter().find(|(own, _)| *own == kind).map_or(String::new(), |(_, keys)| keys.join(", "));
    let (other, kind) = (other.name(), kind.name());
    Some(format!("belongs to kind = {other:?}, set that or leave it out: the keys of {kind:?} here are {own}"))
}

#[derive(serde::Deserialize)]
#[serde(deny_unknown_fields, rename = "BodySpec")]
struct BodyTable {
    #[serde(default)]
    kind: BodyKind,
    block: Option<BlockSpec>,
    material: Option<MaterialSpec>,
    mesh: Option<std::path::PathBuf>,
    surface: Option<std::path::PathBuf>,
    element_size_m: Option<f64>,
    surface_size_m: Option<f64>,
    unit_m: Option<f64>,
    fixed: Option<Vec<Place>>,
    tissue: Option<TissueSpec>,
    #[serde(default)]
    region: Vec<PlacedRegion>,
}

impl<'de> Deserialize<'de> for BodySpec {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        BodyTable::deserialize(from)?.body()
    }
}

impl BodyTable {
    fn body<E: Error>(self) -> Result<BodySpec, E> {
        self.check()?;
        let missing = E::missing_field;
        Ok(match self.kind {
            BodyKind::MassSpring => BodySpec::MassSpring(MassSpringSpec {
                block: self.block.ok_or_else(|| missing("block"))?,
                material: self.material.ok_or_else(|| missing("material"))?,
                regions: self.region.into_iter().map(PlacedRegion::of_block).collect::<Result<_, E>>()?,
            }),
            BodyKind::Tetrahedra => BodySpec::Tetrahedra(TetrahedraSpec {
                mesh: self.mesh,
                surface: self.surface,
                element_size_m: self.element_size_m,
                surface_size_m: self.surface_size_m,
                unit_m: self.unit_m.unwrap_or(1.0),
                fixed: self.fixed.unwrap_or_default().into_iter().map(|Place(place)| place).collect(),
                tissue: self.tissue.ok_or_else(|| missing("tissue"))?,
                regions: self.region.into_iter().map(PlacedRegion::of_tissue).collect(),
                volume: None,
            }),
        })
    }

    /// Refuses keys of the other kind. A scene file has been asked before, with their lines.
    fn check<E: Error>(&self) -> Result<(), E> {
        let given = [
            ("block", self.block.is_some()),
            ("material", self.material.is_some()),
            ("mesh", self.mesh.is_some()),
            ("surface", self.surface.is_some()),
            ("element_size_m", self.element_size_m.is_some()),
            ("surface_size_m", self.surface_size_m.is_some()),
            ("unit_m", self.unit_m.is_some()),
            ("fixed", self.fixed.is_some()),
            ("tissue", self.tissue.is_some()),
        ];
        let of_regions = self.region.iter().flat_map(|region| region.values.given());
        let given = given.into_iter().map(|(key, is_given)| (key, is_given, &BODY_KEYS));
        let given = given.chain(of_regions.map(|(key, is_given)| (key, is_given, &REGION_KEYS)));
        let mut wrong = given.filter(|(_, is_given, _)| *is_given);
        match wrong.find_map(|(key, _, keys)| Some((key, misplaced(key, self.kind, keys)?))) {
            None => Ok(()),
            Some((key, message)) => Err(E::custom(format!("{key} {message}"))),
        }
    }
}

/// A region of either kind, with its part.
struct PlacedRegion {
    place: Where,
    values: RegionTable,
}

#[derive(serde::Deserialize)]
#[serde(deny_unknown_fields, rename = "RegionSpec")]
struct RegionTable {
    name: Option<String>,
    #[serde(default, deserialize_with = "given_shape")]
    shape: Option<Shape>,
    group: Option<String>,
    stiffness_n_per_m: Option<f64>,
    damping_ratio: Option<f64>,
    node_mass_kg: Option<f64>,
    young_modulus_pa: Option<f64>,
    poisson_ratio: Option<f64>,
    density_kg_m3: Option<f64>,
    viscosity_pa_s: Option<f64>,
}

fn given_shape<'de, D: Deserializer<'de>>(from: D) -> Result<Option<Shape>, D::Error> {
    shape::deserialize(from).map(Some)
}

impl<'de> Deserialize<'de> for PlacedRegion {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        let values = RegionTable::deserialize(from)?;
        let place = match (values.shape, &values.group) {
            (Some(shape), None) => Where::Shape(shape),
            (None, Some(group)) => Where::Group(group.clone()),
            (None, None) => return Err(D::Error::missing_field("shape")),
            (Some(_), Some(_)) => {
                return Err(D::Error::custom("has a shape and a group, give a region for each"));
            }
        };
        Ok(Self { place, values })
    }
}

impl RegionTable {
    fn given(&self) -> [(&'static str, bool); 8] {
        [
            ("group", self.group.is_some()),
            ("stiffness_n_per_m", self.stiffness_n_per_m.is_some()),
            ("damping_ratio", self.damping_ratio.is_some()),
            ("node_mass_kg", self.node_mass_kg.is_some()),
            ("young_modulus_pa", self.young_modulus_pa.is_some()),
            ("poisson_ratio", self.poisson_ratio.is_some()),
            ("density_kg_m3", self.density_kg_m3.is_some()),
            ("viscosity_pa_s", self.viscosity_pa_s.is_some()),
        ]
    }
}

impl PlacedRegion {
    fn of_block<E: Error>(self) -> Result<RegionSpec, E> {
        let Where::Shape(shape) = self.place else { return Err(E::missing_field("shape")) };
        let RegionTable { name, stiffness_n_per_m, damping_ratio, node_mass_kg, .. } = self.values;
        Ok(RegionSpec { name, shape, stiffness_n_per_m, damping_ratio, node_mass_kg })
    }

    fn of_tissue(self) -> TissueRegionSpec {
        let RegionTable { name, young_modulus_pa, poisson_ratio, density_kg_m3, viscosity_pa_s, .. } = self.values;
        TissueRegionSpec { name, place: self.place, young_modulus_pa, poisson_ratio, density_kg_m3, viscosity_pa_s }
    }
}
