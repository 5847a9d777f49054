//! A body of tetrahedra as a scene describes it: its mesh, what of it is held, and tissue.

use std::path::PathBuf;

use palpate_mesh::Sizes;
use serde::ser::{Serialize, SerializeStruct, Serializer};

use super::place::{self, Place};
use super::volume::Volume;
use crate::error::Error;
use crate::model::body::{Tetrahedra, Tissue, TissueRegion, Where};

/// A body of linear tetrahedra with tissue's own parameters.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct TetrahedraSpec {
    /// The file of a volume mesh (MSH, VTK or VTU), relative to the scene file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mesh: Option<PathBuf>,
    /// The file of a closed surface (STL or OBJ) in place of a mesh, which is filled; relative to the scene file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub surface: Option<PathBuf>,
    /// Edge length of the elements that a surface is filled with (m).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub element_size_m: Option<f64>,
    /// The same at the surface, where it is to be finer (m).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub surface_size_m: Option<f64>,
    /// Metres per unit of length of the file.
    pub unit_m: f64,
    /// What is held stationary: groups of the mesh, or all nodes in a shape.
    #[serde(serialize_with = "fixed")]
    pub fixed: Vec<Where>,
    /// The tissue of all elements outside of regions.
    pub tissue: TissueSpec,
    /// Parts of the body that differ in tissue, in order: later ones win.
    #[serde(rename = "region", skip_serializing_if = "Vec::is_empty")]
    pub regions: Vec<TissueRegionSpec>,
    /// The mesh itself: read from its file or filled from a surface, or given by a program.
    #[serde(skip)]
    pub volume: Option<Volume>,
}

fn fixed<S: Serializer>(places: &[Where], to: S) -> Result<S::Ok, S::Error> {
    place::serialize_all(places, to)
}

/// The tissue of all elements that are in no region.
#[derive(Clone, Copy, Debug, PartialEq, serde::Deserialize, serde::Serialize)]
#[serde(deny_unknown_fields)]
pub struct TissueSpec {
    /// Young's modulus E (Pa).
    pub young_modulus_pa: f64,
    /// Poisson's ratio nu, from 0 to below 0.5.
    pub poisson_ratio: f64,
    /// Density rho (kg/m^3).
    pub density_kg_m3: f64,
    /// Shear viscosity eta (Pa s).
    #[serde(default)]
    pub viscosity_pa_s: f64,
    /// True for pressure that is averaged over nodes: without it tissue that hardly gives way to pressure is too stiff by far.
    #[serde(default = "default_nodal_pressure")]
    pub nodal_pressure: bool,
}

fn default_nodal_pressure() -> bool {
    true
}

/// A part of a body of tetrahedra that differs in tissue: an element belongs to it if its centroid at rest lies in the shape, or
/// if it is in the group. What it leaves out stays as it was.
#[derive(Clone, Debug, PartialEq)]
pub struct TissueRegionSpec {
    /// Name of the region, for the reader.
    pub name: Option<String>,
    /// The shape or the group of the mesh that holds its elements.
    pub place: Where,
    /// Young's modulus E (Pa).
    pub young_modulus_pa: Option<f64>,
    /// Poisson's ratio nu, from 0 to below 0.5.
    pub poisson_ratio: Option<f64>,
    /// Density rho (kg/m^3).
    pub density_kg_m3: Option<f64>,
    /// Shear viscosity eta (Pa s).
    pub viscosity_pa_s: Option<f64>,
}

