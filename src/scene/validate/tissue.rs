//! What can be wrong with a body of tetrahedra before its mesh is known.

use super::super::{TetrahedraSpec, TissueSpec};
use super::check::{not_negative, positive};
use crate::error::Error;

/// Largest element (m): that of the largest body.
const LARGEST_ELEMENT_M: f64 = 10.0;

/// What can be wrong with it.
pub(super) fn validate(spec: &TetrahedraSpec) -> Result<(), Error> {
    source(spec)?;
    positive("body.unit_m", spec.unit_m)?;
    if spec.fixed.is_empty() {
        let message = "names nothing, and a body that nothing holds falls away: name a group of the mesh or a shape";
        return Err(Error::scene("body.fixed", message));
    }
    let TissueSpec { young_modulus_pa, poisson_ratio, density_kg_m3, viscosity_pa_s, .. } = spec.tissue;
    value("body.tissue.young_modulus_pa", young_modulus_pa)?;
    value("body.tissue.poisson_ratio", poisson_ratio)?;
    value("body.tissue.density_kg_m3", density_kg_m3)?;
    value("body.tissue.viscosity_pa_s", viscosity_pa_s)?;
    for (index, region) in spec.regions.iter().enumerate() {
        let field = format!("body.region[{index}]");
        let given = || region.values().into_iter().filter_map(|(key, value)| Some((key, value?)));
        if given().next().is_none() {
            let keys = region.values().map(|(key, _)| key).join(", ");
            return Err(Error::scene(&field, format!("differs in nothing, give one of {keys}")));
        }
        given().try_for_each(|(key, number)| value(&format!("{field}.{key}"), number))?;
    }
    Ok(())
}

/// A file of one kind, with the sizes that belong to it.
fn source(spec: &TetrahedraSpec) -> Result<(), Error> {
    if spec.mesh.is_some() && spec.surface.is_some() {
        let message = "is given beside body.mesh, a body has one of them: leave one out";
        return Err(Error::scene("body.surface", message));
    }
    let sizes = [("body.element_size_m", spec.element_size_m), ("body.surface_size_m", spec.surface_size_m)];
    for (field, size_m) in sizes {
        let Some(size_m) = size_m else { continue };
        if spec.mesh.is_some() {
            return Err(Error::scene(
                field,
                "belongs to surface, the elements of a mesh are what they are: leave it out",
            ));
        }
        positive(field, size_m)?;
        if size_m > LARGEST_ELEMENT_M {
            return Err(Error::scene(field, format!("is {size_m}, must be at most {LARGEST_ELEMENT_M} m")));
        }
    }
    if spec.surface.is_some() && spec.element_size_m.is_none() {
        let message = "is missing: a surface is filled with elements of a size in metres, such as 0.004";
        return Err(Error::scene("body.element_size_m", message));
    }
    if let (Some(element_m), Some(surface_m)) = (spec.element_size_m, spec.surface_size_m)
        && surface_m > element_m
    {
        let message = format!("is {surface_m}, must be at most body.element_size_m, {element_m}");
        return Err(Error::scene("body.surface_size_m", message));
    }
    Ok(())
}

/// A scene file must name its mesh itself; a program may give one.
pub(in crate::scene) fn mesh(spec: &TetrahedraSpec) -> Result<(), Error> {
    if spec.mesh.is_some() || spec.surface.is_some() {
        return Ok(());
    }
    let message = "has no mesh, give mesh (a volume: .msh, .vtk, .vtu), or surface (.stl, .obj) with element_size_m";
    Err(Error::scene("body", message))
}

/// A number of a tissue, by the end of its `field`.
fn value(field: &str, value: f64) -> Result<(), Error> {
    let must = match field.rsplit('.').next() {
        Some("poisson_ratio") if !(0.0..0.5).contains(&value) => {
            "at least 0 and below 0.5, where nothing could be compressed: nearly so is 0.49"
        }
        Some("young_modulus_pa") if !is_positive(value) => "a finite number of Pa above 0",
        Some("density_kg_m3") if !is_positive(value) => "a finite number of kg/m^3 above 0",
        Some("viscosity_pa_s") => return not_negative(field, value),
        _ => return Ok(()),
    };
    Err(Error::scene(field, format!("is {value}, must be {must}")))
}

fn is_positive(value: f64) -> bool {
    value.is_finite() && value > 0.0
}
