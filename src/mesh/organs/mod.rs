//! Parametric organs at any resolution, with the groups a scene needs.

mod beam;
mod shape;

use palpate_model::mesh::{Group, TetrahedralMesh};

use crate::{MeshError, Sizes, fill_shape};
pub use beam::beam;
use shape::Ellipsoid;
pub use shape::Organ;

/// The shape of [`liver`].
pub fn liver_shape() -> Organ {
    const LOBES: [Ellipsoid; 4] = [
        // The right lobe with its dome, the left one, the bridge between them and the lobe at the back.
        Ellipsoid { centre: [-0.030, 0.000, 0.008], radii: [0.040, 0.037, 0.032] },
        Ellipsoid { centre: [0.038, 0.010, 0.006], radii: [0.036, 0.024, 0.017] },
        Ellipsoid { centre: [0.005, 0.010, 0.008], radii: [0.025, 0.022, 0.022] },
        Ellipsoid { centre: [-0.005, 0.027, 0.004], radii: [0.018, 0.013, 0.014] },
    ];
    let tumour = Ellipsoid { centre: [-0.030, -0.004, 0.027], radii: [0.009, 0.009, 0.007] };
    Organ { blend_m: 0.010, lobes: &LOBES, lump: tumour }
}

/// The shape of [`prostate`].
pub fn prostate_shape() -> Organ {
    const LOBES: [Ellipsoid; 3] = [
        // The two lateral lobes, with a furrow between them on top, and what lies in front of them.
        Ellipsoid { centre: [-0.0105, 0.0, 0.009], radii: [0.0140, 0.0190, 0.0150] },
        Ellipsoid { centre: [0.0105, 0.0, 0.009], radii: [0.0140, 0.0190, 0.0150] },
        Ellipsoid { centre: [0.0, 0.002, 0.004], radii: [0.0170, 0.0170, 0.0120] },
    ];
    let nodule = Ellipsoid { centre: [0.0115, -0.002, 0.0165], radii: [0.0055, 0.0060, 0.0040] };
    Organ { blend_m: 0.004, lobes: &LOBES, lump: nodule }
}

/// A small liver, about 144 x 77 x 40 mm: two lobes that lie on the plane z = 0. Groups: `attached`, the nodes of its underside; `tumour`, the
/// elements of an ellipsoid of 18 x 18 x 14 mm, 6 mm below the dome of the right lobe.
///
/// With elements of 4 mm there are some 38,000.
///
/// # Errors
/// As of [`fill_shape`].
pub fn liver(sizes: Sizes) -> Result<TetrahedralMesh, MeshError> {
    let shape = liver_shape();
    let mut mesh = fill_shape(&shape, sizes, &mut |_| {})?;
    mesh.groups.push(attached(&mesh, sizes));
    let tumour = elements_within(&mesh, &shape.lump);
    mesh.groups.extend(group_of_elements(&mesh, "tumour", tumour));
    Ok(mesh)
}

/// A prostate, about 49 x 38 x 24 mm, its back up: two lateral lobes with a furrow between them, on the plane z = 0. Groups: `attached`, the
/// nodes of its underside; `capsule`, the elements that touch the surface; `nodule`, those of an ellipsoid of 11 x 12 x 8 mm in one lobe,
/// but for the capsule's.
///
/// With elements of 2 mm there are some 35,000.
///
/// # Errors
/// As of [`fill_shape`].
pub fn prostate(sizes: Sizes) -> Result<TetrahedralMesh, MeshError> {
    let shape = prostate_shape();
    let mut mesh = fill_shape(&shape, sizes, &mut |_| {})?;
    mesh.groups.push(attached(&mesh, sizes));
    let mut outer = vec![false; mesh.points.len()];
    mesh.surface_triangles().into_iter().flatten().for_each(|node| outer[node as usize] = true);
    let touches = |&element: &u32| mesh.tetrahedra[element as usize].iter().any(|&node| outer[node as usize]);
    let capsule: Vec<u32> = (0..mesh.tetrahedra.len() as u32).filter(touches).collect();
    let mut nodule = elements_within(&mesh, &shape.lump);
    nodule.retain(|element| capsule.binary_search(element).is_err());
    let groups = [("capsule", capsule), ("nodule", nodule)];
    let groups: Vec<Group> =
        groups.into_iter().filter_map(|(name, elements)| group_of_elements(&mesh, name, elements)).collect();
    mesh.groups.extend(groups);
    Ok(mesh)
}

/// The nodes of the faces on the plane z = 0. They are cut points or were drawn to one, so they lie on it to the last digits.
fn attached(mesh: &TetrahedralMesh, sizes: Sizes) -> Group {
    let on_plane = |node: &u32| mesh.points[*node as usize].z < 1e-3 * sizes.element_m;
    let faces = mesh.surface_triangles().into_iter().filter(|face| face.iter().all(on_plane));
    let mut nodes: Vec<u32> = faces.flatten().collect();
    nodes.sort_unstable();
    nodes.dedup();
    Group { name: "attached".into(), nodes, tetrahedra: Vec::new() }
}

/// The elements with their centroid in `lump`.
fn elements_within(mesh: &TetrahedralMesh, lump: &Ellipsoid) -> Vec<u32> {
    (0..mesh.tetrahedra.len() as u32).filter(|&element| lump.holds(&mesh.centroid(element))).collect()
}

/// The group of these elements, unless there are none.
fn group_of_elements(mesh: &TetrahedralMesh, name: &str, tetrahedra: Vec<u32>) -> Option<Group> {
    let mut nodes: Vec<u32> = tetrahedra.iter().flat_map(|&element| mesh.tetrahedra[element as usize]).collect();
    nodes.sort_unstable();
    nodes.dedup();
    (!tetrahedra.is_empty()).then(|| Group { name: name.into(), nodes, tetrahedra })
}