impl TissueRegionSpec {
    /// Its numbers with their keys.
    pub(in crate::scene) fn values(&self) -> [(&'static str, Option<f64>); 4] {
        [
            ("young_modulus_pa", self.young_modulus_pa),
            ("poisson_ratio", self.poisson_ratio),
            ("density_kg_m3", self.density_kg_m3),
            ("viscosity_pa_s", self.viscosity_pa_s),
        ]
    }

    /// The region as a body takes it.
    fn region(&self) -> TissueRegion {
        TissueRegion {
            place: self.place.clone(),
            young_modulus: self.young_modulus_pa,
            poisson_ratio: self.poisson_ratio,
            density: self.density_kg_m3,
            viscosity: self.viscosity_pa_s,
        }
    }
}

impl Serialize for TissueRegionSpec {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        let mut table = to.serialize_struct("TissueRegionSpec", 6)?;
        table.serialize_field("name", &self.name)?;
        match &self.place {
            Where::Group(name) => table.serialize_field("group", name)?,
            shape => table.serialize_field("shape", &Place(shape.clone()))?,
        }
        for (key, value) in self.values() {
            table.serialize_field(key, &value)?;
        }
        table.end()
    }
}

impl TetrahedraSpec {
    /// Elements, tissue, and what was changed of the mesh, in words.
    pub(crate) fn in_words(&self) -> String {
        let TissueSpec { young_modulus_pa, poisson_ratio, density_kg_m3, viscosity_pa_s, nodal_pressure } = self.tissue;
        let elements = self.volume.as_ref().map_or(0, |volume| volume.mesh().tetrahedra.len());
        let filled = if self.volume.as_ref().is_some_and(Volume::is_filled) { " that fill a surface" } else { "" };
        let pressure = if nodal_pressure { ", nodal pressure" } else { "" };
        let changes = self.volume.as_ref().map(Volume::changes).filter(|changes| !changes.is_empty());
        let regions = match self.regions.len() {
            0 => String::new(),
            1 => ", 1 region".to_owned(),
            count => format!(", {count} regions"),
        };
        format!(
            "{elements} tetrahedra{filled}: E {young_modulus_pa} Pa, nu {poisson_ratio}, {density_kg_m3} kg/m^3, \
             {viscosity_pa_s} Pa s{pressure}{regions}{}",
            changes.map_or(String::new(), |changes| format!("; {changes}"))
        )
    }

    /// Sizes of the elements that its surface is filled with.
    pub(in crate::scene) fn sizes(&self) -> Sizes {
        Sizes { element_m: self.element_size_m.unwrap_or_default(), surface_m: self.surface_size_m }
    }

    /// The same body with its surface filled anew, with elements that are `times` smaller; `None` if it fills no surface.
    ///
    /// # Errors
    /// If there is no filling of that size.
    pub fn refined(&self, times: f64) -> Result<Option<Self>, Error> {
        let smaller = |size_m: Option<f64>| size_m.map(|size_m| size_m / times);
        let (element_size_m, surface_size_m) = (smaller(self.element_size_m), smaller(self.surface_size_m));
        let mut finer = Self { element_size_m, surface_size_m, ..self.clone() };
        let Some(volume) = self.volume.as_ref().and_then(|volume| volume.refilled(finer.sizes())) else {
            return Ok(None);
        };
        finer.volume = Some(volume?);
        Ok(Some(finer))
    }

    /// Makes the body that this describes.
    ///
    /// # Errors
    /// If its mesh was not read, one of its numbers is impossible, or a region or what is held is nowhere.
    pub fn build(&self) -> Result<Tetrahedra, Error> {
        let Some(volume) = &self.volume else {
            let message = "was not read, use Scene::load, or set body.volume to a Volume";
            return Err(Error::scene("body.mesh", message));
        };
        let tissue = Tissue {
            young_modulus: self.tissue.young_modulus_pa,
            poisson_ratio: self.tissue.poisson_ratio,
            density: self.tissue.density_kg_m3,
            viscosity: self.tissue.viscosity_pa_s,
        };
        let builder =
            Tetrahedra::builder(volume.mesh().clone()).tissue(tissue).nodal_pressure(self.tissue.nodal_pressure);
        let builder = self.fixed.iter().fold(builder, |builder, place| builder.fix(place.clone()));
        let builder = self.regions.iter().fold(builder, |builder, spec| builder.region(spec.region()));
        // `fixed[0]: group` as a field of a scene.
        builder.build().map_err(|error| match error.place().split(':').next() {
            None | Some("") => Error::scene("body", error.message()),
            Some(place) => Error::scene(&format!("body.{place}"), error.message()),
        })
    }
}
