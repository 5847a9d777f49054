//! Organs: of the size that is told, held where they lie, with a lump inside; valid at any resolution.

#[path = "support/mod.rs"]
mod support;

use palpate_mesh::Sizes;
use palpate_mesh::organs::{beam, liver, prostate};
use palpate_model::Vec3;
use palpate_model::mesh::{Group, TetrahedralMesh};
use support::{angles, outer_faces, volume};

fn part(mesh: &TetrahedralMesh, group: &Group) -> f64 {
    let tetrahedra = group.tetrahedra.iter().map(|&element| mesh.tetrahedra[element as usize]).collect();
    volume(&TetrahedralMesh { points: mesh.points.clone(), tetrahedra, groups: Vec::new() })
}

fn check_organ(mesh: &TetrahedralMesh, extent: [f64; 3]) {
    let [smallest, largest] = angles(mesh);
    assert!(smallest > 10.7 && largest < 164.8, "{smallest} to {largest} degrees");
    assert_eq!(mesh.parts().len(), 1);
    let low = mesh.points.iter().fold(mesh.points[0], |low, x| low.inf(x));
    let high = mesh.points.iter().fold(mesh.points[0], |high, x| high.sup(x));
    let error = ((high - low) - Vec3::from(extent)).abs();
    assert!(error.max() < 0.002, "{}", high - low);
    // What is held is the underside, and all of it: a part of the surface to count on.
    let attached = mesh.group("attached").unwrap();
    let outer = outer_faces(mesh);
    let held = |face: &&[u32; 3]| face.iter().all(|node| attached.nodes.binary_search(node).is_ok());
    let area = |face: &[u32; 3]| {
        let [a, b, c] = face.map(|node| mesh.points[node as usize]);
        (b - a).cross(&(c - a)).norm() / 2.0
    };
    let (below, all): (f64, f64) = (outer.iter().filter(held).map(area).sum(), outer.iter().map(area).sum());
    assert!((0.15..0.5).contains(&(below / all)), "{}", below / all);
    assert!(
        attached.tetrahedra.is_empty() && attached.nodes.iter().all(|&node| mesh.points[node as usize].z.abs() < 1e-5)
    );
}

#[test]
fn a_liver_is_valid_at_any_size_and_has_a_tumour_of_the_volume_told() {
    for size in [0.009, 0.006, 0.004] {
        let mesh = liver(Sizes::uniform(size)).unwrap();
        check_organ(&mesh, [0.144, 0.077, 0.040]);
        let tumour = part(&mesh, mesh.group("tumour").unwrap());
        let exact = 4.0 / 3.0 * std::f64::consts::PI * 0.009 * 0.009 * 0.007;
        assert!((tumour / exact - 1.0).abs() < 0.15, "{size}: {}", tumour / exact);
    }
    let count = liver(Sizes::uniform(0.004)).unwrap().tetrahedra.len();
    assert!((20_000..40_000).contains(&count), "{count}");
}

#[test]
fn a_prostate_has_a_capsule_all_round_and_a_nodule_below_it() {
    for size in [0.004, 0.002] {
        let mesh = prostate(Sizes::uniform(size)).unwrap();
        check_organ(&mesh, [0.049, 0.038, 0.024]);
        let [capsule, nodule] = ["capsule", "nodule"].map(|name| mesh.group(name).unwrap());
        assert!(nodule.tetrahedra.iter().all(|element| capsule.tetrahedra.binary_search(element).is_err()));
        let outer: Vec<u32> = outer_faces(&mesh).into_iter().flatten().collect();
        assert!(outer.iter().all(|node| capsule.nodes.binary_search(node).is_ok()));
        assert!(part(&mesh, nodule) > 0.5e-6, "{}", part(&mesh, nodule));
    }
}

#[test]
fn a_beam_fills_its_block_without_gaps_and_prefers_no_direction() {
    let mesh = beam([0.1, 0.02, 0.03], 0.01).unwrap();
    assert_eq!((mesh.points.len(), mesh.tetrahedra.len()), (11 * 3 * 4, 10 * 2 * 3 * 6));
    assert!((volume(&mesh) - 6e-5).abs() < 1e-18);
    assert!(angles(&mesh)[0] > 44.9);
    // The faces of one element are those of the block: cubes that cut their common face differently would add to them.
    assert_eq!(outer_faces(&mesh).len(), 2 * 2 * (10 * 2 + 10 * 3 + 2 * 3));
    assert!(mesh.group("attached").unwrap().nodes.iter().all(|&node| mesh.points[node as usize].x == 0.0));
    assert!(mesh.group("tip").unwrap().nodes.iter().all(|&node| mesh.points[node as usize].x == 0.1));
    assert_eq!(mesh.group("tip").unwrap().nodes.len(), 3 * 4);
    for (extent, size) in [([0.1, 0.0, 0.1], 0.01), ([0.1; 3], 0.0), ([0.1; 3], f64::NAN), ([0.1; 3], 1e-6)] {
        assert!(beam(extent, size).is_err());
    }
}

#[test]
fn the_meshes_that_are_kept_for_scenes_are_whole() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/meshes");
    for (name, groups) in [
        ("liver", vec!["attached", "tumour"]),
        ("prostate", vec!["attached", "capsule", "nodule"]),
        ("cantilever", vec!["attached", "tip"]),
    ] {
        let mesh = palpate_mesh::read_volume_file(&folder.join(format!("{name}.msh"))).unwrap().mesh;
        assert!(groups.iter().all(|group| mesh.group(group).is_some_and(|group| group.nodes.len() > 20)), "{name}");
        assert_eq!((mesh.parts().len(), mesh.groups.len()), (1, groups.len()));
        assert!((1_500..4_500).contains(&mesh.tetrahedra.len()), "{name}: {}", mesh.tetrahedra.len());
        let [smallest, largest] = angles(&mesh);
        assert!(smallest > 10.7 && largest < 164.8, "{smallest} to {largest} degrees");
    }
}
